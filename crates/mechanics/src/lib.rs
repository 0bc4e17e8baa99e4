//! Planar rigid and flexible multibody dynamics, with exact derivatives with respect to design parameters.

pub mod analysis;
pub mod linalg;
pub mod multibody;
pub mod sensitivity;

pub use error::{Error, Result};
