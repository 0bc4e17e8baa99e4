//! The automatic method: what it claims is true, and does not depend on units.

use linkwright::autodiff::Scalar;
use linkwright::cases::suite::{self, Transformation, Verdict};
use linkwright::cases::{find, impact_absorber, slider_crank};
use linkwright::function;
use linkwright::problem::{
    Analysis, ClosedForm, Constraint, DesignVariable, Intermediate, Intermediates, Problem, ProblemBuilder, Quantity,
    ResponseAt, Responses, TimeGrid,
};
use linkwright::sao::{Method, RunState, Screening, Status, preset};
use linkwright::{Error, Result};
use nalgebra::DMatrix;
use std::sync::Mutex;

fn solve(problem: &Problem) -> RunState {
    Method::automatic().solve(problem, |_| ()).unwrap()
}

fn case(name: &str) -> Problem {
    (find(name).unwrap().build)().unwrap()
}

/// Numbers of analyses and sensitivity analyses.
fn work(state: &RunState) -> [usize; 2] {
    [state.counters.analyses, state.counters.sensitivity_analyses]
}

struct FarSquare;
impl ClosedForm for FarSquare {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        (b[0] - 1000.0).powi(2)
    }
}

fn far_square(start: f64) -> Problem {
    let mut parts = ProblemBuilder::new("far square");
    parts.variable(DesignVariable::new("x", "", start));
    let f = parts.constant("f", "");
    parts.minimize("f", "", Quantity::response(None, f));
    parts.build_analytic(FarSquare).unwrap()
}

#[test]
fn a_start_far_from_the_minimum_is_no_convergence() {
    for start in [1e-3, 0.0, -5.0] {
        let end = solve(&far_square(start));
        assert_eq!(end.status, Status::Converged, "{}", end.reason);
        assert!((end.design[0] - 1000.0).abs() < 1e-3, "from {start}: {:?}", end.design);
    }
}

#[test]
fn hs_100_from_its_start_with_zeros_reaches_the_optimum() {
    let end = solve(&case("hs100"));
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    assert!((end.evaluation.objective / 680.630_057_3 - 1.0).abs() < 1e-5, "{}", end.evaluation.objective);
}

#[test]
fn feasible_problems_with_large_first_violations_are_not_called_infeasible() {
    for (name, optimum) in [("hs71", 17.014_017_3), ("hs106", 7049.248)] {
        let end = solve(&case(name));
        assert_eq!(end.status, Status::Converged, "{name}: {}", end.reason);
        assert!((end.evaluation.objective / optimum - 1.0).abs() < 1e-5, "{name}: {}", end.evaluation.objective);
    }
}

#[test]
fn units_do_not_change_the_run() {
    for name in ["hs43", "hs71", "hs100", "maratos"] {
        let entry = find(name).unwrap();
        let run = |text: &str| solve(&Transformation::parse(text).unwrap().build(entry).unwrap());
        let plain = run("standard");
        let same = ["objective=1e-6", "objective=1e6", "objective=1e-12", "constraints=1e-3", "constraints=1e3"];
        for text in same.into_iter().chain(["variables=1e-3", "variables=1e3"]) {
            let end = run(text);
            assert_eq!(end.status, plain.status, "{name}, {text}: {}", end.reason);
            let (one, other) = (work(&end), work(&plain));
            let differ = |k: usize| one[k].abs_diff(other[k]) as f64 > 0.2 * other[k] as f64;
            assert!(!differ(0) && !differ(1), "{name}, {text}: {one:?} instead of {other:?}");
        }
    }
}

#[test]
fn an_infeasible_problem_ends_at_a_stationary_point_of_the_violation_and_says_so() {
    let end = solve(&case("infeasible"));
    assert_eq!(end.status, Status::Infeasible);
    assert!(end.reason.contains("the violation is stationary here"), "{}", end.reason);
    // x₁² + x₂² − 1 and 3 − x₁ − x₂ are both 1 at (1, 1), where their largest value is least.
    assert!(end.design.iter().all(|b| (b - 1.0).abs() < 1e-3), "{:?}", end.design);
    assert!((end.evaluation.worst().unwrap().1 - 1.0).abs() < 1e-3, "{:?}", end.evaluation.worst());
}

