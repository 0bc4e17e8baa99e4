//! Diagonal quadratic approximations.

use super::separated::{Separated, UnivariateForm};
use super::{AnyModel, Approximation, Asymptotes, Expansion};
use crate::problem::Problem;
use error::{Error, Result};
use std::sync::Arc;

/// A quadratic with a diagonal Hessian:
///
/// $$ \tilde r(b) = r(b_0) + \sum_k s_k (b_k - b_{0,k}) + \tfrac12 c_k (b_k - b_{0,k})^2 ,\qquad c_k \ge 0 . $$
///
/// The curvatures determine the approximation that it imitates; see [`CurvatureRule`]. Intermediate variables of the
/// response are not used.
///
/// # Sources
///
/// Groenwold, Etman & Wood, *Struct. Multidisc. Optim.* 41 (2010) 39–56; Groenwold & Etman, *Int. J. Numer.
/// Meth. Eng.* 82 (2010) 505–524. We differ: the spherical curvatures are spherical in variables divided by their scales, so
/// that they do not depend on units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiagonalQuadratic {
    /// Rule for the curvatures.
    pub curvature: CurvatureRule,
}

/// Rule for the curvatures c of a [`DiagonalQuadratic`].
///
/// Negative curvatures are replaced by zero. [`CurvatureRule::Reciprocal`] and [`CurvatureRule::Exponential`] use their
/// absolute value instead (Groenwold & Etman). In the first cycle two-point curvatures are zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CurvatureRule {
    /// One curvature for all scaled variables that fits the value at the previous design.
    SphericalValue,
    /// One curvature for all scaled variables that fits the change of the directional derivative along the last step.
    SphericalGradient,
    /// Curvature of the reciprocal approximation: 2 |sₖ / b₀ₖ|; zero if the variable is zero.
    Reciprocal,
    /// Curvature of MMA: 2 sₖ⁺/(u − b₀) + 2 sₖ⁻/(b₀ − l).
    Asymptotes(Asymptotes),
    /// Curvature of the two-point exponential approximation: |sₖ (pₖ − 1) / b₀ₖ| with p between −3 and 3. If p is not
    /// defined, that of the reciprocal approximation.
    Exponential,
    /// ∂²r/∂bₖ² from the analysis; an error if the analysis does not compute it.
    Exact,
}

impl DiagonalQuadratic {
    fn curvature(&self, expansion: &Expansion, k: usize, spherical: f64) -> Result<f64> {
        let (x, slope) = (expansion.here.design[k], expansion.here.gradient[k]);
        let scale = expansion.subproblem_box.scale[k];
        let over_x = |v: f64| if x == 0.0 { 0.0 } else { (v / x).abs() };
        Ok(match self.curvature {
            CurvatureRule::SphericalValue | CurvatureRule::SphericalGradient => spherical / (scale * scale),
            CurvatureRule::Reciprocal => over_x(2.0 * slope),
            CurvatureRule::Asymptotes(rule) => {
                let (low, high) = expansion.subproblem_box.asymptotes(&rule, k)?;
                2.0 * slope.max(0.0) / (high - x) + 2.0 * (-slope).max(0.0) / (x - low)
            }
            CurvatureRule::Exponential => {
                over_x(slope * (expansion.exponent(k).unwrap_or(-1.0).clamp(-3.0, 3.0) - 1.0))
            }
            CurvatureRule::Exact => exact(expansion)?[(k, k)].max(0.0),
        })
    }

    /// The curvature in scaled variables that fits the last step.
    fn spherical(&self, expansion: &Expansion) -> f64 {
        let Some(before) = expansion.last() else { return 0.0 };
        let (here, scale) = (expansion.here, &expansion.subproblem_box.scale);
        let steps = || before.design.iter().zip(here.design).map(|(a, b)| a - b);
        let length: f64 = steps().zip(scale).map(|(d, s)| (d / s).powi(2)).sum();
        let along = |g: &[f64]| steps().zip(g).map(|(d, g)| d * g).sum::<f64>();
        let change = match self.curvature {
            CurvatureRule::SphericalValue => 2.0 * (before.value - here.value - along(here.gradient)),
            _ => along(before.gradient) - along(here.gradient),
        };
        if length > 0.0 { (change / length).max(0.0) } else { 0.0 }
    }
}

