//! The direct method: sensitivities of the state, carried forward along with the analysis.
//!
//! One pass carries [`WIDTH`](autodiff::WIDTH) design variables, for all outputs at all times. Use it for few design
//! variables, and [`adjoint`](crate::derivatives::adjoint) for few responses of many variables.
//!
//! | module | contents |
//! |---|---|
//! | [`dynamics`] | implicit steps: sensitivities of one step, and of the whole motion |
//! | `implicit_steps` | converged implicit steps with their factorized matrices, simulated or recorded |
//! | `initial_conditions` | assembled positions, consistent velocities and accelerations, equilibria |
//! | `saltation` | impacts and switches |
//! | [`instants`] | kinematics with inverse dynamics, and statics |
//! | [`explicit`] | explicit steps, of mechanisms and of differential equations |

pub mod dynamics;
pub mod explicit;
pub(crate) mod implicit_steps;
pub(crate) mod initial_conditions;
pub mod instants;
pub(crate) mod saltation;
