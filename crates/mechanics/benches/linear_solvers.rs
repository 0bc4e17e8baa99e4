//! Factorizations of this crate compared with faer's, for the saddle-point matrices of chains of 8 to 10 000 links.
//!
//! The matrix is that of the accelerations, \[M Φ_qᵀ; Φ_q 0\], of a chain of rigid links: five unknowns per link. Prints the
//! CPU time of factorizing and of solving per unknown, and the ratio of each time to that of `StaticOrderLu`.
//!
//! `cargo bench -p linkwright-mechanics --bench linear_solvers`

#[path = "../../../benches/cpu/mod.rs"]
mod cpu;

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::linalg::cholesky::{SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat};
use faer::{Conj, MatMut, Par, Side};
use linkwright_mechanics::linalg::{Banded, Sparse, StaticOrderLu, reverse_cuthill_mckee};

/// A symmetric matrix by rows, with its multipliers.
struct Matrix {
    rows: Vec<Vec<usize>>,
    values: Vec<Vec<f64>>,
    is_multiplier: Vec<bool>,
}

impl Matrix {
    /// Saddle-point matrix of a chain, numbered for a narrow band.
    fn chain(links: usize) -> Self {
        let (n, length) = (5 * links, 1.0 / links as f64);
        let (mut entries, mut neighbours) = (Vec::new(), vec![Vec::new(); n]);
        for k in 0..links {
            let (sin, cos) = (0.3 + 0.7 * k as f64).sin_cos();
            let lever = [-0.5 * length * sin, 0.5 * length * cos];
            for (i, mass) in [1.0, 1.0, length * length / 12.0].into_iter().enumerate() {
                entries.push((5 * k + i, 5 * k + i, mass));
            }
            // Joint k connects the link with the one before; the end of the last link is free.
            for (joint, side) in [(k, -1.0), (k + 1, 1.0)].into_iter().filter(|(joint, _)| *joint < links) {
                for axis in 0..2 {
                    let row = 5 * joint + 3 + axis;
                    entries.push((row, 5 * k + axis, side));
                    entries.push((row, 5 * k + 2, lever[axis]));
                }
            }
        }
        for &(i, j, _) in entries.iter().filter(|(i, j, _)| i != j) {
            neighbours[i].push(j);
            neighbours[j].push(i);
        }
        let order = reverse_cuthill_mckee(&neighbours);
        let mut number = vec![0; n];
        order.iter().enumerate().for_each(|(new, &old)| number[old] = new);
        let mut rows: Vec<Vec<(usize, f64)>> = vec![Vec::new(); n];
        for (i, j, value) in entries {
            let (i, j) = (number[i], number[j]);
            rows[i].push((j, value));
            if i != j {
                rows[j].push((i, value));
            }
        }
        let is_multiplier: Vec<bool> = order.iter().map(|old| old % 5 >= 3).collect();
        for (i, row) in rows.iter_mut().enumerate().filter(|(i, _)| is_multiplier[*i]) {
            row.push((i, 0.0));
        }
        rows.iter_mut().for_each(|row| row.sort_by_key(|(j, _)| *j));
        let (rows, values) = rows.into_iter().map(|row| row.into_iter().unzip()).unzip();
        Self { rows, values, is_multiplier }
    }

    /// Largest residual of A x = b with b = 1.
    fn residual(&self, x: &[[f64; 1]]) -> f64 {
        let product =
            |i: usize| self.rows[i].iter().zip(&self.values[i]).map(|(&j, value)| value * x[j][0]).sum::<f64>();
        (0..x.len()).map(|i| (product(i) - 1.0).abs()).fold(0.0, f64::max)
    }

    /// Slot and value of every entry.
    fn slots(&self, slot: impl Fn(usize, usize) -> usize) -> Vec<(usize, f64)> {
        let rows = self.rows.iter().zip(&self.values).enumerate();
        rows.flat_map(|(i, (row, values))| row.iter().zip(values).map(move |(&j, &value)| (i, j, value)))
            .map(|(i, j, value)| (slot(i, j), value))
            .collect()
    }
}

/// faer's LBLᵀ factorization in AMD order, for symmetric matrices.
struct Lblt {
    pattern: SymbolicSparseColMat<usize>,
    entries: Vec<f64>,
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    subdiagonal: Vec<f64>,
    permutation: [Vec<usize>; 2],
    memory: MemBuffer,
}

