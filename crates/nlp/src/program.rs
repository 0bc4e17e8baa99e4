//! The mathematical program that subproblem solvers see.

use super::{LowRank, Separable};
use error::Result;
use nalgebra::DMatrix;
use std::borrow::Cow;

/// What a program is made of; recognized from its functions, never configured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Structure {
    /// Objective and all rows linear.
    Linear,
    /// Objective a quadratic, all rows linear.
    Quadratic,
    /// Anything else that is smooth.
    Nonlinear,
}

/// Value of the objective and of every row at one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Values {
    /// f(x).
    pub objective: f64,
    /// gᵢ(x), length m.
    pub rows: Vec<f64>,
}

/// Values and first derivatives at one point.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradients {
    /// The values at the same point.
    pub values: Values,
    /// ∇f, length n.
    pub objective: Vec<f64>,
    /// ∂gᵢ/∂xⱼ, m × n.
    pub rows: DMatrix<f64>,
}

/// A smooth mathematical program:
///
/// $$ \min_x f(x) \quad\text{subject to}\quad g_i(x) \le 0 \ (i = 1 \dots m),\qquad l \le x \le u. $$
///
/// A row for which [`Program::is_equality`] holds reads gᵢ(x) = 0 instead. Bounds may be infinite. Evaluations may fail
/// (a direct coupling calls the analysis itself); approximate problems never do.
pub trait Program: Sync {
    /// Number of variables n.
    fn variables(&self) -> usize;
    /// Number of rows m.
    fn rows(&self) -> usize;
    /// Lower bounds l, length n.
    fn lower(&self) -> &[f64];
    /// Upper bounds u, length n.
    fn upper(&self) -> &[f64];
    /// True where row `i` is an equality.
    fn is_equality(&self, _i: usize) -> bool {
        false
    }
    /// What objective and rows are made of.
    fn structure(&self) -> Structure {
        Structure::Nonlinear
    }
    /// Objective and rows at `x` (length n).
    fn values(&self, x: &[f64]) -> Result<Values>;
    /// Values and first derivatives at `x`.
    fn gradients(&self, x: &[f64]) -> Result<Gradients>;
    /// Hessian of f + Σ λᵢ gᵢ at `x`, n × n, if the program can give it exactly.
    fn lagrangian_hessian(&self, _x: &[f64], _multipliers: &[f64]) -> Result<Option<DMatrix<f64>>> {
        Ok(None)
    }
    /// For programs whose objective is linear or a convex quadratic and whose rows are convex quadratics: a factor Cᵢ
    /// (k × n) of each row's constant Hessian CᵢᵀCᵢ, `None` for linear rows. Equality rows are linear.
    fn row_factors(&self) -> Option<Vec<Option<DMatrix<f64>>>> {
        None
    }
    /// The program as a sum over its variables, if it is one.
    fn separable(&self) -> Option<&dyn Separable> {
        None
    }
    /// For a program whose variables are coupled by a quadratic of low rank in the objective and by nothing else: the sum
    /// over the variables, and that quadratic. The constants and terms of the sum leave it out, the program's values and
    /// gradients do not. Such a program is not [`separable`](Self::separable).
    fn coupled(&self) -> Option<(&dyn Separable, Cow<'_, LowRank>)> {
        None
    }
}
