//! One cycle of the automatic method.

use super::acceptance::{Decision, widths_after_rejection};
use super::candidates::AcceptedPoint;
use super::convergence::{Optimality, StopTest, feasibility_factor, has_settled, largest_change, stalled};
use super::lengths::{spread, start_lengths, start_sizes};
use super::linearized::Linearized;
use super::proposal::Next;
use super::restoration::{is_incompatible, least_violation};
use super::situation::CycleContext;
use super::{Automatic, AutomaticState, noise, stationary};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Problem, RowId};
use crate::sao::{ActiveRow, Method, NOT_FINITE, RunState, Status};
use error::{Error, Result};

/// Number of designs whose extent is the first box of a run that is continued, and the least size of this box as a fraction of the lengths.
const RECENT: usize = 4;
const LEAST_WIDTH: f64 = 1e-3;

/// Steps in addition to the number of variables, and largest number of steps, from which quasi-Newton matrices of many variables are made.
const SURPLUS: usize = 10;
const MOST_STEPS: usize = 120;

/// The reason for the end of a run without progress.
const NO_PROGRESS: &str =
    "the last steps have changed the objective by rounding only, but the optimality conditions do not hold";

/// The message of a run that has stalled with forward differences.
const FORWARD: &str = "forward differences have an error of the order of their steps, and within it this may be an optimum: use central \
                       differences or a shorter step";

impl Automatic {
    /// One trial step, or the end of the run if the stop test holds before another analysis.
    pub(in crate::sao) fn step(&self, method: &Method, problem: &Problem, mut state: RunState) -> Result<RunState> {
        let (mut memory, data) = self.memory_of(method, problem, &mut state)?;
        let situation = CycleContext::new(self, problem, &state, &data, &memory);
        let next = match situation.propose() {
            Err(Error::NotFinite { .. }) => Next::End(Status::Stalled, NOT_FINITE.to_owned(), vec![]),
            next => next?,
        };
        let proposal = match next {
            Next::Analyse(proposal) => *proposal,
            Next::CommonUnit => {
                let widths = situation.units.lengths.clone();
                (memory.has_common_unit, memory.widths) = (true, widths);
                (state.automatic, state.data) = (Some(memory), Some(data));
                return self.step(method, problem, state);
            }
            Next::End(status, reason, active) => {
                (state.status, state.reason, state.active) = (status, reason, Some(active));
                (state.automatic, state.data) = (Some(memory), Some(data));
                return Ok(state);
            }
        };
        let examined = situation.examine(method, &proposal);
        if let Some(error) = examined.analyzed.as_ref().err().filter(|error| error.ends_run()) {
            return Err(error.clone());
        }
        let cycle = situation.record(method, &proposal, &examined);
        let changes = situation.changes(&proposal, &examined);
        let lengths = situation.units.lengths;
        let is_displaced = cycle.is_displaced;
        state.counters.analyses += 1;
        state.counters.sensitivity_analyses += examined.derivatives.iter().filter(|d| d.has_derivatives()).count();
        state.counters.subproblem_iterations += cycle.iterations;
        state.history.push(cycle);
        memory.update(changes);
        let is_accepted = examined.decision != Decision::Rejected;
        let next = match (examined.analyzed, examined.derivatives) {
            (Ok(accepted), Some(next)) if is_accepted => {
                state.advance(accepted, data.sensitivities, 0);
                self.store(problem, &state, &next, &mut memory);
                memory.points.iter_mut().last().into_iter().for_each(|point| point.is_displaced = is_displaced);
                next
            }
            (Ok(nearby), Some(found)) => {
                self.store_nearby(problem, &nearby, &found, &mut memory);
                data
            }
            _ if examined.missed.is_empty() => data,
            _ => {
                let retained = [data.retained, examined.missed].concat();
                match self.retain(method, problem, &mut state, &mut memory, retained) {
                    Ok(data) => data,
                    Err(error) => return state.without_derivatives(error),
                }
            }
        };
        state.factors = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        (state.automatic, state.data) = (Some(memory), Some(next));
        (state.status, state.reason) = method.stop.cycle_limit(&state);
        Ok(state)
    }