/// x² + y² between two circles, on the line x + y = 1 with y ≥ 0.5.
struct Ring;
impl ClosedForm for Ring {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        match h {
            0 => b[0] * b[0] + b[1] * b[1],
            1 => b[0] + b[1],
            _ => b[1] + 1.5,
        }
    }
}

#[test]
fn a_strict_local_minimum_of_the_violation_is_left_for_a_feasible_design() {
    // Where x > 0.5, all violations are equal in one point, and each change makes one of them larger.
    for (x, y) in [(1.0, 0.5), (0.9, 0.4), (1.2, 0.6), (1.0, 0.0), (0.8, 0.6)] {
        let mut parts = ProblemBuilder::new("ring");
        parts.variable(DesignVariable::new("x", "", x));
        parts.variable(DesignVariable::new("y", "", y));
        let [radius, sum, height] =
            ["radius", "sum", "height"].map(|name| Quantity::response(None, parts.constant(name, "")));
        parts.minimize("f", "", radius.clone());
        parts.subject_to(Constraint::equal("line", 1.0, sum));
        parts.subject_to(Constraint::at_least("height", 2.0, height));
        parts.subject_to_both(Constraint::between("ring", [0.6, 0.9], radius));
        let end = solve(&parts.build_analytic(Ring).unwrap());
        assert_eq!(end.status, Status::Converged, "from {x}, {y}: {}", end.reason);
        assert!((end.evaluation.objective - 0.6).abs() < 1e-6, "{}", end.evaluation.objective);
    }
}

#[test]
fn points_where_no_step_leads_on_are_left() {
    for (name, optimum) in [
        // The first step leads to zeros, where the rows depend on two variables in second order only.
        ("hs89", 1.362_656_8),
        // Large curvatures of opposite sign across the active rows, and nearly none along them.
        ("hs116", 97.587_509_6),
        // The powers of a variable at its small lower bound are so curved that their subproblem has no step.
        ("hs102", 911.880_571),
    ] {
        let end = solve(&case(name));
        assert_eq!(end.status, Status::Converged, "{name}: {}", end.reason);
        assert!((end.evaluation.objective / optimum - 1.0).abs() < 1e-5, "{name}: {}", end.evaluation.objective);
    }
}

/// The sum of squares of an exponential decay against its values, rounded to six digits: its least value is a trace of rounding.
struct Decay;
impl ClosedForm for Decay {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        (0..12).fold(S::from(0.0), |sum, k| {
            let t = 0.3 * f64::from(k);
            let measured = ((3.0 * (-0.8 * t).exp() + 0.5) * 1e6).round() / 1e6;
            sum + ((b[1] * -t).exp() * b[0] + b[2] - measured).powi(2)
        })
    }
}

/// (x − 3)² + 0.1 (x − 3)⁴ + 10⁻¹².
struct NearlyZero;
impl ClosedForm for NearlyZero {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        (b[0] - 3.0).powi(2) + (b[0] - 3.0).powi(4) * 0.1 + 1e-12
    }
}

#[test]
fn a_least_value_that_is_tiny_beside_its_range_is_convergence() {
    let problem = |start: &[f64], function: &dyn Fn(ProblemBuilder) -> Problem| {
        let mut parts = ProblemBuilder::new("tiny");
        start.iter().enumerate().for_each(|(k, b)| {
            parts.variable(DesignVariable::new(format!("b{k}"), "", *b));
        });
        let f = parts.constant("f", "");
        parts.minimize("f", "", Quantity::response(None, f));
        function(parts)
    };
    let decay = |parts: ProblemBuilder| parts.build_analytic(Decay).unwrap();
    let nearly_zero = |parts: ProblemBuilder| parts.build_analytic(NearlyZero).unwrap();
    let starts = [[1.0, 1.0, 0.0], [2.0, 0.3, 1.0], [10.0, 2.0, 0.0], [0.5, 0.5, 10.0]];
    let fits = starts.iter().map(|start| problem(start, &decay));
    for problem in fits.chain([problem(&[1.0], &nearly_zero), problem(&[-7.0], &nearly_zero)]) {
        let end = solve(&problem);
        assert_eq!(end.status, Status::Converged, "from {:?}: {}", problem.start(), end.reason);
        assert!(end.evaluation.objective < 1e-11, "{}", end.evaluation.objective);
    }
}

