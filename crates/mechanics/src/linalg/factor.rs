//! A matrix whose LU factorization is chosen by its pattern and its pivots.

use crate::linalg::banded::Banded;
use crate::linalg::redundancy::Redundancy;
use crate::linalg::sparse::Sparse;
use crate::linalg::static_order::StaticOrderLu;
use faer::dyn_stack::MemBuffer;
use std::sync::Arc;

/// A matrix of fixed pattern with the cheapest factorization that is stable for its entries.
///
/// Factorizes without row interchanges unless a pivot is too small. A matrix with a small pivot is factorized with row
/// interchanges (partial pivoting). After [`Factor::allow_redundancy`] constraints may depend on each other.
#[derive(Clone)]
pub struct Factor {
    factorization: Factorization,
    /// Factorization with interchanges, for matrices that need them.
    pivoting: Option<Box<Pivoting>>,
    /// True if the last matrix was factorized with interchanges because of a small pivot.
    pivoted: bool,
    /// Entries of a matrix with redundant constraints.
    redundancy: Option<Redundancy>,
}

#[derive(Clone)]
enum Factorization {
    /// Patterns with little fill: chains, beams, loops.
    StaticOrderLu(StaticOrderLu),
    /// Patterns with much fill.
    Pivoting(Pivoting),
}

/// Factorizations with interchanges.
#[derive(Clone)]
enum Pivoting {
    /// Narrow band.
    Banded(Banded),
    /// Wide band.
    Sparse(Box<Sparse>),
}

/// Memory of a caller that solves with a shared factorization.
pub struct SolveWorkspace(Option<MemBuffer>);

/// The error of a zero or non-finite pivot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Singular {
    /// Number of the unknown; the number of unknowns if it is not known which.
    pub unknown: usize,
}

/// Largest lower bandwidth for the banded factorization; above it the general sparse factorization is cheaper.
const MAX_BAND: usize = 40;

/// Largest number of multiplications per unknown for the factorization in static order.
const MAX_WORK: usize = 1000;

impl Factor {
    /// A zero matrix with the symmetric pattern `rows[i]` of columns (increasing, the diagonal among them), numbered
    /// for a narrow band. `multipliers[i]` is true for unknowns whose diagonal entry is zero.
    pub fn new(rows: &[Vec<usize>], multipliers: &[bool]) -> Self {
        let ordered = StaticOrderLu::new(rows, multipliers, MAX_WORK * rows.len());
        let factorization =
            ordered.map_or_else(|| Factorization::Pivoting(Pivoting::new(rows)), Factorization::StaticOrderLu);
        Self { factorization, pivoting: None, pivoted: false, redundancy: None }
    }

    /// From now on computes least-norm multipliers of constraints that may be redundant. `rows` and `multipliers` are those
    /// of [`Factor::new`].
    pub fn allow_redundancy(&mut self, rows: &[Vec<usize>], multipliers: &[bool]) {
        self.redundancy = Some(Redundancy::new(rows, multipliers, |i, j| self.slot(i, j)));
    }

    /// Forbids redundant constraints: a singular matrix is an error.
    pub fn forbid_redundancy(&mut self) {
        self.redundancy = None;
    }

    /// Returns whether constraints may be redundant.
    pub fn allows_redundancy(&self) -> bool {
        self.redundancy.is_some()
    }

    /// Position of the entry (`i`, `j`) of the pattern in [`Factor::entries_mut`].
    pub fn slot(&self, i: usize, j: usize) -> usize {
        match &self.factorization {
            Factorization::StaticOrderLu(m) => m.slot(i, j),
            Factorization::Pivoting(m) => m.slot(i, j),
        }
    }

