//! Linear and quadratic programs with known answers, and random ones checked by their optimality conditions.

use linkwright_nlp::Error;
use linkwright_nlp::{ActiveSet, Conic, ProgramStatus, QuadraticProgram, Solution, SubproblemSolver};
use linkwright_nlp::{Gradients, Program, Structure, Values};
use nalgebra::DMatrix;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const FREE: f64 = f64::INFINITY;

fn solve(program: &QuadraticProgram) -> Solution {
    Conic::default().solve(program, &vec![0.0; program.gradient.len()]).unwrap()
}

#[track_caller]
fn assert_close(got: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(got.len(), expected.len());
    for (a, b) in got.iter().zip(expected) {
        assert!((a - b).abs() <= tolerance * b.abs().max(1.0), "{got:?} is not {expected:?}");
    }
}

#[track_caller]
fn assert_solved(s: &Solution) {
    assert_eq!(s.status, ProgramStatus::Solved, "{s:?}");
    assert!(s.kkt.largest() < 1e-10, "{:?}", s.kkt);
}

#[test]
fn wyndor_glass() {
    // Hillier & Lieberman: max 3x + 5y, x ≤ 4, 2y ≤ 12, 3x + 2y ≤ 18 has (2, 6), 36 and shadow prices 0, 3/2, 1.
    let program = QuadraticProgram::new(vec![-3.0, -5.0])
        .at_most(&[1.0, 0.0], 4.0)
        .at_most(&[0.0, 2.0], 12.0)
        .at_most(&[3.0, 2.0], 18.0)
        .bounds(vec![0.0; 2], vec![FREE; 2]);
    let s = solve(&program);
    assert_solved(&s);
    assert_close(&s.x, &[2.0, 6.0], 1e-14);
    assert_close(&[s.objective], &[-36.0], 1e-14);
    assert_close(&s.multipliers, &[0.0, 1.5, 1.0], 1e-13);
    assert_eq!(ActiveSet::of(&program, &[0.0; 2], &s, 1e-9).unwrap().rows, [1, 2]);
}

#[test]
fn quadratic_with_an_equality() {
    // min ½(x² + 2y²) on x + y = 3: x = 2, y = 1, multiplier −2.
    let h = DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 2.0]);
    let s = solve(&QuadraticProgram::new(vec![0.0; 2]).hessian(h).equal(&[1.0, 1.0], 3.0));
    assert_solved(&s);
    assert_close(&s.x, &[2.0, 1.0], 1e-14);
    assert_close(&s.multipliers, &[-2.0], 1e-14);
}

#[test]
fn least_squares_without_rows_and_a_flat_direction() {
    // ½(x + y − 2)²: every point of the line is a solution.
    let h = DMatrix::from_element(2, 2, 1.0);
    let s = solve(&QuadraticProgram::new(vec![-2.0, -2.0]).hessian(h));
    assert_eq!(s.status, ProgramStatus::Solved);
    assert_close(&[s.x[0] + s.x[1]], &[2.0], 1e-12);
}

#[test]
fn degenerate_vertex_with_repeated_and_zero_rows() {
    let mut program = QuadraticProgram::new(vec![-1.0, -1.0]).bounds(vec![0.0; 2], vec![5.0; 2]);
    for _ in 0..4 {
        program = program.at_most(&[1.0, 1.0], 2.0).at_most(&[1.0, 0.0], 1.0).at_most(&[0.0, 1.0], 1.0);
    }
    let s = solve(&program.at_most(&[0.0, 0.0], 0.0).at_most(&[0.0, 0.0], 7.0).equal(&[0.0, 0.0], 0.0));
    assert_solved(&s);
    assert_close(&s.x, &[1.0, 1.0], 1e-13);
}

#[test]
fn fixed_variables_and_no_variables_to_move() {
    let program = QuadraticProgram::new(vec![1.0, -1.0]).at_most(&[1.0, 1.0], 9.0).bounds(vec![2.0; 2], vec![2.0; 2]);
    let s = solve(&program);
    assert_eq!((s.status, s.x.as_slice()), (ProgramStatus::Solved, [2.0, 2.0].as_slice()));
}

