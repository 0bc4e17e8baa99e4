#![doc = "Design optimization of multibody systems by sequential approximation."]
pub mod error;
#[cfg(feature = "multibody")]
pub mod linalg;
pub mod problem;
pub mod scalar;
pub mod subproblem;

pub use error::{Error, Result};
