#![doc = "Design optimization of multibody systems by sequential approximation."]
pub mod approximation;
pub mod error;
pub mod problem;
pub mod scalar;
pub mod subproblem;

pub use error::{Error, Result};
