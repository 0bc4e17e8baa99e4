//! Linear and quadratic programs in the form of Clarabel, an interior point method with a homogeneous embedding.

use crate::QuadraticProgram;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT, ZeroConeT,
};
use error::{Error, Result};
use nalgebra::DMatrix;

/// Clarabel's result: a point with multipliers, or a certificate that no solution exists.
pub(super) struct ClarabelResult {
    pub status: SolverStatus,
    pub x: Vec<f64>,
    pub multipliers: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub iterations: usize,
}

/// The row or bound of the program behind a row of Clarabel's A x + s = b.
enum RowOrigin {
    Row(usize),
    Lower(usize),
    Upper(usize),
}

/// Solves `program` to the relative `tolerance`.
pub(super) fn solve(program: &QuadraticProgram, tolerance: f64, iterations: u32) -> Result<ClarabelResult> {
    let n = program.gradient.len();
    let sources = sources(program);
    let equalities = sources.iter().take_while(|o| matches!(o, RowOrigin::Row(i) if program.equality[*i])).count();
    let (a, b) = constraints(program, &sources);
    let p = program.hessian.as_ref().map_or_else(|| CscMatrix::zeros((n, n)), upper_triangle);
    let cones: Vec<SupportedConeT<f64>> = vec![ZeroConeT(equalities), NonnegativeConeT(sources.len() - equalities)];
    let mut solver = DefaultSolver::new(&p, &program.gradient, &a, &b, &cones, settings(tolerance, iterations))
        .map_err(|e| clarabel_error(&e, "check that the program's matrices are finite"))?;
    solver.solve();
    Ok(restored(program, &sources, &solver.solution))
}

/// The error of a program that Clarabel does not accept.
pub(crate) fn clarabel_error(e: &impl ToString, remedy: &'static str) -> Error {
    Error::Subproblem { solver: "Clarabel", status: e.to_string(), iterations: 0, remedy }
}

fn settings(tolerance: f64, iterations: u32) -> DefaultSettings<f64> {
    DefaultSettings {
        verbose: false,
        max_threads: 1,
        max_iter: iterations,
        tol_gap_abs: tolerance,
        tol_gap_rel: tolerance,
        tol_feas: tolerance,
        presolve_enable: false,
        ..DefaultSettings::default()
    }
}

/// Equality rows first, then the inequality rows, then the finite bounds.
fn sources(program: &QuadraticProgram) -> Vec<RowOrigin> {
    let (n, m) = (program.gradient.len(), program.offset.len());
    let rows = |equality| (0..m).filter(move |&i| program.equality[i] == equality).map(RowOrigin::Row);
    let lower = (0..n).filter(|&j| program.lower[j].is_finite()).map(RowOrigin::Lower);
    let upper = (0..n).filter(|&j| program.upper[j].is_finite()).map(RowOrigin::Upper);
    rows(true).chain(rows(false)).chain(lower).chain(upper).collect()
}

/// A and b, without entries that are zero.
fn constraints(program: &QuadraticProgram, sources: &[RowOrigin]) -> (CscMatrix<f64>, Vec<f64>) {
    let n = program.gradient.len();
    let mut bounds: Vec<Vec<(usize, f64)>> = vec![vec![]; n];
    let mut b = Vec::with_capacity(sources.len());
    let mut rows = vec![];
    for (k, source) in sources.iter().enumerate() {
        match *source {
            RowOrigin::Row(i) => {
                rows.push(i);
                b.push(-program.offset[i]);
            }
            RowOrigin::Lower(j) => {
                bounds[j].push((k, -1.0));
                b.push(-program.lower[j]);
            }
            RowOrigin::Upper(j) => {
                bounds[j].push((k, 1.0));
                b.push(program.upper[j]);
            }
        }
    }
    let (mut pointer, mut index, mut value) = (vec![0], vec![], vec![]);
    for (j, bounds) in bounds.iter().enumerate() {
        let column = rows.iter().enumerate().map(|(k, &i)| (k, program.rows[(i, j)])).filter(|e| e.1 != 0.0);
        for (k, v) in column.chain(bounds.iter().copied()) {
            index.push(k);
            value.push(v);
        }
        pointer.push(index.len());
    }
    (CscMatrix::new(sources.len(), n, pointer, index, value), b)
}

fn upper_triangle(h: &DMatrix<f64>) -> CscMatrix<f64> {
    let (mut pointer, mut index, mut value) = (vec![0], vec![], vec![]);
    for j in 0..h.ncols() {
        for i in (0..=j).filter(|&i| h[(i, j)] != 0.0) {
            index.push(i);
            value.push(h[(i, j)]);
        }
        pointer.push(index.len());
    }
    CscMatrix::new(h.nrows(), h.ncols(), pointer, index, value)
}

/// The result with multipliers by row and bound.
fn restored(
    program: &QuadraticProgram,
    sources: &[RowOrigin],
    s: &clarabel::solver::DefaultSolution<f64>,
) -> ClarabelResult {
    let (n, m) = (program.gradient.len(), program.offset.len());
    let mut out = ClarabelResult {
        status: s.status,
        x: s.x.clone(),
        multipliers: vec![0.0; m],
        lower: vec![0.0; n],
        upper: vec![0.0; n],
        iterations: s.iterations as usize,
    };
    for (source, &z) in sources.iter().zip(&s.z) {
        match *source {
            RowOrigin::Row(i) => out.multipliers[i] = z,
            RowOrigin::Lower(j) => out.lower[j] = z,
            RowOrigin::Upper(j) => out.upper[j] = z,
        }
    }
    out
}
