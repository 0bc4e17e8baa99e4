//! Fixed move limits and the classical trust region.

use super::{MoveLimits, Region, StepVerdict, Trial};
use crate::problem::Problem;
use error::{Error, Result};

/// The part of the design space within `fraction` × scale of the design, where the scale of a variable is its range if it is
/// bounded, else |its start|, else 1.
fn scaled_box(problem: &Problem, b: &[f64], factors: &[f64]) -> Region {
    let widths: Vec<f64> = problem.scales().iter().zip(factors).map(|(s, f)| s * f).collect();
    Region::around(problem, b, &widths)
}

fn check_width(width: f64) -> Result<()> {
    Error::check_option("width of the search region", "positive and finite", width, width > 0.0 && width.is_finite())
}

/// Fixed move limits: `width` × the scale of the variable on both sides.
///
/// A rejected cycle halves them until the next accepted one, since the same step would be proposed again. The start gives little
/// information about the scale of a variable without range: its limits are doubled by each step that ends at one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FixedLimits {
    /// Half the width of the region in scales of the variable; with 1 it contains the whole range of a bounded variable.
    pub width: f64,
}

impl Default for FixedLimits {
    fn default() -> Self {
        Self { width: 1.0 }
    }
}

impl MoveLimits for FixedLimits {
    fn check(&self) -> Result<()> {
        check_width(self.width)
    }

    fn start(&self, n: usize) -> Vec<f64> {
        vec![self.width; n]
    }

    fn region(&self, problem: &Problem, b: &[f64], factors: &[f64]) -> Region {
        scaled_box(problem, b, factors)
    }

    fn update(&self, factors: &mut [f64], trial: &Trial, verdict: StepVerdict) {
        for (k, factor) in factors.iter_mut().enumerate() {
            *factor = match verdict {
                StepVerdict::Accept if trial.at_limit[k] && !trial.is_bounded[k] => 2.0 * factor.max(self.width),
                StepVerdict::Accept if trial.is_bounded[k] => self.width,
                StepVerdict::Accept => factor.max(self.width),
                _ => 0.5 * *factor,
            };
        }
    }
}

/// The classical trust region: a box whose size follows the ratio of actual to predicted decrease of a merit function.
///
/// The merit is φ = F + μ h with the largest violation h (as a fraction) and μ twice the sum of the multipliers of the
/// approximate problem. With the ratio ϱ = Δφ / Δφ̃ the box shrinks after a rejected cycle or ϱ below
/// [`poor`](Self::poor), and grows if ϱ exceeds [`good`](Self::good) and the design is at a side of the box.
///
/// With [`Merit::Lagrangian`] φ is the Lagrangian instead.
///
/// # Sources
///
/// Conn, Gould & Toint, *Trust-Region Methods* (2000), algorithm 6.1.1; exact penalty as in section 14.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TrustRegion {
    /// Merit function.
    pub merit: Merit,
    /// First half width in scales of the variable.
    pub initial: f64,
    /// Largest half width of a variable that has a range. The start gives little information about the scale of the others.
    pub cap: f64,
    /// Ratio below which the box shrinks.
    pub poor: f64,
    /// Ratio above which it grows.
    pub good: f64,
    /// Multiplier when it shrinks.
    pub shrink: f64,
    /// Multiplier when it grows.
    pub grow: f64,
}

/// The merit function of a [`TrustRegion`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Merit {
    /// F + μ h with the largest violation h and μ twice the sum of the multipliers. Curvature of the constraints,
    /// which linear rows neglect, increases h and lowers the ratio.
    #[default]
    Penalty,
    /// F + Σ λᵢ gᵢ with the multipliers of the approximate problem. The curvature of the constraints cancels if the
    /// approximate objective has the curvature of the Lagrangian
    /// ([`LagrangianCurvature`](crate::approximation::LagrangianCurvature)): the box is then not reduced unnecessarily.
    /// Combine it with a filter, which limits the violation.
    Lagrangian,
}

impl Default for TrustRegion {
    fn default() -> Self {
        Self { merit: Merit::Penalty, initial: 0.2, cap: 1.0, poor: 0.25, good: 0.75, shrink: 0.5, grow: 2.0 }
    }
}

impl TrustRegion {
    /// The ratio ϱ; `None` if no decrease was predicted.
    fn ratio(&self, trial: &Trial) -> Option<f64> {
        let outcome = trial.outcome.as_ref()?;
        if self.merit == Merit::Lagrangian {
            let [predicted, actual] = trial.lagrangian?;
            return (predicted > 1e-10 * trial.objective_before.abs()).then_some(actual / predicted);
        }
        let weight = 2.0 * trial.multipliers;
        let before = trial.objective_before + weight * trial.violation_before;
        let predicted = before - trial.approximate_objective - weight * trial.approximate_violation;
        let actual = before - outcome.objective - weight * (outcome.violation_pct / 100.0).max(0.0);
        (predicted > 1e-10 * before.abs()).then_some(actual / predicted)
    }
}

impl MoveLimits for TrustRegion {
    fn check(&self) -> Result<()> {
        check_width(self.initial)?;
        Error::check_option(
            "largest width of the search region",
            "at least the first",
            self.cap,
            self.cap >= self.initial,
        )?;
        Error::check_option("poor ratio", "below the good one", self.poor, self.poor < self.good)?;
        let shrinks = self.shrink > 0.0 && self.shrink < 1.0;
        Error::check_option("shrinking of the search region", "between 0 and 1", self.shrink, shrinks)?;
        Error::check_option("growing of the search region", "at least 1", self.grow, self.grow >= 1.0)
    }

    fn start(&self, n: usize) -> Vec<f64> {
        vec![self.initial; n]
    }

    fn region(&self, problem: &Problem, b: &[f64], factors: &[f64]) -> Region {
        scaled_box(problem, b, factors)
    }

    fn update(&self, factors: &mut [f64], trial: &Trial, verdict: StepVerdict) {
        let ratio = self.ratio(trial);
        let factor = if verdict != StepVerdict::Accept || ratio.is_some_and(|r| r < self.poor) {
            self.shrink
        } else if ratio.is_some_and(|r| r > self.good) && trial.at_limit.contains(&true) {
            self.grow
        } else {
            1.0
        };
        for (f, is_bounded) in factors.iter_mut().zip(&trial.is_bounded) {
            *f = if *is_bounded { (*f * factor).min(self.cap) } else { *f * factor };
        }
    }
}
