//! A rigid body in space.

use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Symbol};
use crate::mechanism::frame3::{Frame3, euler_parameters};
use crate::mechanism::rotation::{l_times, l_transposed_times};
use crate::mechanism::vector::{add, cross, dot, product, scaled, transposed_product};
use crate::mechanism::{Body3, Mechanism, Pose3};
use crate::{as_object, element_inputs};
use autodiff::Scalar;
use nalgebra::Matrix3;

/// A rigid body in space with a reference point O, in absolute coordinates and Euler parameters.
///
/// With the centre of mass C at the body-fixed vector c from O, the inertia J about C and the angular velocity ω, both along
/// the axes of the body:
///
/// $$ m(\mathbf a_C - \mathbf g) = \mathbf F ,\qquad
///    \mathbf J\dot{\boldsymbol\omega} + \boldsymbol\omega\times\mathbf J\boldsymbol\omega
///    + \mathbf c\times m\,\mathbf R^{\mathsf T}(\mathbf a_C - \mathbf g) = \mathbf M_O $$
///
/// A torque M along the axes of the body acts on the Euler parameters by 2 LᵀM/|e|².
///
/// # Sources
/// Nikravesh, *Computer-Aided Analysis of Mechanical Systems* (1988), Sections 8.3 and 11.4.
#[derive(Clone, Copy, Debug)]
pub struct RigidBody3;

as_object!(RigidBody3);

element_inputs!(RigidBody3Inputs {
    body: body3("its coordinates x, y, z and Euler parameters"),
    mass: required("kg", 1.0, "mass"),
    centre_x: optional("0", "m", 0.05, "centre of mass, body-fixed x"),
    centre_y: optional("0", "m", -0.02, "centre of mass, body-fixed y"),
    centre_z: optional("0", "m", 0.03, "centre of mass, body-fixed z"),
    inertia_xx: required("kg·m²", 0.1, "moment of inertia about x through the centre of mass"),
    inertia_yy: required("kg·m²", 0.12, "moment of inertia about y through the centre of mass"),
    inertia_zz: required("kg·m²", 0.15, "moment of inertia about z through the centre of mass"),
    inertia_xy: optional("0", "kg·m²", 0.01, "entry xy of the inertia matrix, −∫ x y dm"),
    inertia_yz: optional("0", "kg·m²", -0.02, "entry yz of the inertia matrix, −∫ y z dm"),
    inertia_zx: optional("0", "kg·m²", 0.005, "entry zx of the inertia matrix, −∫ z x dm"),
    gravity_x: gravity(),
    gravity_y: gravity(),
    gravity_z: gravity(),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "rigid",
    family: Family::Body,
    inputs: INPUTS,
    measures: &[],
    about: "a rigid body in space",
    law: "",
    symbol: Symbol::None,
};

/// Mass, centre of mass and inertia of a body in space.
#[derive(Clone, Copy, Debug)]
pub struct MassProperties3<S> {
    /// Mass in kg.
    pub mass: S,
    /// Body-fixed coordinates of the centre of mass in m.
    pub centre: [S; 3],
    /// Moments of inertia Jxx, Jyy, Jzz about the centre of mass along the axes of the body, in kg·m².
    pub moments: [S; 3],
    /// Entries Jxy, Jyz, Jzx of the inertia matrix in kg·m², such as Jxy = −∫ x y dm.
    pub products: [S; 3],
}

impl<S: Scalar> MassProperties3<S> {
    /// A body with its reference point in the centre of mass and its axes along the principal axes: mass (kg) and principal
    /// moments of inertia (kg·m²).
    pub fn principal(mass: S, moments: [S; 3]) -> Self {
        Self { mass, centre: [S::zero(); 3], moments, products: [S::zero(); 3] }
    }

    /// Moves the centre of mass to `centre` (m, body-fixed). The moments of inertia remain those about the centre of mass.
    pub fn with_centre(self, centre: [S; 3]) -> Self {
        Self { centre, ..self }
    }
}

impl<T: Copy> RigidBody3Inputs<'_, T> {
    fn centre(self) -> [T; 3] {
        [self.centre_x(), self.centre_y(), self.centre_z()]
    }

    fn inertia(self) -> [[T; 3]; 3] {
        let (xy, yz, zx) = (self.inertia_xy(), self.inertia_yz(), self.inertia_zx());
        [[self.inertia_xx(), xy, zx], [xy, self.inertia_yy(), yz], [zx, yz, self.inertia_zz()]]
    }

    fn gravity(self) -> [T; 3] {
        [self.gravity_x(), self.gravity_y(), self.gravity_z()]
    }
}

