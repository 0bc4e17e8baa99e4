//! The discrete adjoint of a motion by implicit steps.

use crate::analyses::dynamics::{Dynamics, InitialAcceleration, is_before, simulate_recorded};
use crate::analyses::sampling::{Weights, interpolate};
use crate::checkpointing::recording::Recording;
use crate::checkpointing::recording::StepInterval;
use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, add};
use crate::derivatives::adjoint::batch::{AdjointBatch, SystemVjp};
use crate::derivatives::adjoint::event_window::EventWindow;
use crate::derivatives::adjoint::initial_conditions::InitialConditionAdjoint;
use crate::derivatives::adjoint::problem::{
    AdjointFunctional, AdjointProblem, OutputTerm, ReplayStatistics, ReverseSteps, propagate_backwards,
};
use crate::derivatives::forward::dynamics::propagate_all;
use crate::derivatives::forward::implicit_steps::{ConvergedStep, ImplicitSteps};
use crate::derivatives::indeterminate::check_outputs;
use crate::integrators::generalized_alpha::{GeneralizedAlpha, Prescribed, Step, history_factor, rescaling};
use crate::integrators::time_stepper::TimeStepper;
use crate::integrators::velocity_violation::consistent_velocities;
use crate::mechanism::ParametricMechanism;
use crate::system::linearization::Linearization;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Result, diagnostics};
use nalgebra::DMatrix;

/// Simulates `model` at the design `b` and differentiates `responses` of its outputs at `times` (s) with respect to `b`,
/// backwards in time. Returns the gradients, a row per response.
///
/// The result is that of [`differentiate`](crate::derivatives::forward::dynamics::differentiate) up to rounding. Up to
/// four responses cost less than three analyses, this one included, for any number of design variables
/// (`cargo bench --bench adjoint`). The states of all steps are stored. Where several events end one step, the derivatives are those of the
/// direct method, at its cost.
///
/// # Errors
/// As [`differentiate`](crate::derivatives::forward::dynamics::differentiate), and
/// [`Error::Definition`](crate::Error::Definition) if a response refers to a missing output or time point.
pub fn differentiate_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    responses: &[AdjointFunctional],
) -> Result<DMatrix<f64>> {
    differentiate_backwards_within(usize::MAX, model, b, settings, times, responses).map(|(rows, _)| rows)
}

/// Differentiates as [`differentiate_backwards`] with at most `memory` bytes for the states of steps. Returns the cost of the
/// reverse pass as well.
///
/// If the steps do not fit into the memory, checkpoints are stored and steps are integrated again, with the same bits. Memory
/// for √n of n steps costs one more analysis. In addition, the steps around an event are in memory at once: with adaptive steps these
/// are all steps from the first event on.
///
/// # Errors
/// As [`differentiate_backwards`], and [`Error::Definition`](crate::Error::Definition) if the memory does not hold four
/// checkpoints.
pub fn differentiate_backwards_within<M: ParametricMechanism>(
    memory: usize,
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    responses: &[AdjointFunctional],
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let (_, recording) = simulate_recorded(&model.build(b)?, settings, times, memory)?;
    differentiate_recording_backwards(model, b, settings, times, responses, &recording)
}

/// Differentiates as [`differentiate_backwards`] along the steps of a recording of `model` at `b`. Returns the cost of the
/// reverse pass as well.
///
/// # Errors
/// As [`differentiate_backwards_within`].
pub fn differentiate_recording_backwards<M: ParametricMechanism>(
    model: &M,
    b: &[f64],
    settings: &Dynamics,
    times: &[f64],
    responses: &[AdjointFunctional],
    recording: &Recording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    solve(&AdjointProblem::build(model, b, times, responses)?, settings, times, recording)
}

