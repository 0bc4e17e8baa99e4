//! The driven four-bar mechanism with three links: flexible or rigid, and its stress-constrained minimum mass.

mod mechanism;
mod problem;
mod rigid;

pub use mechanism::FourBar;
pub use problem::*;
pub use rigid::RigidFourBar;
