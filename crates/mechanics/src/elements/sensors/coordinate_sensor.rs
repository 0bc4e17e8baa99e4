//! A sensor for the difference of two coordinates.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A sensor for position, velocity and acceleration of a coordinate relative to another.
#[derive(Clone, Copy, Debug)]
pub struct CoordinateSensor;

as_object!(CoordinateSensor);

element_inputs!(CoordinateSensorInputs {
    a: coordinate("coordinate that it measures from"),
    b: coordinate("coordinate that it measures"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "coordinate-sensor",
    family: Family::Sensor,
    inputs: INPUTS,
    measures: &[
        Measure::new("position", "m or rad", "b − a"),
        Measure::new("velocity", "m/s or rad/s", "rate of b − a"),
        Measure::new("acceleration", "m/s² or rad/s²", "second rate of b − a"),
    ],
    about: "measures the motion of a coordinate",
    law: "",
    symbol: Symbol::None,
};

impl Element for CoordinateSensor {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _dynamics: &mut [T], _constraint: &mut [T]) {}

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (x.q[1] - x.q[0], x.v[1] - x.v[0], x.a[1] - x.a[0]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Measures `b` − `a` and its rates.
    pub fn coordinate_sensor(&mut self, name: &str, a: Coordinate, b: Coordinate) -> ElementIndex {
        self.add_object(name.into(), CoordinateSensor::object(), &[a, b], &[])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured};

    #[test]
    fn differences_and_their_rates() {
        let x = ElementState {
            t: 0.0,
            p: &[],
            q: &[1.0, 4.0],
            v: &[2.0, 7.0],
            a: &[3.0, 9.0],
            l: &[],
            sides: Default::default(),
        };
        close(&measured(&CoordinateSensor, &x), &[3.0, 5.0, 6.0]);
    }
}
