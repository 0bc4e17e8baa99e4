//! One cycle of the automatic method.

mod exploration;
mod noise;
mod stationary;

use super::super::trial::{Proposal as Record, Trial};
use super::super::{Cycle, Method, Region, State, Status, Verdict};
use super::acceptance::{Decision, FilterEntry, Merit, Step, widths_after_acceptance, widths_after_rejection};
use super::candidates::{AcceptedPoint, Candidate, Model, Samples, gradient_changes};
use super::convergence::{
    Optimality, StopTest, feasibility_factor, is_feasible, is_feasible_by_itself, largest_change, stalled,
};
use super::lengths::{Units, spread, start_lengths};
use super::linearized::Linearized;
use super::numbers::{NumberGroup, collect, find};
use super::quasi_newton::{Pair, damped_bfgs};
use super::restoration::{is_incompatible, least_violation};
use super::selection::{Observation, ObservedLagrangian, discount};
use super::surrogate::{BoxedSurrogate, Surrogate};
use super::{Automatic, AutomaticState, RejectedPoint};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Evaluation, Problem, Responses, RowId};
use error::Result;
use nalgebra::{DMatrix, DVector};
use nlp::{Curvature, Solution, Sqp, SubproblemSolver};

/// Number of designs whose extent is the first box of a run that is continued, and its least part of the lengths.
const RECENT: usize = 4;
const LEAST_WIDTH: f64 = 1e-3;
/// Fraction of the half width within which a variable counts as at its move limit.
const AT_LIMIT: f64 = 1e-3;

/// The current design with everything that a cycle derives from it.
struct Situation<'a> {
    settings: &'a Automatic,
    problem: &'a Problem,
    state: &'a State,
    data: &'a CycleData,
    memory: &'a AutomaticState,
    here: Linearized,
    units: Units,
    violation: f64,
}

/// A proposed design and what is predicted there.
struct Proposal {
    design: Vec<f64>,
    region: Region,
    at_limit: Vec<bool>,
    solution: Solution,
    /// t*, if the linearized rows are incompatible.
    restoration: Option<f64>,
    predicted: Merit,
    purpose: Purpose,
}

/// The reason why a design is analysed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Purpose {
    Improvement,
    /// To see the curvature of the Lagrangian in a direction; accepted if it bends down.
    Curvature,
    /// To move along directions in which the Lagrangian has no curvature: a better design may be at their end; accepted if it does not rise.
    Flat,
    /// To leave a stationary point or to move a variable on which nothing depends; always accepted.
    Displacement,
}

/// The surrogate of a cycle: which models it has.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Kind {
    Linear,
    Mixture,
    Lagrangian,
}

