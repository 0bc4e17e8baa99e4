//! How far the start of a cycle was from the first-order conditions of the problem itself.

use crate::approximation::ApproximateProblem;
use crate::problem::Problem;
use error::Result;
use nlp::Program;

/// A variable's length: its size, between a tenth of its scale and its scale.
fn lengths(problem: &Problem, b: &[f64]) -> Vec<f64> {
    problem.scales().iter().zip(b).map(|(scale, b)| b.abs().clamp(0.1 * scale, *scale)).collect()
}

/// What first-order models at design `b`, the start of a cycle, still promise, relative to the objective there.
///
/// The approximate problem has the values and gradients of the problem at `b`. With its multipliers λ and
/// s = ∇F + Σ λᵢ ∇ĝᵢ at `b`, this is the largest of
///
/// * |sₖ| × the distance that variable k can move against sₖ, at most its length, over |F|. Multipliers of move limits are
///   left out of s: a step that only a move limit stops is not at its end;
/// * |λᵢ (ĝᵢ − 1)| over |F|: a row that holds the solution of the approximate problem, but not yet the design.
///
/// The error of the objective is of second order in it.
pub(super) fn residual(
    problem: &Problem,
    approximate: &ApproximateProblem,
    b: &[f64],
    multipliers: &[f64],
) -> Result<f64> {
    let here = approximate.gradients(b)?;
    let unit = if here.values.objective == 0.0 { 1.0 } else { here.values.objective.abs() };
    let mut most = 0.0f64;
    for (k, length) in lengths(problem, b).into_iter().enumerate() {
        let held = multipliers.iter().zip(here.rows.column(k).iter()).map(|(λ, g)| λ * g).sum::<f64>();
        let slope = here.objective[k] + held;
        let variable = &problem.variables[k];
        let room = if slope > 0.0 { b[k] - variable.lower } else { variable.upper - b[k] };
        most = most.max(slope.abs() * room.min(length));
    }
    let slack = multipliers.iter().zip(&here.values.rows).map(|(λ, g)| (λ * g).abs());
    Ok(slack.fold(most, f64::max) / unit)
}
