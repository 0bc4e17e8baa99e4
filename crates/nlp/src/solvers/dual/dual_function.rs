//! The dual function of a separable program with its derivatives, and the solution at given multipliers.

use super::state::FalkState;
use crate::kkt::{KktAccumulator, VariableBounds};
use crate::program::{DualSums, Program, Separable};
use crate::separable::CHUNK;
use crate::solution::{Evaluations, ProgramStatus, Solution};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

/// Variables per parallel task of the dual sums. It is fixed, so that sums have the same bits for any number of threads.
const DUAL_CHUNK: usize = 1024;

/// The dual function W(λ) = min f + Σ λᵢ gᵢ over the bounds, at one λ.
///
/// $$ ∇W = g(x(λ)),\qquad ∇²W = -\sum_{j\ \text{off its bounds}} \frac{g'_j g_j'^T}{f''_{0j} + \sum_i λ_i f''_{ij}} $$
#[derive(Clone, Debug)]
pub(super) struct DualEvaluation {
    pub value: f64,
    /// g at the minimizer, length m.
    pub rows: DVector<f64>,
    /// −∇²W, m × m, positive semidefinite.
    pub negative_hessian: DMatrix<f64>,
}

/// The dual function at `weights` = (1, λ).
pub(super) fn dual(program: &dyn Separable, weights: &[f64]) -> DualEvaluation {
    let (n, m) = (program.variables(), program.rows());
    let chunks: Vec<DualSums> = (0..n.div_ceil(DUAL_CHUNK))
        .into_par_iter()
        .map(|c| program.dual_sums(c * DUAL_CHUNK..n.min((c + 1) * DUAL_CHUNK), weights))
        .collect();
    let mut total = DualSums::new(m);
    chunks.iter().for_each(|c| total.add(c));
    let rows = DVector::from_fn(m, |i, _| program.constant(i + 1) + total.values[i + 1]);
    let value = (0..=m).map(|i| weights[i] * (program.constant(i) + total.values[i])).sum();
    DualEvaluation { value, rows, negative_hessian: DMatrix::from_fn(m, m, |i, k| total.entry(i, k)) }
}

/// The minimizer x(λ) at `weights` = (1, λ).
fn minimizer(program: &dyn Separable, weights: &[f64]) -> Vec<f64> {
    (0..program.variables()).into_par_iter().map(|j| program.minimizer(j, weights)).collect()
}

/// The solution at the multipliers of `state`, with values and KKT residual from new evaluations.
///
/// The residual is accumulated variable by variable; no matrix of size m × n is stored.
pub(super) fn solution(program: &dyn Program, separable: &dyn Separable, start: &[f64], state: &FalkState) -> Solution {
    let (multipliers, status) = (state.multipliers.clone(), state.status.unwrap_or(ProgramStatus::IterationLimit));
    let weights: Vec<f64> = [1.0].into_iter().chain(multipliers.iter().copied()).collect();
    let x = minimizer(separable, &weights);
    let (mut lower, mut upper) = (vec![0.0; x.len()], vec![0.0; x.len()]);
    let bounds = lower.par_chunks_mut(CHUNK).zip(upper.par_chunks_mut(CHUNK));
    let chunks: Vec<(Vec<f64>, KktAccumulator)> = bounds
        .enumerate()
        .map(|(c, (lower, upper))| accumulate(program, separable, (start, &x, &multipliers), c * CHUNK, lower, upper))
        .collect();
    let mut sums: Vec<f64> = (0..weights.len()).map(|i| separable.constant(i)).collect();
    let mut all = KktAccumulator::new(multipliers.len());
    for (values, chunk) in &chunks {
        sums.iter_mut().zip(values).for_each(|(a, b)| *a += b);
        all.merge(chunk);
    }
    let kkt = all.finish(program, &sums[1..], &multipliers, &[]);
    Solution {
        x,
        objective: sums[0],
        rows: sums[1..].to_vec(),
        multipliers,
        lower_multipliers: lower,
        upper_multipliers: upper,
        iterations: 0,
        evaluations: Evaluations::default(),
        status,
        relaxation: None,
        relaxed_rows: vec![],
        kkt,
    }
}

/// Sums of values and KKT contributions of the variables from `first` on; stores the multipliers of their bounds.
fn accumulate(
    program: &dyn Program,
    separable: &dyn Separable,
    (start, x, λ): (&[f64], &[f64], &[f64]),
    first: usize,
    lower: &mut [f64],
    upper: &mut [f64],
) -> (Vec<f64>, KktAccumulator) {
    let functions = λ.len() + 1;
    let (mut sums, mut kkt) = (vec![0.0; functions], KktAccumulator::new(λ.len()));
    let (mut values, mut slopes) = (vec![0.0; functions], vec![0.0; functions]);
    let (l, u) = (program.lower(), program.upper());
    for k in 0..lower.len() {
        let j = first + k;
        separable.column(j, x[j], &mut values, &mut slopes);
        sums.iter_mut().zip(&values).for_each(|(a, b)| *a += b);
        let bounds = VariableBounds::new((l[j], u[j]), x[j], start[j]);
        let objective = [slopes[0], separable.term(0, j, start[j]).slope];
        [lower[k], upper[k]] = kkt.add(&bounds, objective, &slopes[1..], λ, |slope| bounds.multipliers(slope));
    }
    (sums, kkt)
}
