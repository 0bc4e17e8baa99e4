//! Derivatives along with explicit steps.
//!
//! The accepted steps are frozen: the derivatives are those of the discrete solution. Once a step is accepted its
//! stages are repeated for the derivatives, for chunks of [`WIDTH`](autodiff::WIDTH) design variables in parallel.
//!
//! | file | what |
//! |---|---|
//! | `sensitivity` | a step, its end and dense output, for one chunk of derivatives of a differential equation |
//! | `ode` | the right-hand side of a differential equation in dual numbers |
//! | `linearize` | elements in dual numbers, once per stage for all design variables |
//! | `constraint` | one constraint along a motion, in closed form or in jets |
//! | `entries` | the sparse derivatives that come out of it |
//! | `visits` | what a step leaves behind for its derivatives |
//! | `nystrom` | weights of a method for positions and velocities |
//! | `steps` | positions and velocities at the stages of a step and inside it |
//! | `tile` | accelerations and projections: one back-substitution per stage for 16 design variables |
//! | `mechanism` | the motion of a mechanism, all tiles side by side |

pub(crate) mod block;
pub(crate) mod constraint;
pub(crate) mod entries;
pub(crate) mod forward_step;
pub(crate) mod linearize;
pub(crate) mod mechanism;
pub(crate) mod nystrom;
pub(crate) mod ode;
pub(crate) mod step_records;
pub(crate) mod steps;

pub use crate::analyses::dynamics::simulate_explicitly;
pub use mechanism::differentiate_explicitly;
pub use ode::OdeSensitivity;
pub use ode::differentiate_ode;

/// Derivatives of one quantity with respect to a few design variables.
pub(crate) type Block<const W: usize> = [f64; W];
