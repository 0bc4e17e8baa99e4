//! Nonlinear programs of Hock & Schittkowski (*Test Examples for Nonlinear Programming Codes*, 1981), others with
//! known answers, and failures.

use argmin::core::{State, TerminationReason};
use autodiff::{Scalar, hessian, jacobian};
use linkwright_nlp::{
    AutoSolver, ConcurrentSolver, Conic, Curvature, MultiStart, ProgramStatus, QuadraticProgram, SecondOrder, Solution,
    Sqp, SubproblemSolver,
};
use linkwright_nlp::{Error, Result};
use linkwright_nlp::{Gradients, Program, Structure, Values};
use nalgebra::DMatrix;
use std::f64::consts::PI;
use std::sync::atomic::{AtomicUsize, Ordering};

const FREE: f64 = f64::INFINITY;

/// Objective and rows (equalities last), written once over the scalar.
trait TestProgram: Sync {
    fn functions<S: Scalar>(&self, x: &[S]) -> (S, Vec<S>);
    fn equalities(&self) -> usize {
        0
    }
}

struct Smooth<M> {
    model: M,
    rows: usize,
    lower: Vec<f64>,
    upper: Vec<f64>,
    exact: bool,
}

impl<M: TestProgram> Smooth<M> {
    fn new(model: M, lower: Vec<f64>, upper: Vec<f64>) -> Self {
        let rows = model.functions(&lower.iter().map(|_| 0.5).collect::<Vec<f64>>()).1.len();
        Self { model, rows, lower, upper, exact: true }
    }
    fn free(model: M, n: usize) -> Self {
        Self::new(model, vec![-FREE; n], vec![FREE; n])
    }
}

impl<M: TestProgram> Program for Smooth<M> {
    fn variables(&self) -> usize {
        self.lower.len()
    }
    fn rows(&self) -> usize {
        self.rows
    }
    fn lower(&self) -> &[f64] {
        &self.lower
    }
    fn upper(&self) -> &[f64] {
        &self.upper
    }
    fn is_equality(&self, i: usize) -> bool {
        i >= self.rows - self.model.equalities()
    }
    fn structure(&self) -> Structure {
        Structure::Nonlinear
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        let (objective, rows) = self.model.functions(x);
        Ok(Values { objective, rows })
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let all = |x: &[autodiff::Dual]| {
            let (f, mut g) = self.model.functions(x);
            g.push(f);
            g
        };
        let (mut rows, slopes) = jacobian(all, x);
        let objective = rows.pop().unwrap();
        let m = rows.len();
        Ok(Gradients {
            values: Values { objective, rows },
            objective: slopes.row(m).iter().copied().collect(),
            rows: slopes.rows(0, m).into_owned(),
        })
    }
    fn lagrangian_hessian(&self, x: &[f64], λ: &[f64]) -> Result<Option<DMatrix<f64>>> {
        if !self.exact {
            return Ok(None);
        }
        let lagrangian = |x: &[autodiff::HyperDual]| {
            let (f, g) = self.model.functions(x);
            g.into_iter().zip(λ).fold(f, |sum, (g, λ)| sum + g * *λ)
        };
        Ok(Some(hessian(lagrangian, x).2))
    }
}

/// Solves with exact and with quasi-Newton curvature and checks both.
#[track_caller]
fn assert_optimum<M: TestProgram>(mut program: Smooth<M>, start: &[f64], objective: f64) -> [Solution; 2] {
    [true, false].map(|exact| {
        program.exact = exact;
        let s = Sqp::default().solve(&program, start).unwrap();
        assert_eq!(s.status, ProgramStatus::Solved, "exact: {exact}, {s:#?}");
        let close = (s.objective - objective).abs() <= 1e-7 * objective.abs().max(1.0);
        assert!(close, "exact: {exact}, {} is not {objective}", s.objective);
        assert!(s.kkt.largest() < 1e-7, "exact: {exact}, {:?}", s.kkt);
        s
    })
}

