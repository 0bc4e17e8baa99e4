//! Everything that changes during a run of the SQP solver.

use crate::bookkeeping::{Bookkeeping, impl_argmin_state};
use crate::solver::Candidate;
use crate::{Evaluations, KktResidual, Status};
use crate::{Gradients, Values};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// The state of a run: point, values, multipliers, curvature. It can be written to a file.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct SqpState {
    /// The point, length n; empty before the start is set.
    pub x: Vec<f64>,
    /// Objective at the point.
    pub objective: f64,
    /// Rows at the point, length m.
    pub rows: Vec<f64>,
    /// Gradient of the objective, length n.
    pub slope: Vec<f64>,
    /// Gradients of the rows, m × n.
    pub row_slopes: DMatrix<f64>,
    /// Multipliers of the rows at the point, from the last quadratic program.
    pub multipliers: Vec<f64>,
    /// Multipliers of the lower bounds.
    pub lower_multipliers: Vec<f64>,
    /// Multipliers of the upper bounds.
    pub upper_multipliers: Vec<f64>,
    /// Curvature of the Lagrangian in use, n × n.
    pub curvature: DMatrix<f64>,
    /// True until the curvature has seen a step.
    pub fresh: bool,
    /// Weight of the violation in the merit function.
    pub penalty: f64,
    /// Largest violation of a row, in its unit.
    pub violation: f64,
    /// Part of the last step that was taken, 0 … 1.
    pub fraction: f64,
    /// True where the last quadratic program had to be relaxed.
    pub was_elastic: bool,
    /// Optimality conditions at the point.
    pub kkt: KktResidual,
    /// Evaluations so far.
    pub evaluations: Evaluations,
    /// The verdict, once there is one.
    pub verdict: Option<Status>,
    /// Consecutive steps whose gain is below rounding.
    pub quiet: usize,
    /// The start, moved into the bounds.
    pub start: Vec<f64>,
    /// Gradient of the objective at the start.
    pub first_slope: Vec<f64>,
    /// Objective at the start.
    pub first_objective: f64,
    pub(crate) book: Bookkeeping,
}

impl SqpState {
    /// From the start `x`, for at most `limit` iterations.
    #[must_use]
    pub fn start(mut self, x: &[f64], limit: u64) -> Self {
        self.x = x.to_vec();
        self.book.limit = limit;
        self
    }

    /// Takes over values and gradients at `x`.
    pub(super) fn move_to(&mut self, x: Vec<f64>, g: Gradients) {
        self.x = x;
        self.objective = g.values.objective;
        self.rows = g.values.rows;
        self.slope = g.objective;
        self.row_slopes = g.rows;
    }

    /// The point as values and gradients.
    pub(super) fn gradients(&self) -> Gradients {
        let values = Values { objective: self.objective, rows: self.rows.clone() };
        Gradients { values, objective: self.slope.clone(), rows: self.row_slopes.clone() }
    }

    /// The point with its multipliers and the verdict so far.
    pub(crate) fn candidate(&self) -> Candidate {
        Candidate {
            x: self.x.clone(),
            multipliers: self.multipliers.clone(),
            lower: self.lower_multipliers.clone(),
            upper: self.upper_multipliers.clone(),
            iterations: self.book.iteration as usize,
            status: self.verdict.unwrap_or(Status::IterationLimit),
            relaxation: None,
        }
    }
}

impl_argmin_state!(SqpState, x, objective);
