//! The two-point adaptive nonlinear approximation TANA-3.

use super::{AnyModel, Approximation, Expansion, FittedModel, TwoPointExponential};
use crate::problem::{Problem, ProblemScalar};
use error::Result;
use std::sync::Arc;

/// TANA-3: powers that fit the gradient at the previous design, and a correction that fits the value there.
///
/// With y = (bₖ/b₀ₖ)^pₖ − 1, y¹ its value at the previous design, and the gradient s,
///
/// $$ \tilde r(b) = r(b_0) + \sum_k \frac{s_k b_{0,k}}{p_k} y_k
///    {} + \frac{H}{2} \frac{\sum_k y_k^2}{\sum_k (y_k - y^1_k)^2 + \sum_k y_k^2} ,\qquad
///    H = 2 \Bigl[ r(b_1) - r(b_0) - \sum_k \frac{s_k b_{0,k}}{p_k} y^1_k \Bigr] . $$
///
/// Exponents and their exceptions are those of [`TwoPointExponential`], the absolute value of an exponent is at least 0.001.
/// Without a previous design H is zero. The approximation is neither convex nor separable.
///
/// # Sources
///
/// Xu & Grandhi, *Computers & Structures* 67 (1998) 325–334 (with bᵖ instead of (b/b₀)ᵖ, which does not
/// depend on units).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tana {
    /// The exponents.
    pub powers: TwoPointExponential,
}

impl Default for Tana {
    fn default() -> Self {
        Self { powers: TwoPointExponential { least: -5.0, most: 5.0, otherwise: 1.0 } }
    }
}

impl Approximation for Tana {
    fn check(&self, _: &Problem) -> Result<()> {
        self.powers.check_limits()
    }

    fn memory(&self) -> usize {
        1
    }

    fn is_odd(&self) -> bool {
        true
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let here = expansion.here;
        let away = |p: f64| if p.abs() < 1e-3 { 1e-3f64.copysign(p) } else { p };
        // If the search subregion contains zero, the variable itself is used instead of a power: division by an origin
        // of zero is avoided.
        let exponent = self.powers.exponents(expansion).into_iter().map(away);
        let scale = |k: usize| {
            if expansion.subproblem_box.keeps_sign(k) { None } else { Some(expansion.subproblem_box.scale[k]) }
        };
        let powers = exponent.enumerate().map(|(k, exponent)| match scale(k) {
            None => Power::Ratio { origin: here.design[k], exponent },
            Some(scale) => Power::Step { origin: here.design[k], scale },
        });
        let powers: Vec<Power> = powers.collect();
        let slopes: Vec<f64> = powers.iter().zip(here.gradient).map(|(p, s)| s / p.slope()).collect();
        let before = expansion.last().map(|sample| {
            let y: Vec<f64> = powers.iter().zip(sample.design).map(|(p, &b)| p.at(b)).collect();
            let linear: f64 = y.iter().zip(&slopes).map(|(y, s)| y * s).sum();
            (y, 2.0 * (sample.value - here.value - linear))
        });
        // After a step of zero the value at the previous design is that at b₀: H is zero.
        let before = before.filter(|(y, _)| y.iter().any(|y| *y != 0.0));
        Ok(Arc::new(Adapted { value: here.value, powers, slopes, before }))
    }
}

/// A variable in the space in which the expansion is linear: zero at the origin.
#[derive(Clone, Copy, Debug)]
enum Power {
    Ratio { origin: f64, exponent: f64 },
    Step { origin: f64, scale: f64 },
}

impl Power {
    fn at<S: ProblemScalar>(&self, b: S) -> S {
        match *self {
            Self::Ratio { origin, exponent } => (b / origin).powf(exponent) - 1.0,
            Self::Step { origin, scale } => (b - origin) / scale,
        }
    }

    /// dy/db at the origin.
    fn slope(&self) -> f64 {
        match *self {
            Self::Ratio { origin, exponent } => exponent / origin,
            Self::Step { scale, .. } => 1.0 / scale,
        }
    }
}

struct Adapted {
    value: f64,
    powers: Vec<Power>,
    /// ∂r/∂y.
    slopes: Vec<f64>,
    /// y¹ and H.
    before: Option<(Vec<f64>, f64)>,
}

impl FittedModel for Adapted {
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S {
        let y: Vec<S> = self.powers.iter().zip(b).map(|(p, &b)| p.at(b)).collect();
        let linear = y.iter().zip(&self.slopes).fold(S::from(self.value), |sum, (&y, &s)| sum + y * s);
        let Some((first, h)) = &self.before else { return linear };
        let here = y.iter().fold(S::from(0.0), |sum, &y| sum + y * y);
        let there = y.iter().zip(first).fold(S::from(0.0), |sum, (&y, &f)| sum + (y - f) * (y - f));
        linear + here / (here + there) * (0.5 * h)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};
    use autodiff::DualNum as _;
    use autodiff::{HyperDual, gradient};

    #[test]
    fn fits_value_and_gradient_here_and_the_value_at_the_previous_design() {
        check(&Tana::default(), false);
        let f = |b: &[HyperDual]| b[0] * b[0] * b[1] + b[1].recip() * 3.0;
        let case = Case::of(f, &[1.0, 2.0], &[0.1, 0.1], &[4.0, 4.0]).after(&[1.5, 1.0]);
        let model = case.fit(&Tana::default()).unwrap();
        assert!((model.real(&[1.5, 1.0]) - (2.25 + 3.0)).abs() < 1e-12);
    }

    #[test]
    fn a_sum_of_powers_is_exact() {
        // A sum of powers: exponents 3 and −2 are found, H is zero, the approximation is exact.
        let f = |b: &[HyperDual]| b[0].powi(3) + b[1].powi(-2) * 3.0;
        let case = Case::of(f, &[1.0, 2.0], &[0.1, 0.1], &[4.0, 4.0]).after(&[1.5, 1.0]);
        let model = case.fit(&Tana::default()).unwrap();
        let (value, slope) = gradient(|b| model.dual(b), &[1.5, 1.0]);
        assert!((value - (3.375 + 3.0)).abs() < 1e-12);
        assert!((slope[0] - 6.75).abs() < 1e-11 && (slope[1] + 6.0).abs() < 1e-11);
    }
}
