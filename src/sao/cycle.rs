//! The history of a run, row by row.

use super::trial::tracked;
use super::{CycleData, Region, State, Trial, Verdict};
use crate::problem::{Evaluation, Problem, Responses, RowId};
use error::Result;
use nlp::{self, Solution};
use serde::{Deserialize, Serialize};

/// A constraint that holds the proposed design.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ActiveRow {
    /// Constraint and time point.
    pub row: RowId,
    /// Its multiplier ∂F/∂ĝ, in the unit of the objective.
    pub multiplier: f64,
}

/// What the approximate problem promised for the proposed design, beside what its analysis found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Prediction {
    /// F̃, conservatism included.
    pub objective: f64,
    /// ĝ of each kept row in the approximate problem, in the order of [`Cycle::kept`].
    pub rows: Vec<f64>,
    /// ĝ of the same rows as analysed; empty if the analysis failed.
    pub analysed: Vec<f64>,
}

impl Prediction {
    /// Holds a proposal against its analysis, if that succeeded.
    pub(super) fn new(problem: &Problem, kept: &[RowId], proposal: &Solution, analysed: Option<&Evaluation>) -> Self {
        let found = |evaluation| kept.iter().map(|row| tracked(problem, row, evaluation)).collect();
        Self {
            objective: proposal.objective,
            rows: proposal.rows.iter().map(|row| row + 1.0).collect(),
            analysed: analysed.map_or_else(Vec::new, found),
        }
    }
}

/// One row of the history: a cycle, or a rejected try of it. Cycle 0 is the start design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cycle {
    /// Number of the cycle.
    pub cycle: usize,
    /// Whether the proposed design was accepted.
    pub accepted: bool,
    /// Number of variables at a move limit.
    pub active_limits: usize,
    /// The proposed design.
    pub design: Vec<f64>,
    /// F at the proposed design; that of the start of the cycle if the analysis failed.
    pub objective: f64,
    /// E_f in percent.
    pub objective_error_pct: f64,
    /// E_g in percent.
    pub constraint_error_pct: f64,
    /// V in percent.
    pub violation_pct: f64,
    /// max |Δbᵢ| / |bᵢ| in percent.
    pub max_variable_change_pct: f64,
    /// The constraint and time point that is nearest to or farthest beyond its limit.
    pub worst: Option<RowId>,
    /// Move-limit factors of this try.
    pub factors: Vec<f64>,
    /// Search subregion of this try; none for the start.
    pub region: Option<Region>,
    /// Rows of the approximate problem.
    pub kept: Vec<RowId>,
    /// Rows that are active in its solution.
    pub active: Vec<ActiveRow>,
    /// What the subproblem solver concluded; none for the start.
    pub subproblem: Option<nlp::Status>,
    /// Iterations of the subproblem solver.
    pub iterations: usize,
    /// Largest scaled KKT residual of the subproblem's solution, computed independently of the solver.
    pub kkt: f64,
    /// By how much the approximate problem had to be relaxed (largest row violation); 0 where it is feasible.
    pub relaxation: f64,
    /// How far the start of the cycle was from the optimality conditions of the problem itself, relative to the objective;
    /// computed where the objective has settled and nothing is violated.
    #[serde(default)]
    pub residual: Option<f64>,
    /// What was promised for the proposed design; none for the start, and in histories that were written before it was kept.
    #[serde(default)]
    pub prediction: Option<Prediction>,
    /// Why the analysis of the proposed design failed, if it did.
    pub failure: Option<String>,
}

impl Cycle {
    /// The row of the start design.
    pub(super) fn start(design: &[f64], evaluation: &Evaluation, factors: &[f64]) -> Self {
        Self {
            cycle: 0,
            accepted: true,
            active_limits: 0,
            design: design.to_vec(),
            objective: evaluation.objective,
            objective_error_pct: 0.0,
            constraint_error_pct: 0.0,
            violation_pct: evaluation.max_violation_pct(),
            max_variable_change_pct: 0.0,
            worst: evaluation.worst().map(|(row, _)| row),
            factors: factors.to_vec(),
            region: None,
            kept: vec![],
            active: vec![],
            subproblem: None,
            iterations: 0,
            kkt: 0.0,
            relaxation: 0.0,
            residual: None,
            prediction: None,
            failure: None,
        }
    }

    /// The row of a trial that has been judged.
    pub(super) fn new(
        state: &State,
        trial: &Trial,
        verdict: Verdict,
        knowledge: &CycleData,
        region: Region,
        proposal: &Solution,
        analysed: &Result<(Responses, Evaluation)>,
    ) -> Self {
        let outcome = trial.outcome.as_ref();
        let active = knowledge.kept.iter().zip(&proposal.multipliers).filter(|(_, m)| **m != 0.0);
        let change = |(to, from): (&f64, &f64)| (to - from).abs() / if *from == 0.0 { 1.0 } else { from.abs() };
        Self {
            cycle: state.cycles() + 1,
            accepted: verdict == Verdict::Accept,
            active_limits: trial.at_limit.iter().filter(|a| **a).count(),
            design: trial.to.to_vec(),
            objective: outcome.map_or(trial.objective_before, |o| o.objective),
            objective_error_pct: outcome.map_or(0.0, |o| o.objective_error_pct),
            constraint_error_pct: outcome.map_or(0.0, |o| o.constraint_error_pct),
            violation_pct: outcome.map_or(0.0, |o| o.violation_pct),
            max_variable_change_pct: 100.0 * trial.to.iter().zip(trial.from).map(change).fold(0.0, f64::max),
            worst: analysed.as_ref().ok().and_then(|(_, e)| e.worst()).map(|(row, _)| row),
            factors: state.factors.clone(),
            region: Some(region),
            kept: knowledge.kept.clone(),
            active: active.map(|(&row, &multiplier)| ActiveRow { row, multiplier }).collect(),
            subproblem: Some(proposal.status),
            iterations: proposal.iterations,
            kkt: proposal.kkt.largest(),
            relaxation: proposal.relaxation.unwrap_or(0.0),
            residual: None,
            prediction: None,
            failure: analysed.as_ref().err().map(ToString::to_string),
        }
    }
}
