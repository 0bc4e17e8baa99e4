//! Matrix of all methods on all problems.
//!
//! For a run that converges to a known optimum a cell is the number of analyses + sensitivity analyses up to the first design
//! whose objective is within 1e-5 of it and whose violation is at most 1e-6. For other runs it is the conclusion: `other`
//! optimum, cycle `limit`, `stalled`, `refused`. No cell may be FALSE: convergence to a design that is not an optimum.

use crate::documented::{assert_table, code_block, least_work};
use linkwright::cases::{Attempt, CatalogueEntry, Conclusion, catalogue, compare, impact_absorber};
use linkwright::report::benchmark::summary;
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

/// The methods that run on the flexible four-bars, whose analyses take a hundred times as long as those of the others.
const FEW: [&str; 2] = ["slp", "tana"];
/// Number of problems in a row of the table.
const ABREAST: usize = 9;

fn methods_for(entry: &CatalogueEntry) -> Vec<&'static Preset> {
    let runs = |p: &&Preset| !entry.name.starts_with("four-bar") || FEW.contains(&p.name);
    presets().iter().filter(runs).collect()
}

/// Tables of all methods, with [`ABREAST`] problems each; a dot for methods that are not run.
fn tables(entries: &[&CatalogueEntry], columns: &[Vec<Attempt>]) -> String {
    let mut text = String::new();
    for (k, entry) in entries.iter().enumerate() {
        writeln!(text, "{:>2} {}", k + 1, entry.name).unwrap();
    }
    for first in (0..entries.len()).step_by(ABREAST) {
        let part = first..entries.len().min(first + ABREAST);
        write!(text, "\n{:21}", "").unwrap();
        part.clone().for_each(|k| write!(text, " {:>7}", k + 1).unwrap());
        for method in presets() {
            write!(text, "\n{:21}", method.name).unwrap();
            for column in &columns[part.clone()] {
                let run = column.iter().find(|a| a.method == method.name);
                write!(text, " {:>7}", run.map_or("·".to_owned(), cell)).unwrap();
            }
        }
        text.push('\n');
    }
    text.trim_end().to_owned()
}

#[test]
fn every_method_on_every_problem() {
    let entries: Vec<&'static CatalogueEntry> = catalogue().iter().collect();
    let columns: Vec<Vec<Attempt>> = entries.iter().map(|e| compare(e, &methods_for(e)).unwrap()).collect();
    let text = tables(&entries, &columns);
    for a in columns.iter().flatten() {
        assert_ne!(a.conclusion, Conclusion::False, "{} on {}: {a:?}", a.method, a.problem);
    }
    insta::assert_snapshot!(format!("{text}\n"));
    assert_table("matrix", &code_block(&text));
    let cheap = entries.iter().zip(&columns).filter(|(entry, _)| !entry.expensive);
    let cheap: Vec<Vec<Attempt>> = cheap.map(|(_, column)| column.clone()).collect();
    assert_table("summary", &code_block(&summary(&cheap).unwrap().text()));
    assert_table("least-work", &least_work(&columns));
}

#[test]
fn multipliers_are_zero_at_an_optimum_with_all_variables_at_bounds() {
    use linkwright::function;
    use linkwright::problem::{Constraint, DesignVariable, ProblemBuilder, Quantity};
    struct Nothing;
    impl linkwright::problem::ClosedForm for Nothing {
        fn response<S: linkwright::autodiff::Scalar>(&self, _: usize, b: &[S], _: S) -> S {
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
    let end = Method::slp().solve(&problem, |_| ()).unwrap();
    assert_eq!((end.status, end.design[0]), (Status::Converged, 0.25));
    assert!(PostOptimal::new(&problem, &end).unwrap().kkt(&problem) < 1e-12);
}

#[test]
fn short_steps_by_move_limits_do_not_count_as_convergence() {
    let problem = impact_absorber::peak_acceleration().unwrap();
    let move_limits = Box::new(FixedLimits { width: 1e-6 });
    let end = Method { move_limits, ..Method::slp() }.solve(&problem, |_| ()).unwrap();
    assert_eq!(end.status, Status::CycleLimit, "{}", end.reason);
    let residual = end.history.last().unwrap().residual.unwrap();
    assert!(residual > 0.03, "the objective has settled, the optimality conditions have not: {residual}");
}
