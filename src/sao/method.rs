//! The sequence of cycles (Section 4 of the paper).

use super::{
    Counters, Cycle, ErrorBased, Globalization, Knowledge, MoveLimits, Outcome, Region, RelativeLimits, STATE_VERSION,
    Screening, State, Status, Stop, Trial, Verdict,
};
use crate::approximation::{ApproximateProblem, Approximation, Known, Linear};
use crate::error::Result;
use crate::problem::{Evaluation, Problem, Responses, Sensitivities, Values};
use crate::subproblem::{Automatic, Solution, SubproblemSolver};
use nalgebra::DMatrix;

/// A method: a filling of interchangeable parts. It holds settings only; what changes is in the [`State`].
pub struct Method {
    /// How responses are approximated.
    pub approximation: Box<dyn Approximation>,
    /// Which constraints are kept.
    pub screening: Screening,
    /// The search subregion.
    pub move_limits: Box<dyn MoveLimits>,
    /// What solves the approximate problem.
    pub solver: Box<dyn SubproblemSolver>,
    /// Which proposals are accepted.
    pub globalization: Box<dyn Globalization>,
    /// When the run ends.
    pub stop: Stop,
}

impl Default for Method {
    /// The paper's method.
    fn default() -> Self {
        Self {
            approximation: Box::new(Linear),
            screening: Screening::default(),
            move_limits: Box::new(RelativeLimits::default()),
            solver: Box::new(Automatic::default()),
            globalization: Box::new(ErrorBased::default()),
            stop: Stop::default(),
        }
    }
}

impl Method {
    /// Runs from the start design to the end, showing each state to `observe`.
    pub fn solve(&self, problem: &Problem, mut observe: impl FnMut(&State)) -> Result<State> {
        let state = self.start(problem)?;
        observe(&state);
        self.resume(problem, state, observe)
    }

    /// Continues a run to its end. The one loop.
    ///
    /// Errors if settings are out of range, or if the state is one of another problem.
    pub fn resume(&self, problem: &Problem, mut state: State, mut observe: impl FnMut(&State)) -> Result<State> {
        self.check()?;
        state.check(problem)?;
        (state.status, state.reason) = self.stop.test(problem, &state);
        while state.status == Status::Running {
            state = self.step(problem, state)?;
            observe(&state);
        }
        Ok(state)
    }

    /// Analyses the start design.
    ///
    /// Errors if settings are out of range, or if the start cannot be analysed.
    pub fn start(&self, problem: &Problem) -> Result<State> {
        self.start_at(problem, problem.start())
    }

    /// Analyses a start design other than the problem's, within the same bounds.
    pub fn start_at(&self, problem: &Problem, design: Vec<f64>) -> Result<State> {
        self.check()?;
        problem.check()?;
        problem.check_design(&design)?;
        let responses = problem.analyze(&design)?;
        let evaluation = problem.evaluate(&design, &responses)?;
        let factors = self.move_limits.start(problem.n());
        let first = Cycle::start(&design, &evaluation, &factors);
        Ok(State {
            version: STATE_VERSION,
            problem: problem.name.clone(),
            fingerprint: problem.fingerprint(),
            design,
            responses,
            evaluation,
            factors,
            last_step: None,
            knowledge: None,
            history: vec![first],
            counters: Counters { analyses: 1, ..Default::default() },
            status: Status::Running,
            reason: String::new(),
        })
    }

    /// One cycle, or one more try of a rejected one. The stages are those of Section 4 of the paper, in its order.
    pub fn step(&self, problem: &Problem, mut state: State) -> Result<State> {
        let knowledge = match state.knowledge.take() {
            Some(knowledge) => knowledge,
            None => self.screen_and_differentiate(problem, &mut state)?,
        };
        let region = self.move_limits.region(problem, &state.design, &state.factors);
        let approximate = self.approximate(problem, &state, &knowledge, &region)?;
        let proposal = self.solver.solve(&approximate, &state.design)?;
        state.counters.subproblem_iterations += proposal.iterations;
        let analysed = state.analyse(problem, &proposal.x);
        let at_limit = region.at_limit(&proposal.x);
        let trial = self.trial(problem, &state, &knowledge, &proposal, &at_limit, analysed.as_ref().ok())?;
        let verdict = trial.outcome.map_or(Verdict::Reject, |_| self.globalization.judge(&trial));
        let mut factors = state.factors.clone();
        self.move_limits.update(&mut factors, &trial, verdict);
        state.history.push(Cycle::new(&state, &trial, verdict, &knowledge, region, &proposal, &analysed));
        state.factors = factors;
        match (verdict, analysed) {
            (Verdict::Accept, Ok((responses, evaluation))) => state.advance(proposal.x, responses, evaluation),
            _ => state.knowledge = Some(knowledge),
        }
        (state.status, state.reason) = self.stop.test(problem, &state);
        Ok(state)
    }

    fn check(&self) -> Result<()> {
        self.screening.check()?;
        self.move_limits.check()?;
        self.globalization.check()?;
        self.stop.check()
    }

    /// Constraint screening, then sensitivities of what is kept.
    fn screen_and_differentiate(&self, problem: &Problem, state: &mut State) -> Result<Knowledge> {
        let kept = self.screening.keep(problem, &state.evaluation);
        let instants = ApproximateProblem::instants(problem, &kept);
        let rows = if instants.is_empty() {
            DMatrix::zeros(0, problem.n())
        } else {
            state.counters.sensitivity_analyses += 1;
            problem.sensitivities(&state.design, &state.responses, &instants)?
        };
        Ok(Knowledge { kept, sensitivities: Sensitivities { instants, rows } })
    }

    fn approximate<'a>(
        &self,
        problem: &'a Problem,
        state: &State,
        knowledge: &Knowledge,
        region: &Region,
    ) -> Result<ApproximateProblem<'a>> {
        let known = Known {
            design: &state.design,
            responses: &state.responses,
            evaluation: &state.evaluation,
            sensitivities: &knowledge.sensitivities,
        };
        let bounds = (region.lower.clone(), region.upper.clone());
        ApproximateProblem::new(problem, &*self.approximation, known, knowledge.kept.clone(), bounds)
    }

    /// The proposal held against its analysis.
    fn trial<'a>(
        &self,
        problem: &Problem,
        state: &'a State,
        knowledge: &Knowledge,
        proposal: &'a Solution,
        at_limit: &'a [bool],
        analysed: Option<&(Responses, Evaluation)>,
    ) -> Result<Trial<'a>> {
        let approximate = Values { objective: proposal.objective, rows: proposal.rows.clone() };
        let compare =
            |(_, e): &(Responses, Evaluation)| Outcome::new(problem, &self.screening, &knowledge.kept, &approximate, e);
        Ok(Trial {
            from: &state.design,
            to: &proposal.x,
            last_step: state.last_step.as_deref(),
            at_limit,
            objective_before: state.evaluation.objective,
            violation_before_pct: state.evaluation.max_violation_pct(),
            approximate_objective: proposal.objective,
            outcome: analysed.map(compare),
        })
    }
}
