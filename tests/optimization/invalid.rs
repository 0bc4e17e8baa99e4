//! Invalid input: each case returns an error with numbers and a remedy, and none panics.

use linkwright::approximation::CycleData;
use linkwright::autodiff::Scalar;
use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::function;
use linkwright::problem::{
    Analysis, AnalyzedDesign, ClosedForm, Constraint, DesignVariable, Intermediate, Intermediates, Problem,
    ProblemBuilder, Quantity, ResponseAt, Responses, RowId, TimeGrid,
};
use linkwright::sao::{ErrorBased, Method, RelativeLimits, RunState, STATE_VERSION, Screening, Status, Stop};
use linkwright::{Error, Result};
use nalgebra::DMatrix;

/// Minimize b over r(t) = b t ≥ 1 at t = 1 … 3: the smallest problem with all parts.
struct Ramp;

impl ClosedForm for Ramp {
    fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
        b[0] * t
    }
}

/// The parts of the ramp problem with this variable.
fn parts(variable: DesignVariable) -> ProblemBuilder {
    let mut parts = ProblemBuilder::new("ramp");
    parts.variable(variable);
    let time = parts.grid(TimeGrid::uniform(1.0, 3.0, 3).unwrap());
    let ramp = parts.transient("ramp", "m", time);
    parts.minimize("rate", "m/s", Quantity::plain(function!(|p| p.design[0])));
    let above = Quantity::each_point(time, function!(|p| -p.response[0])).of(&[ramp]);
    parts.subject_to(Constraint::at_most("high enough", -1.0, above));
    parts
}

fn rate(start: f64) -> DesignVariable {
    DesignVariable::new("rate", "m/s", start).within(0.1, 10.0)
}

/// The message of an error that contains all of `words`.
#[track_caller]
fn assert_error<T>(result: Result<T>, words: &[&str]) -> Error {
    let error = result.err().expect("this input is invalid");
    let message = error.to_string();
    for word in words {
        assert!(message.contains(word), "`{word}` is missing in: {message}");
    }
    error
}

#[test]
fn crossed_bounds_are_refused() {
    let crossed = parts(DesignVariable::new("rate", "m/s", 1.0).within(2.0, 0.5));
    assert_error(crossed.build_analytic(Ramp), &["`rate`", "lower bound 2", "upper bound 0.5", "at most"]);
    let undefined = parts(DesignVariable::new("rate", "m/s", 1.0).within(f64::NAN, 0.5));
    assert_error(undefined.build_analytic(Ramp), &["`rate`", "NaN"]);
}

#[test]
fn a_start_outside_the_bounds_is_refused() {
    let words = ["`rate`", "[0.1, 10]", "move the start inside or widen the bounds"];
    assert_error(parts(rate(12.0)).build_analytic(Ramp), &["start 12", words[0], words[1], words[2]]);
    assert_error(parts(rate(f64::NAN)).build_analytic(Ramp), &["start NaN", words[0], words[1], words[2]]);
    let problem = parts(rate(1.0)).build_analytic(Ramp).unwrap();
    assert_error(Method::slp().start_at(&problem, vec![12.0]), &["start 12", words[0], words[1], words[2]]);
}

#[test]
fn designs_of_the_wrong_length_are_refused() {
    let problem = parts(rate(1.0)).build_analytic(Ramp).unwrap();
    let words = ["design: expected length 1, got 2"];
    assert_error(problem.analyze(&[1.0, 2.0]), &words);
    assert_error(Method::slp().start_at(&problem, vec![1.0, 2.0]), &words);
    assert_error(problem.evaluate(&[1.0, 2.0], &problem.analyze(&[1.0]).unwrap()), &words);
    let short = Responses::new(vec![vec![1.0, 2.0]]);
    assert_error(problem.evaluate(&[1.0], &short), &["values of response `ramp`: expected length 3, got 2"]);
}

#[test]
fn weights_of_the_wrong_length_are_refused() {
    let mut parts = parts(rate(1.0));
    parts.minimize("sum", "m", Quantity::sum(0, vec![1.0; 2], function!(|p| p.response[0])).of(&[0]));
    assert_error(parts.build_analytic(Ramp), &["objective `sum`: weights: expected length 3, got 2"]);
}

