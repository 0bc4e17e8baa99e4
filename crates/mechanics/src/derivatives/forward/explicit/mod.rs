//! Derivatives along explicit steps.
//!
//! The lengths of the accepted steps are not differentiated: the derivatives are those of the discrete solution. Once a step is accepted, its
//! stages are repeated for the derivatives, for chunks of [`WIDTH`](autodiff::WIDTH) design variables in parallel.
//!
//! | module | contents |
//! |---|---|
//! | `ode` | the solution of a differential equation |
//! | `mechanism` | the motion of a mechanism |
//! | `sensitivity_block` | sensitivities of a mechanism's motion, for up to 16 design variables at a time |
//! | `nystrom` | positions and velocities at the stages of a step and inside it |
//! | `explicit_steps` | the steps of an integration, and their linearized stages |
//! | `linearize` | derivatives of the equations, once per stage for all design variables |
//! | `constraint` | derivatives of one constraint along a motion |
//! | `dual_steps` | steps repeated in numbers with derivatives: second derivatives, and motions with events |
//! | `relative_block` | sensitivities of a planar motion in relative coordinates, for up to 16 design variables at a time |
//! | `relative_steps` | steps in relative coordinates repeated in numbers with derivatives: in space, with loops, second derivatives |
//! | `entries` | sparse derivatives and their products |

pub(crate) mod constraint;
pub(crate) mod dual_steps;
pub(crate) mod entries;
pub(crate) mod explicit_steps;
pub(crate) mod linearize;
pub(crate) mod mechanism;
pub(crate) mod nystrom;
pub(crate) mod ode;
pub(crate) mod relative_block;
pub(crate) mod relative_steps;
pub(crate) mod sensitivity_block;

pub use mechanism::differentiate_explicitly;
pub use ode::OdeSensitivity;
pub use ode::differentiate_ode;
