//! Explicit steps in a limited memory, kept for derivatives.

use crate::Result;
use crate::checkpointing::trajectory_store::{Checkpointable, TrajectoryStore};
use crate::integrators::explicit::mechanism::MechanismRhs;
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::simulation::Start;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::system::System;

/// The steps of a mechanism's motion.
pub struct ExplicitRecording {
    /// The equations, for their numbering.
    pub system: System,
    /// Where the motion starts.
    pub start: Start,
    /// Ends of steps: time, state and rates.
    pub log: TrajectoryStore<Checkpoint>,
}

impl ExplicitRecording {
    /// Of a motion that has not begun; `limit` is the most memory in bytes.
    pub fn of(march: &OdeDriver<MechanismRhs<'_>>, start: Start, limit: usize) -> Self {
        Self { system: march.stepper.flow.system.clone(), start, log: TrajectoryStore::of(march, limit) }
    }
}

/// A check-point: the end of a step.
#[derive(Clone)]
pub struct Checkpoint {
    /// Time, state and rates.
    end: Vec<f64>,
    next: f64,
    taken: usize,
    failed_steps: usize,
}

impl<F: OdeRhs> Checkpointable for OdeDriver<F> {
    type Checkpoint = Checkpoint;

    fn taken(&self) -> usize {
        self.steps.len()
    }

    fn step(&mut self) -> Result<()> {
        self.advance()
    }

    fn mark(&self) -> Checkpoint {
        let mut end = Vec::with_capacity(self.width());
        self.write(&mut end);
        Checkpoint { end, next: self.next, taken: self.steps.len(), failed_steps: self.failed_steps }
    }

    fn mark_bytes(&self) -> usize {
        size_of::<Checkpoint>() + size_of::<f64>() * self.width()
    }

    fn resume(&mut self, mark: &Checkpoint) -> Result<()> {
        self.stepper.put(&mark.end, mark.taken > 0);
        self.steps.resize(mark.taken, 0.0);
        (self.next, self.failed_steps) = (mark.next, mark.failed_steps);
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