macro_rules! model {
    ($name:ident, $equalities:expr, |$x:ident| $body:expr) => {
        struct $name;
        impl TestProgram for $name {
            fn functions<S: Scalar>(&self, $x: &[S]) -> (S, Vec<S>) {
                $body
            }
            fn equalities(&self) -> usize {
                $equalities
            }
        }
    };
}

model!(Hs71, 1, |x| {
    let product = x[0] * x[1] * x[2] * x[3];
    let squares = x.iter().map(|v| v.powi(2)).fold(S::from(0.0), |a, b| a + b);
    (x[0] * x[3] * (x[0] + x[1] + x[2]) + x[2], vec![-product + 25.0, squares - 40.0])
});

#[test]
fn hs71() {
    let program = Smooth::new(Hs71, vec![1.0; 4], vec![5.0; 4]);
    let [exact, quasi] = assert_optimum(program, &[1.0, 5.0, 5.0, 1.0], 17.014_017_289_134_37);
    assert!((exact.multipliers[0] - 0.552_293_66).abs() < 1e-6 && (exact.multipliers[1] - 0.161_468_56).abs() < 1e-6);
    assert!(exact.iterations <= 7 && quasi.iterations <= 12, "{} {}", exact.iterations, quasi.iterations);
    assert!(exact.kkt.largest() < 1e-10);
}

model!(DiskRosenbrock, 0, |x| {
    ((x[1] - x[0].powi(2)).powi(2) * 100.0 + (-x[0] + 1.0).powi(2), vec![x[0].powi(2) + x[1].powi(2) - 2.0])
});
model!(Rosenbrock, 0, |x| ((x[1] - x[0].powi(2)).powi(2) * 100.0 + (-x[0] + 1.0).powi(2), vec![]));

#[test]
fn rosenbrock_free_and_in_a_disk() {
    assert_optimum(Smooth::free(Rosenbrock, 2), &[-1.2, 1.0], 0.0);
    // (1, 1) lies on the circle of radius √2.
    assert_optimum(Smooth::free(DiskRosenbrock, 2), &[-1.2, 1.0], 0.0);
}

model!(RosenSuzuki, 0, |x| {
    let q = |i: usize| x[i].powi(2);
    let f = q(0) + q(1) + q(2) * 2.0 + q(3) - x[0] * 5.0 - x[1] * 5.0 - x[2] * 21.0 + x[3] * 7.0;
    let a = q(0) + q(1) + q(2) + q(3) + x[0] - x[1] + x[2] - x[3] - 8.0;
    let b = q(0) + q(1) * 2.0 + q(2) + q(3) * 2.0 - x[0] - x[3] - 10.0;
    let c = q(0) * 2.0 + q(1) + q(2) + x[0] * 2.0 - x[1] - x[3] - 5.0;
    (f, vec![a, b, c])
});

#[test]
fn hs43_rosen_suzuki() {
    let [s, _] = assert_optimum(Smooth::free(RosenSuzuki, 4), &[0.0; 4], -44.0);
    for (got, exact) in s.x.iter().zip([0.0, 1.0, 2.0, -1.0]) {
        assert!((got - exact).abs() < 1e-9);
    }
}

model!(Hs100, 0, |x| {
    let p = |i: usize, k: i32| x[i].powi(k);
    let f = (x[0] - 10.0).powi(2)
        + (x[1] - 12.0).powi(2) * 5.0
        + p(2, 4)
        + (x[3] - 11.0).powi(2) * 3.0
        + p(4, 6) * 10.0
        + p(5, 2) * 7.0
        + p(6, 4)
        - x[5] * x[6] * 4.0
        - x[5] * 10.0
        - x[6] * 8.0;
    let a = p(0, 2) * 2.0 + p(1, 4) * 3.0 + x[2] + p(3, 2) * 4.0 + x[4] * 5.0 - 127.0;
    let b = x[0] * 7.0 + x[1] * 3.0 + p(2, 2) * 10.0 + x[3] - x[4] - 282.0;
    let c = x[0] * 23.0 + p(1, 2) + p(5, 2) * 6.0 - x[6] * 8.0 - 196.0;
    let d = p(0, 2) * 4.0 + p(1, 2) - x[0] * x[1] * 3.0 + p(2, 2) * 2.0 + x[5] * 5.0 - x[6] * 11.0;
    (f, vec![a, b, c, d])
});

