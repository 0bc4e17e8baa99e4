//! A point mass in space.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Symbol};
use crate::mechanism::vector::dot;
use crate::mechanism::{Body3, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A point mass in space: a body without rotation, m (a − g) = F.
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 11.1.
#[derive(Clone, Copy, Debug)]
pub struct PointMass3;

as_object!(PointMass3);

element_inputs!(PointMass3Inputs {
    body: translations3("its coordinates x, y and z"),
    mass: required("kg", 1.0, "mass"),
    gravity_x: gravity(),
    gravity_y: gravity(),
    gravity_z: gravity(),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "point",
    family: Family::Body,
    inputs: INPUTS,
    measures: &[],
    about: "a point mass in space, which does not rotate",
    law: "",
    symbol: Symbol::None,
};

impl<T: Copy> PointMass3Inputs<'_, T> {
    fn gravity(self) -> [T; 3] {
        [self.gravity_x(), self.gravity_y(), self.gravity_z()]
    }
}

impl Element for PointMass3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let p = PointMass3Inputs(x.p);
        for (k, g) in p.gravity().into_iter().enumerate() {
            dynamics[k] = p.mass() * (x.a[k] - g);
        }
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let p = PointMass3Inputs(x.p);
        let (r, v) = ([x.q[0], x.q[1], x.q[2]], [x.v[0], x.v[1], x.v[2]]);
        Energy { kinetic: p.mass() * dot(v, v) * 0.5, potential: -p.mass() * dot(p.gravity(), r) }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let mass = PointMass3Inputs(p).mass();
        (!(mass > 0.0)).then(|| format!("mass is {mass} kg, and must be positive"))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a point mass (kg) at `position` (m) in space; as a body it does not rotate.
    pub fn point_mass3(&mut self, name: &str, mass: S, position: [S; 3]) -> Body3 {
        let ground = self.ground3();
        let [x, y, z] = self.point(name, position);
        let body = Body3 { x, y, z, e: ground.e };
        let [gx, gy, gz] = self.gravity;
        self.add_object(name.into(), PointMass3::object(), &[body.x, body.y, body.z], &[mass, gx, gy, gz]);
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    #[test]
    fn half_a_kilogram_under_gravity() {
        let p = [0.5, 1.0, 0.0, -10.0];
        let x = ElementState {
            t: 0.0,
            p: &p,
            q: &[2.0, 7.0, 3.0],
            v: &[3.0, 4.0, 0.0],
            a: &[3.0, 2.0, 0.0],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&PointMass3, &x).0, &[1.0, 1.0, 5.0]);
        close(&energies(&PointMass3, &x), &[6.25, 14.0]);
        assert!(PointMass3.validate_parameters(&[f64::NAN, 0.0, 0.0, 0.0]).is_some());
    }
}
