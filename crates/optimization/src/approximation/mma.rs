//! The method of moving asymptotes.

use super::separated::{Separated, UnivariateForm};
use super::{AnyModel, Approximation, Asymptotes, Expansion};
use crate::problem::Problem;
use error::{Error, Result};
use std::sync::Arc;

/// Method of moving asymptotes: a convex separable model between a lower and an upper asymptote for each variable.
///
/// $$ \tilde r(b) = r_0 + \sum_k \frac{p_k}{u_k - b_k} + \frac{q_k}{b_k - l_k} ,\qquad
///    p_k = (u_k - b_{0,k})^2 \bigl( s_k^+ + \kappa\, |s_k| + ε_k \bigr) ,\quad
///    q_k = (b_{0,k} - l_k)^2 \bigl( s_k^- + \kappa\, |s_k| + ε_k \bigr) , $$
///
/// with s the gradient and s⁺ = max(0, s), s⁻ = max(0, −s). κ = 0 and ε = 0 give the method of 1987; the form of 2002 has
/// κ = 0.001 and a small ε that keeps the curvature positive where a slope is zero. The design may move by nine tenths
/// of the distance to an asymptote. Value and gradient equal those at b₀, and ∂²r̃/∂bₖ² ≥ 0 between the asymptotes.
/// Intermediate variables of the response are not used.
///
/// # Units
///
/// εₖ is [`flatness`](Self::flatness) × the mean of |sᵢ|·scaleᵢ over all variables i, divided by scaleₖ.
///
/// # Sources
///
/// Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373; *SIAM J. Optim.* 12 (2002) 555–573; *MMA and GCMMA – two
/// methods for nonlinear optimization*, KTH Stockholm (2007), where a step is at most half the range of a variable. We differ:
/// ε is relative. The conservatism ρ of 2002 belongs to the [globalization](crate::sao::Conservatism).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mma {
    /// Rule for the asymptotes.
    pub asymptotes: Asymptotes,
    /// κ.
    pub curvature: f64,
    /// ε in units of the mean slope.
    pub flatness: f64,
}

impl Mma {
    /// The method of 1987.
    pub const SVANBERG_1987: Self = Self { asymptotes: Asymptotes::SVANBERG_1987, curvature: 0.0, flatness: 0.0 };
    /// The form of 2002, which is that of 2007, too.
    pub const SVANBERG_2002: Self = Self { asymptotes: Asymptotes::SVANBERG_2002, curvature: 1e-3, flatness: 1e-5 };
}

impl Default for Mma {
    /// The form of 2002.
    fn default() -> Self {
        Self::SVANBERG_2002
    }
}

impl Approximation for Mma {
    fn check(&self, _: &Problem) -> Result<()> {
        self.asymptotes.check()?;
        let not_negative = |v: f64| v >= 0.0 && v.is_finite();
        Error::check_option("curvature of MMA", "at least 0", self.curvature, not_negative(self.curvature))?;
        Error::check_option("flatness of MMA", "at least 0", self.flatness, not_negative(self.flatness))
    }

    fn asymptotes(&self) -> Vec<Asymptotes> {
        vec![self.asymptotes]
    }

    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>> {
        let (here, around) = (expansion.here, expansion.subproblem_box);
        let n = here.design.len();
        let mean = (0..n).map(|k| here.gradient[k].abs() * around.scale[k]).sum::<f64>() / n as f64;
        let (mut forms, mut domain) = (Vec::with_capacity(n), [vec![], vec![]]);
        for k in 0..n {
            let (low, high) = around.asymptotes(&self.asymptotes, k)?;
            let (x, slope) = (here.design[k], here.gradient[k]);
            let both = self.curvature * slope.abs() + self.flatness * mean / around.scale[k];
            let p = (high - x) * (high - x) * (slope.max(0.0) + both);
            let q = (x - low) * (x - low) * ((-slope).max(0.0) + both);
            forms.push(UnivariateForm::Asymptotes { p, q, low, high });
            domain[0].push(low + 0.1 * (x - low));
            domain[1].push(high - 0.1 * (high - x));
        }
        Ok(Arc::new(Separated { domain: Some(domain), ..Separated::new(here, forms) }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::approximation::checks::{Case, check};

    #[test]
    fn both_forms_are_exact_to_first_order_and_convex() {
        check(&Mma::SVANBERG_1987, true);
        check(&Mma::SVANBERG_2002, true);
        check(&Mma { asymptotes: Asymptotes::Proportional(0.5), ..Mma::SVANBERG_1987 }, true);
    }

    #[test]
    fn an_asymptote_at_zero_is_the_reciprocal_form() {
        // l → 0 for a falling function: s b₀ (1 − b₀/b), here −3 · 2 (1 − 2/b).
        let case = Case::of(|b| b[0] * -3.0, &[2.0], &[0.1], &[9.0]);
        let model = case.fit(&Mma { asymptotes: Asymptotes::Proportional(1e-9), ..Mma::SVANBERG_1987 }).unwrap();
        assert!((model.real(&[4.0]) - (-6.0 - 3.0)).abs() < 1e-7);
    }

    #[test]
    fn a_slope_of_zero_is_flat_in_1987_and_curved_in_2002() {
        let case = Case::of(|b| b[0] * -3.0 + b[1] * 0.0, &[2.0, 1.0], &[0.1, 0.1], &[9.0, 9.0]);
        let flat = case.fit(&Mma::SVANBERG_1987).unwrap();
        assert_eq!(flat.real(&[2.0, 3.0]), -6.0);
        assert!(case.fit(&Mma::SVANBERG_2002).unwrap().real(&[2.0, 3.0]) > -6.0);
    }
}
