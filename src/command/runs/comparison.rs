//! Comparison of two runs.

use crate::command::run_directory::{NamedValue, Nearest, SettingChange, Summary, changes};
use crate::command::run_entry::RunEntry;
use anyhow::bail;
use linkwright::report::table::{Cell, Table};
use serde::Serialize;
use std::path::Path;

/// Settings and results of two runs.
#[derive(Serialize)]
pub struct RunComparison {
    version: u32,
    /// `true` if both solve the same problem: their models differ at most in starts, bounds, method and title.
    one_problem: bool,
    /// Settings in which the models differ.
    settings: Vec<SettingChange>,
    /// Work, objective, violation, design variables and constraints.
    quantities: Vec<ComparedNumber>,
    runs: [RunEntry; 2],
}

/// A number with its values in both runs.
#[derive(Serialize)]
struct ComparedNumber {
    name: String,
    unit: String,
    /// Values in the first and second run; `None` where a run lacks the number.
    values: [Option<f64>; 2],
}

impl RunComparison {
    /// Compares the runs in two folders. Fails if one of them has no readable run, or has a study.
    pub fn new(a: &Path, b: &Path) -> anyhow::Result<Self> {
        let runs = [RunEntry::read(a)?, RunEntry::read(b)?];
        if let Some(study) = runs.iter().find(|run| run.kind == "study") {
            bail!(
                "{} has a study in it, and two runs are compared; its results are in {0}/summary.json and {0}/report.html",
                study.folder
            );
        }
        let results = [&runs[0], &runs[1]].map(|run| run.result.as_ref());
        let settings = changes(&runs[0].text, &runs[1].text)?;
        // A start is where a run begins, and no part of the problem.
        let is_start = |key: &str| matches!(key.rsplit_once('.'), Some((_, "start")));
        let is_problem = |change: &SettingChange| {
            !change.may_be_edited() && !change.key.strip_prefix("design.").is_some_and(is_start)
        };
        Ok(Self {
            version: 1,
            one_problem: runs[0].fingerprint == runs[1].fingerprint || !settings.iter().any(is_problem),
            settings,
            quantities: quantities(results),
            runs,
        })
    }

    /// The comparison as text for the terminal.
    pub fn text(&self, digits: usize) -> anyhow::Result<String> {
        let [a, b] = &self.runs;
        let mut text =
            format!("A  {}, {}, {}\nB  {}, {}, {}\n", a.folder, a.begun, a.status, b.folder, b.begun, b.status);
        if !self.one_problem {
            text += "They solve different problems.\n";
        }
        text += "\n";
        if self.settings.is_empty() {
            text += "All settings are the same.\n\n";
        } else {
            text += &(self.settings_table()?.text() + "\n");
        }
        Ok(text + self.quantities_table()?.text_with(digits).trim_end())
    }

    /// Returns whether the runs solve one problem, up to start, bounds, method and title.
    pub fn is_of_one_problem(&self) -> bool {
        self.one_problem
    }

    /// The conclusions of both runs in words.
    pub fn statuses(&self) -> [&str; 2] {
        self.runs.each_ref().map(|run| run.status.as_str())
    }

    /// The settings that differ, if any, and the results.
    pub fn tables(&self) -> linkwright::Result<Vec<Table>> {
        let settings = if self.settings.is_empty() { None } else { Some(self.settings_table()?) };
        Ok(settings.into_iter().chain([self.quantities_table()?]).collect())
    }

    fn settings_table(&self) -> linkwright::Result<Table> {
        let mut table = Table::new("Settings that differ", ["setting", "A", "B"]);
        for change in &self.settings {
            let cell = |value: &Option<String>| Cell::from(value.as_deref().unwrap_or("–"));
            table.push([change.key.as_str().into(), cell(&change.before), cell(&change.after)])?;
        }
        Ok(table)
    }

    fn quantities_table(&self) -> linkwright::Result<Table> {
        let mut table = Table::new("Results", ["quantity", "unit", "A", "B", "B_minus_A"])
            .headed(["quantity", "unit", "A", "B", "B - A"])?;
        for quantity in &self.quantities {
            let cell = |value: Option<f64>| match value {
                Some(v) if v.fract() == 0.0 && v.abs() < 1e15 => Cell::Whole(v as i64),
                Some(v) => Cell::Number(v),
                None => Cell::Empty,
            };
            let [a, b] = quantity.values;
            let difference = a.zip(b).map(|(a, b)| b - a);
            table.push([
                quantity.name.as_str().into(),
                quantity.unit.as_str().into(),
                cell(a),
                cell(b),
                cell(difference),
            ])?;
        }
        Ok(table)
    }
}

/// Work, objective, violation, design variables and constraints: those of the first run, then those that only the second has.
fn quantities(results: [Option<&Summary>; 2]) -> Vec<ComparedNumber> {
    let of = |name: &str, unit: &str, value: fn(&Summary) -> Option<f64>| ComparedNumber {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: results.map(|r| r.and_then(value)),
    };
    let mut all = vec![
        of("cycles", "", |r| Some(r.cycles as f64)),
        of("analyses", "", |r| Some(r.analyses as f64)),
        of("sensitivity analyses", "", |r| Some(r.sensitivity_analyses as f64)),
        of("subproblem iterations", "", |r| Some(r.subproblem_iterations as f64)),
    ];
    let objective = |r: &Summary| vec![NamedValue { name: "objective".to_owned(), ..r.objective.clone() }];
    all.extend(paired(&results.map(|r| r.map_or(vec![], objective))));
    all.push(of("largest violation", "%", Summary::violation_pct));
    let designs = results.map(|r| r.map_or(vec![], |r| r.design.clone()));
    all.extend(paired(&designs));
    let constraint = |r: &Summary| -> Vec<NamedValue> {
        let named = |c: &Nearest| NamedValue {
            name: format!("constraint {} {}", c.name, c.relation).trim_end().to_owned(),
            unit: c.unit.clone(),
            value: c.value,
        };
        r.constraints.iter().map(named).collect()
    };
    all.extend(paired(&results.map(|r| r.map_or(vec![], constraint))));
    all
}

/// Values of one name in one unit are compared; those in different units have rows of their own.
fn paired([a, b]: &[Vec<NamedValue>; 2]) -> Vec<ComparedNumber> {
    let is_same = |one: &NamedValue, other: &NamedValue| one.name == other.name && one.unit == other.unit;
    let only_b = b.iter().filter(|n| !a.iter().any(|m| is_same(m, n)));
    let find = |among: &[NamedValue], wanted: &NamedValue| among.iter().find(|n| is_same(n, wanted)).map(|n| n.value);
    let quantity = |n: &NamedValue| ComparedNumber {
        name: n.name.clone(),
        unit: n.unit.clone(),
        values: [find(a, n), find(b, n)],
    };
    a.iter().chain(only_b).map(quantity).collect()
}
