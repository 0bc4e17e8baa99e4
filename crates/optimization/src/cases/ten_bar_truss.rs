//! The ten-bar truss, with equal allowed stresses and with a stronger ninth bar.
//!
//! Six nodes in two bays of 360 in, two of them supported; 100 kip down at both lower free nodes. Minimize the weight
//! 0.1 lb/in³ Σ Aᵢ Lᵢ over the areas Aᵢ ≥ 0.1 in², from 5 in², with stresses within ± 25 ksi. With a larger allowed stress in
//! bar 9 the optimum is not fully stressed. Units are those of the source: in, lb, ksi.
//!
//! # Sources
//! Haftka & Gürdal, *Elements of Structural Optimization*, 3rd ed. (1992), example 6.1.1 and chapter 9.

use super::{Optimum, truss::Truss};
use crate::problem::{DesignVariable, Problem, ProblemBuilder};
use error::{Error, Result};

const BAY: f64 = 360.0;
const NODES: [[f64; 2]; 6] = [[2.0 * BAY, BAY], [2.0 * BAY, 0.0], [BAY, BAY], [BAY, 0.0], [0.0, BAY], [0.0, 0.0]];
const BARS: [[usize; 2]; 10] = [[4, 2], [2, 0], [5, 3], [3, 1], [2, 3], [0, 1], [4, 3], [2, 5], [2, 1], [0, 3]];
/// lb/in³.
const DENSITY: f64 = 0.1;

/// The problem with an allowed stress of ± `ninth` ksi in bar 9 and ± 25 ksi in the other bars.
///
/// The weight is explicit, the stresses are the responses of an analysis.
///
/// # Errors
/// [`Error::Option`] unless `ninth` is positive and finite.
pub fn problem(ninth: f64) -> Result<Problem> {
    let is_valid = ninth > 0.0 && ninth.is_finite();
    Error::check_option("allowed stress of bar 9", "positive and finite", ninth, is_valid)?;
    let down = [0.0, -100.0];
    let truss = Truss::new(&NODES, &BARS, &[(1, down), (3, down)], &[4, 5])?;
    let mut parts = ProblemBuilder::new(if ninth == 25.0 { "ten-bar truss" } else { "ten-bar truss, strong bar 9" });
    for bar in 1..=BARS.len() {
        parts.variable(DesignVariable::new(format!("area {bar}"), "in²", 5.0).within(0.1, 15.0));
    }
    let weights = truss.lengths().iter().map(|l| l * DENSITY).collect();
    let allowed = (1..=BARS.len()).map(|bar| if bar == 9 { ninth } else { 25.0 }).collect();
    truss.least_weight(parts, ("lb", weights), ("ksi", allowed))
}

/// The problem with ± 25 ksi in all bars.
pub fn equal_strengths() -> Result<Problem> {
    problem(25.0)
}

/// The problem with ± 75 ksi in bar 9.
pub fn strong_ninth_bar() -> Result<Problem> {
    problem(75.0)
}

/// The optimum of [`equal_strengths`], which is fully stressed.
pub const fn equal_strengths_optimum() -> Optimum {
    let design = &[7.9379, 0.1, 8.0621, 3.9379, 0.1, 0.1, 5.7447, 5.5690, 5.5690, 0.1];
    Optimum::published(1593.181, design, "Haftka & Gürdal 1992, here to seven digits").within(1e-6)
}

/// The optimum of [`strong_ninth_bar`], the same for 50 ksi: bar 9 is not at its limit.
pub const fn strong_ninth_bar_optimum() -> Optimum {
    let design = &[7.9, 0.1, 8.1, 3.9, 0.1, 0.1, 5.7983, 5.5154, 3.6770, 0.141_42];
    Optimum::published(1497.600, design, "Haftka & Gürdal 1992, here to seven digits").within(1e-6)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_start_and_both_optima_weigh_what_is_printed() {
        for (problem, optimum) in [
            (equal_strengths().unwrap(), equal_strengths_optimum()),
            (strong_ninth_bar().unwrap(), strong_ninth_bar_optimum()),
        ] {
            let at = |b: &[f64]| problem.evaluate(b, &problem.analyze(b).unwrap()).unwrap();
            assert!((at(&problem.start()).objective - 2098.2).abs() < 0.05);
            let there = at(optimum.design.unwrap());
            assert!((there.objective / optimum.objective - 1.0).abs() < 1e-5, "{}", there.objective);
            assert!(there.max_violation_pct() < 1e-2, "{}", there.max_violation_pct());
        }
        assert!(problem(f64::NAN).is_err());
    }
}
