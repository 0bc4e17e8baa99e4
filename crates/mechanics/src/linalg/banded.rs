//! LU factorization of a band matrix with row interchanges.

use crate::linalg::simd::{Substitute, substitute, subtract};

/// A square band matrix in row-major order, and after [`Banded::factorize`] its factors L and U.
///
/// Operations stay inside the envelope of each row: rows shorter than the band cost less. Nothing is allocated after
/// [`Banded::new`].
///
/// # Sources
///
/// Golub & Van Loan, *Matrix Computations*, 4th ed., Section 4.3.3; LAPACK's `gbtf2` for keeping the
/// multipliers where they arise.
#[derive(Clone, Debug)]
pub struct Banded {
    lower: usize,
    width: usize,
    entries: Vec<f64>,
    /// Last column of each row in the pattern, and in the factors.
    last: Vec<usize>,
    filled: Vec<usize>,
    pivots: Vec<usize>,
}

/// Smallest diagonal entry used as pivot, as a fraction of the largest entry of its column.
const THRESHOLD: f64 = 0.1;

impl Banded {
    /// A zero matrix with the pattern `rows[i]` of columns (any order, at least one each).
    pub fn new(rows: &[Vec<usize>]) -> Self {
        let lower = rows.iter().enumerate().flat_map(|(i, r)| r.iter().map(move |&j| i.saturating_sub(j))).max();
        let upper = rows.iter().enumerate().flat_map(|(i, r)| r.iter().map(move |&j| j.saturating_sub(i))).max();
        let (lower, upper) = (lower.unwrap_or(0), upper.unwrap_or(0));
        let width = 2 * lower + upper + 1;
        let last: Vec<usize> =
            rows.iter().enumerate().map(|(i, r)| r.iter().copied().max().unwrap_or(i).max(i)).collect();
        let n = rows.len();
        Self { lower, width, entries: vec![0.0; n * width], filled: last.clone(), last, pivots: vec![0; n] }
    }

    /// Number of stored entries including fill, a measure of the work.
    pub fn stored(&self) -> usize {
        self.entries.len()
    }

    /// Position of the entry (`i`, `j`) of the pattern in [`Banded::entries_mut`].
    pub fn slot(&self, i: usize, j: usize) -> usize {
        self.at(i, j)
    }

    /// The entries by slot. Set them to zero and add to them before each factorization.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    #[inline]
    fn at(&self, i: usize, j: usize) -> usize {
        i * self.width + j + self.lower - i
    }

    /// Factorizes in place. The error is the number of a zero or non-finite pivot.
    pub fn factorize(&mut self) -> Result<(), usize> {
        let n = self.pivots.len();
        self.filled.copy_from_slice(&self.last);
        for k in 0..n {
            let last = (k + self.lower).min(n - 1);
            let pivot = self.choose_pivot(k, last).ok_or(k)?;
            self.pivots[k] = pivot;
            if pivot != k {
                self.interchange(k, pivot);
            }
            for i in k + 1..=last {
                self.eliminate(k, i);
            }
        }
        Ok(())
    }

    fn choose_pivot(&self, k: usize, last: usize) -> Option<usize> {
        let size = |i: usize| self.entries[self.at(i, k)].abs();
        let (mut best, mut largest) = (k, size(k));
        let diagonal = largest;
        for i in k + 1..=last {
            if size(i) > largest {
                (best, largest) = (i, size(i));
            }
        }
        if !(largest > 0.0 && largest.is_finite()) {
            return None;
        }
        Some(if diagonal >= THRESHOLD * largest { k } else { best })
    }

    fn interchange(&mut self, k: usize, p: usize) {
        let end = self.filled[k].max(self.filled[p]);
        let (a, b) = (self.at(k, k), self.at(p, k));
        let (head, tail) = self.entries.split_at_mut(b);
        head[a..=a + end - k].swap_with_slice(&mut tail[..=end - k]);
        self.filled.swap(k, p);
    }

