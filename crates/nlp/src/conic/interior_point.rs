//! Clarabel's homogeneous interior point method on a scaled program.

use crate::QuadraticProgram;
use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, SupportedConeT, ZeroConeT,
};
use error::{Error, Result};
use nalgebra::DMatrix;

/// What the interior point method found: a point, or a certificate that there is none.
pub(super) struct Interior {
    pub status: SolverStatus,
    pub x: Vec<f64>,
    pub multipliers: Vec<f64>,
    pub lower: Vec<f64>,
    pub upper: Vec<f64>,
    pub iterations: usize,
}

/// One row of Clarabel's A x + s = b and where it comes from.
enum Origin {
    Row(usize),
    Lower(usize),
    Upper(usize),
}

/// Solves `program` to the relative `tolerance`.
pub(super) fn solve(program: &QuadraticProgram, tolerance: f64, iterations: u32) -> Result<Interior> {
    let n = program.gradient.len();
    let origins = order(program);
    let equalities = origins.iter().take_while(|o| matches!(o, Origin::Row(i) if program.equality[*i])).count();
    let (a, b) = constraints(program, &origins);
    let p = program.hessian.as_ref().map_or_else(|| CscMatrix::zeros((n, n)), upper_triangle);
    let cones: Vec<SupportedConeT<f64>> = vec![ZeroConeT(equalities), NonnegativeConeT(origins.len() - equalities)];
    let mut solver = DefaultSolver::new(&p, &program.gradient, &a, &b, &cones, settings(tolerance, iterations))
        .map_err(|e| Error::Subproblem {
            solver: "Clarabel",
            status: e.to_string(),
            iterations: 0,
            remedy: "check that the program's matrices are finite",
        })?;
    solver.solve();
    Ok(sorted(program, &origins, &solver.solution))
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
fn order(program: &QuadraticProgram) -> Vec<Origin> {
    let (n, m) = (program.gradient.len(), program.offset.len());
    let rows = |equality| (0..m).filter(move |&i| program.equality[i] == equality).map(Origin::Row);
    let lower = (0..n).filter(|&j| program.lower[j].is_finite()).map(Origin::Lower);
    let upper = (0..n).filter(|&j| program.upper[j].is_finite()).map(Origin::Upper);
    rows(true).chain(rows(false)).chain(lower).chain(upper).collect()
}

/// A and b, column by column without the zeros.
fn constraints(program: &QuadraticProgram, origins: &[Origin]) -> (CscMatrix<f64>, Vec<f64>) {
    let n = program.gradient.len();
    let mut bounds: Vec<Vec<(usize, f64)>> = vec![vec![]; n];
    let mut b = Vec::with_capacity(origins.len());
    let mut rows = vec![];
    for (k, origin) in origins.iter().enumerate() {
        match *origin {
            Origin::Row(i) => {
                rows.push(i);
                b.push(-program.offset[i]);
            }
            Origin::Lower(j) => {
                bounds[j].push((k, -1.0));
                b.push(-program.lower[j]);
            }
            Origin::Upper(j) => {
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
    (CscMatrix::new(origins.len(), n, pointer, index, value), b)
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

fn sorted(program: &QuadraticProgram, origins: &[Origin], s: &clarabel::solver::DefaultSolution<f64>) -> Interior {
    let (n, m) = (program.gradient.len(), program.offset.len());
    let mut out = Interior {
        status: s.status,
        x: s.x.clone(),
        multipliers: vec![0.0; m],
        lower: vec![0.0; n],
        upper: vec![0.0; n],
        iterations: s.iterations as usize,
    };
    for (origin, &z) in origins.iter().zip(&s.z) {
        match *origin {
            Origin::Row(i) => out.multipliers[i] = z,
            Origin::Lower(j) => out.lower[j] = z,
            Origin::Upper(j) => out.upper[j] = z,
        }
    }
    out
}
