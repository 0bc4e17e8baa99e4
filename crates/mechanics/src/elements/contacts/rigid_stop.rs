//! A rigid stop between two coordinates.

use crate::element_inputs;
use crate::mechanism::element::{ElementDescriptor, Family, Symbol};

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
    about: "lets b − a bounce off a limit that it does not fall below; implicit schemes only",
    symbol: Symbol::None,
};