impl Automatic {
    /// One trial step, or the end of the run if the stop test holds before another analysis.
    pub(in crate::sao) fn step(&self, method: &Method, problem: &Problem, mut state: State) -> Result<State> {
        let (mut memory, data) = match (state.automatic.take(), state.data.take()) {
            (Some(memory), Some(data)) => (memory, data),
            _ => self.begin(method, problem, &mut state)?,
        };
        let situation = Situation::new(self, problem, &state, &data, &memory);
        let proposal = match situation.propose()? {
            Next::Analyse(proposal) => *proposal,
            Next::End(status, reason) => {
                (state.status, state.reason) = (status, reason);
                (state.automatic, state.data) = (Some(memory), Some(data));
                return Ok(state);
            }
        };
        let mut analyzed = problem.analyze_design(&proposal.design);
        let mut decision = analyzed.as_ref().map_or(Decision::Rejected, |a| situation.decide(&proposal, a));
        let missed = match &analyzed {
            Ok(next) if decision != Decision::Rejected => {
                method.screening.missed(problem, &data.retained, &next.evaluation, false)
            }
            _ => vec![],
        };
        if !missed.is_empty() {
            // It was not predicted: the step is repeated with these rows.
            decision = Decision::Rejected;
        }
        let mut differentiated = None;
        // The derivatives of a step that was made to see a curvature show more of it than its value.
        let is_wanted = decision != Decision::Rejected || (missed.is_empty() && situation.shows_curvature(&proposal));
        if let (Ok(a), true) = (&analyzed, is_wanted) {
            match method.differentiate(problem, a) {
                Ok(found) => differentiated = Some(found),
                Err(error) => (analyzed, decision) = (Err(error), Decision::Rejected),
            }
        }
        let ratio = analyzed.as_ref().map_or(f64::NAN, |a| situation.step(&proposal, a).ratio());
        let mut scores = memory.scores.clone();
        if let Ok(a) = &analyzed {
            situation.score(&proposal, a, differentiated.as_ref(), &mut scores);
        }
        let numbers = analyzed.as_ref().ok().map(|a| situation.rejected(a));
        let entry = situation.filter_entry();
        let (lengths, violation) = (situation.units.lengths.clone(), situation.violation);
        let is_flat_start = situation.is_flat_start();
        // What follows changes the state.
        let factors: Vec<f64> = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        let step: Vec<f64> = proposal.design.iter().zip(&state.design).map(|(to, from)| to - from).collect();
        let purpose = proposal.purpose;
        let explorations = situation.explorations_after(purpose, decision != Decision::Rejected);
        let Proposal { region, at_limit, solution, .. } = proposal;
        let record = Record { data: &data, region, solution, distance: 0.0, at_limit, analyzed };
        let verdict = if decision == Decision::Rejected { Verdict::Reject } else { Verdict::Accept };
        let from = (&state.design[..], &state.evaluation);
        let trial = Trial::new(problem, &method.screening, from, state.last_step.as_deref(), &record);
        let mut cycle = Cycle::new(problem, state.cycles() + 1, &factors, &trial, verdict, &record);
        drop(trial);
        cycle.residual = None;
        let is_displaced = cycle.accepted && purpose != Purpose::Improvement;
        cycle.is_displaced = is_displaced;
        let Record { at_limit, analyzed, .. } = record;
        memory.explorations = explorations;
        state.counters.analyses += 1;
        state.counters.subproblem_iterations += cycle.iterations;
        state.history.push(cycle);
        memory.scores = scores;
        match (analyzed, differentiated) {
            (Ok(accepted), Some(next)) if verdict == Verdict::Accept => {
                if decision == Decision::Violation {
                    memory.filter.push(entry);
                }
                if purpose == Purpose::Improvement {
                    widths_after_acceptance(&mut memory.widths, &step, &at_limit, ratio);
                } else {
                    let left = purpose == Purpose::Displacement && violation > 0.0;
                    memory.left.extend(left.then(|| state.evaluation.violations()));
                    memory.filter.clear();
                    let shortening = if is_flat_start { stationary::shortening(memory.rejections) } else { 1.0 };
                    memory
                        .widths
                        .iter_mut()
                        .zip(&lengths)
                        .for_each(|(w, l)| *w = w.max(stationary::DISPLACEMENTS[0] * shortening * l));
                }
                (memory.rejections, memory.rejected) = (0, vec![]);
                state.counters.sensitivity_analyses += usize::from(next.has_derivatives());
                state.advance(accepted, data.sensitivities, 0);
                self.store(problem, &state, &next, &mut memory);
                memory.points.last_mut().expect("it was stored").is_displaced = is_displaced;
                state.data = Some(next);
            }
            (Ok(beside), Some(found)) => {
                state.counters.sensitivity_analyses += usize::from(found.has_derivatives());
                let AnalyzedDesign { design, responses, evaluation } = &beside;
                let here = memory.points.len() - 1;
                memory.points.insert(here, AcceptedPoint::new(problem, (design, responses, evaluation), &found));
                self.forget(&mut memory);
                state.data = Some(data);
            }
            _ if !missed.is_empty() => {
                let retained = [data.retained, missed].concat();
                state.data = Some(self.retain(method, problem, &mut state, &mut memory, retained)?);
            }
            _ if matches!(purpose, Purpose::Curvature | Purpose::Flat) => state.data = Some(data),
            (analyzed, _) => {
                widths_after_rejection(&mut memory.widths, &step, analyzed.is_ok() && memory.rejections == 0);
                memory.rejections += 1;
                memory.rejected.extend(numbers);
                state.data = Some(data);
            }
        }
        state.factors = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        state.automatic = Some(memory);
        (state.status, state.reason) = method.stop.cycle_limit(&state);
        Ok(state)
    }

