//! A coordinate that is a prescribed function of time.

use crate::element_inputs;
use crate::mechanism::element::{ElementDescriptor, Family, Measure, Symbol};

element_inputs!(PrescribedInputs {
    coordinate: coordinate("coordinate that it acts on"),
    motion: time_function("m or rad", "position as a function of time"),
});

/// Declaration of [`Mechanism::drive`](crate::mechanism::Mechanism::drive).
pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "coordinate",
    family: Family::Drive,
    inputs: INPUTS,
    measures: &[Measure::new("driving_force", "N or N·m", "driving force or torque, positive towards larger values")],
    about: "prescribes a coordinate",
    symbol: Symbol::None,
};
