//! Bodies: inertia and weight.

pub(crate) mod inertia;
pub(crate) mod point_mass;
pub(crate) mod rigid_body;

pub use inertia::Inertia;
pub use point_mass::PointMass;
pub use rigid_body::RigidBody;
