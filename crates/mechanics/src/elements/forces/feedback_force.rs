//! An effort that is a function of time and state.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// An effort as a function of time and of the motion of some coordinates, written once over the scalar type: a
/// controller, a drag, a magnet.
///
/// Branch on real parts only.
pub trait StateFunction: Send + Sync + 'static {
    /// The effort (N or N·m) at time `t` (s) for the parameters `p`, with positions `q` and velocities `v` of the
    /// coordinates that it observes.
    fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T;
}

/// An effort on one coordinate that follows a [`StateFunction`] of time and state.
///
/// Coordinates: the one that is driven, then those that the law observes; parameters those of the law. The effort acts
/// between the driven coordinate and the ground.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct FeedbackForce<L>(pub L);

impl<L: StateFunction> FeedbackForce<L> {
    fn generalized_force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.generalized_force(x.p, x.t, &x.q[1..], &x.v[1..])
    }
}

impl<L: StateFunction> Element for FeedbackForce<L> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        dynamics[0] = -self.generalized_force(x);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["generalized_force", "power"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.generalized_force(x);
        out[1] = out[0] * x.v[0];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Drives a coordinate by an effort that is a function of time and of the motion of `observed`.
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

    /// A proportional and differential controller with a reference that moves at unit speed.
    struct Follow;

    impl StateFunction for Follow {
        fn generalized_force<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
            p[0] * (t - q[0]) + p[1] * (-v[0] + 1.0)
        }
    }

    #[test]
    fn a_controller_pushes_towards_its_reference() {
        // 10 (2 − 1.5) + 4 (1 − 0.25) = 8 N, at 0.25 m/s.
        let x = ElementState { t: 2.0, p: &[10.0, 4.0], q: &[1.5, 1.5], v: &[0.25, 0.25], a: &[0.0; 2], l: &[] };
        close(&rows(&FeedbackForce(Follow), &x).0, &[-8.0, 0.0]);
        close(&measured(&FeedbackForce(Follow), &x), &[8.0, 2.0]);
    }
}
