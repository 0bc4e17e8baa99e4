//! The analysis of a proposed design: approximation errors and violation (14)–(18).

use super::{Region, Screening};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Evaluation, Problem, RowId};
use error::Result;
use nlp::{Solution, Values};

/// The value of ĝ below which its error is taken relative to this value. Without a cut-off the relative error (16) of a
/// constraint far from its limit could be the largest one, and it is infinite at ĝ = 0. The paper cuts off at 0.5 or 0.7.
const SMALL: f64 = 0.5;

/// The solution of an approximate problem and its analysis.
pub(super) struct AnalysedProposal<'a> {
    pub data: &'a CycleData,
    /// The search subregion.
    pub region: &'a Region,
    /// The solution of the approximate problem.
    pub solution: &'a Solution,
    /// w = ½ Σ (Δbₖ/scaleₖ)² of the step to it.
    pub distance: f64,
    /// True for variables of the solution that are at a move limit.
    pub at_limit: &'a [bool],
    /// Analysis of the solution.
    pub analyzed: &'a Result<AnalyzedDesign>,
}

/// A trial step: a proposed design, compared with its analysis.
#[derive(Clone, Debug)]
pub struct Trial<'a> {
    /// The design from which the step was made.
    pub from: &'a [f64],
    /// The proposed design.
    pub to: &'a [f64],
    /// The last accepted step, if any.
    pub last_step: Option<&'a [f64]>,
    /// True for variables that ended at a move limit (not at a bound of the design space).
    pub at_limit: &'a [bool],
    /// True for variables with a finite range.
    pub is_bounded: Vec<bool>,
    /// Objective at the start of the cycle.
    pub objective_before: f64,
    /// Largest violation there, as a fraction, at least zero.
    pub violation_before: f64,
    /// F̃ at the proposed design, conservatism included.
    pub approximate_objective: f64,
    /// Largest violation of the approximate rows at the proposed design, as a fraction, at least zero.
    pub approximate_violation: f64,
    /// Sum of the multipliers of all rows, in the unit of the objective.
    pub multipliers: f64,
    /// Decrease of the Lagrangian F + Σ λᵢ gᵢ over the step, with the multipliers λ of the approximate problem: predicted, and
    /// as analysed; `None` if the analysis failed.
    pub lagrangian: Option<[f64; 2]>,
    /// w = ½ Σ (Δbₖ/scaleₖ)², the distance in which conservatism is measured.
    pub distance: f64,
    /// Errors and violation by the analysis; `None` if it failed.
    pub outcome: Option<Outcome>,
}

/// Errors and violation of a trial step whose analysis succeeded, in percent.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// F at the proposed design.
    pub objective: f64,
    /// E_f (14).
    pub objective_error_pct: f64,
    /// E_g (15), (16).
    pub constraint_error_pct: f64,
    /// V (17), (18) over all constraints and time points, retained or not.
    pub violation_pct: f64,
    /// True if the objective or a retained row is approximate; otherwise the errors are zero and have no meaning.
    pub is_approximate: bool,
    /// Analysed minus approximate value: of the objective, then of each constraint the largest over its retained time points,
    /// at least zero for an equality. Not positive where the approximation is conservative.
    pub shortfall: Vec<f64>,
}

impl<'a> Trial<'a> {
    /// Compares a proposal with the accepted design `from` and its evaluation `before`.
    pub(super) fn new(
        problem: &Problem,
        screening: &Screening,
        (from, before): (&'a [f64], &Evaluation),
        last_step: Option<&'a [f64]>,
        proposal: &AnalysedProposal<'a>,
    ) -> Self {
        let AnalysedProposal { data, solution, distance, at_limit, analyzed, .. } = proposal;
        let approximate = Values { objective: solution.objective, rows: solution.rows.clone() };
        let after = analyzed.as_ref().ok().map(|analyzed| &analyzed.evaluation);
        Self {
            from,
            to: &solution.x,
            last_step,
            at_limit,
            is_bounded: problem.variables.iter().map(|v| (v.upper - v.lower).is_finite()).collect(),
            objective_before: before.objective,
            violation_before: before.max_violation_pct().max(0.0) / 100.0,
            approximate_objective: solution.objective,
            approximate_violation: data.violation(problem, &solution.rows),
            multipliers: solution.multipliers.iter().map(|m| m.abs()).sum(),
            lagrangian: after.map(|after| decreases_of_lagrangian(&data.retained, solution, [before, after])),
            distance: *distance,
            outcome: after.map(|after| Outcome::new(problem, screening, &data.retained, &approximate, after)),
        }
    }
}

impl Outcome {
    /// E = max(E_f, E_g).
    pub fn error_pct(&self) -> f64 {
        self.objective_error_pct.max(self.constraint_error_pct)
    }

    /// Compares approximate and analysed values.
    ///
    /// E_g is the maximum over retained rows that are still above the cut-off at the new design. Errors of less critical
    /// constraints do not affect the decision on the step.
    pub fn new(
        problem: &Problem,
        screening: &Screening,
        retained: &[RowId],
        approximate: &Values,
        analysed: &Evaluation,
    ) -> Self {
        let mut outcome = Self {
            objective: analysed.objective,
            objective_error_pct: relative_pct(approximate.objective, analysed.objective),
            constraint_error_pct: 0.0,
            violation_pct: analysed.max_violation_pct(),
            is_approximate: !problem.objective.quantity.is_explicit(),
            shortfall: vec![f64::NEG_INFINITY; 1 + problem.constraints.len()],
        };
        outcome.shortfall[0] = analysed.objective - approximate.objective;
        for (&row, approximate) in retained.iter().zip(&approximate.rows) {
            let constraint = &problem.constraints[row.constraint];
            if constraint.quantity.is_explicit() {
                continue;
            }
            outcome.is_approximate = true;
            let g = analysed.value_of(row);
            let short = g - (approximate + 1.0);
            let largest = &mut outcome.shortfall[row.constraint + 1];
            *largest = largest.max(if constraint.is_equality() { 0.0 } else { short });
            if screening.is_critical(g) {
                let error = 100.0 * (approximate + 1.0 - g).abs() / g.abs().max(SMALL);
                outcome.constraint_error_pct = outcome.constraint_error_pct.max(error);
            }
        }
        outcome
    }
}

/// Predicted and actual decrease of the Lagrangian between two evaluations.
fn decreases_of_lagrangian(retained: &[RowId], solution: &Solution, [before, after]: [&Evaluation; 2]) -> [f64; 2] {
    let mut decreases = [before.objective - solution.objective, before.objective - after.objective];
    let rows = retained.iter().zip(&solution.multipliers).zip(&solution.rows);
    for ((&row, λ), to) in rows.filter(|((_, λ), _)| **λ != 0.0) {
        let from = before.residuals[row.constraint][row.point];
        decreases[0] += λ * (from - to);
        decreases[1] += λ * (from - (after.value_of(row) - 1.0));
    }
    decreases
}

/// |a − b| / |b| in percent; in units of the value itself where b is zero.
fn relative_pct(a: f64, b: f64) -> f64 {
    let scale = if b == 0.0 { 1.0 } else { b.abs() };
    (a - b).abs() / scale * 100.0
}
