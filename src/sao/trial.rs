//! What is learnt from analysing a proposed design: approximation errors and violation (14)–(18).

use super::Screening;
use crate::problem::{Evaluation, Problem, RowId};
use nlp::Values;

/// The value of ĝ below which its error is taken relative to this value. Without a cut-off the relative error (16) of a
/// constraint that is nowhere near its limit would decide, and it is infinite at ĝ = 0. The paper cuts off at 0.5 or 0.7.
const SMALL: f64 = 0.5;

/// A proposed design, held against its analysis.
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
    /// Fall of the Lagrangian F + Σ λᵢ gᵢ over the step, with the multipliers λ of the approximate problem: promised, and as
    /// analysed; none if the analysis failed.
    pub lagrangian: Option<[f64; 2]>,
    /// w = ½ Σ (Δbₖ/scaleₖ)², the distance that conservatism is measured in.
    pub distance: f64,
    /// What the analysis says; none if it failed.
    pub outcome: Option<Outcome>,
}

/// Errors and violation of a trial whose analysis succeeded, in percent.
#[derive(Clone, Debug, PartialEq)]
pub struct Outcome {
    /// F at the proposed design.
    pub objective: f64,
    /// E_f (14).
    pub objective_error_pct: f64,
    /// E_g (15), (16).
    pub constraint_error_pct: f64,
    /// V (17), (18) over all constraints and time points, kept or not.
    pub violation_pct: f64,
    /// Whether anything was approximated at all: without evidence errors of zero mean nothing.
    pub evidence: bool,
    /// By how much the analysed value exceeds the approximate one: of the objective, then of each constraint the largest over
    /// its kept time points, with the sign that counts for an equality taken away. Not positive where the approximation is
    /// conservative.
    pub shortfall: Vec<f64>,
}

impl Outcome {
    /// E = max(E_f, E_g).
    pub fn error_pct(&self) -> f64 {
        self.objective_error_pct.max(self.constraint_error_pct)
    }

    /// Compares approximate and analysed values.
    ///
    /// E_g is taken over kept rows that are still above the cut-off at the new design: an error in a constraint that
    /// has become unimportant says nothing about the step.
    pub fn new(
        problem: &Problem,
        screening: &Screening,
        kept: &[RowId],
        approximate: &Values,
        analysed: &Evaluation,
    ) -> Self {
        let mut outcome = Self {
            objective: analysed.objective,
            objective_error_pct: relative_pct(approximate.objective, analysed.objective),
            constraint_error_pct: 0.0,
            violation_pct: analysed.max_violation_pct(),
            evidence: !problem.objective.is_explicit(),
            shortfall: vec![f64::NEG_INFINITY; 1 + problem.constraints.len()],
        };
        outcome.shortfall[0] = analysed.objective - approximate.objective;
        for (row, approximate) in kept.iter().zip(&approximate.rows) {
            if problem.constraints[row.constraint].quantity.is_explicit() {
                continue;
            }
            outcome.evidence = true;
            let g = tracked(problem, row, analysed);
            let short = g - (approximate + 1.0);
            let is_equality = problem.constraints[row.constraint].is_equality;
            let worst = &mut outcome.shortfall[row.constraint + 1];
            *worst = worst.max(if is_equality { 0.0 } else { short });
            if screening.is_critical(g) {
                let error = 100.0 * (approximate + 1.0 - g).abs() / g.abs().max(SMALL);
                outcome.constraint_error_pct = outcome.constraint_error_pct.max(error);
            }
        }
        outcome
    }
}

/// What a [`Trial`] says of the Lagrangian: the approximate problem's values and multipliers held against two analyses.
pub(super) fn falls_of_lagrangian(
    problem: &Problem,
    kept: &[RowId],
    (approximate, multipliers): (&Values, &[f64]),
    [before, after]: [&Evaluation; 2],
) -> [f64; 2] {
    let mut falls = [before.objective - approximate.objective, before.objective - after.objective];
    for ((row, λ), to) in kept.iter().zip(multipliers).zip(&approximate.rows).filter(|((_, λ), _)| **λ != 0.0) {
        let from = before.constraints[row.constraint][row.point] - 1.0;
        falls[0] += λ * (from - to);
        falls[1] += λ * (from - (tracked(problem, row, after) - 1.0));
    }
    falls
}

/// ĝ of a kept row at the new design. A peak in continuous time is followed to the nearest one, if there is one.
pub(super) fn tracked(problem: &Problem, row: &RowId, analysed: &Evaluation) -> f64 {
    let history = &analysed.constraints[row.constraint];
    if !problem.constraints[row.constraint].is_continuous {
        return history[row.point];
    }
    let peaks = analysed.peaks.iter().filter(|p| p.row.constraint == row.constraint);
    let nearest = peaks.min_by_key(|p| p.row.point.abs_diff(row.point));
    nearest.map_or(history[row.point], |p| history[p.row.point])
}

/// |a − b| / |b| in percent; in units of the value itself where b is zero.
fn relative_pct(a: f64, b: f64) -> f64 {
    let scale = if b == 0.0 { 1.0 } else { b.abs() };
    (a - b).abs() / scale * 100.0
}
