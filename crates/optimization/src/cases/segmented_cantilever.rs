//! Vanderplaats' cantilever of N segments: widths and heights, least volume.
//!
//! A tip load P bends a cantilever of length L in N segments of equal length ℓ with rectangular sections bᵢ × hᵢ, i counted
//! from the wall. Minimize Σ bᵢ hᵢ ℓ subject to
//!
//! $$ \sigma_i = \frac{M_i h_i}{2 I_i} \le \bar\sigma ,\qquad h_i \le 20\, b_i ,\qquad y_N \le \bar y , $$
//!
//! with Mᵢ = P (L + ℓ − xᵢ), xᵢ = iℓ, Iᵢ = bᵢ hᵢ³/12, and the tip deflection by recursion from the wall:
//!
//! $$ y'_i = \frac{P\ell}{E I_i} \Bigl( L + \frac\ell2 - x_i \Bigr) + y'_{i-1} ,\qquad
//!    y_i = \frac{P\ell^2}{2 E I_i} \Bigl( L - x_i + \frac{2\ell}3 \Bigr) + y'_{i-1}\ell + y_{i-1} . $$
//!
//! Units N and cm: P = 5e4, E = 2e7, L = 500, σ̄ = 14 000, ȳ = 2.5.
//!
//! # Sources
//! Vanderplaats, *Numerical Optimization Techniques for Engineering Design* (1984), chapter 7.

use super::Optimum;
use crate::function;
use crate::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity};
use autodiff::Scalar;
use error::{Error, Result};

const LOAD: f64 = 5e4;
const YOUNG: f64 = 2e7;
const LENGTH: f64 = 500.0;
const ALLOWED_STRESS: f64 = 14e3;
const ALLOWED_DEFLECTION: f64 = 2.5;

/// Stresses of the segments, responses 0 … N − 1, and the tip deflection, response N; the design is b then h.
struct Cantilever {
    segments: usize,
}

impl Cantilever {
    fn segment(&self) -> f64 {
        LENGTH / self.segments as f64
    }

    /// xᵢ of the segment of index `k` from zero: the distance of its far end from the wall.
    fn end(&self, k: usize) -> f64 {
        (k + 1) as f64 * self.segment()
    }

    fn tip<S: Scalar>(&self, b: &[S]) -> S {
        let l = self.segment();
        let (mut y, mut slope) = (S::from(0.0), S::from(0.0));
        for k in 0..self.segments {
            let flexibility = (b[k] * b[self.segments + k].powi(3)).recip() * (12.0 * LOAD * l / YOUNG);
            y = flexibility * (0.5 * l * (LENGTH - self.end(k) + 2.0 * l / 3.0)) + slope * l + y;
            slope = flexibility * (LENGTH + 0.5 * l - self.end(k)) + slope;
        }
        y
    }
}

impl ClosedForm for Cantilever {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        if h == self.segments {
            return self.tip(b);
        }
        let moment = LOAD * (LENGTH + self.segment() - self.end(h));
        (b[h] * b[self.segments + h].powi(2)).recip() * (6.0 * moment)
    }
}

/// The problem with N = `segments`, 2N variables and 2N + 1 constraints.
///
/// Volume and height over width are explicit, stresses and deflection are the responses of an analysis.
///
/// # Errors
/// [`Error::Option`] if there is no segment.
pub fn problem(segments: usize) -> Result<Problem> {
    Error::check_option("number of segments", "at least 1", segments as f64, segments > 0)?;
    let mut parts = ProblemBuilder::new(format!("cantilever of {segments} segments"));
    for (name, start) in [("width", 5.0), ("height", 40.0)] {
        for k in 1..=segments {
            parts.variable(DesignVariable::new(format!("{name} {k}"), "cm", start).within(0.1, 100.0));
        }
    }
    let length = LENGTH / segments as f64;
    let volume = function!([n: usize = segments, l: f64 = length] |p| {
        (0..n).fold(S::from(0.0), |sum, k| sum + p.design[k] * p.design[n + k] * l)
    });
    parts.minimize("volume", "cm³", Quantity::plain(volume));
    for k in 0..segments {
        let stress = parts.constant(&format!("stress {}", k + 1), "N/cm²");
        let same = Quantity::plain(function!(|p| p.response[0])).of(&[stress]);
        parts.subject_to(Constraint::at_most(format!("strength {}", k + 1), ALLOWED_STRESS, same));
    }
    let tip = parts.constant("tip deflection", "cm");
    let same = Quantity::plain(function!(|p| p.response[0])).of(&[tip]);
    parts.subject_to(Constraint::at_most("stiffness", ALLOWED_DEFLECTION, same));
    for k in 0..segments {
        let slender = function!([n: usize = segments, k: usize = k] |p| p.design[n + k] - p.design[k] * 20.0);
        parts.subject_to(Constraint::at_most(format!("slenderness {}", k + 1), 0.0, Quantity::plain(slender)));
    }
    parts.build_analytic(Cantilever { segments })
}

/// Minimum volume in cm³ for some numbers of segments.
pub const VOLUMES: [(usize, f64); 7] = [
    (1, 89_523.18),
    (2, 72_959.62),
    (5, 65_419.66),
    (10, 64_244.83),
    (20, 63_841.64),
    (25, 63_781.07),
    (50, 63_686.00),
];

/// The optimum for five segments: h = 20 b in all of them.
pub const fn five_segments_optimum() -> Optimum {
    Optimum::computed(VOLUMES[2].1, &[], "two optimizers to seven digits").within(1e-6).of_any_design()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_segment_is_the_cantilever_of_the_textbook() {
        let one = Cantilever { segments: 1 };
        let inertia = 3.0 * 40f64.powi(3) / 12.0;
        let tip = LOAD * LENGTH.powi(3) / (3.0 * YOUNG * inertia);
        assert!((one.response(1, &[3.0, 40.0], f64::NAN) / tip - 1.0).abs() < 1e-14);
        assert!((one.response(0, &[3.0, 40.0], f64::NAN) / (LOAD * LENGTH * 20.0 / inertia) - 1.0).abs() < 1e-14);
        // With h = 20 b and the stress at its limit b³ = 6 P L / (400 σ̄).
        let b = (6.0 * LOAD * LENGTH / (400.0 * ALLOWED_STRESS)).cbrt();
        let stiff = (4.0 * LOAD * LENGTH.powi(3) / (8000.0 * YOUNG * ALLOWED_DEFLECTION)).sqrt().sqrt();
        let least = 20.0 * b.max(stiff).powi(2) * LENGTH;
        assert!((least / VOLUMES[0].1 - 1.0).abs() < 1e-7, "{least}");
    }

    #[test]
    fn equal_segments_are_one_beam() {
        let tip = |n: usize| Cantilever { segments: n }.tip(&[vec![3.0f64; n], vec![40.0; n]].concat());
        assert!((tip(7) / tip(1) - 1.0).abs() < 1e-13);
        assert!(problem(0).is_err());
    }
}
