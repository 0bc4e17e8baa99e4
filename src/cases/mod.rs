//! Problems of the field with their data, optimum and source: to test with, to compare on, to learn from.

pub mod cantilever;
mod catalogue;
mod comparison;
pub mod eight_bar_truss;
#[cfg(feature = "mechanics")]
pub mod four_bar;
pub mod impact_absorber;
#[cfg(feature = "mechanics")]
pub mod mechanisms;
#[cfg(feature = "mechanics")]
pub mod nonlinear_absorber;
mod optimum;
pub mod quadratic_forms;
pub mod segmented_cantilever;
pub mod slider_crank;
pub mod ten_bar_truss;
mod toeplitz;
mod truss;
pub mod two_bar_truss;
pub mod two_spheres;
#[cfg(feature = "mechanics")]
pub mod vehicle_suspension;

pub use catalogue::{Entry, catalogue, find};
pub use comparison::{Attempt, Conclusion, Work, attempt, attempt_with, compare};
pub use optimum::{Optimum, Origin};
pub use truss::Truss;
