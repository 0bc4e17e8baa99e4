//! Sensors in space.

pub(crate) mod euler_angle_sensor;
pub(crate) mod marker_sensor3;

pub use euler_angle_sensor::EulerAngleSensor;
pub use marker_sensor3::MarkerSensor3;

use crate::elements::kind::ElementKind;
use crate::elements::state_function::StateFunction;
use crate::motion::Motion;

/// Sensors in space by their declarations.
pub fn kinds<F: Motion, L: StateFunction>() -> Vec<ElementKind<F, L>> {
    vec![ElementKind::plain(MarkerSensor3::object())]
}
