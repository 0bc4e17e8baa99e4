//! Separable programs by the dual, the interior point and the SQP solver (or Clarabel), compared with each other.

use linkwright::Error;
use linkwright::approximation::{
    ApproximateProblem, Approximation, ApproximationOptions, Conlin, CycleData, DesignHistory, LinearizationPoint, Mma,
    SubproblemBox,
};
use linkwright::cases::{cantilever, ten_bar_truss, two_bar_truss};
use linkwright::nlp::separable::{DiagonalQuadraticProgram, MovingAsymptotesProgram, ReciprocalProgram, Term};
use linkwright::nlp::{
    AutoSolver, Conic, Falk, InteriorPoint, KktResidual, ProgramStatus, QuadraticProgram, Solution, Sqp,
    SubproblemSolver,
};
use linkwright::nlp::{Gradients, LowRank, Program, Separable, Values};
use linkwright::problem::Intermediates;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Cycles through given numbers in 0 … 1.
struct Numbers<'a>(&'a [f64], usize);

impl Numbers<'_> {
    fn next(&mut self) -> f64 {
        self.1 += 1;
        self.0[(self.1 * 7 + self.1 / 97) % self.0.len()]
    }
    fn many(&mut self, n: usize, a: f64, b: f64) -> Vec<f64> {
        (0..n).map(|_| a + (b - a) * self.next()).collect()
    }
}

/// Rows that oppose the objective, feasible at the middle of the box.
fn asymptotes(n: usize, m: usize, v: &mut Numbers<'_>) -> MovingAsymptotesProgram {
    let (mut p, mut q) = (v.many(n * (m + 1), 0.0, 0.2), v.many(n * (m + 1), 0.0, 0.2));
    for j in 0..n {
        p[j * (m + 1)] += 1.0 + v.next();
        for i in 1..=m {
            q[j * (m + 1) + i] += v.next();
        }
    }
    let middle = |i: usize| (0..n).map(|j| (p[j * (m + 1) + i] + q[j * (m + 1) + i]) / 1.5).sum::<f64>();
    let constants =
        (0..=m).map(|i| if i == 0 { 0.0 } else { -middle(i) - 0.1 * n as f64 * (v.next() - 0.2) }).collect();
    MovingAsymptotesProgram::new(constants, p, q, (vec![-0.5; n], vec![2.5; n]), (vec![0.0; n], vec![2.0; n])).unwrap()
}

fn reciprocal(n: usize, m: usize, v: &mut Numbers<'_>) -> ReciprocalProgram {
    let (mut a, mut b) = (vec![0.0; n * (m + 1)], vec![0.0; n * (m + 1)]);
    for j in 0..n {
        (a[j * (m + 1)], b[j * (m + 1)]) = (1.0 + v.next(), 0.01);
        for i in 1..=m {
            (a[j * (m + 1) + i], b[j * (m + 1) + i]) = (0.1 * v.next(), 0.2 + v.next());
        }
    }
    let constants = (0..=m).map(|i| if i == 0 { 0.0 } else { -0.8 * n as f64 }).collect();
    ReciprocalProgram::new(constants, a, b, (vec![0.1; n], vec![4.0; n])).unwrap()
}

fn quadratic(n: usize, m: usize, v: &mut Numbers<'_>, curved_rows: bool) -> DiagonalQuadraticProgram {
    let (g, mut h) = (v.many(n * (m + 1), -1.0, 1.0), v.many(n * (m + 1), 0.1, 1.0));
    for j in 0..n {
        h[j * (m + 1)] += 0.5;
        for i in 1..=m {
            h[j * (m + 1) + i] *= f64::from(u8::from(curved_rows));
        }
    }
    let constants = (0..=m).map(|i| if i == 0 { 0.0 } else { -0.02 - 0.1 * v.next() }).collect();
    DiagonalQuadraticProgram::new(constants, vec![0.0; n], g, h, (vec![-1.0; n], vec![1.0; n])).unwrap()
}

