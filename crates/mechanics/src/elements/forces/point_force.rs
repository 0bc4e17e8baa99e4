//! A force on a point of a body.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::frame::{Frame, add_force};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A force on a point of a body, of fixed direction, as a function of time.
///
/// Coordinates x, y, θ; parameters body-fixed x, y (m), direction (rad), then those of the function (N).
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct PointForce<F>(pub F);

impl<F: Motion> Element for PointForce<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        let lever = Frame::of(x, 0).turned(x.p[0], x.p[1]);
        let force = self.0.position(&x.p[3..], x.t);
        let (sin, cos) = x.p[2].sin_cos();
        add_force(dynamics, 0, lever, [-force * cos, -force * sin]);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.0.position(&x.p[3..], x.t);
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
        let found = rows(&PointForce(Fixed), &at(&p, &[1.0, 1.0, std::f64::consts::FRAC_PI_2], &[])).0;
        close(&found, &[0.0, -8.0, -4.0]);
    }
}
