//! When a run ends, and why, in words.

use super::{Cycle, State};
use crate::error::{Error, Result};
use crate::problem::Problem;
use serde::{Deserialize, Serialize};

/// What the mathematics concluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Status {
    /// Not ended yet.
    Running,
    /// The objective has settled and no constraint is violated.
    Converged,
    /// The cycles are used up.
    CycleLimit,
    /// The move limits have shrunk to nothing without an acceptable design.
    Stalled,
    /// The design has settled where constraints are violated.
    Infeasible,
}

impl Status {
    /// True if the last design is a solution.
    pub fn is_success(self) -> bool {
        self == Self::Converged
    }
}

/// The stop test.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stop {
    /// Relative change of the objective over an accepted cycle, and violation (as a fraction), below which the run has
    /// converged. The paper's is 1e-5.
    pub accuracy: f64,
    /// Most cycles, accepted or not.
    pub max_cycles: usize,
    /// Largest move-limit factor below which the run has stalled.
    pub smallest_factor: f64,
}

impl Default for Stop {
    fn default() -> Self {
        Self { accuracy: 1e-5, max_cycles: 100, smallest_factor: 1e-7 }
    }
}

impl Stop {
    /// Refuses settings out of range.
    pub fn check(&self) -> Result<()> {
        let positive = |v: f64| v > 0.0 && v < 1.0;
        Error::check_option("accuracy", "between 0 and 1", self.accuracy, positive(self.accuracy))?;
        Error::check_option(
            "smallest factor",
            "between 0 and 1",
            self.smallest_factor,
            positive(self.smallest_factor),
        )?;
        Error::check_option("number of cycles", "at least 1", self.max_cycles as f64, self.max_cycles > 0)
    }

    /// The status after the last cycle of `state`, and the reason in words.
    pub fn test(&self, problem: &Problem, state: &State) -> (Status, String) {
        let Some(last) = state.history.last() else { return (Status::Running, String::new()) };
        if let Some(verdict) = self.settled(problem, state, last) {
            return verdict;
        }
        let largest = state.factors.iter().copied().fold(0.0, f64::max);
        if largest < self.smallest_factor {
            let reason = format!("all move-limit factors are below {:e} after {}", self.smallest_factor, words(last));
            return (Status::Stalled, reason);
        }
        let tries = state.history.len() - 1;
        if tries >= self.max_cycles {
            return (Status::CycleLimit, format!("{tries} cycles are done; continue with a larger number of cycles"));
        }
        (Status::Running, String::new())
    }

    /// Whether the objective has stopped changing.
    fn settled(&self, problem: &Problem, state: &State, last: &Cycle) -> Option<(Status, String)> {
        if !last.accepted || last.cycle == 0 {
            return None;
        }
        let before = state.history.iter().rev().skip(1).find(|c| c.accepted)?.objective;
        let scale = if before == 0.0 { 1.0 } else { before.abs() };
        let change = (last.objective - before).abs() / scale;
        let violation = last.violation_pct / 100.0;
        if change < self.accuracy && violation < self.accuracy {
            let reason = format!(
                "the objective changed by {:.1e} of itself and the largest violation is {violation:.1e}, both below {:e}",
                change, self.accuracy
            );
            return Some((Status::Converged, reason));
        }
        let still = last.max_variable_change_pct / 100.0 < self.accuracy;
        if still && violation >= self.accuracy && last.relaxation > 0.0 {
            let worst = last.worst.map_or_else(String::new, |row| problem.row_in_words(row));
            let reason = format!(
                "no design within the move limits is feasible; {worst} is exceeded by {violation:.1e} of its scale"
            );
            return Some((Status::Infeasible, reason));
        }
        None
    }
}

fn words(cycle: &Cycle) -> String {
    match &cycle.failure {
        Some(failure) => format!("a failed analysis ({failure})"),
        None if cycle.accepted => format!("cycle {}", cycle.cycle),
        None => format!("a rejected try of cycle {}", cycle.cycle),
    }
}
