//! The matrix of methods and problems: who reaches which optimum, after how much work, and who says that it does not.
//!
//! A cell is the work, analyses + sensitivity analyses, up to the first design within 1e-5 of a known optimum that violates
//! nothing by more than a millionth, where the run converges there; else how the run ended: `other` optimum, cycle `limit`,
//! `stalled`, `refused`. Optima of the field are mostly reached; that no cell says FALSE is the point.
#![cfg(feature = "multibody")]

use linkwright::library::{Attempt, Conclusion, Entry, catalogue, compare, impact_absorber};
use linkwright::sao::{FixedLimits, Method, PostOptimal, Preset, Status, presets};
use std::fmt::Write;

fn cell(a: &Attempt) -> String {
    match (&a.conclusion, a.to_optimum) {
        (Conclusion::Reached(_), Some(work)) => format!("{}+{}", work.analyses, work.sensitivity_analyses),
        (Conclusion::OtherOptimum, _) => "other".to_owned(),
        (Conclusion::Unfinished(Status::CycleLimit), _) => "limit".to_owned(),
        (conclusion, _) => conclusion.to_string(),
    }
}

/// Left out: long runs of methods that do not get there. `linkwright compare --all` has them.
const SLOW: [&str; 5] = [
    "impact-absorber-nonlinear",
    "vehicle-suspension",
    "ten-bar-truss-strong",
    "quadratic-forms-1",
    "quadratic-forms-2",
];

#[test]
fn every_method_on_every_problem() {
    let methods: Vec<&'static Preset> = presets().iter().collect();
    let entries: Vec<&'static Entry> = catalogue().iter().filter(|e| !e.expensive && !SLOW.contains(&e.name)).collect();
    let columns: Vec<Vec<Attempt>> = entries.iter().map(|e| compare(e, &methods).unwrap()).collect();
    let mut text = String::new();
    for (k, entry) in entries.iter().enumerate() {
        writeln!(text, "{:>2} {}", k + 1, entry.name).unwrap();
    }
    write!(text, "\n{:21}", "").unwrap();
    (1..=entries.len()).for_each(|k| write!(text, " {k:>7}").unwrap());
    for (m, method) in methods.iter().enumerate() {
        write!(text, "\n{:21}", method.name).unwrap();
        columns.iter().for_each(|column| write!(text, " {:>7}", cell(&column[m])).unwrap());
    }
    let page = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/choosing.md")).unwrap();
    assert!(page.contains(&text), "docs/choosing.md has another table:\n{text}");
    insta::assert_snapshot!(text + "\n");
    for a in columns.iter().flatten() {
        assert_ne!(a.conclusion, Conclusion::False, "{} on {}: {a:?}", a.method, a.problem);
    }
}

#[test]
fn an_optimum_at_bounds_in_all_variables_has_no_multipliers_to_look_for() {
    use linkwright::function;
    use linkwright::problem::{Constraint, DesignVariable, ProblemBuilder, Quantity};
    struct Nothing;
    impl linkwright::problem::ClosedForm for Nothing {
        fn response<S: linkwright::scalar::Scalar>(&self, _: usize, b: &[S], _: S) -> S {
            b[0] * 2.0
        }
    }
    let mut parts = ProblemBuilder::new("corner");
    parts.variable(DesignVariable::new("x", "", 0.5).within(0.25, 1.0));
    let r = parts.constant("twice x", "");
    parts.minimize("x", "", Quantity::plain(function!(|p| p.response[0])).of(&[r]));
    let same = Quantity::plain(function!(|p| -p.response[0])).of(&[r]);
    parts.subject_to(Constraint::at_most("touches", -0.5, same));
    let problem = parts.build_analytic(Nothing).unwrap();
    let end = Method::default().solve(&problem, |_| ()).unwrap();
    assert_eq!((end.status, end.design[0]), (Status::Converged, 0.25));
    assert!(PostOptimal::new(&problem, &end).unwrap().kkt(&problem) < 1e-12);
}

#[test]
fn steps_that_only_move_limits_keep_short_are_no_convergence() {
    let problem = impact_absorber::peak_acceleration().unwrap();
    let move_limits = Box::new(FixedLimits { width: 1e-6 });
    let end = Method { move_limits, ..Method::default() }.solve(&problem, |_| ()).unwrap();
    assert_eq!(end.status, Status::CycleLimit, "{}", end.reason);
    let residual = end.history.last().unwrap().residual.unwrap();
    assert!(residual > 0.03, "the objective has settled, the optimality conditions have not: {residual}");
}