#[test]
fn hs100() {
    assert_optimum(Smooth::free(Hs100, 7), &[1.0, 2.0, 0.0, 4.0, 0.0, 1.0, 1.0], 680.630_057_4);
}

model!(Hs26, 1, |x| {
    let f = (x[0] - x[1]).powi(2) + (x[1] - x[2]).powi(4);
    (f, vec![(x[1].powi(2) + 1.0) * x[0] + x[2].powi(4) - 3.0])
});
model!(Hs39, 2, |x| (-x[0], vec![x[1] - x[0].powi(3) - x[2].powi(2), x[0].powi(2) - x[1] - x[3].powi(2)]));
model!(Maratos, 1, |x| {
    let circle = x[0].powi(2) + x[1].powi(2) - 1.0;
    (circle * 2.0 - x[0], vec![circle])
});

#[test]
fn equalities_with_little_curvature_and_the_maratos_effect() {
    assert_optimum(Smooth::free(Hs26, 3), &[-2.6, 2.0, 2.0], 0.0);
    assert_optimum(Smooth::free(Hs39, 4), &[2.0; 4], -1.0);
    assert_optimum(Smooth::free(Maratos, 2), &[0.8, 0.6], -1.0);
}

model!(Chebyshev, 0, |x| {
    // max over 41 points of |e^s − a − b s − c s²|, bounded by the last variable.
    let rows = (0..41).flat_map(|k| {
        let s = f64::from(k) / 20.0 - 1.0;
        let e = x[0] + x[1] * s + x[2] * (s * s) - s.exp();
        [e - x[3], -e - x[3]]
    });
    (x[3], rows.collect())
});

#[test]
fn min_max_by_a_bound_variable() {
    // Best quadratic approximation of the exponential: a linear program, which the conic solver solves, too.
    let program = Smooth::free(Chebyshev, 4);
    let here = program.gradients(&[0.0; 4]).unwrap();
    let mut linear = QuadraticProgram::new(here.objective);
    (linear.rows, linear.offset, linear.equality) = (here.rows, here.values.rows, vec![false; 82]);
    let exact = Conic::default().solve(&linear, &[0.0; 4]).unwrap();
    assert_eq!(exact.status, ProgramStatus::Solved);
    assert!((exact.objective - 0.045).abs() < 1e-4);
    let s = assert_optimum(program, &[1.0, 1.0, 0.5, 1.0], exact.objective);
    assert!(s[0].multipliers.iter().filter(|λ| **λ > 1e-9).count() == 4);
}

model!(FarDisk, 0, |x| (x[0], vec![x[0].powi(2) + x[1].powi(2) - 1.0, -x[0] - x[1] + 3.0]));

#[test]
fn an_infeasible_program_is_relaxed() {
    let s = Sqp::default().solve(&Smooth::free(FarDisk, 2), &[3.0, -1.0]).unwrap();
    assert_eq!(s.status, ProgramStatus::Relaxed, "{s:#?}");
    // Least t with ‖x‖² ≤ 1 + t and x + y ≥ 3 − t has x = y: 2x² − 1 = 3 − 2x, x = (√9 − 1)/2 = 1, t = 1.
    assert!((s.relaxation.unwrap() - 1.0).abs() < 1e-7, "{:?}", s.relaxation);
    assert!((s.x[0] - 1.0).abs() < 1e-3 && (s.x[1] - 1.0).abs() < 1e-3);
}

model!(OutsideEllipses, 0, |x| {
    let outside = |a: f64, b: f64| -(x[0] - x[1]).powi(2) * a - (x[0] + x[1] * 0.5).powi(2) * b + 1.0;
    (x[0].powi(2) + x[1].powi(2) * 3.0, vec![outside(1.0, 2.0), outside(2.0, 1.0)])
});

