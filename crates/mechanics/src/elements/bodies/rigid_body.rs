//! A rigid body in absolute coordinates.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Symbol};
use crate::mechanism::{Body, Mechanism, Pose};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A rigid body with its reference point at the centre of mass, in absolute coordinates x, y, θ.
///
/// $$ m(\ddot x - g_x) = F_x,\quad m(\ddot y - g_y) = F_y,\quad J\ddot\theta = M $$
///
/// # Sources
/// Haug, *Computer Aided Kinematics and Dynamics of Mechanical Systems* (1989), Section 6.1.
#[derive(Clone, Copy, Debug)]
pub struct RigidBody;

as_object!(RigidBody);

element_inputs!(RigidBodyInputs {
    body: body("its coordinates x, y and θ"),
    mass: required("kg", 1.0, "mass"),
    inertia: required("kg·m²", 0.1, "moment of inertia about the centre of mass"),
    gravity_x: gravity(),
    gravity_y: gravity(),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "rigid",
    family: Family::Body,
    inputs: INPUTS,
    measures: &[],
    about: "a rigid body with its reference point in the centre of mass",
    law: "",
    symbol: Symbol::None,
};

impl Element for RigidBody {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let p = RigidBodyInputs(x.p);
        dynamics[0] = p.mass() * (x.a[0] - p.gravity_x());
        dynamics[1] = p.mass() * (x.a[1] - p.gravity_y());
        dynamics[2] = p.inertia() * x.a[2];
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn linear(&self) -> &'static [usize] {
        &[0, 1, 2]
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let p = RigidBodyInputs(x.p);
        let speed_squared = x.v[0] * x.v[0] + x.v[1] * x.v[1];
        Energy {
            kinetic: (p.mass() * speed_squared + p.inertia() * x.v[2] * x.v[2]) * 0.5,
            potential: -p.mass() * (p.gravity_x() * x.q[0] + p.gravity_y() * x.q[1]),
        }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        match p {
            [m, ..] if !(*m > 0.0) => Some(format!("mass is {m} kg")),
            [_, j, ..] if !(*j > 0.0) => Some(format!("moment of inertia is {j} kg·m²")),
            _ => None,
        }
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a rigid body with its centre of mass at `pose`.
    pub fn body(&mut self, name: &str, mass: S, inertia: S, pose: Pose<S>) -> Body {
        let body = self.massless_node(name, pose);
        let [gx, gy, _] = self.gravity;
        self.add_object(name.into(), RigidBody::object(), &body.coordinates(), &[mass, inertia, gx, gy]);
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    #[test]
    fn two_kilograms_under_gravity() {
        let p = [2.0, 0.5, 0.0, -10.0];
        let x = ElementState {
            t: 0.0,
            p: &p,
            q: &[7.0, 3.0, 1.0],
            v: &[3.0, 4.0, 2.0],
            a: &[1.0, -2.0, 6.0],
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&RigidBody, &x).0, &[2.0, 16.0, 3.0]);
        close(&energies(&RigidBody, &x), &[26.0, 60.0]);
        assert!(
            RigidBody.validate_parameters(&[0.0, 1.0]).is_some()
                && RigidBody.validate_parameters(&[1.0, -1.0]).is_some()
        );
    }
}
