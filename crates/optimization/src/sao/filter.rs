//! Filters: a design is accepted if it is better than every earlier one in the objective or in the violation.

use super::{Conservatism, Globalization, GlobalizationState, StepVerdict, Trial};
use crate::problem::{Evaluation, Problem};
use error::{Error, Result};

/// A trust-region filter.
///
/// With h the largest violation (as a fraction, at least 0) and F the objective, a design is accepted if for every pair
/// (hᵢ, Fᵢ) in the filter and for the start of the cycle
///
/// $$ h \le (1 - γ) h_i \quad\text{or}\quad F \le F_i - γ h . $$
///
/// If the approximate problem predicts a decrease of the objective ΔF̃ > 0 that outweighs the violation at the start of the
/// cycle, F must also decrease by at least σ ΔF̃. The start of a cycle without such a prediction is added to the
/// filter. A rejected cycle is repeated with other move limits: combine it with [`TrustRegion`](super::TrustRegion).
///
/// # Sources
///
/// Fletcher, Leyffer & Toint, *SIAM J. Optim.* 13 (2002) 44–59, with h the largest violation. We differ: the
/// restoration phase is the relaxation of the subproblem.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Filter {
    /// γ, the margin; between 0 and 1.
    pub margin: f64,
    /// σ, the fraction of the predicted decrease that must be reached; between 0 and 1.
    pub fraction: f64,
    /// Largest violation, as a fraction, of a design that counts as feasible.
    pub tolerance: f64,
    /// Largest violation, as a fraction, of an accepted design; that of the start is accepted in any case.
    pub ceiling: f64,
}

impl Default for Filter {
    fn default() -> Self {
        Self { margin: 1e-5, fraction: 0.1, tolerance: 1e-10, ceiling: 0.2 }
    }
}

impl Filter {
    fn violation(&self, pct: f64) -> f64 {
        let h = (pct / 100.0).max(0.0);
        if h <= self.tolerance { 0.0 } else { h }
    }

    /// The first entry, an upper bound of the violation.
    fn ceiling(&self, first: &Evaluation) -> [f64; 2] {
        [self.ceiling.max(2.0 * self.violation(first.max_violation_pct())), f64::MIN]
    }

    /// Returns true if the filter accepts the trial step. The start of an accepted step may be added to the filter.
    fn accepts(&self, trial: &Trial, state: &mut GlobalizationState) -> bool {
        let Some(outcome) = &trial.outcome else { return false };
        let (h, f) = (self.violation(outcome.violation_pct), outcome.objective);
        let before = [self.violation(100.0 * trial.violation_before), trial.objective_before];
        // Differences in the last digits of the objective are ignored.
        let noise = 1e-10 * trial.objective_before.abs();
        let better = |&[hi, fi]: &[f64; 2]| h < (1.0 - self.margin) * hi || f <= fi - self.margin * h + noise;
        if !state.filter.iter().all(better) || !(better(&before) || (h == 0.0 && before[0] > 0.0)) {
            return false;
        }
        let predicted = trial.objective_before - trial.approximate_objective;
        let must_decrease = predicted > noise && predicted >= before[0] * before[0] * trial.objective_before.abs();
        let decreases = must_decrease && trial.objective_before - f >= self.fraction * predicted - noise;
        if must_decrease && !decreases && h >= before[0] {
            return false;
        }
        // A step that is accepted for its violation must not be undone by the next one: the filter stores its start.
        if !decreases {
            state.filter.retain(|&[hi, fi]| hi < before[0] || fi < before[1]);
            if before[0] > 0.0 {
                state.filter.push(before);
            }
        }
        true
    }
}

impl Globalization for Filter {
    fn check(&self) -> Result<()> {
        let fraction = |v: f64| v > 0.0 && v < 1.0;
        Error::check_option("margin of the filter", "between 0 and 1", self.margin, fraction(self.margin))?;
        Error::check_option(
            "fraction of the predicted decrease",
            "between 0 and 1",
            self.fraction,
            fraction(self.fraction),
        )?;
        Error::check_option("tolerance of the filter", "at least 0", self.tolerance, self.tolerance >= 0.0)?;
        Error::check_option("ceiling of the filter", "positive", self.ceiling, self.ceiling > 0.0)
    }

    fn start(&self, _: &Problem, first: &Evaluation) -> GlobalizationState {
        GlobalizationState { filter: vec![self.ceiling(first)], ..Default::default() }
    }

    fn judge(&self, trial: &Trial, state: &mut GlobalizationState) -> StepVerdict {
        if self.accepts(trial, state) { StepVerdict::Accept } else { StepVerdict::Reject }
    }
}

/// Filtered conservatism: accepts designs that the filter accepts, and repeats the others with more conservatism.
///
/// A rejected design that was approximated conservatively is repeated with other move limits.
///
/// # Sources
///
/// Groenwold & Etman, *Struct. Multidisc. Optim.* 42 (2010) 165–178.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FilteredConservatism {
    /// The filter.
    pub filter: Filter,
    /// The conservatism.
    pub conservatism: Conservatism,
}

impl Globalization for FilteredConservatism {
    fn check(&self) -> Result<()> {
        Globalization::check(&self.filter)?;
        self.conservatism.check()
    }

    fn start(&self, problem: &Problem, first: &Evaluation) -> GlobalizationState {
        GlobalizationState { filter: vec![self.filter.ceiling(first)], ..self.conservatism.initial(problem, first) }
    }

    fn judge(&self, trial: &Trial, state: &mut GlobalizationState) -> StepVerdict {
        if self.filter.accepts(trial, state) {
            self.conservatism.relax(trial, state);
            StepVerdict::Accept
        } else if self.conservatism.is_conservative(trial) {
            StepVerdict::Reject
        } else {
            self.conservatism.increase(trial, state)
        }
    }
}
