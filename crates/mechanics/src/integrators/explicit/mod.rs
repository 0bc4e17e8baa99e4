//! Explicit Runge–Kutta methods for smooth, non-stiff motions at high accuracy.
//!
//! | file | what |
//! |---|---|
//! | `tableau` | what a method is; Dormand–Prince 5(4) |
//! | `dop853` | the coefficients of order 8 |
//! | `settings` | method, step sizes, tolerances |
//! | `stepper` | one step, its error, dense output |
//! | `march` | the choice of steps |
//! | `ode` | systems of ordinary differential equations |
//! | `mechanism` | constrained mechanisms: accelerations and projections |
//! | `recording` | steps kept for derivatives, and check-points |
//! | `simulation` | the outputs of a mechanism over time |

pub(crate) mod dop853;
pub mod mechanism;
pub mod ode;
pub mod ode_driver;
pub(crate) mod recording;
pub mod settings;
pub(crate) mod simulation;
pub mod stepper;
pub mod tableau;

pub use dop853::DOP853;
pub use mechanism::MechanismRhs;
pub use ode::Ode;
pub use ode::OdeHistory;
pub use ode::integrate;
pub use ode_driver::OdeDriver;
pub use recording::ExplicitRecording;
pub use settings::Explicit;
pub use settings::StepControl;
pub use settings::Tolerance;
pub use simulation::simulate_explicitly;
pub use simulation::simulate_with_recording;
pub use simulation::simulate_with_steps;
pub use stepper::OdeRhs;
pub use stepper::Stepper;
pub use tableau::DOPRI5;
pub use tableau::Tableau;
