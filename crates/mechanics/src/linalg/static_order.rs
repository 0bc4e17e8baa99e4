//! Sparse LU without interchanges, with the order and all operations determined once per pattern.

use crate::linalg::ordering::minimum_fill;
use crate::linalg::simd::{Substitute, substitute, subtract};
use std::sync::Arc;

/// A square sparse matrix of fixed pattern, factorized in an order that depends on the pattern alone.
///
/// Unknowns are eliminated in the minimum-fill order, and multipliers after the unknowns that they are coupled with. A
/// saddle-point matrix of a positive definite M and independent Φ_q then needs no interchanges. The positions that an
/// elimination reads and writes are looked up once, and factorizing is one pass over a list. A pivot that is zero, very small, or
/// a small difference of large numbers, is rejected: the caller then factorizes with interchanges.
///
/// # Sources
///
/// Duff, Erisman & Reid, *Direct Methods for Sparse Matrices*, 2nd ed. (2017), Chapters 9 and 10;
/// Vanderbei, *SIAM J. Optim.* 5 (1995) 100–113, for the order of quasidefinite matrices.
#[derive(Clone, Debug)]
pub struct StaticOrderLu {
    symbolic: Arc<SymbolicFactorization>,
    entries: Vec<f64>,
    factors: Vec<f64>,
    inverses: Vec<f64>,
}

/// Positions of all entries and operations, shared by all matrices of one pattern.
#[derive(Debug)]
struct SymbolicFactorization {
    /// Columns of each row of the matrix, increasing, and the first entry of each row.
    columns: Vec<usize>,
    starts: Vec<usize>,
    /// Position of each entry of the matrix in the factors.
    positions: Vec<u32>,
    rows: Vec<FactorRow>,
    /// Column of each factor entry: its unknown, and the number of the step that eliminates it.
    unknowns: Vec<u32>,
    steps: Vec<u32>,
    /// For each entry of L, the factor entries that it changes.
    targets: Vec<u32>,
}

/// A row of the factors: L from `first`, the diagonal at `diagonal`, U up to `end`.
#[derive(Clone, Copy, Debug)]
struct FactorRow {
    unknown: usize,
    first: usize,
    diagonal: usize,
    end: usize,
}

/// Smallest pivot, as a fraction of the sum of the absolute values of its terms; smaller ones have lost too many digits to
/// cancellation.
const CANCELLED: f64 = 1e-7;

/// Smallest pivot, as a fraction of the largest entry to its right: a sum of stiffnesses of elements may be zero except for rounding.
const SMALL: f64 = 1e-8;

impl StaticOrderLu {
    /// A zero matrix with the symmetric pattern `rows[i]` of columns (increasing, the diagonal among them), where the
    /// diagonals of `multipliers` are zero. `None` if factorizing takes more than `most` multiplications.
    pub fn new(rows: &[Vec<usize>], multipliers: &[bool], most: usize) -> Option<Self> {
        let eliminated = minimum_fill(rows, multipliers, most)?;
        let symbolic = SymbolicFactorization::new(rows, &eliminated);
        let (entries, factors) = (vec![0.0; symbolic.columns.len()], vec![0.0; symbolic.unknowns.len()]);
        let inverses = vec![0.0; rows.len()];
        Some(Self { symbolic: Arc::new(symbolic), entries, factors, inverses })
    }

    /// Number of multiplications of a factorization.
    pub fn work(&self) -> usize {
        self.symbolic.targets.len()
    }

    /// Position of the entry (`i`, `j`) of the pattern in [`StaticOrderLu::entries_mut`].
    pub fn slot(&self, i: usize, j: usize) -> usize {
        let columns = &self.symbolic.columns[self.symbolic.starts[i]..self.symbolic.starts[i + 1]];
        self.symbolic.starts[i] + columns.binary_search(&j).expect("the entry is in the pattern")
    }

