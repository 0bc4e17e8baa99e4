//! Analyses that compute responses: finite differences of any analysis, mechanisms, and other programs.

mod finite_differences;
#[cfg(feature = "mechanics")]
pub mod mechanism;
pub mod program;

pub use finite_differences::Differences;
