//! Confirmation of the end of a run: a search for a better design from there by the automatic method.
//!
//! Methods with first-order approximations can stop at designs that are not optimal: steps become short because of move limits, asymptotes or
//! conservatism, or because the start gives no information about the lengths of the variables. Whether a design is an optimum is
//! therefore decided in one place for all methods: the [automatic method](super::Automatic) continues from the design where a run has
//! settled, with the stored derivatives, or from an earlier design of the run if that is clearly better. The end is
//! confirmed if that leads to no design that is better by more than the accuracy. A design that is better by less becomes the end of
//! the run.

use super::automatic::{AcceptedPoint, Automatic, Continuation, spread};
use super::{Confirmation, Cycle, Method, RunState, Status, Stop};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Problem};
use error::Result;

/// Number of accepted designs whose derivatives are kept for a confirmation.
const KEPT: usize = 8;
/// Largest number of trial steps of a confirmation.
const MOST_TRIALS: usize = 30;
/// Largest ratio of the violation of a run to the violation that the automatic method reports as stationary.
const LARGER: f64 = 1.01;
/// Least number of accepted designs over which the recent change of the objective is taken; it is half of a longer run.
const RECENT: usize = 6;
/// Least unit of the objective, as a fraction of its change.
const LEAST: f64 = 1e-4;
/// Least gain, as a fraction of the smaller one of the objective and its range, for which a confirmation begins at an earlier design; and
/// loss, in units of the objective, above which a confirmation ends at another design.
const CLEAR_GAIN: f64 = 0.01;
/// Fraction of the accuracy by which the end of a confirmation must be better to become the end of the run.
const ADOPTED: f64 = 1e-3;
/// Relative step of a variable below which it counts as unchanged.
const NO_STEP: f64 = 1e-12;
/// Range of the objective over a run, relative to the objective, below which the objective may consist mainly of a constant.
const HIDDEN_SIZE: f64 = 0.01;
/// Factor of the unit of such an objective.
const HIDDEN_UNIT_FACTOR: f64 = 0.1;

impl Confirmation {
    /// True if the run has made no trial step since this confirmation.
    fn is_of(&self, problem: &Problem, state: &RunState) -> bool {
        self.fingerprint == problem.fingerprint() && self.trials == state.history.len()
    }

    /// True if another confirmation may have another result: the objective has come halfway to that of the better design, or the number
    /// of trial steps has doubled.
    fn is_outdated(&self, problem: &Problem, state: &RunState) -> bool {
        let gap = self.from - self.objective;
        let is_better = self.status == Status::Converged && gap > 0.0;
        let is_nearer = is_better && state.evaluation.objective - self.objective <= 0.5 * gap;
        self.fingerprint != problem.fingerprint() || is_nearer || state.history.len() >= 2 * self.trials
    }

    /// The status that is confirmed; `None` if a better design is known or the result is inconclusive.
    fn verdict(&self, accuracy: f64) -> Option<Status> {
        // An end at another, worse design gives no information about this one.
        let gain = (self.from - self.objective) / self.unit;
        let is_best = self.begun_at.is_none() && !(gain > accuracy || gain < -CLEAR_GAIN);
        let is_confirmed = match self.status {
            Status::Converged => self.is_feasible && is_best,
            Status::Infeasible => self.violation_before <= LARGER * self.violation,
            _ => false,
        };
        is_confirmed.then_some(self.status)
    }

    /// True if the design that was found is better by more than a part of the accuracy, and violates no constraint more, up to that part.
    fn is_better(&self, accuracy: f64) -> bool {
        let part = ADOPTED * accuracy;
        self.from - self.objective > part * self.unit && self.violation <= self.violation_before.max(100.0 * part)
    }

    /// Its result in words, for a run that ends with this verdict.
    fn in_words(&self, verdict: Option<Status>) -> String {
        let [analyses, sensitivities] = self.work;
        let work = format!("{analyses} analyses and {sensitivities} sensitivity analyses");
        let begin =
            self.begun_at.map_or_else(|| "here".to_owned(), |cycle| format!("the better design of cycle {cycle}"));
        match (verdict, self.status) {
            (Some(Status::Converged), _) if self.is_adopted => {
                format!("the automatic method moves on to a better design, with {work}: {}", self.reason)
            }
            (Some(Status::Converged), _) => {
                format!("the automatic method confirms the design with {work}: {}", self.reason)
            }
            (Some(_), _) => format!("from {begin} the automatic method ends, with {work}, where {}", self.reason),
            (None, Status::Converged) => {
                format!("from {begin} the automatic method reaches the objective {:.9e} with {work}", self.objective)
            }
            (None, _) => format!("with {work} the automatic method does not confirm an optimum from {begin} either"),
        }
    }
}