    /// Differentiates the design of a state without data of this method.
    fn begin(&self, method: &Method, problem: &Problem, state: &mut State) -> Result<(AutomaticState, CycleData)> {
        let State { design, responses, evaluation, .. } = &*state;
        let at =
            AnalyzedDesign { design: design.clone(), responses: responses.clone(), evaluation: evaluation.clone() };
        let data = method.differentiate(problem, &at)?;
        state.counters.sensitivity_analyses += usize::from(data.has_derivatives());
        let here = Linearized::new(problem, (&at.design, &at.responses, &at.evaluation), &data);
        // Another method may have left a variable that started at zero beside it.
        let start = state.history.first().map_or(&state.design, |start| &start.design);
        let (start_lengths, guessed) = start_lengths(problem, start, state.evaluation.objective, &here);
        let (widths, points) = (start_lengths.clone(), std::mem::take(&mut state.points));
        let mut memory = AutomaticState { widths, start_lengths, guessed, points, ..Default::default() };
        self.store(problem, state, &data, &mut memory);
        Ok((memory, data))
    }

    /// Prepares a state without data of this method for [`step`](Self::step), in a box of the extent of its last designs. The
    /// accuracy is that of the run that is continued.
    pub(in crate::sao) fn begin_at(
        &self,
        method: &Method,
        problem: &Problem,
        state: &mut State,
        accuracy: f64,
    ) -> Result<Continuation> {
        let (mut memory, data) = self.begin(method, problem, state)?;
        for (j, width) in memory.widths.iter_mut().enumerate() {
            let last = memory.points.iter().rev().take(RECENT).map(|point| point.design[j]);
            *width = spread(last).clamp(LEAST_WIDTH * *width, *width);
        }
        let situation = Situation::new(self, problem, state, &data, &memory);
        let is_feasible = situation.is_feasible(feasibility_factor(accuracy));
        let largest_change = largest_change(&situation.here.slope, &situation.units.lengths);
        (state.automatic, state.data) = (Some(memory), Some(data));
        Ok(Continuation { is_feasible, largest_change })
    }

    /// Differentiates the current design again with other retained rows, and stores it with them.
    fn retain(
        &self,
        method: &Method,
        problem: &Problem,
        state: &mut State,
        memory: &mut AutomaticState,
        retained: Vec<RowId>,
    ) -> Result<CycleData> {
        let data = method.differentiate_rows(problem, state, retained)?;
        memory.points.pop();
        // The rejected designs have the numbers of other rows.
        memory.rejected.clear();
        self.store(problem, state, &data, memory);
        Ok(data)
    }

    /// Makes a rejected design, which is analysed, that of the state; `data` belongs to the design before it.
    pub(in crate::sao) fn accept(
        &self,
        method: &Method,
        problem: &Problem,
        state: &mut State,
        (accepted, data): (AnalyzedDesign, CycleData),
    ) -> Result<()> {
        let (mut memory, data) = match state.automatic.take() {
            Some(memory) => (memory, data),
            None => self.begin(method, problem, state)?,
        };
        let next = method.differentiate(problem, &accepted)?;
        state.counters.sensitivity_analyses += usize::from(next.has_derivatives());
        memory.filter.clear();
        (memory.rejections, memory.rejected) = (0, vec![]);
        state.advance(accepted, data.sensitivities, 0);
        self.store(problem, state, &next, &mut memory);
        (state.automatic, state.data) = (Some(memory), Some(next));
        Ok(())
    }

    /// Limits the next step to half the one to a `refused` design.
    pub(in crate::sao) fn narrow(
        &self,
        method: &Method,
        problem: &Problem,
        state: &mut State,
        refused: &[f64],
    ) -> Result<()> {
        let (mut memory, data) = match (state.automatic.take(), state.data.take()) {
            (Some(memory), Some(data)) => (memory, data),
            _ => self.begin(method, problem, state)?,
        };
        let step: Vec<f64> = refused.iter().zip(&state.design).map(|(to, from)| to - from).collect();
        widths_after_rejection(&mut memory.widths, &step, true);
        let lengths = Situation::new(self, problem, state, &data, &memory).units.lengths;
        state.factors = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        (state.automatic, state.data) = (Some(memory), Some(data));
        Ok(())
    }

