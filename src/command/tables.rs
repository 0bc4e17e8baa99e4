//! Cycles, histories and derivatives as tables.

use linkwright::problem::{Evaluation, Problem, Responses, Sensitivities};
use linkwright::report::outcome;
use linkwright::report::run::step_cells;
use linkwright::report::table::{Cell, Table};
use linkwright::sao::RunState;
use std::collections::BTreeSet;

/// Table of trial steps from number `from`, accepted and rejected.
pub fn cycles(problem: &Problem, state: &RunState, from: usize) -> linkwright::Result<Table> {
    let fixed = [
        "cycle",
        "accepted",
        "objective",
        "objective_error_pct",
        "constraint_error_pct",
        "violation_pct",
        "variable_change_pct",
        "active_limits",
        "kept_rows",
        "active_rows",
        "subproblem_iterations",
    ];
    let names = problem.variables.iter().map(|v| v.name.as_str());
    let mut table = Table::new("Cycles", fixed.into_iter().chain(names).map(str::to_owned));
    for (k, c) in state.history.iter().enumerate().skip(from) {
        let objective = outcome::objective_of_step(problem, state, k)?;
        let fixed =
            [c.cycle.into(), usize::from(c.accepted).into()].into_iter().chain(step_cells(problem, c, objective));
        let design = c.design.iter().map(|b| Cell::from(*b));
        table.push(fixed.chain([c.iterations.into()]).chain(design))?;
    }
    Ok(table)
}

/// Table of all responses over time; a response without time has a value in the first row only.
pub fn responses(problem: &Problem, values: &Responses) -> linkwright::Result<Table> {
    let some = |values: &Vec<f64>| values.iter().map(|v| Some(*v)).collect();
    over_time(
        problem,
        "Responses",
        problem.responses.iter().zip(&values.values).map(|(r, v)| (r.name.clone(), some(v))),
    )
}

/// Table of all constrained quantities over time, in their units; empty where a constraint does not hold.
pub fn constraints(problem: &Problem, design: &[f64], evaluation: &Evaluation) -> linkwright::Result<Table> {
    let mut seen = BTreeSet::new();
    // Both sides of a two-sided constraint have the same values.
    let first = (0..problem.constraints.len()).filter(|&j| seen.insert(outcome::name(problem, j)));
    let column = |j| (outcome::name(problem, j).to_owned(), outcome::values(problem, j, design, evaluation));
    over_time(problem, "Constraints", first.map(column))
}

fn over_time(
    problem: &Problem,
    title: &str,
    columns: impl Iterator<Item = (String, Vec<Option<f64>>)>,
) -> linkwright::Result<Table> {
    let columns: Vec<(String, Vec<Option<f64>>)> = columns.collect();
    let times = problem.grids.first().map(|grid| (&grid.name, grid.shown_points()));
    let names = times.iter().map(|(name, _)| (*name).clone()).chain(columns.iter().map(|(name, _)| name.clone()));
    let mut table = Table::new(title, names);
    let rows = times.as_ref().map_or(1, |(_, points)| points.len());
    for p in 0..rows {
        let time = times.as_ref().map(|(_, points)| Cell::from(points[p]));
        let value =
            |(_, values): &(String, Vec<Option<f64>>)| values.get(p).copied().flatten().map_or(Cell::Empty, Cell::from);
        table.push(time.into_iter().chain(columns.iter().map(value)))?;
    }
    Ok(table)
}

/// Table of the derivatives of responses at time points.
pub fn sensitivities(problem: &Problem, values: &Responses, known: &Sensitivities) -> linkwright::Result<Table> {
    let names = problem.variables.iter().map(|v| format!("d/d {}", v.name));
    let axis = problem.grids.first().map_or("time", |grid| &grid.name);
    let fixed = ["response", axis, "value"].map(str::to_owned);
    let mut table = Table::new("Sensitivities", fixed.into_iter().chain(names));
    for (k, at) in known.at.iter().enumerate() {
        let response = &problem.responses[at.response];
        let time = response.grid.map(|g| &problem.grids[g]);
        let time = time.map_or(Cell::Empty, |grid| Cell::from(grid.shown(grid.points[at.point])));
        let fixed = [Cell::from(response.name.as_str()), time, values.at(*at).into()];
        table.push(fixed.into_iter().chain(known.rows.row(k).iter().map(|d| Cell::from(*d))))?;
    }
    Ok(table)
}
