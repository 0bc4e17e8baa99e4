//! Multipliers that balance the gradients of the active rows best, in the least-squares sense.

use super::state::SqpState;
use crate::kkt::row_units;
use crate::{Program, orthonormal_basis};
use nalgebra::{DMatrix, DVector};

/// Distance of a row from its limit, in its unit, up to which it counts as active.
const ACTIVE: f64 = 1e-6;

/// Non-negative multipliers λ of the active rows (of any sign for equalities) that minimize ‖S(∇f + Σ λᵢ ∇gᵢ)‖ over the
/// variables off their bounds, with the scales S of the variables; zero for the other rows.
///
/// They depend on the point only. Those of a quadratic program whose Hessian was made convex depend on that Hessian, and
/// can grow without bound when they weight the next one.
///
/// # Sources
/// Nocedal & Wright, *Numerical Optimization*, equation (18.21); Lawson & Hanson, *Solving Least Squares Problems* (1974),
/// chapter 23.
pub(super) fn multipliers(program: &dyn Program, state: &SqpState, scale: &[f64]) -> Vec<f64> {
    let units = row_units(scale, &state.row_gradients);
    let (lower, upper) = (program.lower(), program.upper());
    let free: Vec<usize> = (0..scale.len())
        .filter(|&j| state.x[j] > lower[j] + ACTIVE * scale[j] && state.x[j] < upper[j] - ACTIVE * scale[j])
        .collect();
    let active: Vec<usize> = (0..state.rows.len())
        .filter(|&i| program.is_equality(i) || state.rows[i] >= -ACTIVE * units[i])
        .filter(|&i| free.iter().any(|&j| state.row_gradients[(i, j)] != 0.0))
        .collect();
    let matrix =
        DMatrix::from_fn(free.len(), active.len(), |k, a| state.row_gradients[(active[a], free[k])] * scale[free[k]]);
    let slope: Vec<f64> = free.iter().map(|&j| state.objective_gradient[j] * scale[j]).collect();
    let equality: Vec<bool> = active.iter().map(|&i| program.is_equality(i)).collect();
    let mut λ = vec![0.0; state.rows.len()];
    active.iter().zip(least_squares_multipliers(&slope, &matrix, &equality)).for_each(|(&i, found)| λ[i] = found);
    λ
}

/// Orthonormal vectors that span the gradients of the equalities and of the rows with a multiplier, over the variables scaled by
/// `scale`, and the variables that the slope of the Lagrangian holds at a bound.
pub(super) fn normals(
    program: &dyn Program,
    state: &SqpState,
    scale: &[f64],
    multipliers: &[f64],
) -> Vec<DVector<f64>> {
    let n = scale.len();
    let slope = |j: usize| {
        state.objective_gradient[j]
            + multipliers.iter().enumerate().map(|(i, λ)| λ * state.row_gradients[(i, j)]).sum::<f64>()
    };
    let is_held = |j: &usize| {
        let j = *j;
        let (low, high) = (program.lower()[j] + ACTIVE * scale[j], program.upper()[j] - ACTIVE * scale[j]);
        (state.x[j] <= low && slope(j) > 0.0) || (state.x[j] >= high && slope(j) < 0.0)
    };
    let held = (0..n).filter(is_held).map(|j| DVector::from_fn(n, |k, _| f64::from(k == j)));
    let rows = (0..multipliers.len()).filter(|&i| program.is_equality(i) || multipliers[i] != 0.0);
    let gradient = |i: usize| DVector::from_fn(n, |j, _| state.row_gradients[(i, j)] * scale[j]);
    orthonormal_basis(held.chain(rows.map(gradient)), super::curvature::DEPENDENT)
}

/// The multipliers λ that minimize ‖slope + `gradients` λ‖, non-negative except for equalities; zero columns have λ = 0.
///
/// `gradients` has one column for each multiplier.
pub fn least_squares_multipliers(slope: &[f64], gradients: &DMatrix<f64>, equality: &[bool]) -> Vec<f64> {
    // Columns of unit length; an equality has a second column of the opposite sign.
    let mut columns: Vec<(usize, f64, DVector<f64>)> = vec![];
    for (i, a) in gradients.column_iter().enumerate() {
        let norm = a.norm();
        if norm > 0.0 && norm.is_finite() {
            columns.push((i, 1.0 / norm, a / norm));
            if equality[i] {
                columns.push((i, -1.0 / norm, -&a / norm));
            }
        }
    }
    let mut λ = vec![0.0; equality.len()];
    if columns.is_empty() {
        return λ;
    }
    let matrix = DMatrix::from_columns(&columns.iter().map(|c| c.2.clone()).collect::<Vec<_>>());
    let target = -DVector::from_column_slice(slope);
    for ((i, factor, _), z) in columns.iter().zip(non_negative_least_squares(&matrix, &target).iter()) {
        λ[*i] += factor * z;
    }
    λ
}

/// The minimizer z ≥ 0 of ‖A z − b‖ by the active-set method of Lawson & Hanson.
fn non_negative_least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let n = a.ncols();
    let (mut z, mut passive) = (DVector::zeros(n), vec![false; n]);
    let tolerance = 1e-12 * b.norm();
    for _ in 0..3 * n {
        let slope = a.tr_mul(&(b - a * &z));
        let steepest = (0..n).filter(|&k| !passive[k]).max_by(|&i, &j| slope[i].total_cmp(&slope[j]));
        let Some(next) = steepest.filter(|&k| slope[k] > tolerance) else { break };
        passive[next] = true;
        loop {
            let chosen: Vec<usize> = (0..n).filter(|&k| passive[k]).collect();
            let svd = a.select_columns(&chosen).svd(true, true);
            let Ok(found) = svd.solve(b, 1e-12) else { return z };
            if found.iter().all(|v| *v > 0.0) {
                z.fill(0.0);
                chosen.iter().zip(found.iter()).for_each(|(&k, v)| z[k] = *v);
                break;
            }
            // The longest step towards the unconstrained solution that keeps all entries non-negative.
            let ratio = |(&k, v): (&usize, &f64)| (*v <= 0.0).then(|| (z[k] / (z[k] - v), k));
            let steps = chosen.iter().zip(found.iter()).filter_map(ratio);
            let Some((length, blocking)) = steps.min_by(|a, b| a.0.total_cmp(&b.0)) else { break };
            chosen.iter().zip(found.iter()).for_each(|(&k, v)| z[k] = (z[k] + length * (v - z[k])).max(0.0));
            (z[blocking], passive[blocking]) = (0.0, false);
            if !passive.contains(&true) {
                break;
            }
        }
    }
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_that_needs_a_negative_entry_is_left_out() {
        let a = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.0]);
        let z = non_negative_least_squares(&a, &DVector::from_vec(vec![2.0, -1.0]));
        assert_eq!(z.as_slice(), [2.0, 0.0]);
    }

    #[test]
    fn dependent_columns_reach_the_smallest_residual() {
        let a = DMatrix::from_row_slice(2, 3, &[1.0, 1.0, 2.0, 1.0, 1.0, -1.0]);
        let b = DVector::from_vec(vec![3.0, 1.0]);
        let z = non_negative_least_squares(&a, &b);
        assert!((&a * &z - b).norm() < 1e-12 && z.iter().all(|v| *v >= 0.0));
    }
}
