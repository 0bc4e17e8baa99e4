//! A force that turns with its body.

use crate::element_inputs;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A force at a point of a body, in a direction that is fixed in the body, as a function of time: a thruster, a jet, a
/// pressure.
///
/// It has no potential: the work on a closed path is not zero.
///
/// # Sources
/// Bolotin, *Nonconservative Problems of the Theory of Elastic Stability* (1963), Section 1.1.
#[derive(Clone, Copy, Debug)]
pub struct FollowerForce<F>(pub F);

element_inputs!(FollowerForceInputs {
    at: marker("point that it acts on"),
    direction: required("rad", 0.5, "direction, fixed in the body"),
    force: time_function("N", "as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "follower-force",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[Measure::new("force", "N", "force along its direction")],
    about: "a force at a point as a function of time that turns with the body",
    law: "the force acts at the point in the direction (cos direction, sin direction) of the axes of its body",
    symbol: Symbol::None,
};

impl<F: Motion> FollowerForce<F> {
    fn force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.position(FollowerForceInputs(x.p).force(), x.t)
    }
}

impl<F: Motion> Element for FollowerForce<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let (p, frame, force) = (FollowerForceInputs(x.p), Frame::of(x, 0), self.force(x));
        let [at_x, at_y] = p.at();
        let (sin, cos) = p.direction().sin_cos();
        let [fx, fy] = frame.turned(force * cos, force * sin);
        add_force(dynamics, 0, frame.turned(at_x, at_y), [-fx, -fy]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(FollowerForceInputs(p).force())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(FollowerForceInputs(p).force())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.force(x);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a force (N) at a point, in a `direction` (rad) that is fixed in its body, as a function of time.
    pub fn follower_force(
        &mut self,
        name: &str,
        at: Marker<S>,
        direction: S,
        force: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let all = [&[at.x, at.y, direction], parameters].concat();
        self.add(name, FollowerForce(force), &at.body.coordinates(), &all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};
    use crate::motion::Fixed;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_thruster_turns_with_its_body() {
        // Along the body's x axis, half a metre to its right: the torque is 4 N·m at any angle.
        let p = [0.0, -0.5, 0.0, 8.0];
        close(&rows(&FollowerForce(Fixed), &at(&p, &[1.0, 1.0, 0.0], &[])).0, &[-8.0, 0.0, -4.0]);
        close(&rows(&FollowerForce(Fixed), &at(&p, &[1.0, 1.0, FRAC_PI_2], &[])).0, &[0.0, -8.0, -4.0]);
    }
}
