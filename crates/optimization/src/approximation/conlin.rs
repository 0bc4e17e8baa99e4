//! Convex linearization.

use super::separated::{Separated, UnivariateForm};
use super::{AnyModel, Approximation, Expansion};
use error::Result;
use std::sync::Arc;

/// Convex linearization: for each variable the linear or the reciprocal expansion, whichever is convex.
///
/// $$ \tilde r(b) = r(b_0) + \sum_{+} (b_k - b_{0,k})\, \partial_k r
///                        + \sum_{-} b_{0,k} \Bigl(1 - \frac{b_{0,k}}{b_k}\Bigr) \partial_k r $$
///
/// with the first sum over variables with ∂ₖr bₖ ≥ 0. Of all mixtures of the two it is the most conservative one. A variable
/// whose search subregion contains zero is expanded linearly; intermediate variables of the response are not used.
///
/// # Sources
///
/// Fleury & Braibant, *Int. J. Numer. Meth. Eng.* 23 (1986) 409–428.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Conlin;

impl Approximation for Conlin {
    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let here = expansion.here;
        let form = |(k, &slope): (usize, &f64)| {
            let falls = slope * here.design[k] < 0.0;
            if falls && expansion.subproblem_box.keeps_sign(k) {
                UnivariateForm::Reciprocal { slope }
            } else {
                UnivariateForm::linear(slope)
            }
        };
        Ok(Arc::new(Separated::new(here, here.gradient.iter().enumerate().map(form).collect())))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};
    use crate::approximation::{Linear, Reciprocal};

    #[test]
    fn more_conservative_than_linear_and_reciprocal() {
        check(&Conlin, true);
        let case = Case::of(|b| b[0] * 2.0 - b[1] * 3.0 + b[0] * b[1], &[1.0, 2.0], &[0.1, 0.1], &[9.0, 9.0]);
        let models = [case.fit(&Conlin).unwrap(), case.fit(&Linear).unwrap(), case.fit(&Reciprocal).unwrap()];
        for b in [[0.5, 0.7], [3.0, 0.3], [0.2, 5.0], [4.0, 4.0]] {
            let [conlin, linear, reciprocal] = models.each_ref().map(|m| m.real(&b));
            assert!(conlin >= linear.max(reciprocal) - 1e-14);
        }
    }
}
