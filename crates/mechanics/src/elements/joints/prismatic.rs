//! A prismatic joint.

use crate::elements::joints::point_on_line::Offset;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A prismatic joint, a slider in a straight guide: a [`PointOnLine`](super::PointOnLine) joint that also keeps the relative
/// rotation, θ_B − θ_A = β.
///
/// λ is the normal force in N and the torque in N·m.
///
/// # Sources
/// Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct Prismatic;

as_object!(Prismatic);

element_inputs!(PrismaticInputs {
    a: marker("point of the first body"),
    line: optional("0", "rad", 0.1, "direction of the line in the body of a"),
    b: marker("point of the second body"),
    angle: optional("0", "rad", 0.1, "rotation of b relative to a"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "prismatic",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[
        Measure::new("force", "N", "normal force of b on the guide, positive to the left of the line"),
        Measure::new("moment", "N·m", "torque of b on the guide, positive counter-clockwise"),
        Measure::new("position", "m", "position of b along the line, from a"),
    ],
    about: "a slider: b moves along a line of a, without relative rotation",
    law: "n·(r_b − r_a) = 0 with the normal n to the left of the line, and θ_b − θ_a = angle",
    symbol: Symbol::Guide,
};

impl Element for Prismatic {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let offset = Offset::of(x);
        constraint[0] = offset.value;
        constraint[1] = x.q[5] - x.q[2] - PrismaticInputs(x.p).angle();
        offset.react(x.l[0], dynamics);
        dynamics[2] -= x.l[1];
        dynamics[5] += x.l[1];
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        2
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (x.l[0], x.l[1], Offset::of(x).along);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets the body of `b` slide along the line through `a` at the angle `line` in the body of `a`, at the angle `turn` (rad)
    /// from that body.
    pub fn prismatic(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>, turn: S) -> ElementIndex {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        self.add_object(name.into(), Prismatic::object(), &coordinates, &[a.x, a.y, line, b.x, b.y, turn])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};

    #[test]
    fn a_slider_two_metres_along_and_turned_too_far() {
        let x = at(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.5], &[0.0, 0.0, 0.0, 2.0, 0.1, 0.7], &[5.0, 3.0]);
        let (dynamics, constraint) = rows(&Prismatic, &x);
        close(&constraint, &[0.1, 0.2]);
        close(&dynamics, &[0.0, -5.0, -13.0, 0.0, 5.0, 3.0]);
        close(&measured(&Prismatic, &x), &[5.0, 3.0, 2.0]);
    }
}
