//! A force that is a function of time.

use crate::element_inputs;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::write_force_pair;
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A force or torque between two coordinates as a function of time: a motor on two rotations, a load on one coordinate.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct Load<F>(pub F);

element_inputs!(LoadInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    generalized_force: time_function("N or N·m", "as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "load",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("generalized_force", "N or N·m", "force or torque, positive if it acts towards larger b − a"),
        Measure::new("power", "W", "power, positive if it does work on the mechanism"),
    ],
    about: "a force or torque between a and b as a function of time",
    law: "generalized_force = a function of time; it acts on b, and its opposite on a",
    symbol: Symbol::None,
};

impl<F: Motion> Load<F> {
    fn force<T: Scalar>(&self, x: &ElementState<'_, T>) -> T {
        self.0.position(LoadInputs(x.p).generalized_force(), x.t)
    }
}

impl<F: Motion> Element for Load<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        write_force_pair(dynamics, self.force(x));
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(LoadInputs(p).generalized_force())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(LoadInputs(p).generalized_force())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.force(x);
        out[1] = out[0] * (x.v[1] - x.v[0]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Applies a force or torque to `b`, and its reaction to `a`, as a function of time.
    pub fn load(
        &mut self,
        name: &str,
        a: Coordinate,
        b: Coordinate,
        force: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        self.add(name, Load(force), &[a, b], parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};
    use crate::motion::ConstantSpeed;

    #[test]
    fn a_torque_that_grows_with_time_and_its_power() {
        let motor = Load(ConstantSpeed);
        let x = ElementState {
            t: 3.0,
            p: &[1.0, 2.0],
            q: &[0.0; 2],
            v: &[1.0, 5.0],
            a: &[0.0; 2],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&motor, &x).0, &[7.0, -7.0]);
        close(&measured(&motor, &x), &[7.0, 28.0]);
    }
}
