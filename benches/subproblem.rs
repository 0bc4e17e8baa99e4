//! Times of subproblems: linear, quadratic, separable, and the approximate problems of the driver.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus};
use divan::{Bencher, black_box};
use linkwright::Result;
use linkwright::approximation::{
    ApproximateProblem, ApproximationOptions, CycleData, DesignHistory, Linear, LinearizationPoint, SubproblemBox,
};
use linkwright::cases::impact_absorber::ClosedFormMotion;
use linkwright::nlp::separable::{DiagonalQuadraticProgram, MovingAsymptotesProgram};
use linkwright::nlp::{AutoSolver, Conic, Falk, InteriorPoint, ProgramStatus, QuadraticProgram, Sqp, SubproblemSolver};
use linkwright::problem::{AnalyzedDesign, DesignVariable, Problem, ProblemBuilder, Quantity, TimeGrid};
use nalgebra::DMatrix;
use std::time::{Duration, Instant};

fn main() {
    if std::env::args().any(|a| a == "--memory") {
        return memory();
    }
    if std::env::args().any(|a| a == "--clarabel") {
        return compare_with_clarabel();
    }
    divan::main();
}

/// Prints the largest memory of a solution beyond that of the program, per variable and row: `-- --memory`.
fn memory() {
    println!("n,m,bytes_of_the_program_per_pair,bytes_of_the_solution_per_pair,passes");
    for (n, m) in [(1_000, 10), (100_000, 1), (100_000, 10), (1_000_000, 1), (1_000_000, 10)] {
        let (pairs, mut program) = ((n * m) as f64, None);
        let made = allocation_counter::measure(|| program = Some(asymptotes(n, m)));
        let (program, start) = (program.expect("it was made"), vec![1.0; n]);
        let mut passes = 0;
        let solved = allocation_counter::measure(|| {
            let s = Falk::default().solve(&program, &start).unwrap();
            assert_eq!(s.status, ProgramStatus::Solved);
            passes = s.evaluations.values;
        });
        let per_pair = |bytes: u64| bytes as f64 / pairs;
        println!("{n},{m},{:.0},{:.0},{passes}", per_pair(made.bytes_max), per_pair(solved.bytes_max));
    }
}

/// A convex quadratic program with a diagonal Hessian and `m` linear rows, about half of which are active.
struct DiagonalProgram {
    n: usize,
    m: usize,
    /// Gradients and curvatures, entry (i, j) at j (1 + m) + i; the rows have no curvature.
    gradients: Vec<f64>,
    curvatures: Vec<f64>,
    constants: Vec<f64>,
}

impl DiagonalProgram {
    fn new(n: usize, m: usize) -> Self {
        let wave = |k: usize| (k as f64 * 0.618_033_988_749_895).fract();
        let (mut gradients, mut curvatures) = (vec![0.0; n * (m + 1)], vec![0.0; n * (m + 1)]);
        for j in 0..n {
            gradients[j * (m + 1)] = -0.5 - wave(j);
            curvatures[j * (m + 1)] = 1.0 + wave(3 * j);
            for i in 1..=m {
                gradients[j * (m + 1) + i] = wave(31 * j + 17 * i);
            }
        }
        let row = |i: usize| -> f64 { (0..n).map(|j| gradients[j * (m + 1) + i]).sum() };
        let constant = |i: usize| if i == 0 { 0.0 } else { -0.4 * row(i) * (1.0 + 0.01 * i as f64) };
        let constants = (0..=m).map(constant).collect();
        Self { n, m, gradients, curvatures, constants }
    }

    fn separable(&self) -> DiagonalQuadraticProgram {
        let (constants, bounds) = (self.constants.clone(), (vec![-1.0; self.n], vec![1.0; self.n]));
        DiagonalQuadraticProgram::new(
            constants,
            vec![0.0; self.n],
            self.gradients.clone(),
            self.curvatures.clone(),
            bounds,
        )
        .expect("the program is convex")
    }

