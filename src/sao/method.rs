//! The sequence of cycles (Section 4 of the paper).

use super::{
    Counters, Cycle, CycleData, ErrorBased, Globalization, MoveLimits, Outcome, Prediction, Region, RelativeLimits,
    STATE_VERSION, Screening, State, Status, Stop, Trial, Verdict, optimality, trial,
};
use crate::approximation::{
    ApproximateProblem, Approximation, ApproximationOptions, LagrangianCurvature, Linear, LinearizationPoint,
    SubproblemBox,
};
use crate::problem::{Evaluation, Peak, Problem, Responses, RowId, Sensitivities};
use error::Result;
use nalgebra::DMatrix;
use nlp::Values;
use nlp::{Automatic, Solution, SubproblemSolver};

/// A method: a filling of interchangeable parts. It holds settings only; what changes is in the [`State`].
pub struct Method {
    /// How responses are approximated.
    pub approximation: Box<dyn Approximation>,
    /// Curvature of the Lagrangian that is added to the approximate objective, meant for linear approximations; none for none.
    pub curvature: Option<LagrangianCurvature>,
    /// Which constraints are kept.
    pub screening: Screening,
    /// The search subregion.
    pub move_limits: Box<dyn MoveLimits>,
    /// What solves the approximate problem.
    pub solver: Box<dyn SubproblemSolver>,
    /// Which proposals are accepted.
    pub globalization: Box<dyn Globalization>,
    /// Whether the peaks of constraints in continuous time drift in the approximate problem as the design changes, or keep
    /// their times.
    pub drifting: bool,
    /// When the run ends.
    pub stop: Stop,
}

impl Default for Method {
    /// The paper's method.
    fn default() -> Self {
        Self {
            approximation: Box::new(Linear),
            curvature: None,
            screening: Screening::default(),
            move_limits: Box::new(RelativeLimits::default()),
            solver: Box::new(Automatic::default()),
            globalization: Box::new(ErrorBased::default()),
            drifting: true,
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
        self.check(problem)?;
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
        self.check(problem)?;
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
            evaluation: evaluation.clone(),
            factors,
            last_step: None,
            guard: self.globalization.start(problem, &evaluation),
            past: vec![],
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
        let distance = approximate.distance(&proposal.x);
        let trial = self.trial(problem, &state, &knowledge, (&proposal, distance), &at_limit, analysed.as_ref().ok());
        let (mut guard, mut factors) = (state.guard.clone(), state.factors.clone());
        let judge = |_: &Outcome| self.globalization.judge(&trial, &mut guard);
        let verdict = trial.outcome.as_ref().map_or(Verdict::Reject, judge);
        if verdict != Verdict::IncreaseConservatism {
            self.move_limits.update(&mut factors, &trial, verdict);
        }
        let mut cycle = Cycle::new(&state, &trial, verdict, &knowledge, region, &proposal, &analysed);
        let found = analysed.as_ref().ok().map(|(_, evaluation)| evaluation);
        cycle.prediction = Some(Prediction::new(problem, &knowledge.kept, &proposal, found));
        if self.stop.has_settled(&cycle, state.evaluation.objective) {
            cycle.residual = Some(optimality::residual(problem, &approximate, &state.design, &proposal.multipliers)?);
        }
        state.history.push(cycle);
        (state.factors, state.guard) = (factors, guard);
        match (verdict, analysed) {
            (Verdict::Accept, Ok((responses, evaluation))) => {
                let design = (proposal.x, responses, evaluation);
                state.advance(design, knowledge.sensitivities, self.memory());
            }
            _ => state.knowledge = Some(knowledge),
        }
        (state.status, state.reason) = self.stop.test(problem, &state);
        Ok(state)
    }

    fn check(&self, problem: &Problem) -> Result<()> {
        self.approximation.check(problem)?;
        self.curvature.map_or(Ok(()), |c| c.check())?;
        self.screening.check()?;
        self.move_limits.check()?;
        self.globalization.check()?;
        self.stop.check()
    }

    /// How many designs accepted before are remembered.
    fn memory(&self) -> usize {
        self.approximation.memory().max(self.curvature.map_or(0, |c| c.steps))
    }

    /// The name of the method by which the analysis differentiates what is kept at this design, where there is a choice.
    pub fn differentiation(&self, problem: &Problem, state: &State) -> Option<&'static str> {
        let kept = self.screening.keep(problem, &state.evaluation);
        problem.analysis.differentiation(problem.n(), &ApproximateProblem::instants(problem, &kept))
    }

