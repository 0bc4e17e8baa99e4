//! Rows of the history of a run.

use super::trial::AnalysedProposal;
use super::{Region, StepVerdict, Trial};
use crate::problem::{AnalyzedDesign, Evaluation, Problem, RowId};
use serde::{Deserialize, Serialize};

/// A constraint that is active in the solution of an approximate problem.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveRow {
    /// Constraint and time point.
    pub row: RowId,
    /// Its multiplier λ in the Lagrangian F + Σ λ (ĝ − 1), in the unit of the objective; non-negative for inequalities.
    pub multiplier: f64,
}

/// Predicted and analysed values at the proposed design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// F̃, conservatism included.
    pub objective: f64,
    /// ĝ of each retained row in the approximate problem, in the order of [`Cycle::retained`].
    pub rows: Vec<f64>,
    /// ĝ of the same rows as analysed; empty if the analysis failed.
    pub analysed: Vec<f64>,
    /// The bound variable β of a min–max objective to which these values belong, if it is not that of [`Cycle::design`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
}

/// One row of the history: a trial step, accepted or rejected. Cycle 0 is the start design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cycle {
    /// Number of the cycle.
    pub cycle: usize,
    /// True if the proposed design was accepted.
    pub accepted: bool,
    /// Number of variables at a move limit.
    pub active_limits: usize,
    /// The proposed design.
    pub design: Vec<f64>,
    /// F at the proposed design; that of the start of the cycle if the analysis failed.
    pub objective: f64,
    /// The largest |f| at the proposed design, for a min–max objective whose analysis succeeded; see [`Problem::peak_objective`].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub peak: Option<f64>,
    /// E_f in percent.
    pub objective_error_pct: f64,
    /// E_g in percent.
    pub constraint_error_pct: f64,
    /// V in percent.
    pub violation_pct: f64,
    /// max |Δbᵢ| / |bᵢ| in percent.
    pub max_variable_change_pct: f64,
    /// The constraint and time point with the largest violation.
    pub worst: Option<RowId>,
    /// Move-limit factors of this trial step.
    pub factors: Vec<f64>,
    /// Search subregion of this trial step; `None` for the start.
    pub region: Option<Region>,
    /// Rows of the approximate problem.
    #[serde(rename = "kept")]
    pub retained: Vec<RowId>,
    /// Rows that are active in its solution.
    pub active: Vec<ActiveRow>,
    /// Status of the subproblem solver; `None` for the start.
    pub subproblem: Option<nlp::ProgramStatus>,
    /// Iterations of the subproblem solver.
    pub iterations: usize,
    /// Largest scaled KKT residual of the subproblem's solution, computed independently of the solver.
    pub kkt: f64,
    /// Relaxation of the approximate problem (largest row violation); 0 if it is feasible.
    pub relaxation: f64,
    /// Residual of the optimality conditions of the problem at the start of the cycle, relative to the objective; computed only
    /// if the objective has settled and no constraint is violated.
    #[serde(default)]
    pub residual: Option<f64>,
    /// Predicted values for the proposed design; `None` for the start, and in histories of early versions.
    #[serde(default)]
    pub prediction: Option<Prediction>,
    /// Error of the analysis of the proposed design; `None` if it succeeded.
    pub failure: Option<String>,
    /// True if the design was accepted without regard to its objective, to leave a stationary point.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_displaced: bool,
}

impl Cycle {
    /// The quantity that is minimized at the proposed design: the peak of a min–max problem, or F.
    pub(super) fn stated_objective(&self) -> f64 {
        self.peak.unwrap_or(self.objective)
    }

    /// V as a fraction; 0 if no constraint is violated.
    pub(super) fn violation(&self) -> f64 {
        (self.violation_pct / 100.0).max(0.0)
    }