    /// Objective of Clarabel's solution. Its matrices are sparse: diagonal Hessian, rows, and bounds.
    fn clarabel(&self, [hessian, constraints]: [&CscMatrix<f64>; 2]) -> f64 {
        let (n, f) = (self.n, self.m + 1);
        let gradient: Vec<f64> = (0..n).map(|j| self.gradients[j * f]).collect();
        let right: Vec<f64> = self.constants[1..].iter().map(|c| -c).chain(vec![1.0; 2 * n]).collect();
        let settings = DefaultSettings { verbose: false, max_threads: 1, ..Default::default() };
        let cones = [NonnegativeConeT(right.len())];
        let mut solver = DefaultSolver::new(hessian, &gradient, constraints, &right, &cones, settings).unwrap();
        solver.solve();
        assert_eq!(solver.solution.status, SolverStatus::Solved);
        solver.solution.obj_val
    }

    fn matrices(&self) -> [CscMatrix<f64>; 2] {
        let (n, m, f) = (self.n, self.m, self.m + 1);
        let curvatures = (0..n).map(|j| self.curvatures[j * f]).collect();
        let hessian = CscMatrix::new(n, n, (0..=n).collect(), (0..n).collect(), curvatures);
        let (mut index, mut value) = (vec![], vec![]);
        for j in 0..n {
            index.extend((0..m).chain([m + j, m + n + j]));
            value.extend(self.gradients[j * f + 1..(j + 1) * f].iter().copied().chain([1.0, -1.0]));
        }
        let pointer = (0..=n).map(|j| j * (m + 2)).collect();
        [hessian, CscMatrix::new(m + 2 * n, n, pointer, index, value)]
    }
}

/// Prints the times of the separable solvers and of Clarabel on the same programs, measured in turn: `-- --clarabel`.
fn compare_with_clarabel() {
    println!("n,m,dual_ms,interior_point_ms,clarabel_ms,clarabel_per_dual,clarabel_per_interior_point");
    for (n, m) in [(100, 10), (1_000, 10), (1_000, 100), (10_000, 10), (100_000, 1), (100_000, 10)] {
        let program = DiagonalProgram::new(n, m);
        let (separable, [hessian, constraints], start) = (program.separable(), program.matrices(), vec![0.0; n]);
        let mut fastest = [Duration::MAX; 3];
        for _ in 0..5 {
            let mut objectives = [0.0; 3];
            for (k, objective) in objectives.iter_mut().enumerate() {
                let begin = Instant::now();
                *objective = match k {
                    0 => solved(&Falk::default(), &separable, &start),
                    1 => solved(&InteriorPoint::default(), &separable, &start),
                    _ => program.clarabel([&hessian, &constraints]),
                };
                fastest[k] = fastest[k].min(begin.elapsed());
            }
            let [dual, others @ ..] = objectives;
            assert!(others.iter().all(|other| (other / dual - 1.0).abs() < 1e-6), "{objectives:?}");
        }
        let [dual, interior, clarabel] = fastest.map(|time| 1e3 * time.as_secs_f64());
        println!("{n},{m},{dual:.3},{interior:.3},{clarabel:.3},{:.1},{:.1}", clarabel / dual, clarabel / interior);
    }
}

/// Objective of a solution that must be solved.
fn solved(solver: &dyn SubproblemSolver, program: &DiagonalQuadraticProgram, start: &[f64]) -> f64 {
    let solution = solver.solve(program, start).unwrap();
    assert_eq!(solution.status, ProgramStatus::Solved);
    solution.objective
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

/// Linearized peaks of a response: the rows of an impact absorber's approximate problem. The bound variable is the last.
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

/// The impact absorber with least peak acceleration at its start, with `rows` retained rows.
struct Cycle {
    problem: Problem,
    start: AnalyzedDesign,
    data: CycleData,
}

const START: [f64; 3] = [1.0, 0.3, 0.85];

impl Cycle {
    fn new(rows: usize) -> Result<Self> {
        let mut parts = ProblemBuilder::new("impact absorber on a fine grid");
        parts.variable(DesignVariable::new("stiffness", "N/m", START[0]).within(1e-6, 1.0));
        parts.variable(DesignVariable::new("damping", "N·s/m", START[1]).within(1e-6, 1.0));
        let time = parts.grid(TimeGrid::uniform(0.0, 12.0, rows / 2)?);
        let [_, acceleration] = ["displacement", "acceleration"].map(|name| parts.transient(name, "", time));
        let bound = DesignVariable::new("peak", "m/s²", START[2]).within(0.0, 10.0);
        parts.minimize_peak(bound, Quantity::response(time, acceleration), 1.0);
        let problem = parts.build_analytic(ClosedFormMotion)?;
        let start = problem.analyze_design(&START)?;
        let data = CycleData::first_order(&problem, &start, problem.all_rows())?;
        Ok(Self { problem, start, data })
    }

    fn approximate(&self) -> ApproximateProblem<'_> {
        let Self { problem, start, data } = self;
        let point = LinearizationPoint::first_order(start, data);
        let region = START.map(|b| [0.6 * b, (1.4 * b).min(if b == 0.85 { 10.0 } else { 1.0 })]);
        let bounds = (region.map(|r| r[0]).to_vec(), region.map(|r| r[1]).to_vec());
        let around = (
            SubproblemBox::new(problem, DesignHistory::default().after([&START[..]]), bounds),
            ApproximationOptions::default(),
        );
        ApproximateProblem::new(problem, &Linear, point, around).expect("the start is regular")
    }
}

