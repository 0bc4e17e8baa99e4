//! The linear approximation in intermediate design variables.

use super::{AnyModel, Approximation, Expansion, FittedModel};
use crate::problem::{Intermediates, ProblemScalar};
use error::Result;
use nlp::separable::Term;
use std::sync::Arc;

/// First-order Taylor expansion in intermediate design variables (equation 13):
///
/// $$ \tilde r(b) = r(b_0) + \sum_k \bigl(b^I_k(b) - b^I_k(b_0)\bigr) \frac{\partial r}{\partial b^I_k}\Big|_{b_0}. $$
///
/// With identity intermediates it is linear in b; with reciprocals it is the reciprocal approximation.
///
/// # Sources
///
/// Etman, van Campen & Schoofs, *Multibody System Dynamics* 2 (1998) 393–415.
#[derive(Clone, Copy, Debug, Default)]
pub struct Linear;

impl Approximation for Linear {
    fn is_odd(&self) -> bool {
        true
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let (here, intermediates) = (&expansion.here, expansion.intermediates.clone());
        let slope = expansion.intermediate_gradient()?;
        let origin = (0..here.design.len()).map(|k| intermediates.component(k, here.design)).collect();
        Ok(Arc::new(Taylor { value: here.value, origin, slope, intermediates }))
    }
}

struct Taylor {
    value: f64,
    /// bᴵ(b₀).
    origin: Vec<f64>,
    /// ∂r/∂bᴵ.
    slope: Vec<f64>,
    intermediates: Intermediates,
}

impl FittedModel for Taylor {
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S {
        let term = |k: usize| (self.intermediates.component(k, b) - self.origin[k]) * self.slope[k];
        (0..b.len()).filter(|&k| self.slope[k] != 0.0).map(term).fold(S::from(self.value), |a, t| a + t)
    }

    fn constant(&self) -> Option<f64> {
        matches!(self.intermediates, Intermediates::Identity).then_some(self.value)
    }

    fn term(&self, k: usize, x: f64) -> Term {
        let slope = self.slope[k];
        Term { value: slope * (x - self.origin[k]), slope, curvature: 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::{DesignHistory, Sample, SubproblemBox};
    use crate::problem::{Intermediate, IntermediateMap};
    use autodiff::{Scalar, gradient};

    fn nowhere(n: usize) -> SubproblemBox {
        let (lower, upper) = (vec![-9.0; n], vec![9.0; n]);
        SubproblemBox { history: DesignHistory::default(), lower, upper, scale: vec![1.0; n] }
    }

    #[test]
    fn identity_intermediates_pass_the_common_checks() {
        crate::approximation::checks::check(&Linear, true);
    }

    fn fit(intermediates: &Intermediates, f: impl Fn(&[autodiff::Dual]) -> autodiff::Dual + Sync) -> Arc<dyn AnyModel> {
        let design = [2.0, 0.5];
        let (value, slope) = gradient(f, &design);
        let here = Sample { design: &design, value, gradient: &slope };
        let subproblem_box = &nowhere(2);
        let expansion = Expansion { name: "r", here, before: &[], intermediates, curvature: None, subproblem_box };
        Linear.fit(&expansion).unwrap()
    }

    #[test]
    fn reciprocal_variables_make_a_reciprocal_response_exact() {
        let model =
            fit(&Intermediates::all(2, Intermediate::Reciprocal), |b| (b[1] * 3.0 + b[0]) / (b[0] * b[1]) - 1.0);
        assert!((model.real(&[5.0, 4.0]) - (0.6 + 0.25 - 1.0)).abs() < 1e-15);
    }

    struct ProductOfTwo;
    impl IntermediateMap for ProductOfTwo {
        fn component<S: Scalar>(&self, k: usize, b: &[S]) -> S {
            if k == 0 { b[0] * b[1] } else { b[0] / b[1] }
        }
    }

    #[test]
    fn a_map_of_the_whole_design_makes_its_own_responses_exact() {
        let model = fit(&Intermediates::map(ProductOfTwo), |b| b[0] * b[1] * 2.0 - b[0] / b[1]);
        assert!((model.real(&[3.0, 1.5]) - (9.0 - 2.0)).abs() < 1e-13);
    }

    #[test]
    fn a_variable_with_a_singular_map_is_named() {
        let here = Sample { design: &[0.0], value: 1.0, gradient: &[1.0] };
        let intermediates = Intermediates::all(1, Intermediate::AreaOfDiameter);
        let subproblem_box = &nowhere(1);
        let expansion = Expansion {
            name: "moment",
            here,
            before: &[],
            intermediates: &intermediates,
            curvature: None,
            subproblem_box,
        };
        let message = Linear.fit(&expansion).err().unwrap().to_string();
        assert!(message.contains("`moment`") && message.contains("variable 0 at 0"), "{message}");
    }
}
