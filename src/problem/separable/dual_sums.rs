//! What one pass over the variables adds to the dual function and its derivatives.

use super::{Separable, Term};
use std::ops::Range;

/// Sums over some variables at the minimizers for given weights (1, λ).
#[derive(Clone, Debug, PartialEq)]
pub struct DualSums {
    /// Σⱼ fᵢⱼ, length 1 + m.
    pub values: Vec<f64>,
    /// Σⱼ f′ᵢⱼ f′ₖⱼ / f″ⱼ over the variables off their bounds, the lower triangle row by row.
    pub bend: Vec<f64>,
}

impl DualSums {
    /// Zeros for m rows.
    pub fn new(m: usize) -> Self {
        Self { values: vec![0.0; m + 1], bend: vec![0.0; m * (m + 1) / 2] }
    }

    /// Entry (i, k) of the symmetric matrix.
    pub fn entry(&self, i: usize, k: usize) -> f64 {
        let (i, k) = (i.max(k), i.min(k));
        self.bend[i * (i + 1) / 2 + k]
    }

    /// Adds other variables.
    pub fn add(&mut self, other: &Self) {
        self.values.iter_mut().zip(&other.values).for_each(|(a, b)| *a += b);
        self.bend.iter_mut().zip(&other.bend).for_each(|(a, b)| *a += b);
    }

    /// Adds one variable, given the slopes of all 1 + m functions and 1/f″, if it is off its bounds.
    #[inline]
    pub(super) fn bend_by(&mut self, slopes: &[f64], flexibility: f64) {
        let rows = &slopes[1..];
        let mut rest = self.bend.as_mut_slice();
        for (i, slope) in rows.iter().enumerate() {
            let (row, next) = rest.split_at_mut(i + 1);
            let scaled = slope * flexibility;
            row.iter_mut().zip(rows).for_each(|(b, s)| *b += scaled * s);
            rest = next;
        }
    }
}

/// The sums over `range`, term by term.
pub(super) fn general(program: &(impl Separable + ?Sized), range: Range<usize>, weights: &[f64]) -> DualSums {
    let mut sums = DualSums::new(weights.len() - 1);
    let (mut terms, mut slopes) = (vec![Term::default(); weights.len()], vec![0.0; weights.len()]);
    for j in range {
        let x = program.minimizer(j, weights);
        program.terms(j, x, &mut terms);
        let curvature: f64 = terms.iter().zip(weights).map(|(t, w)| w * t.curvature).sum();
        let free = x > program.lower()[j] && x < program.upper()[j] && curvature > 0.0;
        for ((sum, slope), t) in sums.values.iter_mut().zip(&mut slopes).zip(&terms) {
            *sum += t.value;
            *slope = t.slope;
        }
        if free {
            sums.bend_by(&slopes, 1.0 / curvature);
        }
    }
    sums
}
