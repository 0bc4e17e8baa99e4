//! The sequence of cycles (Section 4 of the paper).

use super::trace::Trace;
use super::trial::AnalysedProposal;
use super::{Counters, Cycle, Method, RunState, STATE_VERSION, Status, StepVerdict, Trial, optimality};
use crate::approximation::{ApproximateProblem, ApproximationOptions, CycleData, SubproblemBox};
use crate::problem::{AnalyzedDesign, Problem, RowId};
use error::{Error, Result};

impl Method {
    /// Runs from the start design to the end, and passes each state to `observe`.
    ///
    /// # Errors
    ///
    /// As [`start`](Self::start) and [`step`](Self::step).
    pub fn solve(&self, problem: &Problem, mut observe: impl FnMut(&RunState)) -> Result<RunState> {
        let state = self.start(problem)?;
        observe(&state);
        self.resume(problem, state, observe)
    }

    /// Continues a run to its end.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step); also if settings are out of range, or if the state belongs to another problem.
    pub fn resume(
        &self,
        problem: &Problem,
        mut state: RunState,
        mut observe: impl FnMut(&RunState),
    ) -> Result<RunState> {
        state = self.restart(problem, state)?;
        while state.status == Status::Running {
            state = self.step(problem, state)?;
            observe(&state);
        }
        Ok(state)
    }

    /// Analyses the start design.
    ///
    /// # Errors
    ///
    /// If settings are out of range, parts of the problem are inconsistent, or the start cannot be analysed.
    pub fn start(&self, problem: &Problem) -> Result<RunState> {
        self.start_at(problem, problem.start())
    }

    /// Analyses a start design other than the problem's, within the same bounds.
    ///
    /// # Errors
    ///
    /// As [`start`](Self::start).
    pub fn start_at(&self, problem: &Problem, design: Vec<f64>) -> Result<RunState> {
        self.check(problem)?;
        problem.check()?;
        problem.check_design(&design)?;
        let analyzed = problem.analyze_design(&design)?;
        let is_automatic = self.automatic.is_some();
        let analyzed = if is_automatic { problem.with_bound_at_peak(analyzed)? } else { analyzed };
        let AnalyzedDesign { design, responses, evaluation } = analyzed;
        let factors = self.move_limits.start(problem.n());
        Ok(RunState {
            version: STATE_VERSION,
            problem: problem.name.clone(),
            fingerprint: problem.fingerprint(),
            globalization: self.globalization.start(problem, &evaluation),
            history: vec![Cycle::start(problem, &design, &evaluation, &factors)],
            design,
            responses,
            evaluation,
            factors,
            last_step: None,
            previous: vec![],
            data: None,
            automatic: None,
            points: vec![],
            start_lengths: None,
            confirmation: None,
            active: None,
            counters: Counters { analyses: 1, ..Default::default() },
            status: Status::Running,
            reason: String::new(),
            trace: Trace::default(),
        })
    }

    /// One trial step: a new cycle, or another trial step of a cycle whose last step was rejected.
    ///
    /// # Errors
    ///
    /// Those of the sensitivities at the start design, and of the approximation. A failed analysis of the proposed design is not an
    /// error, unless it [ends the run](error::Error::ends_run): it rejects the design. Where a later design cannot be differentiated, or
    /// the approximate problem cannot be solved, the run has [stalled](Status::Stalled).
    pub fn step(&self, problem: &Problem, mut state: RunState) -> Result<RunState> {
        let rules = self.approximation.asymptotes();
        state.follow(&rules);
        state.active = None;
        let mut state = match self.automatic {
            Some(automatic) => automatic.step(self, problem, state)?,
            None => self.trial_step(problem, state)?,
        };
        state.follow(&rules);
        Ok(state)
    }

    /// One trial step of a method of interchangeable parts.
    fn trial_step(&self, problem: &Problem, mut state: RunState) -> Result<RunState> {
        // 1. Responses and 2. objective and constraints at the design of the state: from the analysis that accepted it.
        // 3. Screening and 4. sensitivities of the retained responses; a repeated cycle reuses both.
        let data = match state.data.take() {
            Some(data) => data,
            None => match self.screen_and_differentiate(problem, &mut state) {
                Ok(data) => data,
                Err(error) => return state.without_derivatives(error),
            },
        };
        // 5. Approximations, and from them the approximate problem inside the move limits.
        let region = self.move_limits.region(problem, &state.design, &state.factors);
        let sides = (region.lower.clone(), region.upper.clone());
        let approximate = self.approximate(problem, &state, &data, sides)?;
        // 6. The solution of the approximate problem.
        let solution = match self.solver.solve(&approximate, &state.design) {
            Ok(solution) => solution,
            Err(error) => {
                state.data = Some(data);
                return self.without_step(problem, state, error);
            }
        };
        // 7. Its analysis, errors and violation.
        state.counters.subproblem_iterations += solution.iterations;
        state.counters.analyses += 1;
        let (at_limit, distance) = (region.at_limit(&solution.x), approximate.distance(&solution.x));
        let analyzed = problem.analyze_design(&solution.x);
        if let Some(error) = analyzed.as_ref().err().filter(|error| error.ends_run()) {
            return Err(error.clone());
        }
        let proposal = AnalysedProposal {
            data: &data,
            region: &region,
            solution: &solution,
            distance,
            at_limit: &at_limit,
            analyzed: &analyzed,
        };
        // 8. The decision, new move limits, and a row of the history.
        let (verdict, missed, mut cycle) = self.decide(problem, &mut state, &proposal);
        if self.stop.has_settled(&cycle, state.evaluation.objective) {
            cycle.residual = Some(optimality::residual(problem, &approximate, &state.design, &solution.multipliers)?);
        }
        state.history.push(cycle);
        match (verdict, analyzed) {
            (StepVerdict::Accept, Ok(accepted)) => {
                self.keep(problem, &mut state, &data);
                state.advance(accepted, data.sensitivities, self.memory());
            }
            _ if missed.is_empty() => state.data = Some(data),
            _ => match self.differentiate_rows(problem, &mut state, [data.retained, missed].concat()) {
                Ok(data) => state.data = Some(data),
                Err(error) => return state.without_derivatives(error),
            },
        }
        self.conclude(problem, state)
    }

