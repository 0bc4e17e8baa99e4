#![doc = "Design optimization of multibody systems by sequential approximation."]
#[cfg(feature = "multibody")]
pub mod analysis;
pub mod approximation;
#[cfg(feature = "cli")]
pub mod cli;
pub mod error;
pub mod library;
#[cfg(feature = "multibody")]
pub mod linalg;
#[cfg(feature = "multibody")]
pub mod multibody;
#[cfg(feature = "report")]
pub mod papers;
pub mod problem;
#[cfg(feature = "report")]
pub mod report;
pub mod sao;
pub mod scalar;
#[cfg(feature = "multibody")]
pub mod sensitivity;
pub mod subproblem;

pub use error::{Error, Result};
