//! Two bodies joined rigidly.

use crate::elements::element::{Element, ElementState};
use crate::elements::joints::revolute::Revolute;
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// A weld: a [`Revolute`] whose bodies also keep their relative rotation.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and of B (m), θ_B − θ_A (rad). λ is the force
/// of A on B (N) and the couple (N·m).
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.3.
#[derive(Clone, Copy, Debug)]
pub struct FixedJoint;

impl Element for FixedJoint {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        Element::residual(&Revolute, x, dynamics, constraint);
        constraint[2] = x.q[2] - x.q[5] + x.p[4];
        dynamics[2] += x.l[2];
        dynamics[5] -= x.l[2];
    }

    fn num_constraints(&self) -> usize {
        3
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 3, 4]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force_x", "force_y", "moment"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&x.l[..3]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins the bodies of `a` and `b` at these points, the second turned against the first by `turn` (rad).
    pub fn fixed_joint(&mut self, name: &str, a: Marker<S>, b: Marker<S>, turn: S) -> ElementIndex {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        self.add(name, FixedJoint, &coordinates, &[a.x, a.y, b.x, b.y, turn])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};

    #[test]
    fn a_pin_with_a_couple() {
        let x = at(&[0.5, 0.0, -0.5, 0.0, 0.3], &[0.0, 0.0, 0.0, 1.1, 0.2, 0.0], &[3.0, 4.0, 6.0]);
        let (dynamics, constraint) = rows(&FixedJoint, &x);
        close(&constraint, &[-0.1, -0.2, 0.3]);
        close(&dynamics, &[3.0, 4.0, 8.0, -3.0, -4.0, -4.0]);
        close(&measured(&FixedJoint, &x), &[3.0, 4.0, 6.0]);
    }
}
