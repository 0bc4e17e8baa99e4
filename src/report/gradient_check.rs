//! Results of a gradient check, as a table and as text.

use super::table::{Cell, Table, aligned};
use crate::gradient_check::{CheckedDerivative, GradientCheck, GradientStatus};
use crate::problem::Problem;
use error::Result;
use std::fmt::Write;

/// Table with a row for each derivative: value by each method, finite differences with their error estimate, largest
/// disagreement, status (`finding`), disagreeing methods (`suspect`), explanation; and with one for each response that has no derivatives.
///
/// # Errors
/// If the number of methods and that of the derivatives differ.
pub fn table(problem: &Problem, checked: &GradientCheck) -> Result<Table> {
    let axis = problem.grids.first().map_or("time", |grid| &grid.name);
    let fixed = ["response", axis, "variable"].map(String::from);
    let found = ["differences", "error", "disagreement", "finding", "suspect", "explanation"].map(String::from);
    let columns = fixed.into_iter().chain(checked.methods.iter().cloned()).chain(found);
    let columns: Vec<String> = columns.collect();
    let count = columns.len();
    let mut table = Table::new(format!("{}: derivatives", problem.name), columns);
    for derivative in &checked.derivatives {
        table.push(row(problem, checked, derivative))?;
    }
    for (response, why) in &checked.without_derivatives {
        let mut cells = vec![Cell::Empty; count];
        cells[0] = problem.responses[*response].name.as_str().into();
        cells[count - 3..].clone_from_slice(&[NO_DERIVATIVE.into(), "".into(), why.as_str().into()]);
        table.push(cells)?;
    }
    Ok(table)
}

/// The verdict on a response that has no derivatives.
pub const NO_DERIVATIVE: &str = "no derivative";

fn row(problem: &Problem, checked: &GradientCheck, d: &CheckedDerivative) -> Vec<Cell> {
    let response = &problem.responses[d.at.response];
    let shown = |grid: usize| problem.grids[grid].shown(problem.grids[grid].points[d.at.point]);
    let time = response.grid.map_or(Cell::Empty, |grid| Cell::Number(shown(grid)));
    let mut cells = vec![response.name.as_str().into(), time, problem.variables[d.variable].name.as_str().into()];
    cells.extend(d.computed.iter().map(|&claimed| Cell::Number(claimed)));
    let [value, error] = d.difference.map_or([Cell::Empty, Cell::Empty], |s| [s.value, s.error].map(Cell::Number));
    let (disagreeing_methods, explanation) = (disagreeing_methods(checked, d), d.explanation(&checked.methods));
    cells.extend([value, error, d.disagreement().into(), d.status.text().into()]);
    cells.extend([disagreeing_methods.as_str().into(), explanation.as_str().into()]);
    cells
}

fn disagreeing_methods(checked: &GradientCheck, d: &CheckedDerivative) -> String {
    d.disagreeing.iter().map(|&k| checked.methods[k].as_str()).collect::<Vec<_>>().join(", ")
}

