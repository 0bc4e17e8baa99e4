//! Runs of methods on suites of problems: table of runs, summary, performance and data profiles.

use super::figure::Figure;
use super::plots::{Solver, data_profile, performance_profile};
use super::table::{Cell, Table};
use crate::cases::suite::{SuiteRun, Verdict};
use error::Result;
use std::collections::HashMap;

/// Label of the work in the figures.
const WORK: &str = "analyses + sensitivity analyses";

/// A problem with its transformation.
type TransformedProblem = (&'static str, String);

fn key(run: &SuiteRun) -> TransformedProblem {
    (run.problem, run.transformation.to_string())
}

/// Names of the methods in the order of their first run.
fn methods(runs: &[SuiteRun]) -> Vec<&str> {
    let mut names: Vec<&str> = vec![];
    for run in runs {
        if !names.contains(&run.method.as_str()) {
            names.push(&run.method);
        }
    }
    names
}

/// Table with a row for each run: verdict, status, work, objective and its distance from the known optimum, violation relative to the
/// terms of the row.
///
/// # Errors
/// None: every row has a cell for each column.
pub fn runs<'a>(title: &str, runs: impl IntoIterator<Item = &'a SuiteRun>) -> Result<Table> {
    let columns = [
        "problem",
        "transformation",
        "method",
        "verdict",
        "status",
        "analyses",
        "sensitivity_analyses",
        "objective",
        "from_optimum",
        "violation",
    ];
    let mut table = Table::new(title, columns);
    for run in runs {
        let number = |v: Option<f64>| v.filter(|v| v.is_finite()).map_or(Cell::Empty, Cell::Number);
        table.push([
            run.problem.into(),
            run.transformation.to_string().as_str().into(),
            run.method.as_str().into(),
            run.verification.map_or("refused".to_owned(), |j| j.verdict.to_string()).as_str().into(),
            run.status.as_str().into(),
            run.work.analyses.into(),
            run.work.sensitivity_analyses.into(),
            number(run.verification.map(|j| j.objective)),
            number(run.verification.and_then(|j| j.excess)),
            number(run.verification.map(|j| j.violation)),
        ])?;
    }
    Ok(table)
}

/// Table with a row for each method: numbers of runs by verdict; median and sum of analyses and of sensitivity analyses over the solved
/// runs; geometric mean of the work relative to the least work of all methods, over the solved runs.
///
/// # Errors
/// None: every row has a cell for each column.
pub fn summary(title: &str, all: &[SuiteRun]) -> Result<Table> {
    let columns = [
        "method",
        "runs",
        "solved",
        "optimum",
        "local_optimum",
        "correct_end",
        "honest_end",
        "false",
        "refused",
        "median_analyses",
        "median_sensitivity_analyses",
        "sum_analyses",
        "sum_sensitivity_analyses",
        "mean_ratio",
    ];
    let headings = [
        "method",
        "runs",
        "solved",
        "opt.",
        "local",
        "correct",
        "honest",
        "FALSE",
        "refused",
        "median a",
        "s",
        "sum a",
        "s",
        "mean ratio",
    ];
    let mut table = Table::new(title, columns).headed(headings)?;
    let least = least_work(all);
    for method in methods(all) {
        let runs: Vec<&SuiteRun> = all.iter().filter(|run| run.method == method).collect();
        let solved: Vec<&SuiteRun> = runs.iter().copied().filter(|run| run.is_solved()).collect();
        let count = |v: Verdict| runs.iter().filter(|run| run.verification.is_some_and(|j| j.verdict == v)).count();
        let analyses: Vec<usize> = solved.iter().map(|run| run.work.analyses).collect();
        let sensitivities: Vec<usize> = solved.iter().map(|run| run.work.sensitivity_analyses).collect();
        let ratios: Vec<f64> =
            solved.iter().filter_map(|run| Some(run.work.total() as f64 / *least.get(&key(run))? as f64)).collect();
        let mean = (ratios.iter().map(|r| r.ln()).sum::<f64>() / ratios.len() as f64).exp();
        table.push([
            method.into(),
            runs.len().into(),
            solved.len().into(),
            count(Verdict::Optimum).into(),
            count(Verdict::LocalOptimum).into(),
            count(Verdict::CorrectEnd).into(),
            count(Verdict::Unsolved).into(),
            count(Verdict::False).into(),
            runs.iter().filter(|run| run.verification.is_none()).count().into(),
            median(&analyses).map_or(Cell::Empty, Cell::Number),
            median(&sensitivities).map_or(Cell::Empty, Cell::Number),
            analyses.iter().sum::<usize>().into(),
            sensitivities.iter().sum::<usize>().into(),
            if mean.is_finite() { Cell::Number(mean) } else { Cell::Empty },
        ])?;
    }
    Ok(table)
}

/// The least work of all methods that solve a problem.
fn least_work(all: &[SuiteRun]) -> HashMap<TransformedProblem, usize> {
    let mut least = HashMap::new();
    for run in all.iter().filter(|run| run.is_solved()) {
        let entry = least.entry(key(run)).or_insert(usize::MAX);
        *entry = run.work.total().min(*entry);
    }
    least
}

fn median(values: &[usize]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_unstable();
    let middle = sorted.len().checked_sub(1)?;
    Some(0.5 * (sorted[middle / 2] + sorted[middle.div_ceil(2)]) as f64)
}

/// Draws the performance profile and the data profile of the methods over all problems that any method has run on. The cost is the
/// work of the whole run, infinite for a run that does not solve its problem.
///
/// # Errors
/// If there are no runs.
pub fn profiles(all: &[SuiteRun]) -> Result<[Figure; 2]> {
    let mut keys: Vec<TransformedProblem> = vec![];
    let mut numbers: HashMap<TransformedProblem, usize> = HashMap::new();
    for run in all {
        numbers.entry(key(run)).or_insert_with(|| {
            keys.push(key(run));
            keys.len() - 1
        });
    }
    let names = methods(all);
    let mut costs = vec![vec![f64::INFINITY; keys.len()]; names.len()];
    for run in all.iter().filter(|run| run.is_solved()) {
        let method = names.iter().position(|name| *name == run.method).unwrap_or_default();
        costs[method][numbers[&key(run)]] = run.work.total().max(1) as f64;
    }
    let solvers: Vec<Solver> = names.iter().zip(&costs).map(|(name, costs)| Solver { name, costs }).collect();
    let size = |figure: Figure| figure.sized(150.0, 110.0 + 2.0 * names.len() as f64);
    Ok([size(performance_profile(WORK, &solvers)?), size(data_profile(WORK, &solvers)?)])
}
