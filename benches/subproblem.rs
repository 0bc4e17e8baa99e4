//! Subproblem times: 3 variables with 10, 1 000 and 10 000 rows; how long until a proposal of a new design.

use divan::{Bencher, black_box};
use linkwright::subproblem::{Conic, QuadraticProgram, SubproblemSolver};
use nalgebra::DMatrix;

fn main() {
    divan::main();
}

/// Tangents of the unit sphere at spiral points: about three rows are active, nearly all are close to active.
fn sphere(rows: usize) -> QuadraticProgram {
    let mut program = QuadraticProgram::new(vec![-1.0, -0.7, -0.2]).bounds(vec![-2.0; 3], vec![2.0; 3]);
    program.rows = DMatrix::from_fn(rows, 3, |i, j| {
        let z = (2.0 * i as f64 + 1.0) / rows as f64 - 1.0;
        let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
        let r = (1.0 - z * z).sqrt();
        [r * cos, r * sin, z][j]
    });
    program.offset = vec![-1.0; rows];
    program.equality = vec![false; rows];
    program
}

/// Peaks of a response in time, linearized: the rows of an impact absorber's approximate problem, bound variable last.
fn peaks(rows: usize) -> QuadraticProgram {
    let mut program = QuadraticProgram::new(vec![0.0, 0.0, 1.0]).bounds(vec![0.1, 0.1, 0.0], vec![1.0, 1.0, 2.0]);
    let time = |i: usize| 12.0 * i as f64 / rows as f64;
    program.rows = DMatrix::from_fn(rows, 3, |i, j| {
        let t = time(i);
        [(0.7 * t).cos() * (-0.2 * t).exp(), (0.7 * t).sin() * (-0.1 * t).exp(), -1.0][j]
    });
    program.offset = (0..rows).map(|i| 0.5 * (0.9 * time(i)).cos() * (-0.2 * time(i)).exp()).collect();
    program.equality = vec![false; rows];
    program
}

#[divan::bench(args = [10, 1_000, 10_000])]
fn linear_sphere(bencher: Bencher, rows: usize) {
    let program = sphere(rows);
    bencher.bench(|| Conic::default().solve(black_box(&program), &[0.0; 3]).unwrap());
}

#[divan::bench(args = [10, 1_000, 10_000])]
fn linear_peaks(bencher: Bencher, rows: usize) {
    let program = peaks(rows);
    bencher.bench(|| Conic::default().solve(black_box(&program), &[0.5, 0.5, 1.0]).unwrap());
}

#[divan::bench(args = [10, 1_000, 10_000])]
fn quadratic_sphere(bencher: Bencher, rows: usize) {
    let program = sphere(rows).hessian(DMatrix::identity(3, 3) * 0.3);
    bencher.bench(|| Conic::default().solve(black_box(&program), &[0.0; 3]).unwrap());
}
