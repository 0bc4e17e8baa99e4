//! The discrete adjoint of a mechanism's motion by explicit steps.

use crate::Result;
use crate::analyses::dynamics::simulate_with_recording;
use crate::checkpointing::recording::ExplicitRecording;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::element_vjp::ElementVjp;
use crate::derivatives::adjoint::problem::{
    AdjointFunctional, AdjointProblem, OutputTerm, ReplayStatistics, ReverseSteps, propagate_backwards,
};
use crate::derivatives::adjoint::relative::solve_relative;
use crate::derivatives::adjoint::stage_replay::StageReplay;
use crate::derivatives::forward::explicit::dual_steps::propagate_repeated;
use crate::derivatives::forward::explicit::explicit_steps::LinearizedStages;
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::indeterminate::check_outputs;
use crate::integrators::explicit::mechanism::{SAMPLE, start};
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::integrators::explicit::switching::HeldSides;
use crate::integrators::explicit::tableau::{DenseWeights, Tableau};
use crate::mechanism::ParametricMechanism;
use crate::system::Unknown;
use crate::system::modes::Modes;
use nalgebra::DMatrix;
use std::ops::Range;

/// Simulates `model` at the design `b` by explicit steps and differentiates `responses` of its outputs at `times` (s) with
/// respect to `b`, backwards in time. Returns the gradients, a row per response.
///
/// The steps are frozen; the result is that of
/// [`differentiate_explicitly`](crate::derivatives::forward::explicit::differentiate_explicitly) up to rounding. Every step
/// is repeated for its stages. The adjoint passes through them in reverse, with the transposed matrix of each, and through
/// the projection at the end of the step and the states inside it.
///
/// # Errors
/// As [`differentiate_explicitly`](crate::derivatives::forward::explicit::differentiate_explicitly), and
/// [`Error::Definition`](crate::Error::Definition) if a response refers to a missing output or time point.
pub fn differentiate_explicitly_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    responses: &[AdjointFunctional],
) -> Result<DMatrix<f64>> {
    differentiate_explicitly_backwards_within(usize::MAX, model, b, settings, times, responses).map(|(rows, _)| rows)
}

/// Differentiates as [`differentiate_explicitly_backwards`] with at most `memory` bytes for the states between steps. Returns
/// the cost of the reverse pass as well.
///
/// # Errors
/// As [`differentiate_explicitly_backwards`], and [`Error::Definition`](crate::Error::Definition) if the memory does not
/// hold four checkpoints.
pub fn differentiate_explicitly_backwards_within<M: ParametricMechanism>(
    memory: usize,
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    responses: &[AdjointFunctional],
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let (_, recording) = simulate_with_recording(&model.build(b)?, settings, times, memory)?;
    differentiate_explicit_recording_backwards(model, b, settings, times, responses, &recording)
}

/// Differentiates as [`differentiate_explicitly_backwards`] along the steps of a recording of `model` at `b`. Returns the
/// cost of the reverse pass as well.
///
/// # Errors
/// As [`differentiate_explicitly_backwards_within`].
pub fn differentiate_explicit_recording_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Explicit,
    times: &[f64],
    responses: &[AdjointFunctional],
    recording: &ExplicitRecording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let problem = AdjointProblem::build(model, b, times, responses)?;
    if problem.mechanism.has_events() {
        let statistics =
            ReplayStatistics { memory: recording.store.bytes(), steps: recording.store.steps(), repeated: 0 };
        // After an event all steps depend on its time through the state in which they begin, not only the steps around it.
        let (_, _, derivatives) = propagate_repeated(&problem.mechanism, &problem.chunks, settings, problem.times)?;
        return Ok((problem.products(&derivatives), statistics));
    }
    solve(&problem, settings, times, recording)
}

/// Computes gradients from a recording. Not generic over the model: compiled once, in this crate.
fn solve(
    problem: &AdjointProblem<'_>,
    settings: &Explicit,
    times: &[f64],
    recording: &ExplicitRecording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let relative = start(&problem.mechanism, settings, times, false)?.0.stepper.rhs.relative;
    if let Some(relative) = relative {
        return solve_relative(problem, settings, times, recording, relative.dynamics);
    }
    check_outputs(&recording.system, &problem.mechanism, &recording.start.state)?;
    let mut steps = ReverseExplicitSteps::new(problem, settings, times, recording)?;
    propagate_backwards(problem, &mut steps)?;
    steps.finish()?;
    steps.replay.gradients(problem, steps.adjoints.iter_mut().map(|adjoint| &mut adjoint.batch).collect())
}

