//! Problems of the field with their data, optimum and source: to test with, to compare on, to learn from.

mod catalogue;
mod comparison;
#[cfg(feature = "multibody")]
pub mod four_bar;
pub mod impact_absorber;
mod optimum;
pub mod slider_crank;

pub use catalogue::{Entry, catalogue, find};
pub use comparison::{Attempt, Conclusion, Work, attempt, compare};
pub use optimum::{Optimum, Origin};
