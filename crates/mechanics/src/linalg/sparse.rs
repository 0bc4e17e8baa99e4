//! General sparse LU by faer, with one symbolic factorization per pattern.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::lu::{LuRef, NumericLu, SymbolicLu, factorize_symbolic_lu};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par};

/// A square sparse matrix of fixed pattern and its factorization with partial pivoting in COLAMD order.
///
/// Used for wide bands: several coupled loops, dense force elements. Memory is allocated once and then reused.
pub struct Sparse {
    pattern: SymbolicSparseColMat<usize>,
    entries: Vec<f64>,
    symbolic: SymbolicLu<usize>,
    numeric: NumericLu<usize, f64>,
    memory: MemBuffer,
    n: usize,
}

/// Largest number of right-hand sides in one solve.
const MOST_COLUMNS: usize = 16;

impl Sparse {
    /// A zero matrix with the pattern `rows[i]` of columns; `None` if faer cannot analyse it.
    pub fn new(rows: &[Vec<usize>]) -> Option<Self> {
        let n = rows.len();
        let mut columns = vec![Vec::new(); n];
        rows.iter().enumerate().for_each(|(i, row)| row.iter().for_each(|&j| columns[j].push(i)));
        let (mut starts, mut indices) = (vec![0], Vec::new());
        for column in &mut columns {
            column.dedup();
            indices.extend_from_slice(column);
            starts.push(indices.len());
        }
        let entries = vec![0.0; indices.len()];
        let pattern = SymbolicSparseColMat::new_checked(n, n, starts, None, indices);
        let symbolic = factorize_symbolic_lu(pattern.as_ref(), Default::default()).ok()?;
        let memory = workspace_for(&symbolic);
        Some(Self { pattern, entries, symbolic, numeric: NumericLu::new(), memory, n })
    }

    /// Number of stored entries of the matrix.
    pub fn stored(&self) -> usize {
        self.entries.len()
    }

    /// Position of the entry (`i`, `j`) of the pattern in [`Sparse::entries_mut`].
    pub fn slot(&self, i: usize, j: usize) -> usize {
        let pattern = self.pattern.as_ref();
        let column = pattern.col_range(j);
        let rows = &pattern.row_idx()[column.clone()];
        column.start + rows.binary_search(&i).expect("the entry is in the pattern")
    }

    /// The entries, by slot.
    pub fn entries_mut(&mut self) -> &mut [f64] {
        &mut self.entries
    }

    /// Factorizes and keeps the entries. The error is the number of a column, or n if it is not known which.
    pub fn factorize(&mut self) -> Result<(), usize> {
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &self.entries);
        let stack = MemStack::new(&mut self.memory);
        let done = self.symbolic.factorize_numeric_lu(&mut self.numeric, matrix, Par::Seq, stack, Default::default());
        done.map(drop).map_err(|error| match error {
            faer::sparse::linalg::LuError::SymbolicSingular { index } => index,
            _ => self.n,
        })
    }

    /// Solves A X = B in place; row i of B is `b[i]`, at most 16 columns.
    pub fn solve<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        let rhs = MatMut::from_row_major_slice_mut(b.as_flattened_mut(), self.n, W);
        let lu = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        lu.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.memory));
    }

    /// [`Sparse::solve`] for concurrent callers, each with its own `memory`.
    pub fn solve_in<const W: usize>(&self, b: &mut [[f64; W]], memory: &mut MemBuffer) {
        let rhs = MatMut::from_row_major_slice_mut(b.as_flattened_mut(), self.n, W);
        let lu = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        lu.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(memory));
    }

    /// Memory for [`Sparse::solve_in`].
    pub fn workspace(&self) -> MemBuffer {
        workspace_for(&self.symbolic)
    }

    /// Solves Aᵀ X = B in place.
    pub fn solve_transposed<const W: usize>(&mut self, b: &mut [[f64; W]]) {
        let rhs = MatMut::from_row_major_slice_mut(b.as_flattened_mut(), self.n, W);
        let lu = LuRef::new_unchecked(&self.symbolic, &self.numeric);
        lu.solve_transpose_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.memory));
    }
}

/// Memory for factorizing and solving.
fn workspace_for(symbolic: &SymbolicLu<usize>) -> MemBuffer {
    let factor = symbolic.factorize_numeric_lu_scratch::<f64>(Par::Seq, Default::default());
    let solve = symbolic.solve_in_place_scratch::<f64>(MOST_COLUMNS, Par::Seq);
    let transposed = symbolic.solve_transpose_in_place_scratch::<f64>(MOST_COLUMNS, Par::Seq);
    MemBuffer::new(factor.or(solve).or(transposed))
}

impl Clone for Sparse {
    fn clone(&self) -> Self {
        Self {
            pattern: self.pattern.clone(),
            entries: self.entries.clone(),
            symbolic: self.symbolic.clone(),
            numeric: self.numeric.clone(),
            memory: self.workspace(),
            n: self.n,
        }
    }
}