/// Objectives without a lower limit: −x, −x², −eˣ, x³.
struct Falling(usize);
impl ClosedForm for Falling {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        match self.0 {
            0 => -b[0],
            1 => -(b[0] * b[0]),
            2 => -b[0].exp(),
            _ => b[0] * b[0] * b[0],
        }
    }
}

#[test]
fn an_unbounded_problem_does_not_converge() {
    let falls = "seems to be unbounded";
    let end = solve(&case("unbounded"));
    assert!(end.status == Status::Stalled && end.reason.contains(falls), "{:?}: {}", end.status, end.reason);
    for (k, start) in [(0, 0.0), (0, 1.0), (1, 1.0), (2, 0.0), (3, 1.0), (3, -1.0)] {
        let mut parts = ProblemBuilder::new("falling");
        parts.variable(DesignVariable::new("x", "", start));
        let f = parts.constant("f", "");
        parts.minimize("f", "", Quantity::response(None, f));
        let end = solve(&parts.build_analytic(Falling(k)).unwrap());
        println!("{k} from {start}: {:?}, {}", end.status, end.reason);
        assert_ne!(end.status, Status::Converged, "{k} from {start}: {}", end.reason);
    }
}

/// −2 x² y with x y ≤ 0.8 and y ≥ 0.5: the optimum is a vertex. With L = xy and y the optimum is −2 L² / y.
struct Vertex;
impl ClosedForm for Vertex {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let (x, y) = (b[0], b[1]);
        [-x * x * y * 2.0, x * y, y][h]
    }
}

fn vertex(start: [f64; 2]) -> Problem {
    let mut parts = ProblemBuilder::new("vertex");
    parts.variable(DesignVariable::new("x", "", start[0]).within(0.1, 10.0));
    parts.variable(DesignVariable::new("y", "", start[1]).within(0.1, 10.0));
    let [f, area, height] = ["f", "area", "height"].map(|name| parts.constant(name, ""));
    parts.minimize("f", "", Quantity::response(None, f));
    parts.subject_to(Constraint::at_most("area", 0.8, Quantity::response(None, area)));
    parts.subject_to(Constraint::at_least("height", 0.5, Quantity::response(None, height)));
    parts.build_analytic(Vertex).unwrap()
}

#[test]
fn multipliers_are_those_at_the_last_design() {
    // dF*/dL · L and −dF*/dy · y, relative to the limits.
    let exact = [4.0 * 0.8 * 0.8 / 0.5, 2.0 * 0.8 * 0.8 / 0.5];
    for start in [[1.0, 1.0], [1.6, 0.5]] {
        let end = solve(&vertex(start));
        assert_eq!(end.status, Status::Converged, "{}", end.reason);
        let rows = end.active_rows();
        assert_eq!(rows.len(), 2, "from {start:?}: {rows:?}");
        for (row, exact) in rows.iter().zip(exact) {
            assert!((row.multiplier / exact - 1.0).abs() < 1e-5, "from {start:?}: {rows:?}, exact {exact}");
        }
    }
}

struct Paraboloid;
impl ClosedForm for Paraboloid {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        b[0] * b[0] + b[1] * b[1]
    }
}

