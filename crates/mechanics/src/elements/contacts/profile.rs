//! A closed curve through points, and its point nearest to another point or farthest in a direction.

use crate::mechanism::element::AnyElement;
use crate::mechanism::{ElementIndex, Marker, Mechanism};
use autodiff::Scalar;
use std::sync::Arc;

/// Smallest number of points of a profile.
pub(crate) const FEWEST: usize = 4;

/// √3 − 2: ratio of the entries of the inverse of the spline matrix from point to point, which alternate in sign.
const DECAY: f64 = -0.267_949_192_431_122_7;

/// Trial positions of the search on each segment of the curve.
const TRIALS: usize = 4;

/// Iterations of the search in numbers without derivatives.
const ITERATIONS: usize = 30;

/// Number of Newton corrections in numbers with derivatives: each one doubles the number of orders of derivatives that are exact.
const CORRECTIONS: usize = 3;

/// A closed curve: the periodic cubic spline through `points` (x and y in turn, in m) with one unit of the parameter s from
/// point to point.
///
/// Material is on the left of the curve. Its curvature is continuous. Points should be about evenly spaced, and closer where the
/// curve bends.
///
/// # Sources
/// de Boor, *A Practical Guide to Splines* (1978), Chapter IV.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Profile<'a, T> {
    points: &'a [T],
}

/// Points on the closed curve of a profile through `points` (m), `per_segment` from each point to the next one; the last point is the
/// first one again. Empty without points.
pub fn profile_curve(points: &[[f64; 2]], per_segment: usize) -> Vec<[f64; 2]> {
    let Some(first) = points.first() else { return Vec::new() };
    let on = |segment: Segment<f64>| (0..per_segment).map(move |k| segment.at(k as f64 / per_segment as f64).at);
    Profile::new(points.as_flattened()).segments().into_iter().flat_map(on).chain([*first]).collect()
}

/// Position on a curve with its first and second derivatives with respect to the parameter s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CurvePoint<T> {
    pub at: [T; 2],
    pub tangent: [T; 2],
    pub second_derivative: [T; 2],
}

/// One segment of a curve: its end points and the second derivatives there.
#[derive(Clone, Copy, Debug)]
struct Segment<T> {
    ends: [[T; 2]; 2],
    second_derivatives: [[T; 2]; 2],
}

impl<T: Scalar> Segment<T> {
    /// The point at u, from 0 to 1.
    fn at(&self, u: T) -> CurvePoint<T> {
        let w = -u + 1.0;
        let component = |k: usize| {
            let [p, q] = [self.ends[0][k], self.ends[1][k]];
            let [m, n] = [self.second_derivatives[0][k], self.second_derivatives[1][k]];
            let value = p * w + q * u + (m * (w * w * w - w) + n * (u * u * u - u)) / 6.0;
            let slope = q - p + (n * (u * u * 3.0 - 1.0) - m * (w * w * 3.0 - 1.0)) / 6.0;
            [value, slope, m * w + n * u]
        };
        let [x, y] = [component(0), component(1)];
        CurvePoint { at: [x[0], y[0]], tangent: [x[1], y[1]], second_derivative: [x[2], y[2]] }
    }
}

impl Profile<'_, f64> {
    /// All segments: their second derivatives by two recursions along the points.
    fn segments(&self) -> Vec<Segment<f64>> {
        let n = self.len();
        let scale = 1.0 / (4.0 + 2.0 * DECAY);
        let sides: Vec<[f64; 2]> = (0..n).map(|i| self.right_side(i)).collect();
        let mut second_derivatives: Vec<[f64; 2]> = vec![[0.0; 2]; n];
        // The first passes around the curve bring the recursions to their periodic state.
        let turns = 40 / n + 2;
        let (mut forward, mut backward) = ([0.0; 2], [0.0; 2]);
        for step in 0..turns * n {
            let (i, j) = (step % n, n - 1 - step % n);
            for c in 0..2 {
                forward[c] = sides[i][c] + DECAY * forward[c];
                if step >= (turns - 1) * n {
                    second_derivatives[i][c] += scale * forward[c];
                    second_derivatives[j][c] += scale * DECAY * backward[c];
                }
                backward[c] = sides[j][c] + DECAY * backward[c];
            }
        }
        (0..n)
            .map(|i| Segment {
                ends: [self.point(i), self.point(i + 1)],
                second_derivatives: [second_derivatives[i], second_derivatives[(i + 1) % n]],
            })
            .collect()
    }
}

