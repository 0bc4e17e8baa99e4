//! Derivatives of analyses with respect to the design.
//!
//! | file | what |
//! |---|---|
//! | `direct` | every derivative along with the motion: one residual in dual numbers and one back-substitution per step |
//! | `transient` | the outputs of a mechanism as responses of an optimization problem |

pub mod direct;
pub mod transient;

pub use direct::{SensitiveHistory, differentiate};
pub use transient::Transient;
