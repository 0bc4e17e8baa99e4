//! A sensor for the motion of a marker in space.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame3::{Frame3, check_marker};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A sensor for position, velocity and acceleration of a marker in space, and for the angular motion of its body.
#[derive(Clone, Copy, Debug)]
pub struct MarkerSensor3;

as_object!(MarkerSensor3);

element_inputs!(MarkerSensor3Inputs { at: marker3("marker that it measures") });

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "sensor",
    family: Family::Sensor,
    inputs: INPUTS,
    measures: &[
        Measure::new("x", "m", "position along x of the world"),
        Measure::new("y", "m", "position along y of the world"),
        Measure::new("z", "m", "position along z of the world"),
        Measure::new("vx", "m/s", "velocity along x of the world"),
        Measure::new("vy", "m/s", "velocity along y of the world"),
        Measure::new("vz", "m/s", "velocity along z of the world"),
        Measure::new("ax", "m/s²", "acceleration along x of the world"),
        Measure::new("ay", "m/s²", "acceleration along y of the world"),
        Measure::new("az", "m/s²", "acceleration along z of the world"),
        Measure::new("omega_x", "rad/s", "angular velocity along x of the world"),
        Measure::new("omega_y", "rad/s", "angular velocity along y of the world"),
        Measure::new("omega_z", "rad/s", "angular velocity along z of the world"),
        Measure::new("alpha_x", "rad/s²", "angular acceleration along x of the world"),
        Measure::new("alpha_y", "rad/s²", "angular acceleration along y of the world"),
        Measure::new("alpha_z", "rad/s²", "angular acceleration along z of the world"),
        Measure::new("own_omega_x", "rad/s", "angular velocity along x of the marker"),
        Measure::new("own_omega_y", "rad/s", "angular velocity along y of the marker"),
        Measure::new("own_omega_z", "rad/s", "angular velocity along z of the marker"),
    ],
    about: "measures the motion of a marker",
    law: "",
    symbol: Symbol::None,
};

impl Element for MarkerSensor3 {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _dynamics: &mut [T], _constraint: &mut [T]) {}

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let marker = Frame3::of(x, 0).marker(MarkerSensor3Inputs(x.p).at());
        let frame = marker.frame;
        let omega = frame.angular_velocity(x);
        let all = [
            marker.point,
            frame.velocity(x, marker.lever),
            frame.acceleration(x, marker.lever),
            omega,
            frame.angular_acceleration(x),
            marker.components(omega),
        ];
        out.copy_from_slice(all.as_flattened());
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        check_marker("at", MarkerSensor3Inputs(p).at())
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a sensor for the motion of a marker in space.
    pub fn sensor3(&mut self, name: &str, marker: Marker3<S>) -> ElementIndex {
        let p = marker.parameters();
        self.add_object(name.into(), MarkerSensor3::object(), &marker.body.coordinates(), &p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured};

    #[test]
    fn a_point_two_metres_out_on_a_turning_body() {
        // ω = (0, 0, 3) and ω̇ = (0, 5, 0) rad/s²: v = ω × r, a = ω̇ × r − ω² r, on top of the motion of the reference point.
        // Along e: ë₀ = −|ė|².
        let x = ElementState {
            t: 0.0,
            p: &[2.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
            q: &[1.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0],
            v: &[0.1, 0.2, 0.3, 0.0, 0.0, 0.0, 1.5],
            a: &[0.4, 0.5, 0.6, -2.25, 0.0, 2.5, 0.0],
            l: &[],
            sides: Default::default(),
        };
        let expected =
            [[3.0, 0.0, 0.5], [0.1, 6.2, 0.3], [-17.6, 0.5, -9.4], [0.0, 0.0, 3.0], [0.0, 5.0, 0.0], [0.0, 0.0, 3.0]];
        close(&measured(&MarkerSensor3, &x), expected.as_flattened());
    }
}
