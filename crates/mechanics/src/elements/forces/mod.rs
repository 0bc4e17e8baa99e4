//! Forces: springs, dampers, ropes, bushings, actuators, friction and loads.

pub(crate) mod actuator;
pub(crate) mod bushing;
pub(crate) mod coordinate_spring;
pub(crate) mod dry_friction;
pub(crate) mod feedback_force;
pub(crate) mod feedback_point_force;
pub(crate) mod follower_force;
pub(crate) mod friction;
pub(crate) mod guide_friction;
pub(crate) mod load;
pub(crate) mod point_force;
pub(crate) mod revolute_friction;
pub(crate) mod rope;
pub(crate) mod spring_damper;
pub(crate) mod variable_damper;
pub(crate) mod variable_spring;

pub use crate::elements::state_function::StateFunction;
pub use actuator::Actuator;
pub use bushing::Bushing;
pub use coordinate_spring::CoordinateSpring;
pub use dry_friction::DryFriction;
pub use feedback_force::FeedbackForce;
pub use feedback_point_force::FeedbackPointForce;
pub use follower_force::FollowerForce;
pub use friction::Friction;
pub use guide_friction::GuideFriction;
pub use load::Load;
pub use point_force::PointForce;
pub use revolute_friction::RevoluteFriction;
pub use rope::Rope;
pub use spring_damper::SpringDamper;
pub use variable_damper::VariableDamper;
pub use variable_spring::VariableSpring;

use crate::elements::kind::ElementKind;
use crate::motion::Motion;
use std::sync::Arc;

/// Forces that model files can name.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(SpringDamper::object()),
        ElementKind::plain(CoordinateSpring::object()),
        ElementKind::of_time(&variable_spring::DESCRIPTOR, |stiffness| Arc::new(VariableSpring(stiffness))),
        ElementKind::of_time(&variable_damper::DESCRIPTOR, |damping| Arc::new(VariableDamper(damping))),
        ElementKind::plain(Rope::object()),
        ElementKind::plain(Bushing::object()),
        ElementKind::of_time(&actuator::DESCRIPTOR, |tension| Arc::new(Actuator(tension))),
        ElementKind::of_time(&load::DESCRIPTOR, |force| Arc::new(Load(force))),
        ElementKind::of_time(&point_force::DESCRIPTOR, |force| Arc::new(PointForce(force))),
        ElementKind::of_time(&follower_force::DESCRIPTOR, |force| Arc::new(FollowerForce(force))),
        ElementKind::plain(Friction::object()),
        ElementKind::dry_friction(&dry_friction::DESCRIPTOR),
        ElementKind::plain(RevoluteFriction::object()),
        ElementKind::plain(GuideFriction::object()),
        ElementKind::of_state(&feedback_force::DESCRIPTOR, |law| Arc::new(FeedbackForce(law))),
        ElementKind::of_state(&feedback_point_force::DESCRIPTOR, |law| Arc::new(FeedbackPointForce(law))),
    ]
}
