//! The printed iterates of Svanberg, *Int. J. Numer. Meth. Eng.* 24 (1987) 359–373, and of Groenwold & Etman's reciprocal
//! quadratic approximation on the same cantilever.

use linkwright::approximation::{CurvatureRule, DiagonalQuadratic};
use linkwright::cases::cantilever;
use linkwright::papers::svanberg_1987::{Svanberg1987, iterate_with, with_approximated_objective};
use linkwright::papers::{Paper, ReproducedRun, ReproducedTable};
use linkwright::sao::{Cycle, FixedLimits, Status};

fn table(name: &str) -> ReproducedTable {
    Svanberg1987.regenerate(name, &mut |_, _| ()).unwrap().remove(0)
}

/// The printed numbers of a column of one of the tables in `papers/svanberg-1987`.
fn printed(csv: &str, column: usize) -> Vec<f64> {
    csv.lines().skip(1).filter_map(|line| line.split(',').nth(column)?.parse().ok()).collect()
}

fn values(run: &ReproducedRun, of: fn(&Cycle) -> f64) -> Vec<f64> {
    run.state.history.iter().map(of).collect()
}

#[track_caller]
fn assert_printed(what: &str, ours: &[f64], printed: &[f64], tolerance: f64) {
    assert!(!printed.is_empty() && ours.len() >= printed.len(), "{what}: {} of {}", ours.len(), printed.len());
    let difference = ours.iter().zip(printed).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(difference <= tolerance, "{what}: {difference:.4}\n{ours:.4?}\n{printed:?}");
}

/// Every run of a table against its column of printed weights.
fn assert_weights(name: &str, csv: &str, tolerance: f64) {
    let table = table(name);
    for (k, run) in table.runs.iter().enumerate() {
        assert_printed(run.name(), &values(run, |c| c.objective), &printed(csv, k + 1), tolerance);
    }
    let names = csv.lines().next().unwrap().split(',').skip(1);
    assert_eq!(names.count(), table.runs.len());
    assert_eq!(
        table.comparison().unwrap().compared,
        (1..=table.runs.len()).map(|c| printed(csv, c).len()).sum::<usize>()
    );
}

/// Slightly more than half a unit of the second decimal: 1.4349 is printed as 1.44.
const TWO_DIGITS: f64 = 0.0055;

#[test]
fn two_bar_truss_converges_with_moving_asymptotes_and_oscillates_without() {
    let csv = include_str!("../../papers/svanberg-1987/two_bar_truss.csv");
    let runs = table("two_bar_truss").runs;
    type Column = (usize, fn(&Cycle) -> f64);
    let columns: [Column; 5] =
        [(0, |c| c.objective), (0, |c| c.design[0]), (0, |c| c.design[1]), (1, |c| c.objective), (2, |c| c.objective)];
    for (k, (run, of)) in columns.into_iter().enumerate() {
        let what = csv.split([',', '\n']).nth(k + 1).unwrap();
        assert_printed(what, &values(&runs[run], of), &printed(csv, k + 1), TWO_DIGITS);
    }
    for run in &runs[1..] {
        let half_spans = &values(run, |c| c.design[1])[21..];
        assert!(half_spans.windows(2).all(|w| (w[1] - w[0]).abs() > 0.2), "{}: {half_spans:?}", run.name());
    }
}

#[test]
fn cantilever_has_the_printed_weights_for_every_choice_of_asymptotes() {
    assert_weights("cantilever", include_str!("../../papers/svanberg-1987/cantilever.csv"), 1e-3);
}

#[test]
fn eight_bar_truss_has_the_printed_weights_for_every_rate_of_the_asymptotes() {
    assert_weights("eight_bar_truss", include_str!("../../papers/svanberg-1987/eight_bar_truss.csv"), 0.011);
}

#[test]
fn optima_have_the_printed_weights() {
    let csv = include_str!("../../papers/svanberg-1987/optima.csv");
    let table = table("optima");
    for (run, printed) in table.runs.iter().zip(printed(csv, 1)) {
        assert_eq!(run.state.status, Status::Converged, "{}", run.name());
        assert!((run.state.evaluation.objective - printed).abs() < TWO_DIGITS, "{}", run.name());
    }
}

#[test]
fn cantilever_by_the_reciprocal_quadratic_in_the_printed_steps() {
    let quadratic = DiagonalQuadratic { curvature: CurvatureRule::Reciprocal };
    let problem = with_approximated_objective(cantilever::problem().unwrap());
    let state = iterate_with(quadratic, FixedLimits { width: 0.2 }, 5).solve(&problem, |_| ()).unwrap();
    let objectives: Vec<f64> = state.history.iter().map(|c| c.objective).collect();
    assert_printed("f", &objectives, &[1.560, 1.336, 1.323, 1.340, 1.340, 1.340], 1e-3);
    let violations: Vec<f64> = state.history.iter().map(|c| c.violation_pct.max(0.0) / 100.0).collect();
    // Printed without rounding.
    assert_printed("violation", &violations, &[0.0, 0.10, 0.03, 0.0, 0.0, 0.0], 0.01);
}
