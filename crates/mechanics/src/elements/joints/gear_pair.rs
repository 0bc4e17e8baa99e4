//! A pair of gears.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A pair of gears: Φ = r_A (θ_A − θ_C) + r_B (θ_B − θ_C) − u₀, with the carrier C of both axes.
///
/// Both radii are positive for external teeth; r_B is negative for a ring gear. λ is the tooth force in N.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.4.
#[derive(Clone, Copy, Debug)]
pub struct GearPair;

as_object!(GearPair);

element_inputs!(GearPairInputs {
    a: coordinate("rotation of the first wheel"),
    b: coordinate("rotation of the second wheel"),
    carrier: coordinate_or("ground.theta", "rotation of the carrier"),
    radius_a: required("m", 0.5, "pitch radius of the first wheel"),
    radius_b: required("m", 0.6, "pitch radius of the second wheel; negative for an internal gear"),
    offset: optional("0", "m", 0.02, "r_a θ_a + r_b θ_b relative to the carrier"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "gears",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[Measure::new(
        "tooth_force",
        "N",
        "tangential force at the pitch radius, positive against both rotations",
    )],
    about: "a pair of gears: two wheels roll on each other",
    law: "radius_a·(θ_a − θ_c) + radius_b·(θ_b − θ_c) = offset with the carrier c; the torques are −radius_a·tooth_force on a and −radius_b·tooth_force on b",
    symbol: Symbol::Gears,
};

impl Element for GearPair {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let p = GearPairInputs(x.p);
        let (one, two) = (p.radius_a(), p.radius_b());
        constraint[0] = one * (x.q[0] - x.q[2]) + two * (x.q[1] - x.q[2]) - p.offset();
        (dynamics[0], dynamics[1], dynamics[2]) = (one * x.l[0], two * x.l[0], -(one + two) * x.l[0]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let (one, two) = (GearPairInputs(p).radius_a(), GearPairInputs(p).radius_b());
        (one == 0.0 || two == 0.0).then(|| format!("its radii are {one} m and {two} m"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets two wheels roll on each other: radii r_A and r_B (m), and the offset r_A θ_A + r_B θ_B relative to the carrier.
    pub fn gear_pair(
        &mut self,
        name: &str,
        [a, b]: [Coordinate; 2],
        carrier: Coordinate,
        parameters: [S; 3],
    ) -> ElementIndex {
        self.add_object(name.into(), GearPair::object(), &[a, b, carrier], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};

    #[test]
    fn a_large_wheel_turns_back_half_as_far() {
        let p = [0.1, 0.2, 0.0];
        let (dynamics, constraint) = rows(&GearPair, &at(&p, &[0.8, -0.4, 0.0], &[30.0]));
        close(&constraint, &[0.0]);
        close(&dynamics, &[3.0, 6.0, -9.0]);
        // With the carrier, everything turns as one.
        close(&rows(&GearPair, &at(&p, &[0.3, 0.3, 0.3], &[0.0])).1, &[0.0]);
        assert!(GearPair.validate_parameters(&[0.0, 0.2, 0.0]).is_some());
    }
}
