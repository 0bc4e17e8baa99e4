//! Elements of a mechanism: bodies, joints, drives, forces, contacts, beams and sensors.

pub mod beams;
pub mod bodies;
pub mod contacts;
pub mod drives;
pub mod element;
#[cfg(test)]
pub(crate) mod element_tests;
pub mod forces;
pub mod joints;
pub(crate) mod line;
pub mod sensors;

pub use beams::{Beam, BeamSection, Shear};
pub use bodies::{Inertia, PointMass, RigidBody};
pub use contacts::{BumpStop, WallContact};
pub use drives::{Actuator, Driver, LengthDriver};
pub use element::{Element, ElementState, Energy};
pub use forces::{Bushing, CoordinateSpring, FeedbackForce, Friction, Load, PointForce, SpringDamper, StateFunction};
pub use joints::{DistanceConstraint, FixedJoint, GearPair, PointOnLine, Prismatic, Rack, Revolute};
pub use sensors::{CoordinateSensor, MarkerSensor};
