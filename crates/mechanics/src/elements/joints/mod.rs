//! Joints: constraints between bodies.

pub(crate) mod cam_follower;
pub(crate) mod distance;
pub(crate) mod fixed_joint;
pub(crate) mod gear_pair;
pub(crate) mod point_on_line;
pub(crate) mod prismatic;
pub(crate) mod rack;
pub(crate) mod revolute;

pub use cam_follower::CamFollower;
pub use distance::DistanceConstraint;
pub use fixed_joint::FixedJoint;
pub use gear_pair::GearPair;
pub use point_on_line::PointOnLine;
pub use prismatic::Prismatic;
pub use rack::Rack;
pub use revolute::Revolute;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Joints that model files can name.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(Revolute::object()),
        ElementKind::plain(FixedJoint::object()),
        ElementKind::plain(Prismatic::object()),
        ElementKind::plain(PointOnLine::object()),
        ElementKind::plain(DistanceConstraint::object()),
        ElementKind::plain(GearPair::object()),
        ElementKind::plain(Rack::object()),
        ElementKind::plain(CamFollower::object()),
    ]
}
