//! Svanberg's cantilever: five hollow segments, least weight at a bounded tip deflection.
//!
//! $$ \min\ 0.0624 \sum_{j=1}^5 x_j \quad\text{subject to}\quad
//!    \frac{61}{x_1^3} + \frac{37}{x_2^3} + \frac{19}{x_3^3} + \frac{7}{x_4^3} + \frac{1}{x_5^3} \le 1 ,\qquad
//!    1 \le x_j \le 10 , $$
//!
//! from xⱼ = 5. The optimum is known in closed form: with a the coefficients, xⱼ = K aⱼ^¼ and K³ = Σ aⱼ^¼.
//!
//! # Sources
//! Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, section 6; its convex problem.

use super::Optimum;
use crate::function;
use crate::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity};
use autodiff::Scalar;
use error::Result;

/// Shares of the segments in the tip deflection, from the wall to the tip.
pub const SHARES: [f64; 5] = [61.0, 37.0, 19.0, 7.0, 1.0];
/// Weight of a segment per unit of its height.
pub const DENSITY: f64 = 0.0624;

/// Tip deflection divided by its limit, the only response.
struct Tip;

impl ClosedForm for Tip {
    fn response<S: Scalar>(&self, _: usize, x: &[S], _: S) -> S {
        x.iter().zip(SHARES).fold(S::from(0.0), |sum, (x, share)| sum + x.powi(-3) * share)
    }
}

/// The problem. The weight is explicit, the deflection is the response of an analysis.
pub fn problem() -> Result<Problem> {
    let mut parts = ProblemBuilder::new("cantilever");
    for k in 1..=5 {
        parts.variable(DesignVariable::new(format!("x{k}"), "", 5.0).within(1.0, 10.0));
    }
    let tip = parts.constant("tip deflection", "");
    let weight = function!(|p| p.design.iter().fold(S::from(0.0), |a, &x| a + x) * DENSITY);
    parts.minimize("weight", "", Quantity::plain(weight));
    parts.subject_to(Constraint::at_most("stiff", 1.0, Quantity::plain(function!(|p| p.response[0])).of(&[tip])));
    parts.build_analytic(Tip)
}

/// The optimum; published as 1.340 at (6.016, 5.309, 4.494, 3.502, 2.153).
pub const fn optimum() -> Optimum {
    let design = &[6.016_015_9, 5.309_173_9, 4.494_329_6, 3.501_474_9, 2.152_665_3];
    Optimum::published(1.339_956_361, design, "Svanberg 1987, here to nine digits by its closed form")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_optimum_is_its_closed_form() {
        let factor = SHARES.iter().map(|a| a.powf(0.25)).sum::<f64>().cbrt();
        let design: Vec<f64> = SHARES.iter().map(|a| factor * a.powf(0.25)).collect();
        let problem = problem().unwrap();
        let there = problem.evaluate(&design, &problem.analyze(&design).unwrap()).unwrap();
        assert!((there.objective - optimum().objective).abs() < 1e-9, "{:.10}", there.objective);
        assert!(there.max_violation_pct().abs() < 1e-12);
        for (x, known) in design.iter().zip(optimum().design.unwrap()) {
            assert!((x - known).abs() < 1e-7, "{x:.8}");
        }
    }

    #[test]
    fn the_start_weighs_what_is_printed() {
        let problem = problem().unwrap();
        let start = problem.start();
        let here = problem.evaluate(&start, &problem.analyze(&start).unwrap()).unwrap();
        assert!((here.objective - 1.56).abs() < 1e-15 && here.max_violation_pct().abs() < 1e-12);
    }
}
