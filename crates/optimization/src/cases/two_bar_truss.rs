//! Svanberg's two-bar truss: an area and a shape variable, two stresses.
//!
//! $$ \min\ x_1 \sqrt{1 + x_2^2} \quad\text{subject to}\quad
//!    0.124 \sqrt{1 + x_2^2} \Bigl( \frac{8}{x_1} \pm \frac{1}{x_1 x_2} \Bigr) \le 1 ,\qquad
//!    0.2 \le x_1 \le 4 ,\quad 0.1 \le x_2 \le 1.6 , $$
//!
//! from (1.5, 0.5). x₁ is the area of both bars in cm², x₂ half the distance of their supports in m. The stresses rise and
//! fall with x₂: SLP and CONLIN oscillate forever, MMA converges.
//!
//! # Sources
//! Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, section 6; its two-bar truss.

use super::Optimum;
use crate::function;
use crate::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity};
use autodiff::Scalar;
use error::Result;

/// Stress of a bar divided by its limit: response 0 with the sign +, response 1 with −.
struct Stresses;

impl ClosedForm for Stresses {
    fn response<S: Scalar>(&self, h: usize, x: &[S], _: S) -> S {
        let side = (x[0] * x[1]).recip() * if h == 0 { 1.0 } else { -1.0 };
        length(x[1]) * (x[0].recip() * 8.0 + side) * 0.124
    }
}

/// √(1 + x₂²), the length of a bar in m.
fn length<S: Scalar>(x: S) -> S {
    (x * x + 1.0).sqrt()
}

/// The problem. The weight is explicit, the stresses are the responses of an analysis.
pub fn problem() -> Result<Problem> {
    let mut parts = ProblemBuilder::new("two-bar truss");
    parts.variable(DesignVariable::new("area", "cm²", 1.5).within(0.2, 4.0));
    parts.variable(DesignVariable::new("half span", "m", 0.5).within(0.1, 1.6));
    parts.minimize("weight", "", Quantity::plain(function!(|p| p.design[0] * length(p.design[1]))));
    for bar in ["bar 1", "bar 2"] {
        let stress = parts.constant(&format!("stress of {bar}"), "");
        let quantity = Quantity::plain(function!(|p| p.response[0])).of(&[stress]);
        parts.subject_to(Constraint::at_most(bar, 1.0, quantity));
    }
    parts.build_analytic(Stresses)
}

/// The optimum; published as 1.51 at (1.41, 0.38). Bar 1 alone is active.
pub const fn optimum() -> Optimum {
    let source = "Svanberg 1987, here to eight digits";
    Optimum::published(1.508_652_42, &[1.411_631, 0.377_072], source).within(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_optimum_is_stationary_along_its_active_stress() {
        let problem = problem().unwrap();
        // With bar 1 active x₁ = 0.124 √(1 + x₂²)(8 + 1/x₂), and F = 0.124 (1 + x₂²)(8 + 1/x₂) is least where
        // 16 x₂³ + x₂² = 1.
        let x2 = optimum().design.unwrap()[1];
        assert!((16.0 * x2.powi(3) + x2 * x2 - 1.0).abs() < 1e-5);
        let x1 = 0.124 * length(x2) * (8.0 + 1.0 / x2);
        let there = problem.evaluate(&[x1, x2], &problem.analyze(&[x1, x2]).unwrap()).unwrap();
        assert!((there.objective - optimum().objective).abs() < 1e-8, "{:.9}", there.objective);
        assert!(there.max_violation_pct().abs() < 1e-12);
    }
}
