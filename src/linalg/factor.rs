//! The choice between a banded and a general sparse factorization.

use super::{Banded, Sparse};
use faer::dyn_stack::MemBuffer;

/// A matrix of fixed pattern with whichever factorization is cheaper for it.
#[derive(Clone)]
pub enum Factor {
    /// Narrow band: chains, beams, single loops, and everything small.
    Banded(Banded),
    /// Wide band.
    Sparse(Box<Sparse>),
}

/// Memory of one caller that solves with a shared factorization.
pub struct SolveRoom(Option<MemBuffer>);

/// A factorization met a zero or non-finite pivot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular {
    /// Number of the unknown, as far as known.
    pub unknown: usize,
}

/// A band wider than this (rows below the diagonal) is worth a general sparse factorization.
const WIDE: usize = 40;

impl Factor {
    /// A zero matrix with the pattern `rows[i]` of columns, numbered so that the band is narrow.
    pub fn new(rows: &[Vec<usize>]) -> Self {
        let below = rows.iter().enumerate().flat_map(|(i, r)| r.iter().map(move |&j| i.saturating_sub(j))).max();
        let sparse = if below.unwrap_or(0) > WIDE { Sparse::new(rows) } else { None };
        sparse.map_or_else(|| Self::Banded(Banded::new(rows)), |s| Self::Sparse(Box::new(s)))
    }

    /// Where entry (`i`, `j`) of the pattern is in [`Factor::entries_mut`].
    pub fn slot(&self, i: usize, j: usize) -> usize {
        match self {
            Self::Banded(m) => m.slot(i, j),
            Self::Sparse(m) => m.slot(i, j),
        }
    }

    /// The entries by slot: set them to zero, add to them, and factorize.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Banded(m) => m.entries_mut(),
            Self::Sparse(m) => m.entries_mut(),
        }
    }

    /// Factorizes; a banded matrix is overwritten.
    pub fn factorize(&mut self) -> Result<(), Singular> {
        let done = match self {
            Self::Banded(m) => m.factorize(),
            Self::Sparse(m) => m.factorize(),
        };
        done.map_err(|unknown| Singular { unknown })
    }

    /// Solves A X = B in place for `W` right-hand sides; row i of B is `b[i]`.
    pub fn solve<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match self {
            Self::Banded(m) => m.solve(b),
            Self::Sparse(m) => m.solve(b),
        }
    }

    /// Memory of a caller's own for [`Factor::solve_in`].
    pub fn room(&self) -> SolveRoom {
        match self {
            Self::Banded(_) => SolveRoom(None),
            Self::Sparse(m) => SolveRoom(Some(m.room())),
        }
    }

    /// [`Factor::solve`] by several callers at the same time, each with its own `room`.
    pub fn solve_in<const W: usize>(&self, b: &mut [[f64; W]], room: &mut SolveRoom) {
        match self {
            Self::Banded(m) => m.solve(b),
            Self::Sparse(m) => m.solve_in(b, room.0.get_or_insert_with(|| m.room())),
        }
    }

    /// Solves Aᵀ X = B in place for `W` right-hand sides.
    pub fn solve_transposed<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match self {
            Self::Banded(m) => m.solve_transposed(b),
            Self::Sparse(m) => m.solve_transposed(b),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_factorizations_solve_the_same_arrow() {
        // A band with one dense last row and column: wide, so the general factorization is chosen.
        let n = 60;
        let mut rows: Vec<Vec<usize>> = (0..n).map(|i| vec![i, n - 1]).collect();
        rows[n - 1] = (0..n).collect();
        rows.iter_mut().for_each(|r| r.dedup());
        let (mut sparse, mut banded) = (Factor::new(&rows), Factor::Banded(Banded::new(&rows)));
        assert!(matches!(sparse, Factor::Sparse(_)));
        let solve = |matrix: &mut Factor| {
            for (i, row) in rows.iter().enumerate() {
                for &j in row {
                    let slot = matrix.slot(i, j);
                    matrix.entries_mut()[slot] =
                        if i == j { 3.0 + i as f64 } else { 0.5 + (i as f64 - 2.0 * j as f64).sin() };
                }
            }
            matrix.factorize().unwrap();
            let mut b: Vec<[f64; 3]> = (0..n).map(|i| [1.0, i as f64, -2.0]).collect();
            matrix.solve(&mut b);
            matrix.solve_transposed(&mut b);
            b
        };
        let (x, y) = (solve(&mut sparse), solve(&mut banded));
        for (x, y) in x.as_flattened().iter().zip(y.as_flattened()) {
            assert!((x - y).abs() < 1e-10 * (1.0 + y.abs()));
        }
    }
}
