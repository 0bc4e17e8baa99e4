//! Drives: prescribed motions.

pub(crate) mod driver;
pub(crate) mod length_driver;

pub use driver::Driver;
pub use length_driver::LengthDriver;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;
use std::sync::Arc;

/// Drives that model files can name.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![
        ElementKind::prescribed(&driver::COORDINATE_DRIVE),
        ElementKind::of_time(&driver::DESCRIPTOR, |motion| Arc::new(Driver(motion))),
        ElementKind::of_time(&length_driver::DESCRIPTOR, |motion| Arc::new(LengthDriver(motion))),
    ]
}
