//! Two bodies joined rigidly.

use crate::elements::element::{Element, Local};
use crate::elements::joints::revolute::Revolute;
use crate::mechanism::{Marker, Mechanism, Part};
use autodiff::Scalar;

/// A weld: a [`Revolute`] whose bodies also keep their relative rotation.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and of B (m), θ_B − θ_A (rad). λ is the force
/// of A on B (N) and the couple (N·m).
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 3.3.
#[derive(Clone, Copy, Debug)]
pub struct Weld;

impl Element for Weld {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        Element::residual(&Revolute, x, balance, closure);
        closure[2] = x.q[2] - x.q[5] + x.p[4];
        balance[2] += x.l[2];
        balance[5] -= x.l[2];
    }

    fn closures(&self) -> usize {
        3
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 3, 4]
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force_x", "force_y", "couple"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&x.l[..3]);
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins the bodies of `a` and `b` at these points, the second turned against the first by `turn` (rad).
    pub fn weld(&mut self, name: &str, a: Marker<S>, b: Marker<S>, turn: S) -> Part {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        self.add(name, Weld, &coordinates, &[a.x, a.y, b.x, b.y, turn])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{at, close, measured, rows};

    #[test]
    fn a_pin_with_a_couple() {
        let x = at(&[0.5, 0.0, -0.5, 0.0, 0.3], &[0.0, 0.0, 0.0, 1.1, 0.2, 0.0], &[3.0, 4.0, 6.0]);
        let (balance, closure) = rows(&Weld, &x);
        close(&closure, &[-0.1, -0.2, 0.3]);
        close(&balance, &[3.0, 4.0, 8.0, -3.0, -4.0, -4.0]);
        close(&measured(&Weld, &x), &[3.0, 4.0, 6.0]);
    }
}
