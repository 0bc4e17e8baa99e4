//! What one pass over the variables adds to the dual function and its derivatives.

use super::Separable;
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

    /// These sums times a factor.
    #[must_use]
    pub fn times(mut self, factor: f64) -> Self {
        self.values.iter_mut().chain(&mut self.bend).for_each(|v| *v *= factor);
        self
    }

    /// Adds one variable: value and slope of all 1 + m functions, and 1/f″ if it is off its bounds.
    fn add_variable(&mut self, values: &[f64], slopes: &[f64], flexibility: Option<f64>) {
        self.values.iter_mut().zip(values).for_each(|(sum, value)| *sum += value);
        let Some(flexibility) = flexibility else { return };
        let mut rest = self.bend.as_mut_slice();
        for i in 1..slopes.len() {
            let (row, next) = rest.split_at_mut(i);
            let scaled = slopes[i] * flexibility;
            row.iter_mut().zip(&slopes[1..]).for_each(|(b, s)| *b += scaled * s);
            rest = next;
        }
    }
}

/// The sums over `range`, term by term.
pub(super) fn general(program: &(impl Separable + ?Sized), range: Range<usize>, weights: &[f64]) -> DualSums {
    let mut sums = DualSums::new(weights.len() - 1);
    let (mut values, mut slopes) = (vec![0.0; weights.len()], vec![0.0; weights.len()]);
    for j in range {
        let x = program.minimizer(j, weights);
        program.column(j, x, &mut values, &mut slopes);
        let curvature = program.weighted(j, x, weights).curvature;
        let free = x > program.lower()[j] && x < program.upper()[j] && curvature > 0.0;
        sums.add_variable(&values, &slopes, free.then(|| 1.0 / curvature));
    }
    sums
}
