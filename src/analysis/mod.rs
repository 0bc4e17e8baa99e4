//! What can be asked of a mechanism at one design.
//!
//! | file | what |
//! |---|---|
//! | `blame` | the element that cannot be evaluated or does not settle, for messages |
//! | `limit` | how many time steps a run may take |
//! | `state` | positions, velocities, accelerations, multipliers |
//! | `system/` | the equations: numbering, residual, matrix |
//! | `start` | assembly, consistent velocities and accelerations |
//! | `generalized_alpha` | implicit time steps on the index-3 equations |
//! | `predictor` | a first guess for the next implicit step |
//! | `sampling` | dense output, named outputs at requested times |
//! | `dynamics` | the run over time by implicit steps |
//! | `recording` | the converged steps of a run, kept for derivatives |
//! | `explicit/` | explicit Runge–Kutta steps: differential equations, and mechanisms at high accuracy |
//! | `kinematics` | driven mechanisms instant by instant, and their inverse dynamics |
//! | `statics` | equilibria and load paths |
//! | `modes` | small vibrations about a state |

pub(crate) mod blame;
pub mod dynamics;
pub mod explicit;
mod four_bar;
pub mod generalized_alpha;
pub mod kinematics;
mod limit;
pub mod modes;
pub mod predictor;
pub mod recording;
pub mod sampling;
pub mod start;
pub mod state;
pub mod statics;
pub mod system;

pub use dynamics::{Dynamics, History, simulate, simulate_recorded};
pub use explicit::Explicit;
pub use generalized_alpha::{GeneralizedAlpha, Integrator, Newton};
pub use recording::Recording;
pub use state::State;
pub use system::System;
