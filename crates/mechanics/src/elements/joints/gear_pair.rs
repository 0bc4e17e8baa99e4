//! A pair of gears.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// A pair of gears: r₁ (θ₁ − θ_c) + r₂ (θ₂ − θ_c) = u₀, for external teeth; r₂ < 0 for a ring gear.
///
/// Coordinates θ₁, θ₂ and θ_c of the carrier of both axes; parameters r₁, r₂, u₀ (m). λ is the tooth force in N.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.4.
#[derive(Clone, Copy, Debug)]
pub struct GearPair;

impl Element for GearPair {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (one, two) = (x.p[0], x.p[1]);
        constraint[0] = one * (x.q[0] - x.q[2]) + two * (x.q[1] - x.q[2]) - x.p[2];
        (dynamics[0], dynamics[1], dynamics[2]) = (one * x.l[0], two * x.l[0], -(one + two) * x.l[0]);
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tooth_force"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (p[0] == 0.0 || p[1] == 0.0).then(|| format!("its radii are {} m and {} m", p[0], p[1]))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets two rotations roll on each other: radii r₁ and r₂ (m), and the offset r₁ θ₁ + r₂ θ₂ against the carrier.
    pub fn gear_pair(
        &mut self,
        name: &str,
        [one, two]: [Coordinate; 2],
        carrier: Coordinate,
        [r1, r2, offset]: [S; 3],
    ) -> ElementIndex {
        self.add(name, GearPair, &[one, two, carrier], &[r1, r2, offset])
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
