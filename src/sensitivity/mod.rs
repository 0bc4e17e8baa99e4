//! Derivatives of analyses with respect to the design.
//!
//! | file | what |
//! |---|---|
//! | `direct` | every derivative along with the motion: one residual in dual numbers and one back-substitution per step |

pub mod direct;

pub use direct::{SensitiveHistory, differentiate};
