//! The converged steps of a motion, kept for derivatives.

use crate::Result;
use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::initial_conditions::Projection;
use crate::integrators::generalized_alpha::Step;
use crate::integrators::predictor::Predictor;
use crate::integrators::time_stepper::TimeStepper;
use crate::system::System;
use crate::system::state::State;

/// The converged steps of a motion: from them derivatives are had without another iteration.
///
/// If the memory does not suffice for all, there are check-points in their place, from which steps are had again, bit for bit.
#[derive(Clone)]
pub struct Recording {
    /// The equations, for their numbering.
    pub(crate) system: System,
    /// Multipliers of the initial projections.
    pub(crate) projection: Projection,
    /// Where the motion starts: assembled and consistent.
    pub(crate) start: State<f64>,
    /// The steps.
    pub(crate) log: TrajectoryStore<Checkpoint>,
}

impl Recording {
    /// Of a motion that has not begun; `limit` is the most memory in bytes.
    pub(crate) fn of(run: &TimeStepper<'_>, limit: usize) -> Self {
        let (system, projection) = (run.integrator.system.clone(), run.projection.clone());
        Self { system, projection, start: run.integrator.step.new.clone(), log: TrajectoryStore::of(run, limit) }
    }

    /// Whether every step was kept: the memory sufficed.
    pub fn is_whole(&self) -> bool {
        self.log.is_whole()
    }

    /// Memory of the steps and check-points in bytes.
    pub fn bytes(&self) -> usize {
        self.log.bytes()
    }

    /// Number of steps of the motion.
    pub fn steps(&self) -> usize {
        self.log.steps()
    }

    /// Copies the end of step `k` (from 0) to `state`; returns the length of the step in s.
    pub(crate) fn load(&self, k: usize, state: &mut State<f64>) -> f64 {
        state.read(self.log.row(k))
    }
}

impl State<f64> {
    /// Takes over what was kept of a step; returns its length in s.
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

/// A check-point of a motion by implicit steps: besides the step what chooses its successors and their first guesses.
#[derive(Clone)]
pub struct Checkpoint {
    step: Step<f64>,
    predictor: Predictor,
    curvature: f64,
    next: f64,
    length: f64,
    /// Steps, those on the grid, those that failed, iterations.
    counts: [usize; 4],
}

impl Checkpointable for TimeStepper<'_> {
    type Checkpoint = Checkpoint;

    fn taken(&self) -> usize {
        self.steps
    }

    fn step(&mut self) -> Result<()> {
        self.advance().map(|_| ())
    }

    fn mark(&self) -> Checkpoint {
        let integrator = &self.integrator;
        Checkpoint {
            step: integrator.step.clone(),
            predictor: integrator.predictor.clone(),
            curvature: integrator.curvature,
            next: self.next,
            length: self.length,
            counts: [self.steps, self.grid_steps, self.failed_steps, integrator.iterations],
        }
    }

    fn mark_bytes(&self) -> usize {
        let State { q, l, .. } = &self.integrator.step.new;
        let step = 2 * (4 * q.len() + l.len());
        size_of::<Checkpoint>() + size_of::<f64>() * (step + self.integrator.predictor.numbers())
    }

    fn resume(&mut self, mark: &Checkpoint) -> Result<()> {
        let integrator = &mut self.integrator;
        integrator.step.clone_from(&mark.step);
        integrator.predictor.clone_from(&mark.predictor);
        integrator.curvature = mark.curvature;
        (self.next, self.length) = (mark.next, mark.length);
        [self.steps, self.grid_steps, self.failed_steps, integrator.iterations] = mark.counts;
        Ok(())
    }

    fn write(&self, to: &mut Vec<f64>) {
        let State { t, q, v, a, l } = &self.integrator.step.new;
        to.extend([*t, self.length]);
        [q, v, a, l].into_iter().for_each(|values| to.extend_from_slice(values));
    }

    fn width(&self) -> usize {
        let State { q, l, .. } = &self.integrator.step.new;
        2 + 3 * q.len() + l.len()
    }
}