impl Element for RigidBody3 {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let (p, frame) = (RigidBody3Inputs(x.p), Frame3::of(x, 0));
        let (rate, second) = (euler_parameters(x.v, 0), euler_parameters(x.a, 0));
        // Along the axes of the body.
        let omega = scaled(l_times(&frame.e, &rate), frame.factor);
        let alpha = add(scaled(l_times(&frame.e, &second), frame.factor), scaled(omega, -frame.growth(&rate)));
        let centre = p.centre();
        let swing = add(cross(alpha, centre), cross(omega, cross(omega, centre)));
        let swing = frame.turned(swing);
        let force = [0, 1, 2].map(|k| p.mass() * (x.a[k] + swing[k] - p.gravity()[k]));
        let inertia = p.inertia();
        let gyroscopic = cross(omega, product(&inertia, omega));
        let lever = cross(centre, transposed_product(&frame.rotation, force));
        let torque = add(product(&inertia, alpha), add(gyroscopic, lever));
        dynamics[..3].copy_from_slice(&force);
        dynamics[3..].copy_from_slice(&l_transposed_times(&frame.e, scaled(torque, frame.factor)));
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let (p, frame) = (RigidBody3Inputs(x.p), Frame3::of(x, 0));
        let lever = frame.turned(p.centre());
        let velocity = frame.velocity(x, lever);
        let omega = scaled(l_times(&frame.e, &euler_parameters(x.v, 0)), frame.factor);
        let spin = dot(omega, product(&p.inertia(), omega));
        let position = add(frame.origin, lever);
        Energy {
            kinetic: (p.mass() * dot(velocity, velocity) + spin) * 0.5,
            potential: -p.mass() * dot(p.gravity(), position),
        }
    }

    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        let p = RigidBody3Inputs(p);
        let mass = p.mass();
        if !(mass > 0.0) {
            return Some(format!("mass is {mass} kg, and must be positive"));
        }
        check_inertia(p.inertia())
    }
}

/// Describes an inertia matrix that no rigid body has.
fn check_inertia(j: [[f64; 3]; 3]) -> Option<String> {
    if j.as_flattened().iter().any(|x| !x.is_finite()) {
        return Some(format!("the inertia {j:?} kg·m² is not finite"));
    }
    let moments = Matrix3::from_fn(|i, k| j[i][k]).symmetric_eigenvalues();
    let [a, b, c] = [moments[0], moments[1], moments[2]];
    let (least, largest) = (a.min(b).min(c), a.max(b).max(c));
    let principal = format!("the principal moments of inertia are {a:.6e}, {b:.6e} and {c:.6e} kg·m²");
    if !(least > 0.0) {
        let remedy =
            "all must be positive; give a thin rod a small moment about its axis, and check the sign of the products";
        return Some(format!("{principal}: {remedy}"));
    }
    // a + b ≥ c, with the rounding of a flat plate.
    (a + b + c < 2.0 * largest * (1.0 - 1e-9))
        .then(|| format!("{principal}: the largest must not exceed the sum of the others"))
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a rigid body in space with its reference point and axes at `pose`.
    pub fn body3(&mut self, name: &str, properties: MassProperties3<S>, pose: Pose3<S>) -> Body3 {
        let body = self.massless_frame3(name, pose);
        let MassProperties3 { mass, centre, moments, products } = properties;
        let parameters = [&[mass][..], &centre, &moments, &products, &self.gravity].concat();
        self.add_object(name.into(), RigidBody3::object(), &body.coordinates(), &parameters);
        body
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, rows};

    /// 2 kg at (0.1, 0, 0) of the body; moments 1, 2 and 2.5 kg·m²; gravity of 10 m/s² downwards.
    const BODY: [f64; 13] = [2.0, 0.1, 0.0, 0.0, 1.0, 2.0, 2.5, 0.0, 0.0, 0.0, 0.0, 0.0, -10.0];

    #[test]
    fn a_spinning_body_with_gyroscopic_torque_and_eccentric_weight() {
        // ω = (3, 4, 0): ω × Jω = (0, 0, 3·8 − 4·3) = (0, 0, 12) N·m. The centre moves with ω × (0.1, 0, 0) = (0, 0, −0.4) m/s
        // and is accelerated by ω × (0, 0, −0.4) = (−1.6, 1.2, 0) m/s²; with the weight the force is (−3.2, 2.4, 20) N and
        // the torque about the reference point (0, −2, 0.24) N·m. For e = (1, 0, 0, 0) a torque acts by (0, 2 M).
        let v = [0.0, 0.0, 0.0, 0.0, 1.5, 2.0, 0.0];
        // ω̇ = 0 with |e| = 1 on the way: ë = −|ė|² e.
        let a = [0.0, 0.0, 0.0, -6.25, 0.0, 0.0, 0.0];
        let x = ElementState {
            t: 0.0,
            p: &BODY,
            q: &[0.0, 0.0, 0.5, 1.0, 0.0, 0.0, 0.0],
            v: &v,
            a: &a,
            l: &[],
            sides: Default::default(),
        };
        close(&rows(&RigidBody3, &x).0, &[-3.2, 2.4, 20.0, 0.0, 0.0, -4.0, 24.48]);
        // ½·2·0.16 + ½ (9 + 32) J, and 2·10·0.5 J.
        close(&energies(&RigidBody3, &x), &[20.66, 10.0]);
    }

    #[test]
    fn impossible_masses_and_inertias_are_described() {
        let with = |k: usize, value: f64| {
            let mut p = BODY;
            p[k] = value;
            RigidBody3.validate_parameters(&p)
        };
        assert_eq!(with(0, 2.0), None);
        assert_eq!(with(6, 3.0), None);
        assert!(with(0, -1.0).unwrap().contains("mass is -1 kg"));
        assert!(with(4, 0.0).unwrap().contains("all must be positive"));
        assert!(with(7, 1.5).unwrap().contains("all must be positive"));
        assert!(with(6, 3.1).unwrap().contains("must not exceed the sum"));
        assert!(with(8, f64::NAN).unwrap().contains("not finite"));
    }
}