    /// The entries by slot. Set them to zero, add to them, and factorize.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        match &mut self.factorization {
            Factorization::StaticOrderLu(m) => m.entries_mut(),
            Factorization::Pivoting(m) => m.entries_mut(),
        }
    }

    /// Excludes `directions` of redundant multipliers, Uᵀ λ = 0, from the solutions with matrices that are factorized from now on.
    pub(crate) fn exclude(&mut self, directions: &Arc<[Vec<f64>]>) {
        self.redundancy.iter_mut().for_each(|redundancy| redundancy.exclude(directions));
    }

    /// Orthonormal basis of the multipliers without effect in the factorized matrix, if constraints may be redundant.
    pub(crate) fn null_space(&mut self) -> Arc<[Vec<f64>]> {
        let Some(redundancy) = self.redundancy.take() else { return Arc::default() };
        let basis = redundancy.null_space(|b| self.solve_factorized(b));
        self.redundancy = Some(redundancy);
        basis
    }

    /// Factorizes; this may overwrite the entries.
    ///
    /// # Errors
    ///
    /// [`Singular`] if a pivot is zero or not finite.
    pub fn factorize(&mut self) -> Result<(), Singular> {
        let Some(mut redundancy) = self.redundancy.take() else { return self.factorize_entries() };
        redundancy.shift(self.entries_mut());
        let done = self.factorize_entries();
        if done.is_ok() {
            redundancy.prepare(|b, transposed| match transposed {
                false => self.solve_factorized(b),
                true => self.solve_factorized_transposed(b),
            });
        }
        self.redundancy = Some(redundancy);
        done
    }

    fn factorize_entries(&mut self) -> Result<(), Singular> {
        let done = match &mut self.factorization {
            Factorization::StaticOrderLu(m) => {
                self.pivoted = m.factorize().is_err();
                if !self.pivoted {
                    return Ok(());
                }
                self.pivoting.get_or_insert_with(|| Box::new(Pivoting::like(m))).factorize_copy(m)
            }
            Factorization::Pivoting(m) => m.factorize(),
        };
        done.map_err(|unknown| Singular { unknown })
    }

    /// Returns whether the last matrix was factorized with interchanges.
    pub fn has_interchanges(&self) -> bool {
        self.pivoted || matches!(self.factorization, Factorization::Pivoting(_))
    }

    /// Solves A X = B in place for `W` right-hand sides; row i of B is `b[i]`.
    pub fn solve<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match self.redundancy.take() {
            Some(redundancy) => {
                redundancy.correct(b, false, |b| self.solve_factorized(b));
                self.redundancy = Some(redundancy);
            }
            None => self.solve_factorized(b),
        }
    }

    fn solve_factorized<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match (&mut self.factorization, &mut self.pivoting) {
            (Factorization::StaticOrderLu(_), Some(m)) if self.pivoted => m.solve(b),
            (Factorization::StaticOrderLu(m), _) => m.solve(b),
            (Factorization::Pivoting(m), _) => m.solve(b),
        }
    }

    /// Memory for [`Factor::solve_in`].
    pub fn workspace(&self) -> SolveWorkspace {
        match &self.factorization {
            Factorization::Pivoting(Pivoting::Sparse(m)) => SolveWorkspace(Some(m.workspace())),
            _ => SolveWorkspace(None),
        }
    }

    /// [`Factor::solve`] for concurrent callers, each with its own `workspace`.
    pub fn solve_in<const W: usize>(&self, b: &mut [[f64; W]], workspace: &mut SolveWorkspace) {
        match &self.redundancy {
            Some(redundancy) => redundancy.correct(b, false, |b| self.solve_factorized_in(b, workspace)),
            None => self.solve_factorized_in(b, workspace),
        }
    }

    fn solve_factorized_in<const W: usize>(&self, b: &mut [[f64; W]], workspace: &mut SolveWorkspace) {
        let pivoting = match (&self.factorization, &self.pivoting) {
            (Factorization::StaticOrderLu(_), Some(m)) if self.pivoted => &**m,
            (Factorization::StaticOrderLu(m), _) => return m.solve(b),
            (Factorization::Pivoting(m), _) => m,
        };
        match pivoting {
            Pivoting::Banded(m) => m.solve(b),
            Pivoting::Sparse(m) => m.solve_in(b, workspace.0.get_or_insert_with(|| m.workspace())),
        }
    }

    /// Solves Aᵀ X = B in place for `W` right-hand sides.
    pub fn solve_transposed<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match self.redundancy.take() {
            Some(redundancy) => {
                redundancy.correct(b, true, |b| self.solve_factorized_transposed(b));
                self.redundancy = Some(redundancy);
            }
            None => self.solve_factorized_transposed(b),
        }
    }

    fn solve_factorized_transposed<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match (&mut self.factorization, &mut self.pivoting) {
            (Factorization::StaticOrderLu(_), Some(m)) if self.pivoted => m.solve_transposed(b),
            (Factorization::StaticOrderLu(m), _) => m.solve_transposed(b),
            (Factorization::Pivoting(m), _) => m.solve_transposed(b),
        }
    }
}