impl<'a, T: Scalar> Profile<'a, T> {
    /// The curve through `points`.
    pub fn new(points: &'a [T]) -> Self {
        Self { points }
    }

    /// Number of points.
    fn len(&self) -> usize {
        self.points.len() / 2
    }

    fn point(&self, i: usize) -> [T; 2] {
        let i = i % self.len();
        [self.points[2 * i], self.points[2 * i + 1]]
    }

    /// 6 (P₋ − 2 P + P₊) at point number `i`, the right-hand side of M₋ + 4 M + M₊ for the second derivatives M.
    fn right_side(&self, i: usize) -> [T; 2] {
        let i = i % self.len() + self.len();
        let [before, here, after] = [self.point(i - 1), self.point(i), self.point(i + 1)];
        [0, 1].map(|c| (before[c] - here[c] * 2.0 + after[c]) * 6.0)
    }

    /// Second derivatives at point number `i`.
    ///
    /// The inverse of the periodic matrix decreases by the factor [`DECAY`] from point to point.
    fn second_derivative(&self, i: usize) -> [T; 2] {
        let n = self.len();
        let mut sum = [T::from(0.0); 2];
        let mut add = |k: usize, weight: f64| {
            let side = self.right_side(i + k);
            (0..2).for_each(|c| sum[c] += side[c] * weight);
        };
        let mut weight = 1.0 / (4.0 + 2.0 * DECAY);
        add(0, weight);
        for k in 1.. {
            weight *= DECAY;
            if weight.abs() < 1e-19 {
                break;
            }
            add(k % n, weight);
            add(n - k % n, weight);
        }
        sum
    }

    fn segment(&self, i: usize) -> Segment<T> {
        Segment {
            ends: [self.point(i), self.point(i + 1)],
            second_derivatives: [self.second_derivative(i), self.second_derivative(i + 1)],
        }
    }

    /// Twice the area inside the polygon of the points, negative if they run clockwise.
    fn double_area(&self) -> f64 {
        let cross = |i: usize| {
            let ([x, y], [u, v]) = (self.point(i), self.point(i + 1));
            x.re() * v.re() - y.re() * u.re()
        };
        (0..self.len()).map(cross).sum()
    }

    /// The point of the curve at which `stationary` (with its derivative with respect to s) is zero and `cost` is least.
    fn least(
        &self,
        cost: impl Fn(&CurvePoint<f64>) -> f64,
        stationary_value: impl Fn(&CurvePoint<f64>) -> [f64; 2],
        stationary: impl Fn(&CurvePoint<T>) -> [T; 2],
    ) -> CurvePoint<T> {
        let values: Vec<f64> = self.points.iter().map(|x| x.re()).collect();
        let plain = Profile::new(&values);
        let segments = plain.segments();
        let of = |s: f64| {
            let s = s.rem_euclid(plain.len() as f64);
            let i = (s.floor() as usize).min(plain.len() - 1);
            (i, s - i as f64)
        };
        let at = |s: f64| {
            let (i, u) = of(s);
            segments[i].at(u)
        };
        let trials = (0..plain.len() * TRIALS).map(|k| k as f64 / TRIALS as f64);
        let (mut s, _) = trials
            .map(|s| (s, cost(&at(s))))
            .fold((0.0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best });
        let mut bracket = [s - 1.0 / TRIALS as f64, s + 1.0 / TRIALS as f64];
        for _ in 0..ITERATIONS {
            let [value, slope] = stationary_value(&at(s));
            bracket[usize::from(value > 0.0)] = s;
            let newton = s - value / slope;
            let is_inside = slope > 0.0 && newton > bracket[0] && newton < bracket[1];
            let next = if is_inside { newton } else { 0.5 * (bracket[0] + bracket[1]) };
            let change = (next - s).abs();
            s = next;
            if change <= 4.0 * f64::EPSILON * plain.len() as f64 {
                break;
            }
        }
        let (i, u) = of(s);
        let (segment, mut u) = (self.segment(i), T::from(u));
        for _ in 0..CORRECTIONS {
            let point = segment.at(u);
            let [value, slope] = stationary(&point);
            // At a centre of curvature no point is the nearest one.
            if slope.re().abs() <= 1e-9 * dot(point.tangent, point.tangent).re() {
                break;
            }
            u -= value / slope;
        }
        segment.at(u)
    }

