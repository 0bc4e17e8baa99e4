//! Comparison of methods on one problem and on many.

use super::figure::Figure;
use super::plots::{Approach, Solver, approach, performance_profile};
use super::table::{Cell, Table};
use crate::cases::{AnalysisCounts, Attempt, CatalogueEntry, Conclusion};
use error::Result;

/// Label of the work in the figures.
const WORK: &str = "analyses + sensitivity analyses";

/// Table with a row for each method: first those that reach a known optimum, with increasing work.
///
/// Columns: conclusion; analyses and sensitivity analyses (gradients) up to the first design at the known optimum, within 1e-5
/// or the uncertainty of the optimum; accepted cycles, analyses and sensitivity analyses of the whole run; at its end the
/// objective F, the largest violation V as a fraction, the KKT residual, and F/F* − 1.
///
/// # Errors
/// Never fails: every row has a cell for each column.
pub fn table(entry: &CatalogueEntry, attempts: &[Attempt]) -> Result<Table> {
    let columns = [
        "method",
        "end",
        "analyses_to_optimum",
        "gradients_to_optimum",
        "cycles",
        "analyses",
        "gradients",
        "objective",
        "violation",
        "kkt_residual",
        "from_optimum",
    ];
    let headings =
        ["method", "end", "to 1e-5: analyses", "grad", "cycles", "analyses", "grad", "F", "V", "KKT", "F/F* - 1"];
    let mut table = Table::new(format!("{}: {}", entry.name, entry.title), columns).headed(headings)?;
    for a in ranked(attempts) {
        // Numbers below 1e-12 are rounding errors.
        let number = |v: f64| match v {
            v if !v.is_finite() => Cell::Empty,
            v if v.abs() < 1e-12 => Cell::Number(0.0),
            v => Cell::Number(v),
        };
        let whole = |v: Option<usize>| v.map_or(Cell::Empty, Cell::from);
        let ran = !matches!(a.conclusion, Conclusion::Refused(_));
        table.push([
            a.method.into(),
            a.conclusion.to_string().as_str().into(),
            whole(a.to_optimum.map(|w| w.analyses)),
            whole(a.to_optimum.map(|w| w.sensitivity_analyses)),
            whole(ran.then_some(a.cycles)),
            whole(ran.then_some(a.work.analyses)),
            whole(ran.then_some(a.work.sensitivity_analyses)),
            number(a.objective),
            number(a.violation),
            number(a.residual),
            a.excess.map_or(Cell::Empty, number),
        ])?;
    }
    Ok(table)
}

/// Draws the distance from the known optimum over the work for all methods that ran.
///
/// # Errors
/// If no method ran.
pub fn distances(attempts: &[Attempt]) -> Result<Figure> {
    let ran = ranked(attempts).into_iter().filter(|a| !a.approach.is_empty());
    let lines: Vec<Approach> = ran.map(|a| Approach { name: a.method, designs: &a.approach }).collect();
    approach(WORK, &lines)
}

/// Draws the performance profile over problems. The cost is the work to the known optimum (analyses + sensitivity analyses),
/// infinite without convergence to it.
///
/// `problems` contains, for each problem, the attempts of the same methods in the same order. Problems that no method solves are
/// omitted.
///
/// # Errors
/// If no method solves any problem, or the methods differ between problems.
pub fn profile(problems: &[Vec<Attempt>]) -> Result<Figure> {
    let cost = |a: &Attempt| match (&a.conclusion, a.to_optimum) {
        (Conclusion::Reached(_), Some(work)) => work.total() as f64,
        _ => f64::INFINITY,
    };
    let solved: Vec<&Vec<Attempt>> = problems.iter().filter(|p| p.iter().any(|a| cost(a).is_finite())).collect();
    let methods = solved.first().map_or(0, |first| first.len());
    let costs: Vec<Vec<f64>> =
        (0..methods).map(|k| solved.iter().filter_map(|p| p.get(k)).map(cost).collect()).collect();
    let named = |(k, costs): (usize, _)| Solver { name: solved[0][k].method, costs };
    let solvers: Vec<Solver> = costs.iter().map(Vec::as_slice).enumerate().map(named).collect();
    Ok(performance_profile(WORK, &solvers)?.sized(150.0, 140.0))
}

/// Table of each method's successes and failures, and of its median work relative to the least work on each problem.
///
/// # Errors
/// If the methods differ between problems.
pub fn summary(problems: &[Vec<Attempt>]) -> Result<Table> {
    let columns = ["method", "optimum", "other_optimum", "unfinished", "false", "refused", "median_work_ratio"];
    let title = format!("{} problems; work relative to the least of all methods", problems.len());
    let mut table = Table::new(title, columns);
    let work = |a: &Attempt| match (&a.conclusion, a.to_optimum) {
        (Conclusion::Reached(_), Some(work)) => Some(work.total()),
        _ => None,
    };
    for k in 0..problems.first().map_or(0, Vec::len) {
        let runs: Vec<&Attempt> = problems.iter().filter_map(|p| p.get(k)).collect();
        let count = |of: fn(&Conclusion) -> bool| Cell::from(runs.iter().filter(|a| of(&a.conclusion)).count());
        let least = |p: &Vec<Attempt>| p.iter().filter_map(work).min();
        let ratio = |p: &Vec<Attempt>| Some(work(p.get(k)?)? as f64 / least(p)? as f64);
        let mut ratios: Vec<f64> = problems.iter().filter_map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        table.push([
            runs.first().map_or(Cell::Empty, |a| a.method.into()),
            count(|c| matches!(c, Conclusion::Reached(_))),
            count(|c| *c == Conclusion::OtherOptimum),
            count(|c| matches!(c, Conclusion::Unfinished(_))),
            count(|c| *c == Conclusion::False),
            count(|c| matches!(c, Conclusion::Refused(_))),
            ratios.get(ratios.len() / 2).map_or(Cell::Empty, |r| Cell::Number(*r)),
        ])?;
    }
    Ok(table)
}

/// Attempts in the order of the table.
fn ranked(attempts: &[Attempt]) -> Vec<&Attempt> {
    let mut all: Vec<&Attempt> = attempts.iter().collect();
    let class = |a: &Attempt| match a.conclusion {
        Conclusion::Reached(_) => 0,
        Conclusion::OtherOptimum => 1,
        Conclusion::Unfinished(_) => 2,
        Conclusion::False => 3,
        Conclusion::Refused(_) => 4,
    };
    all.sort_by_key(|a| (class(a), a.to_optimum.as_ref().map_or(usize::MAX, AnalysisCounts::total), a.work.total()));
    all
}
