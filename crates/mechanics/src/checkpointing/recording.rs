//! Recordings of converged steps, by implicit and by explicit methods, for derivatives.

use crate::Result;
use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::initial_conditions::Projection;
use crate::integrators::event_location::EventLocator;
use crate::integrators::explicit::mechanism::{ConsistentState, MechanismRhs};
use crate::integrators::explicit::ode_driver::{OdeDriver, SplitStep};
use crate::integrators::explicit::stepper::OdeRhs;
use crate::integrators::explicit::switching::SwitchLocator;
use crate::integrators::generalized_alpha::{Step, WITHOUT_HISTORY};
use crate::integrators::predictor::Predictor;
use crate::integrators::step_events::StepEvents;
use crate::integrators::time_stepper::TimeStepper;
use crate::system::System;
use crate::system::state::State;

/// The converged steps of a motion by implicit steps, from which derivatives are computed without another iteration.
///
/// If the steps do not fit into memory, checkpoints are stored and steps are recomputed from them bit for bit.
#[derive(Clone)]
pub struct Recording {
    /// The equations of motion, for the numbering of the unknowns.
    pub(crate) system: System,
    /// Multipliers of the initial projections.
    pub(crate) projection: Projection,
    /// The consistent initial state.
    pub(crate) start: State<f64>,
    /// Stored steps and checkpoints.
    pub(crate) store: TrajectoryStore<ImplicitCheckpoint>,
    /// True if several events end one step.
    pub(crate) has_simultaneous_events: bool,
}

impl Recording {
    /// Recording of a motion that has not begun, in at most `limit` bytes.
    pub(crate) fn of(stepper: &TimeStepper<'_>, limit: usize) -> Self {
        let (system, projection) = (stepper.integrator.system.clone(), stepper.projection.clone());
        Self {
            system,
            projection,
            start: stepper.integrator.step.new.clone(),
            store: TrajectoryStore::of(stepper, limit),
            has_simultaneous_events: false,
        }
    }

    /// Returns whether every step is stored, because all of them fitted into the memory.
    pub fn is_complete(&self) -> bool {
        self.store.is_complete()
    }

    /// Memory of the stored steps and checkpoints in bytes.
    pub fn bytes(&self) -> usize {
        self.store.bytes()
    }

    /// Number of steps of the motion.
    pub fn steps(&self) -> usize {
        self.store.steps()
    }

    /// Copies the end of step `k` (from 0) to `state`. Returns the length of the step and its events.
    pub(crate) fn load(&self, k: usize, state: &mut State<f64>) -> StepInterval {
        StepInterval::read(self.store.row(k), state)
    }
}

/// Length of a recorded step, and its relation to events.
///
/// A row of a recording has the time at the end, the length, positions, velocities, accelerations and multipliers. In a
/// mechanism with events follow the values of [`StepEvents`], the modes, and the auxiliary accelerations at the end.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct StepInterval {
    /// Length in s.
    pub h: f64,
    /// Events at its ends.
    pub events: StepEvents,
}

impl StepInterval {
    /// Reads the stored `row` of a step: its end to `state`.
    pub fn read(row: &[f64], state: &mut State<f64>) -> Self {
        state.t = row[0];
        let mut rest = &row[2..];
        for to in [&mut state.q, &mut state.v, &mut state.a, &mut state.l] {
            let (these, others) = rest.split_at(to.len());
            to.copy_from_slice(these);
            rest = others;
        }
        if rest.is_empty() {
            let events = StepEvents { has_given_end: true, since_event: WITHOUT_HISTORY, ..StepEvents::default() };
            return Self { h: row[1], events };
        }
        let (events, rest) = rest.split_at(StepEvents::VALUES);
        state.modes.read(rest);
        Self { h: row[1], events: StepEvents::read(events) }
    }

    /// Auxiliary accelerations at the end of the step, for `coordinates` coordinates of a mechanism with events.
    pub fn auxiliary(row: &[f64], coordinates: usize) -> &[f64] {
        &row[row.len() - coordinates..]
    }
}

/// Checkpoint of a motion by implicit steps: the current step, and the data that determine the lengths and predictions of
/// later steps.
#[derive(Clone)]
pub struct ImplicitCheckpoint {
    step: Step<f64>,
    predictor: Predictor,
    curvature: f64,
    next: f64,
    length: f64,
    locator: EventLocator,
    events: StepEvents,
    /// Numbers of steps, grid steps, failed steps and iterations.
    counts: [usize; 4],
}