    /// Decides about an analysed proposal, and updates move limits and globalization. Returns the verdict, the rows that were not retained
    /// but are violated at the proposal, with which the cycle is repeated, and the row of the history.
    fn decide(
        &self,
        problem: &Problem,
        state: &mut RunState,
        proposal: &AnalysedProposal,
    ) -> (StepVerdict, Vec<RowId>, Cycle) {
        let from = (&state.design[..], &state.evaluation);
        let trial = Trial::new(problem, &self.screening, from, state.last_step.as_deref(), proposal);
        let (mut globalization, mut factors) = (state.globalization.clone(), state.factors.clone());
        let missed = match proposal.analyzed {
            Ok(next) => {
                let all = self.globalization.keeps_feasible();
                self.screening.missed(problem, &proposal.data.retained, &next.evaluation, all)
            }
            Err(_) => vec![],
        };
        let verdict = match &trial.outcome {
            Some(_) if missed.is_empty() => self.globalization.judge(&trial, &mut globalization),
            _ => StepVerdict::Reject,
        };
        if verdict != StepVerdict::IncreaseConservatism && missed.is_empty() {
            self.move_limits.update(&mut factors, &trial, verdict);
        }
        let cycle = Cycle::new(problem, state.cycles() + 1, &state.factors, &trial, verdict, proposal);
        (state.factors, state.globalization) = (factors, globalization);
        (verdict, missed, cycle)
    }

    /// Selects the rows of the next approximate problem, and differentiates their responses.
    pub(super) fn screen_and_differentiate(&self, problem: &Problem, state: &mut RunState) -> Result<CycleData> {
        let retained = self.screening.retain(problem, &state.evaluation);
        self.differentiate_rows(problem, state, retained)
    }

    /// Differentiates the responses of the `retained` rows at the design of the state.
    pub(super) fn differentiate_rows(
        &self,
        problem: &Problem,
        state: &mut RunState,
        mut retained: Vec<RowId>,
    ) -> Result<CycleData> {
        retained.sort_unstable();
        let RunState { design, responses, evaluation, .. } = &*state;
        let second_order = self.approximation.wants_curvature();
        let data = CycleData::differentiate(problem, design, responses, evaluation, retained, second_order)?;
        state.counters.sensitivity_analyses += usize::from(data.has_derivatives());
        Ok(data)
    }

    /// The approximate problem at the design of the state between the `sides` of the search subregion.
    fn approximate<'a>(
        &self,
        problem: &'a Problem,
        state: &RunState,
        data: &CycleData,
        sides: (Vec<f64>, Vec<f64>),
    ) -> Result<ApproximateProblem<'a>> {
        let point = state.linearization_point(data);
        let options = ApproximationOptions {
            conservatism: state.globalization.conservatism.clone(),
            moving_peaks: self.moving_peaks,
            curvature: self.curvature.and_then(|c| c.fit(problem, &point, &state.multipliers())),
        };
        let subproblem_box = SubproblemBox::new(problem, state.trace().designs.clone(), sides);
        ApproximateProblem::new(problem, &*self.approximation, point, (subproblem_box, options))
    }

    /// The end of a run whose approximate problem is not finite. The error of the solver would name variables and functions that are
    /// not those of the problem.
    ///
    /// # Errors
    ///
    /// Another error of the solver, and those of the confirmation.
    fn without_step(&self, problem: &Problem, state: RunState, error: Error) -> Result<RunState> {
        if !matches!(error, Error::NotFinite { .. }) {
            return Err(error);
        }
        self.conclude_as(problem, state, (Status::Stalled, super::NOT_FINITE.to_owned()))
    }
}

impl RunState {
    /// The end of a run at a design that cannot be differentiated.
    ///
    /// # Errors
    ///
    /// The error of the sensitivities if it is the start, or if no other design can be differentiated, either.
    pub(super) fn without_derivatives(mut self, error: Error) -> Result<Self> {
        if self.history.len() == 1 || error.ends_run() {
            return Err(error);
        }
        self.status = Status::Stalled;
        self.reason = format!("no step can be made from here: {error}");
        Ok(self)
    }
}
