//! A force that is a function of time and state.

use crate::element_inputs;
use crate::elements::state_function::StateFunction;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// A force or torque on one coordinate that is a [`StateFunction`] of time and state.
///
/// Its coordinates are the driven one, then the observed ones. The force acts between the driven coordinate and the ground.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct FeedbackForce<L>(pub L);

element_inputs!(FeedbackForceInputs {
    coordinate: coordinate("coordinate that it acts on"),
    generalized_force: state_function("N or N·m", "as a function of time and motion, such as `-k*cart.x - c*cart.vx`"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "feedback",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new(
            "generalized_force",
            "N or N·m",
            "force or torque on the coordinate, positive towards larger values",
        ),
        Measure::new("power", "W", "power, positive if it does work on the mechanism"),
    ],
    about: "a force or torque on a coordinate that depends on the motion: a controller, a drag, a magnet",
    law: "generalized_force acts on the coordinate towards larger values; without a counterpart elsewhere",
    symbol: Symbol::None,
};

impl<L: StateFunction> FeedbackForce<L> {
    fn force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.generalized_force(FeedbackForceInputs(x.p).generalized_force(), x.t, &x.q[1..], &x.v[1..])
    }
}

impl<L: StateFunction> Element for FeedbackForce<L> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] = -self.force(x);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.force(x);
        out[1] = out[0] * x.v[0];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a force or torque to a coordinate, as a function of time and of the motion of `observed`.
    pub fn feedback_force(
        &mut self,
        name: &str,
        driven: Coordinate,
        observed: &[Coordinate],
        law: impl StateFunction,
        parameters: &[S],
    ) -> ElementIndex {
        self.add(name, FeedbackForce(law), &[&[driven], observed].concat(), parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};

    /// A proportional-derivative controller with a reference that moves at unit speed.
    struct Tracking;

    impl StateFunction for Tracking {
        fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
            p[0] * (t - q[0]) + p[1] * (-v[0] + 1.0)
        }
    }

    #[test]
    fn a_controller_pushes_towards_its_reference() {
        // 10 (2 − 1.5) + 4 (1 − 0.25) = 8 N, at 0.25 m/s.
        let x = ElementState {
            t: 2.0,
            p: &[10.0, 4.0],
            q: &[1.5, 1.5],
            v: &[0.25, 0.25],
            a: &[0.0; 2],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&FeedbackForce(Tracking), &x).0, &[-8.0, 0.0]);
        close(&measured(&FeedbackForce(Tracking), &x), &[8.0, 2.0]);
    }
}