fn difference(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).fold(0.0, |m, (a, b)| f64::max(m, (a - b).abs()))
}

fn assert_same(a: &Solution, b: &Solution, names: &str) -> Result<(), TestCaseError> {
    prop_assert_eq!(a.status, b.status, "{}", names);
    prop_assert!(difference(&a.x, &b.x) < 1e-8, "{}: x {:?} {:?}", names, a.x, b.x);
    prop_assert!((a.objective - b.objective).abs() < 1e-8 * a.objective.abs().max(1.0), "{}", names);
    Ok(())
}

fn compare(program: &dyn Program) -> Result<(), TestCaseError> {
    let start: Vec<f64> = program.lower().iter().zip(program.upper()).map(|(l, u)| 0.5 * (l + u)).collect();
    let dual = Falk::default().solve(program, &start).unwrap();
    let interior = InteriorPoint::default().solve(program, &start).unwrap();
    let sqp = Sqp::default().solve(program, &start).unwrap();
    prop_assert_eq!(dual.status, ProgramStatus::Solved, "{:?}", dual.kkt);
    assert_same(&dual, &interior, "dual and interior point")?;
    assert_same(&dual, &sqp, "dual and SQP")?;
    prop_assert!(difference(&dual.multipliers, &interior.multipliers) < 1e-6);
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn three_solvers_agree(n in 2usize..20, m in 1usize..6, v in prop::collection::vec(0.0..1.0f64, 397)) {
        let mut v = Numbers(&v, 0);
        compare(&asymptotes(n, m, &mut v))?;
        compare(&reciprocal(n, m, &mut v))?;
        compare(&quadratic(n, m, &mut v, true))?;
    }

    #[test]
    fn clarabel_agrees_where_rows_are_linear(n in 2usize..12, m in 1usize..6, v in prop::collection::vec(0.0..1.0f64, 397)) {
        let program = quadratic(n, m, &mut Numbers(&v, 0), false);
        let here = program.gradients(&vec![0.0; n]).unwrap();
        let h = program.lagrangian_hessian(&vec![0.0; n], &vec![0.0; m]).unwrap().unwrap();
        let mut matrices = QuadraticProgram::new(here.objective).hessian(h).bounds(vec![-1.0; n], vec![1.0; n]);
        (matrices.rows, matrices.offset, matrices.equality) = (here.rows, here.values.rows, vec![false; m]);
        let clarabel = Conic::default().solve(&matrices, &vec![0.0; n]).unwrap();
        let dual = Falk::default().solve(&program, &vec![0.0; n]).unwrap();
        assert_same(&dual, &clarabel, "dual and Clarabel")?;
        prop_assert!(difference(&dual.multipliers, &clarabel.multipliers) < 1e-7);
    }
}

#[test]
fn contradictory_rows_are_relaxed_alike() {
    let numbers: Vec<f64> = (0..97).map(|k| (0.37 * f64::from(k)).fract()).collect();
    let mut program = quadratic(6, 2, &mut Numbers(&numbers, 0), true);
    let start = vec![0.0; 6];
    let at = program.values(&start).unwrap().rows;
    assert!(at.iter().all(|g| *g < 0.0));
    // Row 1 and its opposite, three apart.
    let g: Vec<f64> = (0..6).flat_map(|j| [1.0, 1.0 + 0.1 * f64::from(j), -1.0 - 0.1 * f64::from(j)]).collect();
    let h: Vec<f64> = (0..6).flat_map(|_| [1.0, 0.0, 0.0]).collect();
    program =
        DiagonalQuadraticProgram::new(vec![0.0, 1.5, 1.5], start.clone(), g, h, (vec![-1.0; 6], vec![1.0; 6])).unwrap();
    for solver in [&Falk::default() as &dyn SubproblemSolver, &InteriorPoint::default(), &Sqp::default()] {
        let s = solver.solve(&program, &start).unwrap();
        assert_eq!(s.status, ProgramStatus::Relaxed, "{}", solver.name());
        assert!((s.relaxation.unwrap() - 1.5).abs() < 1e-8, "{}: {:?}", solver.name(), s.relaxation);
        assert!(s.kkt.largest() < 1e-7, "{}: {:?}", solver.name(), s.kkt);
    }
}

