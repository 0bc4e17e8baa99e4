//! Records of the JSON files: `run.json`, `summary.json` and the lines of `history.jsonl`.

use crate::command::output::{argument, now};
use crate::command::output_folder::{OutputFolder, RUN, STUDY};
use anyhow::{Context, bail};
use linkwright::model_file::{Model, settings};
use linkwright::problem::{DesignVariable, Problem};
use linkwright::report::number::{counted, readable, with_unit};
use linkwright::report::outcome::{self, ConstraintValue};
use linkwright::report::table::one_line;
use linkwright::sao::{Cycle, RunState, Status};
use linkwright::storage::{Directory, fnv1a};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the files of a run directory.
const VERSION: u32 = 1;
/// Version of `state.json`. Files up to version 2 have the history in them and no checksum.
pub const STATE_FILE_VERSION: u32 = 3;
/// Largest sizes in bytes of `run.json`, which has the model and its edits in it, and of `summary.json`.
const RUN_LIMIT: u64 = 256 << 20;
const SUMMARY_LIMIT: u64 = 256 << 20;
/// Name of the summary.
pub const SUMMARY: &str = "summary.json";

/// The part of the history up to the last cycle of a state.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Prefix {
    /// Number of its cycles.
    pub cycles: usize,
    /// Its length.
    pub bytes: u64,
    /// FNV-1a hash of its bytes, in hexadecimal.
    pub hash: String,
}

/// Versions of the files and of the program that wrote them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Versions {
    /// Version of the files of the folder.
    pub version: u32,
    /// Version of linkwright.
    pub program: String,
    /// Version of `state.json`.
    #[serde(default)]
    pub state: u32,
}

/// `run.json`: identity of a run, its model, and the edits of the model.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunRecord {
    #[serde(flatten)]
    pub versions: Versions,
    pub title: String,
    /// Time at which the run began, in UTC.
    #[serde(default)]
    pub begun: String,
    /// Path of the model file, as given on the command line.
    #[serde(default)]
    pub file: String,
    /// Hash of the bytes of the model file.
    #[serde(default)]
    pub input: String,
    /// Hash of the problem without bounds and method, in hexadecimal.
    pub fingerprint: String,
    /// Text of the model that was used last.
    pub model: String,
    pub edits: Vec<ModelEdit>,
}

/// An edit of the model between two parts of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModelEdit {
    /// Number of trial steps before the edit.
    pub after_tries: usize,
    /// Lines of the edited model that the former one does not have.
    pub lines: Vec<String>,
    /// Settings with other values than before.
    #[serde(default)]
    pub changes: Vec<SettingChange>,
}

/// A setting with different values in two models; `None` where a model lacks the key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SettingChange {
    pub key: String,
    pub before: Option<String>,
    pub after: Option<String>,
}

impl SettingChange {
    /// Returns `true` for title, method, and bounds of a design variable: a run can continue with other values of these.
    pub fn may_be_edited(&self) -> bool {
        let is_bound = |key: &str| matches!(key.rsplit_once('.'), Some((_, "lower" | "upper")));
        self.key == "title"
            || self.key == "method"
            || self.key.starts_with("method.")
            || self.key.strip_prefix("design.").is_some_and(is_bound)
    }
}

impl std::fmt::Display for SettingChange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (&self.before, &self.after) {
            (Some(before), Some(after)) => write!(f, "{}: {before} → {after}", self.key),
            (None, Some(after)) => write!(f, "{}: new, {after}", self.key),
            (Some(before), None) => write!(f, "{}: removed, was {before}", self.key),
            (None, None) => write!(f, "{}", self.key),
        }
    }
}

impl RunRecord {
    /// A run of `model` (with `text` from `file`) that begins now.
    pub fn new(model: &Model, text: &str, file: &Path) -> anyhow::Result<Self> {
        Ok(Self {
            versions: Versions {
                version: VERSION,
                program: env!("CARGO_PKG_VERSION").to_owned(),
                state: STATE_FILE_VERSION,
            },
            title: model.title().to_owned(),
            begun: now()?,
            file: file.display().to_string(),
            input: format!("fnv1a64:{:016x}", fnv1a(text)),
            fingerprint: fingerprint(model),
            model: text.to_owned(),
            edits: vec![],
        })
    }

