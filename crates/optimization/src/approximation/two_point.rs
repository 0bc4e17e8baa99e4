//! The two-point exponential approximation.

use super::separated::{Separated, UnivariateForm};
use super::{AnyModel, Approximation, Expansion};
use crate::problem::Problem;
use error::{Error, Result};
use std::sync::Arc;

/// Expansion in powers bₖ^pₖ whose exponents fit the gradient at the previous design:
///
/// $$ \tilde r(b) = r(b_0) + \sum_k \Bigl[\Bigl(\frac{b_k}{b_{0,k}}\Bigr)^{p_k} - 1\Bigr] \frac{b_{0,k}}{p_k}
///    \frac{\partial r}{\partial b_k}\Big|_{b_0} . $$
///
/// The exponents are limited to values between [`least`](Self::least) and [`most`](Self::most). If an exponent is not
/// defined (first cycle, derivative that changes its sign or is zero, unchanged variable), it is
/// [`otherwise`](Self::otherwise). A variable whose search subregion contains zero is expanded linearly. Intermediate
/// variables of the response are not used.
///
/// # Sources
///
/// Fadel, Riley & Barthelemy, *Structural Optimization* 2 (1990) 117–124, with limits ∓1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoPointExponential {
    /// Least exponent.
    pub least: f64,
    /// Largest exponent.
    pub most: f64,
    /// Exponent if two points do not determine one: 1 is linear, −1 reciprocal.
    pub otherwise: f64,
}

impl Default for TwoPointExponential {
    fn default() -> Self {
        Self { least: -1.0, most: 1.0, otherwise: 1.0 }
    }
}

impl TwoPointExponential {
    /// pₖ of all variables; 1 if the search subregion contains zero.
    pub(super) fn exponents(&self, expansion: &Expansion) -> Vec<f64> {
        let exponent = |k| match expansion.exponent(k) {
            _ if !expansion.subproblem_box.keeps_sign(k) => 1.0,
            Some(p) => p.clamp(self.least, self.most),
            None => self.otherwise,
        };
        (0..expansion.here.design.len()).map(exponent).collect()
    }

    pub(super) fn check_limits(&self) -> Result<()> {
        let Self { least, most, otherwise } = *self;
        Error::check_option("least exponent", "finite", least, least.is_finite())?;
        Error::check_option("largest exponent", "at least the least", most, most >= least && most.is_finite())?;
        Error::check_option("exponent otherwise", "finite", otherwise, otherwise.is_finite())
    }
}

impl Approximation for TwoPointExponential {
    fn check(&self, _: &Problem) -> Result<()> {
        self.check_limits()
    }

    fn memory(&self) -> usize {
        1
    }

    fn is_odd(&self) -> bool {
        true
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let form = |(&slope, exponent): (&f64, f64)| match exponent {
            1.0 => UnivariateForm::linear(slope),
            -1.0 => UnivariateForm::Reciprocal { slope },
            exponent => UnivariateForm::Power { slope, exponent },
        };
        let forms = expansion.here.gradient.iter().zip(self.exponents(expansion)).map(form).collect();
        Ok(Arc::new(Separated::new(expansion.here, forms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};
    use autodiff::DualNum as _;

    #[test]
    fn powers_within_the_limits_are_exact() {
        check(&TwoPointExponential::default(), false);
        let f = |b: &[autodiff::HyperDual]| b[0].powf(0.5) * 2.0 - b[1].powf(-0.7);
        let case = Case::of(f, &[1.0, 2.0], &[0.1, 0.1], &[4.0, 4.0]).after(&[2.0, 1.0]);
        let model = case.fit(&TwoPointExponential::default()).unwrap();
        assert!((model.real(&[3.0, 0.5]) - (2.0 * 3f64.sqrt() - 0.5f64.powf(-0.7))).abs() < 1e-12);
    }

    #[test]
    fn the_exponent_zero_is_the_logarithm() {
        let case = Case::of(|b| b[0].ln(), &[1.0], &[0.1], &[4.0]).after(&[2.0]);
        let model = case.fit(&TwoPointExponential::default()).unwrap();
        assert!((model.real(&[3.0]) - 3f64.ln()).abs() < 1e-12);
    }

    #[test]
    fn a_first_cycle_and_a_slope_that_changes_its_sign_are_linear() {
        let f = |b: &[autodiff::HyperDual]| (b[0] - 1.5) * (b[0] - 1.5);
        for case in [Case::of(f, &[1.0], &[0.1], &[4.0]), Case::of(f, &[1.0], &[0.1], &[4.0]).after(&[2.0])] {
            let model = case.fit(&TwoPointExponential::default()).unwrap();
            assert!((model.real(&[2.0]) - (0.25 - 1.0)).abs() < 1e-14);
        }
    }
}
