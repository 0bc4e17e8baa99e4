//! Claims of runs are true, for every preset: convergence, infeasibility, and the problem as it is when a run is continued.

use linkwright::autodiff::Scalar;
use linkwright::cases::suite::{self, Transformation, Verdict};
use linkwright::cases::{find, impact_absorber};
use linkwright::problem::{ClosedForm, Constraint, DesignVariable, Problem, ProblemBuilder, Quantity};
use linkwright::sao::{Method, Preset, RunState, Status, Stop, preset, presets};

fn all_presets() -> Vec<&'static Preset> {
    presets().iter().collect()
}

fn suite_problem(name: &str) -> Problem {
    Transformation::default().build(find(name).unwrap()).unwrap()
}

/// The runs whose claims are false.
fn false_claims(problems: &[&str], transformations: &[&str], presets: &[&'static Preset]) -> Vec<String> {
    let entries: Vec<_> = problems.iter().map(|name| find(name).unwrap()).collect();
    let transformations: Vec<_> = transformations.iter().map(|text| Transformation::parse(text).unwrap()).collect();
    let runs = suite::run(&entries, &transformations, presets).unwrap();
    let wrong = runs.iter().filter(|run| run.verification.is_some_and(|j| j.verdict == Verdict::False));
    wrong.map(|run| format!("{} on {}, {}", run.method, run.problem, run.transformation)).collect()
}

#[test]
fn a_length_from_the_start_is_no_unit_of_convergence() {
    let problems =
        ["far-minimum", "hs25", "small-start-convex", "tiny-start-convex", "tiny-start-bounded", "small-start-wells"];
    let wrong = false_claims(&problems, &["standard", "objective=1e-12"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_small_objective_is_no_sign_of_convergence() {
    let wrong = false_claims(&["small-objective", "hs57"], &["standard"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn feasible_problems_are_not_called_infeasible() {
    let wrong = false_claims(&["hs53", "hs71"], &["standard"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_variable_on_which_nothing_depended_is_moved() {
    // The start of HS 33 has x₂ = 0, where all slopes by it vanish; its bound hides the better design.
    let wrong = false_claims(&["hs33"], &["standard"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_variable_that_ends_at_zero_does_not_hide_an_optimum_without_multipliers() {
    // The cusp of Kuhn and Tucker: in lengths of x₂ at the end, 1e-15, its row would have bounded multipliers.
    let wrong = false_claims(&["hs13"], &["standard", "objective=1e6", "variables=1e-3"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_curvature_that_no_step_has_shown_is_no_proof() {
    let automatic = [preset("automatic").unwrap()];
    // Beside a saddle, where a constant hides the small slope; from a start at which the objective is 2e8.
    let wrong =
        false_claims(&["saddle", "saddle-in-a-plane", "small-objective"], &["offset=1e3", "offset=1e4"], &automatic);
    assert!(wrong.is_empty(), "{wrong:#?}");
    // A flat direction leads to another design that is not an optimum; a length that is too short by nine orders.
    let wrong = false_claims(&["hs108"], &["random=0.3,seed=4"], &automatic);
    assert!(wrong.is_empty(), "{wrong:#?}");
    let wrong = false_claims(&["small-and-large-variables"], &["start=1e-3"], &automatic);
    assert!(wrong.is_empty(), "{wrong:#?}");
    let wrong = false_claims(
        &["exponential-growth", "redundant-equalities"],
        &["random=0.6,seed=2", "random=0.6,seed=3", "random=0.3,seed=3"],
        &automatic,
    );
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_stop_test_is_made_with_the_problem_as_it_is() {
    let free = impact_absorber::peak_acceleration().unwrap();
    let optimum = Method::automatic().solve(&free, |_| ()).unwrap();
    let k = free.variables.iter().position(|v| v.name == "damping c").unwrap();
    for name in ["slp", "gcmma", "automatic"] {
        let method = (preset(name).unwrap().method)();
        let mut problem = impact_absorber::peak_acceleration().unwrap();
        problem.variables[k].upper = 0.8 * optimum.design[k];
        problem.variables[k].start = problem.variables[k].start.min(problem.variables[k].upper);
        let end = method.solve(&problem, |_| ()).unwrap();
        assert_eq!(end.status, Status::Converged, "{name}: {}", end.reason);
        let same = method.resume(&problem, end.clone(), |_| ()).unwrap();
        assert_eq!((same.status, same.counters), (end.status, end.counters), "{name}");
        problem.variables[k].upper = free.variables[k].upper;
        let moved = method.resume(&problem, end.clone().complete(None, &problem).unwrap(), |_| ()).unwrap();
        assert!(moved.cycles() > end.cycles(), "{name}: {}", moved.reason);
        assert!(moved.evaluation.objective < end.evaluation.objective, "{name}");
    }
}

#[test]
fn the_stop_test_of_the_paper_is_not_confirmed() {
    let problem = impact_absorber::peak_acceleration().unwrap();
    let published = Method::as_published().solve(&problem, |_| ()).unwrap();
    assert!(published.confirmation.is_none());
    assert_eq!((published.counters.analyses, published.counters.sensitivity_analyses), (6, 5));
    let confirmed = Method::slp().solve(&problem, |_| ()).unwrap();
    assert_eq!(confirmed.status, Status::Converged, "{}", confirmed.reason);
    let confirmation = confirmed.confirmation.unwrap();
    assert_eq!(confirmation.from, confirmed.evaluation.objective);
    assert_eq!(confirmed.counters.analyses, 6 + confirmation.work[0]);
}

/// Svanberg's cantilever: a measure of the weight, and the deflection of five segments.
struct Cantilever {
    /// −1 for the mirror image, whose responses have the opposite sign.
    sign: f64,
}

impl ClosedForm for Cantilever {
    fn response<S: Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let factors = [61.0, 37.0, 19.0, 7.0, 1.0];
        let sum = |term: &dyn Fn(usize) -> S| (0..5).fold(S::from(0.0), |sum, k| sum + term(k));
        let value = if h == 0 { sum(&|k| b[k] * b[k] * 0.0624) } else { sum(&|k| b[k].powi(-3) * factors[k]) };
        value * self.sign
    }
}

fn cantilever(start: f64, is_mirrored: bool) -> Problem {
    let mut parts = ProblemBuilder::new("cantilever");
    (1..=5).for_each(|k| {
        parts.variable(DesignVariable::new(format!("x{k}"), "m", start).within(0.1, 100.0));
    });
    let [weight, deflection] = ["weight", "deflection"].map(|name| parts.constant(name, ""));
    let limited = Quantity::response(None, deflection);
    if is_mirrored {
        parts.maximize("weight", "", Quantity::response(None, weight));
        parts.subject_to(Constraint::at_least("deflection", -1.0, limited));
    } else {
        parts.minimize("weight", "", Quantity::response(None, weight));
        parts.subject_to(Constraint::at_most("deflection", 1.0, limited));
    }
    parts.build_analytic(Cantilever { sign: if is_mirrored { -1.0 } else { 1.0 } }).unwrap()
}

#[test]
fn conservative_methods_stay_feasible_although_screening_removes_the_constraint() {
    for name in ["gcmma", "linear-conservative"] {
        // At 8 the deflection is a quarter of its limit, below the cut-off.
        for start in [6.0, 8.0, 20.0] {
            let end = (preset(name).unwrap().method)().solve(&cantilever(start, false), |_| ()).unwrap();
            let worst = end.history.iter().filter(|c| c.accepted).map(|c| c.violation_pct).fold(f64::MIN, f64::max);
            assert!(worst < 1e-4, "{name} from {start}: {worst} %");
        }
    }
}

#[test]
fn an_optimum_is_an_optimum_when_it_is_the_start() {
    // Slopes at a free minimum are rounding errors.
    for name in ["hs1", "hs2", "hs21", "hs35", "hs39", "hs43", "hs76"] {
        let mut problem = suite_problem(name);
        let end = Method::automatic().solve(&problem, |_| ()).unwrap();
        problem.variables.iter_mut().zip(&end.design).for_each(|(variable, b)| variable.start = *b);
        let again = Method::automatic().solve(&problem, |_| ()).unwrap();
        assert_eq!(again.status, Status::Converged, "{name}: {}", again.reason);
        assert!(again.counters.analyses <= 20, "{name}: {}", again.counters.analyses);
    }
}

#[test]
fn a_mirror_image_has_the_same_designs() {
    // Two candidates of the automatic method, powers and BFGS, do not know the sign with which a response is used.
    for preset in presets().iter().filter(|preset| preset.name != "automatic") {
        let run = |is_mirrored| (preset.method)().solve(&cantilever(5.0, is_mirrored), |_| ()).unwrap();
        let (one, other) = (run(false), run(true));
        // A last design from the confirmation is one of the automatic method.
        let designs = |state: &RunState| {
            let adopted = state.confirmation.as_ref().is_some_and(|c| c.is_adopted);
            let own = state.history.len() - usize::from(adopted);
            state.history[..own].iter().map(|c| c.design.clone()).collect::<Vec<_>>()
        };
        assert_eq!(designs(&one), designs(&other), "{}", preset.name);
        assert_eq!(one.status, other.status, "{}", preset.name);
    }
}

#[test]
fn a_run_at_its_limit_tells_trial_steps_and_accepted_ones() {
    let stop = Stop { max_cycles: 3, ..Stop::default() };
    let end = Method { stop, ..Method::slp() }.solve(&cantilever(5.0, false), |_| ()).unwrap();
    assert!(end.reason.starts_with("3 trial steps are done, "), "{}", end.reason);
    assert!(end.reason.contains(&format!("{} of them accepted", end.cycles())), "{}", end.reason);
}

#[test]
fn saddle_points_and_maxima_are_no_optima() {
    // The first-order conditions hold at the start or on the plane of symmetry, which no step leaves.
    let problems = ["oblique-saddle", "saddle-in-a-plane", "maximum-on-a-line"];
    let wrong = false_claims(&problems, &["standard", "start=0", "random=0.3,seed=1"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
    let automatic = [preset("automatic").unwrap()];
    for (problem, transformation) in [
        // The objective and its first two derivatives vanish there.
        ("hs78", "random=0.6,seed=1"),
        // A plateau with a slope of 1e-4 of the objective.
        ("hs57", "random=0.6,seed=5"),
        // A variable whose start says it is 1e-3 long instead of 1e6.
        ("small-and-large-variables", "start=1e-3"),
    ] {
        let wrong = false_claims(&[problem], &[transformation], &automatic);
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
}

#[test]
fn ends_beside_saddle_points_and_near_bounds_are_not_confirmed() {
    for (problem, transformation, names) in [
        // Half a hexagon is folded: directions in which no step was made, and a curvature of rounding errors beside them.
        ("hs108", "start=0", &["slp", "slp-fixed-times", "slp-filter", "sqp-filter", "multipoint", "bfgs"][..]),
        // A variable near its bound, where a row has no slope.
        ("hs108", "variables=1e-3", &["tana"]),
        ("hs108", "random=0.6,seed=1", &["reciprocal"]),
        // A maximum along a variable whose start says that it is a thousandth of its length.
        ("chebyshev-oscillation", "start=1e-3", &["linear-conservative", "mma-filtered"]),
        // A variable whose start says that it is 1e-3 long instead of 1e6.
        ("small-and-large-variables", "start=1e-3", &["quadratic-exact", "hessian-errors"]),
        ("eight-wells", "random=0.6,seed=1", &["quadratic-spherical"]),
        // The direction of negative curvature is a combination of the trial steps.
        (
            "saddle-in-a-plane",
            "offset=1e4",
            &["slp-filter", "conlin", "gcmma", "mma-filtered", "quadratic-mma", "bfgs"],
        ),
    ] {
        let presets: Vec<_> = names.iter().map(|name| preset(name).unwrap()).collect();
        let wrong = false_claims(&[problem], &[transformation], &presets);
        assert!(wrong.is_empty(), "{wrong:#?}");
    }
}

#[test]
fn an_end_that_is_worse_than_an_earlier_design_is_not_confirmed() {
    let wrong = false_claims(&["saddle", "hs93"], &["standard"], &all_presets());
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn a_better_design_that_a_confirmation_finds_is_the_end_of_the_run() {
    // A constant of 1e4 hides the error of the objective from these methods. The first one ends where nothing better is found.
    let wrong = false_claims(&["quartic"], &["offset=1e4"], &[preset("sqp-filter").unwrap()]);
    assert!(wrong.is_empty(), "{wrong:#?}");
    let runs = [
        ("hs65", "mma"),
        ("far-minimum", "slp-filter"),
        // The better design violates a row by a rounding error.
        ("hs65", "quadratic-exact"),
        ("nearly-linear", "linear-conservative"),
        ("hs116", "quadratic-reciprocal"),
    ];
    for (problem, name) in runs {
        let preset = preset(name).unwrap();
        let wrong = false_claims(&[problem], &["offset=1e4"], &[preset]);
        assert!(wrong.is_empty(), "{wrong:#?}");
        let changed = Transformation::parse("offset=1e4").unwrap().build(find(problem).unwrap()).unwrap();
        let method = (preset.method)().with_stop(Stop { accuracy: 1e-6, residual: 1e-3, ..Stop::default() });
        let end = method.solve(&changed, |_| ()).unwrap();
        let confirmation = end.confirmation.as_ref().unwrap();
        assert!(confirmation.is_adopted, "{name}: {}", end.reason);
        assert_eq!(confirmation.objective, end.evaluation.objective, "{name}");
        assert_eq!(end.history.last().unwrap().design, end.design, "{name}");
        let read = RunState::from_json(&end.to_json(), &changed).unwrap();
        let again = method.resume(&changed, read, |_| ()).unwrap();
        assert_eq!(again.to_json(), end.to_json(), "{name}");
    }
}

#[test]
fn the_best_design_of_a_run_is_known_although_it_is_not_the_last() {
    let mut count = 0;
    for name in ["hs43", "hs100", "hs21"] {
        let problem = suite_problem(name);
        for preset in presets() {
            let method = (preset.method)().with_stop(Stop { max_cycles: 3, ..Stop::default() });
            let end = method.solve(&problem, |_| ()).unwrap();
            let last = end.history.iter().rfind(|c| c.accepted).unwrap();
            let better = end.better_than_last(1e-4, 1e-4);
            let is_better =
                |c: &&linkwright::sao::Cycle| c.violation_pct <= 1e-2 && c.objective < last.objective - 1e-2;
            let expected = end.history.iter().filter(is_better).map(|c| c.objective).fold(f64::INFINITY, f64::min);
            let found = better.map_or(f64::INFINITY, |c| c.objective);
            assert!(last.violation_pct > 1e-2 || found <= expected, "{name}, {}: {found} {expected}", preset.name);
            count += usize::from(better.is_some());
        }
    }
    assert!(count > 2, "some runs end at a design that violates a constraint: {count}");
}
