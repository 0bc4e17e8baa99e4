#![doc = "Design optimization of multibody systems by sequential approximation."]
#[cfg(feature = "multibody")]
pub mod analysis;
pub mod error;
#[cfg(feature = "multibody")]
pub mod linalg;
#[cfg(feature = "multibody")]
pub mod multibody;
pub mod problem;
pub mod scalar;
#[cfg(feature = "multibody")]
pub mod sensitivity;
pub mod subproblem;

pub use error::{Error, Result};