#[test]
fn contradictory_rows_are_relaxed_by_the_least_amount() {
    // x ≤ 1 and x ≥ 3: the least relaxation is one, with x = 2. Then y is the smallest with x + y ≥ 5 − 1.
    let program = QuadraticProgram::new(vec![0.0, 1.0])
        .at_most(&[1.0, 0.0], 1.0)
        .at_most(&[-1.0, 0.0], -3.0)
        .at_most(&[-1.0, -1.0], -5.0)
        .bounds(vec![-10.0; 2], vec![10.0; 2]);
    let s = solve(&program);
    assert_eq!(s.status, ProgramStatus::Relaxed);
    assert!(!s.status.was_successful() && s.status.is_usable());
    assert_close(&[s.relaxation.unwrap()], &[1.0], 1e-12);
    assert_close(&s.x, &[2.0, 2.0], 1e-11);
    assert!(s.kkt.largest() < 1e-10, "{:?}", s.kkt);
}

#[test]
fn contradictory_equalities_and_a_violated_row_of_zeros_are_relaxed() {
    let both = QuadraticProgram::new(vec![1.0]).equal(&[1.0], 1.0).equal(&[1.0], 2.0);
    let s = solve(&both);
    assert_eq!(s.status, ProgramStatus::Relaxed);
    assert_close(&[s.x[0], s.relaxation.unwrap()], &[1.5, 0.5], 1e-12);
    let zeros = QuadraticProgram::new(vec![1.0]).at_most(&[0.0], -0.25).bounds(vec![0.0], vec![1.0]);
    let s = solve(&zeros);
    assert_eq!(s.status, ProgramStatus::Relaxed);
    assert_close(&[s.x[0], s.relaxation.unwrap()], &[0.0, 0.25], 1e-12);
}

#[test]
fn unbounded_programs_are_reported_with_and_without_a_feasible_point() {
    let down = QuadraticProgram::new(vec![-1.0, 0.0]).at_most(&[-1.0, 1.0], 1.0);
    assert_eq!(solve(&down).status, ProgramStatus::Unbounded);
    // Infeasible, and unbounded after relaxation: both are reported.
    let neither = down.clone().at_most(&[0.0, 1.0], 0.0).at_most(&[0.0, -1.0], -2.0);
    let s = solve(&neither);
    assert_eq!(s.status, ProgramStatus::Unbounded);
    assert_close(&[s.relaxation.unwrap()], &[1.0], 1e-9);
}

#[test]
fn ten_thousand_rows_around_a_ball() {
    // Tangents of the unit sphere: the largest x + y + z in their polytope is found among all rows.
    let n = 10_000;
    let mut program = QuadraticProgram::new(vec![-1.0; 3]).bounds(vec![-2.0; 3], vec![2.0; 3]);
    program.rows = DMatrix::from_fn(n, 3, |i, j| sphere(i, n)[j]);
    program.offset = vec![-1.0; n];
    program.equality = vec![false; n];
    let s = solve(&program);
    assert_solved(&s);
    assert!(-s.objective > 3f64.sqrt() - 1e-12 && -s.objective < 1.01 * 3f64.sqrt());
}

fn sphere(i: usize, n: usize) -> [f64; 3] {
    let z = (2.0 * i as f64 + 1.0) / n as f64 - 1.0;
    let (sin, cos) = (i as f64 * 2.399_963_229_728_653).sin_cos();
    let r = (1.0 - z * z).sqrt();
    [r * cos, r * sin, z]
}

/// A quadratic program that does not provide its Hessian, so that gradients are differenced.
struct WithoutHessian(QuadraticProgram);

impl Program for WithoutHessian {
    fn variables(&self) -> usize {
        self.0.variables()
    }
    fn rows(&self) -> usize {
        Program::rows(&self.0)
    }
    fn lower(&self) -> &[f64] {
        Program::lower(&self.0)
    }
    fn upper(&self) -> &[f64] {
        Program::upper(&self.0)
    }
    fn structure(&self) -> Structure {
        Structure::Quadratic
    }
    fn values(&self, x: &[f64]) -> linkwright_nlp::Result<Values> {
        self.0.values(x)
    }
    fn gradients(&self, x: &[f64]) -> linkwright_nlp::Result<Gradients> {
        self.0.gradients(x)
    }
}

