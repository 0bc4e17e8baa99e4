//! The stop test.

use super::{Cycle, RunState, Status};
use crate::problem::Problem;
use error::{Error, Result};

/// Decrease of the objective, relative to its first values, above which the problem seems to be unbounded, and the largest violation at
/// which this is concluded.
const UNBOUNDED: [f64; 2] = [1e8, 0.01];
/// Decrease of the objective, relative to its values in the first accepted steps, that ends a run; and the number of these.
const WITHOUT_LIMIT: f64 = 1e12;
const FIRST: usize = 10;
/// Number of the last accepted steps over which an unbounded objective still grows by this factor. The first values may be nearly zero.
const STILL_FALLS: (usize, f64) = (4, 2.0);

/// The stop test.
///
/// A run has converged if an accepted cycle meets three conditions: the relative change of the objective is below
/// [`accuracy`](Self::accuracy), no constraint is violated by more than that, and the residual of the optimality
/// conditions at the start of the cycle ([`Cycle::residual`]) is at most [`residual`](Self::residual). Short steps because
/// of small move limits, near asymptotes or high conservatism therefore do not count as convergence. The end is then
/// [confirmed](super::Confirmation). [`Stop::as_published`] has the first two conditions alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Relative change of the objective over an accepted cycle, and violation (as a fraction), below which the run has
    /// converged. The paper's is 1e-5.
    pub accuracy: f64,
    /// Residual of the optimality conditions at the start of the last cycle, relative to the objective, above which the run has
    /// not converged. The relative error of the objective is of second order in it, so that √accuracy is a strict
    /// value. Ten times that value detects runs that stall, and does not change the number of cycles in any table of the paper.
    pub residual: f64,
    /// True if the end of a run is [confirmed](super::Confirmation) by the automatic method, at the cost of a sensitivity analysis
    /// and a few analyses.
    pub confirm: bool,
    /// Largest number of cycles, accepted or not.
    pub max_cycles: usize,
    /// Largest move-limit factor below which the run has stalled.
    pub smallest_factor: f64,
}

impl Default for Stop {
    fn default() -> Self {
        Self { accuracy: 1e-5, residual: 0.03, confirm: true, max_cycles: 100, smallest_factor: 1e-7 }
    }
}

