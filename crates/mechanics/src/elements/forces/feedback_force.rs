//! An effort that is a function of time and state.

use crate::elements::element::{Element, Local};
use crate::mechanism::{Coordinate, Mechanism, Part};
use autodiff::Scalar;

/// An effort as a function of time and of the motion of some coordinates, written once over the scalar type: a
/// controller, a drag, a magnet.
///
/// Branch on real parts only.
pub trait Law: Send + Sync + 'static {
    /// The effort (N or N·m) at time `t` (s) for the parameters `p`, with positions `q` and velocities `v` of the
    /// coordinates that it observes.
    fn effort<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T;
}

/// An effort on one coordinate that follows a [`Law`] of time and state.
///
/// Coordinates: the one that is driven, then those that the law observes; parameters those of the law. The effort acts
/// between the driven coordinate and the ground.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct StateLoad<L>(pub L);

impl<L: Law> StateLoad<L> {
    fn effort<T: Scalar>(&self, x: &Local<'_, T>) -> T {
        self.0.effort(x.p, x.t, &x.q[1..], &x.v[1..])
    }
}

impl<L: Law> Element for StateLoad<L> {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        balance[0] = -self.effort(x);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["effort", "power"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = self.effort(x);
        out[1] = out[0] * x.v[0];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Drives a coordinate by an effort that is a function of time and of the motion of `observed`.
    pub fn state_load(
        &mut self,
        name: &str,
        driven: Coordinate,
        observed: &[Coordinate],
        law: impl Law,
        parameters: &[S],
    ) -> Part {
        self.add(name, StateLoad(law), &[&[driven], observed].concat(), parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};

    /// A proportional and differential controller with a reference that moves at unit speed.
    struct Follow;

    impl Law for Follow {
        fn effort<T: Scalar>(&self, p: &[T], t: T, q: &[T], v: &[T]) -> T {
            p[0] * (t - q[0]) + p[1] * (-v[0] + 1.0)
        }
    }

    #[test]
    fn a_controller_pushes_towards_its_reference() {
        // 10 (2 − 1.5) + 4 (1 − 0.25) = 8 N, at 0.25 m/s.
        let x = Local { t: 2.0, p: &[10.0, 4.0], q: &[1.5, 1.5], v: &[0.25, 0.25], a: &[0.0; 2], l: &[] };
        close(&rows(&StateLoad(Follow), &x).0, &[-8.0, 0.0]);
        close(&measured(&StateLoad(Follow), &x), &[8.0, 2.0]);
    }
}
