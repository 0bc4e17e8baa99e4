//! Points, velocities and forces on a moving frame.

use crate::mechanism::element::ElementState;
use autodiff::Scalar;

/// The frame of a body at an instant: position of its reference point, cosine and sine of its rotation.
#[derive(Clone, Copy, Debug)]
pub struct Frame<T> {
    /// Reference point, horizontal.
    pub x: T,
    /// Reference point, vertical.
    pub y: T,
    /// Rotation in rad.
    pub theta: T,
    /// Cosine of the rotation.
    pub cos: T,
    /// Sine of the rotation.
    pub sin: T,
}

impl<T: Scalar> Frame<T> {
    /// The frame whose coordinates x, y, θ are the local coordinates `first .. first + 3`.
    #[inline(always)]
    pub fn of(x: &ElementState<'_, T>, first: usize) -> Self {
        let theta = x.q[first + 2];
        let (sin, cos) = theta.sin_cos();
        Self { x: x.q[first], y: x.q[first + 1], theta, cos, sin }
    }

    /// A body-fixed vector in the axes of the plane.
    #[inline(always)]
    pub fn turned(&self, x: T, y: T) -> [T; 2] {
        [self.cos * x - self.sin * y, self.sin * x + self.cos * y]
    }

    /// Position of the point with lever `r` (inertial components) from the reference point.
    #[inline]
    pub fn point(&self, r: [T; 2]) -> [T; 2] {
        [self.x + r[0], self.y + r[1]]
    }
}

/// Velocity of the point with lever `r` of the body whose velocities are the local ones from `first` on.
#[inline]
pub fn point_velocity<T: Scalar>(x: &ElementState<'_, T>, first: usize, r: [T; 2]) -> [T; 2] {
    let spin = x.v[first + 2];
    [x.v[first] - spin * r[1], x.v[first + 1] + spin * r[0]]
}

/// Acceleration of the point with lever `r` of the body whose accelerations are the local ones from `first` on.
#[inline]
pub fn point_acceleration<T: Scalar>(x: &ElementState<'_, T>, first: usize, r: [T; 2]) -> [T; 2] {
    let (spin, turn) = (x.v[first + 2], x.a[first + 2]);
    [x.a[first] - turn * r[1] - spin * spin * r[0], x.a[first + 1] + turn * r[0] - spin * spin * r[1]]
}

/// Writes a force or torque `f` on the second of two coordinates and its reaction on the first, as rows inertia − force.
#[inline(always)]
pub fn write_force_pair<T: Scalar>(rows: &mut [T], f: T) {
    (rows[0], rows[1]) = (f, -f);
}

/// Adds the force `f` at lever `r` to the three rows of a body from `first` on.
#[inline(always)]
pub fn add_force<T: Scalar>(rows: &mut [T], first: usize, r: [T; 2], f: [T; 2]) {
    rows[first] += f[0];
    rows[first + 1] += f[1];
    rows[first + 2] += r[0] * f[1] - r[1] * f[0];
}
