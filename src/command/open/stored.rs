//! Runs and studies of the model of a session, stored ones above all, as pages show them.

use super::super::output::results;
use super::super::run_directory::{RunDirectory, SettingChange, changes};
use super::super::run_entry::{self, RunEntry};
use super::super::runs::RunComparison;
use super::super::study::stored_study;
use anyhow::{Context, ensure};
use linkwright::problem::Problem;
use linkwright::report::outcome;
use linkwright::sao::{Cycle, RunState};
use linkwright::storage::Directory;
use serde_json::{Value, json};

/// Largest number of runs, and of studies, that a page lists.
const LISTED: usize = 50;
/// Largest number of rows of a study that a page shows.
const ROWS: usize = 20_000;

/// The runs and studies of a model with the text `text`, the newest first, with the limits in which they differ from it. Reads many files.
pub fn list(text: &str, fingerprint: &str) -> Value {
    let found = run_entry::below(&[results()]).into_iter().rev();
    let (all, others): (Vec<_>, Vec<_>) = found
        .map(|entry| {
            let limits = changed_limits(text, &entry.text);
            (entry, limits)
        })
        .partition(|(_, limits)| limits.is_some());
    let of = |kind: &'static str| all.iter().filter(move |(entry, _)| entry.kind == kind).take(LISTED);
    let run = |(entry, limits): &(RunEntry, Option<Vec<String>>)| {
        let result = entry.result.as_ref();
        json!({
            "limits": limits,
            "folder": entry.folder, "begun": entry.begun, "method": entry.method, "status": entry.status, "fault": entry.fault,
            "is_same": entry.fingerprint == fingerprint, "note": entry.note,
            "analyses": result.map(|r| r.analyses), "objective": result.map(|r| r.objective.value),
        })
    };
    let study = |(entry, limits): &(RunEntry, Option<Vec<String>>)| {
        let progress = entry.study.as_ref();
        json!({
            "limits": limits,
            "folder": entry.folder, "begun": entry.begun, "kind": entry.method, "status": entry.status, "fault": entry.fault,
            "runs": progress.map(|p| p.runs), "done": progress.map(|p| p.done), "failed": progress.map(|p| p.failed),
        })
    };
    json!({
        "stored": of("run").map(run).collect::<Vec<_>>(), "studies": of("study").map(study).collect::<Vec<_>>(),
        "others": others.len(),
    })
}

/// The folder of a run or study below the folder of results. Other folders are unknown here.
pub fn known(name: &str) -> anyhow::Result<RunEntry> {
    let found = run_entry::below(&[results()]).into_iter().find(|entry| entry.folder == name);
    found.with_context(|| format!("there is no run {name} in {}", results().display()))
}

/// The cycles and the last design of a stored run.
pub fn run(name: &str) -> anyhow::Result<Value> {
    let RunEntry { folder, path, .. } = known(name)?;
    let (directory, model, _) = RunDirectory::open(&path)?;
    let problem = model.problem()?;
    let state = directory.last(&model, &problem)?.with_context(|| format!("{folder} has no cycle yet"))?.state;
    let steps = cycles(&problem, &state);
    let design = steps.iter().rev().find(|step| step["accepted"] == true).map(|step| step["design"].clone());
    Ok(json!({ "folder": folder, "cycles": steps, "design": design }))
}

/// Settings and results in which two stored runs differ.
pub fn differences(a: &str, b: &str) -> anyhow::Result<Value> {
    let [a, b] = [known(a)?, known(b)?];
    ensure!(a.kind == "run" && b.kind == "run", "two runs can be compared, studies cannot");
    Ok(serde_json::to_value(RunComparison::new(&a.path, &b.path)?)?)
}

/// Stores the user's note about a run.
pub fn write_note(name: &str, text: &str) -> anyhow::Result<()> {
    let entry = known(name)?;
    ensure!(entry.kind == "run", "notes are about runs");
    RunDirectory::write_note(&Directory::open(&entry.path)?, text)
}

