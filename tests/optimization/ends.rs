//! Ends of runs: what is called an optimum is one, an optimum is called one, and no run loses its result.

use linkwright::autodiff::Scalar;
use linkwright::problem::{
    Analysis, Analytic, ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity, ResponseAt,
    Responses, TimeGrid,
};
use linkwright::responses::Differences;
use linkwright::sao::{Method, RunState, Status, preset, presets};
use linkwright::{Result, function};
use nalgebra::DMatrix;

fn solve(problem: &Problem) -> RunState {
    Method::automatic().solve(problem, |_| ()).unwrap()
}

/// The objective is response 0 and the constraints are responses from 1 on, whose values are at most or equal to these limits.
fn problem(
    variables: &[(f64, f64, f64)],
    limits: &[(f64, bool)],
    build: impl FnOnce(ProblemBuilder) -> Result<Problem>,
) -> Problem {
    let mut parts = ProblemBuilder::new("problem");
    for (k, &(start, lower, upper)) in variables.iter().enumerate() {
        parts.variable(DesignVariable::new(format!("x{k}"), "", start).within(lower, upper));
    }
    let f = parts.constant("f", "");
    parts.minimize("f", "", Quantity::response(None, f));
    for (k, &(limit, is_equality)) in limits.iter().enumerate() {
        let c = Quantity::response(None, parts.constant(&format!("c{k}"), ""));
        let name = format!("c{k}");
        let row = if is_equality { Constraint::equal(name, limit, c) } else { Constraint::at_most(name, limit, c) };
        parts.subject_to(row);
    }
    build(parts).unwrap()
}

const FREE: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// Least time T of a double integrator from rest to rest over the distance 1, with piecewise constant accelerations within ±1.
struct LeastTime;
impl ClosedForm for LeastTime {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let n = b.len() - 1;
        let step = b[n] / n as f64;
        let weighted = |weight: &dyn Fn(usize) -> f64| (0..n).fold(S::from(0.0), |sum, k| sum + b[k] * weight(k));
        match h {
            0 => b[n],
            1 => weighted(&|k| (n - k) as f64 - 0.5) * step * step,
            _ => weighted(&|_| 1.0) * step,
        }
    }
}

/// All accelerations are at their bounds. The time alone, whose row is 1 = λ₁ 2 x/T, does not determine two multipliers.
#[test]
fn multipliers_that_the_free_variables_do_not_determine_are_found() {
    for n in [4, 10, 40] {
        let mut variables = vec![(0.0, -1.0, 1.0); n];
        variables.push((1.0, 0.1, 10.0));
        let end = solve(&problem(&variables, &[(1.0, true), (0.0, true)], |parts| parts.build_analytic(LeastTime)));
        assert_eq!(end.status, Status::Converged, "{n}: {}", end.reason);
        assert!((end.evaluation.objective - 2.0).abs() < 1e-6, "{n}: {}", end.evaluation.objective);
    }
}

/// xᵀ A y + a·x + b·y, and the sums of x and of y.
struct Bilinear;
impl ClosedForm for Bilinear {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        const A: [[f64; 4]; 4] =
            [[0.0, -3.0, -3.0, 3.0], [0.0, 2.0, -2.0, 3.0], [-3.0, 1.0, -2.0, 1.0], [-1.0, 3.0, 3.0, 1.0]];
        let (x, y) = b.split_at(4);
        let sum = |v: &[S], weights: [f64; 4]| (0..4).fold(S::from(0.0), |sum, k| sum + v[k] * weights[k]);
        match h {
            0 => {
                let product = (0..4).fold(S::from(0.0), |total, i| total + x[i] * sum(y, A[i]));
                product + sum(x, [0.0, 1.0, 2.0, 0.0]) + sum(y, [-2.0, 2.0, 0.0, 1.0])
            }
            1 => sum(x, [1.0; 4]),
            _ => sum(y, [1.0; 4]),
        }
    }
}

/// Of one of two simplices no variable is free at the optimum, so that its multiplier comes from the bounds.
#[test]
fn a_vertex_of_a_simplex_is_an_optimum() {
    let end =
        solve(&problem(&[(0.5, 0.0, 1.0); 8], &[(1.0, true), (1.0, true)], |parts| parts.build_analytic(Bilinear)));
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    // The least value of a bilinear function in two simplices is that of a pair of vertices.
    assert!((end.evaluation.objective + 3.0).abs() < 1e-6, "{} at {:?}", end.evaluation.objective, end.design);
}

