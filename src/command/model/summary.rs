//! `summary.json`: how far a run has come, and its result.

use super::folder::{Edit, VERSION};
use super::tables;
use anyhow::Context;
use linkwright::model_file::Model;
use linkwright::problem::{DesignVariable, Problem, RowId};
use linkwright::sao::{State, Status};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The result of a run, as it is written; while the status is `Running`, how far it has come.
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
    /// Cycles, rejected tries included.
    #[serde(default)]
    pub tries: usize,
    pub analyses: usize,
    pub sensitivity_analyses: usize,
    /// By which method the last of them would be taken, where there is a choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    differentiation: Option<String>,
    pub subproblem_iterations: usize,
    pub objective: Named,
    pub violation_pct: f64,
    pub design: Vec<Named>,
    pub constraints: Vec<Nearest>,
    /// When the model was edited during the run.
    pub edits: Vec<Edit>,
}

/// A number with its name and unit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Named {
    pub name: String,
    pub unit: String,
    pub value: f64,
}

/// A constraint where it is nearest to or farthest beyond its limit.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Nearest {
    pub name: String,
    /// Normalised value; feasible means at most one.
    pub value: f64,
    pub time: Option<f64>,
}

impl Summary {
    pub fn of(model: &Model, problem: &Problem, state: &State, edits: &[Edit]) -> Self {
        let named = |(v, b): (&DesignVariable, &f64)| Named { name: v.name.clone(), unit: v.unit.clone(), value: *b };
        let objective = Named {
            name: problem.objective.name.clone(),
            unit: problem.objective.unit.clone(),
            value: state.evaluation.objective,
        };
        let worst = tables::worst(problem, &state.evaluation).into_iter();
        Self {
            event: "end".to_owned(),
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            title: model.title().to_owned(),
            fingerprint: format!("{:016x}", model.fingerprint()),
            status: state.status,
            reason: state.reason.clone(),
            cycles: state.cycles(),
            tries: state.history.len() - 1,
            analyses: state.counters.analyses,
            sensitivity_analyses: state.counters.sensitivity_analyses,
            differentiation: model.method().differentiation(problem, state).map(str::to_owned),
            subproblem_iterations: state.counters.subproblem_iterations,
            objective,
            violation_pct: state.evaluation.max_violation_pct(),
            design: problem.variables.iter().zip(&state.design).map(named).collect(),
            constraints: worst.map(|row| nearest(problem, state, row)).collect(),
            edits: edits.to_vec(),
        }
    }

    /// Reads `summary.json` of a folder; none before the first analysis.
    pub fn read(folder: &Path) -> anyhow::Result<Option<Self>> {
        let path = folder.join("summary.json");
        let text = match std::fs::read_to_string(&path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(e).with_context(|| format!("cannot read {}", path.display())),
        };
        serde_json::from_str(&text).map(Some).with_context(|| format!("{} is not readable", path.display()))
    }

    /// The summary for a reader.
    pub fn text(&self) -> String {
        let mut lines = vec![format!("\n{:?}: {}.", self.status, self.reason)];
        let method = self.differentiation.as_ref().map_or_else(String::new, |name| format!(" ({name})"));
        lines.push(format!(
            "{} cycles, {} analyses, {} sensitivity analyses{method}.",
            self.cycles, self.analyses, self.sensitivity_analyses
        ));
        let row = |n: &Named| format!("  {:<24} {:>16.9e} {}", n.name, n.value, n.unit).trim_end().to_owned();
        lines.push(row(&self.objective));
        // The bound of a peak is the objective itself.
        lines.extend(self.design.iter().filter(|b| b.name != self.objective.name).map(row));
        lines.push(format!("  {:<24} {:>16.3e} %", "largest violation", self.violation_pct));
        lines.join("\n")
    }
}

fn nearest(problem: &Problem, state: &State, row: RowId) -> Nearest {
    let constraint = &problem.constraints[row.constraint];
    let grid = constraint.quantity.grid().filter(|_| constraint.quantity.is_transient());
    Nearest {
        name: constraint.name.clone(),
        value: state.evaluation.constraints[row.constraint][row.point],
        time: grid.map(|g| problem.grids[g].points[row.point]),
    }
}
