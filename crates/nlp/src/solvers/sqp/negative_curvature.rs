//! Steps along negative curvature, from points where no step reduces the violation to first order.

use super::merit::{CountedProgram, LineSearchPoint, between, is_finite};
use super::state::SqpState;
use crate::program::{largest_violation, most_violated};
use error::Result;
use nalgebra::DMatrix;

/// Largest fraction of the violation that may remain after a step.
const LEFT: f64 = 0.9;
/// Largest number of reductions of the step length, each by [`SHORTER`].
const REDUCTIONS: usize = 8;
const SHORTER: f64 = 0.25;
/// Curvature, relative to the largest one of the row, that counts as rounding.
const ROUNDING: f64 = 1e-12;

/// A point x ± t D v with less violation, moved into the bounds; `None` if there is none.
///
/// v is the eigenvector of the least eigenvalue of D ∇²cᵢ D for the most violated row i and the scales D of the variables, where this
/// eigenvalue is negative: along v the row decreases in second order. The first t is where it would be zero. The side to which its
/// slope points down comes first.
pub(super) fn step(
    evaluator: &mut CountedProgram<'_>,
    state: &SqpState,
    scale: &[f64],
) -> Result<Option<LineSearchPoint>> {
    let (program, n) = (evaluator.program, scale.len());
    let violation = |i: usize| if program.is_equality(i) { state.rows[i].abs() } else { state.rows[i] };
    let Some(worst) = most_violated(0..state.rows.len(), violation, 0.0, 1).pop() else { return Ok(None) };
    let sign = state.rows[worst].signum();
    let mut weights = vec![0.0; state.rows.len()];
    let Some(of_objective) = program.lagrangian_hessian(&state.x, &weights)? else { return Ok(None) };
    weights[worst] = sign;
    let Some(of_both) = program.lagrangian_hessian(&state.x, &weights)? else { return Ok(None) };
    evaluator.count.hessians += 2;
    let row = DMatrix::from_fn(n, n, |i, j| (of_both[(i, j)] - of_objective[(i, j)]) * scale[i] * scale[j]);
    if !row.iter().all(|v| v.is_finite()) {
        return Ok(None);
    }
    let eigen = row.symmetric_eigen();
    let least = eigen.eigenvalues.imin();
    let curvature = -eigen.eigenvalues[least];
    if curvature <= ROUNDING * eigen.eigenvalues.amax() {
        return Ok(None);
    }
    let along: Vec<f64> = eigen.eigenvectors.column(least).iter().zip(scale).map(|(v, s)| v * s).collect();
    let slope: f64 = along.iter().zip(state.row_gradients.row(worst).iter()).map(|(v, g)| sign * v * g).sum();
    let first = if slope > 0.0 { -1.0 } else { 1.0 };
    // |c| − |cᵥ| t − |cᵥᵥ| t²/2 = 0
    let to_zero = ((slope * slope + 2.0 * curvature * state.violation).sqrt() - slope.abs()) / curvature;
    for k in 0..=REDUCTIONS {
        for side in [first, -first] {
            let step_length = SHORTER.powi(k as i32);
            let full: Vec<f64> = state.x.iter().zip(&along).map(|(x, v)| x + side * to_zero * v).collect();
            let x: Vec<f64> = (between(&state.x, &full, step_length).into_iter())
                .zip(program.lower().iter().zip(program.upper()))
                .map(|(x, (lower, upper))| x.clamp(*lower, *upper))
                .collect();
            let Ok(values) = evaluator.values(&x) else { continue };
            if largest_violation(program, &values.rows, |_| 1.0) <= LEFT * state.violation
                && let Some(gradients) = evaluator.gradients(&x).ok().filter(is_finite)
            {
                return Ok(Some(LineSearchPoint { x, gradients, step_length }));
            }
        }
    }
    Ok(None)
}
