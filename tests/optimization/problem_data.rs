//! Sides, windows, pairs and goals of constraints and objectives: equivalent problems give the same bits.

use linkwright::cases::impact_absorber::{self, ClosedFormMotion};
use linkwright::prelude::*;
use linkwright::problem::{Goal, RowId, Side};
use linkwright::sao::{Parameter, PostOptimal};
use linkwright::{Error, Result};

/// An impact absorber with the least product of stiffness and damping, subject to constraints on its travel.
fn absorber(maximize: bool, constraints: impl FnOnce(usize, usize) -> Vec<Constraint>) -> Result<Problem> {
    let mut parts = ProblemBuilder::new("absorber");
    parts.variable(DesignVariable::new("stiffness", "N/m", 0.8).within(0.1, 1.0));
    parts.variable(DesignVariable::new("damping", "N·s/m", 0.3).within(0.1, 1.0));
    let time = parts.grid(TimeGrid::uniform(0.0, 12.0, 101)?);
    let y = parts.transient("displacement", "m", time);
    parts.transient("acceleration", "m/s²", time);
    if maximize {
        parts.maximize("product", "", Quantity::plain(function!(|p| -p.design[0] * p.design[1])));
    } else {
        parts.minimize("product", "", Quantity::plain(function!(|p| p.design[0] * p.design[1])));
    }
    constraints(time, y).into_iter().for_each(|constraint| _ = parts.subject_to(constraint));
    parts.build_analytic(ClosedFormMotion)
}

fn solve(problem: &Problem) -> RunState {
    Method::slp().solve(problem, |_| ()).unwrap()
}

#[test]
fn a_lower_limit_is_the_upper_limit_of_the_negative() {
    let travel = |time, y| Constraint::between("travel", [-0.5, 0.7], Quantity::response(time, y));
    let both = absorber(false, |time, y| travel(time, y).into()).unwrap();
    let negative = absorber(false, |time, y| {
        let [upper, _] = travel(time, y);
        let minus = Quantity::each_point(time, function!(|p| p.response[0] * -1.0)).of(&[y]);
        vec![upper, Constraint::at_most("travel lower", 0.5, minus)]
    })
    .unwrap();
    assert_eq!(both.fingerprint(), negative.fingerprint());
    assert_eq!(solve(&both).to_json(), solve(&negative).to_json());
    assert_eq!((both.partner(0), both.partner(1), negative.partner(0)), (Some(1), Some(0), None));
    assert_eq!((both.constraints[1].side, both.constraints[1].limit), (Side::AtLeast, -0.5));
    assert_eq!(both.constraints[0].quantity.as_response(), Some(0));
}

#[test]
fn maximizing_is_minimizing_the_negative() {
    let travel = |time, y| vec![Constraint::at_most("travel", 0.7, Quantity::response(time, y))];
    let [least, largest] = [false, true].map(|maximize| absorber(maximize, travel).unwrap());
    assert_eq!((least.objective.goal, largest.objective.goal), (Goal::Minimize, Goal::Maximize));
    let [least, largest] = [solve(&least), solve(&largest)];
    assert!(least.status.is_success() && least.evaluation.objective > 0.0);
    assert_eq!((least.design, least.evaluation), (largest.design, largest.evaluation));
}

#[test]
fn a_problem_with_another_window_or_goal_is_another_one() {
    let problem = |maximize, from| {
        let travel = |time, y| vec![Constraint::at_most("travel", 0.7, Quantity::response(time, y)).during(from, 1.5)];
        absorber(maximize, travel).unwrap()
    };
    let one = problem(false, 0.5);
    let mut in_milliseconds = problem(false, 0.5);
    in_milliseconds.grids = in_milliseconds.grids.into_iter().map(|grid| grid.shown_in("ms", [1.0, 1e3])).collect();
    assert_eq!(one.fingerprint(), in_milliseconds.fingerprint());
    for other in [problem(false, 0.6), problem(true, 0.5)] {
        assert_ne!(one.fingerprint(), other.fingerprint());
    }
}

#[test]
fn a_window_has_rows_inside_only() {
    let problem = |limit| {
        let in_time =
            move |time, y| vec![Constraint::at_most("travel", limit, Quantity::response(time, y)).during(2.95, 5.45)];
        absorber(false, in_time).unwrap()
    };
    let problem = problem(0.3);
    let points: Vec<usize> = problem.all_rows().iter().map(|row| row.point).collect();
    assert_eq!(points, (25..=45).collect::<Vec<_>>());
    let here = problem.analyze_design(&[0.8, 0.3]).unwrap();
    let history = here.evaluation.normalized(0);
    for (p, g) in history.iter().enumerate() {
        let inside = here.responses.values[0][p] / 0.3;
        assert!(if points.contains(&p) { (g - inside).abs() < 1e-12 } else { *g == 0.0 }, "{p}: {g}");
    }
    let all = Screening::all().retain(&problem, &here.evaluation);
    assert_eq!(all, points.iter().map(|&point| RowId { constraint: 0, point }).collect::<Vec<_>>());
    let end = solve(&problem);
    let beyond = |p: usize| end.responses.values[0][p] > 0.3 + 1e-4;
    assert!(end.status.is_success() && points.iter().all(|&p| !beyond(p)) && (0..25).any(beyond));
}