/// At the origin the slopes of the violated rows vanish, and near it a full step leads far away.
#[test]
fn a_stationary_violation_is_left_along_negative_curvature() {
    for start in [[0.0, 0.0], [1e-15, -2e-15], [-3e-17, 1e-16]] {
        let s = Sqp::default().solve(&Smooth::free(OutsideEllipses, 2), &start).unwrap();
        assert_eq!(s.status, ProgramStatus::Solved, "{start:?}: {s:#?}");
        assert!(s.kkt.largest() < 1e-10 && s.rows.iter().all(|g| *g < 1e-9), "{start:?}: {s:#?}");
    }
}

model!(Downhill, 0, |x| (-x[0] + x[1].powi(2), vec![x[1].powi(2) - 1.0]));

#[test]
fn an_unbounded_program_is_reported() {
    let mut program = Smooth::free(Downhill, 2);
    for exact in [true, false] {
        program.exact = exact;
        assert_eq!(Sqp::default().solve(&program, &[0.0, 0.5]).unwrap().status, ProgramStatus::Unbounded);
    }
}

/// Slider-crank path generation: coupler point against ten points, eight variables, crank must rotate.
struct SliderCrank;

impl TestProgram for SliderCrank {
    fn functions<S: Scalar>(&self, b: &[S]) -> (S, Vec<S>) {
        let mut sum = S::from(0.0);
        for k in 0..10 {
            let angle = b[7] + 2.0 * PI * f64::from(k) / 10.0;
            let sine = (b[0] * angle.sin() + b[4]) / b[1];
            let cosine = (-sine.powi(2) + 1.0).sqrt();
            let x = b[0] * angle.cos() + b[2] * cosine - b[3] * sine + b[5];
            let y = b[0] * angle.sin() - b[2] * sine - b[3] * cosine + b[6];
            let s = 2.0 * PI * f64::from(k) / 10.0;
            sum = sum + (x - (3.0 + 1.5 * s.cos())).powi(2) + (y - (1.0 + 0.8 * s.sin())).powi(2);
        }
        (sum, vec![b[0] - b[1] * 0.9 + b[4], b[0] - b[1] * 0.9 - b[4]])
    }
}

#[test]
fn slider_crank_from_many_starts() {
    let program = Smooth::new(
        SliderCrank,
        vec![0.1, 1.0, -5.0, -5.0, -2.0, -5.0, -5.0, -2.0 * PI],
        vec![3.0, 6.0, 5.0, 5.0, 2.0, 5.0, 5.0, 2.0 * PI],
    );
    let mut worst = 0;
    for k in 0..8 {
        let turn = f64::from(k) * PI / 4.0 - PI;
        let start = [1.0 + 0.1 * f64::from(k), 3.0, 1.0, 0.3, 0.1, 0.5, 0.5, turn];
        let s = Sqp::default().solve(&program, &start).unwrap();
        assert_eq!(s.status, ProgramStatus::Solved, "{s:#?}");
        worst = worst.max(s.iterations);
    }
    assert!(worst <= 100, "{worst}");
}

/// A program whose evaluation fails for x₁ ≤ `limit`.
struct Fragile {
    inner: Smooth<Rosenbrock>,
    limit: f64,
    failures: AtomicUsize,
}

impl Fragile {
    fn check(&self, x: &[f64]) -> Result<()> {
        if x[0] > self.limit {
            return Ok(());
        }
        self.failures.fetch_add(1, Ordering::Relaxed);
        Err(Error::analysis("fragile", format!("x = {}", x[0]), "stay right"))
    }
}

impl Program for Fragile {
    fn variables(&self) -> usize {
        2
    }
    fn rows(&self) -> usize {
        0
    }
    fn lower(&self) -> &[f64] {
        &self.inner.lower
    }
    fn upper(&self) -> &[f64] {
        &self.inner.upper
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        self.check(x)?;
        self.inner.values(x)
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        self.check(x)?;
        self.inner.gradients(x)
    }
}

