//! Geometrically exact beams.

pub(crate) mod beam;
pub(crate) mod line_load;
pub(crate) mod section;
pub(crate) mod shape;

pub use beam::Beam;
pub use line_load::LineLoad;
pub use section::{BeamSection, Shear};
pub use shape::BeamShape;
