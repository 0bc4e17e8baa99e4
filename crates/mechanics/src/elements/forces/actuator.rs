//! A linear actuator.

use crate::element_inputs;
use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A linear actuator: an axial force between two points as a function of time, positive in tension.
///
/// The points must not coincide.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct Actuator<F>(pub F);

element_inputs!(ActuatorInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    tension: time_function("N", "as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "actuator",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("tension", "N", "axial force, positive if it pulls the points together"),
        Measure::new("length", "m", "distance of the points"),
        Measure::new("rate", "m/s", "rate of the distance"),
    ],
    about: "an axial force between two points as a function of time",
    law: "tension = a function of time",
    symbol: Symbol::Cylinder,
};

impl<F: Motion> Actuator<F> {
    fn tension<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.position(ActuatorInputs(x.p).tension(), x.t)
    }
}

impl<F: Motion> Element for Actuator<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        Line::of(x).add_axial_force(self.tension(x), dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(ActuatorInputs(p).tension())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(ActuatorInputs(p).tension())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (self.tension(x), line.length, line.rate);
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a tension (N) between two points as a function of time.
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
        let x = ElementState {
            t: 2.0,
            p: &[0.0, 0.0, 0.0, 0.0, 4.0, 3.0],
            q: &q,
            v: &v,
            a: &[0.0; 6],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&pull, &x).0, &[-6.0, -8.0, 0.0, 6.0, 8.0, 0.0]);
        close(&measured(&pull, &x), &[10.0, 5.0, 2.2]);
    }
}