#[test]
fn many_rows_and_few_variables() {
    let numbers: Vec<f64> = (0..397).map(|k| (0.618_033_988_75 * f64::from(k)).fract()).collect();
    let program = asymptotes(3, 500, &mut Numbers(&numbers, 0));
    let interior = InteriorPoint::default().solve(&program, &[1.0; 3]).unwrap();
    let sqp = Sqp::default().solve(&program, &[1.0; 3]).unwrap();
    assert_eq!((interior.status, sqp.status), (ProgramStatus::Solved, ProgramStatus::Solved));
    assert!(difference(&interior.x, &sqp.x) < 1e-8);
}

/// Falk's dual, the interior point and SQP on the first MMA and CONLIN subproblem of structural problems with up to 20 rows.
#[test]
fn solvers_agree_on_the_subproblems_of_structures() {
    let problems = [cantilever::problem(), two_bar_truss::problem(), ten_bar_truss::strong_ninth_bar()];
    for mut problem in problems.map(Result::unwrap) {
        // Direct approximations of these functions are convex; minus the approximation of a convex stress would not be.
        problem.objective = problem.objective.directly(Intermediates::Identity);
        for constraint in &mut problem.constraints {
            constraint.quantity = constraint.quantity.clone().directly(Intermediates::Identity);
        }
        let start = problem.start();
        let analyzed = problem.analyze_design(&start).unwrap();
        let data = CycleData::first_order(&problem, &analyzed, problem.all_rows()).unwrap();
        for approximation in [&Mma::default() as &dyn Approximation, &Mma::SVANBERG_1987, &Conlin] {
            let point = LinearizationPoint::first_order(&analyzed, &data);
            let region = problem.variables.iter().zip(&start);
            let bounds = region.map(|(v, x)| ((0.3 * x).max(v.lower), (3.0 * x).min(v.upper))).unzip();
            let around = SubproblemBox::new(&problem, DesignHistory::default().after([&start[..]]), bounds);
            let program =
                ApproximateProblem::new(&problem, approximation, point, (around, ApproximationOptions::default()))
                    .unwrap();
            let dual = Falk::default().solve(&program, &start).unwrap();
            let interior = InteriorPoint::default().solve(&program, &start).unwrap();
            let sqp = Sqp::default().solve(&program, &start).unwrap();
            for other in [&interior, &sqp] {
                let what =
                    format!("{} {approximation:?} {:?} {:?} {:?}", problem.name, dual.kkt, interior.kkt, sqp.kkt);
                assert_eq!([dual.status, other.status], [ProgramStatus::Solved; 2], "{what}");
                let scale = start.iter().fold(0.0, |a: f64, x| a.max(x.abs()));
                let apart = difference(&dual.x, &other.x) / scale;
                let objectives = (dual.objective / other.objective - 1.0).abs();
                assert!(
                    apart < 1e-8 && objectives < 1e-8,
                    "{} {approximation:?}: {apart:e} {objectives:e}",
                    problem.name
                );
            }
        }
    }
}

#[test]
fn same_bits_for_any_number_of_threads() {
    let numbers: Vec<f64> = (0..397).map(|k| (0.618_033_988_75 * f64::from(k)).fract()).collect();
    let program = asymptotes(5000, 3, &mut Numbers(&numbers, 0));
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| Falk::default().solve(&program, &vec![1.0; 5000]).unwrap())
    };
    let (one, four) = (run(1), run(4));
    assert_eq!(one.status, ProgramStatus::Solved, "{:?}", one.kkt);
    assert_eq!(one, four);
}