/// Results as text for a terminal: derivatives grouped by response and time, with `digits` significant digits; a star marks disagreeing methods.
///
/// Without `all`, only those derivatives are shown that are neither right nor constant, and the least accurate of the right
/// ones of each response.
pub fn text(problem: &Problem, checked: &GradientCheck, all: bool, digits: usize) -> String {
    let shown: Vec<&CheckedDerivative> = checked.derivatives.iter().filter(|d| all || is_notable(checked, d)).collect();
    let found = ["differences", "±", "apart", "verdict"].map(String::from);
    let methods = checked.methods.iter().map(|name| name.replace('-', " "));
    let headings: Vec<String> = std::iter::once("variable".to_owned()).chain(methods).chain(found).collect();
    let mut rows: Vec<Vec<String>> = shown.iter().map(|d| cells(problem, d, digits)).collect();
    rows.extend(checked.without_derivatives.iter().map(|_| {
        let mut cells = vec![String::new(); headings.len()];
        cells[headings.len() - 1] = NO_DERIVATIVE.to_owned();
        cells
    }));
    let aligned = aligned(&headings, &rows);
    let mut lines = aligned.lines();
    let mut text = String::new();
    for line in lines.by_ref() {
        let _ = writeln!(text, "{line}"); // a String takes everything
        if line.starts_with('─') {
            break;
        }
    }
    let mut before = None;
    for (line, d) in lines.by_ref().take(shown.len()).zip(&shown) {
        if before.replace(d.at) != Some(d.at) {
            let _ = writeln!(text, "{}", response_at(problem, d));
        }
        let _ = writeln!(text, "{line}");
    }
    for (line, (response, _)) in lines.zip(&checked.without_derivatives) {
        let _ = writeln!(text, "{}\n{line}", problem.responses[*response].name);
    }
    let hidden = checked.derivatives.len() - shown.len();
    if hidden > 0 {
        let _ = writeln!(text, "… and {hidden} more that agree at least as well (--all shows them)");
    }
    text + &explanations(problem, checked)
}

/// Largest number of explanations under the table.
const EXPLAINED: usize = 12;

/// A sentence for each derivative that is neither right nor constant, for each response without derivatives and for each method that failed.
fn explanations(problem: &Problem, checked: &GradientCheck) -> String {
    let bad: Vec<&CheckedDerivative> = checked.derivatives.iter().filter(|d| !d.is_fine()).collect();
    let line = |d: &&CheckedDerivative| {
        let variable = &problem.variables[d.variable].name;
        format!("{} by {variable}: {}\n", response_at(problem, d), d.explanation(&checked.methods))
    };
    let more = bad.len().saturating_sub(EXPLAINED);
    let rest = if more > 0 { format!("… and {more} more\n") } else { String::new() };
    let failed = checked.failed.iter().map(|(method, why)| format!("the {method} method failed: {why}\n"));
    let without = checked.without_derivatives.iter();
    let without = without.map(|(response, why)| format!("{}: {why}\n", problem.responses[*response].name));
    bad.iter().take(EXPLAINED).map(line).chain([rest]).chain(without).chain(failed).collect()
}

/// Returns `true` if a derivative is neither right nor constant, or is the least accurate of its response.
fn is_notable(checked: &GradientCheck, d: &CheckedDerivative) -> bool {
    let relative =
        |d: &CheckedDerivative| d.disagreement() / d.computed.iter().fold(f64::MIN_POSITIVE, |a, x| a.max(x.abs()));
    let same = |other: &&CheckedDerivative| other.at.response == d.at.response && other.status == GradientStatus::Right;
    let worst = checked.derivatives.iter().filter(same).max_by(|a, b| relative(a).total_cmp(&relative(b)));
    !d.is_fine() || worst.is_some_and(|worst| std::ptr::eq(worst, d))
}

fn response_at(problem: &Problem, d: &CheckedDerivative) -> String {
    let response = &problem.responses[d.at.response];
    match response.grid {
        Some(_) => format!("{} at {}", response.name, problem.time_in_words(response.grid, d.at.point)),
        None => response.name.clone(),
    }
}

fn cells(problem: &Problem, d: &CheckedDerivative, digits: usize) -> Vec<String> {
    let mut cells = vec![problem.variables[d.variable].name.clone()];
    let star = |k: usize| match (d.disagreeing.contains(&k), d.inaccurate.contains(&k)) {
        (true, _) => "*",
        (_, true) => "~",
        _ => "",
    };
    cells.extend(d.computed.iter().enumerate().map(|(k, &claimed)| in_digits(claimed, digits) + star(k)));
    let [value, error] = d.difference.map_or(Default::default(), |s| [in_digits(s.value, digits), one_digit(s.error)]);
    cells.extend([value, error, one_digit(d.disagreement()), d.status.text().to_owned()]);
    cells
}

fn in_digits(value: f64, digits: usize) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.*e}", digits.max(1) - 1) }
}

/// One digit, for error estimates.
fn one_digit(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.0e}") }
}