    /// Reads `run.json` of a folder.
    pub fn read(folder: &Directory) -> anyhow::Result<Self> {
        let (shown, name) = (folder.path().display(), folder.path().join(RUN));
        let text = folder.read(RUN, RUN_LIMIT).with_context(|| format!("cannot read {}", name.display()))?;
        let Some(text) = text else {
            let lost = OutputFolder::of(folder.clone())?.lost_results()?;
            if folder.entry(STUDY).is_ok_and(|entry| entry.is_some()) {
                bail!(
                    "{shown} has a study in it, and a run is needed; its results are in {shown}/summary.json and {shown}/report.html"
                );
            }
            bail!(lost.unwrap_or_else(|| format!("{shown} has no run in it")));
        };
        let run: Self = serde_json::from_slice(&text).with_context(|| format!("{} is not readable", name.display()))?;
        if run.versions.version != VERSION {
            let got = run.versions.version;
            bail!("{} has version {got}, this program reads version {VERSION}", name.display());
        }
        Ok(run)
    }
}

/// Fingerprint of a model's problem in hexadecimal.
pub fn fingerprint(model: &Model) -> String {
    format!("{:016x}", model.fingerprint())
}

/// Settings with different values in two models.
pub fn changes(before: &str, after: &str) -> anyhow::Result<Vec<SettingChange>> {
    let [old, new] = [settings("the model before", before)?, settings("the model after", after)?];
    let keys: std::collections::BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let different = keys.into_iter().filter(|key| old.get(*key) != new.get(*key));
    let change =
        |key: &String| SettingChange { key: key.clone(), before: old.get(key).cloned(), after: new.get(key).cloned() };
    Ok(different.map(change).collect())
}

/// The last cycle of a state as a line of `--json`: that of `history.jsonl` with the objective as stated.
pub fn shown_cycle(problem: &Problem, state: &RunState, k: usize) -> anyhow::Result<String> {
    let mut line: serde_json::Value = serde_json::from_str(&cycle_line(&state.history[k])?)?;
    if state.history[k].failure.is_some() {
        for name in ["objective", "objective_error_pct", "constraint_error_pct", "violation_pct"] {
            line[name] = serde_json::Value::Null;
        }
    } else {
        line["objective"] = outcome::objective_of_step(problem, state, k)?.into();
    }
    if let Some(predicted) = outcome::predicted_objective(problem, &state.history[k]) {
        line["prediction"]["objective"] = predicted.into();
    }
    Ok(line.to_string())
}

/// The line of a cycle in `history.jsonl`, with the numbers of the driver.
pub(super) fn cycle_line(cycle: &Cycle) -> anyhow::Result<String> {
    #[derive(Serialize)]
    struct CycleLine<'s> {
        event: &'static str,
        #[serde(flatten)]
        cycle: &'s Cycle,
    }
    Ok(serde_json::to_string(&CycleLine { event: "cycle", cycle })?)
}

/// `summary.json`: progress of a run while its status is `Running`, then its result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    event: String,
    /// Version of this file.
    pub version: u32,
    program: String,
    pub title: String,
    fingerprint: String,
    pub status: Status,
    pub reason: String,
    /// Accepted cycles.
    pub cycles: usize,
    /// Trial steps, rejected ones included.
    #[serde(default)]
    pub tries: usize,
    pub analyses: usize,
    pub sensitivity_analyses: usize,
    /// Method of the sensitivity analysis, if the analysis offers several.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    differentiation: Option<String>,
    pub subproblem_iterations: usize,
    pub objective: NamedValue,
    /// Name of the design variable that bounds a peak and is minimized, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    peak_bound: Option<String>,
    /// Largest violation of the constraints; `None` without constraints.
    #[serde(default)]
    violation_pct: Option<f64>,
    pub design: Vec<NamedValue>,
    /// Design variables at a bound, in words.
    #[serde(default)]
    at_bounds: Vec<String>,
    pub constraints: Vec<Nearest>,
    /// The trial step with the best design, if that is better than the last one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    best: Option<BestStep>,
    /// Warnings of the analysis of this design; at the end of a run also those that take further analyses.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub warnings: Vec<String>,
    /// Edits of the model during the run.
    pub edits: Vec<ModelEdit>,
}

/// The best design of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
struct BestStep {
    /// Number of its cycle.
    cycle: usize,
    accepted: bool,
    objective: f64,
    violation_pct: f64,
    design: Vec<f64>,
}

/// A number with its name and unit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NamedValue {
    pub name: String,
    pub unit: String,
    pub value: f64,
}

