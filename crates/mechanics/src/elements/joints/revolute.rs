//! A revolute joint.

use crate::elements::line::{ends, norm};
use crate::mechanism::element::{
    ConstraintDerivatives, Element, ElementDescriptor, ElementState, Family, Measure, Symbol, Variable,
};
use crate::mechanism::frame::{Frame, add_force};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A revolute joint: the points A and B of two bodies coincide.
///
/// $$ \Phi = \mathbf r_A - \mathbf r_B = 0 ,\qquad \lambda = \text{force of A on B, in N} $$
///
/// # Sources
/// Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct Revolute;

as_object!(Revolute);

element_inputs!(RevoluteInputs { a: marker("point of the first body"), b: marker("point of the second body") });

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "revolute",
    family: Family::Joint,
    inputs: INPUTS,
    measures: &[
        Measure::new("force_x", "N", "force of a on b, along x of the plane"),
        Measure::new("force_y", "N", "force of a on b, along y of the plane"),
        Measure::new("force", "N", "magnitude of the force"),
    ],
    about: "a pin that joins two points",
    law: "r_a = r_b",
    symbol: Symbol::Pin,
};

impl Element for Revolute {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (frame_a, frame_b) = (Frame::of(x, 0), Frame::of(x, 3));
        let ([ax, ay], [bx, by]) = (RevoluteInputs(x.p).a(), RevoluteInputs(x.p).b());
        let (ra, rb) = (frame_a.turned(ax, ay), frame_b.turned(bx, by));
        let (pa, pb) = (frame_a.point(ra), frame_b.point(rb));
        constraint[0] = pa[0] - pb[0];
        constraint[1] = pa[1] - pb[1];
        add_force(dynamics, 0, ra, [x.l[0], x.l[1]]);
        add_force(dynamics, 3, rb, [-x.l[0], -x.l[1]]);
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn num_constraints(&self) -> usize {
        2
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 3, 4]
    }

    /// Derivatives with respect to a translation are ±1. A lever r turns with its body: its derivatives r′ with respect to θ
    /// and to its own components turn as well, with the rates ω r′⊥ and α r′⊥ − ω² r′.
    fn constraint_derivatives(
        &self,
        x: &ElementState<'_, f64>,
        variables: &[Variable],
        out: &mut ConstraintDerivatives<'_>,
    ) -> bool {
        let frames = [Frame::of(x, 0), Frame::of(x, 3)];
        let points = [RevoluteInputs(x.p).a(), RevoluteInputs(x.p).b()];
        for (k, variable) in variables.iter().enumerate() {
            let (side, lever) = match *variable {
                Variable::Coordinate(i @ (2 | 5)) => {
                    let side = i / 3;
                    let [rx, ry] = frames[side].turned(points[side][0], points[side][1]);
                    (side, [-ry, rx])
                }
                Variable::Coordinate(i) => {
                    out.constraint[2 * k + i % 3][0] = if i < 3 { 1.0 } else { -1.0 };
                    continue;
                }
                Variable::Parameter(i) if i % 2 == 0 => (i / 2, [frames[i / 2].cos, frames[i / 2].sin]),
                Variable::Parameter(i) => (i / 2, [-frames[i / 2].sin, frames[i / 2].cos]),
            };
            let [ux, uy] = if side == 0 { lever } else { lever.map(|u| -u) };
            let (omega, alpha) = (x.v[3 * side + 2], x.a[3 * side + 2]);
            out.dynamics[6 * k + 3 * side + 2] = ux * x.l[1] - uy * x.l[0];
            out.constraint[2 * k] = [ux, -omega * uy, -alpha * uy - omega * omega * ux];
            out.constraint[2 * k + 1] = [uy, omega * ux, alpha * ux - omega * omega * uy];
        }
        true
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (x.l[0], x.l[1]);
        out[2] = norm([x.l[0], x.l[1]]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins the points `a` and `b` of two bodies by a revolute joint.
    pub fn revolute(&mut self, name: &str, a: Marker<S>, b: Marker<S>) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), Revolute::object(), &coordinates, &p)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, has_its_constraint_derivatives, measured, rows};

    #[test]
    fn a_revolute_joint_half_a_metre_from_both_reference_points() {
        // A at the origin, B's reference point at (1.1, 0.2): the pin points are (0.5, 0) and (0.6, 0.2).
        let x = at(&[0.5, 0.0, -0.5, 0.0], &[0.0, 0.0, 0.0, 1.1, 0.2, 0.0], &[3.0, 4.0]);
        let (dynamics, constraint) = rows(&Revolute, &x);
        close(&constraint, &[-0.1, -0.2]);
        close(&dynamics, &[3.0, 4.0, 2.0, -3.0, -4.0, 2.0]);
        close(&measured(&Revolute, &x), &[3.0, 4.0, 5.0]);
    }

    #[test]
    fn the_closed_form_equals_automatic_differentiation() {
        let (p, l) = ([0.5, 0.1, -0.4, 0.2], [3.0, -4.0]);
        let (q, v) = ([0.0, 0.1, 0.3, 1.1, 0.2, -0.7], [0.3, 0.1, 2.0, -1.0, 0.5, -3.0]);
        has_its_constraint_derivatives(
            &Revolute,
            &ElementState {
                t: 0.0,
                p: &p,
                q: &q,
                v: &v,
                a: &[0.2, -1.0, 5.0, 0.1, 0.7, 8.0],
                l: &l,
                sides: Default::default(),
            },
        );
    }
}