impl Checkpointable for TimeStepper<'_> {
    type Checkpoint = ImplicitCheckpoint;

    fn steps_taken(&self) -> usize {
        self.steps
    }

    fn step(&mut self) -> Result<()> {
        self.advance().map(|_| ())
    }

    fn checkpoint(&self) -> ImplicitCheckpoint {
        let integrator = &self.integrator;
        ImplicitCheckpoint {
            step: integrator.step.clone(),
            predictor: integrator.predictor.clone(),
            curvature: integrator.curvature,
            next: self.next,
            length: self.length,
            locator: self.locator.clone(),
            events: self.events,
            counts: [self.steps, self.grid_steps, self.failed_steps, integrator.iterations],
        }
    }

    fn checkpoint_bytes(&self) -> usize {
        let State { q, l, .. } = &self.integrator.step.new;
        let step = 2 * (4 * q.len() + l.len());
        size_of::<ImplicitCheckpoint>() + size_of::<f64>() * (step + self.integrator.predictor.numbers())
    }

    fn resume(&mut self, checkpoint: &ImplicitCheckpoint) -> Result<()> {
        let integrator = &mut self.integrator;
        integrator.step.clone_from(&checkpoint.step);
        integrator.predictor.clone_from(&checkpoint.predictor);
        integrator.curvature = checkpoint.curvature;
        (self.next, self.length) = (checkpoint.next, checkpoint.length);
        self.locator.clone_from(&checkpoint.locator);
        self.events = checkpoint.events;
        [self.steps, self.grid_steps, self.failed_steps, integrator.iterations] = checkpoint.counts;
        Ok(())
    }

    fn write(&self, to: &mut Vec<f64>) {
        let State { t, q, v, a, l, modes } = &self.integrator.step.new;
        to.extend([*t, self.length]);
        [q, v, a, l].into_iter().for_each(|values| to.extend_from_slice(values));
        if self.integrator.mechanism.has_events() {
            self.events.write(to);
            modes.write(to);
            to.extend_from_slice(self.integrator.step.auxiliary());
        }
    }

    fn width(&self) -> usize {
        let State { q, l, modes, .. } = &self.integrator.step.new;
        let events =
            if self.integrator.mechanism.has_events() { StepEvents::VALUES + modes.width() + q.len() } else { 0 };
        2 + 3 * q.len() + l.len() + events
    }
}

/// The converged steps of a motion by explicit steps.
pub struct ExplicitRecording {
    /// The equations of motion, for the numbering of the unknowns.
    pub system: System,
    /// The consistent initial state.
    pub start: ConsistentState,
    /// Ends of steps: time, state and rates, and the sides of switching functions along the steps with their gradings.
    pub store: TrajectoryStore<ExplicitCheckpoint>,
}

impl ExplicitRecording {
    /// Recording of a motion that has not begun, in at most `limit` bytes.
    pub fn of(driver: &OdeDriver<MechanismRhs<'_>>, start: ConsistentState, limit: usize) -> Self {
        Self { system: driver.stepper.rhs.system.clone(), start, store: TrajectoryStore::of(driver, limit) }
    }
}

/// Checkpoint of a motion by explicit steps: the end of a step.
#[derive(Clone)]
pub struct ExplicitCheckpoint {
    /// Time, state and rates.
    end: Vec<f64>,
    next: f64,
    taken: usize,
    failed_steps: usize,
    given: SplitStep,
    switches: SwitchLocator,
}

impl<F: OdeRhs> Checkpointable for OdeDriver<F> {
    type Checkpoint = ExplicitCheckpoint;

    fn steps_taken(&self) -> usize {
        self.steps.len()
    }

    fn step(&mut self) -> Result<()> {
        self.advance()
    }

    fn checkpoint(&self) -> ExplicitCheckpoint {
        let mut end = Vec::with_capacity(self.width());
        self.write(&mut end);
        let (next, taken, failed_steps) = (self.next, self.steps.len(), self.failed_steps);
        ExplicitCheckpoint { end, next, taken, failed_steps, given: self.given, switches: self.switches.clone() }
    }

    fn checkpoint_bytes(&self) -> usize {
        size_of::<ExplicitCheckpoint>() + size_of::<f64>() * self.width()
    }

    fn resume(&mut self, checkpoint: &ExplicitCheckpoint) -> Result<()> {
        self.stepper.put(&checkpoint.end, checkpoint.taken > 0);
        self.steps.resize(checkpoint.taken, 0.0);
        (self.next, self.failed_steps, self.given) = (checkpoint.next, checkpoint.failed_steps, checkpoint.given);
        self.switches.clone_from(&checkpoint.switches);
        self.stepper.rhs.hold_sides(&self.switches.held);
        Ok(())
    }

    fn write(&self, to: &mut Vec<f64>) {
        let stepper = &self.stepper;
        to.push(stepper.t[1]);
        to.extend_from_slice(&stepper.new);
        to.extend_from_slice(stepper.rates_at_end(!self.steps.is_empty()));
        self.switches.write(stepper.grading, to);
    }

    fn width(&self) -> usize {
        1 + 2 * self.stepper.new.len() + self.switches.width()
    }
}