/// Area of a surface over the unit square by triangles with given edges, 7 × 7 free heights.
struct Surface;
impl ClosedForm for Surface {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        const N: usize = 7;
        let step = 1.0 / (N + 1) as f64;
        let edge = |k: usize| k as f64 * step * (1.0 - k as f64 * step);
        let height = |i: usize, k: usize| match (i, k) {
            (0, k) => S::from(edge(k)),
            (i, k) if i == N + 1 => S::from(-edge(k)),
            (_, k) if k == 0 || k == N + 1 => S::from(0.0),
            _ => b[(i - 1) * N + k - 1],
        };
        let cell = |i: usize, k: usize| {
            let [a, c] = [height(i + 1, k + 1) - height(i, k), height(i + 1, k) - height(i, k + 1)];
            ((a * a + c * c) * (0.5 / step / step) + 1.0).sqrt() * (step * step)
        };
        let cells = (0..=N).flat_map(|i| (0..=N).map(move |k| (i, k)));
        cells.fold(S::from(0.0), |sum, (i, k)| sum + cell(i, k))
    }
}

#[test]
fn a_run_ends_where_its_steps_change_the_objective_by_rounding_only() {
    for start in [0.0, 0.1] {
        let variables = [(start, FREE.0, FREE.1); 49];
        let end = solve(&problem(&variables, &[], |parts| parts.build_analytic(Surface)));
        assert_eq!(end.status, Status::Converged, "from {start}: {}", end.reason);
        assert!(end.counters.analyses < 75, "from {start}: {:?}", end.counters);
        // SciPy's trust-constr with exact derivatives: 1.1022509861720793.
        assert!((end.evaluation.objective - 1.102_250_986_172).abs() < 1e-11, "{}", end.evaluation.objective);
    }
}

/// A ripple of the second order about a constant, which leaves a rounding error of the constant.
struct Ripple;
impl ClosedForm for Ripple {
    fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
        let (x, y) = (b[0], b[1] - 0.8);
        let second = x * x * (t * 20.0).sin() + y * y * (t * 20.0).cos() + x * y * (t * 7.0).cos();
        (second + 3000.0) - 3000.0
    }
}

#[test]
fn a_peak_that_falls_to_rounding_is_an_optimum() {
    for start in [[-0.6, 0.9], [0.3, 0.2], [0.5, 0.5]] {
        let mut parts = ProblemBuilder::new("ripple");
        parts.variable(DesignVariable::new("x", "", start[0]));
        parts.variable(DesignVariable::new("y", "", start[1]));
        let time = parts.grid(TimeGrid::uniform(0.0, 0.628, 73).unwrap());
        let ripple = parts.transient("ripple", "", time);
        let peak = DesignVariable::new("peak", "", 0.5);
        parts.minimize_peak(peak, Quantity::response(time, ripple), 1.0);
        let end = solve(&parts.build_analytic(Ripple).unwrap());
        assert_eq!(end.status, Status::Converged, "from {start:?}: {}", end.reason);
        assert!(end.evaluation.objective.abs() < 1e-11, "from {start:?}: {}", end.evaluation.objective);
    }
}

/// Problem 365 of Schittkowski: rows are divided by √(x₀² + x₂²), which tends to zero.
struct Equilateral;
impl ClosedForm for Equilateral {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let p = (b[0] * b[0] + b[2] * b[2]).sqrt();
        let q = (b[2] * b[2] + (b[1] - b[0]).powi(2)).sqrt();
        let row = |k: usize| (b[0] * b[2] + (b[1] - b[0]) * b[k + 1] - b[2] * b[k]) / q;
        match h {
            0 => b[0] * b[2],
            1 => -(b[3] - b[5]).powi(2) - (b[4] - b[6]).powi(2) + 4.0,
            2 => -(b[2] * b[3] - b[0] * b[4]) / p + 1.0,
            3 => -(b[2] * b[5] - b[0] * b[6]) / p + 1.0,
            4 => -row(3) + 1.0,
            _ => -row(5) + 1.0,
        }
    }
}