fn paraboloid(start: [f64; 2], bounds: [f64; 2]) -> Problem {
    let mut parts = ProblemBuilder::new("paraboloid");
    parts.variable(DesignVariable::new("x", "", start[0]).within(bounds[0], bounds[1]));
    parts.variable(DesignVariable::new("y", "", start[1]).within(-1.0, 1.0));
    let f = parts.constant("f", "");
    parts.minimize("f", "", Quantity::response(None, f));
    parts.build_analytic(Paraboloid).unwrap()
}

#[test]
fn a_start_at_an_optimum_is_confirmed_by_every_method() {
    for preset in linkwright::sao::presets() {
        let end = (preset.method)().solve(&paraboloid([0.0, 0.0], [-1.0, 1.0]), |_| ()).unwrap();
        assert_eq!(
            (end.status, &end.design[..]),
            (Status::Converged, &[0.0, 0.0][..]),
            "{}: {}",
            preset.name,
            end.reason
        );
    }
}

#[test]
fn bounds_far_away_are_no_lengths() {
    for upper in [1e2, 1e6, 1e10, 1e20] {
        let end = solve(&paraboloid([1.0, 0.7], [-upper, upper]));
        assert_eq!(end.status, Status::Converged, "{upper}: {}", end.reason);
        assert!(end.evaluation.objective < 1e-10, "{upper}: {}", end.evaluation.objective);
    }
}

/// Other programs write 1e6 or 1e20 for no bound. Lengths from such ranges made the conditions of an optimum so strict that runs ended as stalled at it.
#[test]
fn wide_bounds_in_place_of_none_do_not_change_the_verdict() {
    let names =
        ["hs1", "hs6", "hs26", "hs39", "hs43", "hs48", "hs77", "hs79", "hs100", "hs112", "saddle", "slider-crank"];
    for name in names {
        let entry = suite::problems().find(|entry| entry.name == name).unwrap();
        let free = Transformation::default().build(entry).unwrap();
        for bound in [1e6, 1e10, 1e20] {
            let mut problem = Transformation::default().build(entry).unwrap();
            for variable in &mut problem.variables {
                let [lower, upper] = [variable.lower.max(-bound), variable.upper.min(bound)];
                *variable = variable.clone().within(lower, upper);
            }
            let end = solve(&problem);
            assert_eq!(end.status, Status::Converged, "{name} within {bound:e}: {}", end.reason);
            let found =
                suite::verify_claim(entry, &Transformation::default(), &free, end.status.into(), &end.design).unwrap();
            assert!(
                matches!(found.verdict, Verdict::Optimum | Verdict::LocalOptimum),
                "{name} within {bound:e}: {found:?}"
            );
        }
    }
}

#[test]
fn an_objective_is_not_zero_beside_that_of_a_start_far_away() {
    for (name, start) in [("hs49", "start=1e4"), ("quartic", "start=1e4"), ("hs57", "start=-1e2"), ("hs1", "start=1e6")]
    {
        let (entry, transformation) = (find(name).unwrap(), Transformation::parse(start).unwrap());
        let problem = transformation.build(entry).unwrap();
        let end = solve(&problem);
        let verification =
            suite::verify_claim(entry, &transformation, &problem, suite::Claim::from(end.status), &end.design);
        assert_ne!(verification.unwrap().verdict, Verdict::False, "{name}, {start}: {}", end.reason);
    }
}

#[test]
fn a_start_without_any_slope_is_left() {
    // −x y z of HS 37 is flat at the origin, which is not a minimum.
    let entry = find("hs37").unwrap();
    let end = solve(&Transformation::parse("start=0").unwrap().build(entry).unwrap());
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    assert!((end.evaluation.objective + 3456.0).abs() < 1e-2, "{}", end.evaluation.objective);
}

#[test]
fn runs_continue_with_the_same_bits_from_every_cycle() {
    for problem in [impact_absorber::comfort().unwrap(), case("hs71"), case("hs6")] {
        let (method, mut files) = (Method::automatic(), vec![]);
        let whole = method.solve(&problem, |state| files.push(state.to_json())).unwrap().to_json();
        for file in &files {
            let read = RunState::from_json(file, &problem).unwrap();
            assert_eq!(&read.to_json(), file);
            assert_eq!(method.resume(&problem, read, |_| ()).unwrap().to_json(), whole);
        }
    }
}

