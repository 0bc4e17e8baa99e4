//! Drives: prescribed motions and actuator forces.

pub(crate) mod actuator;
pub(crate) mod driver;
pub(crate) mod length_driver;

pub use actuator::Actuator;
pub use driver::Driver;
pub use length_driver::LengthDriver;
