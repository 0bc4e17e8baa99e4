//! A rigid wall for a point.

use crate::element_inputs;
use crate::mechanism::element::{ElementDescriptor, Family, Symbol};

element_inputs!(RigidWallInputs {
    a: marker("point of the first body"),
    line: optional("0", "rad", 0.1, "direction of the line in the body of a"),
    b: marker("point of the second body"),
    restitution: optional("0.5", "", 0.6, "part of the speed that is left, 0 to 1"),
});

/// Declaration of [`Mechanism::rigid_wall`](crate::mechanism::Mechanism::rigid_wall).
pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "rigid-wall",
    family: Family::Contact,
    inputs: INPUTS,
    measures: &[],
    about: "lets b bounce off the line through a; it stays to the left, seen along the line; implicit schemes only",
    symbol: Symbol::None,
};