    /// The point nearest to `p`, and the unit vector to the side without material, on the right of the curve.
    pub fn nearest(&self, p: [T; 2]) -> (CurvePoint<T>, [T; 2]) {
        let q = p.map(|x| x.re());
        let cost = |c: &CurvePoint<f64>| (c.at[0] - q[0]).powi(2) + (c.at[1] - q[1]).powi(2);
        let nearest = self.least(cost, |c| approach(c, q), |c| approach(c, p));
        let [tx, ty] = nearest.tangent;
        let length = (tx * tx + ty * ty).sqrt();
        (nearest, [ty / length, -tx / length])
    }

    /// The point farthest in the direction `d`.
    pub fn farthest(&self, d: [T; 2]) -> CurvePoint<T> {
        let e = d.map(|x| x.re());
        self.least(|c| -(c.at[0] * e[0] + c.at[1] * e[1]), |c| descent(c, e), |c| descent(c, d))
    }
}

/// Half the derivative of the squared distance from `p`, and its derivative.
fn approach<T: Scalar>(c: &CurvePoint<T>, p: [T; 2]) -> [T; 2] {
    let gap = [c.at[0] - p[0], c.at[1] - p[1]];
    [dot(gap, c.tangent), dot(c.tangent, c.tangent) + dot(gap, c.second_derivative)]
}

/// Derivative of the distance along −`d`, and its derivative.
fn descent<T: Scalar>(c: &CurvePoint<T>, d: [T; 2]) -> [T; 2] {
    [-dot(c.tangent, d), -dot(c.second_derivative, d)]
}

pub(crate) fn dot<T: Scalar>(a: [T; 2], b: [T; 2]) -> T {
    a[0] * b[0] + a[1] * b[1]
}

/// Describes points that make no closed curve.
pub(crate) fn validate(points: &[f64]) -> Option<String> {
    let profile = Profile::new(points);
    let n = profile.len();
    if n < FEWEST {
        return Some(format!("its profile has {n} points, and needs {FEWEST}"));
    }
    let is_repeated = |i: &usize| profile.point(*i) == profile.point(i + 1);
    if let Some(i) = (0..n).find(is_repeated) {
        let next = (i + 1) % n + 1;
        return Some(format!("points {} and {next} of its profile coincide; do not repeat the first point", i + 1));
    }
    let size = points.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    (profile.double_area().abs() <= 1e-9 * size * size).then(|| "its profile encloses no area".to_owned())
}

