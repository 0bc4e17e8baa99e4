//! Elements of a mechanism in families: bodies, joints, drives, forces, contacts, beams and sensors.
//!
//! Each file holds one element: its residual, its declaration ([`ElementDescriptor`]), the method of
//! [`Mechanism`](crate::mechanism::Mechanism) that adds it, and a test with numbers. [`kinds`] lists those that model files
//! can name.

pub mod beams;
pub mod bodies;
pub mod contacts;
pub mod drives;
#[cfg(test)]
pub(crate) mod element_tests;
pub mod forces;
pub mod joints;
pub mod kind;
pub(crate) mod line;
pub mod sensors;

pub use crate::mechanism::element;
pub use beams::{Beam, BeamSection, Shear};
pub use bodies::{Inertia, PointMass, RigidBody};
pub use contacts::{BumpStop, WallContact};
pub use drives::{Driver, LengthDriver};
pub use element::{Element, ElementDescriptor, ElementState, Energy, Family, Input, Measure, Role, Symbol};
pub use forces::{
    Actuator, Bushing, CoordinateSpring, FeedbackForce, Friction, Load, PointForce, SpringDamper, StateFunction,
};
pub use joints::{DistanceConstraint, FixedJoint, GearPair, PointOnLine, Prismatic, Rack, Revolute};
pub use kind::{Added, ElementKind, InputValue};
pub use sensors::{CoordinateSensor, MarkerSensor};

use crate::motion::Motion;

/// Elements that model files can name, over the types of functions of time and of functions of state.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    [joints::kinds(), drives::kinds(), forces::kinds(), contacts::kinds(), bodies::kinds()]
        .into_iter()
        .flatten()
        .collect()
}
