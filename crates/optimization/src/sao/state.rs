//! The state of a run: one record that can be written to a file.

use super::trace::Trace;
use super::{AcceptedPoint, ActiveRow, AutomaticState, Cycle, GlobalizationState, StartLengths};
use crate::approximation::{Asymptotes, CycleData, LinearizationPoint, PreviousPoint};
use crate::problem::{AnalyzedDesign, Evaluation, Problem, Responses, RowId, Sensitivities};
use error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::path::Path;

/// Version of the state file; a file of another version is rejected.
pub const STATE_VERSION: u32 = 2;

/// The status of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[non_exhaustive]
pub enum Status {
    /// The run has not ended.
    Running,
    /// The objective has settled, no constraint is violated, and the optimality conditions hold.
    Converged,
    /// The largest number of cycles is reached.
    CycleLimit,
    /// The move limits have become too small without an acceptable design.
    Stalled,
    /// The run has ended at a design that violates constraints.
    Infeasible,
}

impl Status {
    /// True if the last design is a solution.
    pub fn is_success(self) -> bool {
        self == Self::Converged
    }
}

/// The status in words for tables: `cycle limit`.
impl std::fmt::Display for Status {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.pad(match self {
            Self::Running => "running",
            Self::Converged => "converged",
            Self::CycleLimit => "cycle limit",
            Self::Stalled => "stalled",
            Self::Infeasible => "infeasible",
        })
    }
}

/// Numbers of analyses and iterations, counted as in the paper.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counters {
    /// Analyses, including the first one and failed ones.
    pub analyses: usize,
    /// Sensitivity analyses: one for each cycle that needed any, none for a repeated one.
    pub sensitivity_analyses: usize,
    /// Iterations of the subproblem solver, all cycles together.
    pub subproblem_iterations: usize,
}

/// Everything that changes during a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunState {
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
    /// Move-limit factors of the next trial step.
    pub factors: Vec<f64>,
    /// The last accepted step.
    pub last_step: Option<Vec<f64>>,
    /// State of the globalization.
    #[serde(rename = "guard")]
    pub globalization: GlobalizationState,
    /// Earlier accepted designs, the newest first; as many as the approximation uses.
    #[serde(rename = "past")]
    pub previous: Vec<PreviousPoint>,
    /// Retained rows and derivatives of a cycle that is to be repeated; `None` after an accepted trial step.
    #[serde(rename = "knowledge")]
    pub data: Option<CycleData>,
    /// Data of the automatic method; `None` for other methods, and before the first cycle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub automatic: Option<AutomaticState>,
    /// The last accepted designs before the current one with their derivatives, for a confirmation of the end.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<AcceptedPoint>,
    /// Lengths of the variables by the start, for a confirmation of the end.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start_lengths: Option<StartLengths>,
    /// The last confirmation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub confirmation: Option<Confirmation>,
    /// All trial steps so far, cycle 0 first.
    pub history: Vec<Cycle>,
    /// Active rows at the design with their multipliers, from the stop test of the automatic method; `None` during a run and
    /// for other methods.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub active: Option<Vec<ActiveRow>>,
    /// Numbers of analyses and iterations so far.
    pub counters: Counters,
    /// Status of the run.
    pub status: Status,
    /// Reason of the status in words; empty during the run.
    pub reason: String,
    /// Quantities derived from the history.
    #[serde(skip)]
    pub(super) trace: Trace,
}

/// Result of the automatic method when started from the last design of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Confirmation {
    /// Number of trial steps of the run before it.
    pub trials: usize,
    /// [`Problem::fingerprint`] of the problem, whose bounds may be changed later.
    pub fingerprint: u64,
    /// The cycle at whose design it began, if not the last one because an earlier design was better.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub begun_at: Option<usize>,
    /// Objective at the last design of the run.
    pub from: f64,
    /// True if the design where it began is feasible by the stop test of the automatic method, to the accuracy of the run.
    pub is_feasible: bool,
    /// Largest violation at the last design of the run, in units of its constraint.
    pub violation_before: f64,
    /// Analyses and sensitivity analyses that it needed.
    pub work: [usize; 2],
    /// Status of its end.
    pub status: Status,
    /// The reason in words.
    pub reason: String,
    /// Objective at its end.
    pub objective: f64,
    /// Largest violation there, in the same units.
    pub violation: f64,
    /// Unit in which differences of the objective are measured, from its change over the run.
    pub unit: f64,
    /// True if the run ends at the design that it found, because it is better.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub is_adopted: bool,
}

