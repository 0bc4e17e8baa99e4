//! One cycle of the automatic method.

use super::acceptance::{Decision, widths_after_rejection};
use super::analyzed_proposal::AnalyzedProposal;
use super::candidates::AcceptedPoint;
use super::convergence::{
    Optimality, StopTest, feasibility_factor, has_settled, largest_change, largest_share, stalled,
};
use super::cycle_context::CycleContext;
use super::displacement::DISPLACEMENTS;
use super::lengths::{StartLengths, is_identity, spread, start_lengths, start_sizes};
use super::linearized::Linearized;
use super::proposal::{Next, Proposal};
use super::restoration::{is_incompatible, least_violation};
use super::stationary::WIDE;
use super::{Automatic, AutomaticState, noise};
use crate::approximation::CycleData;
use crate::problem::{AnalyzedDesign, Problem, RowId};
use crate::sao::{ActiveRow, Method, NOT_FINITE, RunState, Status};
use error::{Error, Result};

/// Number of designs whose extent is the first box of a run that is continued, and the least size of this box as a fraction of the lengths.
const RECENT: usize = 4;
const LEAST_WIDTH: f64 = 1e-3;

/// Steps in addition to the number of variables, and largest number of steps, from which quasi-Newton matrices of many variables are made.
const SURPLUS: usize = 10;
const MAX_STEPS: usize = 120;

/// Factor of a box in which the approximate problem is not finite, and the largest share of the lengths below which it is not reduced further.
const SMALLER_BOX: f64 = 0.25;
const SMALLEST_BOX: f64 = 1e-6;

/// The reason for the end of a run without progress.
const NO_PROGRESS: &str =
    "the last steps have changed the objective by rounding only, but this does not confirm the design as a solution";

/// The message of a run that has stalled with forward differences.
const FORWARD: &str = "forward differences have an error of the order of their steps, and within it this may be an optimum: use central \
                       differences or a shorter step";

