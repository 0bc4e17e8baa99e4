//! A point of one body on a straight line of another: a pin in a slot.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A pin in a straight slot: point B of one body stays on a line through point A of another.
///
/// $$ \Phi = \mathbf n\cdot(\mathbf r_B - \mathbf r_A) = 0 $$
///
/// with n normal to the line. λ in N is the force of B on the slot along n.
///
/// # Sources
/// Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct PointOnLine;

as_object!(PointOnLine);

element_inputs!(PointOnLineInputs {
    a: marker("point of the first body"),
    line: optional("0", "rad", 0.1, "direction of the line in the body of a"),
    b: marker("point of the second body"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "point-on-line",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[
        Measure::new("force", "N", "force of b on the line, positive to its left"),
        Measure::new("position", "m", "position of b along the line, from a"),
    ],
    about: "a pin in a slot: b stays on a line through a",
    law: "n·(r_b − r_a) = 0 with the normal n to the left of the line",
    symbol: Symbol::Guide,
};

/// Offset of B from the line, with the levers from both reference points to B and the normal of the line.
pub(crate) struct Offset<T> {
    pub value: T,
    lever_a: [T; 2],
    lever_b: [T; 2],
    normal: [T; 2],
    /// Position of B along the line.
    pub along: T,
}

impl<T: Scalar> Offset<T> {
    /// Velocity of B along the line, in the body of A.
    pub fn sliding(&self, x: &ElementState<'_, T>) -> T {
        let [nx, ny] = self.normal;
        let ([ax, ay], [bx, by]) = (point_velocity(x, 0, self.lever_a), point_velocity(x, 3, self.lever_b));
        (bx - ax) * ny - (by - ay) * nx
    }

    /// Adds a force `f` along the line, of A on B, to the rows of inertia minus applied forces; both act at the position of B.
    pub fn push_along(&self, f: T, dynamics: &mut [T]) {
        let [nx, ny] = self.normal;
        add_force(dynamics, 0, self.lever_a, [f * ny, -f * nx]);
        add_force(dynamics, 3, self.lever_b, [-f * ny, f * nx]);
    }

    /// The offset for an element with the inputs of a [`PointOnLine`] first.
    #[inline]
    pub fn of(x: &ElementState<'_, T>) -> Self {
        let (frame_a, frame_b, p) = (Frame::of(x, 0), Frame::of(x, 3), PointOnLineInputs(x.p));
        let [ax, ay] = p.a();
        let ra = frame_a.turned(ax, ay);
        let (sin, cos) = (frame_a.theta + p.line()).sin_cos();
        let normal = [-sin, cos];
        let [bx, by] = p.b();
        let lever_b = frame_b.turned(bx, by);
        let pb = frame_b.point(lever_b);
        let lever_a = [pb[0] - frame_a.x, pb[1] - frame_a.y];
        let gap = [lever_a[0] - ra[0], lever_a[1] - ra[1]];
        let value = normal[0] * gap[0] + normal[1] * gap[1];
        Self { value, lever_a, lever_b, normal, along: cos * gap[0] + sin * gap[1] }
    }

    /// Adds the reaction of the line on both bodies; on A it acts at the position of B.
    #[inline]
    pub fn react(&self, l: T, dynamics: &mut [T]) {
        let [nx, ny] = self.normal;
        add_force(dynamics, 0, self.lever_a, [-l * nx, -l * ny]);
        add_force(dynamics, 3, self.lever_b, [l * nx, l * ny]);
    }
}

impl Element for PointOnLine {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let offset = Offset::of(x);
        constraint[0] = offset.value;
        offset.react(x.l[0], dynamics);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (x.l[0], Offset::of(x).along);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Keeps point `b` on the line through point `a` at the angle `line` (rad) in the body of `a`.
    pub fn point_on_line(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>) -> ElementIndex {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        self.add_object(name.into(), PointOnLine::object(), &coordinates, &[a.x, a.y, line, b.x, b.y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};

    #[test]
    fn a_pin_two_metres_along_a_slot_and_a_tenth_off_it() {
        // The slot is along +x of A; the pin is at (2, 0.1). A force of 5 N of the pin on the slot, upwards.
        let x = at(&[0.0; 5], &[0.0, 0.0, 0.0, 2.0, 0.1, 0.7], &[5.0]);
        let (dynamics, constraint) = rows(&PointOnLine, &x);
        close(&constraint, &[0.1]);
        close(&dynamics, &[0.0, -5.0, -10.0, 0.0, 5.0, 0.0]);
        close(&measured(&PointOnLine, &x), &[5.0, 2.0]);
    }
}
