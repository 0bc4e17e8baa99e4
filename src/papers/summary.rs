//! Summary of the runs of a reproduced paper as JSON.

use super::paper::{Paper, ReproducedRun, ReproducedTable};
use crate::problem::DesignVariable;
use crate::report::table::TableComparison;
use crate::sao::{ActiveRow, Counters, Status};
use error::Result;
use serde::Serialize;

/// Name and version of the schema of [`ReproductionSummary`].
pub const SCHEMA: &str = "linkwright/reproduction/1";

/// Content of `summary.json`.
#[derive(Serialize)]
pub struct ReproductionSummary {
    /// [`SCHEMA`].
    pub schema: &'static str,
    /// Reference of the paper.
    pub paper: &'static str,
    /// Version of this program.
    pub version: &'static str,
    /// One entry for each run, in the order of the tables.
    pub runs: Vec<RunSummary>,
}

/// Summary of one run.
#[derive(Serialize)]
pub struct RunSummary {
    /// Table that it regenerates.
    pub table: &'static str,
    /// Name among the runs of the table; absent for the only one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub run: Option<&'static str>,
    /// Problem.
    pub problem: String,
    /// Status of the run.
    pub status: Status,
    /// The reason in words.
    pub reason: String,
    /// Accepted cycles.
    pub cycles: usize,
    /// Rejected trial steps.
    pub rejected: usize,
    /// Analyses, sensitivity analyses and subproblem iterations.
    pub counters: Counters,
    /// Final objective.
    pub objective: f64,
    /// Largest violation at the final design, percent.
    pub violation_pct: f64,
    /// Final design.
    pub design: Vec<VariableValue>,
    /// Active constraints at the final design, by name and time, with their multipliers.
    pub active: Vec<ActiveConstraint>,
    /// Number of printed values of the table that have a computed counterpart.
    pub compared: usize,
    /// Number of these whose printed digits differ.
    pub differing: usize,
    /// Remarks on the table.
    pub notes: Vec<&'static str>,
}

/// Value of a design variable.
#[derive(Serialize)]
pub struct VariableValue {
    /// Name.
    pub name: String,
    /// Unit.
    pub unit: String,
    /// Value.
    pub value: f64,
}

/// An active constraint at the final design.
#[derive(Serialize)]
pub struct ActiveConstraint {
    /// Constraint and time in words.
    pub constraint: String,
    /// Multiplier λ in the Lagrangian F + Σ λ (ĝ − 1), in the unit of the objective; non-negative for inequalities.
    pub multiplier: f64,
}

impl ReproductionSummary {
    /// Summarizes the runs behind some tables of a paper.
    ///
    /// # Errors
    /// As [`ReproducedTable::comparison`].
    pub fn new(paper: &dyn Paper, tables: &[ReproducedTable]) -> Result<Self> {
        let mut runs = vec![];
        for table in tables {
            let comparison = table.comparison()?;
            runs.extend(table.runs.iter().map(|run| RunSummary::new(table, &comparison, run)));
        }
        Ok(Self { schema: SCHEMA, paper: paper.reference(), version: env!("CARGO_PKG_VERSION"), runs })
    }

    /// Writes the summary as JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a summary holds finite numbers and strings only") + "\n"
    }
}

impl RunSummary {
    fn new(table: &ReproducedTable, comparison: &TableComparison, run: &ReproducedRun) -> Self {
        let ReproducedRun { label, problem, state } = run;
        let variable =
            |(v, &value): (&DesignVariable, &f64)| VariableValue { name: v.name.clone(), unit: v.unit.clone(), value };
        let active =
            |a: &ActiveRow| ActiveConstraint { constraint: problem.row_in_words(a.row), multiplier: a.multiplier };
        Self {
            table: table.name,
            run: *label,
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
        }
    }
}
