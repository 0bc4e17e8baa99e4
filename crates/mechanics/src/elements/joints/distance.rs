//! A distance constraint between two points.

use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A distance constraint, a massless rod between two points: Φ = |r_B − r_A| − L.
///
/// λ is the tension in N. The points must not coincide.
///
/// # Sources
/// Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct DistanceConstraint;

as_object!(DistanceConstraint);

element_inputs!(DistanceInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    length: required("m", 0.4, "distance"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "distance",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[Measure::new("tension", "N", "tension of the rod, positive if it pulls the points together")],
    about: "a massless rod: the distance of two points is constant",
    law: "|r_b − r_a| = length",
    symbol: Symbol::Bar,
};

impl Element for DistanceConstraint {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let line = Line::of(x);
        constraint[0] = line.length - DistanceInputs(x.p).length();
        line.add_axial_force(x.l[0], dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let length = DistanceInputs(p).length();
        (!(length > 0.0)).then(|| format!("its length is {length} m"))
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps the points `a` and `b` at the distance `length` (m).
    pub fn distance_constraint(&mut self, name: &str, a: Marker<S>, b: Marker<S>, length: S) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), DistanceConstraint::object(), &coordinates, &[&p[..], &[length]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};
    use crate::elements::line::three_four_five;

    #[test]
    fn a_rod_of_four_metres_is_a_metre_too_short() {
        let (q, _) = three_four_five();
        let (dynamics, constraint) = rows(&DistanceConstraint, &at(&[0.0, 0.0, 0.0, 0.0, 4.0], &q, &[10.0]));
        close(&constraint, &[1.0]);
        close(&dynamics, &[-6.0, -8.0, 0.0, 6.0, 8.0, 0.0]);
        assert!(DistanceConstraint.validate_parameters(&[0.0; 5]).is_some());
    }
}
