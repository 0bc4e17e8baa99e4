//! Rigid contacts: a stop between two coordinates, and a wall for a point.

use crate::element_inputs;
use crate::elements::drives::driver::Driver;
use crate::elements::joints::point_on_line::PointOnLine;
use crate::mechanism::element::{AnyElement, Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::motion::Fixed;
use autodiff::Scalar;
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
        measures: CONTACT_FORCE,
        about: "a rigid stop: b − a bounces off a lower limit",
        law: "when the gap b − a − clearance closes, its rate becomes −restitution times its rate before, by an impulse on b and its opposite on a; once the rebounds have decayed, it stays closed as long as contact_force ≥ 0",
        symbol: Symbol::Stop,
    }
};

/// The gap b − a − clearance of a stop as a trait object.
#[inline(never)]
pub(crate) fn stop_gap() -> Arc<dyn AnyElement> {
    Arc::new(Gap { of: Driver(Fixed), descriptor: &STOP })
}

/// The distance of point b from the line of a wall as a trait object.
#[inline(never)]
pub(crate) fn wall_gap() -> Arc<dyn AnyElement> {
    Arc::new(Gap { of: PointOnLine, descriptor: &WALL })
}

const CONTACT_FORCE: &[Measure] = &[Measure::new(
    "contact_force",
    "N or N·m",
    "force or torque on b while the contact is closed, at least 0; impulses are not a part of it",
)];

/// A gap as the constraint of an element. While the contact is closed the element holds it, and −λ is the contact force.
struct Gap<E> {
    of: E,
    descriptor: &'static ElementDescriptor,
}

impl<E: Element> Element for Gap<E> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        self.of.residual(x, dynamics, constraint);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(self.descriptor)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        self.of.validate_parameters(p)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = T::from(0.0) - x.l[0]; // zero, not −0, while it is open
    }
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
        measures: CONTACT_FORCE,
        about: "a rigid wall: b bounces off the line through a and stays to the left of it, seen along the line",
        law: "when the gap n·(r_b − r_a) closes, its rate becomes −restitution times its rate before, by an impulse along the normal n to the left of the line; once the rebounds have decayed, it stays closed as long as contact_force ≥ 0",
        symbol: Symbol::MovingWall,
    }
};