    /// Stores the current design with its numbers.
    fn store(&self, problem: &Problem, state: &State, data: &CycleData, memory: &mut AutomaticState) {
        let State { design, responses, evaluation, .. } = state;
        memory.points.push(AcceptedPoint::new(problem, (design, responses, evaluation), data));
        self.forget(memory);
    }

    /// Removes the first stored designs if there are too many.
    fn forget(&self, memory: &mut AutomaticState) {
        let surplus = memory.points.len().saturating_sub(self.memory + 1);
        memory.points.drain(..surplus);
    }
}

/// The design where a run of another method is continued.
pub(in crate::sao) struct Continuation {
    /// True if it is feasible, to the accuracy of the run.
    pub is_feasible: bool,
    /// Σ |∂F/∂bⱼ| ℓⱼ.
    pub largest_change: f64,
}

impl AcceptedPoint {
    /// A design with its responses and evaluation, whose retained rows are differentiated.
    pub(in crate::sao) fn new(problem: &Problem, at: (&[f64], &Responses, &Evaluation), data: &CycleData) -> Self {
        let (design, responses, evaluation) = at;
        let slopes = Linearized::new(problem, at, data).slopes(problem.constraints.len());
        let numbers = collect(problem, design, (responses, evaluation), data);
        Self { design: design.to_vec(), numbers, slopes, is_displaced: false }
    }
}

/// The next action of a run.
enum Next {
    Analyse(Box<Proposal>),
    End(Status, String),
}

impl<'a> Situation<'a> {
    fn new(
        settings: &'a Automatic,
        problem: &'a Problem,
        state: &'a State,
        data: &'a CycleData,
        memory: &'a AutomaticState,
    ) -> Self {
        let units = Units::new(memory, &state.trace(), &state.evaluation);
        let violation = units.violation(&state.evaluation.violations());
        let here = Linearized::new(problem, (&state.design, &state.responses, &state.evaluation), data);
        Self { settings, problem, state, data, memory, here, units, violation }
    }

    fn n(&self) -> usize {
        self.state.design.len()
    }

    /// Multipliers of the retained rows in the last accepted step; zero at the start.
    fn last_multipliers(&self) -> Vec<f64> {
        let known = self.state.multipliers();
        let of = |row| known.iter().find(|(r, _)| r == row).map_or(0.0, |(_, λ)| *λ);
        self.here.rows.iter().map(of).collect()
    }

