//! What can be asked of a mechanism at one design.
//!
//! | file | what |
//! |---|---|
//! | `blame` | the element that cannot be evaluated or does not settle, for messages |
//! | `bounce` | where a run closes a rigid contact |
//! | `impact` | what velocities do then |
//! | `limit` | how many time steps a run may take |
//! | `state` | positions, velocities, accelerations, multipliers |
//! | `system/` | the equations: numbering, residual, matrix |
//! | `start` | assembly, consistent velocities and accelerations |
//! | `generalized_alpha` | implicit time steps on the index-3 equations |
//! | `predictor` | a first guess for the next implicit step |
//! | `sampling` | dense output, named outputs at requested times |
//! | `dynamics` | the motion over time by implicit steps: settings and histories |
//! | `run` | a running simulation, step by step |
//! | `log` | the steps of any motion in a limited memory, or check-points |
//! | `recording` | the converged steps of a run, kept for derivatives |
//! | `rewind` | steps from the last to the first, integrated again where they were not kept |
//! | `explicit/` | explicit Runge–Kutta steps: differential equations, and mechanisms at high accuracy |
//! | `kinematics` | driven mechanisms instant by instant, and their inverse dynamics |
//! | `statics` | equilibria and load paths |
//! | `modes` | small vibrations about a state |

pub(crate) mod blame;
mod bounce;
pub mod dynamics;
pub mod explicit;
pub mod generalized_alpha;
pub(crate) mod impact;
pub mod kinematics;
mod limit;
mod log;
pub mod modes;
pub mod predictor;
pub mod recording;
mod rewind;
pub mod run;
pub mod sampling;
pub mod start;
pub mod state;
pub mod statics;
pub mod system;

pub use bounce::Impact;
pub use dynamics::{Dynamics, History, simulate, simulate_recorded};
pub use explicit::Explicit;
pub use generalized_alpha::{GeneralizedAlpha, Integrator, Newton};
pub(crate) use log::Course;
pub use recording::Recording;
pub(crate) use rewind::Rewind;
pub use state::State;
pub use system::System;