#[test]
fn a_design_with_a_large_violation_has_not_converged() {
    let free = |start| (start, FREE.0, FREE.1);
    let variables = [
        (3.0, 0.0, FREE.1),
        free(0.0),
        (2.0, 0.0, FREE.1),
        free(-1.5),
        (1.5, 1.0, FREE.1),
        free(5.0),
        (0.0, 1.0, FREE.1),
    ];
    let variables = variables.map(|(start, lower, upper)| (f64::max(start, lower), lower, upper));
    let end = solve(&problem(&variables, &[(0.0, false); 5], |parts| parts.build_analytic(Equilateral)));
    let violation = end.evaluation.max_violation_pct();
    assert!(end.status != Status::Converged || violation <= 0.1, "{violation} %: {}", end.reason);
}

/// Problem 306 of Schittkowski with the sign that makes it unbounded: values of 1e305 overflow in sums.
struct Overflowing;
impl ClosedForm for Overflowing {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        -(-b[0] - b[1]).exp() * (b[0] * b[0] * 2.0 + b[1] * b[1] * 3.0)
    }
}

#[test]
fn an_objective_near_the_largest_number_has_not_converged() {
    let outputs = problem(&[(1.0, FREE.0, FREE.1); 2], &[], |parts| parts.build_analytic(Overflowing));
    let mut parts = ProblemBuilder::new("direct");
    for name in ["x", "y"] {
        parts.variable(DesignVariable::new(name, "", 1.0));
    }
    parts.minimize("f", "", Quantity::plain(function!(|p| Overflowing.response(0, p.design, p.design[0]))));
    let direct = parts.build_analytic(Overflowing).unwrap();
    for preset in presets() {
        for problem in [&outputs, &direct] {
            let end = (preset.method)().solve(problem, |_| ()).unwrap();
            assert_ne!(end.status, Status::Converged, "{}: {}", preset.name, end.reason);
        }
    }
}

#[test]
fn a_bounded_objective_that_starts_near_zero_is_not_called_unbounded() {
    // x⁴ − x², whose start is as good as zero; the run is cut off at its optimum and before it.
    struct Quartic;
    impl ClosedForm for Quartic {
        fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
            b[0].powi(4) - b[0].powi(2)
        }
    }
    let problem = problem(&[(1e-9, FREE.0, FREE.1)], &[], |parts| parts.build_analytic(Quartic));
    let whole = solve(&problem);
    assert_eq!(whole.status, Status::Converged, "{}", whole.reason);
    let trials = whole.history.len() - 1;
    for max_cycles in [trials - 1, trials - 2] {
        let method = Method::automatic();
        let stop = linkwright::sao::Stop { max_cycles, ..method.stop };
        let end = method.with_stop(stop).solve(&problem, |_| ()).unwrap();
        assert_eq!(end.status, Status::CycleLimit);
        assert!(!end.reason.contains("unbounded"), "{max_cycles}: {}", end.reason);
    }
}

/// x² + y with (x + y − 2)³ = 0: the slopes of the row vanish where it holds.
struct CubedRow;
impl ClosedForm for CubedRow {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        if h == 0 { b[0] * b[0] + b[1] } else { (b[0] + b[1] - 2.0).powi(3) }
    }
}

#[test]
fn no_run_is_lost_by_an_approximate_problem_that_is_not_finite() {
    let variables = [(1.0, FREE.0, FREE.1), (3.0, FREE.0, FREE.1)];
    let problem = problem(&variables, &[(0.0, true)], |parts| parts.build_analytic(CubedRow));
    for preset in presets() {
        let end = (preset.method)().solve(&problem, |_| ()).unwrap_or_else(|error| panic!("{}: {error}", preset.name));
        assert!(end.status != Status::Running && !end.reason.is_empty(), "{}: {:?}", preset.name, end.status);
    }
}

/// (Σ i³ (xᵢ − 1)²)^(1/3), whose derivatives at its minimum are not numbers.
struct CubeRoot;
impl Analysis for CubeRoot {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        Ok(Responses::new(vec![vec![Self::sum(b).cbrt()]]))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let factor = Self::sum(b).powf(-2.0 / 3.0) / 3.0;
        Ok(DMatrix::from_fn(1, b.len(), |_, j| factor * 2.0 * ((j + 1) as f64).powi(3) * (b[j] - 1.0)))
    }
}

impl CubeRoot {
    fn sum(b: &[f64]) -> f64 {
        b.iter().enumerate().map(|(j, b)| ((j + 1) as f64).powi(3) * (b - 1.0).powi(2)).sum()
    }
}