/// The Hessian from the analysis.
///
/// # Errors
///
/// [`Error::Unsupported`] if the analysis offers no second derivatives.
pub(super) fn exact<'a>(expansion: &Expansion<'a>) -> Result<&'a nalgebra::DMatrix<f64>> {
    expansion.curvature.ok_or_else(|| {
        let why = "its analysis offers no second derivatives";
        Error::unsupported(format!("curvature of `{}`", expansion.name), why, "estimate it from gradients")
    })
}

impl Approximation for DiagonalQuadratic {
    fn check(&self, _: &Problem) -> Result<()> {
        match self.curvature {
            CurvatureRule::Asymptotes(rule) => rule.check(),
            _ => Ok(()),
        }
    }

    fn memory(&self) -> usize {
        usize::from(matches!(
            self.curvature,
            CurvatureRule::SphericalValue | CurvatureRule::SphericalGradient | CurvatureRule::Exponential
        ))
    }

    fn asymptotes(&self) -> Vec<Asymptotes> {
        match self.curvature {
            CurvatureRule::Asymptotes(rule) => vec![rule],
            _ => vec![],
        }
    }

    fn wants_curvature(&self) -> bool {
        self.curvature == CurvatureRule::Exact
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let spherical = self.spherical(expansion);
        let form = |(k, &slope): (usize, &f64)| {
            Ok(UnivariateForm::Quadratic { slope, curvature: self.curvature(expansion, k, spherical)? })
        };
        let forms = expansion.here.gradient.iter().enumerate().map(form).collect::<Result<_>>()?;
        Ok(Arc::new(Separated::new(expansion.here, forms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};
    use autodiff::DualNum as _;
    use autodiff::hessian;

    #[test]
    fn every_curvature_rule_is_exact_to_first_order_and_convex() {
        for curvature in [
            CurvatureRule::SphericalValue,
            CurvatureRule::SphericalGradient,
            CurvatureRule::Reciprocal,
            CurvatureRule::Asymptotes(Asymptotes::SVANBERG_2002),
            CurvatureRule::Exponential,
            CurvatureRule::Exact,
        ] {
            check(&DiagonalQuadratic { curvature }, true);
        }
    }

    #[test]
    fn spherical_value_fits_the_value_at_the_previous_design() {
        let f = |b: &[autodiff::HyperDual]| b[0].powi(4) + b[1].recip();
        let case = Case::of(f, &[1.0, 2.0], &[0.1, 0.1], &[4.1, 2.1]).after(&[2.0, 1.0]);
        let model = case.fit(&DiagonalQuadratic { curvature: CurvatureRule::SphericalValue }).unwrap();
        assert!((model.real(&[2.0, 1.0]) - 17.0).abs() < 1e-12);
    }

    #[test]
    fn curvatures_equal_those_of_the_imitated_approximation() {
        let f = |b: &[autodiff::HyperDual]| b[0].powi(3) + b[1].recip() * 2.0;
        let case = Case::of(f, &[1.0, 2.0], &[0.1, 0.1], &[4.1, 2.1]).after(&[2.0, 1.0]);
        let second = |curvature| {
            let model = case.fit(&DiagonalQuadratic { curvature }).unwrap();
            hessian(|b| model.hyper_dual(b), &[1.0, 2.0]).2
        };
        // b³ and 2/b: second derivatives 6 and 4/b³ = 0.5; the exponents 3 and −1 give the same.
        for rule in [CurvatureRule::Exact, CurvatureRule::Exponential] {
            let c = second(rule);
            assert!((c[(0, 0)] - 6.0).abs() < 1e-12 && (c[(1, 1)] - 0.5).abs() < 1e-12, "{rule:?} {c}");
        }
        let c = second(CurvatureRule::Reciprocal);
        assert!((c[(0, 0)] - 6.0).abs() < 1e-12 && (c[(1, 1)] - 0.5).abs() < 1e-12);
        let c = second(CurvatureRule::Asymptotes(Asymptotes::SVANBERG_2002));
        // Scales 4 and 2, so asymptotes at ±2 and ±1: 2·3/2 and 2·0.5/1.
        assert!((c[(0, 0)] - 3.0).abs() < 1e-12 && (c[(1, 1)] - 1.0).abs() < 1e-12);
    }
}