#[test]
fn a_peak_objective_names_its_variable_and_constraints() {
    let problem = impact_absorber::peak_acceleration().unwrap();
    let peak = problem.objective.peak().unwrap();
    assert_eq!(problem.variables[peak.variable].name, problem.objective.name);
    let sides = peak.constraints.map(|j| (problem.constraints[j].side, problem.constraints[j].bound));
    assert_eq!(sides, [(Side::AtMost, Some(peak.variable)), (Side::AtLeast, Some(peak.variable))]);
}

/// The derivative of the optimum with respect to a lower limit has the right sign.
#[test]
fn a_lower_limit_moves_the_optimum() {
    let problem = |limit| {
        let stiff = function!(|p| p.design[0] + p.design[1]);
        absorber(false, |_, _| vec![Constraint::at_least("sum", limit, Quantity::plain(stiff))]).unwrap()
    };
    let (here, h) = (problem(0.9), 1e-4);
    let end = solve(&here);
    let [up, down] = [0.9 + h, 0.9 - h].map(|limit| solve(&problem(limit)).evaluation.objective);
    let found = PostOptimal::new(&here, &end).unwrap().objective(&here, Parameter::Limit(0)).unwrap();
    assert!((found - (up - down) / (2.0 * h)).abs() < 1e-3 * found && found > 0.0, "{found}");
}

#[test]
fn impossible_windows_and_bounds_are_rejected() {
    let refused = |of: fn(Constraint) -> Constraint, words: &str| {
        let made = absorber(false, |time, y| vec![of(Constraint::at_most("travel", 0.7, Quantity::response(time, y)))]);
        let error = made.err().unwrap();
        assert!(matches!(error, Error::Definition { .. }) && error.to_string().contains(words), "{error}");
    };
    refused(|c| c.during(20.0, 30.0), "no time point is inside its window");
    refused(|c| c.during(2.0, 3.0).in_continuous_time(), "only a constraint at the time points");
    let plain = |mut c: Constraint| {
        c.quantity = Quantity::plain(function!(|p| p.design[0]));
        c.during(2.0, 3.0)
    };
    refused(plain, "only a constraint at the time points");
    refused(|c| c.bounded_by(7), "its bound variable does not exist");
}

/// Later versions read stored runs: names in the file are independent of names in the code.
#[test]
fn names_in_a_state_file_stay() {
    let problem = impact_absorber::peak_acceleration().unwrap();
    let method = Method::slp().with_globalization(linkwright::sao::ErrorBased { reject_above_pct: 1e-9 });
    let state = method.step(&problem, method.start(&problem).unwrap()).unwrap();
    let json = state.to_json();
    for name in ["guard", "past", "knowledge", "kept", "instants", "sensitivities", "history", "last_step"] {
        assert!(json.contains(&format!("\"{name}\":")), "{name}");
    }
    assert_eq!(RunState::from_json(&json, &problem).unwrap().to_json(), json);
}

/// A lever whose length is in metres and whose thickness at the start is a millionth of what matters.
struct Lever;

impl linkwright::problem::ClosedForm for Lever {
    fn response<S: linkwright::autodiff::Scalar>(&self, h: usize, b: &[S], _: S) -> S {
        let [length, thickness] = [b[0], b[1]];
        if h == 0 { length + thickness } else { length * 1e-6 - thickness * 1e-6 }
    }
}

#[test]
fn scales_that_are_far_off_are_told_with_what_to_write() {
    let lever = |thickness: f64, scale: f64| {
        let mut parts = ProblemBuilder::new("lever");
        parts.variable(DesignVariable::new("length", "m", 2.0));
        parts.variable(DesignVariable::new("thickness", "m", thickness));
        let [mass, sag] = ["mass", "sag"].map(|name| parts.constant(name, "m"));
        parts.minimize("mass", "m", Quantity::response(None, mass));
        parts.subject_to(Constraint::at_most("sag", 0.0, Quantity::response(None, sag)).scaled_by(scale));
        let problem = parts.build_analytic(Lever).unwrap();
        problem.scaling_advice(&problem.start()).unwrap()
    };
    assert_eq!(lever(1.0, 1e-6), vec![]);
    let [linkwright::problem::ScalingAdvice::Constraint { constraint: 0, scale, suggested }] = lever(1.0, 1.0)[..]
    else {
        panic!("{:?}", lever(1.0, 1.0))
    };
    assert!(scale == 1.0 && (suggested - 3e-6).abs() < 1e-12, "{suggested}");
    let advice = lever(2e-6, 1e-6);
    let [linkwright::problem::ScalingAdvice::ShortVariable { variable: 1, length, share, suggested }] = advice[..]
    else {
        panic!("{advice:?}")
    };
    assert!(length == 2e-6 && (share - 1e-6).abs() < 1e-9 && (suggested - 2.0).abs() < 1e-9, "{share} {suggested}");
}