/// Computes gradients from a recording. Not generic over the model: compiled once, in this crate.
fn solve(
    problem: &AdjointProblem<'_>,
    settings: &Dynamics,
    times: &[f64],
    recording: &Recording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    if recording.has_simultaneous_events {
        return multiply_direct_derivatives(problem, settings, recording);
    }
    check_outputs(&recording.system, &problem.mechanism, &recording.start)?;
    let mut steps = ReverseImplicitSteps::new(problem, recording, settings, times)?;
    propagate_backwards(problem, &mut steps)?;
    let statistics = ReplayStatistics::of(recording.steps(), &steps.playback);
    let ReverseImplicitSteps { mut batches, mut system, window, .. } = steps;
    let mut all: Vec<&mut AdjointBatch> = batches.iter_mut().collect();
    all.iter_mut().for_each(|batch| batch.state.join_accelerations());
    let mut initial =
        InitialConditionAdjoint::new(&problem.mechanism, &problem.activity, &system, &recording.start.modes);
    if settings.initial_acceleration == InitialAcceleration::Consistent {
        initial.accelerations(&mut system, &recording.start, &mut all)?;
    }
    initial.start(&mut system, &recording.start, &recording.projection, settings.initial_configuration, &mut all)?;
    Ok((problem.gradients(&batches) + window.gradients, statistics))
}

/// Computes gradients of a motion in which several events end one step, from the derivatives by the direct method.
///
/// The events stay simultaneous along changes of the design, but not along changes of each variable of the state at the beginning of the
/// step: the derivatives with respect to these do not exist.
fn multiply_direct_derivatives(
    problem: &AdjointProblem<'_>,
    settings: &Dynamics,
    recording: &Recording,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let mut steps = ImplicitSteps::simulated(&problem.mechanism, settings, problem.times)?;
    let derivatives = propagate_all(&problem.chunks, settings, problem.times, &mut steps)?;
    let (memory, steps) = (recording.bytes(), recording.steps());
    Ok((problem.products(&derivatives), ReplayStatistics { memory, steps, repeated: steps }))
}

/// The recorded implicit steps of a motion, with the adjoint states of all responses.
struct ReverseImplicitSteps<'m> {
    batches: Vec<AdjointBatch>,
    problem: &'m AdjointProblem<'m>,
    recording: &'m Recording,
    playback: ReversePlayback<'m, TimeStepper<'m>>,
    settings: &'m Dynamics,
    vjp: SystemVjp,
    system: System,
    rows: Vec<[f64; 1]>,
    /// Adjoint states at the beginning of the step.
    before: Vec<AdjointState>,
    old: State<f64>,
    new: State<f64>,
    /// Number of the step whose end is in `old`, and its record.
    old_step: Option<(usize, StepInterval)>,
    /// Record of the step.
    step: StepInterval,
    /// The steps around an event, up to the current one.
    window: EventWindow,
    at: State<f64>,
    adjoint_at: AdjointState,
    /// Workspace of steps that rescale velocities.
    rescaling: Option<RescalingAdjoint<'m>>,
}

/// Adjoint of consistent velocities in these modes.
struct RescalingAdjoint<'m> {
    modes: Modes,
    adjoint: InitialConditionAdjoint<'m>,
}

impl<'m> ReverseImplicitSteps<'m> {
    fn new(
        problem: &'m AdjointProblem<'m>,
        recording: &'m Recording,
        settings: &'m Dynamics,
        times: &'m [f64],
    ) -> Result<Self> {
        let AdjointProblem { mechanism, activity, .. } = problem;
        let playback = ReversePlayback::new(&recording.store, || TimeStepper::new(mechanism, settings, times))?;
        let (system, count) = (recording.system.clone(), problem.batches());
        let state = || recording.start.clone();
        Ok(Self {
            batches: vec![AdjointBatch::new(mechanism, system.size()); count],
            before: vec![AdjointState::new(mechanism); count],
            vjp: SystemVjp::new(mechanism, activity, &system, count),
            rows: vec![[0.0]; system.size()],
            old: state(),
            new: state(),
            old_step: None,
            step: StepInterval::default(),
            window: EventWindow::new(problem),
            at: state(),
            adjoint_at: AdjointState::new(mechanism),
            rescaling: None,
            problem,
            recording,
            playback,
            settings,
            system,
        })
    }

