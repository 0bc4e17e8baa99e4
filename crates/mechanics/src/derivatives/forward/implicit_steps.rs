//! Converged implicit steps with their factorized matrices, simulated or read from a recording.

use crate::analyses::dynamics::{Dynamics, Work, is_before};
use crate::analyses::sampling::OutputRecorder;
use crate::checkpointing::recording::{Recording, StepInterval};
use crate::derivatives::propagation::StepSource;
use crate::initial_conditions::Projection;
use crate::integrators::event_location::is_very_short;
use crate::integrators::generalized_alpha::GeneralizedAlpha;
use crate::integrators::settings::StepSize;
use crate::integrators::step_events::StepEvents;
use crate::integrators::time_stepper::TimeStepper;
use crate::linalg::factor::Factor;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::{Result, diagnostics};

/// Largest number of steps in a block: enough for a small cost of synchronization between threads.
const BLOCK_LENGTH: usize = 8;

/// A converged step, linearized at its end.
#[derive(Clone)]
pub(crate) struct ConvergedStep {
    /// Length in s.
    pub h: f64,
    /// The state at the end.
    pub end: State<f64>,
    /// The factorized matrix at the end.
    pub factor: Factor,
    /// Events at its ends.
    pub events: StepEvents,
}

impl ConvergedStep {
    /// Returns whether the end of the step, and its derivatives, are extrapolated from its beginning, for steps `nominal`.
    pub fn is_extrapolated(&self, nominal: StepSize) -> bool {
        self.events.closed.is_some() && is_very_short(self.h, nominal)
    }
}

/// Consecutive converged steps.
pub(crate) struct StepBlock {
    storage: Vec<ConvergedStep>,
    count: usize,
}

impl StepBlock {
    /// The steps, first to last.
    pub fn steps(&self) -> &[ConvergedStep] {
        &self.storage[..self.count]
    }
}

/// Output times in the order in which the steps of a motion reach them.
pub(crate) struct OutputTimes<'m> {
    start: f64,
    times: &'m [f64],
    reached: usize,
}

impl<'m> OutputTimes<'m> {
    /// Output times of a motion that begins at `start` (s).
    pub fn new(start: f64, times: &'m [f64]) -> Self {
        Self { start, times, reached: 0 }
    }

    /// The next time, if a step that ends at `end` (s) reaches it.
    pub fn next_until(&mut self, end: f64) -> Option<f64> {
        let t = *self.times.get(self.reached)?;
        if is_before(self.start, end, t) {
            return None;
        }
        self.reached += 1;
        Some(t)
    }

    /// Returns whether all times have been reached.
    pub fn is_done(&self) -> bool {
        self.reached == self.times.len()
    }
}

/// The converged steps of a motion, from a simulation or from a recording.
pub(crate) struct ImplicitSteps<'m> {
    pub mechanism: &'m Mechanism<f64>,
    pub system: System,
    /// The initial state.
    pub start: State<f64>,
    /// Multipliers of the initial projections.
    pub projection: Projection,
    scheme: GeneralizedAlpha,
    rows: Vec<[f64; 1]>,
    origin: StepOrigin<'m>,
}

/// Source of the steps.
enum StepOrigin<'m> {
    Simulation(Box<RecordedSimulation<'m>>),
    /// The steps from number `next` up to `end`.
    Recording {
        recording: &'m Recording,
        next: usize,
        end: usize,
    },
}

impl<'m> ImplicitSteps<'m> {
    /// Simulates `mechanism` up to the last of `times`, and records its outputs.
    ///
    /// # Errors
    /// As [`TimeStepper::new`].
    pub fn simulated(mechanism: &'m Mechanism<f64>, settings: &Dynamics, times: &'m [f64]) -> Result<Self> {
        let stepper = TimeStepper::new(mechanism, settings, times)?;
        let start = stepper.integrator.step.new.clone();
        let (system, projection) = (stepper.integrator.system.clone(), stepper.projection.clone());
        let (recorder, at) = (OutputRecorder::new(mechanism, times.len()), start.clone());
        let times = OutputTimes::new(settings.start, times);
        let mut simulation = Box::new(RecordedSimulation { stepper, recorder, times, at });
        simulation.record_outputs()?;
        let (rows, origin) = (vec![[0.0]; system.size()], StepOrigin::Simulation(simulation));
        Ok(Self { mechanism, system, start, projection, scheme: settings.scheme, rows, origin })
    }