#[test]
fn a_failing_evaluation_shortens_the_step_and_is_an_error_only_at_the_start() {
    let inner = Smooth::free(Rosenbrock, 2);
    let program = Fragile { inner, limit: 0.0, failures: AtomicUsize::new(0) };
    let s = Sqp::default().solve(&program, &[3.0, -4.0]).unwrap();
    assert_eq!(s.status, ProgramStatus::Solved, "{s:#?}");
    assert!(program.failures.load(Ordering::Relaxed) > 0, "no failure met");
    assert!(s.evaluations.values >= s.iterations && s.evaluations.gradients <= s.evaluations.values + 1);
    assert!(matches!(Sqp::default().solve(&program, &[-2.0, 0.0]), Err(Error::Analysis { .. })));
}

#[test]
fn an_iteration_limit_is_reported() {
    let program = Smooth::free(Rosenbrock, 2);
    let s = Sqp::default()
        .with_iterations(3)
        .unwrap()
        .with_curvature(Curvature::QuasiNewton)
        .solve(&program, &[-1.2, 1.0])
        .unwrap();
    assert_eq!((s.status, s.iterations), (ProgramStatus::IterationLimit, 3));
}

#[test]
fn each_setting_is_checked() {
    for tolerance in [0.0, f64::NAN, 1.0] {
        assert!(matches!(Sqp::default().with_tolerance(tolerance), Err(Error::Option { .. })));
    }
    assert!(matches!(Sqp::default().with_iterations(0), Err(Error::Option { .. })));
}

#[test]
fn argmin_reports_why_a_run_stopped_and_a_stopped_run_continues_to_the_same_bits() {
    let program = Smooth::new(Hs71, vec![1.0; 4], vec![5.0; 4]);
    let start = [1.0, 5.0, 5.0, 1.0];
    let solver = Sqp::default().with_curvature(Curvature::QuasiNewton);
    let whole = solver.executor(&program, &start).unwrap().run().unwrap().state;
    assert_eq!(whole.get_termination_reason(), Some(&TerminationReason::SolverConverged));
    let stopped = solver.with_iterations(3).unwrap().executor(&program, &start).unwrap().run().unwrap().state;
    assert_eq!(stopped.get_termination_reason(), Some(&TerminationReason::MaxItersReached));
    assert_eq!(stopped.solution(&program).status, ProgramStatus::IterationLimit);
    let executor = solver.executor(&program, &start).unwrap().configure(|_| stopped.resume(100));
    let continued = executor.timer(true).run().unwrap().state;
    assert!(continued.get_time().is_some() && whole.get_time().is_none());
    assert_eq!(continued.solution(&program), whole.solution(&program));
    assert!((whole.objective - 17.014_017_289_134_37).abs() < 1e-8);
    assert!(matches!(solver.executor(&program, &[0.0; 3]), Err(Error::Length { .. })));
}

model!(Wells, 0, |x| {
    // Six-hump camel back (Dixon & Szegö 1978): global minimum −1.0316284535 at ±(0.0898, −0.7126).
    let (a, b) = (x[0].powi(2), x[1].powi(2));
    let f = (-a * 2.1 + a * a / 3.0 + 4.0) * a + x[0] * x[1] + (b * 4.0 - 4.0) * b;
    (f, vec![x[0] - 1.9])
});

#[test]
fn several_starts_find_the_deepest_well() {
    let program = Smooth::new(Wells, vec![-2.0, -1.0], vec![2.0, 1.0]);
    let one = Sqp::default().solve(&program, &[1.8, 0.9]).unwrap();
    let solver = MultiStart::new(Sqp::default(), 12, 3).unwrap();
    let best = solver.solve(&program, &[1.8, 0.9]).unwrap();
    assert!((best.objective + 1.031_628_453_489_877).abs() < 1e-12, "{}", best.objective);
    assert!(one.objective > best.objective && best.evaluations.gradients > one.evaluations.gradients);
    assert_eq!(best, solver.solve(&program, &[1.8, 0.9]).unwrap());
    assert!(matches!(MultiStart::new(Sqp::default(), 0, 3), Err(Error::Option { .. })));
}

