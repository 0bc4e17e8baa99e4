#![doc = "Design optimization of multibody systems by sequential approximation."]
pub mod error;
pub mod problem;
#[cfg(feature = "report")]
pub mod report;
pub mod scalar;
pub mod subproblem;

pub use error::{Error, Result};
