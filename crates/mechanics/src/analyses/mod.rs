//! Analyses of a mechanism at one design.

pub mod conservation;
pub(crate) mod doubtful_states;
pub mod dynamics;
pub mod indeterminate_outputs;
pub mod kinematics;
pub mod modal;
pub(crate) mod negative_coefficients;
pub mod sampling;
pub(crate) mod small_motion;
pub mod statics;
pub mod step_comparison;
pub mod tensioned_beams;
