//! Values and derivatives of one number, and the chain rule to its intermediate variables.

use super::SubproblemBox;
use crate::problem::Intermediates;
use autodiff::jacobian;
use error::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Value and gradient of one number at one design.
#[derive(Clone, Copy, Debug)]
pub struct Sample<'a> {
    /// The design b₀ (length n).
    pub design: &'a [f64],
    /// The value r(b₀).
    pub value: f64,
    /// ∂r/∂b at b₀ (length n).
    pub gradient: &'a [f64],
}

/// All data that an approximation of one number may use.
#[derive(Clone, Copy, Debug)]
pub struct Expansion<'a> {
    /// Name of the number, for messages.
    pub name: &'a str,
    /// The design around which the approximation is built.
    pub here: Sample<'a>,
    /// Earlier accepted designs at which the same number was differentiated, the newest first; as many as
    /// [`Approximation::memory`](super::Approximation::memory) requests, fewer at the start of a run.
    pub before: &'a [Sample<'a>],
    /// The intermediate design variables of the number.
    pub intermediates: &'a Intermediates,
    /// ∂²r/∂b² at b₀ (n × n), if the approximation requests it and the analysis offers it.
    pub curvature: Option<&'a DMatrix<f64>>,
    /// The box and the designs of the cycle, the same for all numbers.
    pub subproblem_box: &'a SubproblemBox,
}

impl Expansion<'_> {
    /// ∂r/∂bᴵ at b₀: the solution of (∂bᴵ/∂b)ᵀ s = ∂r/∂b.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the derivatives of the intermediate variables by the design are singular.
    pub fn intermediate_gradient(&self) -> Result<Vec<f64>> {
        let (b, n) = (self.here.design, self.here.design.len());
        if let Intermediates::Identity = self.intermediates {
            return Ok(self.here.gradient.to_vec());
        }
        let (_, rows) = jacobian(|b| (0..n).map(|k| self.intermediates.component(k, b)).collect(), b);
        if self.intermediates.is_separable() {
            let slope = |k| self.divide(k, self.here.gradient[k], rows[(k, k)]);
            return (0..n).map(slope).collect();
        }
        let gradient = DVector::from_column_slice(self.here.gradient);
        let solution = rows.transpose().lu().solve(&gradient).filter(|s| s.iter().all(|v| v.is_finite()));
        solution.map(|s| s.as_slice().to_vec()).ok_or_else(|| self.singular("the map is singular".to_owned()))
    }

    fn divide(&self, k: usize, slope: f64, map_slope: f64) -> Result<f64> {
        let quotient = if slope == 0.0 { 0.0 } else { slope / map_slope };
        let why = || format!("variable {k} at {} has derivative {map_slope}", self.here.design[k]);
        if quotient.is_finite() { Ok(quotient) } else { Err(self.singular(why())) }
    }

    fn singular(&self, why: String) -> Error {
        let remedy = "bound the design variables away from zero, or linearize in the variables themselves";
        Error::definition(format!("intermediate variables of `{}`", self.name), why, remedy)
    }

    /// The previous accepted design, if the number was differentiated there.
    pub fn last(&self) -> Option<Sample<'_>> {
        self.before.first().copied()
    }

    /// The exponent p for which the derivatives of bₖᵖ at both designs have the same ratio as those of the number,
    ///
    /// $$ p_k = 1 + \frac{\ln \bigl(\partial_k r(b_1) / \partial_k r(b_0)\bigr)}{\ln (b_{1,k} / b_{0,k})} , $$
    ///
    /// or `None` if the derivative changes its sign or the variable has not changed. b₁ is the previous design.
    ///
    /// # Sources
    ///
    /// Fadel, Riley & Barthelemy, *Structural Optimization* 2 (1990) 117–124.
    pub fn exponent(&self, k: usize) -> Option<f64> {
        let before = self.last()?;
        let slopes = before.gradient[k] / self.here.gradient[k];
        let designs = before.design[k] / self.here.design[k];
        let p = 1.0 + slopes.ln() / designs.ln();
        (slopes > 0.0 && designs > 0.0 && p.is_finite()).then_some(p)
    }
}