    fn samples(&self, k: usize) -> Samples<'_> {
        Samples::new(self.problem, &self.memory.points, k, &self.units.lengths)
    }

    fn current(&self) -> &AcceptedPoint {
        self.memory.points.last().expect("the current design is stored")
    }

    /// True at a feasible start where the objective has no slope at all: it may as well be a maximum or a saddle point.
    fn is_flat_start(&self) -> bool {
        let trace = self.state.trace();
        let is_start = self.state.design.iter().enumerate().all(|(j, &b)| trace.designs.extent(j) == [b; 2]);
        is_start && self.violation == 0.0 && self.here.slope.iter().all(|g| *g == 0.0)
    }

    /// True if a converged design may have the violation here; the limits are those of the automatic method times `factor`.
    fn is_feasible(&self, factor: f64) -> bool {
        let violations = self.state.evaluation.violations();
        let in_terms = self.units.violation_in_terms(&violations, self.current(), &self.memory.start_lengths);
        let is_own = |(v, slopes): (&f64, &Vec<f64>)| {
            is_feasible_by_itself(*v, slopes, (&self.state.design, &self.units.lengths), factor)
        };
        is_feasible(self.violation, in_terms, factor) && violations.iter().zip(&self.current().slopes).all(is_own)
    }

    /// Objectives of the last accepted designs without excursions, and of the current one, which is the last.
    fn objectives(&self) -> Vec<f64> {
        let (mut objectives, current) = (self.state.trace().objectives.clone(), self.state.evaluation.objective);
        if objectives.last() != Some(&current) {
            objectives.push(current);
        }
        objectives
    }

    /// The last stored designs, the newest first, without the first one and those to which the run was displaced.
    fn last_points(&self, count: usize) -> impl Iterator<Item = &AcceptedPoint> {
        self.memory.points.iter().skip(1).rev().filter(|point| !point.is_displaced).take(count)
    }

    /// Largest change of the objective by a row, |λᵢ| Σ |∂cᵢ/∂bⱼ| ℓⱼ, with its slopes at the last designs.
    fn largest_multiplier(&self, multipliers: &[f64]) -> f64 {
        let change = |point: &AcceptedPoint| {
            let one =
                |(λ, row): (&f64, &RowId)| λ.abs() * largest_change(&point.slopes[row.constraint], &self.units.lengths);
            multipliers.iter().zip(&self.here.rows).map(one).fold(0.0, f64::max)
        };
        self.last_points(RECENT).map(change).fold(0.0, f64::max)
    }

    /// The surrogate of this kind at the current design; `None` for the Lagrangian before a step along which it bends up.
    fn surrogate(&self, kind: Kind) -> Option<Surrogate<'_>> {
        let numbers = &self.current().numbers;
        let model = |k: usize| -> Model {
            let samples = self.samples(k);
            let candidate = match kind {
                Kind::Mixture => self.memory.scores.choose(numbers[k].id.group()),
                Kind::Linear | Kind::Lagrangian => Candidate::Linear,
            };
            let fitted = samples.fit(candidate).or_else(|| samples.fit(Candidate::Linear));
            fitted.expect("a linear candidate needs the current gradient only")
        };
        let models = (0..numbers.len()).map(model).collect();
        let at = (&self.state.design[..], &self.state.responses);
        let mut surrogate = Surrogate::new(self.problem, at, self.data, numbers, models);
        if kind == Kind::Lagrangian {
            surrogate.hessian = Some(self.lagrangian_matrix()?);
        }
        Some(surrogate)
    }

    /// The weight of each number in the Lagrangian L = F + Σ λᵢ cᵢ at the current design.
    fn lagrangian_weights(&self, multipliers: &[f64]) -> Vec<f64> {
        let surrogate = self.surrogate(Kind::Linear).expect("only the Lagrangian may be missing");
        let values: Vec<f64> = self.current().numbers.iter().map(|number| number.value).collect();
        surrogate.number_weights(multipliers, &values)
    }

    /// The steps between the stored designs and the changes of ∂L/∂b along them, in lengths, with these weights of the numbers in L.
    fn lagrangian_steps(&self, weights: &[f64]) -> Vec<Pair> {
        let (n, points) = (self.n(), &self.memory.points);
        let mut changes = vec![vec![0.0; n]; points.len() - 1];
        for (number, weight) in self.current().numbers.iter().zip(weights).filter(|(_, w)| **w != 0.0) {
            for (sum, change) in changes.iter_mut().zip(gradient_changes(self.problem, points, number)) {
                let change = change.unwrap_or_else(|| vec![0.0; n]);
                sum.iter_mut().zip(change).for_each(|(s, c)| *s += weight * c);
            }
        }
        let l = &self.units.lengths;
        let pair = |(ends, change): (&[AcceptedPoint], &Vec<f64>)| {
            let step = DVector::from_fn(n, |j, _| (ends[1].design[j] - ends[0].design[j]) / l[j]);
            [step, DVector::from_fn(n, |j, _| change[j] * l[j])]
        };
        points.windows(2).zip(&changes).map(pair).collect()
    }

    /// Those that are not zero.
    fn lagrangian_pairs(&self, weights: &[f64]) -> Vec<Pair> {
        let mut pairs = self.lagrangian_steps(weights);
        pairs.retain(|[step, _]| step.norm() > 0.0);
        pairs
    }

    /// The damped BFGS matrix of the Lagrangian; `None` before a step along which it bends up.
    fn lagrangian_matrix(&self) -> Option<DMatrix<f64>> {
        let scaled = damped_bfgs(&self.lagrangian_pairs(&self.lagrangian_weights(&self.last_multipliers())))?;
        let (n, l) = (self.n(), &self.units.lengths);
        Some(DMatrix::from_fn(n, n, |i, j| scaled[(i, j)] / l[i] / l[j]))
    }

    /// The surrogate that the scores choose, with corrections through the rejected designs.
    fn chosen(&self) -> Surrogate<'_> {
        let lagrangian = if self.memory.scores.prefers_lagrangian() { self.surrogate(Kind::Lagrangian) } else { None };
        let mut surrogate =
            lagrangian.unwrap_or_else(|| self.surrogate(Kind::Mixture).expect("only the Lagrangian may be missing"));
        for point in &self.memory.rejected {
            surrogate.correct(&point.design, &point.values, &self.units.lengths);
        }
        surrogate
    }

    /// The sides of a box of half widths `widths` in the design space.
    fn sides(&self, widths: &[f64]) -> Region {
        Region::around(self.problem, &self.state.design, widths)
    }

    fn propose(&self) -> Result<Next> {
        let design = &self.state.design;
        let region = self.sides(&self.memory.widths);
        let least = least_violation(&self.here, &self.units, design, [&region.lower, &region.upper])?;
        let restoration = is_incompatible(least, self.violation).then_some(least);
        if restoration.is_some()
            && let Some(next) = self.stationary_violation()?
        {
            return Ok(next);
        }
        let surrogate = self.chosen();
        let proposal = self.solve(&surrogate, self.domain(&surrogate), restoration)?;
        let step: Vec<f64> = proposal.design.iter().zip(design).map(|(to, from)| to - from).collect();
        let noise = self.noise();
        let stalled = noise.map(noise::in_words).or_else(|| stalled(&step, &self.memory.widths, &self.units.lengths));
        let objectives = self.objectives();
        let λ = &proposal.solution.multipliers;
        let optimality = Optimality::new(self.problem, design, &self.here, λ, &self.units.lengths);
        let test = StopTest {
            is_feasible: self.is_feasible(1.0),
            is_compatible: restoration.is_none(),
            predicted: self.state.evaluation.objective - proposal.predicted.objective,
            at_limit: proposal.at_limit.contains(&true),
            is_last: stalled.is_some(),
            largest_multiplier: self.largest_multiplier(&optimality.multipliers),
            optimality,
            objectives: &objectives,
            objective_range: self.units.objective_range,
            rejected_change: self.rejected_change(),
            tolerance: self.memory.tolerance,
        };
        if self.is_flat_start() {
            return Ok(Next::Analyse(Box::new(self.displacement(stationary::DISPLACEMENTS[0], |_| true))));
        }
        if let Some(reason) = test.converged() {
            let unexplored = self.unexplored(test.negligible());
            return Ok(unexplored.map_or(Next::End(Status::Converged, reason), |p| Next::Analyse(Box::new(p))));
        }
        let Some(reason) = stalled else { return Ok(Next::Analyse(Box::new(proposal))) };
        if noise.is_none()
            && let Some(other) = self.after_stalling(restoration)?
        {
            return Ok(Next::Analyse(Box::new(other)));
        }
        Ok(Next::End(Status::Stalled, test.unbounded_multipliers().unwrap_or(reason)))
    }

    /// The box of the next step, inside the domain of a surrogate.
    fn domain(&self, surrogate: &Surrogate) -> Region {
        let mut region = self.sides(&self.memory.widths);
        for j in 0..self.n() {
            let lower = surrogate.lower(j).min(self.state.design[j]);
            if lower > region.lower[j] {
                (region.lower[j], region.is_limit[j][0]) = (lower, true);
            }
        }
        region
    }

    /// Solves the surrogate in its box.
    fn solve(&self, surrogate: &Surrogate, region: Region, restoration: Option<f64>) -> Result<Proposal> {
        let unit = |row: &RowId| self.units.rows[row.constraint];
        // Rounding must not make the relaxed rows contradictory.
        let relaxed =
            |t: f64| -> Vec<f64> { self.here.rows.iter().map(|r| unit(r) * (t * (1.0 + 1e-7) + 1e-10)).collect() };
        let relaxation = restoration.map(relaxed);
        let objective = self.state.evaluation.objective;
        let widths: Vec<f64> = (0..self.n())
            .map(|j| {
                let d = self.state.design[j];
                let reach = (region.upper[j] - d).max(d - region.lower[j]);
                if reach > 0.0 { reach } else { self.units.lengths[j] }
            })
            .collect();
        let sides = [&region.lower[..], &region.upper[..]];
        let program =
            BoxedSurrogate::new(surrogate, &widths, sides, &self.here.equality, relaxation.clone(), objective);
        let sqp = Sqp::default().with_curvature(Curvature::Absolute).with_iterations(self.settings.iterations)?;
        let solver = nlp::Automatic::default().with_sqp(sqp);
        let found = solver.solve(&program, &vec![1.0; self.n()])?;
        let design: Vec<f64> = program
            .design(&found.x)
            .into_iter()
            .zip(region.lower.iter().zip(&region.upper))
            .map(|(x, (l, u))| x.clamp(*l, *u))
            .collect();
        let values = surrogate.values(&design);
        let at_limit = self.at_limit(&design, &region);
        Ok(Proposal {
            predicted: self.merit(values.objective, &values.rows),
            restoration,
            purpose: Purpose::Improvement,
            at_limit,
            solution: Solution {
                x: design.clone(),
                objective: values.objective,
                multipliers: program.multipliers(&found.multipliers),
                rows: values.rows,
                relaxation: relaxation.map(|t| t.into_iter().fold(0.0, f64::max)),
                relaxed_rows: vec![],
                ..found
            },
            region,
            design,
        })
    }

    /// The merit with these values of the objective and the retained rows.
    fn merit(&self, objective: f64, rows: &[f64]) -> Merit {
        let mut violations = vec![f64::NEG_INFINITY; self.problem.constraints.len()];
        for ((row, c), equality) in self.here.rows.iter().zip(rows).zip(&self.here.equality) {
            let v = &mut violations[row.constraint];
            *v = v.max(if *equality { c.abs() } else { *c });
        }
        Merit::new(objective, &violations, &self.units)
    }

    /// Marks the variables that are at a move limit.
    fn at_limit(&self, design: &[f64], region: &Region) -> Vec<bool> {
        let one = |j: usize| {
            let here = self.state.design[j];
            let near = AT_LIMIT * (region.upper[j] - here).max(here - region.lower[j]);
            (region.is_limit[j][0] && design[j] - region.lower[j] <= near)
                || (region.is_limit[j][1] && region.upper[j] - design[j] <= near)
        };
        (0..self.n()).map(one).collect()
    }

    fn step(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> Step {
        let evaluation = &analyzed.evaluation;
        let rows = self.here.rows.iter().map(|row| row.constraint);
        let weighted = proposal.solution.multipliers.iter().copied().zip(rows);
        Step {
            from: Merit { objective: self.state.evaluation.objective, violation: self.violation },
            predicted: proposal.predicted,
            to: Merit::new(evaluation.objective, &evaluation.violations(), &self.units),
            restoration: proposal.restoration,
            objective_per_violation: self.units.objective_per_violation(weighted),
        }
    }

    fn decide(&self, proposal: &Proposal, analyzed: &AnalyzedDesign) -> Decision {
        match proposal.purpose {
            Purpose::Improvement => {}
            Purpose::Curvature | Purpose::Flat if !self.leads_on(proposal, analyzed) => return Decision::Rejected,
            // The lengths of variables that start at zero are guesses.
            Purpose::Displacement
                if self.is_flat_start()
                    && self.memory.rejections < stationary::SIZES
                    && analyzed.evaluation.objective > self.state.evaluation.objective =>
            {
                return Decision::Rejected;
            }
            Purpose::Curvature | Purpose::Flat | Purpose::Displacement => return Decision::Decrease,
        }
        let filter = self.memory.filter.iter().map(|e| Merit::new(e.objective, &e.violations, &self.units));
        self.step(proposal, analyzed).decide(filter)
    }

    /// The largest change of the objective by a rejected step from the current design.
    fn rejected_change(&self) -> f64 {
        let rejected = self.state.history.iter().rev().take_while(|cycle| !cycle.accepted);
        let change = |cycle: &Cycle| (cycle.objective - self.state.evaluation.objective).abs();
        rejected.map(change).filter(|change| change.is_finite()).fold(0.0, f64::max)
    }

    fn filter_entry(&self) -> FilterEntry {
        let evaluation = &self.state.evaluation;
        FilterEntry { objective: evaluation.objective, violations: evaluation.violations() }
    }

    fn rejected(&self, analyzed: &AnalyzedDesign) -> RejectedPoint {
        let value = |n: &super::Number| n.id.value(&analyzed.responses, &analyzed.evaluation);
        RejectedPoint { design: analyzed.design.clone(), values: self.current().numbers.iter().map(value).collect() }
    }

    /// Updates the scores by the prediction errors of all candidates at an analysed design, whose derivatives are known if it
    /// was accepted.
    fn score(
        &self,
        proposal: &Proposal,
        analyzed: &AnalyzedDesign,
        derivatives: Option<&CycleData>,
        scores: &mut super::Scores,
    ) {
        let numbers = &self.current().numbers;
        let AnalyzedDesign { design, responses, evaluation } = analyzed;
        let found = derivatives.map(|data| collect(self.problem, design, (responses, evaluation), data));
        let observed = numbers.iter().map(|number| {
            let there = found.as_ref().and_then(|found| find(self.problem, found, number.id));
            let value = number.id.value(responses, evaluation);
            (value, there.map_or_else(Vec::new, |there| there.gradient.clone()))
        });
        let origin = &self.state.design;
        let observation = Observation::new(design, origin, &self.units.lengths, observed.collect());
        let samples: Vec<Samples> = (0..numbers.len()).map(|k| self.samples(k)).collect();
        let mut groups: Vec<(NumberGroup, Vec<usize>)> = vec![];
        for (k, number) in numbers.iter().enumerate() {
            match groups.iter_mut().find(|(group, _)| *group == number.id.group()) {
                Some((_, members)) => members.push(k),
                None => groups.push((number.id.group(), vec![k])),
            }
        }
        let weights = &observation.weights;
        if let Some(lagrangian) = self.observed_lagrangian(proposal, analyzed, derivatives) {
            let λ = &proposal.solution.multipliers;
            let error = |surrogate: &Surrogate| lagrangian.error(&surrogate.gradients(design), λ, weights);
            let linear = self.surrogate(Kind::Linear).map_or(0.0, |s| error(&s));
            let of = |kind| {
                let surrogate = self.surrogate(kind)?;
                Some(lagrangian.quotient(error(&surrogate), linear, surrogate.is_defined(design)))
            };
            let (mixture, whole) = (of(Kind::Mixture), of(Kind::Lagrangian));
            discount(&mut scores.mixture, mixture);
            discount(&mut scores.lagrangian, whole);
        }
        for (group, members) in groups {
            let current = (&numbers[..], &origin[..]);
            scores.update(group, observation.quotients(&members, current, |k, candidate| samples[k].fit(candidate)));
        }
    }

    /// The Lagrangian at an analysed design with the multipliers of the subproblem.
    fn observed_lagrangian(
        &self,
        proposal: &Proposal,
        analyzed: &AnalyzedDesign,
        derivatives: Option<&CycleData>,
    ) -> Option<ObservedLagrangian> {
        let λ = &proposal.solution.multipliers;
        let rows = self.here.rows.iter().zip(λ).filter(|(_, λ)| **λ != 0.0);
        let sum: f64 = rows.map(|(row, λ)| λ * (analyzed.evaluation.value_of(*row) - 1.0)).sum();
        let value = analyzed.evaluation.objective + sum;
        let gradient = derivatives.and_then(|data| {
            let AnalyzedDesign { design, responses, evaluation } = analyzed;
            let there = Linearized::new(self.problem, (design, responses, evaluation), data);
            let of = |row: &RowId| there.rows.iter().position(|r| r == row);
            let mut multipliers = vec![0.0; there.rows.len()];
            for (row, λ) in self.here.rows.iter().zip(λ).filter(|(_, λ)| **λ != 0.0) {
                multipliers[of(row)?] = *λ;
            }
            Some(there.lagrangian_slope(&multipliers))
        });
        Some(ObservedLagrangian { value, gradient })
    }
}
