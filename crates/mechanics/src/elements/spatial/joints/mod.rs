//! Joints in space: constraints between markers of two bodies.

pub(crate) mod distance3;
pub(crate) mod lower_pairs;
pub(crate) mod point_joints;
pub(crate) mod rows;

pub use distance3::DistanceConstraint3;
pub use lower_pairs::{Cylindrical, FixedJoint3, Planar, Prismatic3, Revolute3};
pub use point_joints::{ConstantVelocity, PointOnLine3, PointOnPlane, Spherical, Universal};

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Joints in space by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(Revolute3::object()),
        ElementKind::plain(Prismatic3::object()),
        ElementKind::plain(Cylindrical::object()),
        ElementKind::plain(Spherical::object()),
        ElementKind::plain(Universal::object()),
        ElementKind::plain(ConstantVelocity::object()),
        ElementKind::plain(Planar::object()),
        ElementKind::plain(FixedJoint3::object()),
        ElementKind::plain(PointOnLine3::object()),
        ElementKind::plain(PointOnPlane::object()),
        ElementKind::plain(DistanceConstraint3::object()),
    ]
}
