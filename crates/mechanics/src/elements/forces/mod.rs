//! Forces: springs, dampers, bushings, friction and loads.

pub(crate) mod bushing;
pub(crate) mod coordinate_spring;
pub(crate) mod feedback_force;
pub(crate) mod friction;
pub(crate) mod load;
pub(crate) mod point_force;
pub(crate) mod spring_damper;

pub use bushing::Bushing;
pub use coordinate_spring::CoordinateSpring;
pub use feedback_force::{FeedbackForce, StateFunction};
pub use friction::Friction;
pub use load::Load;
pub use point_force::PointForce;
pub use spring_damper::SpringDamper;
