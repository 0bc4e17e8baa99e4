//! Svanberg's small example: the point in the intersection of two balls that is nearest to the origin.
//!
//! $$ \min\ x \cdot x \quad\text{subject to}\quad |x - (5, 2, 1)|^2 \le 9 ,\quad |x - (3, 4, 3)|^2 \le 9 ,\qquad
//!    0 \le x_j \le 5 , $$
//!
//! from (4, 3, 2).
//!
//! # Sources
//! Svanberg, *MMA and GCMMA – two methods for nonlinear optimization* (2007), the small example.

use super::Optimum;
use crate::function;
use crate::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity};
use autodiff::Scalar;
use error::Result;

const CENTRES: [[f64; 3]; 2] = [[5.0, 2.0, 1.0], [3.0, 4.0, 3.0]];

/// Squared distances from the two centres.
struct Distances;

impl ClosedForm for Distances {
    fn response<S: Scalar>(&self, h: usize, x: &[S], _: S) -> S {
        x.iter().zip(CENTRES[h]).fold(S::from(0.0), |sum, (&x, c)| sum + (x - c).powi(2))
    }
}

/// The problem. The objective is explicit, the distances are the responses of an analysis.
pub fn problem() -> Result<Problem> {
    let mut parts = ProblemBuilder::new("two spheres");
    for (k, start) in [4.0, 3.0, 2.0].into_iter().enumerate() {
        parts.variable(DesignVariable::new(format!("x{}", k + 1), "", start).within(0.0, 5.0));
    }
    let square = function!(|p| p.design.iter().fold(S::from(0.0), |sum, &x| sum + x * x));
    parts.minimize("square of the distance", "", Quantity::plain(square));
    for ball in ["ball 1", "ball 2"] {
        let distance = parts.constant(&format!("square of the distance from {ball}"), "");
        let inside = Quantity::plain(function!(|p| p.response[0])).of(&[distance]);
        parts.subject_to(Constraint::at_most(ball, 9.0, inside));
    }
    parts.build_analytic(Distances)
}

/// The optimum, on both spheres.
pub const fn optimum() -> Optimum {
    let source = "Svanberg 2007, here to seven digits";
    Optimum::published(8.770_246, &[2.017_519, 1.780_011, 1.237_507], source).within(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_optimum_is_on_both_spheres_and_in_the_plane_of_their_centres() {
        let x = optimum().design.unwrap();
        let problem = problem().unwrap();
        let there = problem.evaluate(x, &problem.analyze(x).unwrap()).unwrap();
        assert!((there.objective - optimum().objective).abs() < 5e-6, "{}", there.objective);
        assert!(there.residuals.iter().all(|history| history[0].abs() < 1e-6), "{:?}", there.residuals);
        // x is a combination of the centres: both spheres pull along x − c, the objective along x.
        let [a, b] = CENTRES;
        let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
        assert!(x.iter().zip(normal).map(|(x, n)| x * n).sum::<f64>().abs() < 1e-4);
    }
}