impl<S: Scalar> Mechanism<S> {
    /// Adds a contact of the profile through `points` on the body of `a` with the body of `b`.
    pub(super) fn add_profile(
        &mut self,
        name: &str,
        contact: Arc<dyn AnyElement>,
        [a, b]: [Marker<S>; 2],
        law: [S; 3],
        points: &[[S; 2]],
    ) -> ElementIndex {
        let coordinates = [a.body.coordinates(), b.body.coordinates()].concat();
        let parameters = [&[a.x, a.y, b.x, b.y], &law[..], points.as_flattened()].concat();
        self.add_object(name.into(), contact, &coordinates, &parameters)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::DualVec;

    /// Points of an ellipse with the half axes 0.3 m and 0.2 m.
    fn ellipse(n: usize) -> Vec<f64> {
        (0..n)
            .flat_map(|k| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / n as f64).sin_cos();
                [0.3 * cos, 0.2 * sin]
            })
            .collect()
    }

    #[test]
    fn the_spline_passes_through_its_points_and_is_periodic_and_smooth() {
        let points = [0.0f64, 0.0, 1.0, 0.2, 1.3, 1.0, 0.2, 1.4, -0.5, 0.7];
        let profile = Profile::new(&points);
        for i in 0..5 {
            let (here, next) = (profile.segment(i), profile.segment((i + 1) % 5));
            let same = profile.segments()[i];
            assert!(
                (0..2).all(|c| (here.second_derivatives[0][c] - same.second_derivatives[0][c]).abs() < 1e-14),
                "{here:?} {same:?}"
            );
            let (end, start) = (here.at(1.0), next.at(0.0));
            for c in 0..2 {
                assert!((end.at[c] - points[2 * ((i + 1) % 5) + c]).abs() < 1e-15);
                assert!((end.tangent[c] - start.tangent[c]).abs() < 1e-14, "{end:?} {start:?}");
                assert!((end.second_derivative[c] - start.second_derivative[c]).abs() < 1e-14);
            }
        }
    }

    #[test]
    fn an_ellipse_by_60_points_has_its_nearest_and_farthest_points() {
        let points = ellipse(60);
        let profile = Profile::new(&points);
        // The farthest point along (cos α, sin α) is at the distance √(a² cos² α + b² sin² α).
        for k in 0..7 {
            let (sin, cos) = (0.9 * f64::from(k)).sin_cos();
            let farthest = profile.farthest([cos, sin]);
            let expected = ((0.3 * cos).powi(2) + (0.2 * sin).powi(2)).sqrt();
            assert!((dot(farthest.at, [cos, sin]) - expected).abs() < 2e-7, "{farthest:?} {expected}");
        }
        // A point on the normal at the angle t of the ellipse, 0.1 m outside.
        for k in 0..7 {
            let (sin, cos) = (0.2 + 0.9 * f64::from(k)).sin_cos();
            let length = ((0.2 * cos).powi(2) + (0.3 * sin).powi(2)).sqrt();
            let normal = [0.2 * cos / length, 0.3 * sin / length];
            let foot = [0.3 * cos, 0.2 * sin];
            let (nearest, outward) = profile.nearest([foot[0] + 0.1 * normal[0], foot[1] + 0.1 * normal[1]]);
            for c in 0..2 {
                assert!((nearest.at[c] - foot[c]).abs() < 2e-6, "{nearest:?} {foot:?}");
                assert!((outward[c] - normal[c]).abs() < 2e-5, "{outward:?} {normal:?}");
            }
        }
    }

    #[test]
    fn derivatives_of_the_nearest_point_are_exact() {
        let points = ellipse(12);
        let distance = |p: [f64; 2]| {
            let (nearest, outward) = Profile::new(&points).nearest(p);
            dot([p[0] - nearest.at[0], p[1] - nearest.at[1]], outward)
        };
        let p = [0.25, 0.21];
        let constants: Vec<DualVec<2>> = points.iter().map(|&x| DualVec::constant(x)).collect();
        let moving = [DualVec::<2>::variable(p[0], 0), DualVec::variable(p[1], 1)];
        let (nearest, outward) = Profile::new(&constants).nearest(moving);
        let value = dot([moving[0] - nearest.at[0], moving[1] - nearest.at[1]], outward);
        let h = 1e-5;
        for k in 0..2 {
            let moved = |h: f64| {
                let mut moved = p;
                moved[k] += h;
                distance(moved)
            };
            let difference = (moved(h) - moved(-h)) / (2.0 * h);
            assert!((value.eps[k] - difference).abs() < 1e-9, "{value:?} {difference}");
        }
    }

    #[test]
    fn wrong_points_are_explained() {
        assert!(validate(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0]).unwrap().contains("needs 4"));
        assert!(validate(&[0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0]).unwrap().contains("points 4 and 1"));
        assert!(validate(&[0.0, 0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.0]).unwrap().contains("no area"));
        assert_eq!(validate(&ellipse(8)), None);
    }

    #[test]
    fn a_drawn_profile_is_closed_and_passes_through_its_points() {
        let points: Vec<[f64; 2]> = ellipse(12).as_chunks::<2>().0.to_vec();
        let curve = profile_curve(&points, 4);
        assert_eq!((curve.len(), curve[0], curve[48]), (49, points[0], points[0]));
        assert!(points.iter().enumerate().all(|(k, p)| (curve[4 * k][0] - p[0]).hypot(curve[4 * k][1] - p[1]) < 1e-12));
        // Between the points the curve is near the ellipse.
        assert!(curve.iter().all(|[x, y]| ((x / 0.3).powi(2) + (y / 0.2).powi(2) - 1.0).abs() < 2e-3));
        assert!(profile_curve(&[], 4).is_empty());
    }
}