/// Rosenbrock's function; analysis or derivatives fail in a part of the design space.
struct Failing {
    derivatives: bool,
}

impl Analysis for Failing {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        if !self.derivatives && b[0] > 1.05 {
            return Err(Error::unsupported("assembly", "the loop does not close", "shorten the crank"));
        }
        Ok(Responses::new(vec![vec![100.0 * (b[1] - b[0] * b[0]).powi(2) + (1.0 - b[0]).powi(2)]]))
    }

    fn sensitivities(&self, b: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
        if self.derivatives && b[0] > 1.05 {
            return Err(Error::unsupported("assembly", "the Jacobian is singular", "shorten the crank"));
        }
        let slope = b[1] - b[0] * b[0];
        Ok(DMatrix::from_row_slice(1, 2, &[-400.0 * b[0] * slope - 2.0 * (1.0 - b[0]), 200.0 * slope]))
    }
}

#[test]
fn failed_analyses_and_failed_derivatives_are_rejected_tries() {
    for derivatives in [false, true] {
        let mut parts = ProblemBuilder::new("failing");
        parts.variable(DesignVariable::new("x", "", 0.9));
        parts.variable(DesignVariable::new("y", "", -1.0));
        let f = parts.constant("f", "");
        parts.minimize("f", "", Quantity::response(None, f));
        let end = solve(&parts.build(Failing { derivatives }).unwrap());
        assert_eq!(end.status, Status::Converged, "{}", end.reason);
        assert!(end.evaluation.objective < 1e-8, "{:?}", end.design);
        let failed = |c: &&linkwright::sao::Cycle| c.failure.is_some();
        assert!(end.history.iter().filter(failed).all(|c| !c.accepted));
    }
}

#[test]
fn an_explicit_objective_that_is_undefined_at_a_trial_is_a_rejected_try() {
    let end = solve(&case("arcsine"));
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
}

/// The absorber of the paper.
struct Absorber;
impl ClosedForm for Absorber {
    fn response<S: Scalar>(&self, h: usize, b: &[S], t: S) -> S {
        impact_absorber::motion(b[0], b[1], t)[h]
    }
}

fn absorber(points: usize) -> Problem {
    let mut parts = ProblemBuilder::new("absorber");
    parts.variable(DesignVariable::new("stiffness", "N/m", 1.0).within(1e-6, 1.0));
    parts.variable(DesignVariable::new("damping", "N·s/m", 0.3).within(1e-6, 1.0));
    let time = parts.grid(TimeGrid::uniform(0.0, 12.0, points).unwrap());
    let y = parts.transient("displacement", "m", time);
    let a = parts.transient("acceleration", "m/s²", time);
    let peak = DesignVariable::new("peak", "m/s²", 0.85).within(0.0, f64::INFINITY);
    parts.minimize_peak(peak, Quantity::response(time, a), 1.0);
    parts.subject_to(Constraint::at_most("travel", 1.0, Quantity::response(time, y)));
    parts.build_analytic(Absorber).unwrap()
}

#[test]
fn the_number_of_time_points_changes_neither_the_result_nor_the_work() {
    let ends = [101, 10_001].map(|points| solve(&absorber(points)));
    for end in &ends {
        assert_eq!(end.status, Status::Converged, "{}", end.reason);
        assert!(end.counters.analyses <= 11, "{:?}", end.counters);
        let rejected = end.history.windows(2).filter(|pair| pair.iter().all(|cycle| !cycle.accepted));
        assert!({ rejected }.all(|pair| pair[0].design != pair[1].design), "a design was analysed twice");
    }
    // The coarse grid misses the peak by 3e-4.
    let optimum = impact_absorber::continuous_peak_acceleration_optimum().objective;
    assert!((ends[1].evaluation.objective - optimum).abs() < 1e-6, "{}", ends[1].evaluation.objective);
    let retained = |end: &RunState| end.history.last().unwrap().retained.len();
    assert!(retained(&ends[1]) < 3 * retained(&ends[0]), "{} and {}", retained(&ends[0]), retained(&ends[1]));
}

