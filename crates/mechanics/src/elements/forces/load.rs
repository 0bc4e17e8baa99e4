//! An effort that is a function of time.

use crate::elements::element::{Element, ElementState};
use crate::mechanism::{Coordinate, ElementIndex, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;

/// An effort between two coordinates that is a function of time: a motor on two rotations, a load on one coordinate.
///
/// Coordinates q_A, q_B (driven forward); parameters those of the function (N or N·m).
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.2.
#[derive(Clone, Copy, Debug)]
pub struct Load<F>(pub F);

impl<F: Motion> Element for Load<F> {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        let effort = self.0.position(x.p, x.t);
        (dynamics[0], dynamics[1]) = (effort, -effort);
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["generalized_force", "power"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out[0] = self.0.position(x.p, x.t);
        out[1] = out[0] * (x.v[1] - x.v[0]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Drives `b` against `a` by an effort that is a function of time.
    pub fn load(
        &mut self,
        name: &str,
        a: Coordinate,
        b: Coordinate,
        effort: impl Motion,
        parameters: &[S],
    ) -> ElementIndex {
        self.add(name, Load(effort), &[a, b], parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, measured, rows};
    use crate::motion::ConstantSpeed;

    #[test]
    fn a_torque_that_grows_with_time_and_its_power() {
        let motor = Load(ConstantSpeed);
        let x = ElementState { t: 3.0, p: &[1.0, 2.0], q: &[0.0; 2], v: &[1.0, 5.0], a: &[0.0; 2], l: &[] };
        close(&rows(&motor, &x).0, &[7.0, -7.0]);
        close(&measured(&motor, &x), &[7.0, 28.0]);
    }
}
