//! A linear drive.

use crate::element_inputs;
use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A linear drive: the distance of two points is a function of time, Φ = |r_B − r_A| − f(t).
///
/// λ is the tension in N. The points must not coincide.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.5.
#[derive(Clone, Copy, Debug)]
pub struct LengthDriver<F>(pub F);

element_inputs!(LengthDriverInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    motion: time_function("m", "distance as a function of time"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "length",
    family: Family::Drive,
    inputs: INPUTS,
    measures: &[
        Measure::new("tension", "N", "tension of the drive, positive if it pulls the points together"),
        Measure::new("length", "m", "distance of the points"),
    ],
    about: "the distance of two points as a function of time",
    law: "|r_b − r_a| = motion(t)",
    symbol: Symbol::Cylinder,
};

impl<F: Motion> Element for LengthDriver<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let line = Line::of(x);
        constraint[0] = line.length - self.0.position(LengthDriverInputs(x.p).motion(), x.t);
        line.add_axial_force(x.l[0], dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        self.0.breaks(LengthDriverInputs(p).motion())
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.0.validate_parameters(LengthDriverInputs(p).motion())
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (x.l[0], Line::of(x).length);
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Prescribes the distance (m) of two points as a function of time.
    pub fn drive_length(
        &mut self,
        name: &str,
        a: Marker<S>,
        b: Marker<S>,
        length: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add(name, LengthDriver(length), &coordinates, &[&p[..], parameters].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, rows};
    use crate::elements::line::three_four_five;
    use crate::motion::ConstantSpeed;

    #[test]
    fn half_a_metre_ahead_after_a_second() {
        let (q, v) = three_four_five();
        let x = ElementState {
            t: 1.0,
            p: &[0.0, 0.0, 0.0, 0.0, 4.0, 0.5],
            q: &q,
            v: &v,
            a: &[0.0; 6],
            l: &[10.0],
            sides: Default::default(),
        };
        let (dynamics, constraint) = rows(&LengthDriver(ConstantSpeed), &x);
        close(&constraint, &[0.5]);
        close(&dynamics, &[-6.0, -8.0, 0.0, 6.0, 8.0, 0.0]);
    }
}
