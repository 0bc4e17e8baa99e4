//! What is known of one number at a design, and the chain rule to its intermediate variables.

use crate::error::{Error, Result};
use crate::problem::Intermediates;
use crate::scalar::jacobian;
use nalgebra::DVector;

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

/// Everything that an approximation of one number may use.
#[derive(Clone, Copy, Debug)]
pub struct Expansion<'a> {
    /// Name of the number, for messages.
    pub name: &'a str,
    /// The design around which the approximation is built.
    pub here: Sample<'a>,
    /// The design accepted before, if the same number was differentiated there.
    pub before: Option<Sample<'a>>,
    /// The intermediate design variables of the number.
    pub intermediates: &'a Intermediates,
}

impl Expansion<'_> {
    /// ∂r/∂bᴵ at b₀: the solution of (∂bᴵ/∂b)ᵀ s = ∂r/∂b.
    ///
    /// Errors with [`Error::Definition`] where the intermediate variables do not move with the design.
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
}