    /// The data of a state, taken from it; new ones if it has none.
    fn memory_of(
        &self,
        method: &Method,
        problem: &Problem,
        state: &mut RunState,
    ) -> Result<(AutomaticState, CycleData)> {
        match (state.automatic.take(), state.data.take()) {
            (Some(memory), Some(data)) => Ok((memory, data)),
            _ => self.begin(method, problem, state),
        }
    }

    /// Differentiates the design of a state without data of this method.
    fn begin(&self, method: &Method, problem: &Problem, state: &mut RunState) -> Result<(AutomaticState, CycleData)> {
        let RunState { design, responses, evaluation, .. } = &*state;
        let at =
            AnalyzedDesign { design: design.clone(), responses: responses.clone(), evaluation: evaluation.clone() };
        let data = method.differentiate(problem, &at)?;
        state.counters.sensitivity_analyses += usize::from(data.has_derivatives());
        let here = Linearized::new(problem, (&at.design, &at.responses, &at.evaluation), &data);
        let objective = state.evaluation.objective;
        // Another method may have left a variable that started at zero near zero.
        let start = state.history.first().map_or(&state.design, |start| &start.design);
        let sizes = match &state.start_sizes {
            _ if *start == state.design => start_sizes(start, objective, &here),
            Some(known) => known.clone(),
            None => start.iter().map(|b| b.abs()).collect(),
        };
        let (start_lengths, guessed) = start_lengths(problem, &sizes, objective, &here);
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
        state: &mut RunState,
        accuracy: f64,
    ) -> Result<Continuation> {
        let (mut memory, data) = self.begin(method, problem, state)?;
        for (j, width) in memory.widths.iter_mut().enumerate() {
            let last = memory.points.iter().rev().take(RECENT).map(|point| point.design[j]);
            *width = spread(last).clamp(LEAST_WIDTH * *width, *width);
        }
        let situation = CycleContext::new(self, problem, state, &data, &memory);
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
        state: &mut RunState,
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
        state: &mut RunState,
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
        state: &mut RunState,
        refused: &[f64],
    ) -> Result<()> {
        let (mut memory, data) = self.memory_of(method, problem, state)?;
        let step: Vec<f64> = refused.iter().zip(&state.design).map(|(to, from)| to - from).collect();
        widths_after_rejection(&mut memory.widths, &step, true);
        let lengths = CycleContext::new(self, problem, state, &data, &memory).units.lengths;
        state.factors = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        (state.automatic, state.data) = (Some(memory), Some(data));
        Ok(())
    }

    /// Sizes of the values of the current design if it is the start; zero for one that counts as zero.
    pub(in crate::sao) fn start_sizes(problem: &Problem, state: &RunState, data: &CycleData) -> Vec<f64> {
        let RunState { design, responses, evaluation, .. } = state;
        start_sizes(design, evaluation.objective, &Linearized::new(problem, (design, responses, evaluation), data))
    }

    /// Stores the current design with its numbers.
    fn store(&self, problem: &Problem, state: &RunState, data: &CycleData, memory: &mut AutomaticState) {
        let RunState { design, responses, evaluation, .. } = state;
        memory.points.push(AcceptedPoint::new(problem, (design, responses, evaluation), data));
        self.forget(problem, memory);
    }

    /// Stores a design near the current one, as the last but one.
    fn store_nearby(&self, problem: &Problem, nearby: &AnalyzedDesign, data: &CycleData, memory: &mut AutomaticState) {
        let AnalyzedDesign { design, responses, evaluation } = nearby;
        let point = AcceptedPoint::new(problem, (design, responses, evaluation), data);
        memory.points.insert(memory.points.len().saturating_sub(1), point);
        self.forget(problem, memory);
    }

