//! The page and its head; design variables, objective and constraints as tables.

use super::design_space_slice::Slice;
use super::{OptimizationReport, change, change_cell, number};
use crate::Result;
use crate::report::outcome::{self, ConstraintValue};
use crate::report::page::{Badge, Page, PageSection};
use crate::report::table::{Cell, Table};
use crate::sao::Status;

impl OptimizationReport<'_> {
    /// The page. `slice` gives the section of the design space; the sections `more`, such as an animation of the mechanism,
    /// follow the table of the design variables.
    ///
    /// # Errors
    /// Those of the figures, if a number is not finite.
    pub fn page(&self, slice: Option<&Slice>, more: Vec<PageSection>) -> Result<Page> {
        let mut sections = vec![self.design()?];
        sections.extend(more);
        let mut curves = vec![];
        let histories = self.histories(&mut curves)?;
        sections.extend([self.constraints()?, self.convergence()?, histories, self.prediction_accuracy()?]);
        sections.push(self.design_space(slice)?);
        sections.push(self.optimality()?);
        let page = self.head().choices(self.choices(&curves));
        Ok(sections.into_iter().filter(|section| !section.is_empty()).fold(page, Page::with))
    }

    /// The head of the page: title, status and main results.
    pub(super) fn head(&self) -> Page {
        let (problem, state) = (self.problem, self.state);
        let (word, badge, mut lead) = self.status();
        lead.extend(self.better());
        lead.extend(outcome::failed_steps(state).as_deref().map(|text| format!(" {}", sentence(text))));
        let (before, after) = self.objective();
        let unit = |value: f64| format!("{} {}", number(value), problem.objective.unit).trim_end().to_owned();
        let changed = change(before, after).map_or_else(String::new, |c| format!(", {}", percent(c)));
        let (label, value, nearest) = self.nearest();
        let rejected = state.history.iter().filter(|c| !c.accepted).count();
        let iterations = format!("{} iterations of the subproblem solver", state.counters.subproblem_iterations);
        Page::new(self.title)
            .status(word, badge)
            .lead(lead)
            .card(&problem.objective.name, unit(after), format!("from {}{changed}", unit(before)))
            .card(label, value, nearest)
            .card("cycles", state.cycles().to_string(), format!("and {rejected} rejected step{}", plural(rejected)))
            .card(
                "analyses",
                state.counters.analyses.to_string(),
                format!("{} sensitivity analyses, {iterations}", state.counters.sensitivity_analyses),
            )
    }

    /// A sentence about the best design, if that is not the last one.
    fn better(&self) -> Option<String> {
        let (cycle, objective) = outcome::better_than_last(self.problem, self.state)?;
        let step = if cycle.accepted { "cycle" } else { "a rejected step of cycle" };
        let value = format!("{} {}", number(objective), self.problem.objective.unit);
        let violation = outcome::violation(self.problem, cycle)
            .map_or_else(String::new, |violation| format!(", largest violation {} %", number(violation.max(0.0))));
        let name = &self.problem.objective.name;
        Some(format!(" The best design is that of {step} {}: {name} {}{violation}.", cycle.cycle, value.trim_end()))
    }

    fn status(&self) -> (&'static str, Badge, String) {
        let state = self.state;
        let reason = sentence(&state.reason);
        match state.status {
            Status::Converged => ("converged", Badge::Good, reason),
            Status::Running => {
                let done = state.history.len() - 1;
                let text = format!(
                    "The run was interrupted or is not finished: the page shows the {done} trial steps so far and the last \
                     accepted design."
                );
                ("unfinished", Badge::Fair, text)
            }
            Status::CycleLimit => ("cycle limit", Badge::Fair, reason),
            Status::Stalled => ("stalled", Badge::Bad, reason),
            Status::Infeasible => ("infeasible", Badge::Bad, reason),
            _ => ("not converged", Badge::Bad, reason),
        }
    }

    /// Design variables at the first and at the last design.
    pub(super) fn design(&self) -> Result<PageSection> {
        let columns = ["variable", "unit", "first", "last", "change in %", "lower bound", "upper bound", "remark"];
        let mut table = Table::new("Design variables", columns);
        let bound = |b: f64| if b.is_finite() { Cell::from(b) } else { Cell::Empty };
        let peak = self.problem.objective.peak().map(|peak| peak.variable);
        let pairs = self.start().iter().zip(&self.state.design);
        for (k, (variable, (&from, &to))) in self.problem.variables.iter().zip(pairs).enumerate() {
            let is_peak = peak == Some(k);
            let remark = is_peak.then_some("bounds the peak").or(outcome::at_bound(self.problem, k, to));
            table.push([
                variable.name.as_str().into(),
                variable.unit.as_str().into(),
                from.into(),
                to.into(),
                // The start of the variable that bounds a peak may be a guess.
                if is_peak { Cell::Empty } else { change_cell(from, to) },
                bound(variable.lower),
                bound(variable.upper),
                remark.unwrap_or_default().into(),
            ])?;
        }
        // The two sides of a limit are one constraint.
        let names = outcome::stated_constraints(self.problem).map(|j| outcome::name(self.problem, j));
        let (n, m) = (self.problem.n(), names.collect::<std::collections::BTreeSet<_>>().len());
        let text = format!(
            "{} is {} over {n} design variable{}, subject to {m} constraint{}.",
            self.problem.objective.name,
            outcome::goal(self.problem),
            plural(n),
            plural(m)
        );
        Ok(PageSection::new("design", "Design").paragraph(text).table(table))
    }

    /// Objective and constraints at the first and at the last design.
    pub(super) fn constraints(&self) -> Result<PageSection> {
        let section = PageSection::new("constraints", "Objective and constraints");
        let mut objective = Table::new("Objective", ["objective", "unit", "first", "last", "change in %"]);
        let (before, after) = self.objective();
        let name = self.problem.objective.name.as_str();
        objective.push([
            name.into(),
            self.problem.objective.unit.as_str().into(),
            before.into(),
            after.into(),
            change_cell(before, after),
        ])?;
        let section = section.table(objective);
        let (first, last) = self.constraint_values();
        if last.is_empty() {
            return Ok(section);
        }
        let columns = ["constraint", "unit", "limit", "first", "last", "margin", "worst at", "remark"];
        let mut table = Table::new("Constraints at their smallest margins", columns);
        for (before, after) in first.iter().zip(&last) {
            table.push([
                after.name.as_str().into(),
                after.unit.as_str().into(),
                limit(after).as_str().into(),
                before.shown().into(),
                after.shown().into(),
                rounded(after).into(),
                after.time_in_words.as_deref().unwrap_or_default().into(),
                after.status().into(),
            ])?;
        }
        Ok(section.table(table))
    }

    /// The objective at the first and at the last design.
    fn objective(&self) -> (f64, f64) {
        let of = |design: &[f64], evaluation| outcome::objective(self.problem, design, evaluation);
        (of(self.start(), &self.first.1), of(&self.state.design, &self.state.evaluation))
    }

    /// The constraints at the first and at the last design.
    fn constraint_values(&self) -> (Vec<ConstraintValue>, Vec<ConstraintValue>) {
        let of = |design: &[f64], evaluation| outcome::constraints(self.problem, design, evaluation);
        (of(self.start(), &self.first.1), of(&self.state.design, &self.state.evaluation))
    }

    /// Label, value and remark of the card of the constraints: the largest violation, or the nearest constraint.
    fn nearest(&self) -> (&'static str, String, String) {
        let last = self.constraint_values().1;
        let relative = |c: &ConstraintValue| if c.size > 0.0 { c.margin / c.size } else { 0.0 };
        let Some(nearest) = last.iter().min_by(|a, b| relative(a).total_cmp(&relative(b))) else {
            return ("constraints", "none".to_owned(), String::new());
        };
        let time = nearest.time_in_words.as_ref();
        let place = time.map_or_else(|| nearest.name.clone(), |time| format!("{} at {time}", nearest.name));
        let violated = last.iter().filter(|c| c.status() == "violated").count();
        if violated > 0 {
            let unit = &nearest.unit;
            let by = format!("{place}: {} {unit} instead of {} {unit}", number(nearest.value), limit(nearest));
            return ("constraints", format!("{violated} violated"), by);
        }
        ("constraints", "all satisfied".to_owned(), format!("nearest: {place}"))
    }
}

/// The side and the limit of a constraint.
fn limit(constraint: &ConstraintValue) -> String {
    format!("{} {}", constraint.relation(), number(constraint.limit))
}

/// The margin; zero instead of one of the order of rounding errors.
fn rounded(constraint: &ConstraintValue) -> f64 {
    if constraint.margin.abs() < 1e-6 * constraint.tolerance { 0.0 } else { constraint.margin }
}

fn plural(count: usize) -> &'static str {
    if count == 1 { "" } else { "s" }
}

fn percent(change: f64) -> String {
    format!("{}{}\u{a0}%", if change > 0.0 { "+" } else { "" }, number((change * 100.0).round() / 100.0))
}

/// A text with a capital letter and a full stop.
fn sentence(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |c| format!("{}{}.", c.to_uppercase(), letters.as_str()))
}
