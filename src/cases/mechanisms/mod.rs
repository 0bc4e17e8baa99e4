//! Reference mechanisms.

pub mod absorber;
pub mod andrews;
pub mod chain;
pub mod coupler_path;
pub mod four_bar;
mod four_bar_dynamics;
pub mod governor;
pub mod rigid_four_bar;
pub mod slider_crank;
pub mod spinning_beam;

pub use absorber::Absorber;
pub use andrews::Andrews;
pub use chain::Chain;
pub use coupler_path::CouplerPath;
pub use four_bar::FourBar;
pub use governor::Governor;
pub use rigid_four_bar::RigidFourBar;
pub use slider_crank::SliderCrank;
pub use spinning_beam::SpinningBeam;
