//! A point mass.

use crate::elements::element::{Element, ElementState, Energy};
use crate::mechanism::{Body, Mechanism};
use autodiff::Scalar;

/// A point mass: a body without rotation. Coordinates x, y; parameters m (kg), g_x, g_y (m/s²).
///
/// **Source.** Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.1.
#[derive(Clone, Copy, Debug)]
pub struct PointMass;

impl Element for PointMass {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        dynamics[0] = x.p[0] * (x.a[0] - x.p[1]);
        dynamics[1] = x.p[0] * (x.a[1] - x.p[2]);
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let kinetic = x.p[0] * (x.v[0] * x.v[0] + x.v[1] * x.v[1]) * 0.5;
        Energy { kinetic, potential: -x.p[0] * (x.p[1] * x.q[0] + x.p[2] * x.q[1]) }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        (!(p[0] > 0.0)).then(|| format!("mass is {} kg", p[0]))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a point mass; as a body it does not rotate.
    pub fn point_mass(&mut self, name: &str, mass: S, x: S, y: S) -> Body {
        let zero = S::from(0.0);
        let body = Body {
            x: self.coordinate(format!("{name}.x"), x, zero),
            y: self.coordinate(format!("{name}.y"), y, zero),
            theta: self.ground().theta,
        };
        let [gx, gy] = self.gravity;
        self.add(name, PointMass, &[body.x, body.y], &[mass, gx, gy]);
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    #[test]
    fn half_a_kilogram_under_gravity() {
        let x = ElementState { t: 0.0, p: &[0.5, 1.0, -10.0], q: &[2.0, 3.0], v: &[3.0, 4.0], a: &[3.0, 0.0], l: &[] };
        close(&rows(&PointMass, &x).0, &[1.0, 5.0]);
        close(&energies(&PointMass, &x), &[6.25, 14.0]);
        assert!(PointMass.validate_parameters(&[f64::NAN]).is_some());
    }
}