    /// The method of the current step.
    fn scheme(&self) -> GeneralizedAlpha {
        self.settings.scheme.after_event(self.step.events.since_event)
    }

    /// Assembles and factorizes the matrix of the current step; returns its linearization.
    fn factorize(&mut self) -> Result<Linearization> {
        let (position, velocity) = self.scheme().newmark_coefficients(self.step.h);
        let linearization = Linearization::step(position, velocity);
        self.system.assemble(&self.problem.mechanism, &self.new, linearization, &mut self.rows);
        diagnostics::factorize(&mut self.system, &self.problem.mechanism, &self.new)?;
        Ok(linearization)
    }

    /// Adds the current step to those around an event; with the first of them, propagates the adjoint states to its beginning.
    fn propagate_around_event(&mut self) -> Result<()> {
        self.factorize()?;
        let (factor, StepInterval { h, events }) = (self.system.factor().clone(), self.step);
        self.window.steps.push(ConvergedStep { h, end: self.new.clone(), factor, events });
        if events.begins_with_event() {
            return Ok(());
        }
        let (auxiliary, length) = match self.old_step {
            Some((number, StepInterval { h, .. })) => {
                let row = self.playback.row(number)?;
                (StepInterval::auxiliary(row, self.old.q.len()).to_vec(), Some(h))
            }
            None => (self.old.a.clone(), None),
        };
        let begin = Step::ending_at(self.old.clone(), auxiliary, length, events.since_event);
        self.window.propagate(self.problem, &self.system, self.settings, &begin, &mut self.batches)
    }

    /// Propagates from the first velocities of the step to those at the end of the step before, where the step rescales them.
    fn propagate_rescaling(&mut self) -> Result<()> {
        let Self { problem, settings, system, old, step, old_step, rescaling: workspace, batches, .. } = self;
        let AdjointProblem { mechanism, activity, .. } = problem;
        let change = old_step.and_then(|(_, previous)| rescaling(step.h, previous.h));
        let Some(change) = change.filter(|_| settings.rescales_velocities(mechanism) && step.events.since_event > 0)
        else {
            return Ok(());
        };
        let Some((consistent, projection)) = consistent_velocities(system, mechanism, old) else { return Ok(()) };
        let same = workspace.take().filter(|workspace| workspace.modes == old.modes);
        let workspace = workspace.insert(same.unwrap_or_else(|| RescalingAdjoint {
            modes: old.modes.clone(),
            adjoint: InitialConditionAdjoint::new(mechanism, activity, system, &old.modes),
        }));
        let mut batches: Vec<&mut AdjointBatch> = batches.iter_mut().collect();
        workspace.adjoint.rescaled_velocities(system, (&consistent, &projection), change, &mut batches)
    }

    /// Propagates the adjoint state of one batch by the formulas of the step.
    fn apply_step_formulas(&mut self, batch: usize) {
        let Dynamics { prescribed, .. } = self.settings;
        let AdjointProblem { mechanism, activity, .. } = self.problem;
        let (scheme, h) = (&self.scheme(), self.step.h);
        let (AdjointBatch { state, design, .. }, before) = (&mut self.batches[batch], &mut self.before[batch]);
        for (i, coordinate) in mechanism.coordinates.iter().enumerate() {
            if coordinate.motion.is_none() {
                state.propagate_free(before, scheme, h, i);
            } else if activity.motions[i] {
                let position = match prescribed {
                    Prescribed::Exact => state.q[i],
                    Prescribed::Newmark => state.propagate_prescribed(before, scheme, h, i),
                };
                let adjoints = [&position, &state.v[i], &state.a[i]];
                design.add_motion(mechanism, i, self.new.t, *prescribed, adjoints);
            }
        }
        let previous = self.old_step.map(|(_, previous)| previous.h);
        let factor = match self.step.events.is_without_history() {
            true => Some(0.0),
            false => previous.and_then(|previous| history_factor(h, previous)),
        };
        if let Some(factor) = factor {
            before.rescale_auxiliary(factor);
        }
        std::mem::swap(state, before);
        before.clear();
    }
}

