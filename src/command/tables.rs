//! Cycles, histories and derivatives as tables.

use linkwright::problem::{Evaluation, Problem, ResponseAt, Responses, RowId};
use linkwright::report::run::step_cells;
use linkwright::report::table::{Cell, Table};
use linkwright::sao::Cycle;
use nalgebra::DMatrix;

/// Table of trial steps, accepted and rejected.
pub fn cycles(problem: &Problem, history: &[Cycle]) -> linkwright::Result<Table> {
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
    for c in history {
        let fixed = [c.cycle.into(), usize::from(c.accepted).into()].into_iter().chain(step_cells(c));
        let design = c.design.iter().map(|b| Cell::from(*b));
        table.push(fixed.chain([c.iterations.into()]).chain(design))?;
    }
    Ok(table)
}

/// Table of all responses over time; a response without time has a value in the first row only.
pub fn responses(problem: &Problem, values: &Responses) -> linkwright::Result<Table> {
    over_time(problem, "Responses", problem.responses.iter().zip(&values.values).map(|(r, v)| (r.name.clone(), v)))
}

/// Table of all constraints over time, normalized: feasible up to one.
pub fn constraints(problem: &Problem, evaluation: &Evaluation) -> linkwright::Result<Table> {
    let columns = problem.constraints.iter().zip(&evaluation.constraints).map(|(c, v)| (c.name.clone(), v));
    over_time(problem, "Constraints", columns)
}

fn over_time<'v>(
    problem: &Problem,
    title: &str,
    columns: impl Iterator<Item = (String, &'v Vec<f64>)>,
) -> linkwright::Result<Table> {
    let columns: Vec<(String, &Vec<f64>)> = columns.collect();
    let times = problem.grids.first().map(|grid| (&grid.name, &grid.points));
    let names = times.iter().map(|(name, _)| (*name).clone()).chain(columns.iter().map(|(name, _)| name.clone()));
    let mut table = Table::new(title, names);
    let rows = times.map_or(1, |(_, points)| points.len());
    for p in 0..rows {
        let time = times.map(|(_, points)| Cell::from(points[p]));
        let value = |(_, values): &(String, &Vec<f64>)| values.get(p).map_or(Cell::Empty, |v| Cell::from(*v));
        table.push(time.into_iter().chain(columns.iter().map(value)))?;
    }
    Ok(table)
}

/// Table of the derivatives of all responses at all time points.
pub fn sensitivities(
    problem: &Problem,
    values: &Responses,
    points: &[ResponseAt],
    rows: &DMatrix<f64>,
) -> linkwright::Result<Table> {
    let names = problem.variables.iter().map(|v| format!("d/d {}", v.name));
    let fixed = ["response", "time", "value"].map(str::to_owned);
    let mut table = Table::new("Sensitivities", fixed.into_iter().chain(names));
    for (k, at) in points.iter().enumerate() {
        let response = &problem.responses[at.response];
        let time = response.grid.map_or(Cell::Empty, |g| Cell::from(problem.grids[g].points[at.point]));
        let fixed = [Cell::from(response.name.as_str()), time, values.at(*at).into()];
        table.push(fixed.into_iter().chain(rows.row(k).iter().map(|d| Cell::from(*d))))?;
    }
    Ok(table)
}

/// The time point of the largest violation of each constraint, or of its smallest margin.
pub fn worst(problem: &Problem, evaluation: &Evaluation) -> Vec<RowId> {
    (0..problem.constraints.len()).filter_map(|j| evaluation.worst_of(j)).map(|(row, _)| row).collect()
}