impl RunState {
    /// The state as JSON; every number reads back with the same bits.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("a state holds finite numbers and strings only")
    }

    /// The state from JSON, for continuing a run of `problem`.
    ///
    /// # Errors
    ///
    /// [`Error::File`] if the text is not a state, or one of another version or another problem.
    pub fn from_json(text: &str, problem: &Problem) -> Result<Self> {
        #[derive(Deserialize)]
        struct Version {
            version: u32,
        }
        let Version { version } = serde_json::from_str(text).map_err(broken)?;
        check_version(version)?;
        let state: Self = serde_json::from_str(text).map_err(broken)?;
        state.check(problem)?;
        Ok(state)
    }

    /// Calls `f` with the state without its history, for a history that is stored elsewhere.
    pub fn without_history<T>(&mut self, f: impl FnOnce(&Self) -> T) -> T {
        let history = std::mem::take(&mut self.history);
        let result = f(self);
        self.history = history;
        result
    }

    /// Completes a state that was stored [without its history](Self::without_history), and checks it. With `None` the state has
    /// its history.
    ///
    /// The caller has checked that the problem is that of the state; only its bounds may differ.
    ///
    /// # Errors
    ///
    /// [`Error::File`] for another version; [`Error::Length`] or [`Error::Definition`] if a length or an index does not agree with
    /// the problem.
    pub fn complete(mut self, history: Option<Vec<Cycle>>, problem: &Problem) -> Result<Self> {
        check_version(self.version)?;
        self.history = history.unwrap_or(self.history);
        (self.fingerprint, self.problem) = (problem.fingerprint(), problem.name.clone());
        self.check_shape(problem)?;
        Ok(self)
    }

    /// Rejects a state of another version or problem, and one whose parts do not have the problem's shape.
    pub(super) fn check(&self, problem: &Problem) -> Result<()> {
        check_version(self.version)?;
        if self.fingerprint != problem.fingerprint() {
            let why = format!(
                "it belongs to another problem, or an earlier version wrote it (`{}`, here `{}`)",
                self.problem, problem.name
            );
            return Err(fault(why, "continue it with the problem, bounds and limits that it was written with"));
        }
        self.check_shape(problem)
    }

    /// Writes the state to a file atomically: a temporary file is written and then renamed.
    ///
    /// # Errors
    ///
    /// [`Error::File`] if that is not possible.
    pub fn save(&self, path: &Path) -> Result<()> {
        crate::storage::replace_file(path, self.to_json().as_bytes(), false).map_err(|e| {
            file_fault(path, &format!("it cannot be written: {e}"), "give a folder that can be written to")
        })
    }

    /// Reads a state that [`RunState::save`] wrote, for continuing a run of `problem` with the same bits.
    ///
    /// # Errors
    ///
    /// As [`RunState::from_json`], and if the file cannot be read; the message names the file.
    pub fn load(path: &Path, problem: &Problem) -> Result<Self> {
        let unreadable =
            |e: std::io::Error| file_fault(path, &format!("it cannot be read: {e}"), "give a file that a run wrote");
        let bytes = crate::storage::read_file(path, u64::MAX - 1).map_err(unreadable)?;
        let text = String::from_utf8(bytes).map_err(|e| unreadable(std::io::Error::other(e)))?;
        Self::from_json(&text, problem).map_err(|e| match e {
            Error::File { why, remedy, .. } => file_fault(path, &why, &remedy),
            other => other,
        })
    }

    /// The accepted design as the point of linearization.
    pub fn linearization_point<'a>(&'a self, data: &'a CycleData) -> LinearizationPoint<'a> {
        LinearizationPoint { design: &self.design, responses: &self.responses, data, previous: &self.previous }
    }

    /// Makes an accepted design the start of the next cycle; the last `memory` designs are stored with their sensitivities.
    pub(super) fn advance(&mut self, accepted: AnalyzedDesign, sensitivities: Sensitivities, memory: usize) {
        let AnalyzedDesign { design, responses, evaluation } = accepted;
        if memory > 0 {
            let responses = Responses::new(self.responses.values.clone());
            self.previous.insert(0, PreviousPoint { design: self.design.clone(), responses, sensitivities });
            self.previous.truncate(memory);
        }
        self.last_step = Some(design.iter().zip(&self.design).map(|(to, from)| to - from).collect());
        (self.design, self.responses, self.evaluation) = (design, responses, evaluation);
    }

    /// The active rows with their multipliers: at the design, from the stop test of the automatic method; else those of the subproblem
    /// that gave the design.
    pub fn active_rows(&self) -> &[ActiveRow] {
        let last = || self.history.iter().rev().find(|c| c.accepted).map_or(&[][..], |cycle| &cycle.active);
        self.active.as_deref().unwrap_or_else(last)
    }

    /// The active rows of the last accepted cycle with their multipliers.
    pub(super) fn multipliers(&self) -> Vec<(RowId, f64)> {
        let last = self.history.iter().rev().find(|c| c.accepted);
        last.map_or_else(Vec::new, |cycle| cycle.active.iter().map(|a| (a.row, a.multiplier)).collect())
    }

    /// Σ |λ| over the active rows of the last accepted cycle: to first order, what the objective gains if all of them are violated by the unit of
    /// their scales.
    pub fn gain_of_violation(&self) -> f64 {
        self.multipliers().iter().map(|(_, multiplier)| multiplier.abs()).sum()
    }

    /// The trial step with the best design if that is better than the last accepted one; not every method descends.
    ///
    /// Better is a smaller objective, by more than `least` × the range of the objective over the accepted designs and by more than
    /// its violation gains ([`gain_of_violation`](Self::gain_of_violation)), among the
    /// designs that violate no constraint by more than `tolerance` (a fraction of its scale); if the last design violates one, any
    /// design that does not, or the one with a violation smaller by more than `least`. The objective of a min–max problem is the
    /// peak. Among equal ones it is the earliest with the least violation.
    pub fn better_than_last(&self, tolerance: f64, least: f64) -> Option<&Cycle> {
        let merit = |cycle: &Cycle| {
            let violation = cycle.violation();
            if violation <= tolerance { [0.0, cycle.stated_objective()] } else { [violation, 0.0] }
        };
        let last = merit(self.history.iter().rev().find(|cycle| cycle.accepted)?);
        let trace = self.trace();
        let best = &self.history[trace.best(tolerance)?];
        let [violation, objective] = merit(best);
        let is_better = if last[0] > 0.0 {
            last[0] - violation > least
        } else {
            let size = trace.stated.width().min(last[1].abs().max(objective.abs()));
            violation == 0.0 && last[1] - objective > least * size + self.gain_of_violation() * best.violation()
        };
        is_better.then_some(best)
    }

    /// Quantities of all steps.
    pub(super) fn trace(&self) -> Cow<'_, Trace> {
        if self.trace.is_complete(&self.history) {
            return Cow::Borrowed(&self.trace);
        }
        let mut trace = self.trace.clone();
        trace.follow(&self.history);
        Cow::Owned(trace)
    }

    /// Reads the last steps, and updates the distances by rules for asymptotes.
    pub(super) fn follow(&mut self, rules: &[Asymptotes]) {
        self.trace.follow_with(rules, &self.history);
    }

    /// Number of accepted cycles.
    pub fn cycles(&self) -> usize {
        self.history.last().map_or(0, |last| if last.accepted { last.cycle } else { last.cycle.saturating_sub(1) })
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

fn broken(error: serde_json::Error) -> Error {
    fault(format!("it is not a state file: {error}"), "give a file that a run wrote")
}

fn fault(why: String, remedy: &str) -> Error {
    Error::File { file: "state".to_owned(), why, remedy: remedy.to_owned() }
}
