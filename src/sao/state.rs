//! The state of a run: one record that can be written to a file.

use super::{Cycle, Status};
use crate::approximation::PreviousPoint;
use crate::problem::{Evaluation, Peak, Problem, Responses, RowId, Sensitivities};
use error::{Error, Result};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Version of the state file; a file of another version is refused.
pub const STATE_VERSION: u32 = 2;

/// Work done, counted as the paper counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Analyses, the first one included, failed ones too.
    pub analyses: usize,
    /// Sensitivity analyses: one for each cycle that needed any, none for a repeated try.
    pub sensitivity_analyses: usize,
    /// Iterations of the subproblem solver, all cycles together.
    pub subproblem_iterations: usize,
}

/// What a cycle knows besides its start: kept rows and sensitivities, reused when it is repeated.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CycleData {
    /// Kept constraints and time points.
    pub kept: Vec<RowId>,
    /// Sensitivities of the responses that they and the objective need.
    pub sensitivities: Sensitivities,
    /// Second derivatives at the same instants, if the approximation uses them.
    pub curvatures: Option<Vec<DMatrix<f64>>>,
    /// Kept local maxima of constraints in continuous time.
    pub peaks: Vec<Peak>,
}

impl CycleData {
    /// The largest violation of the kept rows, as a fraction, at least zero.
    pub(super) fn violation(&self, problem: &Problem, rows: &[f64]) -> f64 {
        let one = |(kept, &row): (&RowId, &f64)| {
            if problem.constraints[kept.constraint].is_equality { row.abs() } else { row }
        };
        self.kept.iter().zip(rows).map(one).fold(0.0, f64::max)
    }
}

/// What a globalization remembers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct GlobalizationState {
    /// Conservatism ρ of the objective, then of each constraint, in the unit of each; empty for none.
    pub conservatism: Vec<f64>,
    /// The filter: largest violation (as a fraction) and objective of designs that no other one dominates.
    pub filter: Vec<[f64; 2]>,
}

/// Everything that changes during a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct State {
    /// [`STATE_VERSION`] of the writer.
    pub version: u32,
    /// Name of the problem.
    pub problem: String,
    /// [`Problem::fingerprint`] of the problem.
    pub fingerprint: u64,
    /// The accepted design.
    pub design: Vec<f64>,
    /// Responses there.
    pub responses: Responses,
    /// Objective and constraints there.
    pub evaluation: Evaluation,
    /// Move-limit factors of the next try.
    pub factors: Vec<f64>,
    /// The last accepted step.
    pub last_step: Option<Vec<f64>>,
    /// What the globalization remembers.
    pub guard: GlobalizationState,
    /// Designs accepted before, the newest first; as many as the approximation uses.
    pub past: Vec<PreviousPoint>,
    /// Present after a rejected try.
    pub knowledge: Option<CycleData>,
    /// What happened so far, cycle 0 first.
    pub history: Vec<Cycle>,
    /// Work done.
    pub counters: Counters,
    /// Whether the run goes on.
    pub status: Status,
    /// Why not, in words.
    pub reason: String,
}