#[test]
fn concurrent_solvers_are_compared() {
    let program = Smooth::new(Hs71, vec![1.0; 4], vec![5.0; 4]);
    let both = ConcurrentSolver::new(Sqp::default(), Sqp::default().with_curvature(Curvature::QuasiNewton));
    let c = both.compare(&program, &[1.0, 5.0, 5.0, 1.0]).unwrap();
    assert!(c.agrees(1e-9) && c.variables < 1e-6 && c.multipliers < 1e-6, "{c:?}");
    assert_eq!(c.better().status, ProgramStatus::Solved);
    // The solution of one solver suffices if the other does not accept the program.
    let s = ConcurrentSolver::new(Conic::default(), Sqp::default()).solve(&program, &[1.0, 5.0, 5.0, 1.0]).unwrap();
    assert_eq!(s.status, ProgramStatus::Solved);
}

/// min c·x within bounds, with rows gᵢ + aᵢ·x + ½ ‖Cᵢ x‖² ≤ 0: the moving peaks of a response.
struct Peaks {
    offset: Vec<f64>,
    slope: DMatrix<f64>,
    factors: Vec<Option<DMatrix<f64>>>,
}

impl Program for Peaks {
    fn variables(&self) -> usize {
        3
    }
    fn rows(&self) -> usize {
        self.offset.len()
    }
    fn lower(&self) -> &[f64] {
        &[-1.0, -1.0, -10.0]
    }
    fn upper(&self) -> &[f64] {
        &[1.0, 1.0, 10.0]
    }
    fn values(&self, x: &[f64]) -> Result<Values> {
        Ok(self.gradients(x)?.values)
    }
    fn gradients(&self, x: &[f64]) -> Result<Gradients> {
        let x = nalgebra::DVector::from_column_slice(x);
        let mut values = &self.slope * &x;
        let mut rows = self.slope.clone();
        for (i, c) in self.factors.iter().enumerate() {
            values[i] += self.offset[i];
            if let Some(c) = c {
                let y = c * &x;
                values[i] += 0.5 * y.norm_squared();
                let mut row = rows.row_mut(i);
                row += (c.transpose() * y).transpose();
            }
        }
        let values = Values { objective: x[2], rows: values.as_slice().to_vec() };
        Ok(Gradients { values, objective: vec![0.0, 0.0, 1.0], rows })
    }
    fn row_factors(&self) -> Option<Vec<Option<DMatrix<f64>>>> {
        Some(self.factors.clone())
    }
}

#[test]
fn convex_quadratic_rows_as_cones() {
    let drift = |a: f64, b: f64| Some(DMatrix::from_row_slice(1, 3, &[a, b, 0.0]));
    let mut program = Peaks {
        offset: vec![0.5, 0.4, 0.3, -0.2],
        slope: DMatrix::from_row_slice(4, 3, &[1.0, 0.2, -1.0, -0.8, 0.5, -1.0, 0.1, -0.9, -1.0, 1.0, 1.0, 0.0]),
        factors: vec![drift(2.0, 0.5), drift(-1.0, 1.5), drift(0.3, 3.0), None],
    };
    let cone = SecondOrder::default().solve(&program, &[0.0; 3]).unwrap();
    let sqp = Sqp::default().solve(&program, &[0.9, -0.9, 5.0]).unwrap();
    assert_eq!((cone.status, sqp.status), (ProgramStatus::Solved, ProgramStatus::Solved));
    assert!((cone.objective - sqp.objective).abs() < 1e-9, "{} {}", cone.objective, sqp.objective);
    assert!(cone.iterations <= 4 && cone.kkt.largest() < 1e-7, "{cone:?}");
    // A row that cannot hold: all rows are relaxed by the same least amount.
    program.offset[3] = 2.5;
    let s = AutoSolver::default().solve(&program, &[0.0; 3]).unwrap();
    assert_eq!(s.status, ProgramStatus::Relaxed);
    assert!((s.relaxation.unwrap() - 0.5).abs() < 1e-8, "{:?}", s.relaxation);
    assert!(matches!(
        SecondOrder::default().solve(&Smooth::free(Rosenbrock, 2), &[0.0; 2]),
        Err(Error::Unsupported { .. })
    ));
}
