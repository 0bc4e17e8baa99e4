//! A massless rod.

use crate::elements::element::{Element, ElementState};
use crate::elements::line::{Line, ends, without_direction};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// A massless rod: two points keep their distance, Φ = |r_B − r_A| − L.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, L (m). λ is the tension in N.
///
/// **Source.** Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct DistanceConstraint;

impl Element for DistanceConstraint {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let line = Line::of(x);
        constraint[0] = line.length - x.p[4];
        line.add_axial_force(x.l[0], dynamics);
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measures(&self) -> &'static [&'static str] {
        &["tension"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = x.l[0];
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (!(p[4] > 0.0)).then(|| format!("its length is {} m", p[4]))
    }

    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        without_direction(x)
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps the points `a` and `b` at the distance `length` (m).
    pub fn distance_constraint(&mut self, name: &str, a: Marker<S>, b: Marker<S>, length: S) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add(name, DistanceConstraint, &coordinates, &[&p[..], &[length]].concat())
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