    /// The entries, by slot.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// All entries with their row and column.
    pub fn entries(&self) -> impl Iterator<Item = (usize, usize, f64)> + '_ {
        let rows = self.symbolic.starts.windows(2).enumerate().flat_map(|(i, s)| (s[0]..s[1]).map(move |k| (i, k)));
        rows.map(|(i, k)| (i, self.symbolic.columns[k], self.entries[k]))
    }

    /// Factorizes and keeps the entries. The error is the unknown of a rejected pivot.
    pub fn factorize(&mut self) -> Result<(), usize> {
        let Self { symbolic, entries, factors, inverses } = self;
        factors.fill(0.0);
        for (&position, &entry) in symbolic.positions.iter().zip(&*entries) {
            factors[position as usize] = entry;
        }
        let mut targets = symbolic.targets.as_slice();
        for (step, row) in symbolic.rows.iter().enumerate() {
            let mut size = factors[row.diagonal].abs();
            for entry in row.first..row.diagonal {
                let eliminated = symbolic.steps[entry] as usize;
                let (above, factor) = (&symbolic.rows[eliminated], factors[entry] * inverses[eliminated]);
                factors[entry] = factor;
                let upper = above.diagonal + 1..above.end;
                let (own, rest) = targets.split_at(upper.len());
                targets = rest;
                for (&target, source) in own.iter().zip(upper) {
                    let change = factor * factors[source];
                    factors[target as usize] -= change;
                    if target as usize == row.diagonal {
                        size += change.abs();
                    }
                }
            }
            let pivot = factors[row.diagonal];
            let largest = factors[row.diagonal + 1..row.end].iter().fold(0.0f64, |a, x| a.max(x.abs()));
            if !(pivot.abs() > CANCELLED * size && pivot.abs() > SMALL * largest && size.is_finite()) {
                return Err(row.unknown);
            }
            inverses[step] = 1.0 / pivot;
        }
        Ok(())
    }

    /// Solves A X = B in place for `W` right-hand sides; row i of B is `b[i]`.
    pub fn solve<const W: usize>(&self, b: &mut [[f64; W]]) {
        substitute(self, b);
    }

    /// Solves Aᵀ X = B in place for `W` right-hand sides.
    pub fn solve_transposed<const W: usize>(&self, b: &mut [[f64; W]]) {
        let symbolic = &*self.symbolic;
        for (row, inverse) in symbolic.rows.iter().zip(&self.inverses) {
            let x = b[row.unknown].map(|x| x * inverse);
            b[row.unknown] = x;
            for entry in row.diagonal + 1..row.end {
                subtract(&mut b[symbolic.unknowns[entry] as usize], self.factors[entry], &x);
            }
        }
        for row in symbolic.rows.iter().rev() {
            let x = b[row.unknown];
            for entry in row.first..row.diagonal {
                subtract(&mut b[symbolic.unknowns[entry] as usize], self.factors[entry], &x);
            }
        }
    }
}

impl Substitute for StaticOrderLu {
    #[inline(always)]
    fn substitute<const W: usize>(&self, b: &mut [[f64; W]]) {
        let symbolic = &*self.symbolic;
        for row in &symbolic.rows {
            let mut x = b[row.unknown];
            for entry in row.first..row.diagonal {
                subtract(&mut x, self.factors[entry], &b[symbolic.unknowns[entry] as usize]);
            }
            b[row.unknown] = x;
        }
        for (row, inverse) in symbolic.rows.iter().zip(&self.inverses).rev() {
            let mut x = b[row.unknown];
            for entry in row.diagonal + 1..row.end {
                subtract(&mut x, self.factors[entry], &b[symbolic.unknowns[entry] as usize]);
            }
            b[row.unknown] = x.map(|x| x * inverse);
        }
    }
}

