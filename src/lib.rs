#![doc = "Design optimization of multibody systems by sequential approximation."]
pub mod approximation;
#[cfg(feature = "cli")]
pub mod cli;
pub mod error;
pub mod library;
#[cfg(feature = "report")]
pub mod papers;
pub mod problem;
#[cfg(feature = "report")]
pub mod report;
pub mod sao;
pub mod scalar;
pub mod subproblem;

pub use error::{Error, Result};
