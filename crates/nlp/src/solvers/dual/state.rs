//! Settings and state of the dual solver.

use crate::program::Separable;
use crate::solution::ProgramStatus;
use crate::solvers::argmin_state::{ExecutorRecord, impl_argmin_state};
use crate::solvers::interior_point::InteriorPoint;
use error::{Error, Result};
use serde::{Deserialize, Serialize};

/// Falk's dual method for separable, strictly convex programs with few rows and up to millions of variables.
///
/// The dual function W(λ) = min f + Σ λᵢ gᵢ over the bounds separates into n problems of one variable. It is maximized
/// over λ ≥ 0 by Newton's method with adaptive damping. Sums run in parallel chunks of fixed size and are added in order,
/// so that the results have the same bits for any number of threads. The solver stores a few vectors of length n.
///
/// The dual has no maximum if the rows contradict each other, and its minimizers jump if terms have no curvature. Such
/// programs, and those with infinite bounds, are passed to [`InteriorPoint`], which also relaxes them.
///
/// The solver is also an argmin `Solver`. It returns [`Error::Unsupported`] for a program that is not [`Separable`].
///
/// # Sources
/// Falk, *J. Math. Anal. Appl.* 19 (1967) 141–159; Fleury, *Int. J. Numer. Meth. Eng.* 14 (1979) 1761–1783.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Falk {
    pub(super) tolerance: f64,
    pub(super) iterations: usize,
    pub(super) fallback: InteriorPoint,
}

impl Default for Falk {
    fn default() -> Self {
        Self { tolerance: 1e-11, iterations: 200, fallback: InteriorPoint::default() }
    }
}

impl Falk {
    /// Sets the largest violation and complementarity of a solution, in 1e-14 … 1e-4 (default 1e-11).
    ///
    /// Both are relative as in [`KktResidual`](crate::KktResidual).
    ///
    /// # Errors
    /// [`Error::Option`] outside this range.
    pub fn with_tolerance(self, tolerance: f64) -> Result<Self> {
        let is_valid = (1e-14..=1e-4).contains(&tolerance);
        Error::check_option("tolerance of the dual solver", "between 1e-14 and 1e-4", tolerance, is_valid)?;
        Ok(Self { tolerance, ..self })
    }

    /// Sets the largest number of iterations, at least 1 (default 200).
    ///
    /// # Errors
    /// [`Error::Option`] for zero.
    pub fn with_iterations(self, iterations: usize) -> Result<Self> {
        Error::check_option("iterations of the dual solver", "at least 1", iterations as f64, iterations >= 1)?;
        Ok(Self { iterations, ..self })
    }

    /// Sets the solver of programs whose dual has no maximum.
    #[must_use]
    pub fn with_fallback(self, fallback: InteriorPoint) -> Self {
        Self { fallback, ..self }
    }

    /// The tolerance, or the rounding error of sums over n terms if that is larger.
    pub(super) fn attainable_tolerance(&self, program: &dyn Separable) -> f64 {
        self.tolerance.max(16.0 * f64::EPSILON * program.variables() as f64)
    }
}

/// State of a run of the dual solver. It can be serialized.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct FalkState {
    /// λ, length m.
    pub multipliers: Vec<f64>,
    /// −W(λ), which decreases.
    pub cost: f64,
    /// Rows at the minimizer, length m.
    pub rows: Vec<f64>,
    /// Damping of the Newton step, relative.
    pub damping: f64,
    /// Largest relative violation and complementarity.
    pub residual: f64,
    /// Evaluations of the dual function.
    pub evaluations: usize,
    /// True if the dual function has not been evaluated after the last step, because convergence was predicted.
    pub convergence_predicted: bool,
    /// Status at the end of the run; `None` during the run.
    pub status: Option<ProgramStatus>,
    pub(super) previous_residual: f64,
    /// −∇²W, m × m, column by column.
    pub(super) negative_hessian: Vec<f64>,
    /// Largest change of each row when one variable changes by its scale.
    pub(super) row_units: Vec<f64>,
    /// Largest change of the objective when one variable changes by its scale.
    pub(super) objective_unit: f64,
    pub(super) record: ExecutorRecord,
}

impl_argmin_state!(FalkState, multipliers, cost);

impl FalkState {
    /// Relative violation and complementarity of `rows` at the multipliers λ.
    pub(super) fn residual(&self, λ: &[f64], rows: &[f64], is_equality: &[bool]) -> f64 {
        (0..λ.len()).fold(0.0f64, |worst, i| {
            let g = rows[i];
            let violation = if is_equality[i] { g.abs() } else { g.max(0.0) } / self.row_units[i];
            let complementarity = if is_equality[i] { 0.0 } else { (λ[i] * g).abs() / self.objective_unit };
            let undefined = violation.is_nan() || complementarity.is_nan();
            if undefined { f64::INFINITY } else { worst.max(violation).max(complementarity) }
        })
    }
}
