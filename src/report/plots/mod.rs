//! The pictures of an optimization and of a mechanism, each from plain numbers.
//!
//! Names and units use the markup of [`figure`](super::figure) labels (`*b*_1`, `N/m^2`); names that come from users
//! and should be shown as they are go through [`literal`](super::figure::literal).

mod approach;
mod convergence;
mod coupler_curve;
mod design_plane;
mod field;
mod linkage;
mod profile;
mod time_history;
mod time_points;

pub use approach::{Approach, approach};
pub use convergence::{Convergence, Measure, convergence};
pub use coupler_curve::{CouplerCurve, coupler_curve};
pub use design_plane::{Bound, DesignPlane, Iterate, Objective, design_plane};
pub use field::{StressField, stress_field};
pub(crate) use linkage::window;
pub use linkage::{Linkage, mechanism};
pub use profile::{Solver, performance_profile};
pub use time_history::{History, Side, TimeBound, TimeHistory, time_history};
pub use time_points::{Family, TimePointConstraints, time_point_constraints};
