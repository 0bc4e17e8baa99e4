//! Sensors: elements that measure and add nothing to the equations.

pub(crate) mod coordinate_sensor;
pub(crate) mod marker_sensor;

pub use coordinate_sensor::CoordinateSensor;
pub use marker_sensor::MarkerSensor;
