//! Drives of one coordinate, and between two coordinates.

use crate::element_inputs;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A drive: the difference of two coordinates is a function of time, Φ = q_B − q_A − f(t).
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.5.
#[derive(Clone, Copy, Debug)]
pub struct Driver<F>(pub F);

element_inputs!(DriverInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    motion: time_function("m or rad", "position as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "relative",
    family: Family::Drive,
    inputs: INPUTS,
    measures: &[
        Measure::new("driving_force", "N or N·m", "driving force or torque, positive if it acts towards larger b − a"),
        Measure::new("power", "W", "power of the drive, positive if it does work on the mechanism"),
    ],
    about: "the difference b − a as a function of time",
    law: "b − a = motion(t)",
    symbol: Symbol::None,
};

/// Declaration of [`Mechanism::drive`](crate::mechanism::Mechanism::drive): a coordinate that is a function of time.
pub static COORDINATE_DRIVE: ElementDescriptor = {
    element_inputs!(CoordinateDriveInputs {
        coordinate: coordinate("coordinate that it acts on"),
        motion: time_function("m or rad", "position as a function of time"),
    });
    ElementDescriptor {
        kind: "coordinate",
        family: Family::Drive,
        inputs: INPUTS,
        measures: &[Measure::new(
            "driving_force",
            "N or N·m",
            "driving force or torque, positive towards larger values",
        )],
        about: "a coordinate as a function of time",
        law: "coordinate = motion(t)",
        symbol: Symbol::None,
    }
};

impl<F: Motion> Element for Driver<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        constraint[0] = x.q[1] - x.q[0] - self.0.position(DriverInputs(x.p).motion(), x.t);
        (dynamics[0], dynamics[1]) = (-x.l[0], x.l[0]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(DriverInputs(p).motion())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(DriverInputs(p).motion())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (-x.l[0], -x.l[0] * (x.v[1] - x.v[0]));
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Prescribes `b` − `a` as a function of time.
    pub fn driver(
        &mut self,
        name: &str,
        a: Coordinate,
        b: Coordinate,
        motion: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        self.add(name, Driver(motion), &[a, b], parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};
    use crate::motion::ConstantSpeed;

    #[test]
    fn the_driving_force_is_the_negative_multiplier() {
        let drive = Driver(ConstantSpeed);
        let x = ElementState {
            t: 2.0,
            p: &[0.5, 3.0],
            q: &[1.0, 7.0],
            v: &[1.0, 4.0],
            a: &[0.0; 2],
            l: &[-5.0],
            sides: Default::default(),
        };
        let (dynamics, constraint) = rows(&drive, &x);
        close(&dynamics, &[5.0, -5.0]);
        close(&constraint, &[-0.5]);
        close(&measured(&drive, &x), &[5.0, 15.0]);
    }
}
