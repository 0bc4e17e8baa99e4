//! The unloaded shape of a beam: a straight line or an arc of a circle, with a prestress.

use crate::mechanism::Pose;
use autodiff::Scalar;

/// Unloaded shape and prestress of a beam.
///
/// The axis is an arc of a circle from the first to the last point. With the distance D of the points and the rise s, it subtends
/// the angle φ = 4 atan(2 s/D): a half circle has the rise D/2. Its elements are chords of equal length, which differ from the arc
/// by the square of the element's angle, φ²/(24 n²).
#[derive(Clone, Copy, Debug)]
pub struct BeamShape<S> {
    /// First and last point in m.
    pub span: [[S; 2]; 2],
    /// Height of the middle of the arc above the line of the points in m, positive to the left of the way from the first to the
    /// last point; zero for a straight beam.
    pub rise: S,
    /// Normal force at the unloaded length in N, positive in tension.
    pub tension: S,
}

/// Half angle in rad below which the ratio of two sines is its series: the error is of the order of its sixth power.
const SMALL_ANGLE: f64 = 1e-3;

impl<S: Scalar> BeamShape<S> {
    /// Angle in rad by which the tangent turns clockwise from the first to the last point.
    pub fn angle(&self) -> S {
        (self.rise * 2.0).atan2(self.distance()) * 4.0
    }

    /// Length in m of one of `elements` equal elements.
    pub fn element_length(&self, elements: usize) -> S {
        self.distance() * self.chord(1.0 / elements as f64)
    }

    /// Point and tangent at the `fraction` of the arc.
    pub fn pose(&self, fraction: f64) -> Pose<S> {
        let ([from, to], angle) = (self.span, self.angle());
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        let (sin, cos) = (angle * (0.5 * (1.0 - fraction))).sin_cos();
        let chord = self.chord(fraction);
        let (along, across) = (chord * cos, chord * sin);
        Pose {
            x: from[0] + dx * along - dy * across,
            y: from[1] + dy * along + dx * across,
            theta: dy.atan2(dx) + angle * (0.5 - fraction),
        }
    }

    fn distance(&self) -> S {
        let [from, to] = self.span;
        let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
        (dx * dx + dy * dy).sqrt()
    }

    /// Chord of the `fraction` f of the arc, relative to that of the whole: sin(f φ/2)/sin(φ/2).
    fn chord(&self, fraction: f64) -> S {
        let half = self.angle() * 0.5;
        if half.re().abs() < SMALL_ANGLE {
            let (square, f) = (half * half, fraction * fraction);
            let fourth = (7.0 - 10.0 * f + 3.0 * f * f) / 360.0;
            return (square * ((1.0 - f) / 6.0) + square * square * fourth + 1.0) * fraction;
        }
        (half * fraction).sin() / half.sin()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elements::element_tests::close;

    fn shape(rise: f64) -> BeamShape<f64> {
        BeamShape { span: [[1.0, 0.0], [3.0, 0.0]], rise, tension: 0.0 }
    }

    #[test]
    fn a_half_circle_to_the_left() {
        let pose = |fraction: f64| {
            let Pose { x, y, theta } = shape(1.0).pose(fraction);
            [x, y, theta]
        };
        let quarter = std::f64::consts::FRAC_PI_2;
        close(&pose(0.0), &[1.0, 0.0, quarter]);
        close(&pose(0.5), &[2.0, 1.0, 0.0]);
        close(&pose(0.75), &[2.0 + 0.5f64.sqrt(), 0.5f64.sqrt(), -0.5 * quarter]);
        close(&pose(1.0), &[3.0, 0.0, -quarter]);
        close(&[shape(1.0).element_length(2)], &[2f64.sqrt()]);
    }

    #[test]
    fn the_series_continues_the_sines() {
        // φ/2 = 2 atan(s) on both sides of the limit.
        for fraction in [0.25, 0.6, 1.0] {
            let [below, above] = [0.999_999, 1.000_001].map(|near| shape(near * 0.5 * SMALL_ANGLE).chord(fraction));
            close(&[below], &[above]);
        }
    }
}
