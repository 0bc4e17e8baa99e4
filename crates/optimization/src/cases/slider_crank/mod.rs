//! Slider-cranks: a path generator with its problem, and a driven mechanism with a rigid or flexible rod.

#[cfg(feature = "mechanics")]
mod coupler_path;
#[cfg(feature = "mechanics")]
mod mechanism;
mod path_generation;

#[cfg(feature = "mechanics")]
pub use coupler_path::CouplerPath;
#[cfg(feature = "mechanics")]
pub use mechanism::SliderCrank;
pub use path_generation::*;