/// A constraint at the time of its largest violation or smallest margin, as stated.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Nearest {
    pub name: String,
    #[serde(default)]
    pub unit: String,
    /// `≤`, `≥` or `=`; empty in summaries of early versions, whose values are normalized.
    #[serde(default)]
    pub relation: String,
    #[serde(default)]
    pub limit: f64,
    pub value: f64,
    /// Distance from the limit: positive inside the feasible region.
    #[serde(default)]
    pub margin: f64,
    /// `violated`, `active` or `satisfied`.
    #[serde(default)]
    pub status: String,
    pub time: Option<f64>,
    #[serde(default)]
    pub time_unit: String,
    /// Margin below which it is a rounding error, which texts of a few digits do not show.
    #[serde(skip)]
    rounding: f64,
}

/// Digits of a text in which rounding errors of a margin would show as differences of value and limit, too.
const MANY_DIGITS: usize = 11;

impl Nearest {
    /// A constraint of a problem.
    pub fn new(problem: &Problem, c: ConstraintValue) -> Self {
        let (relation, status) = (c.relation().to_owned(), c.status().to_owned());
        let grid = problem.constraints[c.row.constraint].quantity.grid().filter(|_| c.time.is_some());
        let time_unit = grid.map(|grid| problem.grids[grid].unit.clone()).unwrap_or_default();
        let rounding = 1e-6 * c.tolerance;
        let ConstraintValue { name, unit, limit, value, margin, time, .. } = c;
        Self { name, unit, relation, limit, value, margin, status, time, time_unit, rounding }
    }
}

impl Summary {
    /// The summary of a state.
    pub fn new(model: &Model, problem: &Problem, state: &RunState, edits: &[ModelEdit]) -> Self {
        let named =
            |(v, b): (&DesignVariable, &f64)| NamedValue { name: v.name.clone(), unit: v.unit.clone(), value: *b };
        let objective = NamedValue {
            name: problem.objective.name.clone(),
            unit: problem.objective.unit.clone(),
            value: outcome::objective(problem, &state.design, &state.evaluation),
        };
        let constraints = outcome::constraints(problem, &state.design, &state.evaluation);
        let best = outcome::better_than_last(problem, state).map(|(cycle, objective)| BestStep {
            cycle: cycle.cycle,
            accepted: cycle.accepted,
            objective,
            violation_pct: cycle.violation_pct,
            design: cycle.design.clone(),
        });
        let is_peak = |k: usize| problem.objective.peak().is_some_and(|peak| peak.variable == k);
        let at_bounds = state.design.iter().enumerate().filter_map(|(k, &value)| {
            // The variable that bounds a peak is not chosen by the user.
            let bound = outcome::at_bound(problem, k, value).filter(|_| !is_peak(k))?;
            Some(format!("{} is {bound}", problem.variables[k].name))
        });
        Self {
            event: "end".to_owned(),
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            title: model.title().to_owned(),
            fingerprint: fingerprint(model),
            status: state.status,
            reason: state.reason.clone(),
            cycles: state.cycles(),
            tries: state.history.len().saturating_sub(1),
            analyses: state.counters.analyses,
            sensitivity_analyses: state.counters.sensitivity_analyses,
            differentiation: model.method().differentiation(problem, state).map(str::to_owned),
            subproblem_iterations: state.counters.subproblem_iterations,
            objective,
            peak_bound: problem.objective.peak().map(|peak| problem.variables[peak.variable].name.clone()),
            violation_pct: (!problem.constraints.is_empty()).then(|| state.evaluation.max_violation_pct()),
            design: problem.variables.iter().zip(&state.design).map(named).collect(),
            at_bounds: at_bounds.collect(),
            constraints: constraints.into_iter().map(|c| Nearest::new(problem, c)).collect(),
            best,
            warnings: state.responses.warnings.clone(),
            edits: edits.to_vec(),
        }
    }

    /// Largest violation of the constraints in percent; `None` without constraints, for which earlier versions wrote a number.
    pub fn violation_pct(&self) -> Option<f64> {
        self.violation_pct.filter(|_| !self.constraints.is_empty() || self.peak_bound.is_some())
    }

    /// Reads `summary.json` of a folder; `None` before the first analysis.
    pub fn read(folder: &Directory) -> anyhow::Result<Option<Self>> {
        let path = folder.path().join(SUMMARY);
        let text = folder.read(SUMMARY, SUMMARY_LIMIT).with_context(|| format!("cannot read {}", path.display()))?;
        let summary = text.map(|text| serde_json::from_slice(&text)).transpose();
        summary.with_context(|| format!("{} is not readable", path.display()))
    }