impl Pivoting {
    /// A zero matrix with the pattern `rows`: banded, or sparse if the band is wide.
    fn new(rows: &[Vec<usize>]) -> Self {
        let below = rows.iter().enumerate().flat_map(|(i, r)| r.iter().map(move |&j| i.saturating_sub(j))).max();
        let sparse = if below.unwrap_or(0) > MAX_BAND { Sparse::new(rows) } else { None };
        sparse.map_or_else(|| Self::Banded(Banded::new(rows)), |s| Self::Sparse(Box::new(s)))
    }

    /// A zero matrix with the pattern of `matrix`.
    fn like(matrix: &StaticOrderLu) -> Self {
        let mut rows = Vec::new();
        for (i, j, _) in matrix.entries() {
            rows.resize(i + 1, Vec::new());
            rows[i].push(j);
        }
        Self::new(&rows)
    }

    /// Copies the entries of `matrix`, which has the same pattern, and factorizes.
    fn factorize_copy(&mut self, matrix: &StaticOrderLu) -> Result<(), usize> {
        self.entries_mut().fill(0.0);
        for (i, j, value) in matrix.entries() {
            let slot = self.slot(i, j);
            self.entries_mut()[slot] = value;
        }
        self.factorize()
    }

    fn slot(&self, i: usize, j: usize) -> usize {
        match self {
            Self::Banded(m) => m.slot(i, j),
            Self::Sparse(m) => m.slot(i, j),
        }
    }

    fn entries_mut(&mut self) -> &mut [f64] {
        match self {
            Self::Banded(m) => m.entries_mut(),
            Self::Sparse(m) => m.entries_mut(),
        }
    }

    fn factorize(&mut self) -> Result<(), usize> {
        match self {
            Self::Banded(m) => m.factorize(),
            Self::Sparse(m) => m.factorize(),
        }
    }

    fn solve<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match self {
            Self::Banded(m) => m.solve(b),
            Self::Sparse(m) => m.solve(b),
        }
    }

    fn solve_transposed<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        match self {
            Self::Banded(m) => m.solve_transposed(b),
            Self::Sparse(m) => m.solve_transposed(b),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A band with one dense last row and column, and then one without a diagonal.
    #[test]
    fn all_factorizations_solve_the_same_arrowhead_matrix() {
        let n = 60;
        let mut rows: Vec<Vec<usize>> = (0..n).map(|i| vec![i, n - 1]).collect();
        rows[n - 1] = (0..n).collect();
        rows.iter_mut().for_each(|r| r.dedup());
        let pivoting = |matrix| Factor {
            factorization: Factorization::Pivoting(matrix),
            pivoting: None,
            pivoted: false,
            redundancy: None,
        };
        let mut ordered = Factor::new(&rows, &vec![false; n]);
        let mut sparse = pivoting(Pivoting::new(&rows));
        let mut banded = pivoting(Pivoting::Banded(Banded::new(&rows)));
        assert!(
            matches!(ordered.factorization, Factorization::StaticOrderLu(_))
                && matches!(sparse.factorization, Factorization::Pivoting(Pivoting::Sparse(_)))
        );
        let solve = |matrix: &mut Factor, diagonal: f64| {
            matrix.entries_mut().fill(0.0);
            for (i, row) in rows.iter().enumerate() {
                for &j in row {
                    let slot = matrix.slot(i, j);
                    let value = if i == j { 3.0 + i as f64 } else { 0.5 + (i as f64 - 2.0 * j as f64).sin() };
                    matrix.entries_mut()[slot] = if i == 0 && j == 0 { diagonal } else { value };
                }
            }
            matrix.factorize().unwrap();
            let mut b: Vec<[f64; 3]> = (0..n).map(|i| [1.0, i as f64, -2.0]).collect();
            matrix.solve(&mut b);
            matrix.solve_transposed(&mut b);
            b
        };
        for diagonal in [3.0, 0.0] {
            let reference = solve(&mut banded, diagonal);
            for other in [&mut ordered, &mut sparse] {
                let computed = solve(other, diagonal);
                for (x, y) in computed.as_flattened().iter().zip(reference.as_flattened()) {
                    assert!((x - y).abs() < 1e-10 * (1.0 + y.abs()));
                }
            }
            assert_eq!(ordered.has_interchanges(), diagonal == 0.0);
        }
    }
}