#[test]
fn intermediate_variables_of_the_wrong_length_are_refused() {
    let two = || Intermediates::all(2, Intermediate::Reciprocal);
    let mut responses = parts(rate(1.0));
    responses.linearize_in(0, two());
    let words = "expected length 1, got 2";
    assert_error(responses.build_analytic(Ramp), &["intermediate variables of response `ramp`", words]);
    let mut direct = parts(rate(1.0));
    direct.minimize("rate", "m/s", Quantity::plain(function!(|p| p.design[0])).directly(two()));
    assert_error(direct.build_analytic(Ramp), &["intermediate variables of objective `rate`", words]);
}

#[test]
fn an_empty_time_grid_is_refused() {
    let empty = TimeGrid::new("time", "s", vec![]);
    assert_error(empty, &["time grid `time`", "no time point", "at least one point"]);
    assert_error(TimeGrid::uniform(0.0, 1.0, 0), &["no time point"]);
    let mut problem = parts(rate(1.0)).build_analytic(Ramp).unwrap();
    problem.grids[0].points.clear();
    assert_error(Method::slp().start(&problem), &["time grid `time`", "no time point"]);
}

#[test]
fn duplicate_names_are_refused() {
    let mut variables = parts(rate(1.0));
    variables.variable(rate(2.0));
    let words = ["`rate`", "the name is taken twice", "give every part its own name"];
    assert_error(variables.build_analytic(Ramp), &words);
    let mut responses = parts(rate(1.0));
    responses.constant("ramp", "m");
    assert_error(responses.build_analytic(Ramp), &["response `ramp`", words[1], words[2]]);
    let mut constraints = parts(rate(1.0));
    constraints.subject_to(Constraint::at_most("high enough", 1.0, Quantity::plain(function!(|p| p.design[0]))));
    assert_error(constraints.build_analytic(Ramp), &["constraint `high enough`", words[1], words[2]]);
}

#[test]
fn parts_that_do_not_exist_are_named() {
    let of = |responses: &[usize], grid| Quantity::each_point(grid, function!(|p| p.response[0])).of(responses);
    let with = |quantity| {
        let mut parts = parts(rate(1.0));
        parts.subject_to(Constraint::at_most("odd", 1.0, quantity));
        parts.build_analytic(Ramp)
    };
    assert_error(with(of(&[7], 0)), &["constraint `odd`", "response number 7", "there are 1"]);
    assert_error(with(of(&[0], 3)), &["constraint `odd`", "time grid does not exist"]);
    let history = Quantity::each_point(0, function!(|p| p.response[0])).of(&[0]);
    let mut objective = parts(rate(1.0));
    objective.minimize("history", "m", history);
    assert_error(objective.build_analytic(Ramp), &["history", "not a number", "minimize_peak"]);
    assert_error(ProblemBuilder::new("empty").build_analytic(Ramp), &["empty", "no objective", "call `minimize`"]);
}

#[test]
fn limits_and_scales_that_are_no_numbers_are_refused() {
    let with = |limit, scale| {
        let mut parts = parts(rate(1.0));
        let quantity = Quantity::plain(function!(|p| p.design[0]));
        parts.subject_to(Constraint::at_most("odd", limit, quantity).scaled_by(scale));
        parts.build_analytic(Ramp)
    };
    assert_error(with(f64::NAN, 1.0), &["limit of constraint `odd` must be finite, got NaN"]);
    assert_error(with(1.0, 0.0), &["scale of constraint `odd` must be positive and finite, got 0"]);
}

/// Minimize (b − 3)² through a response that does not exist beyond `end`.
struct Cliff {
    end: f64,
    beyond: f64,
}

impl Analysis for Cliff {
    fn analyze(&self, b: &[f64]) -> Result<Responses> {
        let good = b[0] <= self.end;
        Ok(Responses::new(vec![vec![b[0] - 3.0, if good { b[0] - 3.0 } else { self.beyond }]]))
    }
    fn sensitivities(&self, _: &[f64], _: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        Ok(DMatrix::from_element(wanted.len(), 1, 1.0))
    }
}

