//! Residual of the first-order optimality conditions of the problem at the start of a cycle.

use crate::approximation::ApproximateProblem;
use crate::problem::Problem;
use error::Result;
use nlp::Program;

/// Length of each variable: its absolute value, limited to between a tenth of its scale and its scale.
fn lengths(problem: &Problem, b: &[f64]) -> Vec<f64> {
    problem.scales().iter().zip(b).map(|(scale, b)| b.abs().clamp(0.1 * scale, *scale)).collect()
}

/// Possible first-order decrease of the objective at design `b`, the start of a cycle, relative to the objective there.
///
/// The approximate problem has the values and gradients of the problem at `b`. With its multipliers λ and
/// s = ∇F + Σ λᵢ ∇ĝᵢ at `b`, this is the largest of
///
/// * |sₖ| × the distance that variable k can move against sₖ, at most its length, divided by |F|. Multipliers of move limits do not
///   enter s: a design at a move limit only is not optimal;
/// * |λᵢ (ĝᵢ − 1)| divided by |F|: a row that is active in the solution of the approximate problem, but not yet at the design.
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
        let distance = if slope > 0.0 { b[k] - variable.lower } else { variable.upper - b[k] };
        most = most.max(slope.abs() * distance.min(length));
    }
    let slack = multipliers.iter().zip(&here.values.rows).map(|(λ, g)| (λ * g).abs());
    Ok(slack.fold(most, f64::max) / unit)
}
