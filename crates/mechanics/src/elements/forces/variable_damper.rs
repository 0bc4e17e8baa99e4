//! A damper whose coefficient is a function of time.

use crate::element_inputs;
use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A viscous damper between two points whose coefficient is a function of time: tension c(t) L̇.
///
/// For a coefficient that is constant take the [`SpringDamper`](crate::elements::SpringDamper), for one that depends on the motion
/// a [`FeedbackPointForce`](crate::elements::FeedbackPointForce).
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct VariableDamper<F>(pub F);

element_inputs!(VariableDamperInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    damping: time_function("N·s/m", "damping as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "variable-damper",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("tension", "N", "force of the damper, positive if it pulls the points together"),
        Measure::new("length", "m", "distance of the points"),
        Measure::new("rate", "m/s", "rate of the distance"),
        Measure::new("damping", "N·s/m", "damping at this time"),
    ],
    about: "a damper between two points whose coefficient changes with time",
    law: "tension = damping(t)·L̇ with the distance L of the points",
    symbol: Symbol::Damper,
};

impl<F: Motion> VariableDamper<F> {
    fn tension<T: Scalar>(&self, x: &ElementState<'_, T>, line: &Line<T>) -> T {
        self.0.position(VariableDamperInputs(x.p).damping(), x.t) * line.rate
    }
}

impl<F: Motion> Element for VariableDamper<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let line = Line::of(x);
        line.add_axial_force(self.tension(x, &line), dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(VariableDamperInputs(p).damping())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(VariableDamperInputs(p).damping())
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (self.tension(x, &line), line.length, line.rate);
        out[3] = self.0.position(VariableDamperInputs(x.p).damping(), x.t);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a damper between two points whose coefficient (N·s/m) is a function of time.
    pub fn variable_damper(
        &mut self,
        name: &str,
        [a, b]: [Marker<S>; 2],
        damping: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add(name, VariableDamper(damping), &coordinates, &[&p[..], parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, moving, rows};
    use crate::elements::line::three_four_five;
    use crate::motion::Fixed;

    #[test]
    fn five_metres_long_and_growing() {
        // 10 · 2.2 = 22 N along (0.6, 0.8).
        let ((q, v), p) = (three_four_five(), [0.0, 0.0, 0.0, 0.0, 10.0]);
        let x = moving(&p, &q, &v, &[]);
        close(&rows(&VariableDamper(Fixed), &x).0, &[-13.2, -17.6, 0.0, 13.2, 17.6, 0.0]);
        close(&measured(&VariableDamper(Fixed), &x), &[22.0, 5.0, 2.2, 10.0]);
    }
}
