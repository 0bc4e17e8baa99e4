//! A bushing: an elastic connection of two bodies.

use crate::elements::line::ends;
use crate::mechanism::element::{Element, ElementDescriptor, ElementState, Energy, Family, Measure, Symbol};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use crate::{as_object, element_inputs};
use autodiff::Scalar;

/// A bushing: linear springs and dampers between two points along the axes of body A, and between the rotations.
///
/// The force acts at point B on both bodies.
///
/// # Sources
/// Blundell & Harty, *The Multibody Systems Approach to Vehicle Dynamics* (2004), Chapter 3.
#[derive(Clone, Copy, Debug)]
pub struct Bushing;

as_object!(Bushing);

element_inputs!(BushingInputs {
    a: marker("point of the first body"),
    b: marker("point of the second body"),
    stiffness_x: required("N/m", 15.0, "stiffness along x of the body of a"),
    stiffness_y: required("N/m", 10.0, "stiffness along y of the body of a"),
    stiffness_theta: required("N·m/rad", 2.0, "torsional stiffness"),
    damping_x: optional("0", "N·s/m", 1.0, "damping along x of the body of a"),
    damping_y: optional("0", "N·s/m", 0.5, "damping along y of the body of a"),
    damping_theta: optional("0", "N·m·s/rad", 0.1, "torsional damping"),
});

pub static DESCRIPTOR: ElementDescriptor = ElementDescriptor {
    kind: "bushing",
    family: Family::Force,
    inputs: INPUTS,
    measures: &[
        Measure::new("force_x", "N", "force on a along x of its body, positive if b is displaced in this direction"),
        Measure::new("force_y", "N", "force on a along y of its body, positive if b is displaced in this direction"),
        Measure::new("moment", "N·m", "torque on a, positive if b is turned counter-clockwise"),
    ],
    about: "an elastic connection of two points",
    law: "force_x = stiffness_x·u + damping_x·u̇ with the displacement u of b from a along x of the body of a, and likewise along y; moment = stiffness_theta·φ + damping_theta·φ̇ with φ = θ_b − θ_a; the forces on both bodies act at b",
    symbol: Symbol::Connection,
};

/// Deformation of a bushing and its rate, in the axes of body A.
struct Deformation<T> {
    gap: [T; 3],
    rate: [T; 3],
    frame: Frame<T>,
    lever_a: [T; 2],
    lever_b: [T; 2],
}

impl<T: Scalar> Deformation<T> {
    fn of(x: &ElementState<'_, T>) -> Self {
        let (a, b) = (Frame::of(x, 0), Frame::of(x, 3));
        let ([ax, ay], [bx, by]) = (BushingInputs(x.p).a(), BushingInputs(x.p).b());
        let (ra, lever_b) = (a.turned(ax, ay), b.turned(bx, by));
        let pb = b.point(lever_b);
        let lever_a = [pb[0] - a.x, pb[1] - a.y];
        let gap = [lever_a[0] - ra[0], lever_a[1] - ra[1]];
        // Seen from A, the gap changes by the velocity of B relative to the point of A that coincides with it.
        let (va, vb) = (point_velocity(x, 0, lever_a), point_velocity(x, 3, lever_b));
        let rate = [vb[0] - va[0], vb[1] - va[1]];
        let to_a = |w: [T; 2]| [a.cos * w[0] + a.sin * w[1], a.cos * w[1] - a.sin * w[0]];
        let ([gx, gy], [rx, ry]) = (to_a(gap), to_a(rate));
        let gap = [gx, gy, b.theta - a.theta];
        Self { gap, rate: [rx, ry, x.v[5] - x.v[2]], frame: a, lever_a, lever_b }
    }

    /// Forces along the axes of A, and torque.
    fn forces(&self, x: &ElementState<'_, T>) -> [T; 3] {
        let p = BushingInputs(x.p);
        let (stiffness, damping) = (p.stiffness(), [p.damping_x(), p.damping_y(), p.damping_theta()]);
        [0, 1, 2].map(|k| stiffness[k] * self.gap[k] + damping[k] * self.rate[k])
    }
}

impl<T: Scalar> BushingInputs<'_, T> {
    fn stiffness(self) -> [T; 3] {
        [self.stiffness_x(), self.stiffness_y(), self.stiffness_theta()]
    }
}

impl Element for Bushing {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        let deformation = Deformation::of(x);
        let [along_x, along_y, torque] = deformation.forces(x);
        let [fx, fy] = deformation.frame.turned(along_x, along_y);
        add_force(dynamics, 0, deformation.lever_a, [-fx, -fy]);
        add_force(dynamics, 3, deformation.lever_b, [fx, fy]);
        dynamics[2] -= torque;
        dynamics[5] += torque;
    }

    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Some(&DESCRIPTOR)
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&Deformation::of(x).forces(x));
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let (gap, stiffness) = (Deformation::of(x).gap, BushingInputs(x.p).stiffness());
        let potential = [0, 1, 2].map(|k| stiffness[k] * gap[k] * gap[k] * 0.5).into_iter().sum();
        Energy { kinetic: T::zero(), potential }
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins two points elastically: stiffnesses along x and y of the body of `a` and in rotation, and dampings.
    pub fn bushing(
        &mut self,
        name: &str,
        a: Marker<S>,
        b: Marker<S>,
        stiffness: [S; 3],
        damping: [S; 3],
    ) -> ElementIndex {
        let (coordinates, p) = ends(a, b);
        self.add_object(name.into(), Bushing::object(), &coordinates, &[&p[..], &stiffness[..], &damping[..]].concat())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, energies, measured, moving, rows};

    #[test]
    fn gaps_and_rates_in_the_axes_of_a_turned_body() {
        // Body A is turned by 90°: what is +y in the plane is +x in its axes. B is 0.1 m above A and rises by 2 m/s.
        let p = [0.0, 0.0, 0.0, 0.0, 100.0, 50.0, 10.0, 1.0, 2.0, 3.0];
        let quarter = std::f64::consts::FRAC_PI_2;
        let q = [0.0, 0.0, quarter, 0.0, 0.1, quarter + 0.2];
        let x = moving(&p, &q, &[0.0, 0.0, 0.0, 0.0, 2.0, 0.5], &[]);
        close(&measured(&Bushing, &x), &[12.0, 0.0, 3.5]);
        // The force acts at B: 0.1 m above A, in line with it, so that only the torsional torque acts on A.
        close(&rows(&Bushing, &x).0, &[0.0, -12.0, -3.5, 0.0, 12.0, 3.5]);
        close(&energies(&Bushing, &x), &[0.0, 0.7]);
    }
}