/// The bound variable of a peak is at the peak of each design: its start is no guess on which the run depends, and designs are feasible if
/// the stated constraints are.
#[test]
fn a_peak_counts_as_it_is_and_not_as_its_bound_was_guessed() {
    let run = |guess: f64| {
        let mut problem = absorber(101);
        let bound = problem.objective.peak().unwrap().variable;
        problem.variables[bound].start = guess;
        let end = solve(&problem);
        for cycle in end.history.iter().filter(|cycle| cycle.failure.is_none()) {
            let peak = cycle.peak.unwrap();
            assert!(
                (cycle.objective - peak).abs() < 1e-12 * peak,
                "cycle {}: {} and {peak}",
                cycle.cycle,
                cycle.objective
            );
        }
        end
    };
    let ends = [1e-3, 0.85, 40.0].map(run);
    for end in &ends {
        assert_eq!(end.status, Status::Converged, "{}", end.reason);
        assert_eq!((&end.design, work(end)), (&ends[0].design, work(&ends[0])));
    }
}

/// An analysis that is asked only for derivatives of designs that it has analysed.
struct Remembering {
    inner: Box<dyn Analysis>,
    analysed: Mutex<Vec<Vec<f64>>>,
}

impl Analysis for Remembering {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        self.analysed.lock().unwrap().push(b.to_vec());
        self.inner.analyze(b)
    }

    fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        assert!(self.analysed.lock().unwrap().iter().any(|analysed| analysed == b), "what is stored for {b:?} is lost");
        self.inner.sensitivities(b, responses, wanted)
    }
}

/// Stored steps of an analysis are found again by its design, which must not change with the bound.
#[test]
fn the_bound_of_a_peak_is_no_other_design_for_the_analysis() {
    let mut problem = absorber(101);
    let inner = std::mem::replace(&mut problem.analysis, Box::new(Failing { derivatives: false }));
    problem.analysis = Box::new(Remembering { inner, analysed: Mutex::default() });
    let end = solve(&problem);
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    assert!(end.counters.sensitivity_analyses > 2);
}

/// The bound may be larger than the peak: stiffness + 1 ≤ bound, with a peak below 1.
#[test]
fn a_constraint_on_the_bound_of_a_peak_can_be_satisfied() {
    let mut parts = ProblemBuilder::new("bounded bound");
    parts.variable(DesignVariable::new("stiffness", "N/m", 1.0).within(0.1, 1.0));
    parts.variable(DesignVariable::new("damping", "N·s/m", 0.3).within(1e-6, 1.0));
    let time = parts.grid(TimeGrid::uniform(0.0, 12.0, 101).unwrap());
    let _ = parts.transient("displacement", "m", time);
    let a = parts.transient("acceleration", "m/s²", time);
    let peak = DesignVariable::new("peak", "m/s²", 0.85).within(0.0, f64::INFINITY);
    parts.minimize_peak(peak, Quantity::response(time, a), 1.0);
    parts.subject_to(Constraint::at_most("margin", -1.0, Quantity::plain(function!(|p| p.design[0] - p.design[2]))));
    let end = solve(&parts.build_analytic(Absorber).unwrap());
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    assert!((end.evaluation.objective - 1.1).abs() < 1e-9, "{:?}", end.design);
}

/// Force of a contact that is open below x = 3.
struct Contact;
impl ClosedForm for Contact {
    fn response<S: Scalar>(&self, _: usize, b: &[S], _: S) -> S {
        let depth = b[0] - 3.0;
        if depth.re() > 0.0 { depth.powi(2) + b[1] } else { S::from(0.0) }
    }
}

