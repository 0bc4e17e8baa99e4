//! Analyses of a mechanism at one design.

pub mod conservation;
pub mod dynamics;
pub mod kinematics;
pub mod modal;
pub mod sampling;
pub mod statics;
pub mod step_comparison;