    /// The summary as text for the terminal, with numbers of the given significant digits.
    pub fn text(&self, digits: usize) -> String {
        let mut lines = vec![format!("\n{:?}: {}.", self.status, self.reason)];
        let method = self.differentiation.as_ref().map_or_else(String::new, |name| format!(" ({name})"));
        lines.push(format!(
            "{}, {}, {}{method}.",
            counted(self.cycles, ["cycle", "cycles"]),
            counted(self.analyses, ["analysis", "analyses"]),
            counted(self.sensitivity_analyses, ["sensitivity analysis", "sensitivity analyses"])
        ));
        let row = |n: &NamedValue| one_line(&format!("  {:<24} {}", n.name, with_unit(n.value, &n.unit, digits)));
        lines.push(row(&self.objective));
        // The variable that bounds a peak is the objective itself.
        lines.extend(self.design.iter().filter(|b| self.peak_bound.as_ref() != Some(&b.name)).map(row));
        lines.extend(self.constraints.iter().map(|c| c.text(digits)));
        lines.extend(self.best.as_ref().map(|best| self.best_in_words(best, digits)));
        lines
            .extend(self.at_bounds.iter().map(|text| format!("Note: {text}; a wider bound may give a better design.")));
        lines.extend(self.warnings.iter().map(|text| format!("Warning: {text}")));
        lines.join("\n")
    }
}

impl Summary {
    /// The best design, with the arguments that continue from it.
    fn best_in_words(&self, best: &BestStep, digits: usize) -> String {
        let what = if best.accepted { "cycle" } else { "a rejected step of cycle" };
        let start = self
            .design
            .iter()
            .zip(&best.design)
            .filter(|(named, _)| Some(&named.name) != self.peak_bound.as_ref())
            .map(|(named, b)| format!(" --start {}", argument(&format!("{}={b}", named.name))));
        one_line(&format!(
            "Note: the best design is that of {what} {}: {} {}{}. Start there with{}",
            best.cycle,
            self.objective.name,
            with_unit(best.objective, &self.objective.unit, digits),
            match self.violation_pct() {
                Some(_) => format!(", largest violation {} %", readable(best.violation_pct.max(0.0), digits)),
                None => String::new(),
            },
            start.collect::<String>()
        ))
    }
}

impl Nearest {
    /// The constraint as a line for the terminal: value, limit, unit, margin and status.
    pub fn text(&self, digits: usize) -> String {
        let Self { name, unit, relation, limit, value, margin, status, time, time_unit, rounding } = self;
        let margin = if margin.abs() < *rounding && digits < MANY_DIGITS { &0.0 } else { margin };
        let at = time.map_or_else(String::new, |t| format!(" at {}", with_unit(t, time_unit, digits)));
        let [value, limit, margin] = [*value, *limit, *margin].map(|v| readable(v, digits));
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        one_line(&format!("  {name:<24} {value} {relation} {limit}{unit}{at}, {status}, margin {margin}{unit}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lines of the summary of a run that minimizes `weight`, with the design variables `weight` and `angle`.
    fn lines(peak_bound: &str) -> Vec<String> {
        let text = format!(
            r#"{{ "event": "end", "version": 1, "program": "0.1.0", "title": "arm", "fingerprint": "0", "status": "Converged",
            "reason": "done", "cycles": 1, "tries": 1, "analyses": 2, "sensitivity_analyses": 1, "subproblem_iterations": 3,
            "objective": {{ "name": "weight", "unit": "kg", "value": 2.0 }}, {peak_bound} "violation_pct": -1.0,
            "design": [{{ "name": "weight", "unit": "kg", "value": 2.0 }}, {{ "name": "angle", "unit": "rad", "value": 0.5 }}],
            "constraints": [], "edits": [] }}"#
        );
        let summary: Summary = serde_json::from_str(&text).unwrap();
        summary.text(5).lines().map(|line| line.split_whitespace().next().unwrap_or_default().to_owned()).collect()
    }

    #[test]
    fn only_the_variable_that_bounds_a_peak_is_left_out_of_the_design() {
        let shown = |peak_bound: &str| lines(peak_bound).into_iter().filter(|name| name == "weight").count();
        assert_eq!(shown(r#""peak_bound": "weight","#), 1);
        // A variable that is minimized itself is a part of the design, too.
        assert_eq!(shown(""), 2);
        assert!(lines("").contains(&"angle".to_owned()));
    }
}
