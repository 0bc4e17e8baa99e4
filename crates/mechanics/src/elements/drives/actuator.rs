//! A linear actuator.

use crate::elements::element::{Element, ElementState};
use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A linear actuator: a tension that is a function of time.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, then those of the function. The points must
/// not coincide.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct Actuator<F>(pub F);

impl<F: Motion> Element for Actuator<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        Line::of(x).add_axial_force(self.0.position(&x.p[4..], x.t), dynamics);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tension", "length", "rate"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (self.0.position(&x.p[4..], x.t), line.length, line.rate);
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Pulls two points together with a tension (N) that is a function of time.
    pub fn actuator(
        &mut self,
        name: &str,
        a: Marker<S>,
        b: Marker<S>,
        tension: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add(name, Actuator(tension), &coordinates, &[&p[..], parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};
    use crate::elements::line::three_four_five;
    use crate::motion::ConstantSpeed;

    #[test]
    fn a_tension_of_ten_newtons_after_two_seconds() {
        let ((q, v), pull) = (three_four_five(), Actuator(ConstantSpeed));
        let x = ElementState { t: 2.0, p: &[0.0, 0.0, 0.0, 0.0, 4.0, 3.0], q: &q, v: &v, a: &[0.0; 6], l: &[] };
        close(&rows(&pull, &x).0, &[-6.0, -8.0, 0.0, 6.0, 8.0, 0.0]);
        close(&measured(&pull, &x), &[10.0, 5.0, 2.2]);
    }
}
