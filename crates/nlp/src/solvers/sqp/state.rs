//! Settings and state of the SQP solver.

use crate::kkt::{KktResidual, PrimalDual};
use crate::program::{Gradients, Program, Values};
use crate::solution::{Candidate, Evaluations, ProgramStatus, Solution};
use crate::solvers::argmin_state::{ExecutorRecord, impl_argmin_state};
use crate::solvers::qp::Conic;
use argmin::core::TerminationStatus;
use error::{Error, Result};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Source of the Hessian of the Lagrangian.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum Curvature {
    /// The program's exact Hessian if it provides one, otherwise damped BFGS.
    #[default]
    Exact,
    /// The program's exact Hessian, weighted with the least-squares multipliers of the active rows, with absolute eigenvalues on the
    /// tangent space of these rows.
    ///
    /// For nonconvex programs whose solution is to stay near the start, such as approximate problems in a trust region. Damped
    /// BFGS if the program has no Hessian.
    Absolute,
    /// Damped BFGS always.
    QuasiNewton,
}

/// Sequential quadratic programming for smooth programs.
///
/// Each iteration solves a quadratic program through [`Conic`]. A line search on the merit function f + ρ·max(gᵢ)⁺, with
/// a second-order correction, accepts or shortens the step. Linearized rows without a common point are relaxed. An
/// evaluation that fails shortens the step.
///
/// The result is a local solution: use [`MultiStart`](crate::MultiStart) if there may be several. For separable convex
/// programs [`Falk`](crate::Falk) and [`InteriorPoint`](crate::InteriorPoint) are faster.
///
/// `Sqp` is also an argmin `Solver`. [`Sqp::executor`] returns an argmin `Executor` to which observers, checkpoints and a
/// time limit can be added.
///
/// # Sources
/// Nocedal & Wright, *Numerical Optimization*, 2nd ed., algorithm 18.3; Powell (1978) for the damping.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sqp {
    pub(super) tolerance: f64,
    pub(super) iterations: usize,
    pub(super) curvature: Curvature,
    pub(super) conic: Conic,
}

impl Default for Sqp {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 200, curvature: Curvature::Exact, conic: Conic::default() }
    }
}

impl Sqp {
    /// Sets the largest [`KktResidual`] of a solution, in 1e-14 … 1e-2 (default 1e-10).
    ///
    /// If rounding prevents a further decrease of the merit function, a residual up to ten times this value, and at least
    /// up to 1e-7, also counts as solved.
    ///
    /// # Errors
    /// [`Error::Option`] outside this range.
    pub fn with_tolerance(self, tolerance: f64) -> Result<Self> {
        let is_valid = (1e-14..=1e-2).contains(&tolerance);
        Error::check_option("tolerance of the SQP solver", "between 1e-14 and 1e-2", tolerance, is_valid)?;
        Ok(Self { tolerance, ..self })
    }

    /// Sets the largest number of iterations, at least 1 (default 200).
    ///
    /// # Errors
    /// [`Error::Option`] for zero.
    pub fn with_iterations(self, iterations: usize) -> Result<Self> {
        Error::check_option("iterations of the SQP solver", "at least 1", iterations as f64, iterations >= 1)?;
        Ok(Self { iterations, ..self })
    }

    /// Sets the source of the Hessian.
    #[must_use]
    pub fn with_curvature(self, curvature: Curvature) -> Self {
        Self { curvature, ..self }
    }

    /// The residual up to which a run that cannot proceed counts as solved.
    pub(super) fn accepted(&self) -> f64 {
        (10.0 * self.tolerance).max(1e-7)
    }
}

