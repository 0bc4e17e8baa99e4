//! A slider in a straight guide.

use crate::elements::element::{Element, ElementState};
use crate::elements::joints::point_on_line::Offset;
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// A slider: as [`PointOnLine`](crate::elements::joints::point_on_line::PointOnLine), and both bodies keep their relative rotation.
///
/// Coordinates and first five parameters as there; the sixth is θ_B − θ_A in rad. λ is the normal force in N and the
/// couple in N·m.
///
/// **Source.** Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct Prismatic;

impl Element for Prismatic {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let offset = Offset::of(x);
        constraint[0] = offset.value;
        constraint[1] = x.q[5] - x.q[2] - x.p[5];
        offset.react(x.l[0], dynamics);
        dynamics[2] -= x.l[1];
        dynamics[5] += x.l[1];
    }

    fn num_constraints(&self) -> usize {
        2
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force", "moment", "position"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1], out[2]) = (x.l[0], x.l[1], Offset::of(x).along);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Lets the body of `b` slide along the line through `a` at the angle `line` in the body of `a`, turned against it
    /// by `turn` (rad).
    pub fn prismatic(&mut self, name: &str, a: Marker<S>, line: S, b: Marker<S>, turn: S) -> ElementIndex {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        self.add(name, Prismatic, &coordinates, &[a.x, a.y, line, b.x, b.y, turn])
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
