//! Checked derivatives as a table.

use super::table::{Cell, Table, aligned};
use crate::gradient_check::{Checked, GradientCheck, GradientStatus};
use crate::problem::Problem;
use error::Result;
use std::fmt::Write;

/// One row for each derivative: what the methods say, what differences say and how sure they are, by how much all of them
/// disagree, the verdict, whom it suspects, and why.
pub fn table(problem: &Problem, proof: &GradientCheck) -> Result<Table> {
    let fixed = ["response", "time", "variable"].map(String::from);
    let found = ["differences", "error", "disagreement", "finding", "suspect", "explanation"].map(String::from);
    let columns = fixed.into_iter().chain(proof.methods.iter().cloned()).chain(found);
    let mut table = Table::new(format!("{}: derivatives", problem.name), columns);
    for derivative in &proof.derivatives {
        table.push(row(problem, proof, derivative))?;
    }
    Ok(table)
}

fn row(problem: &Problem, proof: &GradientCheck, d: &Checked) -> Vec<Cell> {
    let response = &problem.responses[d.at.response];
    let time = response.grid.map_or(Cell::Empty, |grid| Cell::Number(problem.grids[grid].points[d.at.point]));
    let mut cells = vec![response.name.as_str().into(), time, problem.variables[d.variable].name.as_str().into()];
    cells.extend(d.computed.iter().map(|&claimed| Cell::Number(claimed)));
    let [value, error] = d.difference.map_or([Cell::Empty, Cell::Empty], |s| [s.value, s.error].map(Cell::Number));
    let (suspects, explanation) = (suspects(proof, d), d.explanation(&proof.methods));
    cells.extend([value, error, d.disagreement().into(), d.status.text().into()]);
    cells.extend([suspects.as_str().into(), explanation.as_str().into()]);
    cells
}

fn suspects(proof: &GradientCheck, d: &Checked) -> String {
    d.disagreeing.iter().map(|&k| proof.methods[k].as_str()).collect::<Vec<_>>().join(", ")
}

/// The same for a terminal: the derivatives of one response at one time under each other, numbers in four digits, those of
/// suspects with a star.
///
/// Unless `all` are wanted, of those that are right or constant only the least certain of each response is shown, and the others
/// are counted.
pub fn text(problem: &Problem, proof: &GradientCheck, all: bool) -> String {
    let shown: Vec<&Checked> = proof.derivatives.iter().filter(|d| all || is_telling(proof, d)).collect();
    let found = ["differences", "±", "apart", "verdict"].map(String::from);
    let methods = proof.methods.iter().map(|name| name.replace('-', " "));
    let headings: Vec<String> = std::iter::once("variable".to_owned()).chain(methods).chain(found).collect();
    let rows: Vec<Vec<String>> = shown.iter().map(|d| cells(problem, d)).collect();
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
    for (line, d) in lines.zip(&shown) {
        if before.replace(d.at) != Some(d.at) {
            let _ = writeln!(text, "{}", place(problem, d));
        }
        let _ = writeln!(text, "{line}");
    }
    let hidden = proof.derivatives.len() - shown.len();
    if hidden > 0 {
        let _ = writeln!(text, "… and {hidden} more that agree at least as well (--all shows them)");
    }
    text + &explanations(problem, proof)
}

/// Most explanations under the table.
const EXPLAINED: usize = 12;

/// A sentence for everything that is neither right nor constant.
fn explanations(problem: &Problem, proof: &GradientCheck) -> String {
    let bad: Vec<&Checked> = proof.derivatives.iter().filter(|d| !d.is_fine()).collect();
    let line = |d: &&Checked| {
        let variable = &problem.variables[d.variable].name;
        format!("{} by {variable}: {}\n", place(problem, d), d.explanation(&proof.methods))
    };
    let more = bad.len().saturating_sub(EXPLAINED);
    let rest = if more > 0 { format!("… and {more} more\n") } else { String::new() };
    bad.iter().take(EXPLAINED).map(line).collect::<String>() + &rest
}

/// Whether a derivative is shown: it is not fine, or the least certain of its response.
fn is_telling(proof: &GradientCheck, d: &Checked) -> bool {
    let relative = |d: &Checked| d.disagreement() / d.computed.iter().fold(f64::MIN_POSITIVE, |a, x| a.max(x.abs()));
    let same = |other: &&Checked| other.at.response == d.at.response && other.status == GradientStatus::Right;
    let worst = proof.derivatives.iter().filter(same).max_by(|a, b| relative(a).total_cmp(&relative(b)));
    !d.is_fine() || worst.is_some_and(|worst| std::ptr::eq(worst, d))
}

fn place(problem: &Problem, d: &Checked) -> String {
    let response = &problem.responses[d.at.response];
    match response.grid {
        Some(_) => format!("{} at {}", response.name, problem.time_in_words(response.grid, d.at.point)),
        None => response.name.clone(),
    }
}

fn cells(problem: &Problem, d: &Checked) -> Vec<String> {
    let mut cells = vec![problem.variables[d.variable].name.clone()];
    let star = |k: usize| if d.disagreeing.contains(&k) { "*" } else { "" };
    cells.extend(d.computed.iter().enumerate().map(|(k, &claimed)| four_digits(claimed) + star(k)));
    let [value, error] = d.difference.map_or(Default::default(), |s| [four_digits(s.value), size(s.error)]);
    cells.extend([value, error, size(d.disagreement()), d.status.text().to_owned()]);
    cells
}

fn four_digits(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.3e}") }
}

/// What is known to a digit at best.
fn size(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.0e}") }
}
