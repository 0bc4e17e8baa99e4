//! A force at a point that is a function of time and state.

use crate::element_inputs;
use crate::elements::state_function::StateFunction;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{Coordinate, ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// A force at a point of a body, in a direction that is fixed in the plane, that is a [`StateFunction`] of time and of the
/// motion of some coordinates: a wind load, a magnet, a controlled jet.
///
/// Its coordinates are those of the body, then the observed ones.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct FeedbackPointForce<L>(pub L);

element_inputs!(FeedbackPointForceInputs {
    at: marker("point that it acts on"),
    direction: required("rad", 0.5, "direction, fixed in the plane"),
    force: state_function("N", "as a function of time and motion, such as `-c*tip.vx*abs(tip.vx)`"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "feedback-force",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("force", "N", "force along its direction"),
        Measure::new("power", "W", "power, positive if it does work on the mechanism"),
    ],
    about: "a force at a point that depends on the motion: a wind load, a magnet, a controlled jet",
    law: "the force acts at the point in the direction (cos direction, sin direction) of the plane",
    symbol: Symbol::None,
};

impl<L: StateFunction> FeedbackPointForce<L> {
    fn force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.generalized_force(FeedbackPointForceInputs(x.p).force(), x.t, &x.q[3..], &x.v[3..])
    }
}

impl<L: StateFunction> Element for FeedbackPointForce<L> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let p = FeedbackPointForceInputs(x.p);
        let [at_x, at_y] = p.at();
        let lever = Frame::of(x, 0).turned(at_x, at_y);
        let force = self.force(x);
        let (sin, cos) = p.direction().sin_cos();
        add_force(dynamics, 0, lever, [-force * cos, -force * sin]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let p = FeedbackPointForceInputs(x.p);
        let [at_x, at_y] = p.at();
        let [vx, vy] = point_velocity(x, 0, Frame::of(x, 0).turned(at_x, at_y));
        let (sin, cos) = p.direction().sin_cos();
        out[0] = self.force(x);
        out[1] = out[0] * (vx * cos + vy * sin);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a force (N) at a point, in the fixed `direction` (rad), as a function of time and of the motion of `observed`.
    pub fn feedback_point_force(
        &mut self,
        name: &str,
        (at, direction): (Marker<S>, S),
        observed: &[Coordinate],
        law: impl StateFunction,
        parameters: &[S],
    ) -> ElementIndex {
        let coordinates = [&at.body.coordinates()[..], observed].concat();
        self.add(name, FeedbackPointForce(law), &coordinates, &[&[at.x, at.y, direction], parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};

    /// A drag that grows with the square of the speed.
    struct Drag;

    impl StateFunction for Drag {
        fn generalized_force<T: Scalar>(&self, p: &[T], _t: T, _q: &[T], v: &[T]) -> T {
            -p[0] * v[0] * v[0].abs()
        }
    }

    #[test]
    fn a_drag_on_a_lever() {
        // 2 · 3² = 18 N against x at the lever (0, 0.5): 9 N·m counter-clockwise; the body does not turn.
        let q = [0.0, 0.0, 0.0, 0.0];
        let v = [3.0, 1.0, 0.0, 3.0];
        let x = ElementState {
            t: 0.0,
            p: &[0.0, 0.5, 0.0, 2.0],
            q: &q,
            v: &v,
            a: &[0.0; 4],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&FeedbackPointForce(Drag), &x).0, &[18.0, 0.0, -9.0, 0.0]);
        close(&measured(&FeedbackPointForce(Drag), &x), &[-18.0, -54.0]);
    }
}
