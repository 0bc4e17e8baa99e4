//! A rigid connection of two bodies.

use crate::elements::joints::revolute::Revolute;
use crate::elements::line::ends;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A fixed joint: a [`Revolute`] joint that also keeps the relative rotation of its bodies.
///
/// $$ \Phi = (\mathbf r_A - \mathbf r_B,\ \theta_A - \theta_B + \beta) = 0 $$
///
/// with the angle β of B relative to A. λ is the force of A on B (N) and the torque (N·m).
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.3.
#[derive(Clone, Copy, Debug)]
pub struct FixedJoint;

as_object!(FixedJoint);

element_inputs!(FixedJointInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    angle: optional("0", "rad", 0.1, "rotation of b relative to a"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "fixed",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[
        Measure::new("force_x", "N", "force of a on b, along x of the plane"),
        Measure::new("force_y", "N", "force of a on b, along y of the plane"),
        Measure::new("moment", "N·m", "torque of a on b, positive counter-clockwise"),
    ],
    about: "a rigid connection of two bodies",
    law: "r_a = r_b and θ_b − θ_a = angle",
    symbol: Symbol::Connection,
};

impl Element for FixedJoint {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        Element::residual(&Revolute, x, dynamics, constraint);
        constraint[2] = x.q[2] - x.q[5] + FixedJointInputs(x.p).angle();
        dynamics[2] += x.l[2];
        dynamics[5] -= x.l[2];
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        3
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 3, 4]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&x.l[..3]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins the bodies of `a` and `b` at these points, with the second body at the angle `turn` (rad) from the first.
    pub fn fixed_joint(&mut self, name: &str, a: Marker<S>, b: Marker<S>, turn: S) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), FixedJoint::object(), &coordinates, &[&p[..], &[turn]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};

    #[test]
    fn a_revolute_joint_with_a_torque() {
        let x = at(&[0.5, 0.0, -0.5, 0.0, 0.3], &[0.0, 0.0, 0.0, 1.1, 0.2, 0.0], &[3.0, 4.0, 6.0]);
        let (dynamics, constraint) = rows(&FixedJoint, &x);
        close(&constraint, &[-0.1, -0.2, 0.3]);
        close(&dynamics, &[3.0, 4.0, 8.0, -3.0, -4.0, -4.0]);
        close(&measured(&FixedJoint, &x), &[3.0, 4.0, 6.0]);
    }
}