    /// Reads a recording of `mechanism` up to the last of `times`.
    pub fn recorded(
        mechanism: &'m Mechanism<f64>,
        recording: &'m Recording,
        settings: &Dynamics,
        times: &[f64],
    ) -> Self {
        let end = times.last().map_or(0, |&last| recording.store.steps_to(last));
        let (system, start) = (recording.system.clone(), recording.start.clone());
        let (rows, projection) = (vec![[0.0]; system.size()], recording.projection.clone());
        let origin = StepOrigin::Recording { recording, next: 0, end };
        Self { mechanism, system, start, projection, scheme: settings.scheme, rows, origin }
    }

    /// Loads the next step, if there is one, and factorizes its matrix.
    fn load_next(&mut self, step: &mut ConvergedStep) -> Result<bool> {
        match &mut self.origin {
            StepOrigin::Simulation(simulation) => {
                let Some(h) = simulation.advance()? else { return Ok(false) };
                let stepper = &simulation.stepper;
                step.h = h;
                step.end.copy_from(&stepper.integrator.step.new);
                step.events = stepper.events;
            }
            StepOrigin::Recording { next, end, .. } if next == end => return Ok(false),
            StepOrigin::Recording { recording, next, .. } => {
                StepInterval { h: step.h, events: step.events } = recording.load(*next, &mut step.end);
                *next += 1;
            }
        }
        let scheme = self.scheme.after_event(step.events.since_event);
        let (position, velocity) = scheme.newmark_coefficients(step.h);
        self.system.assemble(self.mechanism, &step.end, Linearization::step(position, velocity), &mut self.rows);
        diagnostics::factorize(&mut self.system, self.mechanism, &step.end)?;
        self.system.swap_factor(&mut step.factor);
        Ok(true)
    }

    /// The recorded outputs of a simulation, and its work.
    pub fn finish(self) -> Option<(OutputRecorder, Work)> {
        match self.origin {
            StepOrigin::Simulation(simulation) => Some((simulation.recorder, simulation.stepper.work())),
            StepOrigin::Recording { .. } => None,
        }
    }
}

impl StepSource for ImplicitSteps<'_> {
    type Block = StepBlock;

    fn block(&mut self) -> StepBlock {
        let (end, factor) = (self.start.clone(), self.system.factor().clone());
        let step = ConvergedStep { h: 0.0, end, factor, events: StepEvents::default() };
        StepBlock { storage: vec![step; BLOCK_LENGTH], count: 0 }
    }

    fn fill(&mut self, block: &mut StepBlock) -> Result<bool> {
        block.count = 0;
        for step in &mut block.storage {
            if !self.load_next(step)? {
                break;
            }
            block.count += 1;
        }
        Ok(block.count > 0)
    }
}

/// A simulation whose outputs are recorded while it runs.
struct RecordedSimulation<'m> {
    stepper: TimeStepper<'m>,
    recorder: OutputRecorder,
    times: OutputTimes<'m>,
    at: State<f64>,
}

impl RecordedSimulation<'_> {
    /// Takes a step, unless the last output time has been reached. Returns its length in s.
    fn advance(&mut self) -> Result<Option<f64>> {
        if self.times.is_done() || self.stepper.has_ended() {
            return Ok(None);
        }
        let h = self.stepper.advance()?;
        self.record_outputs()?;
        Ok(Some(h))
    }

    fn record_outputs(&mut self) -> Result<()> {
        let mechanism = self.stepper.integrator.mechanism;
        let (end, has_ended) = (self.stepper.integrator.step.new.t, self.stepper.has_ended());
        // After the end of the motion the outputs keep their values.
        while let Some(t) = self.times.next_until(if has_ended { f64::INFINITY } else { end }) {
            self.stepper.sample(t, &mut self.at);
            self.recorder.record_held(mechanism, &self.at, self.stepper.locator.held.as_ref())?;
        }
        Ok(())
    }
}