    /// Removes the first stored designs if there are too many.
    fn forget(&self, problem: &Problem, memory: &mut AutomaticState) {
        let by_size = if problem.n() > self.memory { (problem.n() + SURPLUS).min(MOST_STEPS) } else { 0 };
        let surplus = memory.points.len().saturating_sub(self.memory.max(by_size) + 1);
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

impl CycleContext<'_> {
    /// The next step; the end of the run if the stop test holds or no step can be made.
    fn propose(&self) -> Result<Next> {
        let design = &self.state.design;
        let region = self.sides(&self.memory.widths);
        let least = least_violation(&self.here, &self.units, design, [&region.lower, &region.upper])?;
        let restoration = is_incompatible(least, self.violation).then_some(least);
        if restoration.is_some()
            && let Some(next) = self.stationary_violation(stationary::WIDE)?
        {
            return Ok(next);
        }
        let surrogate = self.chosen();
        let proposal = self.solve(&surrogate, self.domain(&surrogate), restoration)?;
        let step: Vec<f64> = proposal.design.iter().zip(design).map(|(to, from)| to - from).collect();
        let noise = self.noise(false);
        let stalled = noise.map(noise::in_words).or_else(|| {
            let reason = stalled(&step, &self.memory.widths, &self.units.lengths)?;
            let kink = || self.has_kink().then(|| noise::KINK.to_owned());
            Some(self.noise(true).map(noise::in_words).or_else(kink).unwrap_or(reason))
        });
        let (objectives, at_limit) = (self.objectives(), proposal.at_limit.contains(&true));
        let predicted = self.state.evaluation.objective - proposal.predicted.objective;
        let is_without_change = |is_without_progress| {
            restoration.is_none() && has_settled(&objectives, predicted, at_limit, is_without_progress)
        };
        let stalled = stalled.or_else(|| is_without_change(true).then(|| NO_PROGRESS.to_owned()));
        let λ = &proposal.solution.multipliers;
        let optimality = Optimality::new(self.problem, design, &self.here, λ, &self.units.lengths);
        let test = StopTest {
            is_feasible: self.is_feasible(1.0),
            is_compatible: restoration.is_none(),
            predicted,
            at_limit,
            is_last: stalled.is_some() || is_without_change(false),
            has_settled: is_without_change(false),
            largest_multiplier: self.largest_multiplier(&optimality.multipliers),
            optimality,
            objectives: &objectives,
            objective_range: self.units.objective_range,
            settled_range: self.state.trace().settled.width(),
            rejected_change: self.rejected_change(),
            tolerance: self.memory.tolerance,
            has_forward_differences: self.has_forward_differences(),
        };
        if self.is_flat_start() && !self.rises_evenly() {
            return Ok(Next::Analyse(Box::new(self.displacement(stationary::DISPLACEMENTS[0], |_| true))));
        }
        if let Some(reason) = test.converged() {
            let unexplored = self.unexplored(test.negligible(), test.has_settled);
            let end = || Next::End(Status::Converged, reason, self.active_rows(&test.optimality));
            return Ok(unexplored.map_or_else(end, |p| Next::Analyse(Box::new(p))));
        }
        let Some(reason) = stalled else { return Ok(Next::Analyse(Box::new(proposal))) };
        if noise.is_none()
            && let Some(next) = self.after_stalling(restoration)?
        {
            return Ok(next);
        }
        let reason = match test.unbounded_multipliers() {
            Some(reason) => reason,
            None if test.is_feasible => format!("{reason}; {}", test.optimality.in_words()),
            None => format!("no step reduces the violation further: {}", self.largest_violation_in_words()),
        };
        let reason = if test.has_forward_differences { format!("{reason}; {FORWARD}") } else { reason };
        Ok(Next::End(Status::Stalled, reason, self.active_rows(&test.optimality)))
    }

    /// True if the analysis is differentiated by forward differences, whose error is of the first order in their step.
    fn has_forward_differences(&self) -> bool {
        let needed = CycleData::needed(self.problem, &self.data.retained);
        self.problem.analysis.differentiation(self.n(), &needed) == Some("forward")
    }

    /// The rows with a multiplier.
    fn active_rows(&self, optimality: &Optimality) -> Vec<ActiveRow> {
        let rows = self.here.rows.iter().zip(&optimality.multipliers);
        rows.filter(|(_, λ)| **λ != 0.0).map(|(&row, &multiplier)| ActiveRow { row, multiplier }).collect()
    }
}