impl Method {
    /// The status of a run after its last trial step. Convergence, infeasibility and stalling are confirmed.
    ///
    /// # Errors
    ///
    /// Those that [end a run](error::Error::ends_run).
    pub(super) fn conclude(&self, problem: &Problem, state: RunState) -> Result<RunState> {
        let end = self.stop.test(problem, &state);
        self.conclude_as(problem, state, end)
    }

    /// The status of a run that seems to have this one.
    ///
    /// # Errors
    ///
    /// As [`conclude`](Self::conclude).
    pub(super) fn conclude_as(
        &self,
        problem: &Problem,
        mut state: RunState,
        (status, reason): (Status, String),
    ) -> Result<RunState> {
        let is_confirmed = |known: &Confirmation| known.is_adopted && known.is_of(problem, &state);
        if let Some(status) =
            state.confirmation.as_ref().filter(|c| is_confirmed(c)).and_then(|c| c.verdict(self.stop.accuracy))
        {
            // The last design is the one that the confirmation found.
            state.status = status;
            return Ok(state);
        }
        (state.status, state.reason) = (status, reason);
        if !self.stop.confirm || matches!(status, Status::Running | Status::CycleLimit) {
            return Ok(state);
        }
        let is_at_end = status == Status::Stalled || has_stopped(&state);
        let (mut known, end) = match state.confirmation.take() {
            // An adopted one has been handled above, unless a smaller accuracy was set since then.
            Some(known) if known.is_of(problem, &state) && !known.is_adopted => (known, None),
            Some(known) if !is_at_end && !known.is_outdated(problem, &state) => {
                state.confirmation = Some(known);
                (state.status, state.reason) = self.stop.cycle_limit(&state);
                return Ok(state);
            }
            _ => match confirm(problem, &mut state, self.stop.accuracy) {
                Ok((known, end)) => (known, Some(end)),
                Err(error) if error.ends_run() => return Err(error),
                Err(error) => {
                    state.status = Status::Stalled;
                    state.reason = format!("{}; the automatic method cannot continue from here: {error}", state.reason);
                    return Ok(state);
                }
            },
        };
        let verdict = known.verdict(self.stop.accuracy);
        if let Some(end) = end.filter(|_| verdict == Some(Status::Converged) && known.is_better(self.stop.accuracy)) {
            state.adopt(end);
            (known.trials, known.is_adopted) = (state.history.len(), true);
        }
        (state.status, state.reason) = if verdict.is_some() || is_at_end {
            let is_refuted = verdict.is_none() && status != Status::Stalled;
            let reason = if is_refuted { "the steps have become zero" } else { &state.reason };
            (verdict.unwrap_or(Status::Stalled), format!("{reason}; {}", known.in_words(verdict)))
        } else {
            self.stop.cycle_limit(&state)
        };
        state.confirmation = Some(known);
        Ok(state)
    }

    /// The status of a run for the problem and the settings as they are now, when it is to be continued.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step); also if settings are out of range, or if the state belongs to another problem.
    pub fn restart(&self, problem: &Problem, mut state: RunState) -> Result<RunState> {
        self.check(problem)?;
        state.check(problem)?;
        if self.automatic.is_none() {
            return self.conclude(problem, state);
        }
        // The automatic method makes its stop test at the beginning of a cycle.
        (state.status, state.reason) = self.stop.cycle_limit(&state);
        Ok(state)
    }

    /// Stores the derivatives at the design of a state before the next step, and the lengths of the variables if it is the start, for a
    /// later confirmation.
    pub(super) fn keep(&self, problem: &Problem, state: &mut RunState, data: &CycleData) {
        if self.stop.confirm {
            if state.history.first().is_some_and(|start| start.design == state.design) {
                state.start_lengths = Some(Automatic::lengths(problem, state, data));
            }
            let at = (&state.design[..], &state.responses, &state.evaluation);
            state.points.push(AcceptedPoint::new(problem, at, data));
            let surplus = state.points.len().saturating_sub(KEPT);
            state.points.drain(..surplus);
        }
    }
}

/// True if the last trial step was accepted and has the length zero.
fn has_stopped(state: &RunState) -> bool {
    let zero = |(step, b): (&f64, &f64)| step.abs() <= NO_STEP * b.abs();
    let is_accepted = state.history.last().is_some_and(|c| c.accepted && c.cycle > 0);
    is_accepted && state.last_step.as_ref().is_some_and(|step| step.iter().zip(&state.design).all(zero))
}

