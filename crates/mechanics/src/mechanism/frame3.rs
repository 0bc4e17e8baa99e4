//! Points, axes, velocities and forces on a body in space.

use crate::mechanism::element::ElementState;
use crate::mechanism::rotation::{e_times, e_transposed_times, matrix, square};
use crate::mechanism::vector::{add, cross, product, scaled, transposed_product};
use autodiff::Scalar;

/// Number of coordinates of a body in space.
pub(crate) const WIDTH3: usize = 7;

/// The frame of a body in space at an instant.
///
/// The rotation matrix, the angular velocity and the rows of a torque are those of e/|e|: they do not depend on the length of
/// the Euler parameters e. Torques do no work along e, so that the multiplier of the constraint |e| = 1 is zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Frame3<T> {
    /// Position of the reference point in m.
    pub origin: [T; 3],
    /// Rotation matrix, row by row: components in world axes of body-fixed vectors.
    pub rotation: [[T; 3]; 3],
    /// Euler parameters.
    pub e: [T; 4],
    /// 2/|e|².
    pub factor: T,
    /// First local coordinate.
    first: usize,
}

impl<T: Scalar> Frame3<T> {
    /// The frame whose coordinates x, y, z, e₀ to e₃ are the local coordinates `first .. first + 7`.
    pub fn of(x: &ElementState<'_, T>, first: usize) -> Self {
        let e = euler_parameters(x.q, first);
        let origin = [0, 1, 2].map(|k| x.q[first + k]);
        Self { origin, rotation: matrix(&e), e, factor: square(&e).recip() * 2.0, first }
    }

    /// A body-fixed vector in world axes.
    pub fn turned(&self, v: [T; 3]) -> [T; 3] {
        product(&self.rotation, v)
    }

    /// Angular velocity in world axes in rad/s.
    pub fn angular_velocity(&self, x: &ElementState<'_, T>) -> [T; 3] {
        scaled(e_times(&self.e, &euler_parameters(x.v, self.first)), self.factor)
    }

    /// Angular acceleration in world axes in rad/s².
    pub fn angular_acceleration(&self, x: &ElementState<'_, T>) -> [T; 3] {
        let (rate, second) = (euler_parameters(x.v, self.first), euler_parameters(x.a, self.first));
        let shrinking = -self.growth(&rate);
        let own = scaled(e_times(&self.e, &second), self.factor);
        add(own, scaled(self.angular_velocity(x), shrinking))
    }

    /// 2 e·ė/|e|², the relative rate of |e|²; zero for unit Euler parameters.
    pub fn growth(&self, rate: &[T; 4]) -> T {
        (0..4).map(|k| self.e[k] * rate[k]).sum::<T>() * self.factor
    }

    /// Velocity of the point with the lever `r` (world components) from the reference point.
    pub fn velocity(&self, x: &ElementState<'_, T>, r: [T; 3]) -> [T; 3] {
        let own = [0, 1, 2].map(|k| x.v[self.first + k]);
        add(own, cross(self.angular_velocity(x), r))
    }

    /// Acceleration of the point with the lever `r` (world components) from the reference point.
    pub fn acceleration(&self, x: &ElementState<'_, T>, r: [T; 3]) -> [T; 3] {
        let own = [0, 1, 2].map(|k| x.a[self.first + k]);
        let omega = self.angular_velocity(x);
        let tangential = cross(self.angular_acceleration(x), r);
        add(own, add(tangential, cross(omega, cross(omega, r))))
    }

    /// Adds the force `f` (N, world axes) at the lever `r` to the rows of the body.
    pub fn add_force(&self, rows: &mut [T], r: [T; 3], f: [T; 3]) {
        rows[self.first..].iter_mut().zip(f).for_each(|(row, f)| *row += f);
        self.add_torque(rows, cross(r, f));
    }

    /// Adds the torque `m` (N·m, world axes) to the rows of the body: 2 Eᵀ m/|e|².
    pub fn add_torque(&self, rows: &mut [T], m: [T; 3]) {
        let own = e_transposed_times(&self.e, scaled(m, self.factor));
        rows[self.first + 3..].iter_mut().zip(own).for_each(|(row, m)| *row += m);
    }

    /// The marker with the parameters `p`, see [`Marker3::parameters`](crate::mechanism::Marker3::parameters).
    pub fn marker(self, p: [T; 7]) -> PlacedMarker<T> {
        let [px, py, pz, e0, e1, e2, e3] = p;
        let lever = self.turned([px, py, pz]);
        let own = matrix(&[e0, e1, e2, e3]);
        let axes = [0, 1, 2].map(|k| self.turned([own[0][k], own[1][k], own[2][k]]));
        PlacedMarker { point: add(self.origin, lever), lever, axes, frame: self }
    }
}

/// A marker at an instant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedMarker<T> {
    /// World coordinates of the point in m.
    pub point: [T; 3],
    /// Vector from the reference point of the body to the point, in world axes.
    pub lever: [T; 3],
    /// The unit vectors x, y, z of the marker in world axes.
    pub axes: [[T; 3]; 3],
    /// The frame of the body.
    pub frame: Frame3<T>,
}

impl<T: Scalar> PlacedMarker<T> {
    /// A vector with components along the axes of the marker, in world axes.
    pub fn world(&self, v: [T; 3]) -> [T; 3] {
        transposed_product(&self.axes, v)
    }

    /// Components of a world vector along the axes of the marker.
    pub fn components(&self, v: [T; 3]) -> [T; 3] {
        product(&self.axes, v)
    }
}

/// The four numbers of `values` after three translations from `first` on.
pub(crate) fn euler_parameters<T: Copy>(values: &[T], first: usize) -> [T; 4] {
    [0, 1, 2, 3].map(|k| values[first + 3 + k])
}

/// Describes a marker whose orientation is not a rotation: its axis has length zero or is not a number.
pub(crate) fn check_marker(name: &str, p: [f64; 7]) -> Option<String> {
    let e = [p[3], p[4], p[5], p[6]];
    let length = square(&e).sqrt();
    let why = if length.is_finite() {
        format!("the Euler parameters {e:?} have the length {length}")
    } else {
        "an axis has length zero, or two axes are parallel".to_owned()
    };
    (!((length - 1.0).abs() < 1e-6)).then(|| format!("the orientation of its point {name} is no rotation: {why}"))
}
