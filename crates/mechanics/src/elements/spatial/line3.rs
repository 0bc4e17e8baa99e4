//! The straight line between two points of two bodies in space.

use crate::mechanism::element::ElementState;
use crate::mechanism::frame3::{Frame3, PlacedMarker, WIDTH3, check_marker};
use crate::mechanism::rotation::Rotation;
use crate::mechanism::vector::{dot, norm, scaled, subtract};
use crate::mechanism::{Coordinate, Marker3};
use autodiff::Scalar;

/// The markers A and B of an element whose first inputs they are.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MarkerPair<T> {
    /// The marker A.
    pub a: PlacedMarker<T>,
    /// The marker B.
    pub b: PlacedMarker<T>,
}

impl<T: Scalar> MarkerPair<T> {
    pub fn of(x: &ElementState<'_, T>) -> Self {
        let p = |first: usize| [0, 1, 2, 3, 4, 5, 6].map(|k| x.p[first + k]);
        Self { a: Frame3::of(x, 0).marker(p(0)), b: Frame3::of(x, WIDTH3).marker(p(7)) }
    }

    /// Orientations of the markers of an element whose first inputs they are.
    pub fn orientations(&self, x: &ElementState<'_, T>) -> [Rotation<T>; 2] {
        [(&self.a, 0), (&self.b, 7)].map(|(marker, first)| {
            let own = [3, 4, 5, 6].map(|k| x.p[first + k]);
            Rotation::euler_parameters(marker.frame.e).then(Rotation::euler_parameters(own))
        })
    }

    /// From A to B in m, in world axes.
    pub fn gap(&self) -> [T; 3] {
        subtract(self.b.point, self.a.point)
    }

    /// Velocity of B relative to A in m/s, in world axes.
    pub fn gap_rate(&self, x: &ElementState<'_, T>) -> [T; 3] {
        subtract(self.b.frame.velocity(x, self.b.lever), self.a.frame.velocity(x, self.a.lever))
    }

    /// Adds the force `f` to the rows of A and −`f` to those of B, both at the point B.
    pub fn apply_at_b(&self, f: [T; 3], rows: &mut [T]) {
        self.a.frame.add_force(rows, subtract(self.b.point, self.a.frame.origin), f);
        self.b.frame.add_force(rows, self.b.lever, f.map(|f| -f));
    }

    /// Adds the torque `m` to the rows of A and −`m` to those of B.
    pub fn apply_torque(&self, m: [T; 3], rows: &mut [T]) {
        self.a.frame.add_torque(rows, m);
        self.b.frame.add_torque(rows, m.map(|m| -m));
    }
}

/// Distance of two points in space with its rate, and the action of a force along it.
///
/// If the points coincide, the length is zero, the rate is their relative speed, and the direction is NaN, so that an
/// analysis that needs it fails.
pub(crate) struct Line3<T> {
    /// From A to B in m.
    pub gap: [T; 3],
    /// Velocity of B relative to A in m/s.
    pub gap_rate: [T; 3],
    /// |gap|.
    pub length: T,
    /// Rate of the length.
    pub rate: T,
    direction: [T; 3],
    ends: MarkerPair<T>,
}

impl<T: Scalar> Line3<T> {
    /// The line of an element whose first inputs are the points A and B.
    pub fn of(x: &ElementState<'_, T>) -> Self {
        let ends = MarkerPair::of(x);
        let (gap, gap_rate) = (ends.gap(), ends.gap_rate(x));
        let length = norm(gap);
        if length.re() == 0.0 {
            return Self { gap, gap_rate, length, rate: norm(gap_rate), direction: [T::from(f64::NAN); 3], ends };
        }
        let direction = scaled(gap, length.recip());
        Self { gap, gap_rate, length, rate: dot(gap_rate, direction), direction, ends }
    }

    /// Returns whether the points coincide.
    pub fn is_point(&self) -> bool {
        self.length.re() == 0.0
    }

    /// Adds a tension `f`, positive if it pulls the points together, as rows inertia − force.
    pub fn add_axial_force(&self, f: T, dynamics: &mut [T]) {
        self.apply(scaled(self.direction, f), dynamics);
    }

    /// Adds the force `f` on A and −`f` on B as rows inertia − force.
    pub fn apply(&self, f: [T; 3], dynamics: &mut [T]) {
        let MarkerPair { a, b } = &self.ends;
        a.frame.add_force(dynamics, a.lever, f.map(|f| -f));
        b.frame.add_force(dynamics, b.lever, f);
    }
}

/// Describes the state of an element that needs a direction if its points coincide.
pub(crate) fn without_direction3(x: &ElementState<'_, f64>) -> Option<String> {
    Line3::of(x).is_point().then(|| "its two points coincide, so that it has no direction".to_owned())
}

/// Describes a marker of an element whose first inputs are the markers A and B, if its orientation is not a rotation.
pub(crate) fn check_ends(p: &[f64]) -> Option<String> {
    let marker = |first: usize| [0, 1, 2, 3, 4, 5, 6].map(|k| p[first + k]);
    check_marker("a", marker(0)).or_else(|| check_marker("b", marker(7)))
}

/// Coordinates of the bodies of two markers, and the parameters of the markers.
pub(crate) fn ends3<S: Scalar>(a: Marker3<S>, b: Marker3<S>) -> (Vec<Coordinate>, Vec<S>) {
    ([a.body.coordinates(), b.body.coordinates()].concat(), [a.parameters(), b.parameters()].concat())
}

/// Coordinates for tests: two bodies with the axes of the world, at the given positions.
#[cfg(test)]
pub(crate) fn upright(a: [f64; 3], b: [f64; 3]) -> [f64; 14] {
    let e = [1.0, 0.0, 0.0, 0.0];
    std::array::from_fn(|k| match k {
        0..3 => a[k],
        3..7 => e[k - 3],
        7..10 => b[k - 7],
        _ => e[k - 10],
    })
}

/// Parameters of two markers for tests: points with the axes of their bodies.
#[cfg(test)]
pub(crate) fn points(a: [f64; 3], b: [f64; 3]) -> [f64; 14] {
    upright(a, b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::{close, moving};

    #[test]
    fn a_line_of_seven_metres_grows_by_its_component() {
        // From the origin to (2, 3, 6); the second body turns about z with 2 rad/s (ė₃ = 1), its point one metre along x from
        // its reference point: velocity (0, 2, 0).
        let (q, p) = (upright([0.0; 3], [1.0, 3.0, 6.0]), points([0.0; 3], [1.0, 0.0, 0.0]));
        let mut v = [0.0; 14];
        v[13] = 1.0;
        let line = Line3::of(&moving(&p, &q, &v, &[]));
        close(&[line.length, line.rate], &[7.0, 6.0 / 7.0]);
        let mut rows = [0.0; 14];
        line.add_axial_force(7.0, &mut rows);
        // On B the torque (1, 0, 0) × (2, 3, 6) = (0, −6, 3), doubled on the Euler parameters.
        close(&rows, &[-2.0, -3.0, -6.0, 0.0, 0.0, 0.0, 0.0, 2.0, 3.0, 6.0, 0.0, 0.0, -12.0, 6.0]);
    }

    #[test]
    fn points_that_coincide_have_no_direction() {
        let (q, p) = (upright([0.0; 3], [0.0; 3]), points([0.0; 3], [0.0; 3]));
        assert!(without_direction3(&moving(&p, &q, &[0.0; 14], &[])).is_some());
        let mut bad = p;
        bad[10] = f64::NAN;
        assert!(check_ends(&bad).unwrap().contains("point b is no rotation"));
    }
}