#[test]
fn a_design_without_derivatives_ends_a_run_with_its_history() {
    let problem = problem(&[(0.0, FREE.0, FREE.1); 3], &[], |parts| parts.build(CubeRoot));
    // Those without second derivatives, which this analysis does not have.
    for name in ["automatic", "slp", "slp-filter", "sqp-filter", "bfgs", "mma", "gcmma"] {
        let end = (preset(name).unwrap().method)().solve(&problem, |_| ());
        let end = end.unwrap_or_else(|error| panic!("{name}: {error}"));
        assert!(end.history.len() > 1 && end.status != Status::Running, "{name}: {:?}", end.status);
    }
    // A start without derivatives is an error.
    let at_start = self::problem(&[(1.0, FREE.0, FREE.1); 3], &[], |parts| parts.build(CubeRoot));
    assert!((preset("slp-filter").unwrap().method)().solve(&at_start, |_| ()).is_err());
}

/// A quartic with an even symmetry in an ellipsoid: runs that start at it come to zero, where all steps underflow.
struct ToZero;
impl ClosedForm for ToZero {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let sum =
            |weights: [f64; 3], power: i32| (0..3).fold(S::from(0.0), |sum, k| sum + b[k].powi(power) * weights[k]);
        if h == 0 { sum([1.4, 2.1, 1.8], 4) + sum([1.1, 0.7, 0.9], 2) } else { sum([1.4, 0.6, 0.9], 2) }
    }
}

#[test]
fn steps_that_underflow_are_no_error_of_the_problem() {
    for start in [[0.0, 0.0, 1e-9], [1e-60, 1e-80, 0.0], [1e-150, 1e-155, 1e-160]] {
        let variables = start.map(|b| (b, FREE.0, FREE.1));
        let problem = problem(&variables, &[(1.9, false)], |parts| parts.build_analytic(ToZero));
        for preset in presets() {
            let end = (preset.method)().solve(&problem, |_| ());
            let end = end.unwrap_or_else(|error| panic!("{} from {start:?}: {error}", preset.name));
            assert_ne!(end.status, Status::Running);
        }
    }
}

#[test]
fn a_start_that_nothing_improves_is_the_result() {
    struct Flat(fn(f64) -> f64);
    impl Analysis for Flat {
        fn analyze(&self, b: &[f64]) -> Result<Responses> {
            Ok(Responses::new(vec![vec![(self.0)(b[0])]]))
        }

        fn sensitivities(&self, b: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::zeros(1, b.len()))
        }
    }
    for function in [|_: f64| 3.0, f64::signum, |b: f64| if b > 1.0 { 1.0 } else { 2.0 }] {
        for (lower, upper) in [(0.5, 3.0), FREE] {
            let end = solve(&problem(&[(2.0, lower, upper)], &[], |parts| parts.build(Flat(function))));
            assert_eq!((end.status, &end.design[..]), (Status::Converged, &[2.0][..]), "{}", end.reason);
        }
    }
    for (lower, upper) in [(0.5, 3.0), FREE] {
        let mut parts = ProblemBuilder::new("direct");
        parts.variable(DesignVariable::new("a", "", 2.0).within(lower, upper));
        parts.minimize("f", "", Quantity::plain(function!(|p| p.design[0] * 0.0 + 3.0)));
        let end = solve(&parts.build_analytic(CubedRow).unwrap());
        assert_eq!((end.status, &end.design[..]), (Status::Converged, &[2.0][..]), "{}", end.reason);
    }
}

/// Brown's badly scaled function, with the minimum 0 at (1e6, 2e-6). From (1, 1) it falls from 1e12.
struct BadlyScaled;
impl ClosedForm for BadlyScaled {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        let [x, y, product] = [b[0] - 1e6, b[1] - 2e-6, b[0] * b[1] - 2.0];
        x * x + y * y + product * product
    }
}

/// A forward difference of (x − 10⁶)² with a step of one is zero half a step beside the minimum. The run ends there at 0.25, and its
/// conditions hold to the error of the differences only, which is small compared with 10¹².
#[test]
fn forward_differences_far_from_exact_are_no_convergence() {
    let variables = [(1.0, FREE.0, FREE.1); 2];
    let forward = || Differences::forward(Analytic::new(BadlyScaled, &[None]), 1e-6);
    let end = solve(&problem(&variables, &[], |parts| parts.build(forward()?)));
    assert_eq!(end.status, Status::Stalled, "F = {:e}: {}", end.evaluation.objective, end.reason);
    assert!(end.reason.contains("the optimality conditions hold to"), "{}", end.reason);
    assert!(end.reason.contains("forward differences"), "{}", end.reason);
    let exact = solve(&problem(&variables, &[], |parts| parts.build_analytic(BadlyScaled)));
    assert_eq!(exact.status, Status::Converged, "{}", exact.reason);
    assert!(exact.evaluation.objective < 1e-6, "{:e}", exact.evaluation.objective);
}

