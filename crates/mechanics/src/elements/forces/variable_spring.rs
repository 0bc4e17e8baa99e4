//! A spring whose stiffness is a function of time.

use crate::element_inputs;
use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A spring and damper between two points whose stiffness is a function of time: tension k(t) (L − L₀) + c L̇.
///
/// It stores ½ k(t) (L − L₀)², which a change of its stiffness changes too: it is not conservative.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct VariableSpring<F>(pub F);

element_inputs!(VariableSpringInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    damping: optional("0", "N·s/m", 1.0, "damping"),
    length: optional("0", "m", 0.7, "unloaded length"),
    stiffness: time_function("N/m", "stiffness as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "variable-spring",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("tension", "N", "force of spring and damper, positive if it pulls the points together"),
        Measure::new("length", "m", "distance of the points"),
        Measure::new("rate", "m/s", "rate of the distance"),
        Measure::new("stiffness", "N/m", "stiffness at this time"),
    ],
    about: "a spring and damper between two points whose stiffness changes with time",
    law: "tension = stiffness(t)·(L − length) + damping·L̇ with the distance L of the points",
    symbol: Symbol::Spring,
};

impl<F: Motion> VariableSpring<F> {
    fn tension<T: Scalar>(&self, x: &ElementState<'_, T>, line: &Line<T>) -> T {
        let p = VariableSpringInputs(x.p);
        self.0.position(p.stiffness(), x.t) * (line.length - p.length()) + p.damping() * line.rate
    }
}

impl<F: Motion> Element for VariableSpring<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let line = Line::of(x);
        line.add_axial_force(self.tension(x, &line), dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(VariableSpringInputs(p).stiffness())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(VariableSpringInputs(p).stiffness())
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        let line = Line::of(x);
        (out[0], out[1], out[2]) = (self.tension(x, &line), line.length, line.rate);
        out[3] = self.0.position(VariableSpringInputs(x.p).stiffness(), x.t);
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let p = VariableSpringInputs(x.p);
        let elongation = Line::of(x).length - p.length();
        Energy { kinetic: T::zero(), potential: self.0.position(p.stiffness(), x.t) * elongation * elongation * 0.5 }
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a spring and damper between two points whose stiffness (N/m) is a function of time.
    pub fn variable_spring(
        &mut self,
        name: &str,
        [a, b]: [Marker<S>; 2],
        [damping, length]: [S; 2],
        stiffness: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add(name, VariableSpring(stiffness), &coordinates, &[&p[..], &[damping, length], parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};
    use crate::elements::line::three_four_five;
    use crate::motion::Fixed;

    #[test]
    fn five_metres_long_at_rest_with_four() {
        // 7 · 1 + 10 · 2.2 = 29 N along (0.6, 0.8).
        let ((q, v), p) = (three_four_five(), [0.0, 0.0, 0.0, 0.0, 10.0, 4.0, 7.0]);
        let x = moving(&p, &q, &v, &[]);
        close(&rows(&VariableSpring(Fixed), &x).0, &[-17.4, -23.2, 0.0, 17.4, 23.2, 0.0]);
        close(&measured(&VariableSpring(Fixed), &x), &[29.0, 5.0, 2.2, 7.0]);
        close(&energies(&VariableSpring(Fixed), &x), &[0.0, 3.5]);
    }
}
