//! A sensor for the difference of two coordinates.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use autodiff::Scalar;

/// Measures position, velocity and acceleration of a coordinate relative to another.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateSensor;

impl Element for CoordinateSensor {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _balance: &mut [T], _closure: &mut [T]) {}

    fn is_sensor(&self) -> bool {
        true
    }

    fn measures(&self) -> &'static [&'static str] {
        &["position", "velocity", "acceleration"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (x.q[1] - x.q[0], x.v[1] - x.v[0], x.a[1] - x.a[0]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Measures `b` − `a` and its rates.
    pub fn coordinate_sensor(&mut self, name: &str, a: Coordinate, b: Coordinate) -> ElementIndex {
        self.add(name, CoordinateSensor, &[a, b], &[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured};

    #[test]
    fn differences_and_their_rates() {
        let x = ElementState { t: 0.0, p: &[], q: &[1.0, 4.0], v: &[2.0, 7.0], a: &[3.0, 9.0], l: &[] };
        close(&measured(&CoordinateSensor, &x), &[3.0, 5.0, 6.0]);
    }
}
