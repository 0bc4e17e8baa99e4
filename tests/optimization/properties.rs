//! Properties that hold for all inputs: first-order exactness, optimality of subproblem solutions, safe screening.

use linkwright::approximation::{
    ApproximateProblem, Approximation, ApproximationOptions, Conlin, CurvatureRule, CycleData, DesignHistory,
    DiagonalQuadratic, Expansion, FullQuadratic, Hessian, Linear, LinearizationPoint, Mma, Reciprocal, Sample,
    SubproblemBox, Tana, TwoPointExponential,
};
use linkwright::autodiff::{Scalar, gradient};
use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::function;
use linkwright::nlp::{AutoSolver, KktResidual, ProgramStatus, QuadraticProgram, Sqp, SubproblemSolver};
use linkwright::problem::{
    ClosedForm, Constraint, DesignVariable, Evaluation, Intermediate, IntermediateMap, Intermediates, Problem,
    ProblemBuilder, Quantity, Selection, TimeGrid,
};
use linkwright::sao::{MoveLimits, RelativeLimits, Screening};
use nalgebra::DMatrix;
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

/// Largest KKT residual of a solution.
const OPTIMAL: f64 = 1e-6;

/// A map that couples the variables: bᴵ₀ = b₀ b₁ …, bᴵₖ = bₖ / bₖ₋₁.
struct Mixed;

impl IntermediateMap for Mixed {
    fn component<S: Scalar>(&self, k: usize, b: &[S]) -> S {
        if k == 0 { b.iter().fold(S::from(1.0), |a, &b| a * b) } else { b[k] / b[k - 1] }
    }
}

fn intermediates(n: usize) -> Vec<Intermediates> {
    let each =
        [Intermediate::Identity, Intermediate::Reciprocal, Intermediate::Power(-2.5), Intermediate::AreaOfDiameter];
    let mut all: Vec<Intermediates> = each.iter().map(|&choice| Intermediates::all(n, choice)).collect();
    all.push(Intermediates::Each((0..n).map(|k| each[k % 4]).collect()));
    all.push(Intermediates::Identity);
    all.push(Intermediates::map(Mixed));
    all
}

