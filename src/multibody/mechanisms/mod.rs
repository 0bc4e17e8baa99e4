//! Reference mechanisms.

pub mod absorber;
pub mod andrews;
pub mod chain;
pub mod four_bar;
pub mod rigid_four_bar;
pub mod slider_crank;

pub use absorber::Absorber;
pub use andrews::Andrews;
pub use chain::Chain;
pub use four_bar::FourBar;
pub use rigid_four_bar::RigidFourBar;
pub use slider_crank::SliderCrank;
