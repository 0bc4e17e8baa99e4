//! The dual function of a separable program, with first and second derivatives.

use crate::problem::Separable;
use crate::problem::separable::Term;
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
    let chunks: Vec<Sums> = (0..n.div_ceil(CHUNK).max(1))
        .into_par_iter()
        .map(|c| Sums::of(program, weights, c * CHUNK..n.min((c + 1) * CHUNK)))
        .collect();
    let mut total = Sums::new(m);
    chunks.iter().for_each(|c| total.add(c));
    let rows = DVector::from_fn(m, |i, _| program.constant(i + 1) + total.values[i + 1]);
    let value = (0..=m).map(|i| weights[i] * (program.constant(i) + total.values[i])).sum();
    let bend = DMatrix::from_fn(m, m, |i, k| total.bend[packed(i.max(k), i.min(k))]);
    Dual { value, rows, bend }
}

/// x(λ).
pub(super) fn minimizer(program: &dyn Separable, weights: &[f64]) -> Vec<f64> {
    (0..program.variables()).into_par_iter().map(|j| program.minimizer(j, weights)).collect()
}

/// Sums over some variables; the matrix is packed by rows of its lower triangle.
struct Sums {
    values: Vec<f64>,
    bend: Vec<f64>,
}

fn packed(i: usize, k: usize) -> usize {
    i * (i + 1) / 2 + k
}

impl Sums {
    fn new(m: usize) -> Self {
        Self { values: vec![0.0; m + 1], bend: vec![0.0; m * (m + 1) / 2] }
    }

    fn of(program: &dyn Separable, weights: &[f64], range: std::ops::Range<usize>) -> Self {
        let m = weights.len() - 1;
        let mut sums = Self::new(m);
        let mut terms = vec![Term::default(); m + 1];
        for j in range {
            let x = program.minimizer(j, weights);
            program.terms(j, x, &mut terms);
            sums.values.iter_mut().zip(&terms).for_each(|(sum, t)| *sum += t.value);
            if x > program.lower()[j] && x < program.upper()[j] {
                let curvature: f64 = terms.iter().zip(weights).map(|(t, w)| w * t.curvature).sum();
                if curvature > 0.0 {
                    sums.bend_by(&terms[1..], 1.0 / curvature);
                }
            }
        }
        sums
    }

    fn bend_by(&mut self, terms: &[Term], flexibility: f64) {
        let mut at = 0;
        for (i, t) in terms.iter().enumerate() {
            let scaled = t.slope * flexibility;
            for (b, u) in self.bend[at..=at + i].iter_mut().zip(terms) {
                *b += scaled * u.slope;
            }
            at += i + 1;
        }
    }

    fn add(&mut self, other: &Self) {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self.bend.iter_mut().zip(&other.bend).for_each(|(a, b)| *a += b);
    }
}