    /// The row of the start design.
    pub(super) fn start(problem: &Problem, design: &[f64], evaluation: &Evaluation, factors: &[f64]) -> Self {
        Self {
            cycle: 0,
            accepted: true,
            active_limits: 0,
            design: design.to_vec(),
            objective: evaluation.objective,
            peak: problem.peak_objective(design, evaluation),
            objective_error_pct: 0.0,
            constraint_error_pct: 0.0,
            violation_pct: evaluation.max_violation_pct(),
            max_variable_change_pct: 0.0,
            worst: evaluation.worst().map(|(row, _)| row),
            factors: factors.to_vec(),
            region: None,
            retained: vec![],
            active: vec![],
            subproblem: None,
            iterations: 0,
            kkt: 0.0,
            relaxation: 0.0,
            residual: None,
            prediction: None,
            failure: None,
            is_displaced: false,
        }
    }

    /// The row of a trial step after the decision on it; `number` is that of its cycle.
    pub(super) fn new(
        problem: &Problem,
        number: usize,
        factors: &[f64],
        trial: &Trial,
        verdict: StepVerdict,
        proposal: &AnalysedProposal,
    ) -> Self {
        let (outcome, AnalysedProposal { data, region, solution, analyzed, .. }) = (trial.outcome.as_ref(), proposal);
        let analyzed = analyzed.as_ref();
        let found = analyzed.ok().map(|analyzed| &analyzed.evaluation);
        let active = data.retained.iter().zip(&solution.multipliers).filter(|(_, m)| **m != 0.0);
        let change = |(to, from): (&f64, &f64)| (to - from).abs() / if *from == 0.0 { 1.0 } else { from.abs() };
        let values = |found: &Evaluation| data.retained.iter().map(|row| found.value_of(*row)).collect();
        let prediction = Prediction {
            objective: solution.objective,
            rows: solution.rows.iter().map(|row| row + 1.0).collect(),
            analysed: found.map_or_else(Vec::new, values),
            bound: None,
        };
        Self {
            cycle: number,
            accepted: verdict == StepVerdict::Accept,
            active_limits: trial.at_limit.iter().filter(|a| **a).count(),
            design: solution.x.clone(),
            objective: outcome.map_or(trial.objective_before, |o| o.objective),
            peak: analyzed.ok().and_then(|analyzed| problem.peak_objective(&analyzed.design, &analyzed.evaluation)),
            objective_error_pct: outcome.map_or(0.0, |o| o.objective_error_pct),
            constraint_error_pct: outcome.map_or(0.0, |o| o.constraint_error_pct),
            violation_pct: outcome.map_or(0.0, |o| o.violation_pct),
            max_variable_change_pct: 100.0 * trial.to.iter().zip(trial.from).map(change).fold(0.0, f64::max),
            worst: found.and_then(Evaluation::worst).map(|(row, _)| row),
            factors: factors.to_vec(),
            region: Some((*region).clone()),
            retained: data.retained.clone(),
            active: active.map(|(&row, &multiplier)| ActiveRow { row, multiplier }).collect(),
            subproblem: Some(solution.status),
            iterations: solution.iterations,
            kkt: solution.kkt.largest(),
            relaxation: solution.relaxation.unwrap_or(0.0),
            residual: None,
            prediction: Some(prediction),
            failure: analyzed.err().map(ToString::to_string),
            is_displaced: false,
        }
    }

    /// The row with design, objective and violation of `analyzed`, whose variable `bound` is at the peak of the objective. Predictions
    /// remain those with the proposed bound.
    pub(super) fn at(mut self, analyzed: &AnalyzedDesign, bound: usize) -> Self {
        let AnalyzedDesign { design, evaluation, .. } = analyzed;
        if let Some(prediction) = &mut self.prediction {
            prediction.bound = Some(self.design[bound]);
        }
        Self {
            design: design.clone(),
            objective: evaluation.objective,
            violation_pct: evaluation.max_violation_pct(),
            worst: evaluation.worst().map(|(row, _)| row),
            ..self
        }
    }
}