impl State {
    /// The state as JSON; every number reads back with the same bits.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a state holds finite numbers and strings only")
    }

    /// The state from JSON, for continuing a run of `problem`.
    ///
    /// Errors with [`Error::File`] if the text is not a state, of another version or of another problem.
    pub fn from_json(text: &str, problem: &Problem) -> Result<Self> {
        #[derive(Deserialize)]
        struct Version {
            version: u32,
        }
        let broken =
            |e: serde_json::Error| fault(format!("it is not a state file: {e}"), "give a file that a run wrote");
        let Version { version } = serde_json::from_str(text).map_err(broken)?;
        check_version(version)?;
        let state: Self = serde_json::from_str(text).map_err(broken)?;
        state.check(problem)?;
        Ok(state)
    }

    /// Refuses a state of another version or problem, and one whose parts do not have the problem's shape.
    pub(super) fn check(&self, problem: &Problem) -> Result<()> {
        check_version(self.version)?;
        if self.fingerprint != problem.fingerprint() {
            let why = format!("it belongs to another problem (`{}`, here `{}`)", self.problem, problem.name);
            return Err(fault(why, "continue it with the problem, bounds and limits that it was written with"));
        }
        Error::check_length("design of the state", problem.n(), self.design.len())?;
        Error::check_length("move-limit factors of the state", problem.n(), self.factors.len())?;
        problem.check_shape(&self.responses)?;
        Error::check_length("constraints of the state", problem.constraints.len(), self.evaluation.constraints.len())
    }

    /// Writes the state to a file. The file appears whole or not at all: it is written beside its place and then moved.
    ///
    /// Errors with [`Error::File`] if that is not possible.
    pub fn save(&self, path: &Path) -> Result<()> {
        crate::storage::replace_file(path, self.to_json().as_bytes(), false).map_err(|e| {
            file_fault(path, &format!("it cannot be written: {e}"), "give a folder that can be written to")
        })
    }

    /// Reads a state that [`State::save`] wrote, for continuing a run of `problem` with the same bits.
    ///
    /// Errors as [`State::from_json`] does, and if the file cannot be read; the message names the file.
    pub fn load(path: &Path, problem: &Problem) -> Result<Self> {
        let unreadable = |e| file_fault(path, &format!("it cannot be read: {e}"), "give a file that a run wrote");
        let text = std::fs::read_to_string(path).map_err(unreadable)?;
        Self::from_json(&text, problem).map_err(|e| match e {
            Error::File { why, remedy, .. } => file_fault(path, &why, &remedy),
            other => other,
        })
    }

    /// Analyses a proposed design. A failure is a fact about the design, not the end of the run.
    pub(super) fn analyse(&mut self, problem: &Problem, design: &[f64]) -> Result<(Responses, Evaluation)> {
        self.counters.analyses += 1;
        let responses = problem.analyze(design)?;
        let evaluation = problem.evaluate(design, &responses)?;
        Ok((responses, evaluation))
    }

    /// Makes an accepted design the start of the next cycle; the last `memory` designs are remembered with their
    /// sensitivities.
    pub(super) fn advance(
        &mut self,
        (design, responses, evaluation): (Vec<f64>, Responses, Evaluation),
        sensitivities: Sensitivities,
        memory: usize,
    ) {
        if memory > 0 {
            let responses = Responses::new(self.responses.values.clone());
            self.past.insert(0, PreviousPoint { design: self.design.clone(), responses, sensitivities });
            self.past.truncate(memory);
        }
        self.last_step = Some(design.iter().zip(&self.design).map(|(to, from)| to - from).collect());
        (self.design, self.responses, self.evaluation) = (design, responses, evaluation);
    }

    /// The active rows of the last accepted cycle with their multipliers.
    pub(super) fn multipliers(&self) -> Vec<(RowId, f64)> {
        let last = self.history.iter().rev().find(|c| c.accepted);
        last.map_or_else(Vec::new, |cycle| cycle.active.iter().map(|a| (a.row, a.multiplier)).collect())
    }

    /// Number of accepted cycles.
    pub fn cycles(&self) -> usize {
        self.history.iter().filter(|c| c.accepted).count() - 1
    }
}

fn file_fault(path: &Path, why: &str, remedy: &str) -> Error {
    Error::File { file: path.display().to_string(), why: why.to_owned(), remedy: remedy.to_owned() }
}

fn check_version(version: u32) -> Result<()> {
    if version == STATE_VERSION {
        return Ok(());
    }
    let why = format!("it has version {version}, this program reads version {STATE_VERSION}");
    Err(fault(why, "continue it with the release that wrote it, or start anew"))
}

fn fault(why: String, remedy: &str) -> Error {
    Error::File { file: "state".to_owned(), why, remedy: remedy.to_owned() }
}
