//! One body of a tree in space at an instant; motions and wrenches.

use crate::mechanism::rotation::{e_times, e_transposed_times, matrix, square};
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::vector::{add, scaled};
use crate::tree::space::joint::{BodyMotion, angular_bias, angular_velocity};
/// A motion (rotation, translation of the reference point) or a wrench (moment about it, force), in world axes.
pub(crate) type Twist<T> = [T; 6];

/// A body of a tree at an instant, in world axes, and the joint that connects it to its parent.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PlacedBody<T> {
    pub origin: [T; 3],
    pub e: [T; 4],
    pub rotation: [[T; 3]; 3],
    pub velocity: [T; 3],
    /// Angular velocity.
    pub spin: [T; 3],
    pub acceleration: [T; 3],
    /// Angular acceleration.
    pub turn: [T; 3],
    /// From the reference point of the parent to that of the body.
    pub lever: [T; 3],
    /// From the reference point of the parent to the joint's point of the second marker.
    pub arm: [T; 3],
    /// From the reference point of the body to that point.
    pub tip: [T; 3],
    /// Axes of the joint's first marker.
    pub axes: [[T; 3]; 3],
    /// Motion of the body relative to its parent at the rate one of each joint coordinate, of each component of the angular
    /// velocity for Euler parameters.
    pub columns: [Twist<T>; 3],
    /// Acceleration of the body at zero accelerations of the parent and of the joint coordinates.
    pub bias: Twist<T>,
}

impl<T: StateScalar> PlacedBody<T> {
    /// At the origin.
    pub fn zero() -> Self {
        let (zero, one) = (T::from(0.0), T::from(1.0));
        let none = [zero; 3];
        Self {
            origin: none,
            e: [one, zero, zero, zero],
            rotation: [none; 3],
            velocity: none,
            spin: none,
            acceleration: none,
            turn: none,
            lever: none,
            arm: none,
            tip: none,
            axes: [none; 3],
            columns: [[zero; 6]; 3],
            bias: [zero; 6],
        }
    }

    /// A body whose coordinates have these positions and velocities.
    #[inline(always)]
    pub fn of(q: &[T; 7], v: &[T; 7]) -> Self {
        let body = BodyMotion::of(q, v);
        Self {
            origin: body.origin,
            e: body.e,
            rotation: matrix(&body.e),
            velocity: body.velocity,
            spin: body.spin,
            ..Self::zero()
        }
    }

    /// Sets the accelerations of a body with these velocities and accelerations of its coordinates.
    #[inline(always)]
    pub fn accelerate(&mut self, v: &[T; 7], a: &[T; 7]) {
        let rate = [v[3], v[4], v[5], v[6]];
        let own = angular_velocity(&self.e, &[a[3], a[4], a[5], a[6]]);
        self.turn = add(own, angular_bias(&self.e, &rate, self.spin));
        self.acceleration = [a[0], a[1], a[2]];
    }

    /// Positions and velocities of the seven coordinates.
    #[inline(always)]
    pub fn coordinates(&self) -> ([T; 7], [T; 7]) {
        let ([x, y, z], [e0, e1, e2, e3]) = (self.origin, self.e);
        let ([u, v, w], [r0, r1, r2, r3]) = (self.velocity, rates(&self.e, self.spin));
        ([x, y, z, e0, e1, e2, e3], [u, v, w, r0, r1, r2, r3])
    }

    /// Accelerations of the seven coordinates.
    #[inline(always)]
    pub fn second(&self) -> [T; 7] {
        let rate = rates(&self.e, self.spin);
        let shrinking = -(square(&rate) / square(&self.e));
        let own = rates(&self.e, self.turn);
        let [a0, a1, a2, a3] = [0, 1, 2, 3].map(|k| own[k] + self.e[k] * shrinking);
        let [x, y, z] = self.acceleration;
        [x, y, z, a0, a1, a2, a3]
    }
}

/// Rates ½ Eᵀ ω of Euler parameters that keep their length.
#[inline(always)]
pub(crate) fn rates<T: StateScalar>(e: &[T; 4], spin: [T; 3]) -> [T; 4] {
    e_transposed_times(e, spin).map(|x| x * 0.5)
}

/// The moment of the rows of the Euler parameters of a body: the inverse of 2 Eᵀ m/|e|².
#[inline(always)]
pub(crate) fn moment_of_rows<T: StateScalar>(e: &[T; 4], rows: &[T; 4]) -> [T; 3] {
    scaled(e_times(e, rows), T::from(0.5))
}

/// 2 Eᵀ m/|e|²: the rows of Euler parameters on which the moment m acts.
#[inline(always)]
pub(crate) fn rows_of_moment<T: StateScalar>(e: &[T; 4], moment: [T; 3]) -> [T; 4] {
    e_transposed_times(e, scaled(moment, square(e).recip() * 2.0))
}

/// The first and the last three components.
#[inline(always)]
pub(crate) fn halves<T: Copy>(x: &Twist<T>) -> [[T; 3]; 2] {
    [[x[0], x[1], x[2]], [x[3], x[4], x[5]]]
}

/// The inverse of [`halves`].
#[inline(always)]
pub(crate) fn joined<T: Copy>([a, b]: [[T; 3]; 2]) -> Twist<T> {
    [a[0], a[1], a[2], b[0], b[1], b[2]]
}

/// Power of a wrench on a motion.
#[inline(always)]
pub(crate) fn power<T: StateScalar>(a: &Twist<T>, b: &Twist<T>) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5]
}

/// The values of `x` for the coordinates of a body.
#[inline(always)]
pub(crate) fn of_body<T: Copy>(x: &[T], coordinates: &[usize; 7]) -> [T; 7] {
    coordinates.map(|i| x[i])
}