impl Stop {
    /// The paper's test of objective and violation alone. If move limits shrink quickly, it ends a run too early.
    pub fn as_published() -> Self {
        Self { residual: f64::INFINITY, confirm: false, ..Self::default() }
    }

    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] for a setting out of range.
    pub fn check(&self) -> Result<()> {
        let positive = |v: f64| v > 0.0 && v < 1.0;
        Error::check_option("accuracy", "between 0 and 1", self.accuracy, positive(self.accuracy))?;
        Error::check_option("residual of the stop test", "positive", self.residual, self.residual > 0.0)?;
        Error::check_option(
            "smallest factor",
            "between 0 and 1",
            self.smallest_factor,
            positive(self.smallest_factor),
        )?;
        Error::check_option("number of cycles", "at least 1", self.max_cycles as f64, self.max_cycles > 0)
    }

    /// The status after the last cycle of `state`, and the reason in words.
    pub(super) fn test(&self, problem: &Problem, state: &RunState) -> (Status, String) {
        let Some(last) = state.history.last() else { return (Status::Running, String::new()) };
        if let Some(verdict) = self.settled(problem, state, last) {
            return verdict;
        }
        let largest = state.factors.iter().copied().fold(0.0, f64::max);
        if largest < self.smallest_factor {
            let reason = format!("all move-limit factors are below {:e} after {}", self.smallest_factor, words(last));
            return (Status::Stalled, reason);
        }
        self.cycle_limit(state)
    }

    /// The status by the number of cycles, and by an objective that falls without limit.
    pub(super) fn cycle_limit(&self, state: &RunState) -> (Status, String) {
        let trials = state.history.len() - 1;
        if falls_without_limit(state) {
            let reason =
                format!("the objective seems to be unbounded, after {trials} trial steps: add bounds or constraints");
            return (Status::Stalled, reason);
        }
        if trials >= self.max_cycles {
            let accepted = state.history.iter().filter(|cycle| cycle.accepted).count() - 1;
            let remedy = if is_unbounded(state) {
                "the objective seems to be unbounded: add bounds or constraints"
            } else {
                "continue with a larger number of cycles"
            };
            let reason = format!("{trials} trial steps are done, {accepted} of them accepted; {remedy}");
            return (Status::CycleLimit, reason);
        }
        (Status::Running, String::new())
    }

    /// True if an accepted cycle without violation changed the objective little from `before`.
    pub(super) fn has_settled(&self, cycle: &Cycle, before: f64) -> bool {
        let change = relative_change(cycle.objective, before);
        cycle.accepted && change < self.accuracy && cycle.violation_pct / 100.0 < self.accuracy
    }

    /// Status and reason, if the run seems to have ended.
    fn settled(&self, problem: &Problem, state: &RunState, last: &Cycle) -> Option<(Status, String)> {
        if !last.accepted || last.cycle == 0 {
            return None;
        }
        let before = state.history.iter().rev().skip(1).find(|c| c.accepted)?.objective;
        let violation = last.violation_pct / 100.0;
        let residual = last.residual.filter(|r| *r <= self.residual && self.has_settled(last, before));
        if let Some(residual) = residual {
            let reason = format!(
                "the objective changed by {:.1e} of itself and the largest violation is {violation:.1e}, both below {:e}; \
                 the optimality conditions hold to {residual:.1e}",
                relative_change(last.objective, before),
                self.accuracy
            );
            return Some((Status::Converged, reason));
        }
        let is_settled = last.max_variable_change_pct / 100.0 < self.accuracy;
        if is_settled && violation >= self.accuracy && last.relaxation > 0.0 {
            let worst = last.worst.map_or_else(String::new, |row| problem.row_in_words(row));
            let reason = format!(
                "no design within the move limits is feasible; {worst} is violated by {violation:.1e} of its scale"
            );
            return Some((Status::Infeasible, reason));
        }
        None
    }
}

/// True if the minimized objective is negative, huge compared with its first values, and still falls.
fn is_unbounded(state: &RunState) -> bool {
    let accepted: Vec<f64> = state.history.iter().filter(|cycle| cycle.accepted).map(|cycle| cycle.objective).collect();
    let first = accepted.iter().take(2).fold(0.0, |m: f64, objective| m.max(objective.abs()));
    let (steps, factor) = STILL_FALLS;
    let before = accepted.iter().rev().nth(steps).map_or(0.0, |objective| objective.abs());
    let is_feasible = state.evaluation.max_violation_pct() <= 100.0 * UNBOUNDED[1];
    is_feasible && state.evaluation.objective < -(UNBOUNDED[0] * first).max(factor * before)
}

/// True if the minimized objective is negative and huge compared with its values in many steps at first, and still falls.
fn falls_without_limit(state: &RunState) -> bool {
    let accepted = || state.history.iter().filter(|cycle| cycle.accepted).map(|cycle| cycle.objective);
    let first = accepted().take(FIRST).fold(0.0, |m: f64, objective| m.max(objective.abs()));
    accepted().count() >= 2 * FIRST && state.evaluation.objective < -WITHOUT_LIMIT * first && is_unbounded(state)
}

fn relative_change(objective: f64, before: f64) -> f64 {
    (objective - before).abs() / if before == 0.0 { 1.0 } else { before.abs() }
}

fn words(cycle: &Cycle) -> String {
    match &cycle.failure {
        Some(failure) => format!("a failed analysis ({failure})"),
        None if cycle.accepted => format!("cycle {}", cycle.cycle),
        None => format!("a rejected trial step of cycle {}", cycle.cycle),
    }
}
