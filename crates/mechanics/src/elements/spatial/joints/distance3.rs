//! A distance constraint between two points in space.

use crate::elements::spatial::line3::{Line3, check_ends, ends3, without_direction3};
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A distance constraint in space, a massless rod with spherical joints: Φ = |r_B − r_A| − L.
///
/// λ is the tension in N. The points must not coincide.
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct DistanceConstraint3;

as_object!(DistanceConstraint3);

element_inputs!(Distance3Inputs {
    a: marker3("point of the first body"),
    b: marker3("point of the second body"),
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

impl Element for DistanceConstraint3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let line = Line3::of(x);
        constraint[0] = line.length - Distance3Inputs(x.p).length();
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
        let length = Distance3Inputs(p).length();
        (!(length > 0.0)).then(|| format!("its length is {length} m")).or_else(|| check_ends(p))
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction3(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps the points of `a` and `b` at the distance `length` (m).
    pub fn distance_constraint3(&mut self, name: &str, a: Marker3<S>, b: Marker3<S>, length: S) -> ElementIndex {
        let (coordinates, p) = ends3(a, b);
        self.add_object(name.into(), DistanceConstraint3::object(), &coordinates, &[&p[..], &[length]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, rows};
    use crate::elements::spatial::line3::{points, upright};

    #[test]
    fn a_rod_of_six_metres_is_a_metre_too_short() {
        let p = [&points([0.0; 3], [1.0, 0.0, 0.0])[..], &[6.0]].concat();
        let q = upright([0.0; 3], [1.0, 3.0, 6.0]);
        let (dynamics, constraint) = rows(&DistanceConstraint3, &at(&p, &q, &[7.0]));
        close(&constraint, &[1.0]);
        close(&dynamics, &[-2.0, -3.0, -6.0, 0.0, 0.0, 0.0, 0.0, 2.0, 3.0, 6.0, 0.0, 0.0, -12.0, 6.0]);
        assert!(DistanceConstraint3.validate_parameters(&[0.0; 15]).is_some());
    }
}
