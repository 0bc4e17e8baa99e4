//! Geometrically exact beams.

pub(crate) mod beam;
pub(crate) mod section;

pub use beam::Beam;
pub use section::{BeamSection, Shear};
