//! Tables of coefficients of many functions in many variables, stored in blocks for fast sums over the variables.

use std::ops::Range;

/// Variables per block: the coefficients of some tens of functions then fit into the L1 cache.
pub(super) const BLOCK: usize = 64;

/// A table of coefficients: blocks of [`BLOCK`] variables, each stored function by function.
///
/// Sums over variables run over contiguous numbers for each function. The last block may be narrower.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Blocks {
    functions: usize,
    variables: usize,
    values: Vec<f64>,
}

impl Blocks {
    /// Stores the entries (i, j), given at j · functions + i.
    pub fn new(functions: usize, variables: usize, by_variable: &[f64]) -> Self {
        let mut values = Vec::with_capacity(by_variable.len());
        for block in by_variable.chunks((BLOCK * functions).max(1)) {
            for i in 0..functions {
                values.extend(block[i..].iter().step_by(functions));
            }
        }
        Self { functions, variables, values }
    }

    /// Start and width of the block of variable `j`.
    fn block(&self, j: usize) -> (usize, usize) {
        let first = j - j % BLOCK;
        (first * self.functions, BLOCK.min(self.variables - first))
    }

    /// The entry of function `i` and variable `j`.
    #[inline]
    pub fn at(&self, i: usize, j: usize) -> f64 {
        let (start, width) = self.block(j);
        self.values[start + i * width + j % BLOCK]
    }

    /// The entries of all functions for variable `j`, in order.
    #[inline]
    pub fn of_variable(&self, j: usize) -> impl Iterator<Item = &f64> {
        let (start, width) = self.block(j);
        self.values[start + j % BLOCK..start + width * self.functions].iter().step_by(width)
    }

    /// The entries of function `i` for `variables`, which lie in one block.
    #[inline]
    pub fn of_function(&self, i: usize, variables: &Range<usize>) -> &[f64] {
        let (start, width) = self.block(variables.start);
        let from = start + i * width + variables.start % BLOCK;
        &self.values[from..from + variables.len()]
    }
}

/// Splits `range` at the boundaries of blocks.
pub(super) fn parts(range: Range<usize>) -> impl Iterator<Item = Range<usize>> {
    let first = range.start / BLOCK;
    (first..range.end.div_ceil(BLOCK)).map(move |b| range.start.max(b * BLOCK)..range.end.min((b + 1) * BLOCK))
}

/// Σ aⱼ bⱼ in four partial sums, in a fixed order of additions that SIMD instructions can execute.
#[inline]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut lanes = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for k in 0..4 {
            lanes[k] += a[k] * b[k];
        }
    }
    let rest: f64 = a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum();
    (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]) + rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_stored_and_returned() {
        for (functions, variables) in [(1, 1), (3, 64), (2, 130), (5, 63)] {
            let entries: Vec<f64> = (0..functions * variables).map(|k| k as f64).collect();
            let table = Blocks::new(functions, variables, &entries);
            for j in 0..variables {
                assert!(table.of_variable(j).eq(&entries[j * functions..(j + 1) * functions]));
                assert!((0..functions).all(|i| table.at(i, j) == entries[j * functions + i]));
            }
            for part in parts(0..variables) {
                for i in 0..functions {
                    let row = table.of_function(i, &part);
                    assert!(part.clone().zip(row).all(|(j, v)| *v == entries[j * functions + i]));
                }
            }
        }
        assert!(parts(60..130).eq([60..64, 64..128, 128..130]));
    }

    #[test]
    fn dot_product_of_partial_sums() {
        let v: Vec<f64> = (1..=11).map(f64::from).collect();
        assert_eq!(dot(&v, &v), 506.0);
    }
}
