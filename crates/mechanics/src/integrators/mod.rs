//! Time integration: implicit steps on the index-3 equations, and explicit Runge–Kutta methods.
//!
//! | file | contents |
//! |---|---|
//! | `generalized_alpha` | one step of the generalized-α and HHT-α methods, Newton's iteration |
//! | `prescribed_jumps` | prescribed positions and velocities that jump |
//! | `predictor` | extrapolation of accelerations to the next step |
//! | `inspection` | inspection of long steps: what happens between their ends |
//! | `settings` | settings of a dynamic analysis, limits and counts of steps |
//! | `event_location` | steps that end at an event |
//! | `step_events` | events at the ends of a step |
//! | `time_stepper` | implicit steps with step control and events |
//! | `velocity_violation` | velocities of implicit steps that violate the constraints |
//! | `explicit` | explicit Runge–Kutta methods of orders 5 and 8 |

pub(crate) mod consistent_ends;
pub(crate) mod event_location;
pub mod explicit;
pub mod generalized_alpha;
pub(crate) mod inspection;
pub mod predictor;
pub(crate) mod prescribed_jumps;
pub mod settings;
pub(crate) mod step_events;
pub mod time_stepper;
pub(crate) mod velocity_violation;

pub use generalized_alpha::{GeneralizedAlpha, Newton, Prescribed};
pub use settings::{Dynamics, InitialAcceleration, InitialConfiguration, StepSize, Work};
pub use time_stepper::TimeStepper;