impl ReverseSteps for ReverseImplicitSteps<'_> {
    fn steps_to(&self, t: f64) -> usize {
        self.recording.store.steps_to(t)
    }

    fn load_step(&mut self, k: usize) -> Result<()> {
        match self.old_step {
            Some((number, step)) if number == k => {
                std::mem::swap(&mut self.old, &mut self.new);
                self.step = step;
            }
            _ => self.step = StepInterval::read(self.playback.row(k)?, &mut self.new),
        }
        self.old_step = match k.checked_sub(1) {
            Some(number) => Some((number, StepInterval::read(self.playback.row(number)?, &mut self.old))),
            None => {
                self.old.copy_from(&self.recording.start);
                None
            }
        };
        Ok(())
    }

    fn contains(&self, _: usize, t: f64) -> bool {
        is_before(self.settings.start, self.old.t, t)
    }

    fn add_outputs(&mut self, t: f64, terms: &[OutputTerm]) -> Result<()> {
        let weights = Weights::of([self.old.t, self.new.t], t);
        interpolate(&self.old, &self.new, t, &mut self.at);
        for term in terms {
            if self.window.is_held(self.problem, &self.new, term.output) {
                self.window.add_held(term);
                continue;
            }
            if self.step.events.depends_on_event() {
                self.window.add_output(t, term);
                continue;
            }
            let (batch, before) = (&mut self.batches[term.batch], &mut self.before[term.batch]);
            std::mem::swap(&mut batch.state, &mut self.adjoint_at);
            batch.add_output(&self.problem.mechanism, &self.at, term, &mut self.vjp.element);
            std::mem::swap(&mut batch.state, &mut self.adjoint_at);
            self.adjoint_at.propagate_to_ends(weights, [before, &mut batch.state]);
            self.adjoint_at.clear();
        }
        Ok(())
    }

    fn propagate_to_step_start(&mut self) -> Result<()> {
        if self.step.events.depends_on_event() {
            return self.propagate_around_event();
        }
        let linearization = self.factorize()?;
        let (mechanism, scheme, h) = (&self.problem.mechanism, self.scheme(), self.step.h);
        if self.step.events.is_without_history() {
            let lead = self.settings.scheme.lead();
            let ends = self.batches.iter_mut().zip(&mut self.before);
            ends.for_each(|(batch, before)| batch.state.propagate_lead(before, lead));
        }
        for batch in &mut self.batches {
            batch.solve(&mut self.system, |adjoint, unknown| match unknown {
                Unknown::Coordinate(i) => adjoint.by_acceleration(&scheme, h, i),
                Unknown::Multiplier(m) => adjoint.l[m],
            });
        }
        let mut batches: Vec<&mut AdjointBatch> = self.batches.iter_mut().collect();
        self.vjp.add(mechanism, &self.system, &self.new, linearization.constraint_scale, &mut batches);
        let outputs = match self.settings.rescales_velocities(&self.problem.mechanism) {
            true => self.before.iter_mut().map(AdjointState::take_velocities).collect(),
            false => Vec::new(),
        };
        (0..self.batches.len()).for_each(|batch| self.apply_step_formulas(batch));
        self.propagate_rescaling()?;
        for (batch, outputs) in self.batches.iter_mut().zip(outputs) {
            batch.state.v.iter_mut().zip(&outputs).for_each(|(v, output)| add(v, 1.0, output));
        }
        Ok(())
    }

    fn load_start(&mut self) -> Result<()> {
        self.old.copy_from(&self.recording.start);
        self.new.copy_from(&self.recording.start);
        self.step = StepInterval::default();
        Ok(())
    }
}
