//! Coordinates of joints in space, and drives of them.

pub(crate) mod joint_coordinate;

pub use joint_coordinate::{JointAngle, JointDisplacement, PointDistance};

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Coordinates of joints by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(JointAngle::object()),
        ElementKind::plain(JointDisplacement::object()),
        ElementKind::plain(PointDistance::object()),
    ]
}