/// An approximate problem of the driver: recognition of its structure, evaluation and solution.
#[divan::bench(args = [10, 1_000, 10_000])]
fn approximate_problem(bencher: Bencher, rows: usize) {
    let cycle = Cycle::new(rows).unwrap();
    let program = cycle.approximate();
    bencher.bench(|| AutoSolver::default().solve(black_box(&program), &START).unwrap());
}

/// Fitting of all models of a cycle.
#[divan::bench(args = [10, 1_000, 10_000])]
fn fit_approximate_problem(bencher: Bencher, rows: usize) {
    let cycle = Cycle::new(rows).unwrap();
    bencher.bench(|| black_box(&cycle).approximate().retained().len());
}

/// An MMA subproblem as in a topology or truss problem: the objective increases with every variable, the rows decrease.
fn asymptotes(n: usize, m: usize) -> MovingAsymptotesProgram {
    let wave = |k: usize| 0.5 + 0.5 * (k as f64 * 0.618_033_988_749_895).fract();
    let functions = m + 1;
    let (mut p, mut q) = (vec![1e-3; n * functions], vec![1e-3; n * functions]);
    for j in 0..n {
        p[j * functions] = wave(j);
        for i in 1..functions {
            q[j * functions + i] = wave(j * 31 + i * 17);
        }
    }
    let row = |i: usize| (0..n).map(|j| (p[j * functions + i] + q[j * functions + i]) / 1.5).sum::<f64>();
    let constants = (0..functions).map(|i| if i == 0 { 0.0 } else { -0.95 * row(i) }).collect();
    MovingAsymptotesProgram::new(constants, p, q, (vec![-0.5; n], vec![2.5; n]), (vec![0.0; n], vec![2.0; n])).unwrap()
}

#[divan::bench(args = [(1_000, 10), (100_000, 1), (100_000, 10), (1_000_000, 1), (1_000_000, 10)], sample_count = 10)]
fn mma_dual(bencher: Bencher, (n, m): (usize, usize)) {
    let (program, start) = (asymptotes(n, m), vec![1.0; n]);
    bencher.bench(|| {
        let s = Falk::default().solve(black_box(&program), &start).unwrap();
        assert_eq!(s.status, ProgramStatus::Solved);
        s
    });
}

#[divan::bench(args = [(1_000, 10), (100_000, 10), (3, 1_000), (3, 10_000)], sample_count = 10)]
fn mma_interior_point(bencher: Bencher, (n, m): (usize, usize)) {
    let (program, start) = (asymptotes(n, m), vec![1.0; n]);
    bencher.bench(|| InteriorPoint::default().solve(black_box(&program), &start).unwrap());
}

#[divan::bench(args = [(3, 10), (3, 1_000), (3, 10_000), (30, 10)], sample_count = 10)]
fn mma_sqp(bencher: Bencher, (n, m): (usize, usize)) {
    let (program, start) = (asymptotes(n, m), vec![1.0; n]);
    bencher.bench(|| Sqp::default().solve(black_box(&program), &start).unwrap());
}