#[test]
fn many_variables_take_few_passes_and_many_rows_few_rounds() {
    let numbers: Vec<f64> = (0..397).map(|k| (0.618_033_988_75 * f64::from(k)).fract()).collect();
    let program = asymptotes(40_000, 4, &mut Numbers(&numbers, 0));
    let start = vec![1.0; 40_000];
    let s = Falk::default().solve(&program, &start).unwrap();
    assert_eq!(s.status, ProgramStatus::Solved, "{:?}", s.kkt);
    assert!(s.evaluations.values <= 5, "{:?}", s.evaluations);
    assert_eq!(
        s.kkt,
        KktResidual::of(&program, &start, &s).unwrap(),
        "computed independently of the solver and without matrices"
    );

    // Contradictory rows.
    let program = asymptotes(3, 10_000, &mut Numbers(&numbers, 0));
    let s = InteriorPoint::default().solve(&program, &[1.0; 3]).unwrap();
    assert!(s.status == ProgramStatus::Relaxed && s.kkt.largest() < 1e-8, "{:?} {:?}", s.status, s.kkt);

    // Rows that decrease with every variable can be satisfied.
    let mut v = Numbers(&numbers, 0);
    let (mut p, mut q) = (vec![1e-3; 3 * 10_001], vec![1e-3; 3 * 10_001]);
    for j in 0..3 {
        p[j * 10_001] = v.next();
        q[j * 10_001 + 1..(j + 1) * 10_001].iter_mut().for_each(|q| *q = 0.5 + v.next());
    }
    let constants = std::iter::once(0.0).chain(v.many(10_000, -6.0, -2.0)).collect();
    let box_ = (vec![0.0; 3], vec![2.0; 3]);
    let program = MovingAsymptotesProgram::new(constants, p, q, (vec![-0.5; 3], vec![2.5; 3]), box_).unwrap();
    let s = InteriorPoint::default().solve(&program, &[1.0; 3]).unwrap();
    let sqp = Sqp::default().solve(&program, &[1.0; 3]).unwrap();
    assert_eq!([s.status, sqp.status], [ProgramStatus::Solved; 2], "{:?} {:?}", s.kkt, sqp.kkt);
    assert!(difference(&s.x, &sqp.x) < 1e-8);
}

#[test]
fn zero_gradients_and_rows_of_zeros_are_accepted() {
    let program = MovingAsymptotesProgram::new(
        vec![1.0, -1.0],
        vec![0.0; 6],
        vec![0.0; 6],
        (vec![-1.0; 3], vec![2.0; 3]),
        (vec![0.0; 3], vec![1.0; 3]),
    )
    .unwrap();
    for solver in [&Falk::default() as &dyn SubproblemSolver, &InteriorPoint::default(), &Sqp::default()] {
        let s = solver.solve(&program, &[0.2; 3]).unwrap();
        assert_eq!((s.status, s.objective), (ProgramStatus::Solved, 1.0), "{}", solver.name());
    }
}

#[test]
fn programs_that_are_not_separable_and_settings_out_of_range_are_rejected() {
    let h = DMatrix::from_row_slice(2, 2, &[1.0, 0.5, 0.5, 1.0]);
    let program = QuadraticProgram::new(vec![1.0, DVector::<f64>::zeros(1)[0]]).hessian(h);
    assert!(matches!(Falk::default().solve(&program, &[0.0; 2]), Err(Error::Unsupported { .. })));
    assert!(matches!(InteriorPoint::default().solve(&program, &[0.0; 2]), Err(Error::Unsupported { .. })));
    for tolerance in [0.0, f64::NAN, 1.0] {
        assert!(matches!(Falk::default().with_tolerance(tolerance), Err(Error::Option { .. })));
        assert!(matches!(InteriorPoint::default().with_tolerance(tolerance), Err(Error::Option { .. })));
        assert!(matches!(Sqp::default().with_tolerance(tolerance), Err(Error::Option { .. })));
    }
    assert!(matches!(Falk::default().with_iterations(0), Err(Error::Option { .. })));
    assert!(matches!(InteriorPoint::default().with_iterations(0), Err(Error::Option { .. })));
    assert!(matches!(Sqp::default().with_iterations(0), Err(Error::Option { .. })));
}