impl Lblt {
    fn new(matrix: &Matrix) -> Self {
        let n = matrix.rows.len();
        let starts = matrix.rows.iter().scan(0, |end, row| {
            *end += row.len();
            Some(*end)
        });
        let starts = std::iter::once(0).chain(starts).collect();
        let pattern = SymbolicSparseColMat::new_checked(n, n, starts, None, matrix.rows.concat());
        let symbolic =
            factorize_symbolic_cholesky(pattern.as_ref(), Side::Lower, SymmetricOrdering::Amd, Default::default())
                .expect("the pattern can be analysed");
        let factor = symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(Par::Seq, Default::default());
        let memory = MemBuffer::new(factor.or(symbolic.solve_in_place_scratch::<f64>(1, Par::Seq)));
        let (values, subdiagonal) = (vec![0.0; symbolic.len_val()], vec![0.0; n]);
        let (entries, permutation) = (matrix.values.concat(), [vec![0; n], vec![0; n]]);
        Self { pattern, entries, symbolic, values, subdiagonal, permutation, memory }
    }

    /// Factorizes, and solves A x = b in place if there is a right-hand side.
    fn factorize_and_solve(&mut self, b: Option<&mut [[f64; 1]]>) {
        let matrix = SparseColMatRef::new(self.pattern.as_ref(), &self.entries);
        let [forward, inverse] = &mut self.permutation;
        let factor = self.symbolic.factorize_numeric_intranode_lblt(
            &mut self.values,
            &mut self.subdiagonal,
            forward,
            inverse,
            matrix,
            Side::Lower,
            Par::Seq,
            MemStack::new(&mut self.memory),
            Default::default(),
        );
        if let Some(b) = b {
            let n = b.len();
            let rhs = MatMut::from_row_major_slice_mut(b.as_flattened_mut(), n, 1);
            factor.solve_in_place_with_conj(Conj::No, rhs, Par::Seq, MemStack::new(&mut self.memory));
        }
    }
}

/// Times of factorizing (with filling in the entries) and of solving, and the residual.
macro_rules! times {
    ($matrix:expr, $solver:expr) => {{
        let mut solver = $solver;
        let slots = $matrix.slots(|i, j| solver.slot(i, j));
        let mut factorize = || {
            solver.entries_mut().fill(0.0);
            let entries = solver.entries_mut();
            slots.iter().for_each(|&(slot, value)| entries[slot] += value);
            solver.factorize().expect("the matrix is regular");
        };
        let factorizing = cpu::least(3, &mut factorize);
        let mut x = vec![[1.0]; $matrix.rows.len()];
        solver.solve(&mut x);
        let residual = $matrix.residual(&x);
        let solving = cpu::least(3, || {
            x.fill([1.0]);
            solver.solve(&mut x);
        });
        (factorizing, solving, residual)
    }};
}

fn main() {
    println!("CPU time per unknown in ns (ratio to StaticOrderLu), and the largest residual of A x = 1");
    for links in [8, 30, 100, 1000, 10_000] {
        let matrix = Matrix::chain(links);
        let n = matrix.rows.len();
        println!("{links} links, {n} unknowns");
        let ours = times!(matrix, StaticOrderLu::new(&matrix.rows, &matrix.is_multiplier, usize::MAX).unwrap());
        let banded = times!(matrix, Banded::new(&matrix.rows));
        let sparse = times!(matrix, Sparse::new(&matrix.rows).unwrap());
        let mut lblt = Lblt::new(&matrix);
        let mut x = vec![[1.0]; n];
        lblt.factorize_and_solve(Some(&mut x));
        let (factorizing, both) = (
            cpu::least(3, || lblt.factorize_and_solve(None)),
            cpu::least(3, || {
                x.fill([1.0]);
                lblt.factorize_and_solve(Some(&mut x));
            }),
        );
        x.fill([1.0]);
        lblt.factorize_and_solve(Some(&mut x));
        let symmetric = (factorizing, (both - factorizing).max(0.0), matrix.residual(&x));
        let rows = [
            ("StaticOrderLu", ours),
            ("Banded", banded),
            ("faer LU, COLAMD (Sparse)", sparse),
            ("faer LBLt, AMD", symmetric),
        ];
        for (name, (factorizing, solving, residual)) in rows {
            let [f, s] = [factorizing, solving].map(|seconds| seconds / n as f64 * 1e9);
            let [rf, rs] = [factorizing / ours.0, solving / ours.1];
            println!("  {name:<26} factorize {f:8.1} ({rf:5.2})   solve {s:7.1} ({rs:5.2})   residual {residual:.1e}");
        }
    }
}
