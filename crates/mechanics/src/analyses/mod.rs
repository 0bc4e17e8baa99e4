//! Analyses of a mechanism at one design.

pub mod assembly_branch;
pub mod conservation;
pub mod dynamics;
pub(crate) mod element_warnings;
pub mod equilibrium_jumps;
pub(crate) mod equilibrium_stability;
pub mod indeterminate_outputs;
pub(crate) mod initial_positions;
pub mod kinematics;
pub mod modal;
pub(crate) mod motion_watch;
pub(crate) mod negative_coefficients;
pub mod sampling;
pub(crate) mod small_displacements;
pub mod statics;
pub mod step_comparison;
pub mod tensioned_beams;