/// Σ xⱼ²/2 − xⱼ and a row Σ xⱼ ≤ 1, coupled by ½ c (u·x)² in the objective.
struct Coupled {
    low_rank: LowRank,
    bounds: [Vec<f64>; 2],
}

impl Program for Coupled {
    fn variables(&self) -> usize {
        self.bounds[0].len()
    }
    fn rows(&self) -> usize {
        1
    }
    fn lower(&self) -> &[f64] {
        &self.bounds[0]
    }
    fn upper(&self) -> &[f64] {
        &self.bounds[1]
    }
    fn values(&self, x: &[f64]) -> linkwright::Result<Values> {
        Ok(self.gradients(x)?.values)
    }
    fn gradients(&self, x: &[f64]) -> linkwright::Result<Gradients> {
        let (bent, slope) = self.low_rank.value_and_slope(x);
        let sum = x.iter().sum::<f64>();
        let own = x.iter().map(|x| 0.5 * x * x - x).sum::<f64>();
        let objective = x.iter().zip(slope).map(|(x, s)| x - 1.0 + s).collect();
        let values = Values { objective: own + bent, rows: vec![sum - 1.0] };
        Ok(Gradients { values, objective, rows: DMatrix::from_element(1, x.len(), 1.0) })
    }
    fn coupled(&self) -> Option<(&dyn Separable, std::borrow::Cow<'_, LowRank>)> {
        Some((self, std::borrow::Cow::Borrowed(&self.low_rank)))
    }
}

impl Separable for Coupled {
    fn constant(&self, i: usize) -> f64 {
        if i == 0 { 0.0 } else { -1.0 }
    }
    fn term(&self, i: usize, _: usize, x: f64) -> Term {
        match i {
            0 => Term { value: 0.5 * x * x - x, slope: x - 1.0, curvature: 1.0 },
            _ => Term { value: x, slope: 1.0, curvature: 0.0 },
        }
    }
}

#[test]
fn a_coupling_of_low_rank_gives_the_solution_of_the_dense_quadratic_program() {
    let n = 12;
    let wave = |k: usize| (0.7 * k as f64).sin();
    let mut low_rank = LowRank::diagonal(vec![0.1; n], vec![0.5; n]);
    low_rank.add(2.0, (0..n).map(wave).collect());
    low_rank.add(-0.05, (0..n).map(|k| wave(k + 3)).collect());
    let mut bounds = [vec![-0.2; n], vec![0.4; n]];
    (bounds[0][4], bounds[1][4]) = (0.1, 0.1);
    let program = Coupled { low_rank, bounds };
    let found = InteriorPoint::default().solve(&program, &vec![0.0; n]).unwrap();
    assert_eq!(found.status, ProgramStatus::Solved);
    let here = program.gradients(&vec![0.0; n]).unwrap();
    let whole = QuadraticProgram::new(here.objective)
        .hessian(program.low_rank.dense() + DMatrix::identity(n, n))
        .at_most(&vec![1.0; n], 1.0)
        .bounds(program.bounds[0].clone(), program.bounds[1].clone());
    let exact = Conic::default().solve(&whole, &vec![0.0; n]).unwrap();
    assert!(found.x.iter().zip(&exact.x).all(|(a, b)| (a - b).abs() < 1e-8), "{:?} {:?}", found.x, exact.x);
    assert!((found.multipliers[0] - exact.multipliers[0]).abs() < 1e-7);
    assert_eq!(AutoSolver::default().solve(&program, &vec![0.0; n]).unwrap().x, found.x);
}
