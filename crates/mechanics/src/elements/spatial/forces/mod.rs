//! Forces in space: loads, springs, ropes and bushings.

pub(crate) mod bushing3;
pub(crate) mod load3;
pub(crate) mod rope3;
pub(crate) mod spring_damper3;

pub use bushing3::Bushing3;
pub use load3::{Load3, LoadKind3};
pub use rope3::Rope3;
pub use spring_damper3::SpringDamper3;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;
use std::sync::Arc;

/// Forces in space by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::plain(SpringDamper3::object()),
        ElementKind::plain(Rope3::object()),
        ElementKind::plain(Bushing3::object()),
        ElementKind::of_time(&load3::FORCE, |f| Arc::new(Load3 { magnitude: f, kind: LoadKind3::Force })),
        ElementKind::of_time(&load3::FOLLOWER_FORCE, |f| {
            Arc::new(Load3 { magnitude: f, kind: LoadKind3::FollowerForce })
        }),
        ElementKind::of_time(&load3::TORQUE, |f| Arc::new(Load3 { magnitude: f, kind: LoadKind3::Torque })),
        ElementKind::of_time(&load3::FOLLOWER_TORQUE, |f| {
            Arc::new(Load3 { magnitude: f, kind: LoadKind3::FollowerTorque })
        }),
    ]
}
