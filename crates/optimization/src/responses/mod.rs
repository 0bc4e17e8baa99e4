//! Analyses that compute responses: finite differences of any analysis, and mechanisms.

mod finite_differences;
#[cfg(feature = "mechanics")]
pub mod mechanism;

pub use finite_differences::Differences;
