//! Sums of functions of one design variable each: the form of most approximations of structural optimization.

use super::{FittedModel, Sample};
use crate::problem::ProblemScalar;
use nlp::separable::Term;

/// r(b₀) + Σₖ fₖ(bₖ) with fₖ(b₀ₖ) = 0.
pub(super) struct Separated {
    /// r(b₀).
    pub value: f64,
    /// b₀.
    pub origin: Vec<f64>,
    /// One for each variable.
    pub forms: Vec<UnivariateForm>,
    /// Box in which the forms are valid; `None` if they are valid everywhere.
    pub domain: Option<[Vec<f64>; 2]>,
}

impl Separated {
    /// A model around the design of `here` that is valid everywhere.
    pub fn new(here: Sample, forms: Vec<UnivariateForm>) -> Self {
        Self { value: here.value, origin: here.design.to_vec(), forms, domain: None }
    }
}

/// A function of one variable that vanishes at its origin x₀.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum UnivariateForm {
    /// s (x − x₀) + ½ c (x − x₀)².
    Quadratic { slope: f64, curvature: f64 },
    /// s x₀ (1 − x₀/x).
    Reciprocal { slope: f64 },
    /// s x₀ ((x/x₀)ᵖ − 1) / p, and its limit s x₀ ln(x/x₀) for p = 0.
    Power { slope: f64, exponent: f64 },
    /// p/(u − x) + q/(x − l), minus its value at x₀.
    Asymptotes { p: f64, q: f64, low: f64, high: f64 },
}

impl UnivariateForm {
    pub fn linear(slope: f64) -> Self {
        Self::Quadratic { slope, curvature: 0.0 }
    }

    fn is_zero(&self) -> bool {
        match *self {
            Self::Quadratic { slope, curvature } => slope == 0.0 && curvature == 0.0,
            Self::Reciprocal { slope } | Self::Power { slope, .. } => slope == 0.0,
            Self::Asymptotes { p, q, .. } => p == 0.0 && q == 0.0,
        }
    }

    fn at<S: ProblemScalar>(&self, x: S, origin: f64) -> S {
        match *self {
            Self::Quadratic { slope, curvature } => {
                let step = x - origin;
                // Without curvature the degree must stay one.
                if curvature == 0.0 { step * slope } else { step * slope + step * step * (0.5 * curvature) }
            }
            Self::Reciprocal { slope } => (-(x.recip() * origin) + 1.0) * (slope * origin),
            Self::Power { slope, exponent: 0.0 } => (x / origin).ln() * (slope * origin),
            Self::Power { slope, exponent } => ((x / origin).powf(exponent) - 1.0) * (slope * origin / exponent),
            Self::Asymptotes { p, q, low, high } => {
                let above = (-x + high).recip() - 1.0 / (high - origin);
                let below = (x - low).recip() - 1.0 / (origin - low);
                above * p + below * q
            }
        }
    }

    /// Value, slope and curvature.
    pub fn term(&self, x: f64, x0: f64) -> Term {
        let value = self.at(x, x0);
        let (slope, curvature) = match *self {
            Self::Quadratic { slope, curvature } => (slope + curvature * (x - x0), curvature),
            Self::Reciprocal { slope } => {
                let ratio = x0 / x;
                (slope * ratio * ratio, -2.0 * slope * ratio * ratio / x)
            }
            Self::Power { slope, exponent } => {
                let first = slope * (x / x0).powf(exponent - 1.0);
                (first, first * (exponent - 1.0) / x)
            }
            Self::Asymptotes { p, q, low, high } => {
                let (a, b) = (1.0 / (high - x), 1.0 / (x - low));
                (p * a * a - q * b * b, 2.0 * (p * a * a * a + q * b * b * b))
            }
        };
        Term { value, slope, curvature }
    }
}

impl FittedModel for Separated {
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S {
        let terms = self.forms.iter().zip(b).zip(&self.origin).filter(|((form, _), _)| !form.is_zero());
        terms.map(|((form, &x), &origin)| form.at(x, origin)).fold(S::from(self.value), |a, t| a + t)
    }

    fn domain(&self) -> Option<&[Vec<f64>; 2]> {
        self.domain.as_ref()
    }

    fn constant(&self) -> Option<f64> {
        Some(self.value)
    }

    fn term(&self, k: usize, x: f64) -> Term {
        self.forms[k].term(x, self.origin[k])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::hessian;

    #[test]
    fn terms_agree_with_dual_numbers() {
        let forms = [
            UnivariateForm::Quadratic { slope: -1.5, curvature: 2.0 },
            UnivariateForm::Reciprocal { slope: -0.7 },
            UnivariateForm::Power { slope: 0.4, exponent: 2.5 },
            UnivariateForm::Power { slope: 0.4, exponent: 0.0 },
            UnivariateForm::Asymptotes { p: 0.3, q: 1.2, low: -1.0, high: 4.0 },
        ];
        for form in forms {
            let (value, slope, curvature) = hessian(|x| form.at(x[0], 1.3), &[2.1]);
            let term = form.term(2.1, 1.3);
            assert_eq!(form.at(1.3, 1.3), 0.0, "{form:?}");
            for (a, b) in [(term.value, value), (term.slope, slope[0]), (term.curvature, curvature[(0, 0)])] {
                assert!((a - b).abs() < 1e-14, "{form:?}: {a} {b}");
            }
        }
    }
}
