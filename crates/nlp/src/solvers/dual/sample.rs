//! Units and initial multipliers of the dual solver, from all variables or from a sample of them.

use crate::kkt::{positive_or_one, variable_scale};
use crate::program::{DualSums, Program, Separable, Term, bounds_from_fields};
use crate::separable::{self, CHUNK};
use rayon::prelude::*;
use std::ops::Range;

/// Number of neighbouring variables that are sampled together: a block of the table of coefficients.
const SAMPLED_BLOCK: usize = 64;
/// Number of blocks in each sample. Each sample starts from the multipliers of the previous one.
pub(super) const SIZES: [usize; 3] = [32, 256, 2048];
/// Smallest ratio of the sizes of program and sample; below it the sample costs more than it saves.
const SMALLEST_RATIO: usize = 4;

/// A program with an evenly spread sample of the variables, whose sums are scaled up to the size of the whole program.
///
/// Its multipliers approximate those of the whole program, so that Newton's method needs few steps from there.
pub(super) struct SampledProgram<'a> {
    program: &'a dyn Separable,
    /// Distance between sampled blocks.
    stride: usize,
    factor: f64,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl<'a> SampledProgram<'a> {
    /// The sample of `size` blocks; `None` if the program is too small for it.
    pub fn new(program: &'a dyn Separable, size: usize) -> Option<Self> {
        let n = program.variables();
        let blocks = n / SAMPLED_BLOCK;
        if blocks < SMALLEST_RATIO * size {
            return None;
        }
        let stride = blocks / size;
        let mut sample = Self { program, stride, factor: 1.0, lower: vec![], upper: vec![] };
        let count = size * SAMPLED_BLOCK;
        sample.lower = (0..count).map(|k| program.lower()[sample.source(k)]).collect();
        sample.upper = (0..count).map(|k| program.upper()[sample.source(k)]).collect();
        sample.factor = n as f64 / count as f64;
        Some(sample)
    }

    /// The values of the sampled variables.
    pub fn pick(&self, x: &[f64]) -> Vec<f64> {
        (0..self.lower.len()).map(|k| x[self.source(k)]).collect()
    }

    /// Converts units of the sample to units of the program: divides by the factor that scales up the sums.
    pub fn units_of_program(&self, mut units: DualStart) -> DualStart {
        units.rows.iter_mut().chain([&mut units.objective]).for_each(|u| *u /= self.factor);
        units
    }

    /// The variable of the program that is variable `k` of the sample.
    fn source(&self, k: usize) -> usize {
        (k / SAMPLED_BLOCK * self.stride + self.stride / 2) * SAMPLED_BLOCK + k % SAMPLED_BLOCK
    }
}

impl Program for SampledProgram<'_> {
    bounds_from_fields!();
    fn rows(&self) -> usize {
        self.program.rows()
    }
    fn is_equality(&self, i: usize) -> bool {
        self.program.is_equality(i)
    }
    separable::evaluate_terms!();
}

impl Separable for SampledProgram<'_> {
    fn constant(&self, i: usize) -> f64 {
        self.program.constant(i)
    }

    fn term(&self, i: usize, k: usize, x: f64) -> Term {
        let term = self.program.term(i, self.source(k), x);
        Term::default().plus(self.factor, term)
    }

    fn minimizer(&self, k: usize, weights: &[f64]) -> f64 {
        self.program.minimizer(self.source(k), weights)
    }

    fn dual_sums(&self, range: Range<usize>, weights: &[f64]) -> DualSums {
        let mut sums = DualSums::new(weights.len() - 1);
        let mut k = range.start;
        while k < range.end {
            let end = range.end.min((k / SAMPLED_BLOCK + 1) * SAMPLED_BLOCK);
            let first = self.source(k);
            sums.add(&self.program.dual_sums(first..first + end - k, weights));
            k = end;
        }
        sums.times(self.factor)
    }
}

/// Initial multipliers, and units of objective and rows: their largest change when one variable changes by its scale, at
/// the start point.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct DualStart {
    /// The largest change of each row by one variable; one for a row of zeros.
    pub rows: Vec<f64>,
    /// The largest change of the objective by one variable; one if it is constant.
    pub objective: f64,
    /// Initial multipliers: for each row, the sum of the changes of the objective divided by that of the row and by
    /// the number of rows. Most minimizers are then between their bounds.
    pub multipliers: Vec<f64>,
}

