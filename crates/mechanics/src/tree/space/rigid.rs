//! Rigid bodies and point masses of a tree in space, without calls of their elements.

use crate::elements::spatial::bodies::{point_mass3, rigid_body3};
use crate::mechanism::ElementInstance;
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::vector::{add, cross, product, scaled, subtract, transposed_product};
use crate::tree::space::placed::PlacedBody;

/// Mass properties of a body in its own axes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct RigidProperties<T> {
    pub mass: T,
    /// Centre of mass.
    pub centre: [T; 3],
    /// Inertia matrix about the centre of mass.
    pub inertia: [[T; 3]; 3],
    /// Gravitational acceleration, in world axes.
    pub gravity: [T; 3],
}

/// Returns whether the element is a rigid body or a point mass in space.
pub(crate) fn is_body<S>(instance: &ElementInstance<S>) -> bool {
    is_rigid(instance) || is_point(instance)
}

fn is_rigid<S>(instance: &ElementInstance<S>) -> bool {
    instance.element.descriptor().is_some_and(|own| std::ptr::eq(own, &rigid_body3::DESCRIPTOR))
}

fn is_point<S>(instance: &ElementInstance<S>) -> bool {
    instance.element.descriptor().is_some_and(|own| std::ptr::eq(own, &point_mass3::DESCRIPTOR))
}

impl<T: StateScalar> RigidProperties<T> {
    /// Of the element of a body.
    pub fn of(instance: &ElementInstance<T>) -> Self {
        let (p, zero) = (&instance.parameters, T::from(0.0));
        if is_point(instance) {
            let gravity = [p[1], p[2], p[3]];
            return Self { mass: p[0], centre: [zero; 3], inertia: [[zero; 3]; 3], gravity };
        }
        let [xx, yy, zz, xy, yz, zx] = [4, 5, 6, 7, 8, 9].map(|k| p[k]);
        Self {
            mass: p[0],
            centre: [p[1], p[2], p[3]],
            inertia: [[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]],
            gravity: [p[10], p[11], p[12]],
        }
    }

    /// Wrench (moment about the reference point, force) of the inertia minus the weight, in world axes.
    #[inline(always)]
    pub fn wrench(&self, body: &PlacedBody<T>) -> [T; 6] {
        let centre = product(&body.rotation, self.centre);
        let omega = transposed_product(&body.rotation, body.spin);
        let alpha = transposed_product(&body.rotation, body.turn);
        let own = add(product(&self.inertia, alpha), cross(omega, product(&self.inertia, omega)));
        let swing = add(cross(body.turn, centre), cross(body.spin, cross(body.spin, centre)));
        let force = scaled(subtract(add(body.acceleration, swing), self.gravity), self.mass);
        let [mx, my, mz] = add(product(&body.rotation, own), cross(centre, force));
        [mx, my, mz, force[0], force[1], force[2]]
    }
}
