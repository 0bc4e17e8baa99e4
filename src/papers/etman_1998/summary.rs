//! The machine-readable account of a reproduction.

use super::{Regenerated, ReproducedRun};
use crate::problem::DesignVariable;
use crate::sao::{ActiveRow, Counters, Status};
use error::Result;
use serde::Serialize;

/// Name and version of the schema of [`Summary`].
pub const SCHEMA: &str = "linkwright/reproduction/1";

/// What `summary.json` holds.
#[derive(Serialize)]
pub struct Summary {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// The paper.
    pub paper: &'static str,
    /// Version of this program.
    pub version: &'static str,
    /// One entry for each run, in the order of the tables.
    pub runs: Vec<Entry>,
}

/// One run.
#[derive(Serialize)]
pub struct Entry {
    /// Table that it regenerates.
    pub table: String,
    /// Problem.
    pub problem: String,
    /// Status of the run.
    pub status: Status,
    /// The reason in words.
    pub reason: String,
    /// Accepted cycles.
    pub cycles: usize,
    /// Rejected tries.
    pub rejected: usize,
    /// Work done.
    pub counters: Counters,
    /// Final objective.
    pub objective: f64,
    /// Largest violation at the final design, percent.
    pub violation_pct: f64,
    /// Final design.
    pub design: Vec<Variable>,
    /// Constraints that hold the final design, by name and time, with their multipliers.
    pub active: Vec<Active>,
    /// Printed values that have a counterpart of ours.
    pub compared: usize,
    /// Those of them whose printed digits differ.
    pub differing: usize,
    /// Remarks on the table.
    pub notes: Vec<&'static str>,
}

/// A design variable of the final design.
#[derive(Serialize)]
pub struct Variable {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value.
    pub value: f64,
}

/// A constraint that holds the final design.
#[derive(Serialize)]
pub struct Active {
    /// Constraint and time in words.
    pub constraint: String,
    /// ∂F/∂ĝ.
    pub multiplier: f64,
}

impl Summary {
    /// The summary of the runs behind some tables.
    pub fn of(tables: &[Regenerated]) -> Result<Self> {
        let paper =
            "Etman, van Campen & Schoofs, Multibody System Dynamics 2 (1998) 393-415, doi:10.1023/A:1009780119839";
        let entries = tables.iter().filter_map(|t| Entry::of(t).transpose());
        Ok(Self { schema: SCHEMA, paper, version: env!("CARGO_PKG_VERSION"), runs: entries.collect::<Result<_>>()? })
    }

    /// As JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a summary holds finite numbers and strings only") + "\n"
    }
}

impl Entry {
    /// The entry of a table; none for a table of data.
    fn of(table: &Regenerated) -> Result<Option<Self>> {
        let Some(ReproducedRun { problem, state }) = &table.run else { return Ok(None) };
        let comparison = table.comparison()?;
        let variable =
            |(v, &value): (&DesignVariable, &f64)| Variable { name: v.name.clone(), unit: v.unit.clone(), value };
        let active = |a: &ActiveRow| Active { constraint: problem.row_in_words(a.row), multiplier: a.multiplier };
        Ok(Some(Self {
            table: table.name.to_owned(),
            problem: problem.name.clone(),
            status: state.status,
            reason: state.reason.clone(),
            cycles: state.cycles(),
            rejected: state.history.iter().filter(|c| !c.accepted).count(),
            counters: state.counters,
            objective: state.evaluation.objective,
            violation_pct: state.evaluation.max_violation_pct(),
            design: problem.variables.iter().zip(&state.design).map(variable).collect(),
            active: state.history.last().map_or(vec![], |c| c.active.iter().map(active).collect()),
            compared: comparison.compared,
            differing: comparison.differing,
            notes: table.notes.clone(),
        }))
    }
}
