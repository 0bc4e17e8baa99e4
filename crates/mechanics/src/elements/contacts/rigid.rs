//! Rigid contacts: a stop between two coordinates, and a wall for a point.

use crate::element_inputs;
use crate::elements::drives::driver::Driver;
use crate::mechanism::element::{AnyElement, ElementDescriptor, Family, Symbol};
use crate::motion::Fixed;
use std::sync::Arc;

/// Declaration of [`Mechanism::rigid_stop`](crate::mechanism::Mechanism::rigid_stop).
pub static STOP: ElementDescriptor = {
    element_inputs!(RigidStopInputs {
        a: coordinate_or("ground.x", "coordinate that it acts against"),
        b: coordinate("coordinate that it acts on"),
        clearance: required("m or rad", -0.1, "limit of b − a"),
        restitution: optional("0.5", "", 0.6, "ratio of the speeds after and before an impact, 0 to 1"),
    });
    ElementDescriptor {
        kind: "rigid-stop",
        family: Family::Contact,
        inputs: INPUTS,
        measures: &[],
        about: "a rigid stop: b − a bounces off a lower limit",
        law: "when the gap b − a − clearance closes, its rate becomes −restitution times its rate before, by an impulse on b and its opposite on a",
        symbol: Symbol::Stop,
    }
};

/// The gap b − a − clearance of a stop as a trait object.
#[inline(never)]
pub(crate) fn stop_gap() -> Arc<dyn AnyElement> {
    Arc::new(Driver(Fixed))
}

/// Declaration of [`Mechanism::rigid_wall`](crate::mechanism::Mechanism::rigid_wall).
pub static WALL: ElementDescriptor = {
    element_inputs!(RigidWallInputs {
        a: marker("point of the first body"),
        line: optional("0", "rad", 0.1, "direction of the line in the body of a"),
        b: marker("point of the second body"),
        restitution: optional("0.5", "", 0.6, "ratio of the speeds after and before an impact, 0 to 1"),
    });
    ElementDescriptor {
        kind: "rigid-wall",
        family: Family::Contact,
        inputs: INPUTS,
        measures: &[],
        about: "a rigid wall: b bounces off the line through a and stays to the left of it, seen along the line",
        law: "when the gap n·(r_b − r_a) closes, its rate becomes −restitution times its rate before, by an impulse along the normal n to the left of the line",
        symbol: Symbol::MovingWall,
    }
};