/// |x − 1| + 3 |y − ½|, whose kinks stop the run before its minimum.
struct Kinks;
impl ClosedForm for Kinks {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        (b[0] - 1.0).abs() + (b[1] - 0.5).abs() * 3.0
    }
}

#[test]
fn a_run_that_a_kink_stops_says_so() {
    let end =
        solve(&problem(&[(3.0, FREE.0, FREE.1), (-2.0, FREE.0, FREE.1)], &[], |parts| parts.build_analytic(Kinks)));
    assert_eq!(end.status, Status::Stalled, "F = {}: {}", end.evaluation.objective, end.reason);
    assert!(end.reason.contains("a response has a kink here"), "{}", end.reason);
}

/// 1 + (x − 0.3)² + 4 (y + 0.2)² + 0.3 x y with noise of 1 %, which differs between neighbouring designs, and its derivatives without noise.
struct NoisyBowl(u64);
impl Analysis for NoisyBowl {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        // The bits of the design, mixed as by the generator SplitMix64.
        let mixed = b.iter().fold(self.0, |seed, x| {
            let z = (seed ^ x.to_bits()).wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        });
        let u = 2.0 * (mixed >> 11) as f64 / (1u64 << 53) as f64 - 1.0;
        let f = 1.0 + (b[0] - 0.3).powi(2) + 4.0 * (b[1] + 0.2).powi(2) + 0.3 * b[0] * b[1];
        Ok(Responses::new(vec![vec![f * (1.0 + 0.01 * u)]]))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let slopes = [2.0 * (b[0] - 0.3) + 0.3 * b[1], 8.0 * (b[1] + 0.2) + 0.3 * b[0]];
        Ok(DMatrix::from_fn(wanted.len(), 2, |_, i| slopes[i]))
    }
}

/// Noise of 1 % is not taken for a kink: its errors do not fall with the step. With differences of noise, both are possible, and the reason says so.
#[test]
fn noise_is_no_kink() {
    let variables = [(1.7, -5.0, 5.0), (-1.3, -5.0, 5.0)];
    for seed in 0..40 {
        type Build = fn(ProblemBuilder, NoisyBowl) -> Result<Problem>;
        let builds: [Build; 4] = [
            |parts, bowl| parts.build(bowl),
            |parts, bowl| parts.build(Differences::forward(bowl, 1e-4)?),
            |parts, bowl| parts.build(Differences::central(bowl, 1e-2)?),
            |parts, bowl| parts.build(Differences::noise_aware(bowl)),
        ];
        for (k, build) in builds.into_iter().enumerate() {
            let end = solve(&problem(&variables, &[], |parts| build(parts, NoisyBowl(seed))));
            assert!(!end.reason.contains("a response has a kink here"), "{seed} {k}: {}", end.reason);
        }
    }
}

/// t² − x t − y on [0, 1].
struct Parabola;
impl ClosedForm for Parabola {
    fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
        t * t - b[0] * t - b[1]
    }
}

/// The scale of a peak is that at the start, which is a rounding error where it should be zero.
#[test]
fn a_peak_whose_scale_is_a_rounding_error_is_minimized() {
    for scale in [1.0, 1e-17] {
        let mut parts = ProblemBuilder::new("parabola");
        for (name, start) in [("x", 2.0), ("y", 0.5)] {
            parts.variable(DesignVariable::new(name, "", start));
        }
        let time = parts.grid(TimeGrid::uniform(0.0, 1.0, 101).unwrap());
        let off = parts.transient("off", "", time);
        parts.minimize_peak(DesignVariable::new("peak", "", 3.0), Quantity::response(time, off), scale);
        let end = solve(&parts.build_analytic(Parabola).unwrap());
        assert_eq!(end.status, Status::Converged, "{scale:e}: {}", end.reason);
        assert!((end.evaluation.objective - 0.125).abs() < 1e-9, "{scale:e}: {}", end.evaluation.objective);
    }
}
