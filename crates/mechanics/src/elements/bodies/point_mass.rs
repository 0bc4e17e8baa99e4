//! A point mass.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Symbol};
use crate::mechanism::{Body, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A point mass: a body without rotation, m (a − g) = F.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.1.
#[derive(Clone, Copy, Debug)]
pub struct PointMass;

as_object!(PointMass);

element_inputs!(PointMassInputs {
    body: translations("its coordinates x and y"),
    mass: required("kg", 1.0, "mass"),
    gravity_x: gravity(),
    gravity_y: gravity(),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "point",
    family: Family::Body,
    inputs: INPUTS,
    measures: &[],
    about: "a point mass, which does not rotate",
    law: "",
    symbol: Symbol::None,
};

impl Element for PointMass {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let p = PointMassInputs(x.p);
        dynamics[0] = p.mass() * (x.a[0] - p.gravity_x());
        dynamics[1] = p.mass() * (x.a[1] - p.gravity_y());
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1]
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let p = PointMassInputs(x.p);
        let kinetic = p.mass() * (x.v[0] * x.v[0] + x.v[1] * x.v[1]) * 0.5;
        Energy { kinetic, potential: -p.mass() * (p.gravity_x() * x.q[0] + p.gravity_y() * x.q[1]) }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let mass = PointMassInputs(p).mass();
        (!(mass > 0.0)).then(|| format!("mass is {mass} kg"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a point mass; as a body it does not rotate.
    pub fn point_mass(&mut self, name: &str, mass: S, x: S, y: S) -> Body {
        let [x, y] = self.point(name, [x, y]);
        let body = Body { x, y, theta: self.ground().theta };
        let [gx, gy, _] = self.gravity;
        self.add_object(name.into(), PointMass::object(), &[body.x, body.y], &[mass, gx, gy]);
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    #[test]
    fn half_a_kilogram_under_gravity() {
        let x = ElementState {
            t: 0.0,
            p: &[0.5, 1.0, -10.0],
            q: &[2.0, 3.0],
            v: &[3.0, 4.0],
            a: &[3.0, 0.0],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&PointMass, &x).0, &[1.0, 5.0]);
        close(&energies(&PointMass, &x), &[6.25, 14.0]);
        assert!(PointMass.validate_parameters(&[f64::NAN]).is_some());
    }
}
