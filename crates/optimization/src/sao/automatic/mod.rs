//! The automatic method: approximations selected by their prediction errors, in a filter trust-region method.
//!
//! | file | content |
//! |---|---|
//! | `state`, `shape` | the data that are stored, and their check when they come from a file |
//! | `numbers` | the numbers that are approximated |
//! | `candidates`, `quasi_newton` | the candidate approximations of a number |
//! | `linearized`, `lengths` | first derivatives; lengths and units from the designs of the run |
//! | `surrogate` | the approximate problem |
//! | `cycle_context` | the data at the beginning of a cycle |
//! | `proposal`, `subproblem` | the proposed design: the solution of the approximate problem |
//! | `restoration`, `stationary` | incompatible rows; points that no step improves |
//! | `displacement` | steps from points where derivatives show no direction |
//! | `tangent_space`, `second_order` | curvature along the active rows; check of the second-order conditions before the end |
//! | `convergence`, `noise` | the stop test; noise and kinks of the responses |
//! | `selection`, `observation` | prediction errors and the choice by them |
//! | `analyzed_proposal`, `acceptance` | analysis of a proposal and the decision about it; filter and box |
//! | `cycle` | one cycle |

mod acceptance;
mod analyzed_proposal;
mod candidates;
mod convergence;
mod cycle;
mod cycle_context;
mod displacement;
mod lengths;
mod linearized;
mod noise;
mod numbers;
mod observation;
mod proposal;
mod quasi_newton;
mod restoration;
mod second_order;
mod selection;
mod shape;
mod state;
mod stationary;
mod subproblem;
mod surrogate;
mod tangent_space;

pub use candidates::{AcceptedPoint, ApproximationKind};
pub(in crate::sao) use cycle::Continuation;
pub use lengths::StartLengths;
pub(in crate::sao) use lengths::spread;
pub use numbers::{ApproximatedValue, NumberGroup, NumberId};
pub use selection::Scores;
pub use state::{AutomaticState, FilterEntry, RejectedPoint};

use error::{Error, Result};

/// Selection of approximations by their prediction errors, for problems of up to about a hundred variables: matrices are full.
///
/// All [`ApproximationKind`]s are exact in value and gradient at the current design. At every analysed design the error of each
/// is known without another analysis: for each response, the one with the least errors is used next. One candidate concerns
/// the whole problem: linear responses with a BFGS matrix of the Lagrangian. The globalization does not depend on the
/// candidate: a filter, a box whose size depends on the accuracy of the prediction, restoration where linearized rows are incompatible, and a
/// correction through rejected designs. The stop test uses lengths and units from the designs of the run: scaling the objective,
/// constraints or variables, or adding a constant to the objective, changes the run by rounding only. An exception are variables
/// without range that start at zero and on which no row depends: their first length is |F| / |∂F/∂b|.
///
/// The result satisfies the first-order conditions. Before the run ends, the Lagrangian is evaluated near the design in
/// directions along the active rows in which no step was made, or in which the steps show no positive curvature: at a saddle point or a
/// maximum the run continues. Not all directions are tried, so this is not a proof. A run may also end at a stationary point of the
/// violation, unless it has seen a feasible design, to which it goes back: it then reports [`Status::Infeasible`](super::Status::Infeasible), which does not exclude feasible designs in other regions.
///
/// # Sources
///
/// Fletcher & Leyffer, *Math. Program.* 91 (2002) 239–269; Fletcher, Leyffer & Toint, *SIAM J. Optim.* 13 (2002) 44–59;
/// Fadel, Riley & Barthelemy, *Structural Optimization* 2 (1990) 117–124; Nocedal & Wright, *Numerical Optimization* (2006),
/// sections 6.2 and 18.2. The selection is our own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Automatic {
    /// Number of accepted steps from which quasi-Newton matrices are made, at least 1. For more variables than this it is a little more than
    /// their number, up to 120.
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
