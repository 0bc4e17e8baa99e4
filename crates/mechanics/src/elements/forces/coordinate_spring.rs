//! A spring and damper between two coordinates.

use crate::elements::element::{Element, ElementState, Energy};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// A spring and damper on the difference u = q_B − q_A − u₀ of two coordinates: k u + k₃ u³ + c u̇.
///
/// On two rotations it is a torsion spring. Coordinates q_A, q_B; parameters k, c, u₀, k₃.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateSpring;

impl CoordinateSpring {
    fn generalized_force<T: Scalar>(x: &ElementState<'_, T>) -> T {
        let u = x.q[1] - x.q[0] - x.p[2];
        x.p[0] * u + x.p[3] * u.powi(3) + x.p[1] * (x.v[1] - x.v[0])
    }
}

impl Element for CoordinateSpring {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        let effort = Self::generalized_force(x);
        (dynamics[0], dynamics[1]) = (-effort, effort);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["generalized_force", "elongation", "rate"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (Self::generalized_force(x), x.q[1] - x.q[0] - x.p[2], x.v[1] - x.v[0]);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let u = x.q[1] - x.q[0] - x.p[2];
        Energy { kinetic: T::zero(), potential: x.p[0] * u * u * 0.5 + x.p[3] * u.powi(4) * 0.25 }
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Puts a spring and damper on `b` − `a`: stiffness, damping, unloaded difference, cubic stiffness.
    pub fn coordinate_spring(&mut self, name: &str, a: Coordinate, b: Coordinate, parameters: [S; 4]) -> ElementIndex {
        self.add(name, CoordinateSpring, &[a, b], &parameters)
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
