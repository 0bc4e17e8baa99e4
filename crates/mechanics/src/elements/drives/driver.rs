//! A drive between two coordinates.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// A drive: the difference of two coordinates is a function of time, Φ = q_B − q_A − f(t).
///
/// Coordinates q_A, q_B; parameters those of the function. Measures the effort that the drive needs, and its power.
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.5.
#[derive(Clone, Copy, Debug)]
pub struct Driver<F>(pub F);

impl<F: Motion> Element for Driver<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        constraint[0] = x.q[1] - x.q[0] - self.0.position(x.p, x.t);
        (dynamics[0], dynamics[1]) = (-x.l[0], x.l[0]);
    }

    fn num_constraints(&self) -> usize {
        1
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["driving_force", "power"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        (out[0], out[1]) = (-x.l[0], -x.l[0] * (x.v[1] - x.v[0]));
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Prescribes `b` − `a` as a function of time.
    pub fn driver(
        &mut self,
        name: &str,
        a: Coordinate,
        b: Coordinate,
        motion: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        self.add(name, Driver(motion), &[a, b], parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};
    use crate::motion::ConstantSpeed;

    #[test]
    fn the_effort_is_the_reaction_and_the_closure_the_lag() {
        let drive = Driver(ConstantSpeed);
        let x = ElementState { t: 2.0, p: &[0.5, 3.0], q: &[1.0, 7.0], v: &[1.0, 4.0], a: &[0.0; 2], l: &[-5.0] };
        let (dynamics, constraint) = rows(&drive, &x);
        close(&dynamics, &[5.0, -5.0]);
        close(&constraint, &[-0.5]);
        close(&measured(&drive, &x), &[5.0, 15.0]);
    }
}
