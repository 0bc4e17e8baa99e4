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
pub use contacts::{Stop, WallContact};
pub use drives::{Actuator, Driver, LengthDriver};
pub use element::{Element, Energy, Local};
pub use forces::{Bushing, CoordinateSpring, Friction, Law, Load, PointForce, SpringDamper, StateLoad};
pub use joints::{GearPair, PointOnLine, Prismatic, Rack, Revolute, Rod, Weld};
pub use sensors::{CoordinateSensor, MarkerSensor};
