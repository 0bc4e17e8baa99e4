//! What a subproblem solver hands back.

use super::KktResidual;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What the mathematics concluded.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Status {
    /// A point that satisfies the optimality conditions.
    Solved,
    /// No point satisfies all rows: the rows are violated least, and among such points the objective is smallest.
    Relaxed,
    /// The objective falls without limit at feasible points.
    Unbounded,
    /// The iterations ran out before the optimality conditions held.
    IterationLimit,
    /// No further progress is possible, yet the optimality conditions do not hold.
    Stalled,
}

impl Status {
    /// True for a solution of the program as it was posed.
    pub fn was_successful(self) -> bool {
        self == Self::Solved
    }

    /// True where the point means something: a solution of the program or of its least relaxation.
    pub fn is_usable(self) -> bool {
        matches!(self, Self::Solved | Self::Relaxed)
    }
}

impl fmt::Display for Status {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Solved => "solved",
            Self::Relaxed => "relaxed: no feasible point, rows violated least",
            Self::Unbounded => "unbounded below",
            Self::IterationLimit => "iteration limit",
            Self::Stalled => "stalled before the optimality conditions held",
        })
    }
}

/// Evaluations of the program that a solution took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Evaluations {
    /// Calls of [`Program::values`](crate::Program::values), failed ones included.
    pub values: usize,
    /// Calls of [`Program::gradients`](crate::Program::gradients).
    pub gradients: usize,
    /// Calls of [`Program::lagrangian_hessian`](crate::Program::lagrangian_hessian).
    pub hessians: usize,
}

impl std::ops::Add for Evaluations {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self {
            values: self.values + other.values,
            gradients: self.gradients + other.gradients,
            hessians: self.hessians + other.hessians,
        }
    }
}

/// A point, its multipliers and how good they are.
///
/// The multipliers belong to L = f + Σ λᵢ gᵢ − Σ μₗ (x − l) + Σ μᵤ (x − u) (or its relaxation g ≤ t). They are
/// non-negative, but for equality rows, whose multiplier may have either sign. Their unit is that of the objective over
/// that of the row or variable.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Solution {
    /// The point, length n.
    pub x: Vec<f64>,
    /// Objective at the point.
    pub objective: f64,
    /// Rows at the point, length m.
    pub rows: Vec<f64>,
    /// λ, length m.
    pub multipliers: Vec<f64>,
    /// μₗ, length n.
    pub lower_multipliers: Vec<f64>,
    /// μᵤ, length n.
    pub upper_multipliers: Vec<f64>,
    /// Iterations done: of the interior point for linear and quadratic programs, of the outer loop otherwise.
    pub iterations: usize,
    /// Evaluations of the program.
    pub evaluations: Evaluations,
    /// What the mathematics concluded.
    pub status: Status,
    /// The largest amount by which a row is relaxed; `None` unless relaxed.
    pub relaxation: Option<f64>,
    /// The amounts tᵢ ≥ 0 by which the rows are relaxed, g ≤ t (and |g| ≤ t in equality rows): the same for all where
    /// the rows are comparable, in units of each row's change over the scales of the variables where these differ by more
    /// than 1e4. Empty unless relaxed.
    pub relaxed_rows: Vec<f64>,
    /// How well the optimality conditions hold, computed apart from the solver.
    pub kkt: KktResidual,
}
