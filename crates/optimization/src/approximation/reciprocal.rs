//! The reciprocal approximation.

use super::separated::{Separated, UnivariateForm};
use super::{AnyModel, Approximation, Expansion};
use error::Result;
use std::sync::Arc;

/// First-order expansion in 1/b:
///
/// $$ \tilde r(b) = r(b_0) + \sum_k b_{0,k} \Bigl(1 - \frac{b_{0,k}}{b_k}\Bigr) \frac{\partial r}{\partial b_k}\Big|_{b_0}, $$
///
/// exact for stresses and displacements of statically determinate trusses as functions of the areas. A variable whose
/// search subregion contains zero is expanded linearly instead: 1/b is not defined at zero. Intermediate variables of the
/// response are not used.
///
/// # Sources
///
/// Schmit & Farshi, *AIAA Journal* 12 (1974) 692–699.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reciprocal;

impl Approximation for Reciprocal {
    fn is_odd(&self) -> bool {
        true
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let form = |(k, &slope): (usize, &f64)| {
            if expansion.subproblem_box.keeps_sign(k) {
                UnivariateForm::Reciprocal { slope }
            } else {
                UnivariateForm::linear(slope)
            }
        };
        let forms = expansion.here.gradient.iter().enumerate().map(form).collect();
        Ok(Arc::new(Separated::new(expansion.here, forms)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};
    use autodiff::DualNum as _;

    #[test]
    fn a_truss_displacement_is_exact() {
        let case = Case::of(|b| b[0].recip() * 3.0 + b[1].recip() * 0.5, &[2.0, 0.5], &[0.1, 0.1], &[9.0, 9.0]);
        let model = case.fit(&Reciprocal).unwrap();
        assert!((model.real(&[5.0, 4.0]) - (0.6 + 0.125)).abs() < 1e-14);
        check(&Reciprocal, false);
    }

    #[test]
    fn a_region_that_contains_zero_is_expanded_linearly() {
        let case = Case::of(|b| b[0] * 2.0 + b[1].recip(), &[0.0, 0.5], &[-1.0, 0.1], &[1.0, 9.0]);
        let model = case.fit(&Reciprocal).unwrap();
        assert!((model.real(&[0.25, 2.0]) - 1.0).abs() < 1e-14);
    }
}
