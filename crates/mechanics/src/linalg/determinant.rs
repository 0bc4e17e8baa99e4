//! Sign of the determinant of a sparse matrix.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Elimination of a square matrix row by row, of which only the sign of the determinant is kept. Storage is used again.
///
/// The determinant itself overflows for some hundred rows. The pivot of a row is its largest entry (partial pivoting by columns), so that rows stay sparse
/// where they are coupled to few others, as in a chain of bodies.
#[derive(Clone, Debug, Default)]
pub(crate) struct DeterminantSign {
    eliminated: Vec<EliminatedRow>,
    /// For each column, the row of which it is the pivot column.
    pivot_of: Vec<Option<usize>>,
    /// The current row with its columns that are not zero.
    row: Vec<f64>,
    is_used: Vec<bool>,
    columns: Vec<usize>,
    /// Rows that are still to be subtracted from the current one.
    pending: BinaryHeap<Reverse<usize>>,
}

/// A row from which the rows before it are subtracted.
#[derive(Clone, Debug, Default)]
struct EliminatedRow {
    column: usize,
    pivot: f64,
    /// The other entries, as (column, value).
    others: Vec<(usize, f64)>,
}

impl DeterminantSign {
    /// Returns whether the determinant is positive, for `rows` of (column, value); entries of one column are added up. `None` if it is zero.
    pub fn is_positive(&mut self, rows: &[Vec<(usize, f64)>]) -> Option<bool> {
        let n = rows.len();
        self.pivot_of.clear();
        self.pivot_of.resize(n, None);
        self.row.resize(n, 0.0);
        self.is_used.resize(n, false);
        self.eliminated.resize(n, EliminatedRow::default());
        let is_regular = rows.iter().enumerate().all(|(r, row)| self.eliminate(r, row));
        is_regular.then(|| {
            let negative = self.eliminated.iter().filter(|row| row.pivot < 0.0).count();
            (negative + self.exchanges()).is_multiple_of(2)
        })
    }

    /// Subtracts the rows before row `r` from it. Returns whether a pivot is left.
    fn eliminate(&mut self, r: usize, row: &[(usize, f64)]) -> bool {
        row.iter().for_each(|&(column, value)| self.add(column, value));
        while let Some(Reverse(before)) = self.pending.pop() {
            let earlier = std::mem::take(&mut self.eliminated[before]);
            let factor = std::mem::take(&mut self.row[earlier.column]) / earlier.pivot;
            if factor != 0.0 {
                earlier.others.iter().for_each(|&(column, value)| self.add(column, -factor * value));
            }
            self.eliminated[before] = earlier;
        }
        let (mut best, mut pivot) = (0, 0.0f64);
        for &column in &self.columns {
            if self.row[column].abs() > pivot.abs() {
                (best, pivot) = (column, self.row[column]);
            }
        }
        let (mut columns, row) = (std::mem::take(&mut self.columns), &mut self.row);
        let eliminated = &mut self.eliminated[r];
        (eliminated.column, eliminated.pivot) = (best, pivot);
        eliminated.others.clear();
        for column in columns.drain(..) {
            self.is_used[column] = false;
            let value = std::mem::take(&mut row[column]);
            if column != best && value != 0.0 {
                eliminated.others.push((column, value));
            }
        }
        self.columns = columns;
        if pivot != 0.0 {
            self.pivot_of[best] = Some(r);
        }
        pivot != 0.0
    }

    /// Adds `value` to a column of the current row.
    fn add(&mut self, column: usize, value: f64) {
        self.row[column] += value;
        if !std::mem::replace(&mut self.is_used[column], true) {
            self.columns.push(column);
            self.pending.extend(self.pivot_of[column].map(Reverse));
        }
    }

    /// Number of exchanges that put the pivots on the diagonal.
    fn exchanges(&self) -> usize {
        let (mut is_seen, mut exchanges) = (vec![false; self.eliminated.len()], 0);
        for first in 0..is_seen.len() {
            let mut next = first;
            while !std::mem::replace(&mut is_seen[next], true) {
                next = self.eliminated[next].column;
                exchanges += usize::from(next != first);
            }
        }
        exchanges
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::DMatrix;

    #[test]
    fn has_the_sign_of_a_dense_determinant() {
        let mut sign = DeterminantSign::default();
        let mut seed = 1u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let mut regular = [0, 0];
        for case in 0..2000 {
            let n = case % 9;
            let rows: Vec<Vec<(usize, f64)>> = (0..n)
                .map(|_| (0..4).map(|_| ((random() * n as f64) as usize, (random() * 10.0).round() - 5.0)).collect())
                .collect();
            let mut dense = DMatrix::<f64>::zeros(n, n);
            rows.iter().enumerate().for_each(|(r, row)| row.iter().for_each(|&(c, value)| dense[(r, c)] += value));
            let determinant = dense.determinant();
            if determinant.abs() > 1e-9 {
                let is_positive = sign.is_positive(&rows);
                assert_eq!(is_positive, Some(determinant > 0.0), "{dense}");
                regular[usize::from(determinant > 0.0)] += 1;
            }
        }
        assert!(regular[0] > 300 && regular[1] > 300, "{regular:?}");
    }

    #[test]
    fn of_a_row_of_zeros_is_unknown() {
        assert_eq!(DeterminantSign::default().is_positive(&[vec![(0, 1.0)], vec![(0, 2.0), (1, 0.0)]]), None);
    }
}
