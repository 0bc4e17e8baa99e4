//! The elements: one file each, with one residual, one citation and one test with a number.

mod beam;
mod marker;
mod revolute;
mod rigid_body;

pub use beam::{Beam, BeamSection, Shear};
pub use marker::MarkerSensor;
pub use revolute::Revolute;
pub use rigid_body::RigidBody;