impl SymbolicFactorization {
    /// Factorization of unknowns in the order of elimination, each with those that it is coupled with when it is eliminated.
    fn new(matrix: &[Vec<usize>], eliminated: &[(usize, Vec<usize>)]) -> Self {
        let n = eliminated.len();
        let mut step_of = vec![0; n];
        eliminated.iter().enumerate().for_each(|(k, (unknown, _))| step_of[*unknown] = k);
        let mut pattern: Vec<Vec<usize>> = (0..n).map(|k| vec![k]).collect();
        for (k, (_, later)) in eliminated.iter().enumerate() {
            for &other in later {
                pattern[k].push(step_of[other]);
                pattern[step_of[other]].push(k);
            }
        }
        pattern.iter_mut().for_each(|row| row.sort_unstable());
        let (mut rows, mut steps) = (Vec::with_capacity(n), Vec::new());
        for (k, row) in pattern.iter().enumerate() {
            let first = steps.len();
            steps.extend(row.iter().map(|&column| column as u32));
            let diagonal = first + row.iter().position(|&column| column == k).expect("the diagonal is in the pattern");
            rows.push(FactorRow { unknown: eliminated[k].0, first, diagonal, end: steps.len() });
        }
        let position = |k: usize, column: usize| {
            let offset = pattern[k].binary_search(&column).expect("an elimination changes what is in the pattern");
            (rows[k].first + offset) as u32
        };
        let mut targets = Vec::new();
        for (k, row) in pattern.iter().enumerate() {
            for &above in row.iter().take_while(|&&above| above < k) {
                let later = pattern[above].iter().filter(|&&column| column > above);
                targets.extend(later.map(|&column| position(k, column)));
            }
        }
        let mut starts = vec![0];
        starts.extend(matrix.iter().scan(0, |sum, row| {
            *sum += row.len();
            Some(*sum)
        }));
        let all = |i: usize| matrix[i].iter().map(move |&j| (i, j));
        let positions = (0..n).flat_map(all).map(|(i, j)| position(step_of[i], step_of[j])).collect();
        let unknowns = steps.iter().map(|&k| eliminated[k as usize].0 as u32).collect();
        Self { columns: matrix.concat(), starts, positions, rows, unknowns, steps, targets }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Masses in a row, each pinned to the next: unknown 2k is a mass, 2k + 1 the force between k and k + 1.
    fn saddle_point(masses: usize) -> (StaticOrderLu, DMatrix<f64>) {
        let n = 2 * masses - 1;
        let rows: Vec<Vec<usize>> = (0..n).map(|i| (i.saturating_sub(1)..(i + 2).min(n)).collect()).collect();
        let late: Vec<bool> = (0..n).map(|i| i % 2 == 1).collect();
        let mut matrix = StaticOrderLu::new(&rows, &late, usize::MAX).unwrap();
        let mut dense = DMatrix::zeros(n, n);
        for (i, row) in rows.iter().enumerate() {
            for &j in row {
                let value = match (i % 2, i == j) {
                    (0, true) => 0.5 + i as f64,
                    (1, true) => 0.0,
                    _ => {
                        if j > i {
                            1.0
                        } else {
                            -1.5
                        }
                    }
                };
                let slot = matrix.slot(i, j);
                matrix.entries_mut()[slot] = value;
                dense[(i, j)] = value;
            }
        }
        (matrix, dense)
    }

    #[test]
    fn agrees_with_a_dense_factorization() {
        let (mut matrix, dense) = saddle_point(12);
        matrix.factorize().unwrap();
        assert!(matrix.entries().all(|(i, j, value)| dense[(i, j)] == value));
        let n = dense.nrows();
        let mut b: Vec<[f64; 2]> = (0..n).map(|i| [(i as f64).cos(), 1.0]).collect();
        let mut c = b.clone();
        let first = DVector::from_iterator(n, b.iter().map(|r| r[0]));
        matrix.solve(&mut b);
        matrix.solve_transposed(&mut c);
        let (x, y) = (dense.clone().lu().solve(&first).unwrap(), dense.transpose().lu().solve(&first).unwrap());
        for i in 0..n {
            assert!((b[i][0] - x[i]).abs() < 1e-12 * x.amax(), "{i}");
            assert!((c[i][0] - y[i]).abs() < 1e-12 * y.amax(), "{i}");
        }
    }

    #[test]
    fn a_chain_has_no_fill() {
        // At most four multiplications for each mass and one for each force.
        let (matrix, _) = saddle_point(100);
        assert!(matrix.work() <= 4 * 100 + 99, "{}", matrix.work());
    }

    #[test]
    fn lost_digits_and_zeros_are_rejected() {
        let mut matrix = StaticOrderLu::new(&[vec![0, 1], vec![0, 1]], &[false; 2], usize::MAX).unwrap();
        matrix.entries_mut().copy_from_slice(&[1.0, 1.0, 1.0, 1.0 + 1e-9]);
        assert_eq!(matrix.factorize(), Err(1));
        matrix.entries_mut().copy_from_slice(&[0.0, 1.0, 1.0, 0.0]);
        assert_eq!(matrix.factorize(), Err(0));
        matrix.entries_mut().copy_from_slice(&[1e-15, 1.0, 1.0, 1.0]);
        assert_eq!(matrix.factorize(), Err(0));
        matrix.entries_mut().copy_from_slice(&[2.0, 1.0, 1.0, 1.0]);
        assert_eq!(matrix.factorize(), Ok(()));
    }
}