fn cliff(start: f64, end: f64, beyond: f64) -> Problem {
    let mut parts = ProblemBuilder::new("cliff");
    parts.variable(DesignVariable::new("place", "m", start).within(0.1, 10.0));
    let time = parts.grid(TimeGrid::uniform(0.0, 0.25, 2).unwrap());
    let distance = parts.transient("distance", "m", time);
    let square = Quantity::sum(time, vec![0.5; 2], function!(|p| p.response[0] * p.response[0])).of(&[distance]);
    parts.minimize("square", "m²", square);
    parts.build(Cliff { end, beyond }).unwrap()
}

#[test]
fn responses_that_are_not_finite_at_the_start_are_an_error_with_response_time_and_design() {
    for (beyond, value) in [(f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        let start = Method::slp().start(&cliff(2.0, 1.0, beyond));
        let place = "time 0.25 s and place = 2 m";
        let error = assert_error(start, &["response `distance`", &format!("is {value}"), place, "bound the design"]);
        assert!(matches!(error, Error::NotFinite { .. }));
    }
}

#[test]
fn responses_that_are_not_finite_later_reject_the_cycle_halve_the_limits_and_the_run_goes_on() {
    let state = Method::slp().solve(&cliff(2.0, 2.75, f64::NAN), |_| ()).unwrap();
    let [failed, next] = [&state.history[1], &state.history[2]];
    assert!(!failed.accepted && failed.design[0] > 2.75, "{failed:?}");
    let why = failed.failure.as_deref().unwrap();
    assert!(why.contains("response `distance` is NaN at time 0.25 s and place = 2.8 m"), "{why}");
    assert_eq!((failed.cycle, next.cycle), (1, 1), "the same cycle is repeated");
    assert_eq!(next.factors[0], 0.5 * failed.factors[0]);
    assert!(next.accepted && next.failure.is_none());
    let confirmation = state.confirmation.as_ref().map_or(0, |c| c.work[0]);
    assert_eq!(state.counters.analyses, state.history.len() + confirmation, "a failed analysis is counted too");
    assert!(state.design[0] > 2.5 && state.design[0] <= 2.75, "the run continues up to the edge: {:?}", state.design);
    assert_ne!(state.status, Status::Running);
}

#[test]
fn an_analysis_of_the_wrong_shape_is_refused() {
    struct Short;
    impl Analysis for Short {
        fn analyze(&self, _: &[f64]) -> Result<Responses> {
            Ok(Responses::new(vec![vec![1.0, 2.0]]))
        }
        fn sensitivities(&self, _: &[f64], _: &Responses, _: &[ResponseAt]) -> Result<DMatrix<f64>> {
            Ok(DMatrix::zeros(1, 1))
        }
    }
    let problem = parts(rate(1.0)).build(Short).unwrap();
    assert_error(Method::slp().start(&problem), &["values of response `ramp`: expected length 3, got 2"]);
    let mut wide = parts(rate(1.0)).build_analytic(Ramp).unwrap();
    wide.analysis = Box::new(Short);
    let all = Responses::new(vec![vec![1.0, 2.0, 3.0]]);
    let wanted = [0, 1].map(|point| ResponseAt { response: 0, point });
    assert_error(wide.sensitivities(&[1.0], &all, &wanted), &["rows of the sensitivities: expected length 2, got 1"]);
}

#[test]
fn a_design_variable_of_zero_has_the_documented_floor_and_is_not_frozen() {
    let start = |bounds: Option<[f64; 2]>| {
        let mut parts = ProblemBuilder::new("from zero");
        let free = DesignVariable::new("place", "m", 0.0);
        parts.variable(bounds.map_or(free.clone(), |[l, u]| free.within(l, u)));
        parts.minimize("square", "m²", Quantity::plain(function!(|p| (p.design[0] - 1.0).powi(2))));
        parts.build_analytic(Ramp).unwrap()
    };
    let first_width = |problem: &Problem| {
        let region = RelativeLimits::default();
        use linkwright::sao::MoveLimits;
        region.region(problem, &problem.start(), &region.start(1)).upper[0]
    };
    // floor × factor × range, and × 1 without a range.
    assert!((first_width(&start(Some([-1.0, 3.0]))) - 1e-3 * 0.4 * 4.0).abs() < 1e-15);
    assert!((first_width(&start(None)) - 1e-3 * 0.4).abs() < 1e-15);
    let state = Method::slp().solve(&start(Some([-1.0, 3.0])), |_| ()).unwrap();
    assert!(state.status.is_success() && (state.design[0] - 1.0).abs() < 1e-6, "{:?}", state.history);
}

#[test]
fn a_problem_without_a_feasible_design_is_relaxed_reported_and_ends_as_infeasible() {
    let mut parts = parts(rate(1.0));
    // High enough needs b ≥ 1, low enough b ≤ 0.2 at the last of the time points.
    let below = Quantity::each_point(0, function!(|p| p.response[0])).of(&[0]);
    parts.subject_to(Constraint::at_most("low enough", 0.6, below));
    let problem = parts.build_analytic(Ramp).unwrap();
    let state = Method::slp().solve(&problem, |_| ()).unwrap();
    let last = state.history.last().unwrap();
    assert_eq!(last.subproblem, Some(linkwright::nlp::ProgramStatus::Relaxed));
    assert!(last.relaxation > 0.1, "{last:?}");
    assert_eq!(state.status, Status::Infeasible, "{}", state.reason);
    assert!(state.reason.contains("no design within the move limits is feasible"), "{}", state.reason);
    let both =
        "the violation is stationary here: high enough at time 1 s and low enough at time 3 s are violated by 66.667 %";
    assert!(state.reason.contains(both), "{}", state.reason);
    // Both constraints are violated by two thirds at b = 1/3: 1 + (1 − b)/1 = 1 + (3 b − 0.6)/0.6.
    assert!((state.design[0] - 1.0 / 3.0).abs() < 1e-6 && (last.relaxation - 2.0 / 3.0).abs() < 1e-6);
    assert!(state.reason.contains("6.7e-1"), "{}", state.reason);
}

#[test]
fn a_state_of_another_version_or_problem_is_refused() {
    let problem = impact_absorber::comfort().unwrap();
    let state = Method::slp().start(&problem).unwrap();
    let text = state.to_json();
    let newer = text.replacen(&format!("\"version\": {STATE_VERSION}"), "\"version\": 99", 1);
    let reads = format!("reads version {STATE_VERSION}");
    let words = ["version 99", reads.as_str(), "continue it with the release that wrote it"];
    assert_error(RunState::from_json(&newer, &problem), &words);
    let other = impact_absorber::peak_acceleration().unwrap();
    let words = [
        "another problem, or an earlier version wrote it (`impact absorber, comfort criterion`",
        "here `impact absorber, peak acceleration`",
    ];
    assert_error(RunState::from_json(&text, &other), &words);
    assert_error(Method::slp().resume(&other, state, |_| ()), &words);
    assert_error(RunState::from_json("{", &problem), &["not a state file", "give a file that a run wrote"]);
    let mut moved = impact_absorber::comfort().unwrap();
    moved.variables[0].upper = 2.0;
    assert_error(RunState::from_json(&text, &moved), &["another problem", "bounds and limits"]);
}

#[test]
fn a_state_whose_parts_do_not_have_the_shape_of_the_problem_is_refused() {
    let problem = slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap();
    let state = Method::slp().start(&problem).unwrap();
    let refused = |change: fn(&mut RunState), words: &[&str]| {
        let mut state = state.clone();
        change(&mut state);
        assert_error(RunState::from_json(&state.to_json(), &problem), words);
    };
    refused(|s| _ = s.design.pop(), &["design of the state: expected length 8, got 7"]);
    refused(|s| _ = s.factors.pop(), &["factors of the state: expected length 8, got 7"]);
    refused(|s| _ = s.responses.values[1].pop(), &["response `y2`: expected length 8, got 7"]);
    refused(|s| _ = s.evaluation.residuals.pop(), &["constraints of the state: expected length 2, got 1"]);
    refused(|s| s.factors[0] = -1.0, &["a move-limit factor is not positive"]);
    refused(|s| s.counters.subproblem_iterations = usize::MAX, &["a counter is above"]);
    refused(|s| s.evaluation.equalities.push(7), &["equality constraints [7] are not those of the problem"]);
    refused(|s| s.globalization.conservatism.push(1.0), &["conservatism of the state: expected length 3, got 1"]);
    refused(|s| s.last_step = Some(vec![]), &["last step of the state: expected length 8, got 0"]);
    refused(|s| s.history.clear(), &["the history is empty"]);
    refused(|s| s.history[0].cycle = 3, &["line 0 of the history is cycle 3, expected cycle 0"]);
    refused(|s| _ = s.history[0].design.pop(), &["design of cycle 0: expected length 8, got 7"]);
    let nowhere = |s: &mut RunState| s.history[0].retained.push(RowId { constraint: 9, point: 0 });
    refused(nowhere, &["constraint 9 at time point 0 does not exist; there are 2 constraints"]);
    refused(|s| s.design[0] += 1.0, &["the design is not that of the last accepted cycle"]);
}

/// After a rejected step the state has derivatives, which the next step uses.
#[test]
fn stored_derivatives_that_do_not_fit_are_refused() {
    let problem = impact_absorber::comfort().unwrap();
    let method = Method::slp();
    let mut state = method.start(&problem).unwrap();
    let retained = method.screening.retain(&problem, &state.evaluation);
    let at = AnalyzedDesign {
        design: state.design.clone(),
        responses: state.responses.clone(),
        evaluation: state.evaluation.clone(),
    };
    state.data = Some(CycleData::first_order(&problem, &at, retained).unwrap());
    RunState::from_json(&state.to_json(), &problem).unwrap();
    let refused = |change: fn(&mut CycleData), words: &[&str]| {
        let mut state = state.clone();
        change(state.data.as_mut().unwrap());
        assert_error(RunState::from_json(&state.to_json(), &problem), words);
    };
    refused(|d| d.sensitivities.rows = DMatrix::zeros(0, 2), &["rows of the sensitivities of the state"]);
    refused(|d| _ = d.sensitivities.at.pop(), &["not those of the retained rows"]);
    refused(|d| d.retained.reverse(), &["the retained rows are not sorted"]);
    refused(|d| d.retained.push(RowId { constraint: 0, point: 100_000 }), &["at time point 100000 does not exist"]);
    refused(|d| d.curvatures = Some(vec![]), &["second derivatives of the state"]);
    // Sizes whose product overflows.
    let text = state.to_json();
    let rows = text.find("\"rows\"").unwrap();
    let end = rows + text[rows..].find("]\n").unwrap();
    let huge = format!("{}\"rows\": [[], 8589934592, 2147483648{}", &text[..rows], &text[end..]);
    assert!(RunState::from_json(&huge, &problem).is_err());
}

#[test]
fn settings_out_of_range_are_refused() {
    let problem = parts(rate(1.0)).build_analytic(Ramp).unwrap();
    let refused = |method: Method, words: &[&str]| {
        assert_error(method.start(&problem), words);
    };
    let limits = |limits: RelativeLimits| Method { move_limits: Box::new(limits), ..Method::slp() };
    let standard = RelativeLimits::default();
    refused(
        limits(RelativeLimits { initial: 0.0, ..standard }),
        &["initial move-limit factor must be positive and finite, got 0"],
    );
    refused(limits(RelativeLimits { cap: 0.1, ..standard }), &["move-limit cap must be at least the initial factor"]);
    refused(limits(RelativeLimits { on_rejection: 1.5, ..standard }), &["above 0 and at most 1, got 1.5"]);
    refused(limits(RelativeLimits { increase: 0.9, ..standard }), &["increase must be at least 1", "got 0.9"]);
    refused(limits(RelativeLimits { floor: f64::NAN, ..standard }), &["move-limit floor", "got NaN"]);
    refused(limits(RelativeLimits { increase_violation_pct: f64::NAN, ..standard }), &["must be a number, got NaN"]);
    let screening = Screening { cutoff: Some(1.5), ..Screening::default() };
    refused(Method { screening, ..Method::slp() }, &["screening cut-off must be a number below 1", "got 1.5"]);
    let globalization = Box::new(ErrorBased { reject_above_pct: -1.0 });
    refused(Method { globalization, ..Method::slp() }, &["above which a cycle is rejected must be positive", "-1"]);
    let stop = |stop| Method { stop, ..Method::slp() };
    refused(stop(Stop { accuracy: 0.0, ..Stop::default() }), &["accuracy must be between 0 and 1, got 0"]);
    refused(stop(Stop { max_cycles: 0, ..Stop::default() }), &["number of cycles must be at least 1, got 0"]);
}