/// Largest change, sum of changes and value of each function, the objective first.
struct FunctionChanges {
    largest: Vec<f64>,
    sums: Vec<f64>,
    values: Vec<f64>,
    finite: bool,
}

impl DualStart {
    /// The units at `start`, which is within the bounds; `None` if the program is not finite there.
    pub fn at(program: &dyn Separable, start: &[f64]) -> Option<Self> {
        let chunks: Vec<FunctionChanges> =
            start.par_chunks(CHUNK).enumerate().map(|(c, part)| changes(program, c * CHUNK, part)).collect();
        let functions = program.rows() + 1;
        let mut all = FunctionChanges::new(functions);
        for chunk in &chunks {
            all.largest.iter_mut().zip(&chunk.largest).for_each(|(a, b)| *a = a.max(*b));
            all.sums.iter_mut().zip(&chunk.sums).for_each(|(a, b)| *a += b);
            all.values.iter_mut().zip(&chunk.values).for_each(|(a, b)| *a += b);
            all.finite &= chunk.finite;
        }
        let values = all.values.iter().enumerate().map(|(i, v)| program.constant(i) + v);
        if !all.finite || values.into_iter().any(|v| !v.is_finite()) {
            return None;
        }
        let rows = functions - 1;
        let multiplier = |i: usize| match program.is_equality(i) || all.sums[i + 1] == 0.0 {
            true => 0.0,
            false => all.sums[0] / all.sums[i + 1] / rows as f64,
        };
        Some(Self {
            rows: all.largest[1..].iter().map(|v| positive_or_one(*v)).collect(),
            objective: positive_or_one(all.largest[0]),
            multipliers: (0..rows).map(multiplier).collect(),
        })
    }
}

impl FunctionChanges {
    fn new(functions: usize) -> Self {
        let zeros = || vec![0.0; functions];
        Self { largest: zeros(), sums: zeros(), values: zeros(), finite: true }
    }
}

/// Returns the changes of the functions when each variable from `first` on changes by its scale.
fn changes(program: &dyn Separable, first: usize, start: &[f64]) -> FunctionChanges {
    let functions = program.rows() + 1;
    let mut all = FunctionChanges::new(functions);
    let (mut values, mut slopes) = (vec![0.0; functions], vec![0.0; functions]);
    let (lower, upper) = (program.lower(), program.upper());
    for (k, &x) in start.iter().enumerate() {
        let j = first + k;
        program.column(j, x, &mut values, &mut slopes);
        let scale = variable_scale(lower[j], upper[j], x, x);
        for i in 0..functions {
            let change = (scale * slopes[i]).abs();
            all.largest[i] = all.largest[i].max(change);
            all.sums[i] += change;
            all.values[i] += values[i];
        }
    }
    all.finite = all.sums.iter().chain(&all.values).all(|v| v.is_finite());
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::separable::DiagonalQuadraticProgram;

    #[test]
    fn sums_of_a_sample_of_equal_variables_equal_those_of_the_program() {
        let n = 40_000;
        let (g, h) = ([1.0, -2.0].repeat(n), [1.0, 0.5].repeat(n));
        let program =
            DiagonalQuadraticProgram::new(vec![0.0, 3.0], vec![0.5; n], g, h, (vec![-9.0; n], vec![9.0; n])).unwrap();
        let sample = SampledProgram::new(&program, 32).unwrap();
        let weights = [1.0, 0.7];
        let (whole, part) = (program.dual_sums(0..n, &weights), sample.dual_sums(0..sample.variables(), &weights));
        for (a, b) in
            whole.values.iter().chain(&whole.negative_hessian).zip(part.values.iter().chain(&part.negative_hessian))
        {
            assert!((a - b).abs() < 1e-10 * a.abs(), "{a} {b}");
        }
        assert!(sample.source(sample.variables() - 1) < n);
        let small = DiagonalQuadraticProgram::new(
            vec![0.0],
            vec![0.5; 9],
            vec![1.0; 9],
            vec![1.0; 9],
            (vec![0.0; 9], vec![1.0; 9]),
        );
        assert!(SampledProgram::new(&small.unwrap(), 32).is_none());
    }
}
