//! The state of a run: one record that can be written to a file.

use super::{Cycle, Status};
use crate::approximation::Past;
use crate::error::{Error, Result};
use crate::problem::{Evaluation, Peak, Problem, Responses, RowId, Sensitivities};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

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
pub struct Knowledge {
    /// Kept constraints and time points.
    pub kept: Vec<RowId>,
    /// Sensitivities of the responses that they and the objective need.
    pub sensitivities: Sensitivities,
    /// Second derivatives at the same instants, if the approximation uses them.
    pub curvatures: Option<Vec<DMatrix<f64>>>,
    /// Kept local maxima of constraints in continuous time.
    pub peaks: Vec<Peak>,
}

impl Knowledge {
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
pub struct Guard {
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
    pub guard: Guard,
    /// Designs accepted before, the newest first; as many as the approximation uses.
    pub past: Vec<Past>,
    /// Present after a rejected try.
    pub knowledge: Option<Knowledge>,
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
        let fault =
            |why: String, remedy: &str| Error::File { file: "state".to_owned(), why, remedy: remedy.to_owned() };
        #[derive(Deserialize)]
        struct Version {
            version: u32,
        }
        let broken =
            |e: serde_json::Error| fault(format!("it is not a state file: {e}"), "give a file that a run wrote");
        let Version { version } = serde_json::from_str(text).map_err(broken)?;
        if version != STATE_VERSION {
            let why = format!("it has version {version}, this program reads version {STATE_VERSION}");
            return Err(fault(why, "continue it with the release that wrote it, or start anew"));
        }
        let state: Self = serde_json::from_str(text).map_err(broken)?;
        if state.fingerprint != problem.fingerprint() {
            let why = format!("it belongs to another problem (`{}`, here `{}`)", state.problem, problem.name);
            return Err(fault(why, "continue it with the problem, bounds and limits that it was written with"));
        }
        Ok(state)
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
            self.past.insert(0, Past { design: self.design.clone(), responses, sensitivities });
            self.past.truncate(memory);
        }
        self.last_step = Some(design.iter().zip(&self.design).map(|(to, from)| to - from).collect());
        (self.design, self.responses, self.evaluation) = (design, responses, evaluation);
    }

    /// Number of accepted cycles.
    pub fn cycles(&self) -> usize {
        self.history.iter().filter(|c| c.accepted).count() - 1
    }
}