impl Automatic {
    /// One trial step, or the end of the run if the stop test holds before another analysis.
    pub(in crate::sao) fn step(&self, method: &Method, problem: &Problem, mut state: RunState) -> Result<RunState> {
        let (mut memory, data) = self.memory_of(method, problem, &mut state)?;
        let context = CycleContext::new(self, problem, &state, &data, &memory);
        let next = match context.propose() {
            // A quantity such as the time of a crossing may exist close to the design only.
            Err(Error::NotFinite { .. }) if largest_share(&memory.widths, &context.units.lengths) > SMALLEST_BOX => {
                memory.widths.iter_mut().for_each(|width| *width *= SMALLER_BOX);
                (state.automatic, state.data) = (Some(memory), Some(data));
                return self.step(method, problem, state);
            }
            Err(Error::NotFinite { .. }) => Next::End(Status::Stalled, NOT_FINITE.to_owned(), vec![]),
            next => next?,
        };
        let proposal = match next {
            Next::Analyse(proposal) => *proposal,
            Next::CommonUnit => {
                let widths = context.units.lengths.clone();
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
        let trial = context.analyze_proposal(method, &proposal);
        if let Some(error) = trial.analyzed.as_ref().err().filter(|error| error.ends_run()) {
            return Err(error.clone());
        }
        let cycle = context.record(method, &proposal, &trial);
        let changes = context.changes(&proposal, &trial);
        let lengths = context.units.lengths;
        state.counters.analyses += 1;
        state.counters.sensitivity_analyses += trial.derivatives.iter().filter(|d| d.has_derivatives()).count();
        state.counters.subproblem_iterations += cycle.iterations;
        state.history.push(cycle);
        memory.update(changes);
        let next = match self.store_trial(method, problem, (&mut state, &mut memory), trial, data) {
            Ok(next) => next,
            Err(error) => return state.without_derivatives(error),
        };
        state.factors = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        (state.automatic, state.data) = (Some(memory), Some(next));
        (state.status, state.reason) = method.stop.cycle_limit(&state);
        Ok(state)
    }

    /// Stores the design of a trial step and makes it the current one if it was accepted. Returns the data of the current design.
    fn store_trial(
        &self,
        method: &Method,
        problem: &Problem,
        (state, memory): (&mut RunState, &mut AutomaticState),
        trial: AnalyzedProposal,
        data: CycleData,
    ) -> Result<CycleData> {
        match (trial.analyzed, trial.derivatives) {
            (Ok(accepted), Some(next)) if trial.decision != Decision::Rejected => {
                state.advance(accepted, data.sensitivities, 0);
                self.store(problem, state, &next, memory);
                let is_displaced = state.history.last().is_some_and(|cycle| cycle.is_displaced);
                memory.points.iter_mut().last().into_iter().for_each(|point| point.is_displaced = is_displaced);
                Ok(next)
            }
            (Ok(nearby), Some(found)) => {
                self.store_nearby(problem, &nearby, &found, memory);
                Ok(data)
            }
            _ if trial.missed.is_empty() => Ok(data),
            _ => self.retain(method, problem, state, memory, [data.retained, trial.missed].concat()),
        }
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
        let StartLengths { lengths: start_lengths, guessed } = Self::lengths(problem, state, &data);
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
        let context = CycleContext::new(self, problem, state, &data, &memory);
        let is_feasible = context.is_feasible(feasibility_factor(accuracy));
        let largest_change = largest_change(&context.linearized.gradient, &context.units.lengths);
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

    /// Makes the analysed design of a rejected step the current one; `data` belongs to the design before it.
    pub(in crate::sao) fn accept_rejected_step(
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

    /// Limits the next step to half the one to a `rejected` design.
    pub(in crate::sao) fn shorten_next_step(
        &self,
        method: &Method,
        problem: &Problem,
        state: &mut RunState,
        rejected: &[f64],
    ) -> Result<()> {
        let (mut memory, data) = self.memory_of(method, problem, state)?;
        let step: Vec<f64> = rejected.iter().zip(&state.design).map(|(to, from)| to - from).collect();
        widths_after_rejection(&mut memory.widths, &step, true);
        let lengths = CycleContext::new(self, problem, state, &data, &memory).units.lengths;
        state.factors = memory.widths.iter().zip(&lengths).map(|(w, l)| w / l).collect();
        (state.automatic, state.data) = (Some(memory), Some(data));
        Ok(())
    }

    /// The start lengths of a run. Slopes at its end do not determine them: another method may have left a variable that started at zero
    /// near zero, and margins vanish there.
    pub(in crate::sao) fn lengths(problem: &Problem, state: &RunState, data: &CycleData) -> StartLengths {
        let RunState { design, responses, evaluation, start_lengths: known, .. } = state;
        let start = state.history.first().map_or(design, |start| &start.design);
        if let Some(known) = known.as_ref().filter(|_| start != design) {
            return known.clone();
        }
        // Variables that start at zero have no size yet.
        let size = |j: usize| {
            let variable = &problem.variables[j];
            let range = (variable.upper - variable.lower).min(1.0);
            if start[j] == 0.0 { range } else { start[j].abs() }
        };
        let here = Linearized::new(problem, (design, responses, evaluation), data).without(|here, i| {
            let slopes = here.jacobian.row(i);
            let change = slopes.iter().enumerate().map(|(j, g)| (g * size(j)).abs()).sum();
            is_identity([change, here.c[i].abs()])
        });
        let sizes = if start == design {
            start_sizes(start, evaluation.objective, &here)
        } else {
            start.iter().map(|b| b.abs()).collect()
        };
        start_lengths(problem, &sizes, evaluation.objective, &here)
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
        let by_size = if problem.n() > self.memory { (problem.n() + SURPLUS).min(MAX_STEPS) } else { 0 };
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
        let least = least_violation(&self.linearized, &self.units, design, [&region.lower, &region.upper])?;
        let restoration = is_incompatible(least, self.violation).then_some(least);
        if restoration.is_some()
            && let Some(next) = self.stationary_violation(WIDE)?
        {
            return Ok(next);
        }
        let surrogate = self.selected_surrogate();
        let proposal = self.solve(&surrogate, self.domain(&surrogate), restoration)?;
        let (noise, objectives) = (self.noise(false), self.objectives());
        let stalled = noise.map(noise::in_words).or_else(|| self.stalled(&proposal));
        let is_without_progress = || self.has_settled(&proposal, &objectives, true);
        let stalled = stalled.or_else(|| is_without_progress().then(|| NO_PROGRESS.to_owned()));
        let test = self.stop_test(&proposal, &objectives, [stalled.is_some(), noise.is_some()]);
        if self.is_flat_start() && !self.increases_quadratically() {
            return Ok(Next::Analyse(Box::new(self.displacement(DISPLACEMENTS[0], |_| true))));
        }
        if let Some(reason) = test.converged() {
            let second_order = self.second_order_step(test.negligible(), test.has_settled);
            let end = || Next::End(Status::Converged, reason, self.active_rows(&test.optimality));
            return Ok(second_order.map_or_else(end, |p| Next::Analyse(Box::new(p))));
        }
        let Some(reason) = stalled else { return Ok(Next::Analyse(Box::new(proposal))) };
        if noise.is_none()
            && let Some(next) = self.step_after_stalling(restoration)?
        {
            return Ok(next);
        }
        let is_smooth = self.noise(true).is_none() && !self.has_kink();
        let converged = test.converged_to_rounding().filter(|_| is_smooth);
        Ok(match converged {
            Some(reason) => Next::End(Status::Converged, reason, self.active_rows(&test.optimality)),
            None => self.stalled_end(&test, reason),
        })
    }

    /// The reason in words if the step to a proposal or the box has become too small.
    fn stalled(&self, proposal: &Proposal) -> Option<String> {
        let step: Vec<f64> = proposal.design.iter().zip(&self.state.design).map(|(to, from)| to - from).collect();
        let reason = stalled(&step, &self.memory.widths, &self.units.lengths)?;
        let words = || if self.differences().is_some() { noise::KINK_OR_DIFFERENCES } else { noise::KINK };
        let kink = || self.has_kink().then(|| words().to_owned());
        Some(self.noise(true).map(noise::in_words).or_else(kink).unwrap_or(reason))
    }

    /// True if the last steps have changed the objective by rounding only, see [`has_settled`]; false during a restoration.
    fn has_settled(&self, proposal: &Proposal, objectives: &[f64], is_without_progress: bool) -> bool {
        let predicted = self.state.evaluation.objective - proposal.predicted.objective;
        let at_limit = proposal.at_limit.contains(&true);
        proposal.restoration.is_none() && has_settled(objectives, predicted, at_limit, is_without_progress)
    }

    /// The stop test with a proposal, of a run that is stalled, by noise, or not.
    fn stop_test<'o>(
        &self,
        proposal: &Proposal,
        objectives: &'o [f64],
        [is_stalled, is_noisy]: [bool; 2],
    ) -> StopTest<'o> {
        let λ = &proposal.solution.multipliers;
        let optimality = Optimality::new(self.problem, &self.state.design, &self.linearized, λ, &self.units.lengths);
        let has_settled = self.has_settled(proposal, objectives, false);
        StopTest {
            is_feasible: self.is_feasible(1.0),
            is_compatible: proposal.restoration.is_none(),
            predicted: self.state.evaluation.objective - proposal.predicted.objective,
            at_limit: proposal.at_limit.contains(&true),
            is_last: is_stalled || has_settled,
            is_noisy,
            has_settled,
            largest_multiplier: self.largest_multiplier(&optimality.multipliers),
            optimality,
            objectives,
            objective_range: self.units.objective_range,
            settled_range: self.state.trace().settled.width(),
            rejected_change: self.rejected_change(),
            tolerance: self.memory.tolerance,
            has_forward_differences: self.has_forward_differences(),
        }
    }

    /// The end of a stalled run, with the most specific reason.
    fn stalled_end(&self, test: &StopTest, stalled: String) -> Next {
        let reason = match test.unbounded_multipliers() {
            Some(reason) => reason,
            None if test.is_feasible => format!("{stalled}; {}", test.optimality.in_words()),
            None => format!("no step reduces the violation further: {}", self.largest_violation_in_words()),
        };
        let reason = if test.has_forward_differences { format!("{reason}; {FORWARD}") } else { reason };
        Next::End(Status::Stalled, reason, self.active_rows(&test.optimality))
    }

    /// True if the analysis is differentiated by forward differences, whose error is of the first order in their step.
    fn has_forward_differences(&self) -> bool {
        self.differences() == Some("forward")
    }

    /// The name of the finite differences that differentiate the analysis; `None` for other methods.
    fn differences(&self) -> Option<&'static str> {
        let needed = CycleData::needed(self.problem, &self.data.retained);
        let method = self.problem.analysis.differentiation(self.n(), &needed)?;
        ["forward", "central", "richardson", "noise-aware"].contains(&method).then_some(method)
    }

    /// The rows with a multiplier.
    fn active_rows(&self, optimality: &Optimality) -> Vec<ActiveRow> {
        let rows = self.linearized.rows.iter().zip(&optimality.multipliers);
        rows.filter(|(_, λ)| **λ != 0.0).map(|(&row, &multiplier)| ActiveRow { row, multiplier }).collect()
    }
}
