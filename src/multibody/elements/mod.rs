//! The elements: bodies, joints, drives, forces and sensors, each with one residual.

mod beam;
mod bushing;
mod coordinate;
mod line;
mod marker;
mod point_on_line;
mod revolute;
mod rigid_body;
mod weld;

pub use beam::{Beam, BeamSection, Shear};
pub use bushing::{Bushing, PointForce, WallContact};
pub use coordinate::{CoordinateSensor, CoordinateSpring, Driver, Friction, GearPair, Inertia, Load, Rack, Stop};
pub use line::{Actuator, LengthDriver, Rod, SpringDamper};
pub use marker::MarkerSensor;
pub use point_on_line::{PointOnLine, Prismatic};
pub use revolute::Revolute;
pub use rigid_body::{PointMass, RigidBody};
pub use weld::Weld;