/// Every approximation of the crate, with its name.
fn approximations() -> Vec<Box<dyn Approximation>> {
    vec![
        Box::new(Linear),
        Box::new(Reciprocal),
        Box::new(Conlin),
        Box::new(Mma::default()),
        Box::new(DiagonalQuadratic { curvature: CurvatureRule::Reciprocal }),
        Box::new(DiagonalQuadratic { curvature: CurvatureRule::SphericalGradient }),
        Box::new(TwoPointExponential::default()),
        Box::new(Tana::default()),
        Box::new(FullQuadratic { hessian: Hessian::Bfgs(2) }),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, failure_persistence: None, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn an_approximation_equals_value_and_gradient_at_its_point(
        value in -10.0..10.0f64,
        numbers in vec((0.2..5.0f64, -3.0..3.0f64), 1..6),
    ) {
        let (design, slope): (Vec<f64>, Vec<f64>) = numbers.into_iter().unzip();
        for intermediates in intermediates(design.len()) {
            for approximation in approximations() {
                let here = Sample { design: &design, value, gradient: &slope };
                let box_of = |factor: f64| design.iter().map(|b| b * factor).collect::<Vec<_>>();
                let subproblem_box = SubproblemBox {
                    history: DesignHistory::default().after([&design[..]]),
                    lower: box_of(0.6),
                    upper: box_of(1.4),
                    scale: vec![1.0; design.len()],
                };
                let model = approximation
                    .fit(&Expansion {
                        name: "r",
                        here,
                        before: &[],
                        intermediates: &intermediates,
                        curvature: None,
                        subproblem_box: &subproblem_box,
                    })
                    .unwrap();
                let (v, g) = gradient(|b| model.dual(b), &design);
                prop_assert!((model.real(&design) - value).abs() < 1e-12 * (1.0 + value.abs()), "{approximation:?} {intermediates:?}");
                prop_assert!((v - value).abs() < 1e-12 * (1.0 + value.abs()));
                let scale = 1.0 + slope.iter().fold(0.0f64, |a, s| a.max(s.abs()));
                let error = g.iter().zip(&slope).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                prop_assert!(error < 1e-10 * scale, "{approximation:?} {intermediates:?}: {g:?} {slope:?}");
            }
        }
    }

    #[test]
    fn solutions_of_linear_and_quadratic_programs_satisfy_the_optimality_conditions(
        (n, m) in (1..5usize, 0..9usize),
        numbers in vec(-1.0..1.0f64, 100),
        room in vec(0.0..1.0f64, 9),
        curved in any::<bool>(),
    ) {
        let mut next = numbers.into_iter();
        let mut draw = |count| next.by_ref().take(count).collect::<Vec<f64>>();
        let mut program = QuadraticProgram::new(draw(n)).bounds(vec![-2.0; n], vec![3.0; n]);
        for &room in &room[..m] {
            program = program.at_most(&draw(n), room);
        }
        if curved {
            let root = DMatrix::from_vec(n, n, draw(n * n));
            program = program.hessian(root.transpose() * root);
        }
        let start = vec![0.5; n];
        for solver in [&AutoSolver::default() as &dyn SubproblemSolver, &Sqp::default()] {
            let solution = solver.solve(&program, &start).unwrap();
            let residual = KktResidual::of(&program, &start, &solution).unwrap();
            prop_assert_eq!(solution.status, ProgramStatus::Solved, "{}", solver.name());
            prop_assert!(residual.largest() < OPTIMAL, "{}: {residual:?}", solver.name());
        }
    }
}

/// Passes the paper's approximate problem around a design to `judge`.
fn with_approximate_problem(problem: &Problem, b: &[f64], judge: impl FnOnce(&ApproximateProblem)) {
    let analyzed = problem.analyze_design(b).unwrap();
    let retained = Screening::default().retain(problem, &analyzed.evaluation);
    let data = CycleData::first_order(problem, &analyzed, retained).unwrap();
    let point = LinearizationPoint::first_order(&analyzed, &data);
    let region = RelativeLimits::default().region(problem, b, &vec![0.2; b.len()]);
    let subproblem_box = SubproblemBox::new(problem, DesignHistory::default().after([b]), (region.lower, region.upper));
    judge(
        &ApproximateProblem::new(problem, &Linear, point, (subproblem_box, ApproximationOptions::default())).unwrap(),
    );
}

fn assert_optimal(problem: &Problem, b: &[f64]) {
    with_approximate_problem(problem, b, |program| {
        let solution = AutoSolver::default().solve(program, b).unwrap();
        let residual = KktResidual::of(program, b, &solution).unwrap();
        assert!(solution.status.is_usable(), "{} at {b:?}: {}", problem.name, solution.status);
        assert!(residual.largest() < OPTIMAL, "{} at {b:?}: {residual:?}", problem.name);
        assert!((solution.status == ProgramStatus::Relaxed) == (solution.relaxation.unwrap_or(0.0) > 0.0));
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn solutions_of_approximate_problems_satisfy_the_optimality_conditions(
        (k, c, peak) in (0.05..1.0f64, 0.05..1.0f64, 0.3..1.0f64),
    ) {
        // A linear and a quadratic program, with or without a feasible point.
        assert_optimal(&impact_absorber::peak_acceleration().unwrap(), &[k, c, peak]);
        assert_optimal(&impact_absorber::comfort().unwrap(), &[k, c]);
    }

    #[test]
    fn solutions_of_nonlinear_approximate_problems_satisfy_the_optimality_conditions(
        scales in vec(0.9..1.1f64, 8),
        from_the_second in any::<bool>(),
    ) {
        let start = if from_the_second { slider_crank::SECOND_STAND_IN_START } else { slider_crank::STAND_IN_START };
        let b: Vec<f64> = start.iter().zip(&scales).map(|(b, s)| b * s).collect();
        let problem = slider_crank::path_generation(start).unwrap();
        // Some of these cannot be assembled.
        prop_assume!(problem.analyze(&b).is_ok());
        assert_optimal(&problem, &b);
    }
}

struct Nothing;

impl ClosedForm for Nothing {
    fn response<S: Scalar>(&self, _: usize, _: &[S], _: S) -> S {
        S::from(0.0)
    }
}

/// A problem with one transient constraint at `count` time points.
fn one_history(count: usize) -> Problem {
    let mut parts = ProblemBuilder::new("one history");
    parts.variable(DesignVariable::new("b", "", 1.0));
    let time = parts.grid(TimeGrid::uniform(0.0, 1.0, count).unwrap());
    let response = parts.transient("r", "", time);
    parts.minimize("b", "", Quantity::plain(function!(|p| p.design[0])));
    parts.subject_to(Constraint::at_most(
        "r",
        1.0,
        Quantity::each_point(time, function!(|p| p.response[0])).of(&[response]),
    ));
    parts.build_analytic(Nothing).unwrap()
}

/// The local maximum that uphill steps from point `p` reach; of a plateau the first point.
fn summit(g: &[f64], mut p: usize) -> usize {
    loop {
        if p > 0 && g[p - 1] >= g[p] {
            p -= 1;
        } else if p + 1 < g.len() && g[p + 1] > g[p] {
            p += 1;
        } else {
            return p;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, rng_seed: RngSeed::Fixed(1998), ..ProptestConfig::default() })]

    #[test]
    fn screening_never_drops_a_violated_maximum(
        // Coarse steps, so that plateaus occur.
        steps in vec(-3..8i32, 1..60),
        cutoff in prop_oneof![Just(None), (0.0..0.99f64).prop_map(Some)],
        neighbours in 0..4usize,
    ) {
        let g: Vec<f64> = steps.iter().map(|&s| 0.25 * f64::from(s)).collect();
        let problem = one_history(g.len());
        let residuals = vec![g.iter().map(|g| g - 1.0).collect()];
        let evaluation = Evaluation { objective: 0.0, residuals, equalities: vec![], peaks: vec![] };
        for selection in [Selection::All, Selection::NearMaxima(neighbours)] {
            let retained = Screening { cutoff, selection, ..Screening::default() }.retain(&problem, &evaluation);
            let is_retained = |p: usize| retained.iter().any(|row| row.point == p);
            prop_assert!(retained.is_sorted(), "in order and once each: {retained:?}");
            for p in (0..g.len()).filter(|&p| g[p] > 1.0) {
                let top = summit(&g, p);
                prop_assert!(is_retained(top), "{selection:?} drops point {top} of {g:?}");
            }
            for end in [0, g.len() - 1] {
                prop_assert!(g[end] <= 1.0 || is_retained(end), "{selection:?} drops the end {end} of {g:?}");
            }
        }
    }
}
