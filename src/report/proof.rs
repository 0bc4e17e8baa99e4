//! Checked derivatives as a table.

use super::table::{Cell, Table};
use crate::error::Result;
use crate::problem::Problem;
use crate::problem::check::{Checked, Proof};

/// One row for each derivative: what the methods say, what differences say and how sure they are, the verdict and whom it
/// suspects.
pub fn table(problem: &Problem, proof: &Proof) -> Result<Table> {
    let fixed = ["response", "time", "variable"].map(String::from);
    let found = ["differences", "error", "finding", "suspect"].map(String::from);
    let columns = fixed.into_iter().chain(proof.methods.iter().cloned()).chain(found);
    let mut table = Table::new(format!("{}: derivatives", problem.name), columns);
    for derivative in &proof.derivatives {
        table.push(row(problem, proof, derivative))?;
    }
    Ok(table)
}

fn row(problem: &Problem, proof: &Proof, d: &Checked) -> Vec<Cell> {
    let response = &problem.responses[d.instant.response];
    let time = response.grid.map_or(Cell::Empty, |grid| Cell::Number(problem.grids[grid].points[d.instant.point]));
    let mut cells = vec![response.name.as_str().into(), time, problem.variables[d.variable].name.as_str().into()];
    cells.extend(d.claimed.iter().map(|&claimed| Cell::Number(claimed)));
    let [value, error] = d.difference.map_or([Cell::Empty, Cell::Empty], |s| [s.value, s.error].map(Cell::Number));
    let suspects: Vec<&str> = d.suspects.iter().map(|&k| proof.methods[k].as_str()).collect();
    cells.extend([value, error, d.finding.text().into(), suspects.join(", ").as_str().into()]);
    cells
}