impl RunState {
    /// Moves to the design where the run of a confirmation has ended: the last cycle.
    fn adopt(&mut self, end: RunState) {
        let Some(cycle) = end.history.into_iter().rfind(|cycle| cycle.accepted) else { return };
        self.history.push(Cycle { cycle: self.cycles() + 1, ..cycle });
        self.active = end.active;
        let RunState { design, responses, evaluation, .. } = end;
        self.last_step = Some(design.iter().zip(&self.design).map(|(to, from)| to - from).collect());
        (self.design, self.responses, self.evaluation, self.data) = (design, responses, evaluation, None);
    }
}

/// Continues with the automatic method from the design of a state, or from a clearly better one before it, until it ends. Returns its
/// last state, too.
fn confirm(problem: &Problem, state: &mut RunState, accuracy: f64) -> Result<(Confirmation, RunState)> {
    let better = clearly_better(state, accuracy);
    let mut history: Vec<_> = state.history.iter().filter(|cycle| cycle.accepted).cloned().collect();
    history.extend(better.map(|cycle| Cycle { accepted: true, ..cycle.clone() }));
    let max_cycles = history.len() - 1 + MOST_TRIALS;
    let method = Method::automatic().with_stop(Stop { max_cycles, ..Stop::default() });
    let mut run = RunState { history, data: None, automatic: None, confirmation: None, active: None, ..state.clone() };
    (run.status, run.reason) = (Status::Running, String::new());
    let begin = run.counters;
    if let Some(cycle) = better {
        AnalyzedDesign { design: run.design, responses: run.responses, evaluation: run.evaluation } =
            problem.analyze_design(&cycle.design)?;
        run.counters.analyses += 1;
    }
    let Continuation { is_feasible, largest_change } =
        Automatic::default().begin_at(&method, problem, &mut run, accuracy)?;
    let objectives: Vec<f64> = run.history.iter().map(|cycle| cycle.objective).collect();
    let unit = unit(&objectives, largest_change);
    if let Some(memory) = &mut run.automatic {
        memory.tolerance = accuracy * unit;
    }
    while run.status == Status::Running {
        run = method.step(problem, run)?;
    }
    let end = run.counters;
    let violation = |state: &RunState| state.evaluation.max_violation_pct().max(0.0);
    let confirmation = Confirmation {
        trials: state.history.len(),
        fingerprint: problem.fingerprint(),
        begun_at: better.map(|cycle| cycle.cycle),
        from: state.evaluation.objective,
        is_feasible,
        violation_before: violation(state),
        work: [end.analyses - begin.analyses, end.sensitivity_analyses - begin.sensitivity_analyses],
        status: run.status,
        objective: run.evaluation.objective,
        violation: violation(&run),
        reason: std::mem::take(&mut run.reason),
        unit,
        is_adopted: false,
    };
    state.counters = end;
    Ok((confirmation, run))
}

/// The best design of a run if it is better than the last one by more than the accuracy.
fn clearly_better(state: &RunState, accuracy: f64) -> Option<&Cycle> {
    let objective = state.evaluation.objective;
    let size = objective.abs();
    // The objective of a run that starts at an optimum has almost no range.
    let least = (CLEAR_GAIN * state.trace().objective.width().min(size)).max(accuracy * size);
    let is_clear = |cycle: &&Cycle| {
        let is_equally_feasible = state.evaluation.max_violation_pct() <= 100.0 * accuracy;
        !is_equally_feasible || objective - cycle.objective > least
    };
    state.better_than_last(accuracy, accuracy).filter(is_clear)
}

/// The unit of the objective: the smaller one of the last objective and the change of the objective over a run. `by_slopes` is the change
/// that the slopes at the last design allow over the lengths. A start with a huge objective must not affect the whole run, so that the
/// change over the last designs counts, too; for an objective near zero the unit is a fraction of the change. If the objective may
/// consist mainly of a constant, the unit is smaller.
fn unit(objectives: &[f64], by_slopes: f64) -> f64 {
    let range = |count: usize| spread(objectives[objectives.len().saturating_sub(count)..].iter().copied());
    let whole = range(objectives.len());
    let change = (range(RECENT.max(objectives.len() / 2)) * whole).sqrt().max(by_slopes.min(whole)).max(LEAST * whole);
    let unit = |last: &f64| {
        let unit = last.abs().min(change).max(LEAST * change);
        if whole < HIDDEN_SIZE * last.abs() { HIDDEN_UNIT_FACTOR * unit } else { unit }
    };
    objectives.last().map_or(0.0, unit)
}
