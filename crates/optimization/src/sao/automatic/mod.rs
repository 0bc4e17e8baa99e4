//! The automatic method: approximations selected by their prediction errors, in a filter trust-region method.
//!
//! | file | content |
//! |---|---|
//! | `numbers` | the numbers that are approximated |
//! | `candidates`, `quasi_newton` | the candidate approximations of a number |
//! | `selection` | prediction errors and the choice by them |
//! | `linearized`, `lengths` | first derivatives; lengths and units from what was seen |
//! | `surrogate` | the approximate problem |
//! | `restoration` | incompatible rows, stationary violation |
//! | `acceptance` | filter and box |
//! | `convergence` | the stop test |
//! | `cycle` | one cycle |
//! | `shape` | check of the data from a file |

mod acceptance;
mod candidates;
mod convergence;
mod cycle;
mod lengths;
mod linearized;
mod numbers;
mod quasi_newton;
mod restoration;
mod selection;
mod shape;
mod surrogate;

pub use acceptance::FilterEntry;
pub use candidates::{AcceptedPoint, Candidate};
pub(in crate::sao) use cycle::Continuation;
pub(in crate::sao) use lengths::spread;
pub use numbers::{Number, NumberGroup, NumberId};
pub use selection::Scores;

use error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Selection of approximations by their prediction errors, for problems of up to about a hundred variables: matrices are full.
///
/// All [`Candidate`]s are exact in value and gradient at the current design. At every analysed design the error of each
/// is known without another analysis: for each response, the one with the least errors is used next. One candidate concerns
/// the whole problem: linear responses with a BFGS matrix of the Lagrangian. The globalization does not depend on the
/// candidate: a filter, a box whose size follows the prediction, restoration where linearized rows are incompatible, and a
/// correction through rejected designs. The stop test is made in units of what was seen: scaling the objective,
/// constraints or variables, or adding a constant to the objective, changes the run by rounding only; but for variables without
/// range that start at zero and on which no row depends, whose first length is |F| / |∂F/∂b|.
///
/// The result satisfies the first-order conditions. Before the run ends, the Lagrangian is evaluated beside the design in
/// directions along the active rows that no step had, or in which the steps show no positive curvature: at a saddle point or a
/// maximum the run goes on. Not all directions are tried, so that this is no proof. A run may also end at a stationary point of the violation: it then reports
/// [`Status::Infeasible`](super::Status::Infeasible), which says nothing about other regions.
///
/// # Sources
///
/// Fletcher & Leyffer, *Math. Program.* 91 (2002) 239–269; Fletcher, Leyffer & Toint, *SIAM J. Optim.* 13 (2002) 44–59;
/// Fadel, Riley & Barthelemy, *Structural Optimization* 2 (1990) 117–124; Nocedal & Wright, *Numerical Optimization* (2006),
/// sections 6.2 and 18.2. The selection is our own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Automatic {
    /// Number of accepted steps from which quasi-Newton matrices are made, at least 1.
    pub memory: usize,
    /// Iterations of the subproblem solver, at least 1.
    pub iterations: usize,
}

impl Default for Automatic {
    fn default() -> Self {
        Self { memory: 30, iterations: 60 }
    }
}

impl Automatic {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] for a setting out of range.
    pub fn check(&self) -> Result<()> {
        let positive = |name, v: usize| Error::check_option(name, "at least 1", v as f64, v > 0);
        positive("memory of the automatic method", self.memory)?;
        positive("iterations of the subproblem solver", self.iterations)
    }
}

/// Data that the automatic method stores from cycle to cycle.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct AutomaticState {
    /// d of each variable.
    pub start_lengths: Vec<f64>,
    /// True for each start length that is a guess, as the variable starts at zero and has no range.
    #[serde(default)]
    pub guessed: Vec<bool>,
    /// Half widths w of the box of the next cycle.
    pub widths: Vec<f64>,
    /// The last accepted designs with their numbers, the current one last.
    pub points: Vec<AcceptedPoint>,
    /// The filter.
    pub filter: Vec<FilterEntry>,
    /// Scores of the candidates.
    pub scores: Scores,
    /// Rejected steps from the current design.
    pub rejections: usize,
    /// Rejected designs with the numbers there, since the last accepted one.
    pub rejected: Vec<RejectedPoint>,
    /// The largest violation of each constraint at the points that the run has left by a displacement.
    #[serde(default)]
    pub left: Vec<Vec<f64>>,
    /// Number of analyses beside a design that seemed to be an optimum, to see the curvature in a direction.
    #[serde(default)]
    pub explorations: usize,
    /// Change of the objective that does not matter, where the run of another method is continued; zero otherwise.
    #[serde(default)]
    pub tolerance: f64,
}

/// A rejected design with the numbers of the current cycle.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RejectedPoint {
    /// Design.
    pub design: Vec<f64>,
    /// Values of the numbers there, in the order of the current design.
    pub values: Vec<f64>,
}
