//! A force at a point of a body.

use crate::element_inputs;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A force at a point of a body, in a direction that is fixed in the plane, as a function of time.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct PointForce<F>(pub F);

element_inputs!(PointForceInputs {
    at: marker("point that it acts on"),
    direction: required("rad", 0.5, "direction, fixed in the plane"),
    force: time_function("N", "as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "force",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[Measure::new("force", "N", "force along its direction")],
    about: "a force at a point as a function of time",
    law: "the force acts at the point in the direction (cos direction, sin direction) of the plane",
    symbol: Symbol::None,
};

impl<F: Motion> PointForce<F> {
    fn force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.position(PointForceInputs(x.p).force(), x.t)
    }
}

impl<F: Motion> Element for PointForce<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let p = PointForceInputs(x.p);
        let [at_x, at_y] = p.at();
        let lever = Frame::of(x, 0).turned(at_x, at_y);
        let force = self.force(x);
        let (sin, cos) = p.direction().sin_cos();
        add_force(dynamics, 0, lever, [-force * cos, -force * sin]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(PointForceInputs(p).force())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(PointForceInputs(p).force())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.force(x);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a force (N) at a point, in the fixed `direction` (rad), as a function of time.
    pub fn force(
        &mut self,
        name: &str,
        at: Marker<S>,
        direction: S,
        force: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let all = [&[at.x, at.y, direction], parameters].concat();
        self.add(name, PointForce(force), &at.body.coordinates(), &all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};
    use crate::motion::Fixed;

    #[test]
    fn a_force_upwards_on_a_lever_of_a_turned_body() {
        // Lever (0, −0.5) of a body turned by 90° points along +x: 8 N upwards make 4 N·m.
        let p = [0.0, -0.5, std::f64::consts::FRAC_PI_2, 8.0];
        let computed = rows(&PointForce(Fixed), &at(&p, &[1.0, 1.0, std::f64::consts::FRAC_PI_2], &[])).0;
        close(&computed, &[0.0, -8.0, -4.0]);
    }
}
