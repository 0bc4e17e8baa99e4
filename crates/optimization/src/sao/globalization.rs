//! Acceptance of a proposed design.

use super::Trial;
use crate::problem::{Evaluation, Problem};
use error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The decision on a proposed design.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum StepVerdict {
    /// The design is accepted and starts the next cycle.
    Accept,
    /// The cycle is repeated from the same design with other move limits.
    Reject,
    /// The cycle is repeated from the same design with the same move limits and more conservatism.
    IncreaseConservatism,
}

/// Data that a globalization stores from cycle to cycle.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GlobalizationState {
    /// Conservatism ρ of the objective, then of each constraint, in the unit of each; empty for none.
    pub conservatism: Vec<f64>,
    /// The filter: largest violation (as a fraction) and objective of designs that no other one dominates.
    pub filter: Vec<[f64; 2]>,
}

/// A rule that accepts or rejects trial steps. Values hold settings only; their data are in the [`GlobalizationState`].
pub trait Globalization: Send + Sync + std::fmt::Debug {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] for a setting out of range.
    fn check(&self) -> Result<()> {
        Ok(())
    }
    /// True if accepted designs are to be feasible at all time points, retained or not.
    fn keeps_feasible(&self) -> bool {
        false
    }
    /// The state at the start design.
    fn start(&self, _problem: &Problem, _first: &Evaluation) -> GlobalizationState {
        GlobalizationState::default()
    }
    /// The decision on a trial step; one whose analysis failed is rejected without this method.
    fn judge(&self, trial: &Trial, state: &mut GlobalizationState) -> StepVerdict;
}

/// Accepts a design unless the approximation errors there are too large: the paper's rule.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBased {
    /// E = max(E_f, E_g) in percent above which the cycle is rejected. In the paper's tables 28.7 is accepted, 41.6 is not.
    pub reject_above_pct: f64,
}

impl Default for ErrorBased {
    fn default() -> Self {
        Self { reject_above_pct: 30.0 }
    }
}

impl Globalization for ErrorBased {
    fn check(&self) -> Result<()> {
        let limit = self.reject_above_pct;
        Error::check_option("error above which a cycle is rejected", "positive", limit, limit > 0.0)
    }

    fn judge(&self, trial: &Trial, _: &mut GlobalizationState) -> StepVerdict {
        let error = trial.outcome.as_ref().map_or(f64::INFINITY, |o| o.error_pct());
        if error > self.reject_above_pct { StepVerdict::Reject } else { StepVerdict::Accept }
    }
}

/// Accepts a design unless it violates constraints by more than a limit and by more than the previous design.
///
/// From a feasible start the run stays near the feasible region. The error-based rule rejects feasible and better designs
/// where responses change fast, for example near a resonance, and may accept infeasible ones that lead to a local
/// minimum of the violation. Errors still determine the move limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StayFeasible {
    /// V in percent up to which a design is always accepted.
    pub violation_pct: f64,
}

impl Default for StayFeasible {
    fn default() -> Self {
        Self { violation_pct: 3.0 }
    }
}

impl Globalization for StayFeasible {
    fn check(&self) -> Result<()> {
        let limit = self.violation_pct;
        Error::check_option("violation above which a cycle is rejected", "not negative", limit, limit >= 0.0)
    }

    fn keeps_feasible(&self) -> bool {
        true
    }

    fn judge(&self, trial: &Trial, _: &mut GlobalizationState) -> StepVerdict {
        let violation = trial.outcome.as_ref().map_or(f64::INFINITY, |o| o.violation_pct);
        if violation > self.violation_pct.max(100.0 * trial.violation_before) {
            StepVerdict::Reject
        } else {
            StepVerdict::Accept
        }
    }
}

/// Accepts every design that can be analysed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AcceptAlways;

impl Globalization for AcceptAlways {
    fn judge(&self, _: &Trial, _: &mut GlobalizationState) -> StepVerdict {
        StepVerdict::Accept
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sao::Outcome;

    #[test]
    fn staying_feasible_depends_on_the_violation_and_not_on_the_error() {
        let judge = |before: f64, violation_pct: f64| {
            let outcome = Outcome {
                objective: 1.0,
                objective_error_pct: 0.0,
                constraint_error_pct: 120.0,
                violation_pct,
                is_approximate: true,
                shortfall: vec![0.0],
            };
            let trial = Trial {
                from: &[1.0],
                to: &[2.0],
                last_step: None,
                at_limit: &[false],
                is_bounded: vec![true],
                objective_before: 2.0,
                violation_before: before.max(0.0) / 100.0,
                approximate_violation: 0.0,
                multipliers: 0.0,
                lagrangian: None,
                distance: 0.0,
                approximate_objective: 1.0,
                outcome: Some(outcome),
            };
            StayFeasible::default().judge(&trial, &mut GlobalizationState::default())
        };
        assert_eq!([judge(-5.0, -1.0), judge(-5.0, 2.9), judge(20.0, 15.0)], [StepVerdict::Accept; 3]);
        assert_eq!([judge(-5.0, 3.1), judge(20.0, 25.0)], [StepVerdict::Reject; 2]);
        assert!(StayFeasible { violation_pct: -1.0 }.check().is_err());
    }
}
