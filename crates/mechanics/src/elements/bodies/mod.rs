//! Bodies: inertia and weight.

pub(crate) mod inertia;
pub(crate) mod point_mass;
pub(crate) mod rigid_body;

pub use inertia::Inertia;
pub use point_mass::PointMass;
pub use rigid_body::RigidBody;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Bodies that model files add to coordinates of other bodies.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![ElementKind::plain(Inertia::object())]
}
