//! An elastic joint.

use crate::elements::element::{Element, ElementState, Energy};
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;

/// A bushing: linear springs and dampers between two points along the axes of body A, and between the rotations.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, k_x, k_y (N/m), k_θ (N·m/rad), c_x, c_y
/// (N·s/m), c_θ (N·m·s/rad). The force acts at point B on both bodies.
///
/// **Source.** Blundell & Harty, *The Multibody Systems Approach to Vehicle Dynamics* (2004), Chapter 3.
#[derive(Clone, Copy, Debug)]
pub struct Bushing;

/// Deformation of a bushing and its rate, in the axes of body A.
struct Deformed<T> {
    gap: [T; 3],
    rate: [T; 3],
    frame: Frame<T>,
    lever_a: [T; 2],
    lever_b: [T; 2],
}

impl<T: Scalar> Deformed<T> {
    fn of(x: &ElementState<'_, T>) -> Self {
        let (a, b) = (Frame::of(x, 0), Frame::of(x, 3));
        let (ra, lever_b) = (a.turned(x.p[0], x.p[1]), b.turned(x.p[2], x.p[3]));
        let pb = b.point(lever_b);
        let lever_a = [pb[0] - a.x, pb[1] - a.y];
        let gap = [lever_a[0] - ra[0], lever_a[1] - ra[1]];
        // Seen from A, the gap changes by the velocity of B against the point of A that coincides with it.
        let (va, vb) = (point_velocity(x, 0, lever_a), point_velocity(x, 3, lever_b));
        let rate = [vb[0] - va[0], vb[1] - va[1]];
        let into = |w: [T; 2]| [a.cos * w[0] + a.sin * w[1], a.cos * w[1] - a.sin * w[0]];
        let ([gx, gy], [rx, ry]) = (into(gap), into(rate));
        let gap = [gx, gy, b.theta - a.theta];
        Self { gap, rate: [rx, ry, x.v[5] - x.v[2]], frame: a, lever_a, lever_b }
    }

    fn generalized_force(&self, x: &ElementState<'_, T>) -> [T; 3] {
        [0, 1, 2].map(|k| x.p[4 + k] * self.gap[k] + x.p[7 + k] * self.rate[k])
    }
}

impl Element for Bushing {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _closure: &mut [T]) {
        let deformed = Deformed::of(x);
        let effort = deformed.generalized_force(x);
        let [fx, fy] = deformed.frame.turned(effort[0], effort[1]);
        add_force(dynamics, 0, deformed.lever_a, [-fx, -fy]);
        add_force(dynamics, 3, deformed.lever_b, [fx, fy]);
        dynamics[2] -= effort[2];
        dynamics[5] += effort[2];
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force_x", "force_y", "moment"]
    }

    fn measure<T: Scalar>(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&Deformed::of(x).generalized_force(x));
    }

    fn energy<T: Scalar>(&self, x: &ElementState<'_, T>) -> Energy<T> {
        let gap = Deformed::of(x).gap;
        let potential = [0, 1, 2].map(|k| x.p[4 + k] * gap[k] * gap[k] * 0.5).into_iter().sum();
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
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        let parameters = [&[a.x, a.y, b.x, b.y], &stiffness[..], &damping[..]].concat();
        self.add(name, Bushing, &coordinates, &parameters)
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
        // The force acts at B: 0.1 m above A, in line with it, so that A feels no couple but the torsional one.
        close(&rows(&Bushing, &x).0, &[0.0, -12.0, -3.5, 0.0, 12.0, 3.5]);
        close(&energies(&Bushing, &x), &[0.0, 0.7]);
    }
}
