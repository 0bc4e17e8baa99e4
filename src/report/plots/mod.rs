//! Plots of an optimization and of a mechanism, each from plain numbers.
//!
//! Names and units use the markup of [`figure`](super::figure) labels (`*b*_1`, `N/m^2`). Names that come from users pass through
//! [`literal`](super::figure::literal), so that they are shown as they are.

mod benchmark;
mod convergence;
mod coupler_curve;
mod design_space_slice;
mod linkage;
mod profiles;
mod spatial_linkage;
mod stress_field;
mod time_history;
mod time_point_constraints;

pub use benchmark::{Approach, approach};
pub use convergence::{Convergence, ConvergenceMeasure, convergence};
pub use coupler_curve::{CouplerCurve, coupler_curve};
pub use design_space_slice::{Bound, DesignSpaceSlice, Iterate, ObjectiveContours, design_space_slice};
pub use linkage::{Linkage, mechanism};
pub(crate) use linkage::{headed, stress_colour, window};
pub use profiles::{Solver, data_profile, performance_profile};
pub use spatial_linkage::{SpatialLinkage, ViewDirection};
pub use stress_field::{StressField, stress_field};
pub(crate) use time_history::bound_marks;
pub use time_history::{FeasibleSide, ResponseHistory, TimeBound, TimeHistory, time_history};
pub use time_point_constraints::{ConstraintFamily, TimePointConstraints, time_point_constraints};
