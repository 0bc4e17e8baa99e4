//! First prices from a sample of the variables.

use super::units::Units;
use crate::separable::{self, DualSums, Term};
use crate::{Program, Separable};
use std::ops::Range;

/// Neighbouring variables that are taken together: a block of the table of coefficients.
const BLOCK: usize = 64;
/// Blocks in a small sample, then in larger ones, each of which begins with the prices of the one before.
pub(super) const SIZES: [usize; 3] = [32, 256, 2048];
/// A sample must be this many times smaller than the program to be worth its cost.
const WORTH: usize = 4;

/// A program of a few thousand of the variables, evenly spread, whose sums are enlarged to stand for all of them.
///
/// Its prices are near those of the whole program and cost next to nothing; Newton's method needs few steps from there.
pub(super) struct Sample<'a> {
    program: &'a dyn Separable,
    /// From one taken block to the next.
    stride: usize,
    factor: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> Sample<'a> {
    /// The sample of so many blocks; none where the program is too small for it.
    pub fn of(program: &'a dyn Separable, size: usize) -> Option<Self> {
        let n = program.variables();
        let blocks = n / BLOCK;
        if blocks < WORTH * size {
            return None;
        }
        let stride = blocks / size;
        let mut sample = Self { program, stride, factor: 1.0, lower: vec![], upper: vec![] };
        let count = size * BLOCK;
        sample.lower = (0..count).map(|k| program.lower()[sample.place(k)]).collect();
        sample.upper = (0..count).map(|k| program.upper()[sample.place(k)]).collect();
        sample.factor = n as f64 / count as f64;
        Some(sample)
    }

    /// The values of the sampled variables.
    pub fn pick(&self, x: &[f64]) -> Vec<f64> {
        (0..self.lower.len()).map(|k| x[self.place(k)]).collect()
    }

    /// Units of the program from those of the sample: each variable counts for many in sums, but not by itself.
    pub fn restore(&self, mut units: Units) -> Units {
        units.rows.iter_mut().chain([&mut units.objective]).for_each(|u| *u /= self.factor);
        units
    }

    /// The variable of the program that is variable `k` of the sample.
    fn place(&self, k: usize) -> usize {
        (k / BLOCK * self.stride + self.stride / 2) * BLOCK + k % BLOCK
    }
}

impl Program for Sample<'_> {
    fn variables(&self) -> usize {
        self.lower.len()
    }
    fn rows(&self) -> usize {
        self.program.rows()
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        self.program.is_equality(i)
    }
    separable::evaluate_terms!();
}

impl Separable for Sample<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.program.constant(i)
    }

    fn term(&self, i: usize, k: usize, x: f64) -> Term {
        let term = self.program.term(i, self.place(k), x);
        Term::default().plus(self.factor, term)
    }

    fn minimizer(&self, k: usize, weights: &[f64]) -> f64 {
        self.program.minimizer(self.place(k), weights)
    }

    fn dual_sums(&self, range: Range<usize>, weights: &[f64]) -> DualSums {
        let mut sums = DualSums::new(weights.len() - 1);
        let mut k = range.start;
        while k < range.end {
            let end = range.end.min((k / BLOCK + 1) * BLOCK);
            let first = self.place(k);
            sums.add(&self.program.dual_sums(first..first + end - k, weights));
            k = end;
        }
        sums.times(self.factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::separable::DiagonalQuadratic;

    #[test]
    fn a_sample_of_equal_variables_is_the_whole() {
        let n = 40_000;
        let (g, h) = ([1.0, -2.0].repeat(n), [1.0, 0.5].repeat(n));
        let program =
            DiagonalQuadratic::new(vec![0.0, 3.0], vec![0.5; n], g, h, (vec![-9.0; n], vec![9.0; n])).unwrap();
        let sample = Sample::of(&program, 32).unwrap();
        let weights = [1.0, 0.7];
        let (whole, part) = (program.dual_sums(0..n, &weights), sample.dual_sums(0..sample.variables(), &weights));
        for (a, b) in whole.values.iter().chain(&whole.bend).zip(part.values.iter().chain(&part.bend)) {
            assert!((a - b).abs() < 1e-10 * a.abs(), "{a} {b}");
        }
        assert!(sample.place(sample.variables() - 1) < n);
        let small =
            DiagonalQuadratic::new(vec![0.0], vec![0.5; 9], vec![1.0; 9], vec![1.0; 9], (vec![0.0; 9], vec![1.0; 9]));
        assert!(Sample::of(&small.unwrap(), 32).is_none());
    }
}
