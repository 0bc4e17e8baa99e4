//! A spring and damper between two coordinates.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame::write_force_pair;
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A spring and damper on the difference u = q_B − q_A − u₀ of two coordinates: k u + k₃ u³ + c u̇.
///
/// On two rotations it is a torsion spring.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateSpring;

as_object!(CoordinateSpring);

element_inputs!(CoordinateSpringInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    stiffness: required("N/m or N·m/rad", 15.0, "stiffness"),
    damping: optional("0", "N·s/m or N·m·s/rad", 0.5, "damping"),
    unloaded: optional("0", "m or rad", 0.1, "b − a without force"),
    cubic: optional("0", "N/m³ or N·m/rad³", 3.0, "cubic stiffness"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "coordinate-spring",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("generalized_force", "N or N·m", "force or torque, positive if it acts towards smaller b − a"),
        Measure::new("elongation", "m or rad", "elongation b − a − unloaded"),
        Measure::new("rate", "m/s or rad/s", "rate of b − a"),
    ],
    about: "a spring and damper on b − a",
    law: "generalized_force = stiffness·u + cubic·u³ + damping·u̇ with u = b − a − unloaded",
    symbol: Symbol::Spring,
};

impl CoordinateSpring {
    fn elongation<T: Scalar>(x: &ElementState<'_, T>) -> T {
        x.q[1] - x.q[0] - CoordinateSpringInputs(x.p).unloaded()
    }

    fn force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        let (p, u) = (CoordinateSpringInputs(x.p), Self::elongation(x));
        p.stiffness() * u + p.cubic() * u.powi(3) + p.damping() * (x.v[1] - x.v[0])
    }
}

impl Element for CoordinateSpring {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        write_force_pair(dynamics, -Self::force(x));
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (Self::force(x), Self::elongation(x), x.v[1] - x.v[0]);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let (p, u) = (CoordinateSpringInputs(x.p), Self::elongation(x));
        Energy { kinetic: T::zero(), potential: p.stiffness() * u * u * 0.5 + p.cubic() * u.powi(4) * 0.25 }
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a spring and damper on `b` − `a`: stiffness, damping, unloaded difference, cubic stiffness.
    pub fn coordinate_spring(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 4]) -> ElementIndex {
        self.add_object(name.into(), CoordinateSpring::object(), &[a, b], &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};

    #[test]
    fn stretched_by_two_and_lengthening_at_three() {
        // u = 3 − 0.5 − 0.5 = 2: 10·2 + 1·8 + 4·3 = 40; ½·10·4 + ¼·1·16 = 24.
        let x = moving(&[10.0, 4.0, 0.5, 1.0], &[0.5, 3.0], &[1.0, 4.0], &[]);
        close(&rows(&CoordinateSpring, &x).0, &[-40.0, 40.0]);
        close(&measured(&CoordinateSpring, &x), &[40.0, 2.0, 3.0]);
        close(&energies(&CoordinateSpring, &x), &[0.0, 24.0]);
    }
}