/// The explicit steps of a motion, repeated for their stages, with the adjoint states of all responses.
struct ReverseExplicitSteps<'m> {
    adjoints: Vec<StageAdjoint>,
    replay: StageReplay<'m>,
    stages: AdjointStages<'m>,
    /// End in s and sides of switching functions of the step to load next.
    next: Option<(f64, HeldSides)>,
}

impl<'m> ReverseExplicitSteps<'m> {
    fn new(
        problem: &'m AdjointProblem<'m>,
        settings: &'m Explicit,
        times: &'m [f64],
        recording: &'m ExplicitRecording,
    ) -> Result<Self> {
        let AdjointProblem { mechanism, activity, .. } = problem;
        let (replay, begin) = StageReplay::new(problem, settings, times, recording)?;
        let stepper = &replay.driver.stepper;
        let system = &stepper.rhs.system;
        let linearizer = Linearizer::new(mechanism, activity, system, &Modes::initial(mechanism));
        let stages = AdjointStages {
            problem,
            method: stepper.method,
            linearized: LinearizedStages::new(&linearizer, &begin),
            sources: vec![[0.0; BATCH]; linearizer.sources()],
            linearizer,
            unknowns: system.unknowns().to_vec(),
            element: ElementVjp::default(),
            h: 0.0,
        };
        let adjoints = (0..problem.batches()).map(|_| StageAdjoint::new(&stages)).collect();
        Ok(Self { adjoints, replay, stages, next: None })
    }

    /// Propagates from the rates at the start of the motion to the positions and velocities there.
    fn finish(&mut self) -> Result<()> {
        self.replay.evaluate_start()?;
        self.with_record(|adjoints, stages| {
            stages.linearize(0..1);
            adjoints.iter_mut().for_each(|adjoint| adjoint.finish(stages));
        });
        Ok(())
    }

    /// Moves the record of the step from the equations to the stages while `action` runs.
    fn with_record(&mut self, action: impl FnOnce(&mut [StageAdjoint], &mut AdjointStages<'m>)) {
        let record = &mut self.replay.driver.stepper.rhs.record;
        self.stages.linearized.take_record(record);
        action(&mut self.adjoints, &mut self.stages);
        self.stages.linearized.return_record(record);
    }
}

impl ReverseSteps for ReverseExplicitSteps<'_> {
    fn steps_to(&self, t: f64) -> usize {
        self.replay.steps_to(t)
    }

    fn load_step(&mut self, k: usize) -> Result<()> {
        let StageReplay { playback, driver, first, is_dense, .. } = &mut self.replay;
        let stepper = &mut driver.stepper;
        let numbers = 1 + 2 * stepper.old.len();
        let end_of = |row: &[f64]| (row[0], HeldSides::read(&row[numbers..]));
        let (end, HeldSides { sides, grading }) = match self.next.take() {
            Some(next) => next,
            None => end_of(playback.row(k)?),
        };
        let begin = if k > 0 { playback.row(k - 1)? } else { &*first };
        stepper.put(begin, false);
        let last = end_of(begin);
        stepper.rhs.hold_sides(&sides);
        self.stages.linearized.is_restarted = sides != last.1.sides;
        (stepper.grading, self.stages.linearized.grading) = (grading, grading);
        if self.stages.linearized.is_restarted {
            stepper.restart_rates()?;
        }
        stepper.attempt(end, None)?;
        (self.stages.h, *is_dense, self.next) = (stepper.length(), false, Some(last));
        Ok(())
    }

    fn contains(&self, k: usize, t: f64) -> bool {
        self.steps_to(t) > k
    }

    fn add_outputs(&mut self, t: f64, terms: &[OutputTerm]) -> Result<()> {
        let fraction = self.replay.sample(t)?;
        let stepper = &self.replay.driver.stepper;
        let weights = fraction.map(|fraction| stepper.method.graded_dense_weights(fraction, stepper.grading));
        self.with_record(|adjoints, stages| {
            stages.linearize(SAMPLE..SAMPLE + 1);
            for (k, adjoint) in adjoints.iter_mut().enumerate() {
                let mut terms = terms.iter().filter(|term| term.batch == k).peekable();
                if terms.peek().is_some() {
                    adjoint.add_outputs(stages, terms, weights);
                }
            }
        });
        Ok(())
    }

    fn propagate_to_step_start(&mut self) -> Result<()> {
        let is_dense = self.replay.is_dense;
        self.with_record(|adjoints, stages| {
            stages.linearize(if stages.linearized.is_restarted { 0 } else { 1 }..stages.method.end + 1);
            if is_dense {
                stages.linearize(stages.method.end + 1..stages.method.slots());
            }
            let AdjointStages { linearized, linearizer, problem, .. } = stages;
            linearized.linearize_projections(linearizer, &problem.mechanism);
            adjoints.iter_mut().for_each(|adjoint| adjoint.propagate_to_step_start(stages, is_dense));
        });
        Ok(())
    }

