//! Snapshots of the convergence histories of all runs of the library: a changed algorithm is a readable difference.
//!
//! Objectives and designs have six digits, errors four. Errors below 1e-6 % are rounding errors and not shown.

use linkwright::cases::{impact_absorber, slider_crank};
use linkwright::problem::{Intermediates, Problem, Selection};
use linkwright::sao::{Cycle, Method, RelativeLimits, RunState, Screening};
use std::fmt::Write;

fn percent(value: f64) -> String {
    if value.abs() < 1e-6 { "< 1e-6".to_owned() } else { format!("{value:.3e}") }
}

fn row(cycle: &Cycle) -> String {
    let mut text = format!("{:>3} {}", cycle.cycle, if cycle.accepted { "y" } else { "n" });
    let factors = cycle.factors.iter().copied().fold((f64::INFINITY, 0.0f64), |(l, u), f| (l.min(f), u.max(f)));
    let [e_f, e_g, v] = [cycle.objective_error_pct, cycle.constraint_error_pct, cycle.violation_pct].map(percent);
    let (kept, active) = (cycle.retained.len(), cycle.active.len());
    write!(text, "  {:>12.5e}  {e_f:>10} {e_g:>10} {v:>10}", cycle.objective).unwrap();
    write!(text, "  {:.4}…{:.4} {:>2}  {kept:>2} {active:>2} ", factors.0, factors.1, cycle.active_limits).unwrap();
    cycle.design.iter().for_each(|b| write!(text, " {b:>9.5}").unwrap());
    text
}

fn table(state: &RunState) -> String {
    let work = state.counters;
    let mut text = format!(
        "{}: {:?} after {} cycles, {} analyses, {} sensitivity analyses\n",
        state.problem,
        state.status,
        state.cycles(),
        work.analyses,
        work.sensitivity_analyses
    );
    text += "cycle             F     E_f [%]    E_g [%]      V [%]          factors  at  kept act  design\n";
    state.history.iter().for_each(|cycle| text += &(row(cycle) + "\n"));
    text
}

fn run(method: &Method, problem: &Problem) -> String {
    let state = method.solve(problem, |_| ()).unwrap();
    assert!(state.history.iter().all(|c| c.kkt < 1e-6), "every subproblem is solved");
    table(&state)
}

/// With the paper's stop test, which does not use the optimality conditions: with them the oscillation lasts 37 cycles.
fn neighbours(count: usize) -> Method {
    let screening = Screening { selection: Selection::NearMaxima(count), ..Screening::as_published() };
    Method { screening, ..Method::as_published() }
}

#[test]
fn table_one_the_impact_absorber_with_least_peak_acceleration() {
    insta::assert_snapshot!(run(&Method::slp(), &impact_absorber::peak_acceleration().unwrap()));
}

#[test]
fn one_time_point_for_each_maximum() {
    insta::assert_snapshot!(run(&neighbours(0), &impact_absorber::peak_acceleration().unwrap()));
}

#[test]
fn table_two_the_impact_absorber_with_comfort_criterion() {
    insta::assert_snapshot!(run(&Method::slp(), &impact_absorber::comfort().unwrap()));
}

#[test]
fn the_comfort_criterion_linearized_directly() {
    let mut problem = impact_absorber::comfort().unwrap();
    problem.objective = problem.objective.clone().directly(Intermediates::Identity);
    insta::assert_snapshot!(run(&Method::slp(), &problem));
}

#[test]
fn table_four_the_slider_crank_from_the_stand_in_start() {
    let problem = slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap();
    insta::assert_snapshot!(run(&Method::slp(), &problem));
}

#[test]
fn the_slider_crank_from_move_limits_of_thirty_percent() {
    let problem = slider_crank::path_generation(slider_crank::STAND_IN_START).unwrap();
    let limits = RelativeLimits { initial: 0.3, ..RelativeLimits::default() };
    insta::assert_snapshot!(run(&Method { move_limits: Box::new(limits), ..Method::slp() }, &problem));
}

#[test]
fn the_slider_crank_from_the_second_stand_in_start() {
    let problem = slider_crank::path_generation(slider_crank::SECOND_STAND_IN_START).unwrap();
    insta::assert_snapshot!(run(&Method::slp(), &problem));
}
