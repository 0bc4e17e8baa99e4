//! The dual function of a separable program, with first and second derivatives.

use crate::Separable;
use crate::separable::DualSums;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Variables per parallel task; fixed, so that sums have the same bits for any number of threads.
const CHUNK: usize = 1024;

/// W(λ) = min over the box of f + Σ λᵢ gᵢ.
///
/// $$ ∇W = g(x(λ)),\qquad ∇²W = -\sum_{j\ \text{off its bounds}} \frac{g'_j g_j'^T}{f''_{0j} + \sum_i λ_i f''_{ij}} $$
#[derive(Clone, Debug)]
pub(super) struct Dual {
    pub value: f64,
    /// g at the minimizer, length m.
    pub rows: DVector<f64>,
    /// −∇²W, m × m, positive semidefinite.
    pub bend: DMatrix<f64>,
}

/// The dual function at `weights` = (1, λ).
pub(super) fn dual(program: &dyn Separable, weights: &[f64]) -> Dual {
    let (n, m) = (program.variables(), program.rows());
    let chunks: Vec<DualSums> = (0..n.div_ceil(CHUNK))
        .into_par_iter()
        .map(|c| program.dual_sums(c * CHUNK..n.min((c + 1) * CHUNK), weights))
        .collect();
    let mut total = DualSums::new(m);
    chunks.iter().for_each(|c| total.add(c));
    let rows = DVector::from_fn(m, |i, _| program.constant(i + 1) + total.values[i + 1]);
    let value = (0..=m).map(|i| weights[i] * (program.constant(i) + total.values[i])).sum();
    Dual { value, rows, bend: DMatrix::from_fn(m, m, |i, k| total.entry(i, k)) }
}

/// x(λ).
pub(super) fn minimizer(program: &dyn Separable, weights: &[f64]) -> Vec<f64> {
    (0..program.variables()).into_par_iter().map(|j| program.minimizer(j, weights)).collect()
}
