//! A pin that holds two points together.

use crate::elements::element::{ConstraintDerivatives, Element, ElementState, Variable};
use crate::mechanism::frame::{Frame, add_force};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// A pin: the points A and B of two bodies coincide.
///
/// $$ \Phi = \mathbf r_A - \mathbf r_B = 0 ,\qquad \lambda = \text{force of A on B, in N} $$
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and of B (m).
/// Measures the reaction on body B.
///
/// **Source.** Nikravesh, *Planar Multibody Dynamics* (2008), Section 7.2.
#[derive(Clone, Copy, Debug)]
pub struct Revolute;

impl Element for Revolute {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        let (a, b) = (Frame::of(x, 0), Frame::of(x, 3));
        let (ra, rb) = (a.turned(x.p[0], x.p[1]), b.turned(x.p[2], x.p[3]));
        let (pa, pb) = (a.point(ra), b.point(rb));
        constraint[0] = pa[0] - pb[0];
        constraint[1] = pa[1] - pb[1];
        add_force(dynamics, 0, ra, [x.l[0], x.l[1]]);
        add_force(dynamics, 3, rb, [-x.l[0], -x.l[1]]);
    }

    fn num_constraints(&self) -> usize {
        2
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 3, 4]
    }

    /// A lever r turns with its body: its derivatives with respect to θ and to its own components are levers r′ as well,
    /// with rates ω r′⊥ and α r′⊥ − ω² r′.
    fn constraint_derivatives(
        &self,
        x: &ElementState<'_, f64>,
        variables: &[Variable],
        out: &mut ConstraintDerivatives<'_>,
    ) -> bool {
        let frames = [Frame::of(x, 0), Frame::of(x, 3)];
        for (k, variable) in variables.iter().enumerate() {
            let (side, lever) = match *variable {
                Variable::Coordinate(i @ (2 | 5)) => {
                    let side = i / 3;
                    let [rx, ry] = frames[side].turned(x.p[2 * side], x.p[2 * side + 1]);
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
            let (spin, turn) = (x.v[3 * side + 2], x.a[3 * side + 2]);
            out.dynamics[6 * k + 3 * side + 2] = ux * x.l[1] - uy * x.l[0];
            out.constraint[2 * k] = [ux, -spin * uy, -turn * uy - spin * spin * ux];
            out.constraint[2 * k + 1] = [uy, spin * ux, turn * ux - spin * spin * uy];
        }
        true
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force_x", "force_y", "force"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (x.l[0], x.l[1]);
        out[2] = (x.l[0] * x.l[0] + x.l[1] * x.l[1]).sqrt();
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Pins the points `a` and `b` of two bodies together.
    pub fn revolute(&mut self, name: &str, a: Marker<S>, b: Marker<S>) -> ElementIndex {
        let [ax, ay, at] = a.body.coordinates();
        let [bx, by, bt] = b.body.coordinates();
        self.add(name, Revolute, &[ax, ay, at, bx, by, bt], &[a.x, a.y, b.x, b.y])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, has_its_slopes, measured, rows};

    #[test]
    fn a_pin_half_a_metre_out_on_both_bodies() {
        // A at the origin, B's reference point at (1.1, 0.2): the pin points are (0.5, 0) and (0.6, 0.2).
        let x = at(&[0.5, 0.0, -0.5, 0.0], &[0.0, 0.0, 0.0, 1.1, 0.2, 0.0], &[3.0, 4.0]);
        let (dynamics, constraint) = rows(&Revolute, &x);
        close(&constraint, &[-0.1, -0.2]);
        close(&dynamics, &[3.0, 4.0, 2.0, -3.0, -4.0, 2.0]);
        close(&measured(&Revolute, &x), &[3.0, 4.0, 5.0]);
    }

    #[test]
    fn the_closed_form_is_what_jets_of_dual_numbers_give() {
        let (p, l) = ([0.5, 0.1, -0.4, 0.2], [3.0, -4.0]);
        let (q, v) = ([0.0, 0.1, 0.3, 1.1, 0.2, -0.7], [0.3, 0.1, 2.0, -1.0, 0.5, -3.0]);
        has_its_slopes(
            &Revolute,
            &ElementState { t: 0.0, p: &p, q: &q, v: &v, a: &[0.2, -1.0, 5.0, 0.1, 0.7, 8.0], l: &l },
        );
    }
}