    fn load_start(&mut self) -> Result<()> {
        let StageReplay { driver, first, .. } = &mut self.replay;
        let stepper = &mut driver.stepper;
        stepper.put(first, false);
        stepper.rhs.hold_sides(&HeldSides::read(&first[1 + 2 * stepper.old.len()..]).sides);
        self.stages.h = 0.0;
        Ok(())
    }
}

/// The stages of a step, which all responses share.
struct AdjointStages<'m> {
    problem: &'m AdjointProblem<'m>,
    method: &'static Tableau,
    linearizer: Linearizer,
    linearized: LinearizedStages,
    unknowns: Vec<Unknown>,
    element: ElementVjp,
    /// Workspace: derivatives with respect to each source of the entries.
    sources: Vec<BatchValues>,
    /// Length of the step in s.
    h: f64,
}

impl AdjointStages<'_> {
    fn linearize(&mut self, slots: Range<usize>) {
        self.linearized.linearize(&self.linearizer, &self.problem.mechanism, slots, false);
    }
}

/// Adjoint states of a batch of responses at the stages of a step.
///
/// With k = f(Y) at the states Y = y₀ + h Σ a k of the stages and y₁ = P(Y_e), from the last stage to the first
///
/// $$ \bar Y_i = \left(\frac{\partial f}{\partial Y_i}\right)^{\!T}\bar k_i,\qquad
///    \bar k_j \mathrel{+}= h\,a_{ij}\bar Y_i,\qquad \bar y_0 \mathrel{+}= \bar Y_i $$
///
/// # Sources
/// Hager, *Numer. Math.* 87 (2000) 247–282; Sandu, *Lect. Notes Comput. Sci.* 3994 (2006) 550–557.
struct StageAdjoint {
    batch: AdjointBatch,
    /// ȳ₁ at the end of the step, positions and then velocities.
    end: Vec<BatchValues>,
    /// ȳ₀ at its beginning.
    begin: Vec<BatchValues>,
    /// k̄ of each slot.
    rates: Vec<Vec<BatchValues>>,
}

impl StageAdjoint {
    /// Zero derivatives, at the end of the motion.
    fn new(stages: &AdjointStages<'_>) -> Self {
        let mechanism = &stages.problem.mechanism;
        let zeros = vec![[0.0; BATCH]; 2 * mechanism.coordinates.len()];
        Self {
            batch: AdjointBatch::new(mechanism, stages.unknowns.len()),
            rates: vec![zeros.clone(); stages.method.slots()],
            begin: zeros.clone(),
            end: zeros,
        }
    }

