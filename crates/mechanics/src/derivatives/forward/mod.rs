//! The direct method: derivatives of states along with the analysis.

pub mod dynamics;
pub mod explicit;
pub(crate) mod forward_sensitivity;
pub(crate) mod initial_conditions;
pub mod instants;
pub(crate) mod step_block;