    fn eliminate(&mut self, k: usize, i: usize) {
        let (a, b) = (self.at(k, k), self.at(i, k));
        if self.entries[b] == 0.0 {
            return;
        }
        let count = self.filled[k] - k;
        let (head, tail) = self.entries.split_at_mut(b);
        let factor = tail[0] / head[a];
        tail[0] = factor;
        for (x, y) in tail[1..=count].iter_mut().zip(&head[a + 1..=a + count]) {
            *x -= factor * y;
        }
        self.filled[i] = self.filled[i].max(self.filled[k]);
    }

    /// Solves A X = B in place for `W` right-hand sides; row i of B is `b[i]`.
    pub fn solve<const W: usize>(&self, b: &mut [[f64; W]]) {
        substitute(self, b);
    }

    /// Solves Aᵀ X = B in place for `W` right-hand sides.
    pub fn solve_transposed<const W: usize>(&self, b: &mut [[f64; W]]) {
        let n = self.pivots.len();
        for k in 0..n {
            let start = self.at(k, k);
            let inverse = 1.0 / self.entries[start];
            let row = b[k].map(|x| x * inverse);
            b[k] = row;
            for (j, &u) in (k + 1..=self.filled[k]).zip(&self.entries[start + 1..]) {
                subtract(&mut b[j], u, &row);
            }
        }
        for k in (0..n).rev() {
            let mut row = b[k];
            for i in k + 1..=(k + self.lower).min(n - 1) {
                subtract(&mut row, self.entries[self.at(i, k)], &b[i]);
            }
            b[k] = row;
            b.swap(k, self.pivots[k]);
        }
    }
}

impl Substitute for Banded {
    #[inline(always)]
    fn substitute<const W: usize>(&self, b: &mut [[f64; W]]) {
        let n = self.pivots.len();
        for k in 0..n {
            b.swap(k, self.pivots[k]);
            let row = b[k];
            for i in k + 1..=(k + self.lower).min(n - 1) {
                let factor = self.entries[self.at(i, k)];
                if factor != 0.0 {
                    subtract(&mut b[i], factor, &row);
                }
            }
        }
        for k in (0..n).rev() {
            let start = self.at(k, k);
            let mut row = b[k];
            for (y, &u) in b[k + 1..=self.filled[k]].iter().zip(&self.entries[start + 1..]) {
                if W == 1 || u != 0.0 {
                    subtract(&mut row, u, y);
                }
            }
            let inverse = 1.0 / self.entries[start];
            b[k] = row.map(|x| x * inverse);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// A saddle-point band: zero diagonal entries force interchanges.
    fn sample(n: usize) -> (Banded, DMatrix<f64>) {
        let rows: Vec<Vec<usize>> = (0..n).map(|i| (i.saturating_sub(3)..(i + 3).min(n)).collect()).collect();
        let (mut band, mut dense) = (Banded::new(&rows), DMatrix::zeros(n, n));
        for (i, row) in rows.iter().enumerate() {
            for &j in row {
                let value = if i == j && i % 3 == 2 { 0.0 } else { ((7 * i + 3 * j) as f64).sin() };
                let slot = band.slot(i, j);
                band.entries_mut()[slot] = value;
                dense[(i, j)] = value;
            }
        }
        (band, dense)
    }

    #[test]
    fn agrees_with_a_dense_factorization() {
        let (mut band, dense) = sample(23);
        band.factorize().unwrap();
        let mut b: Vec<[f64; 2]> = (0..23).map(|i| [(i as f64).cos(), 1.0]).collect();
        let mut c = b.clone();
        let first = DVector::from_iterator(23, b.iter().map(|r| r[0]));
        band.solve(&mut b);
        band.solve_transposed(&mut c);
        let x = dense.clone().lu().solve(&first).unwrap();
        let y = dense.transpose().lu().solve(&first).unwrap();
        for i in 0..23 {
            assert!((b[i][0] - x[i]).abs() < 1e-11 * x.amax(), "{i}");
            assert!((c[i][0] - y[i]).abs() < 1e-11 * y.amax(), "{i}");
        }
    }

    #[test]
    fn a_singular_matrix_names_the_pivot() {
        let mut band = Banded::new(&[vec![0, 1], vec![0, 1]]);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let slot = band.slot(i, j);
            band.entries_mut()[slot] = 1.0;
        }
        assert_eq!(band.factorize(), Err(1));
    }
}
