//! Problems and mechanisms of the literature with their data, known optima and sources.
//!
//! Each module is one case. [`catalogue()`] lists the optimization problems by name; [`compare`] runs methods on one of them.

#[cfg(feature = "mechanics")]
pub mod andrews;
mod benchmark;
pub mod cantilever;
mod catalogue;
#[cfg(feature = "mechanics")]
pub mod chain;
pub mod eight_bar_truss;
mod entry;
#[cfg(feature = "mechanics")]
pub mod four_bar;
#[cfg(feature = "mechanics")]
pub mod governor;
pub mod impact_absorber;
#[cfg(feature = "mechanics")]
pub mod nonlinear_absorber;
mod optimum;
pub mod quadratic_forms;
mod random;
pub mod segmented_cantilever;
pub mod slider_crank;
#[cfg(feature = "mechanics")]
pub mod spinning_beam;
pub mod suite;
pub mod ten_bar_truss;
mod truss;
pub mod two_bar_truss;
pub mod two_spheres;
#[cfg(feature = "mechanics")]
pub mod vehicle_suspension;

pub use benchmark::{AnalysisCounts, Attempt, Conclusion, attempt, attempt_with, compare, kkt_residual};
pub use catalogue::catalogue;
pub use entry::{CatalogueEntry, KnownSolution, Suite};
pub use optimum::{Optimum, Provenance};
pub use suite::find;
pub use truss::Truss;

#[cfg(feature = "mechanics")]
pub use self::{
    andrews::Andrews,
    chain::Chain,
    four_bar::{FourBar, RigidFourBar},
    governor::Governor,
    impact_absorber::Absorber,
    slider_crank::{CouplerPath, SliderCrank},
    spinning_beam::SpinningBeam,
};
