//! Derivatives along with explicit steps.
//!
//! The accepted steps are frozen: the derivatives are those of the discrete solution. Once a step is accepted its
//! stages are repeated for the derivatives, for chunks of [`WIDTH`](crate::scalar::WIDTH) design variables in parallel.
//!
//! | file | what |
//! |---|---|
//! | `follower` | a step, its end and dense output, for one chunk of derivatives |
//! | `ode` | the right-hand side of a differential equation in dual numbers |
//! | `linearize` | elements in dual numbers, once per stage for all design variables |
//! | `mechanism` | accelerations and projections of a mechanism: one back-substitution per stage and chunk |

mod follower;
mod linearize;
mod mechanism;
mod ode;

pub use crate::analysis::explicit::simulate_explicitly;
pub use mechanism::differentiate_explicitly;
pub use ode::{OdeSensitivity, differentiate_ode};

/// Derivatives of one quantity with respect to one chunk of design variables.
pub(crate) type Block = [f64; crate::scalar::WIDTH];
