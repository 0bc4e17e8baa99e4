//! A distributed load on a beam element.

use crate::element_inputs;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Body, ElementIndex, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A load per unloaded length on a beam element, in a direction that is fixed in the plane, as a function of time.
///
/// Half of q ℓ acts on each node: the consistent load of linear interpolation.
///
/// # Sources
/// Bathe, *Finite Element Procedures* (1996), Section 4.2.1.
#[derive(Clone, Copy, Debug)]
pub struct LineLoad<F>(pub F);

element_inputs!(LineLoadInputs {
    i: body("first node"),
    j: body("second node"),
    length: required("m", 0.4, "unloaded length"),
    direction: required("rad", 0.5, "direction, fixed in the plane"),
    load: time_function("N/m", "as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "line-load",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[Measure::new("force", "N", "force on the element along its direction")],
    about: "a distributed load on a beam element",
    law: "",
    symbol: Symbol::None,
};

impl<F: Motion> LineLoad<F> {
    fn force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        let p = LineLoadInputs(x.p);
        self.0.position(p.load(), x.t) * p.length()
    }
}

impl<F: Motion> Element for LineLoad<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let half = self.force(x) * 0.5;
        let (sin, cos) = LineLoadInputs(x.p).direction().sin_cos();
        for node in [0, 3] {
            dynamics[node] = -half * cos;
            dynamics[node + 1] = -half * sin;
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(LineLoadInputs(p).load())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(LineLoadInputs(p).load())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.force(x);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a load (N/m) per unloaded `length` (m) to the beam element between two nodes, in the fixed `direction` (rad).
    pub fn line_load(
        &mut self,
        name: &str,
        [i, j]: [Body; 2],
        [length, direction]: [S; 2],
        load: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let coordinates = [i.coordinates(), j.coordinates()].concat();
        self.add(name, LineLoad(load), &coordinates, &[&[length, direction], parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};
    use crate::motion::Fixed;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn half_of_the_load_is_on_each_node() {
        let p = [2.0, FRAC_PI_2, -10.0];
        let x = at(&p, &[0.0, 0.0, 0.3, 2.0, 0.0, 0.1], &[]);
        close(&rows(&LineLoad(Fixed), &x).0, &[0.0, 10.0, 0.0, 0.0, 10.0, 0.0]);
        close(&measured(&LineLoad(Fixed), &x), &[-20.0]);
    }
}