    /// Adds the derivatives of outputs of the state in the slot for output: inside the step with the weights of dense
    /// output, or at its end.
    fn add_outputs<'w>(
        &mut self,
        stages: &mut AdjointStages<'_>,
        terms: impl Iterator<Item = &'w OutputTerm>,
        dense: Option<DenseWeights>,
    ) {
        self.batch.state.clear();
        let AdjointStages { problem, linearized, element, .. } = stages;
        for term in terms {
            self.batch.add_output(&problem.mechanism, &linearized.record().stages[SAMPLE].state, term, element);
        }
        self.differentiate_accelerations(stages, SAMPLE);
        let Some(weights) = dense else { return self.batch.add_state(1.0, &mut self.end) };
        self.batch.add_state(1.0 - weights.change, &mut self.begin);
        self.batch.add_state(weights.change, &mut self.end);
        for (rates, weight) in self.rates.iter_mut().zip(weights.slots).filter(|(_, weight)| *weight != 0.0) {
            self.batch.add_state(stages.h * weight, rates);
        }
    }

    /// Propagates from the end of the step to its beginning; `is_dense` if states inside it have derivatives.
    fn propagate_to_step_start(&mut self, stages: &mut AdjointStages<'_>, is_dense: bool) {
        let (method, end) = (stages.method, stages.method.end);
        if is_dense {
            (end + 1..method.slots()).rev().for_each(|slot| self.differentiate_stage(stages, slot));
        }
        self.differentiate_rates(stages, end, end);
        self.batch.add_state(1.0, &mut self.end);
        self.differentiate_projection(stages);
        self.differentiate_end(stages);
        (1..end).rev().for_each(|slot| self.differentiate_stage(stages, slot));
        if stages.linearized.is_restarted {
            // These rates are not those at the end of the step before.
            self.differentiate_rates(stages, 0, 0);
            self.batch.add_state(1.0, &mut self.begin);
            self.rates[0].fill([0.0; BATCH]);
        }
        std::mem::swap(&mut self.begin, &mut self.end);
        self.begin.fill([0.0; BATCH]);
        self.rates.swap(0, end);
        self.rates.iter_mut().enumerate().filter(|(slot, _)| *slot != end).for_each(|(_, r)| r.fill([0.0; BATCH]));
    }

    /// Propagates to the positions and velocities at the start of the motion, and stores their derivatives in the batch.
    fn finish(&mut self, stages: &mut AdjointStages<'_>) {
        self.differentiate_rates(stages, stages.method.end, 0);
        self.batch.add_state(1.0, &mut self.end);
        self.batch.state.clear();
        let n = self.end.len() / 2;
        self.batch.state.q.copy_from_slice(&self.end[..n]);
        self.batch.state.v.copy_from_slice(&self.end[n..]);
    }

    /// Propagates from the rates of a stage to the beginning of the step and to the rates of earlier stages.
    fn differentiate_stage(&mut self, stages: &mut AdjointStages<'_>, slot: usize) {
        self.differentiate_rates(stages, slot, slot);
        let Self { batch, begin, rates, .. } = self;
        batch.add_state(1.0, begin);
        for (j, weight) in stages.method.row(slot, stages.linearized.grading) {
            batch.add_state(stages.h * weight, &mut rates[j]);
        }
    }

    /// Propagates from the end of the step, before the projection, to its beginning and to the rates of the stages.
    fn differentiate_end(&mut self, stages: &AdjointStages<'_>) {
        let Self { end, begin, rates, .. } = self;
        let add_end =
            |to: &mut [BatchValues], factor: f64| to.iter_mut().zip(&*end).for_each(|(to, end)| add(to, factor, end));
        add_end(begin, 1.0);
        for (j, weight) in stages.method.row(stages.method.end, stages.linearized.grading) {
            add_end(&mut rates[j], stages.h * weight);
        }
    }

    /// Propagates from k̄ of slot `rates` to the state of the stage in `slot`, which is then the state of the batch.
    fn differentiate_rates(&mut self, stages: &mut AdjointStages<'_>, rates: usize, slot: usize) {
        let (state, rates) = (&mut self.batch.state, &self.rates[rates]);
        let n = state.q.len();
        state.clear();
        for unknown in &stages.unknowns {
            if let Unknown::Coordinate(i) = *unknown {
                (state.v[i], state.a[i]) = (rates[i], rates[n + i]);
            }
        }
        self.differentiate_accelerations(stages, slot);
    }

    /// Propagates from accelerations and multipliers of a stage to its positions and velocities.
    fn differentiate_accelerations(&mut self, stages: &mut AdjointStages<'_>, slot: usize) {
        let AdjointStages { problem, linearized, linearizer, sources, unknowns, .. } = stages;
        let stage = &mut linearized.record_mut().stages[slot];
        self.batch.solve_accelerations(unknowns, &mut stage.factor);
        let t = stage.state.t;
        self.batch.add_vjp(&linearized.entries[slot], linearizer, sources);
        self.batch.take_motions(&problem.mechanism, &problem.activity, t);
    }

    /// Propagates from the projected end of the step to the end before the projection.
    fn differentiate_projection(&mut self, stages: &mut AdjointStages<'_>) {
        let AdjointStages { problem, linearized, linearizer, sources, unknowns, .. } = stages;
        if linearized.is_free {
            return;
        }
        let n = self.end.len() / 2;
        let Self { batch, end, .. } = self;
        let (projected, [positions, velocities, corrections]) = linearized.projected_mut();
        batch.state.clear();
        batch.state.q.copy_from_slice(&end[..n]);
        batch.solve_coordinates(unknowns, &mut projected.factor, &end[n..]);
        batch.add_vjp(velocities, linearizer, sources);
        let by_positions = batch.state.q.clone();
        batch.add_vjp(corrections, linearizer, sources);
        let by_velocities = std::mem::replace(&mut batch.state.v, vec![[0.0; BATCH]; n]);
        batch.solve_coordinates(unknowns, &mut projected.factor, &by_positions);
        batch.add_vjp(positions, linearizer, sources);
        batch.state.v.iter_mut().zip(&by_velocities).for_each(|(to, from)| add(to, 1.0, from));
        batch.take_motions(&problem.mechanism, &problem.activity, projected.before.t);
        end[..n].fill([0.0; BATCH]);
        batch.add_state(1.0, end);
    }
}

impl AdjointBatch {
    /// Adds `factor` times the derivatives with respect to positions and velocities to `to`, those with respect to a state or
    /// its rates.
    fn add_state(&self, factor: f64, to: &mut [BatchValues]) {
        self.state.q.iter().chain(&self.state.v).zip(to).for_each(|(from, to)| add(to, factor, from));
    }
}
