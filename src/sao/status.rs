//! The status of a run.

use serde::{Deserialize, Serialize};

/// The status of a run: running, or how it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Status {
    /// The run is not at its end.
    Running,
    /// The objective has settled, no constraint is violated, and the optimality conditions hold.
    Converged,
    /// The largest number of cycles is reached.
    CycleLimit,
    /// The move limits have become too small without an acceptable design.
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