    /// Constraint screening, then sensitivities of what is kept.
    fn screen_and_differentiate(&self, problem: &Problem, state: &mut State) -> Result<CycleData> {
        let kept = self.screening.keep(problem, &state.evaluation);
        let instants = ApproximateProblem::instants(problem, &kept);
        let peaks = self.peaks(problem, state, &kept)?;
        let needed = !instants.is_empty() || !peaks.is_empty();
        state.counters.sensitivity_analyses += usize::from(needed);
        let rows = if instants.is_empty() {
            DMatrix::zeros(0, problem.n())
        } else {
            problem.sensitivities(&state.design, &state.responses, &instants)?
        };
        let curvatures = if self.approximation.wants_curvature() {
            problem.curvatures(&state.design, &state.responses, &instants)?
        } else {
            None
        };
        Ok(CycleData { kept, sensitivities: Sensitivities { instants, rows }, curvatures, peaks })
    }

    /// The kept local maxima of constraints in continuous time, differentiated.
    fn peaks(&self, problem: &Problem, state: &State, kept: &[RowId]) -> Result<Vec<Peak>> {
        let at = state.evaluation.peaks.iter().filter(|peak| kept.contains(&peak.row));
        let history = |j: usize| &state.evaluation.constraints[j];
        let (b, responses) = (&state.design, &state.responses);
        at.map(|p| {
            let peak = problem.peak(*p, b, responses, history(p.row.constraint))?;
            if self.approximation.wants_curvature() { problem.curved(peak, b, responses) } else { Ok(peak) }
        })
        .collect()
    }

    fn approximate<'a>(
        &self,
        problem: &'a Problem,
        state: &State,
        knowledge: &CycleData,
        region: &Region,
    ) -> Result<ApproximateProblem<'a>> {
        let known = LinearizationPoint {
            design: &state.design,
            responses: &state.responses,
            evaluation: &state.evaluation,
            sensitivities: &knowledge.sensitivities,
            curvatures: knowledge.curvatures.as_deref(),
            peaks: &knowledge.peaks,
            past: &state.past,
        };
        let trail = state.history.iter().filter(|c| c.accepted).map(|c| c.design.clone()).collect();
        let subproblem_box = SubproblemBox::new(problem, trail, (region.lower.clone(), region.upper.clone()));
        let curvature = self.curvature.and_then(|c| c.fit(problem, &known, &state.multipliers()));
        let manner =
            ApproximationOptions { conservatism: state.guard.conservatism.clone(), drifting: self.drifting, curvature };
        ApproximateProblem::new(problem, &*self.approximation, known, knowledge.kept.clone(), (subproblem_box, manner))
    }

    /// The proposal held against its analysis.
    fn trial<'a>(
        &self,
        problem: &Problem,
        state: &'a State,
        knowledge: &CycleData,
        (proposal, distance): (&'a Solution, f64),
        at_limit: &'a [bool],
        analysed: Option<&(Responses, Evaluation)>,
    ) -> Trial<'a> {
        let approximate = Values { objective: proposal.objective, rows: proposal.rows.clone() };
        let compare =
            |(_, e): &(Responses, Evaluation)| Outcome::new(problem, &self.screening, &knowledge.kept, &approximate, e);
        let falls = |(_, e): &(Responses, Evaluation)| {
            let promise = (&approximate, &proposal.multipliers[..]);
            trial::falls_of_lagrangian(problem, &knowledge.kept, promise, [&state.evaluation, e])
        };
        Trial {
            lagrangian: analysed.map(falls),
            from: &state.design,
            to: &proposal.x,
            last_step: state.last_step.as_deref(),
            at_limit,
            objective_before: state.evaluation.objective,
            violation_before: state.evaluation.max_violation_pct().max(0.0) / 100.0,
            approximate_objective: proposal.objective,
            approximate_violation: knowledge.violation(problem, &proposal.rows),
            multipliers: proposal.multipliers.iter().map(|m| m.abs()).sum(),
            distance,
            outcome: analysed.map(compare),
        }
    }
}