/// Zero derivatives are no certificate that no design is feasible: those with x > 3.5 are.
#[test]
fn a_constraint_that_depends_on_nothing_is_not_called_infeasible() {
    let mut parts = ProblemBuilder::new("contact");
    parts.variable(DesignVariable::new("x", "", 1.0).within(0.0, 10.0));
    parts.variable(DesignVariable::new("y", "", 0.5).within(0.0, 0.6));
    let force = parts.constant("force", "N");
    parts.minimize("x", "", Quantity::variable(0));
    parts.subject_to(Constraint::at_least("contact force", 1.0, Quantity::response(None, force)));
    let end = solve(&parts.build_analytic(Contact).unwrap());
    assert_eq!(end.status, Status::Stalled, "{}", end.reason);
    assert!(
        end.reason.contains("contact force is violated by 100.000 %, and does not depend on the design"),
        "{}",
        end.reason
    );
}

/// Weight of five segments and the deflection of their tip.
struct Cantilever;
impl ClosedForm for Cantilever {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let factors = [61.0, 37.0, 19.0, 7.0, 1.0];
        let sum = |term: &dyn Fn(usize) -> S| (0..5).fold(S::from(0.0), |sum, k| sum + term(k));
        if h == 0 { sum(&|k| b[k] * 0.0624) } else { sum(&|k| b[k].powi(-3) * factors[k]) }
    }
}

#[test]
fn a_response_is_approximated_in_the_intermediate_variables_that_the_user_gave() {
    let run = |intermediates: Option<Intermediates>| {
        let mut parts = ProblemBuilder::new("cantilever");
        (1..=5).for_each(|k| {
            parts.variable(DesignVariable::new(format!("x{k}"), "m", 5.0).within(0.1, 100.0));
        });
        let [weight, deflection] = ["weight", "deflection"].map(|name| parts.constant(name, ""));
        parts.minimize("weight", "", Quantity::response(None, weight));
        parts.subject_to(Constraint::at_most("deflection", 1.0, Quantity::response(None, deflection)));
        if let Some(intermediates) = intermediates {
            parts.linearize_in(deflection, intermediates);
        }
        solve(&parts.build_analytic(Cantilever).unwrap())
    };
    let (plain, exact) = (run(None), run(Some(Intermediates::all(5, Intermediate::Power(-3.0)))));
    for end in [&plain, &exact] {
        assert_eq!(end.status, Status::Converged, "{}", end.reason);
        assert!((end.evaluation.objective - 1.339_956).abs() < 1e-5, "{}", end.evaluation.objective);
    }
    // The other trial steps show that the curvature is positive in the directions that this step did not have.
    assert_eq!(exact.cycles(), 1, "exact approximations need one step");
    assert!(exact.counters.analyses < plain.counters.analyses);
}

/// Two springs; the objective is an explicit function of the responses.
struct TwoForces;
impl ClosedForm for TwoForces {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        if h == 0 { b[0] * b[1] - 2.0 } else { b[0] - b[1] * 3.0 + 1.0 }
    }
}

#[test]
fn explicit_functions_of_responses_keep_their_form() {
    let mut parts = ProblemBuilder::new("least squares");
    parts.variable(DesignVariable::new("x", "", 1.0));
    parts.variable(DesignVariable::new("y", "", 3.0));
    let forces = ["first", "second"].map(|name| parts.constant(name, "N"));
    let squares = function!(|p| p.response[0].powi(2) + p.response[1].powi(2));
    parts.minimize("sum of squares", "N²", Quantity::plain(squares).of(&forces));
    parts.subject_to(Constraint::at_most(
        "limit",
        10.0,
        Quantity::plain(function!(|p| p.design[0] + p.design[1].powi(2))),
    ));
    let end = solve(&parts.build_analytic(TwoForces).unwrap());
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    // Linear models of the two forces give Gauss-Newton steps: x y = 2 and x = 3 y − 1 at (2, 1).
    assert!(end.evaluation.objective < 1e-10 && (end.design[0] - 2.0).abs() < 1e-4, "{:?}", end.design);
    assert!(end.counters.analyses <= 11, "{:?}", end.counters);
}

