//! Two runs beside each other.

use super::record::Record;
use crate::command::model::{Change, Named, Summary, changes};
use linkwright::report::table::{Cell, Table};
use serde::Serialize;
use std::path::Path;

/// What two runs have in common, and in what they differ.
#[derive(Serialize)]
pub struct Comparison {
    version: u32,
    /// Whether both solve one problem: their models differ in bounds, method and title at most.
    one_problem: bool,
    /// Settings in which their models differ.
    settings: Vec<Change>,
    /// Objective, violation, work, and design variables by name.
    quantities: Vec<Quantity>,
    runs: [Record; 2],
}

/// A number of both runs.
#[derive(Serialize)]
struct Quantity {
    name: String,
    unit: String,
    /// Of the first and of the second run; none where a run has no such number.
    values: [Option<f64>; 2],
}

impl Comparison {
    /// Compares the runs in two folders.
    ///
    /// **Errors.** A folder without a run that can be read.
    pub fn of(a: &Path, b: &Path) -> anyhow::Result<Self> {
        let runs = [Record::read(a)?, Record::read(b)?];
        let results = [&runs[0], &runs[1]].map(|run| run.result.as_ref());
        Ok(Self {
            version: 1,
            one_problem: runs[0].fingerprint == runs[1].fingerprint,
            settings: changes(&runs[0].text, &runs[1].text)?,
            quantities: quantities(results),
            runs,
        })
    }

    /// The comparison for a reader.
    pub fn text(&self) -> anyhow::Result<String> {
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
        Ok(text + self.quantities_table()?.text().trim_end())
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

/// Objective, violation, work, design variables, constraints: those of the first run, then those that only the second one has.
fn quantities(results: [Option<&Summary>; 2]) -> Vec<Quantity> {
    let of = |name: &str, unit: &str, value: fn(&Summary) -> f64| Quantity {
        name: name.to_owned(),
        unit: unit.to_owned(),
        values: results.map(|r| r.map(value)),
    };
    let mut all = vec![
        of("cycles", "", |r| r.cycles as f64),
        of("analyses", "", |r| r.analyses as f64),
        of("sensitivity analyses", "", |r| r.sensitivity_analyses as f64),
        of("subproblem iterations", "", |r| r.subproblem_iterations as f64),
        of("objective", "", |r| r.objective.value),
        of("largest violation", "%", |r| r.violation_pct),
    ];
    let designs = results.map(|r| r.map_or(vec![], |r| r.design.clone()));
    all.extend(beside(&designs));
    let constraint = |r: &Summary| -> Vec<Named> {
        let named = |c: &crate::command::model::Nearest| Named {
            name: format!("constraint {}", c.name),
            unit: "of its limit".to_owned(),
            value: c.value,
        };
        r.constraints.iter().map(named).collect()
    };
    all.extend(beside(&results.map(|r| r.map_or(vec![], constraint))));
    all
}

fn beside([a, b]: &[Vec<Named>; 2]) -> Vec<Quantity> {
    let only_b = b.iter().filter(|n| !a.iter().any(|m| m.name == n.name));
    let find = |among: &[Named], name: &str| among.iter().find(|n| n.name == name).map(|n| n.value);
    let quantity = |n: &Named| Quantity {
        name: n.name.clone(),
        unit: n.unit.clone(),
        values: [find(a, &n.name), find(b, &n.name)],
    };
    a.iter().chain(only_b).map(quantity).collect()
}
