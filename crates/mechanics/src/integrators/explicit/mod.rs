//! Explicit Runge–Kutta methods for smooth, non-stiff motions at high accuracy.
//!
//! | file | contents |
//! |---|---|
//! | `tableau` | coefficients of a method, Dormand–Prince 5(4) |
//! | `dop853` | coefficients of the method of order 8 |
//! | `settings` | method, step control, tolerances |
//! | `stepper` | one step, its error, dense output |
//! | `constraint_drift` | violation of the constraints along the steps |
//! | `switching` | adaptive steps that end where contacts close or open |
//! | `defect` | check of long steps for loads that act between their stages |
//! | `grading` | stages that are graded towards the start and the end of a contact |
//! | `ode_driver` | step control |
//! | `ode` | systems of ordinary differential equations |
//! | `mechanism` | constrained mechanisms as such a system: accelerations and projections, steps that end at events |
//! | `relative` | mechanisms in relative coordinates as such a system |
//!
//! [`simulate_explicitly`](crate::analyses::dynamics::simulate_explicitly) simulates a mechanism with these methods. For
//! stiff systems, beams and contacts use the implicit steps of [`Dynamics`](crate::integrators::settings::Dynamics).

pub mod constraint_drift;
pub(crate) mod defect;
pub(crate) mod dop853;
pub mod grading;
pub mod mechanism;
pub mod ode;
pub mod ode_driver;
pub(crate) mod relative;
pub mod settings;
pub mod stepper;
pub(crate) mod switching;
pub mod tableau;

pub use dop853::DOP853;
pub use grading::Grading;
pub use mechanism::MechanismRhs;
pub use ode::{Ode, OdeHistory, integrate};
pub use ode_driver::OdeDriver;
pub use settings::{Coordinates, Explicit, ReplayedStep, StepControl, Tolerance};
pub use stepper::{OdeRhs, Stepper};
pub use tableau::{DOPRI5, Tableau};
