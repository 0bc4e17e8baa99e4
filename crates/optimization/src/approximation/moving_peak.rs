//! Local maxima whose times move with the design.

use super::AnyModel;
use crate::problem::{Peak, ProblemScalar};
use std::sync::Arc;

/// A row for a local maximum in continuous time.
///
/// The local model in design and time around the maximum at t*,
///
/// $$ \hat g(b, t^* + τ) \approx \tilde g(b, t^*) + σ τ - \tfrac12 κ τ^2 ,\qquad
///    σ = g_t + g_{bt} \cdot Δb ,\quad κ = -g_{tt} , $$
///
/// is maximized over the times −T₋ ≤ τ ≤ T₊ up to the next minimum or the end of the interval. This adds to g̃
///
/// $$ φ(σ) = \max_{-T_- \le τ \le T_+} σ τ - \tfrac12 κ τ^2 , $$
///
/// which is σ²/2κ for a maximum within the interval. If g_t = 0 there, this is the exact second-order effect of the motion,
/// from first-order sensitivities alone. φ is linear if the maximum would leave the interval, and zero at an end from which
/// the constraint decreases. It is convex and continuously differentiable for κ > 0; κ is at
/// least a millionth divided by the squared length of the interval, so that φ of a flat peak is smooth.
pub(super) struct MovingPeak {
    /// Models of the responses at t*.
    pub models: Vec<Arc<dyn AnyModel>>,
    /// The peak and its derivatives at the start design.
    pub peak: Peak,
    /// False if the time of the peak stays fixed.
    pub is_moving: bool,
}

impl MovingPeak {
    /// σ, after the step from `origin`.
    fn slope<S: ProblemScalar>(&self, b: &[S], origin: &[f64]) -> S {
        let moved = b.iter().zip(origin).zip(&self.peak.cross).filter(|(_, c)| **c != 0.0);
        // Inside the interval the slope is zero except for rounding.
        let inside = self.peak.reach.iter().all(|&t| t > 0.0)
            && self.peak.slope.abs() < 1e-6 * -self.peak.curvature_in_time * self.span();
        let start = S::from(if inside { 0.0 } else { self.peak.slope });
        moved.fold(start, |sum, ((&b, &o), &c)| sum + (b - o) * c)
    }

    fn span(&self) -> f64 {
        self.peak.reach[0] + self.peak.reach[1]
    }

    /// κ.
    fn stiffness(&self) -> f64 {
        (-self.peak.curvature_in_time).max(1e-6 / self.span().powi(2))
    }

    /// φ, the increase of the maximum due to its motion in time.
    pub fn rise<S: ProblemScalar>(&self, b: &[S], origin: &[f64]) -> S {
        if !self.is_moving || self.span() <= 0.0 {
            return S::from(0.0);
        }
        let (slope, κ) = (self.slope(b, origin), self.stiffness());
        let time = (slope.re() / κ).clamp(-self.peak.reach[0], self.peak.reach[1]);
        if time == slope.re() / κ {
            slope * slope * (0.5 / κ)
        } else if time == 0.0 {
            S::from(0.0)
        } else {
            slope * time - 0.5 * κ * time * time
        }
    }

    /// True if the row is a quadratic in the whole box.
    pub fn stays_quadratic(&self, origin: &[f64], lower: &[f64], upper: &[f64]) -> bool {
        if !self.is_moving || self.span() <= 0.0 {
            return true;
        }
        let (slope, κ) = (self.slope::<f64>(origin, origin), self.stiffness());
        let steps = self.peak.cross.iter().enumerate();
        let corner = |up: bool| {
            let far = |(k, c): (usize, &f64)| {
                if (*c > 0.0) == up { c * (upper[k] - origin[k]) } else { c * (lower[k] - origin[k]) }
            };
            slope + steps.clone().map(far).sum::<f64>()
        };
        let (least, most) = (corner(false) / κ, corner(true) / κ);
        least >= -self.peak.reach[0] && most <= self.peak.reach[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::problem::RowId;
    use autodiff::gradient;
    use nalgebra::DMatrix;

    fn moving(slope: f64, curvature_in_time: f64, reach: [f64; 2]) -> MovingPeak {
        let row = RowId { constraint: 0, point: 0 };
        let (responses, gradients) = (vec![], DMatrix::zeros(0, 1));
        let peak = Peak {
            row,
            time: 1.0,
            responses,
            gradients,
            curvatures: vec![],
            slope,
            curvature_in_time,
            cross: vec![2.0],
            reach,
        };
        MovingPeak { models: vec![], peak, is_moving: true }
    }

    #[test]
    fn the_peak_of_a_travelling_wave_is_exact_to_second_order() {
        // g = b² − (t − b)²: at b = 1 the peak is at t* = 1, g_tt = −2, g_bt = 2, g_b = 2b + 2(t − b) = 2, g_bb at fixed t is 0.
        let d = moving(0.0, -2.0, [0.5, 0.5]);
        let φ = |b: f64| d.rise(&[b], &[1.0]);
        assert!((1.0 + 2.0 * 0.1 + φ(1.1) - 1.21).abs() < 1e-15);
        // Beyond the reach of 0.5 s the parabola is cut: σ τ − κτ²/2.
        assert!((φ(2.0) - (2.0 * 0.5 - 0.25)).abs() < 1e-15);
        let slopes = [1.4999999, 1.5000001].map(|b| gradient(|b| d.rise(b, &[1.0]), &[b]).1[0]);
        assert!((slopes[0] - slopes[1]).abs() < 1e-6);
    }

    #[test]
    fn an_end_has_no_effect_until_its_slope_changes_sign() {
        let d = moving(-1.0, -2.0, [0.0, 0.5]);
        assert_eq!(d.rise(&[1.2], &[1.0]), 0.0);
        // σ = −1 + 2·0.75 = 0.5: φ = σ²/4.
        assert!((d.rise(&[1.75], &[1.0]) - 0.0625).abs() < 1e-15);
    }

    #[test]
    fn a_flat_peak_is_bounded_by_its_reach() {
        let d = moving(0.0, 0.0, [0.5, 0.5]);
        assert!((d.rise(&[1.3], &[1.0]) - 0.6 * 0.5).abs() < 1e-6);
        assert!(!d.stays_quadratic(&[1.0], &[0.0], &[2.0]));
        assert!(moving(0.0, -10.0, [0.5, 0.5]).stays_quadratic(&[1.0], &[0.0], &[2.0]));
    }
}
