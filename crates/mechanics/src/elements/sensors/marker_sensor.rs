//! A sensor for the motion of a point of a body.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, point_acceleration, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A sensor for position, velocity and acceleration of a point of a body, and of the body's rotation.
#[derive(Clone, Copy, Debug)]
pub struct MarkerSensor;

as_object!(MarkerSensor);

element_inputs!(MarkerSensorInputs { at: marker("point that it measures") });

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "sensor",
    family: Family::Sensor,
    inputs: INPUTS,
    measures: &[
        Measure::new("x", "m", "horizontal position"),
        Measure::new("y", "m", "vertical position"),
        Measure::new("theta", "rad", "rotation of the body, counter-clockwise"),
        Measure::new("vx", "m/s", "horizontal velocity"),
        Measure::new("vy", "m/s", "vertical velocity"),
        Measure::new("omega", "rad/s", "angular velocity of the body"),
        Measure::new("ax", "m/s²", "horizontal acceleration"),
        Measure::new("ay", "m/s²", "vertical acceleration"),
        Measure::new("alpha", "rad/s²", "angular acceleration of the body"),
    ],
    about: "measures the motion of a point",
    law: "",
    symbol: Symbol::None,
};

impl Element for MarkerSensor {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _dynamics: &mut [T], _constraint: &mut [T]) {}

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let frame = Frame::of(x, 0);
        let [at_x, at_y] = MarkerSensorInputs(x.p).at();
        let lever = frame.turned(at_x, at_y);
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
        self.add_object(name.into(), MarkerSensor::object(), &marker.body.coordinates(), &[marker.x, marker.y])
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
            sides: Default::default(),
        };
        close(&measured(&MarkerSensor, &x), &[3.0, 0.0, 0.0, 0.1, 6.2, 3.0, -17.7, 10.4, 5.0]);
    }
}