/// The rows of a study by phases, with the columns that give the design of each row, by variable; a variable without a column has
/// its start value. The study changes the `others`, which are no variables: a design alone does not have the results of its row.
pub fn study(name: &str, variables: &[String]) -> anyhow::Result<Value> {
    let entry = known(name)?;
    ensure!(entry.kind == "study", "{name} has a run in it, and no study");
    let (study, rows) = stored_study(&Directory::open(&entry.path)?)?;
    let model = study.source().model()?;
    let start_of = |name: &String| model.variables().iter().find(|v| v.name == *name).map(|v| v.start);
    let start: Vec<Option<f64>> = variables.iter().map(start_of).collect();
    let phases = study.phases().iter().enumerate().map(|(number, phase)| {
        let columns = phase.columns.iter().map(|c| json!({ "name": c.name, "unit": c.unit, "words": c.words }));
        let column_of = |name: &String| phase.columns.iter().position(|column| column.name == *name);
        let rows = rows.of(number).take(ROWS).map(|row| {
            json!({ "run": row.run, "values": row.values, "status": row.status, "failure": row.failure })
        });
        json!({
            "name": phase.name, "columns": columns.collect::<Vec<_>>(), "rows": rows.collect::<Vec<_>>(), "runs": phase.runs,
            "design": variables.iter().map(column_of).collect::<Vec<_>>(),
        })
    });
    let phases: Vec<Value> = phases.collect();
    let others: Vec<&str> = study.changed().filter(|name| !variables.iter().any(|variable| variable == name)).collect();
    Ok(json!({
        "folder": entry.folder, "title": study.title(), "start": start, "phases": phases, "others": others,
    }))
}

/// True for the key of a constraint, or of a table of a limit that was drawn in a page.
pub fn is_of_limit(key: &str) -> bool {
    key.starts_with("constraint.") || key.starts_with("table.drawn_")
}

/// The limits, in words, in which `after` differs from `before`; `None` if it states another problem in other respects, too. Start values,
/// bounds, title and method may differ.
fn changed_limits(before: &str, after: &str) -> Option<Vec<String>> {
    let all = changes(before, after).ok()?;
    let changed: Vec<SettingChange> = all.into_iter().filter(|change| !is_free(change)).collect();
    if !changed.iter().all(|change| is_of_limit(&change.key)) {
        return None;
    }
    let table = |change: &SettingChange| change.key.rsplit_once('.').map_or("", |(table, _)| table).to_owned();
    let in_words = |group: &[SettingChange]| -> Vec<String> {
        let name = &table(&group[0]);
        let keys = |value: fn(&SettingChange) -> &Option<String>| {
            let known = group.iter().filter_map(|c| Some((c.key.get(name.len() + 1..)?, value(c).as_ref()?)));
            known
                .filter(|(key, _)| *key != "name")
                .map(|(key, value)| format!("{key} = {value}"))
                .collect::<Vec<_>>()
                .join(", ")
        };
        // Each of these tables has one of these keys.
        let has = |value: fn(&SettingChange) -> &Option<String>| {
            let of = |key: &str| key == format!("{name}.value") || key == format!("{name}.x");
            group.iter().any(|c| of(&c.key) && value(c).is_some())
        };
        match (has(|c| &c.before), has(|c| &c.after)) {
            (false, true) => vec![format!("with {name}: {}", keys(|c| &c.after))],
            (true, false) => vec![format!("without {name}: {}", keys(|c| &c.before))],
            _ => group.iter().map(ToString::to_string).collect(),
        }
    };
    Some(changed.chunk_by(|a, b| table(a) == table(b)).flat_map(in_words).collect())
}

/// The settings, in words, with which `after` states another problem than `before`. Start values, bounds, title and method do not.
pub fn other_settings(before: &str, after: &str) -> Vec<String> {
    let all = changes(before, after).unwrap_or_default().into_iter();
    all.filter(|change| !is_free(change)).map(|change| change.to_string()).collect()
}

/// True for settings in which two runs of one problem can differ.
fn is_free(change: &SettingChange) -> bool {
    change.may_be_edited() || (change.key.starts_with("design.") && change.key.ends_with(".start"))
}

/// The values of the variables that the model states: all but the bound of a peak.
pub fn own(problem: &Problem, values: &[f64]) -> Vec<f64> {
    let bound = problem.objective.peak().map(|peak| peak.variable);
    values.iter().enumerate().filter(|(k, _)| Some(*k) != bound).map(|(_, v)| *v).collect()
}

/// The trial steps of a run as pages show them.
pub fn cycles(problem: &Problem, state: &RunState) -> Vec<Value> {
    let one = |(k, cycle): (usize, &Cycle)| {
        json!({
            "cycle": cycle.cycle, "accepted": cycle.accepted, "design": own(problem, &cycle.design),
            "objective": outcome::objective_of_step(problem, state, k).ok(),
            "predicted": outcome::predicted_objective(problem, cycle),
            "violation": outcome::violation(problem, cycle),
            "objective_error": cycle.objective_error_pct, "constraint_error": cycle.constraint_error_pct,
            "retained": cycle.retained.len(), "active": cycle.active.len(), "failure": cycle.failure,
        })
    };
    state.history.iter().enumerate().map(one).collect()
}
