//! The head of the page; design variables, objective and constraints as tables.

use super::{OptimizationReport, change, number};
use crate::Result;
use crate::problem::{Constraint, DesignVariable, Evaluation, Side};
use crate::report::page::{Badge, Page, PageSection};
use crate::report::table::{Cell, Table};
use crate::sao::Status;

/// Violation in percent up to which a constraint counts as satisfied.
const SATISFIED: f64 = 1e-3;
/// Distance from the limit in percent up to which a constraint counts as active.
const ACTIVE: f64 = 1.0;

impl OptimizationReport<'_> {
    /// The head of the page: title, status and main results.
    pub(super) fn head(&self) -> Page {
        let (problem, state) = (self.problem, self.state);
        let (word, badge, lead) = self.status();
        let (before, after) = (self.first.1.objective, state.evaluation.objective);
        let unit = |value: f64| format!("{} {}", number(value), problem.objective.unit).trim_end().to_owned();
        let changed = change(before, after).map_or_else(String::new, |c| format!(", {}", percent(c)));
        let violation = state.evaluation.max_violation_pct();
        let nearest = state.evaluation.worst().map_or_else(String::new, |(row, _)| problem.row_in_words(row));
        let (label, value) = match violation {
            v if v > SATISFIED => ("largest violation", format!("{} %", number(v))),
            v if v <= -100.0 && nearest.is_empty() => ("constraints", "none".to_owned()),
            _ => ("constraints", "all satisfied".to_owned()),
        };
        let rejected = state.history.iter().filter(|c| !c.accepted).count();
        let iterations = format!("{} iterations of the subproblem solver", state.counters.subproblem_iterations);
        Page::new(self.title)
            .status(word, badge)
            .lead(lead)
            .card(&problem.objective.name, unit(after), format!("from {}{changed}", unit(before)))
            .card(label, value, if nearest.is_empty() { nearest } else { format!("nearest: {nearest}") })
            .card("cycles", state.cycles().to_string(), format!("and {rejected} rejected step{}", plural(rejected)))
            .card(
                "analyses",
                state.counters.analyses.to_string(),
                format!("{} sensitivity analyses, {iterations}", state.counters.sensitivity_analyses),
            )
    }

    fn status(&self) -> (&'static str, Badge, String) {
        let reason = |text: &str| {
            let mut letters = text.chars();
            letters.next().map_or_else(String::new, |c| format!("{}{}.", c.to_uppercase(), letters.as_str()))
        };
        let state = self.state;
        match state.status {
            Status::Converged => ("converged", Badge::Good, reason(&state.reason)),
            Status::Running => {
                let done = state.history.len() - 1;
                let text = format!(
                    "The run was interrupted or is not finished: the page shows the {done} trial steps so far and the last \
                     accepted design."
                );
                ("unfinished", Badge::Fair, text)
            }
            Status::CycleLimit => ("cycle limit", Badge::Fair, reason(&state.reason)),
            Status::Stalled => ("stalled", Badge::Bad, reason(&state.reason)),
            Status::Infeasible => ("infeasible", Badge::Bad, reason(&state.reason)),
            _ => ("not converged", Badge::Bad, reason(&state.reason)),
        }
    }

    /// Design variables at the first and at the last design.
    pub(super) fn design(&self) -> Result<PageSection> {
        let columns = ["variable", "unit", "first", "last", "change in %", "lower bound", "upper bound", "remark"];
        let mut table = Table::new("Design variables", columns);
        let bound = |b: f64| if b.is_finite() { Cell::from(b) } else { Cell::Empty };
        let peak = self.problem.objective.peak().map(|peak| &self.problem.variables[peak.variable].name);
        for ((variable, &from), &to) in self.problem.variables.iter().zip(self.start()).zip(&self.state.design) {
            table.push([
                variable.name.as_str().into(),
                variable.unit.as_str().into(),
                from.into(),
                to.into(),
                change(from, to).map_or(Cell::Empty, Cell::from),
                bound(variable.lower),
                bound(variable.upper),
                remark(variable, to, peak == Some(&variable.name)).into(),
            ])?;
        }
        let (n, m) = (self.problem.n(), self.problem.constraints.len());
        let text = format!(
            "{} is minimized over {n} design variable{}, subject to {m} constraint{}.",
            self.problem.objective.name,
            plural(n),
            plural(m)
        );
        Ok(PageSection::new("design", "Design").paragraph(text).table(table))
    }

    /// Objective and constraints at the first and at the last design.
    pub(super) fn constraints(&self) -> Result<PageSection> {
        let section = PageSection::new("constraints", "Objective and constraints");
        let mut objective = Table::new("Objective", ["objective", "unit", "first", "last", "change in %"]);
        let (before, after) = (self.first.1.objective, self.state.evaluation.objective);
        let name = self.problem.objective.name.as_str();
        let changed = change(before, after).map_or(Cell::Empty, Cell::from);
        objective.push([
            name.into(),
            self.problem.objective.unit.as_str().into(),
            before.into(),
            after.into(),
            changed,
        ])?;
        let section = section.table(objective);
        if self.problem.constraints.is_empty() {
            return Ok(section);
        }
        let columns = ["constraint", "limit", "first", "last", "violation in %", "worst at", "remark"];
        let title = "Largest values of the constraints, normalized: the limit is 1";
        let mut table = Table::new(title, columns);
        for (j, constraint) in self.problem.constraints.iter().enumerate() {
            let worst = |evaluation: &Evaluation| evaluation.worst_of(j).expect("a constraint has a time point");
            let ((row, last), (_, first)) = (worst(&self.state.evaluation), worst(&self.first.1));
            let violation = rounded(100.0 * self.state.evaluation.violation(j, last));
            let quantity = &constraint.quantity;
            let at = if quantity.is_transient() {
                self.problem.time_in_words(quantity.grid(), row.point)
            } else {
                String::new()
            };
            let relation = self.relation(constraint);
            table.push([
                constraint.name.as_str().into(),
                relation.as_str().into(),
                first.into(),
                last.into(),
                violation.into(),
                at.as_str().into(),
                constraint_status(violation).into(),
            ])?;
        }
        Ok(section.table(table))
    }

    /// The side and the limit of a constraint.
    fn relation(&self, constraint: &Constraint) -> String {
        let (sign, minus) = match constraint.side {
            Side::AtMost => ("\u{2264}", ""),
            Side::AtLeast => ("\u{2265}", "\u{2212}"),
            Side::Equal => ("=", ""),
        };
        match constraint.bound {
            Some(k) => format!("{sign} {minus}{}", self.problem.variables[k].name),
            None => format!("{sign} {}", number(constraint.limit)),
        }
    }
}

/// Zero instead of a violation of the order of rounding errors.
fn rounded(violation: f64) -> f64 {
    if violation.abs() < 1e-9 { 0.0 } else { violation }
}

fn constraint_status(violation: f64) -> &'static str {
    match violation {
        v if v > SATISFIED => "violated",
        v if v > -ACTIVE => "active",
        _ => "satisfied",
    }
}

fn remark(variable: &DesignVariable, value: f64, is_peak: bool) -> &'static str {
    let is_at =
        |bound: f64| bound.is_finite() && (value - bound).abs() <= 1e-6 * value.abs().max(bound.abs()).max(1e-12);
    match () {
        () if is_at(variable.lower) => "at its lower bound",
        () if is_at(variable.upper) => "at its upper bound",
        () if is_peak => "bounds the peak",
        () => "",
    }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn percent(change: f64) -> String {
    format!("{}{}\u{a0}%", if change > 0.0 { "+" } else { "" }, number((change * 100.0).round() / 100.0))
}