/// State of an SQP run: point, values, multipliers and Hessian. It can be serialized.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[non_exhaustive]
pub struct SqpState {
    /// The point, length n; empty before the start is set.
    pub x: Vec<f64>,
    /// Objective at the point.
    pub objective: f64,
    /// Rows at the point, length m.
    pub rows: Vec<f64>,
    /// Gradient of the objective, length n.
    pub objective_gradient: Vec<f64>,
    /// Gradients of the rows, m × n.
    pub row_gradients: DMatrix<f64>,
    /// Multipliers of the rows at the point, from the last quadratic program.
    pub multipliers: Vec<f64>,
    /// Multipliers of the lower bounds.
    pub lower_multipliers: Vec<f64>,
    /// Multipliers of the upper bounds.
    pub upper_multipliers: Vec<f64>,
    /// Hessian of the Lagrangian in the quadratic program, or its approximation, n × n.
    pub hessian: DMatrix<f64>,
    /// True until the first BFGS update of the Hessian.
    pub hessian_is_initial: bool,
    /// True if all variables have the same least curvature, after an iteration without an acceptable step.
    #[serde(default)]
    pub has_uniform_floor: bool,
    /// Weight of the violation in the merit function.
    pub penalty: f64,
    /// Largest violation of a row, in its unit.
    pub violation: f64,
    /// Fraction of the last full step that was taken, 0 … 1.
    pub step_length: f64,
    /// True if the last quadratic program was relaxed.
    pub relaxed: bool,
    /// Residual of the optimality conditions at the point.
    pub kkt: KktResidual,
    /// Evaluations so far.
    pub evaluations: Evaluations,
    /// Conclusion; `None` during the run.
    pub status: Option<ProgramStatus>,
    /// Consecutive steps whose predicted decrease is below rounding.
    pub stagnant_steps: usize,
    /// The start, moved into the bounds.
    pub start: Vec<f64>,
    /// Gradient of the objective at the start.
    pub start_gradient: Vec<f64>,
    /// Objective at the start.
    pub start_objective: f64,
    /// Gradients at the start if they have been evaluated before the run.
    #[serde(skip)]
    pub(super) known_gradients: Option<Gradients>,
    pub(super) record: ExecutorRecord,
}

impl SqpState {
    /// The state at the point `x`, for at most `limit` iterations.
    #[must_use]
    pub fn start(mut self, x: &[f64], limit: u64) -> Self {
        self.x = x.to_vec();
        self.record.limit = limit;
        self
    }

    /// This state as the start of another run, which continues it up to `limit` iterations in total.
    #[must_use]
    pub fn resume(mut self, limit: u64) -> Self {
        self.status = None;
        self.record.limit = limit;
        self.record.termination = TerminationStatus::NotTerminated;
        self
    }

    /// Replaces the point by `x`, with its values and gradients.
    pub(super) fn move_to(&mut self, x: Vec<f64>, g: Gradients) {
        self.x = x;
        self.objective = g.values.objective;
        self.rows = g.values.rows;
        self.objective_gradient = g.objective;
        self.row_gradients = g.rows;
    }

    /// Values and gradients at the point.
    pub(super) fn gradients(&self) -> Gradients {
        let values = Values { objective: self.objective, rows: self.rows.clone() };
        Gradients { values, objective: self.objective_gradient.clone(), rows: self.row_gradients.clone() }
    }

    /// Residual of the optimality conditions at the point with its multipliers.
    pub(super) fn residual(&self, program: &dyn Program) -> KktResidual {
        let point = PrimalDual {
            x: &self.x,
            multipliers: &self.multipliers,
            lower: &self.lower_multipliers,
            upper: &self.upper_multipliers,
            relaxed: &[],
        };
        KktResidual::from_gradients(program, &self.start, &self.gradients(), Some(&self.start_gradient), &point)
    }

    /// The point with its multipliers and status.
    pub(super) fn candidate(&self) -> Candidate {
        Candidate {
            x: self.x.clone(),
            multipliers: self.multipliers.clone(),
            lower: self.lower_multipliers.clone(),
            upper: self.upper_multipliers.clone(),
            iterations: self.record.iteration as usize,
            status: self.status.unwrap_or(ProgramStatus::IterationLimit),
            relaxation: None,
        }
    }

    /// The point of a finished run on `program` as a solution with its KKT residual.
    ///
    /// A run that argmin stopped, at the limit of iterations or time, has [`ProgramStatus::IterationLimit`].
    pub fn solution(&self, program: &dyn Program) -> Solution {
        let gradients = self.gradients();
        self.candidate().certified(program, &self.start, self.evaluations, &gradients, Some(&self.start_gradient))
    }
}

impl_argmin_state!(SqpState, x, objective);
