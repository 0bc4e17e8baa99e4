//! An elastic joint and point forces.

use crate::multibody::element::{Element, Energy, Local};
use crate::multibody::frame::{Frame, add_force, point_velocity};
use crate::multibody::mechanism::{Marker, Mechanism, Part};
use crate::multibody::motion::Motion;
use crate::scalar::Scalar;

/// A bushing: linear springs and dampers between two points along the axes of body A, and between the rotations.
///
/// Coordinates x, y, θ of both bodies; parameters body-fixed x, y of A and B, k_x, k_y (N/m), k_θ (N·m/rad), c_x, c_y
/// (N·s/m), c_θ (N·m·s/rad). The force acts at point B on both bodies.
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
    fn of(x: &Local<'_, T>) -> Self {
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

    fn effort(&self, x: &Local<'_, T>) -> [T; 3] {
        [0, 1, 2].map(|k| x.p[4 + k] * self.gap[k] + x.p[7 + k] * self.rate[k])
    }
}

impl Element for Bushing {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let deformed = Deformed::of(x);
        let effort = deformed.effort(x);
        let [fx, fy] = deformed.frame.turned(effort[0], effort[1]);
        add_force(balance, 0, deformed.lever_a, [-fx, -fy]);
        add_force(balance, 3, deformed.lever_b, [fx, fy]);
        balance[2] -= effort[2];
        balance[5] += effort[2];
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force_x", "force_y", "couple"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out.copy_from_slice(&Deformed::of(x).effort(x));
    }

    fn energy<T: Scalar>(&self, x: &Local<'_, T>) -> Energy<T> {
        let gap = Deformed::of(x).gap;
        let potential = [0, 1, 2].map(|k| x.p[4 + k] * gap[k] * gap[k] * 0.5).into_iter().sum();
        Energy { kinetic: T::zero(), potential }
    }
}

/// A force on a point of a body, of fixed direction, as a function of time.
///
/// Coordinates x, y, θ; parameters body-fixed x, y (m), direction (rad), then those of the function (N).
#[derive(Clone, Copy, Debug)]
pub struct PointForce<F>(pub F);

impl<F: Motion> Element for PointForce<F> {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let lever = Frame::of(x, 0).turned(x.p[0], x.p[1]);
        let force = self.0.position(&x.p[3..], x.t);
        let (sin, cos) = x.p[2].sin_cos();
        add_force(balance, 0, lever, [-force * cos, -force * sin]);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["force"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = self.0.position(&x.p[3..], x.t);
    }
}

/// Contact of a point of a body with a straight wall, without friction: k δ^{3/2} (1 + 1.5 c δ̇), never pulling.
///
/// Coordinates x, y, θ; parameters body-fixed x, y, a point x, y of the wall (m), direction of its outward normal (rad),
/// k (N/m^{3/2}), c (s/m).
///
/// **Source.** Hunt & Crossley, *J. Appl. Mech.* 42 (1975) 440–445.
#[derive(Clone, Copy, Debug)]
pub struct WallContact;

impl WallContact {
    fn push<T: Scalar>(x: &Local<'_, T>) -> (T, [T; 2], [T; 2]) {
        let frame = Frame::of(x, 0);
        let lever = frame.turned(x.p[0], x.p[1]);
        let (point, velocity) = (frame.point(lever), point_velocity(x, 0, lever));
        let (sin, cos) = x.p[4].sin_cos();
        let depth = (x.p[2] - point[0]) * cos + (x.p[3] - point[1]) * sin;
        if depth.re() <= 0.0 {
            return (T::zero(), lever, [cos, sin]);
        }
        let rate = -(velocity[0] * cos + velocity[1] * sin);
        let push = x.p[5] * depth * depth.sqrt() * (x.p[6] * rate * 1.5 + 1.0);
        (if push.re() > 0.0 { push } else { T::zero() }, lever, [cos, sin])
    }
}

impl Element for WallContact {
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], _closure: &mut [T]) {
        let (push, lever, normal) = Self::push(x);
        add_force(balance, 0, lever, [-push * normal[0], -push * normal[1]]);
    }

    fn measures(&self) -> &'static [&'static str] {
        &["push"]
    }

    fn measure<T: Scalar>(&self, x: &Local<'_, T>, out: &mut [T]) {
        out[0] = Self::push(x).0;
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Joins two points elastically: stiffnesses along x and y of the body of `a` and in rotation, and dampings.
    pub fn bushing(&mut self, name: &str, a: Marker<S>, b: Marker<S>, stiffness: [S; 3], damping: [S; 3]) -> Part {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        let parameters = [&[a.x, a.y, b.x, b.y], &stiffness[..], &damping[..]].concat();
        self.add(name, Bushing, &coordinates, &parameters)
    }

    /// Applies a force (N) at a point, in the fixed `direction` (rad), as a function of time.
    pub fn force(&mut self, name: &str, at: Marker<S>, direction: S, force: impl Motion, parameters: &[S]) -> Part {
        let all = [&[at.x, at.y, direction], parameters].concat();
        self.add(name, PointForce(force), &at.body.coordinates(), &all)
    }
}