#[test]
fn a_hessian_is_found_by_differences() {
    let h = DMatrix::from_row_slice(2, 2, &[3.0, 1.0, 1.0, 2.0]);
    let known = QuadraticProgram::new(vec![1.0, -4.0]).hessian(h).at_most(&[1.0, 1.0], 0.5);
    let exact = solve(&known);
    let differenced = Conic::default().solve(&WithoutHessian(known), &[0.0, 0.0]).unwrap();
    assert_close(&differenced.x, &exact.x, 1e-12);
}

#[test]
fn bad_input_is_named() {
    let program = QuadraticProgram::new(vec![1.0]).bounds(vec![1.0], vec![0.0]);
    assert!(matches!(Conic::default().solve(&program, &[0.0]), Err(Error::Definition { .. })));
    let program = QuadraticProgram::new(vec![1.0]).bounds(vec![f64::NAN], vec![0.0]);
    assert!(matches!(Conic::default().solve(&program, &[0.0]), Err(Error::Definition { .. })));
    let program = QuadraticProgram::new(vec![f64::NAN]);
    assert!(matches!(Conic::default().solve(&program, &[0.0]), Err(Error::NotFinite { .. })));
    let program = QuadraticProgram::new(vec![1.0]);
    assert!(matches!(Conic::default().solve(&program, &[0.0, 1.0]), Err(Error::Length { .. })));
    assert!(matches!(Conic::default().solve(&program, &[f64::NAN]), Err(Error::NotFinite { .. })));
    let concave = program.hessian(-DMatrix::identity(1, 1));
    assert!(matches!(Conic::default().solve(&concave, &[0.0]), Err(Error::Unsupported { .. })));
    for tolerance in [0.0, f64::NAN, 1.0] {
        assert!(matches!(Conic::default().with_tolerance(tolerance), Err(Error::Option { .. })));
    }
    assert!(matches!(Conic::default().with_iterations(0), Err(Error::Option { .. })));
}

/// A program with a known solution: x*, multipliers and active rows first, then matrices that fit them.
fn with_known_solution(n: usize, m: usize, v: &[f64], scales: &[i32]) -> (QuadraticProgram, Vec<f64>) {
    let mut next = v.iter().copied().cycle();
    let mut take = || next.next().unwrap();
    let unit: Vec<f64> = (0..n).map(|j| 10f64.powi(scales[j % scales.len()])).collect();
    let x: Vec<f64> = (0..n).map(|_| take()).collect();
    let root = DMatrix::from_fn(n, n, |_, _| take());
    let h = &root * root.transpose() + DMatrix::identity(n, n) * 0.1;
    let mut slope = &h * nalgebra::DVector::from_column_slice(&x);
    let mut program = QuadraticProgram::new(vec![0.0; n]);
    for i in 0..m {
        let a: Vec<f64> = (0..n).map(|_| take()).collect();
        let value: f64 = a.iter().zip(&x).map(|(a, x)| a * x).sum();
        let active = i < n / 2;
        if active {
            let λ = 0.1 + take().abs();
            slope.iter_mut().zip(&a).for_each(|(s, a)| *s += λ * a);
        }
        let size = 10f64.powi(scales[(i + 1) % scales.len()]);
        let scaled: Vec<f64> = a.iter().zip(&unit).map(|(a, u)| a * size / u).collect();
        program = program.at_most(&scaled, (value + if active { 0.0 } else { 0.5 + take().abs() }) * size);
    }
    program.gradient = (0..n).map(|j| -slope[j] / unit[j]).collect();
    program.hessian = Some(DMatrix::from_fn(n, n, |i, j| h[(i, j)] / unit[i] / unit[j]));
    program.lower = unit.iter().map(|u| -4.0 * u).collect();
    program.upper = unit.iter().map(|u| 4.0 * u).collect();
    (program, x.iter().zip(&unit).map(|(x, u)| x * u).collect())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn finds_the_known_solution_at_any_scale(
        n in 2usize..7, m in 1usize..12,
        v in prop::collection::vec(-1.0..1.0f64, 211), scales in prop::collection::vec(-8i32..9, 5),
    ) {
        let (program, x) = with_known_solution(n, m, &v, &scales);
        let s = solve(&program);
        prop_assert_eq!(s.status, ProgramStatus::Solved);
        prop_assert!(s.kkt.largest() < 1e-9, "{:?}", s.kkt);
        for j in 0..n {
            prop_assert!((s.x[j] - x[j]).abs() <= 1e-8 * program.upper[j], "{:?} {:?}", s.x, x);
        }
    }
}
