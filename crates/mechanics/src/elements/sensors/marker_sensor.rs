//! A sensor for the motion of a point of a body.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::frame::{Frame, point_acceleration, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// Measures position, velocity and acceleration of a point of a body, and of the body's rotation.
///
/// Coordinates x, y, θ; parameters body-fixed x, y (m).
#[derive(Clone, Copy, Debug)]
pub struct MarkerSensor;

impl Element for MarkerSensor {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _balance: &mut [T], _closure: &mut [T]) {}

    fn is_sensor(&self) -> bool {
        true
    }

    fn measures(&self) -> &'static [&'static str] {
        &["x", "y", "theta", "vx", "vy", "omega", "ax", "ay", "alpha"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let frame = Frame::of(x, 0);
        let lever = frame.turned(x.p[0], x.p[1]);
        [out[0], out[1]] = frame.point(lever);
        out[2] = x.q[2];
        [out[3], out[4]] = point_velocity(x, 0, lever);
        out[5] = x.v[2];
        [out[6], out[7]] = point_acceleration(x, 0, lever);
        out[8] = x.a[2];
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a sensor for the motion of a point.
    pub fn sensor(&mut self, name: &str, marker: Marker<S>) -> ElementIndex {
        self.add(name, MarkerSensor, &marker.body.coordinates(), &[marker.x, marker.y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured};

    #[test]
    fn a_point_two_metres_out_on_a_turning_body() {
        // ω = 3 rad/s, α = 5 rad/s²: v = ω × r, a = α × r − ω² r, on top of the motion of the reference point.
        let x = ElementState {
            t: 0.0,
            p: &[2.0, 0.0],
            q: &[1.0, 0.0, 0.0],
            v: &[0.1, 0.2, 3.0],
            a: &[0.3, 0.4, 5.0],
            l: &[],
        };
        close(&measured(&MarkerSensor, &x), &[3.0, 0.0, 0.0, 0.1, 6.2, 3.0, -17.7, 10.4, 5.0]);
    }
}
