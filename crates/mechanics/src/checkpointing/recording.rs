//! Recordings of converged steps, by implicit and by explicit methods, for derivatives.

use crate::Result;
use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::initial_conditions::Projection;
use crate::integrators::explicit::mechanism::{ConsistentState, MechanismRhs};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::integrators::generalized_alpha::Step;
use crate::integrators::predictor::Predictor;
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

    /// Copies the end of step `k` (from 0) to `state`. Returns the length of the step in s.
    pub(crate) fn load(&self, k: usize, state: &mut State<f64>) -> f64 {
        state.read(self.store.row(k))
    }
}

impl State<f64> {
    /// Reads the stored `row` of a step. Returns the length of the step in s.
    pub(crate) fn read(&mut self, row: &[f64]) -> f64 {
        self.t = row[0];
        let mut rest = &row[2..];
        for to in [&mut self.q, &mut self.v, &mut self.a, &mut self.l] {
            let (these, others) = rest.split_at(to.len());
            to.copy_from_slice(these);
            rest = others;
        }
        row[1]
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
        [self.steps, self.grid_steps, self.failed_steps, integrator.iterations] = checkpoint.counts;
        Ok(())
    }

    fn write(&self, to: &mut Vec<f64>) {
        let State { t, q, v, a, l, .. } = &self.integrator.step.new;
        to.extend([*t, self.length]);
        [q, v, a, l].into_iter().for_each(|values| to.extend_from_slice(values));
    }

    fn width(&self) -> usize {
        let State { q, l, .. } = &self.integrator.step.new;
        2 + 3 * q.len() + l.len()
    }
}

/// The converged steps of a motion by explicit steps.
pub struct ExplicitRecording {
    /// The equations of motion, for the numbering of the unknowns.
    pub system: System,
    /// The consistent initial state.
    pub start: ConsistentState,
    /// Ends of steps: time, state and rates.
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
    /// Signs of the switching functions.
    sides: Vec<bool>,
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
        ExplicitCheckpoint { end, next, taken, failed_steps, sides: self.switches.sides.clone() }
    }

    fn checkpoint_bytes(&self) -> usize {
        size_of::<ExplicitCheckpoint>() + size_of::<f64>() * self.width()
    }

    fn resume(&mut self, checkpoint: &ExplicitCheckpoint) -> Result<()> {
        self.stepper.put(&checkpoint.end, checkpoint.taken > 0);
        self.steps.resize(checkpoint.taken, 0.0);
        (self.next, self.failed_steps) = (checkpoint.next, checkpoint.failed_steps);
        self.switches.sides.clone_from(&checkpoint.sides);
        Ok(())
    }

    fn write(&self, to: &mut Vec<f64>) {
        let stepper = &self.stepper;
        to.push(stepper.t[1]);
        to.extend_from_slice(&stepper.new);
        to.extend_from_slice(stepper.rates_at_end(!self.steps.is_empty()));
    }

    fn width(&self) -> usize {
        1 + 2 * self.stepper.new.len()
    }
}