#[test]
fn problems_of_the_paper_need_no_more_designs_than_its_method() {
    let problems = [
        (impact_absorber::peak_acceleration().unwrap(), 0.520_286, [5, 4]),
        (impact_absorber::comfort().unwrap(), 0.038_037_8, [8, 7]),
        (slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap(), 3.746_106, [12, 11]),
    ];
    for (problem, optimum, most) in problems {
        let mut first = None;
        let end = Method::automatic()
            .solve(&problem, |state| {
                let near = (state.evaluation.objective / optimum - 1.0).abs() < 1e-5
                    && state.evaluation.max_violation_pct() < 1e-4;
                first = first
                    .or(near
                        .then_some([state.counters.analyses, state.counters.sensitivity_analyses.saturating_sub(1)]));
            })
            .unwrap();
        let found = first.unwrap_or([usize::MAX; 2]);
        assert!(found[0] <= most[0] && found[1] <= most[1], "{}: {found:?}, {}", problem.name, end.reason);
    }
}

#[test]
fn no_claim_about_a_problem_of_the_suites_is_false() {
    let entries: Vec<_> = suite::problems().filter(|entry| !entry.expensive).collect();
    let runs = suite::run(&entries, &[Transformation::default()], &[preset("automatic").unwrap()]).unwrap();
    let of = |wanted: &dyn Fn(Verdict) -> bool| -> Vec<&str> {
        runs.iter().filter(|run| run.verification.is_some_and(|j| wanted(j.verdict))).map(|run| run.problem).collect()
    };
    let wrong = of(&|v| v == Verdict::False);
    assert!(wrong.is_empty(), "false: {wrong:?}");
    let unsolved = of(&|v| !v.is_solved());
    assert!(100 * unsolved.len() <= 5 * runs.len(), "{} of {} unsolved: {unsolved:?}", unsolved.len(), runs.len());
}

/// Screening removes all rows at a heavy start, so that nothing keeps the first step from the lower bounds: the step is repeated with the
/// rows that it violates.
#[test]
fn a_step_that_violates_rows_which_screening_has_removed_is_repeated_with_them() {
    let method = Method::automatic().with_screening(Screening::above(0.5));
    let problem = case("cantilever");
    let end = method.resume(&problem, method.start_at(&problem, vec![8.0; 5]).unwrap(), |_| ()).unwrap();
    assert_eq!(end.status, Status::Converged, "{}", end.reason);
    let largest = end.history.iter().filter(|c| c.accepted).map(|c| c.violation_pct).fold(0.0, f64::max);
    assert!(largest < 100.0, "a design is accepted that violates by {largest} %");
    let seen: Vec<_> = end.history.iter().map(|c| (c.accepted, c.objective, c.violation_pct)).collect();
    assert!(end.history.iter().any(|c| !c.accepted && c.violation_pct > 100.0), "no step was repeated: {seen:?}");
}

/// Starts of the flexible four-bar mechanism within 30 % of the paper's.
#[test]
fn the_flexible_four_bar_converges_from_starts_around_that_of_the_paper() {
    let (method, problem) = (Method::automatic(), case("four-bar"));
    let start = problem.start();
    for signs in [[0, 0, 0], [-1, 0, 1], [1, 1, -1], [0, -1, 1], [1, 0, 0], [-1, 1, 1]] {
        let design = start.iter().zip(signs).map(|(b, s)| b * (1.0 + 0.29 * f64::from(s))).collect();
        let end = method.resume(&problem, method.start_at(&problem, design).unwrap(), |_| ()).unwrap();
        let largest = end.history.iter().filter(|c| c.accepted).map(|c| c.violation_pct).fold(0.0, f64::max);
        assert_eq!(end.status, Status::Converged, "{signs:?} after {:?}: {}", work(&end), end.reason);
        assert!(end.evaluation.max_violation_pct() < 1e-3 && largest < 200.0, "{signs:?}: {largest} %");
    }
}
