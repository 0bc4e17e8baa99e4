//! A rigid stop between two coordinates.

use crate::element_inputs;
use crate::elements::drives::driver::Driver;
use crate::mechanism::element::{AnyElement, ElementDescriptor, Family, Symbol};
use crate::motion::Fixed;
use std::sync::Arc;

element_inputs!(RigidStopInputs {
    a: coordinate_or("ground.x", "coordinate that it acts against"),
    b: coordinate("coordinate that it acts on"),
    clearance: required("m or rad", -0.1, "limit of b − a"),
    restitution: optional("0.5", "", 0.6, "part of the speed that is left, 0 to 1"),
});

/// Declaration of [`Mechanism::rigid_stop`](crate::mechanism::Mechanism::rigid_stop).
pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "rigid-stop",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[],
    about: "a rigid stop: b − a bounces off a lower limit; implicit schemes only",
    symbol: Symbol::None,
};

/// The gap b − a − clearance as an object.
#[inline(never)]
pub(crate) fn gap() -> Arc<dyn AnyElement> {
    Arc::new(Driver(Fixed))
}
