//! The straight line between two points of two bodies.

use crate::mechanism::element::ElementState;
use crate::mechanism::frame::{Frame, add_force, point_velocity};
use crate::mechanism::{Coordinate, Marker};
use autodiff::Scalar;

/// Distance of two points with its rate, and the action of a force along it.
///
/// If the points coincide, the length is zero, the rate is their relative speed, and the direction is NaN, so that an
/// analysis that needs it fails.
pub struct Line<T> {
    /// From A to B in m.
    pub gap: [T; 2],
    /// Velocity of B relative to A in m/s.
    pub gap_rate: [T; 2],
    /// |gap|.
    pub length: T,
    /// Rate of the length.
    pub rate: T,
    /// gap / length.
    pub direction: [T; 2],
    lever_a: [T; 2],
    lever_b: [T; 2],
}

impl<T: Scalar> Line<T> {
    /// The line of an element whose first inputs are the points A and B.
    #[inline]
    pub fn of(x: &ElementState<'_, T>) -> Self {
        let (frame_a, frame_b) = (Frame::of(x, 0), Frame::of(x, 3));
        let [ax, ay, bx, by] = [x.p[0], x.p[1], x.p[2], x.p[3]];
        let (lever_a, lever_b) = (frame_a.turned(ax, ay), frame_b.turned(bx, by));
        let (pa, pb) = (frame_a.point(lever_a), frame_b.point(lever_b));
        let (va, vb) = (point_velocity(x, 0, lever_a), point_velocity(x, 3, lever_b));
        let gap = [pb[0] - pa[0], pb[1] - pa[1]];
        let gap_rate = [vb[0] - va[0], vb[1] - va[1]];
        let length = norm(gap);
        if length.re() == 0.0 {
            let rate = norm(gap_rate);
            return Self { gap, gap_rate, length, rate, direction: [T::from(f64::NAN); 2], lever_a, lever_b };
        }
        let inverse = length.recip();
        let direction = [gap[0] * inverse, gap[1] * inverse];
        let rate = gap_rate[0] * direction[0] + gap_rate[1] * direction[1];
        Self { gap, gap_rate, length, rate, direction, lever_a, lever_b }
    }

    /// Returns whether the points coincide.
    #[inline]
    pub fn is_point(&self) -> bool {
        self.length.re() == 0.0
    }

    /// Adds a tension `f`, positive if it pulls the points together, as rows inertia − force.
    #[inline]
    pub fn add_axial_force(&self, f: T, dynamics: &mut [T]) {
        self.apply([f * self.direction[0], f * self.direction[1]], dynamics);
    }

    /// Adds the force `f` on A and −`f` on B as rows inertia − force.
    #[inline]
    pub fn apply(&self, [fx, fy]: [T; 2], dynamics: &mut [T]) {
        add_force(dynamics, 0, self.lever_a, [-fx, -fy]);
        add_force(dynamics, 3, self.lever_b, [fx, fy]);
    }
}

/// |w|, with derivatives of zero at w = 0.
#[inline]
pub(crate) fn norm<T: Scalar>([x, y]: [T; 2]) -> T {
    let square = x * x + y * y;
    if square.re() == 0.0 { T::zero() } else { square.sqrt() }
}

/// Describes the state of an element that needs a direction if its points coincide.
pub fn without_direction(x: &ElementState<'_, f64>) -> Option<String> {
    Line::of(x).is_point().then(|| "its two points coincide, so that it has no direction".to_owned())
}

/// Coordinates of the bodies of two points, and the body-fixed coordinates of the points.
pub fn ends<S: Scalar>(a: Marker<S>, b: Marker<S>) -> ([Coordinate; 6], [S; 4]) {
    let ([ax, ay, at], [bx, by, bt]) = (a.body.coordinates(), b.body.coordinates());
    ([ax, ay, at, bx, by, bt], [a.x, a.y, b.x, b.y])
}

/// Positions and velocities for tests: A at the origin, B at (3, 4) m with the velocity (1, 2) m/s.
#[cfg(test)]
pub fn three_four_five() -> ([f64; 6], [f64; 6]) {
    ([0.0, 0.0, 0.0, 3.0, 4.0, 0.0], [0.0, 0.0, 0.0, 1.0, 2.0, 0.0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving};

    #[test]
    fn a_line_of_five_metres_grows_by_its_component() {
        let (q, v) = three_four_five();
        let line = Line::of(&moving(&[0.0; 4], &q, &v, &[]));
        close(&[line.length, line.rate], &[5.0, 2.2]);
        let mut rows = [0.0; 6];
        line.add_axial_force(10.0, &mut rows);
        close(&rows, &[-6.0, -8.0, 0.0, 6.0, 8.0, 0.0]);
    }

    #[test]
    fn points_that_coincide_have_a_length_and_a_rate_but_no_direction() {
        let x = moving(&[0.0; 4], &[0.0; 6], &[0.0, 0.0, 0.0, 3.0, 4.0, 0.0], &[]);
        let line = Line::of(&x);
        assert_eq!((line.length, line.rate), (0.0, 5.0));
        assert!(line.direction[0].is_nan() && without_direction(&x).is_some());
    }
}
