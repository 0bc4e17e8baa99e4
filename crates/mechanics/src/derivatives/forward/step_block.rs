//! Converged steps with their factorized matrices, some in a row.

use crate::Result;
use crate::analyses::dynamics::{Dynamics, Work};
use crate::analyses::sampling::interpolate;
use crate::checkpointing::recording::Recording;
use crate::derivatives::history::Record;
use crate::diagnostics;
use crate::initial_conditions::Projection;
use crate::integrators::generalized_alpha::GeneralizedAlpha;
use crate::integrators::time_stepper::TimeStepper;
use crate::linalg::factor::Factor;
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::linearization::Linearization;
use crate::system::state::State;

/// Steps in a stretch: enough that handing them over does not count.
const LENGTH: usize = 8;

/// A converged step, linearized at its end.
#[derive(Clone)]
pub(crate) struct ConvergedStep {
    /// Length in s.
    pub h: f64,
    /// The state at the end.
    pub end: State<f64>,
    /// Factorized matrix there.
    pub factor: Factor,
    /// The contact that closes there.
    pub closed: Option<usize>,
    /// Whether the end is at a given time.
    pub is_on_grid: bool,
}

/// What goes along with converged steps.
pub(crate) trait StepConsumer: Send {
    /// Derivatives along a stretch of steps, and of the outputs there.
    fn follow(&mut self, stretch: &StepBlock) -> Result<()>;
}

/// Steps in a row.
pub(crate) struct StepBlock {
    workspace: Vec<ConvergedStep>,
    count: usize,
}

impl StepBlock {
    /// Room for steps of `source`.
    pub fn new(source: &mut StepSource<'_>) -> Self {
        let (end, factor) = (source.start.clone(), source.system.factor().clone());
        let taken = ConvergedStep { h: 0.0, end, factor, closed: None, is_on_grid: true };
        Self { workspace: vec![taken; LENGTH], count: 0 }
    }

    /// The steps.
    pub fn taken(&self) -> &[ConvergedStep] {
        &self.workspace[..self.count]
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Takes the next steps, none if the end has been reached.
    pub fn fill(&mut self, source: &mut StepSource<'_>) -> Result<()> {
        self.count = 0;
        for taken in &mut self.workspace {
            if !source.next(taken)? {
                break;
            }
            self.count += 1;
        }
        Ok(())
    }
}

/// Where converged steps come from, and what their matrices are made with.
pub(crate) struct StepSource<'m> {
    pub mechanism: &'m Mechanism<f64>,
    pub system: System,
    /// Where the motion starts.
    pub start: State<f64>,
    pub projection: Projection,
    scheme: GeneralizedAlpha,
    rows: Vec<[f64; 1]>,
    steps: Steps<'m>,
}

enum Steps<'m> {
    Running(Box<Running<'m>>),
    /// Those from number `next` up to `end`.
    Recorded {
        recording: &'m Recording,
        next: usize,
        end: usize,
    },
}

impl<'m> StepSource<'m> {
    /// A simulation that has not begun; its outputs go to `record`.
    pub fn running(run: TimeStepper<'m>, record: Record, settings: &Dynamics, times: &'m [f64]) -> Result<Self> {
        let integrator = &run.integrator;
        let (mechanism, start) = (integrator.mechanism, integrator.step.new.clone());
        let (system, projection) = (integrator.system.clone(), run.projection.clone());
        let mut running = Box::new(Running { at: start.clone(), run, record, times, passed: 0 });
        running.sample()?;
        let rows = vec![[0.0]; system.size()];
        Ok(Self { mechanism, system, start, projection, scheme: settings.scheme, rows, steps: Steps::Running(running) })
    }

    /// A recording of `mechanism`, as far as the last of `times`.
    pub fn recorded(
        mechanism: &'m Mechanism<f64>,
        recording: &'m Recording,
        settings: &Dynamics,
        times: &[f64],
    ) -> Self {
        let end = times.last().map_or(0, |&last| recording.log.steps_to(last));
        let (system, start) = (recording.system.clone(), recording.start.clone());
        let (rows, projection) = (vec![[0.0]; system.size()], recording.projection.clone());
        let steps = Steps::Recorded { recording, next: 0, end };
        Self { mechanism, system, start, projection, scheme: settings.scheme, rows, steps }
    }

    /// The next step, if there is one.
    fn next(&mut self, taken: &mut ConvergedStep) -> Result<bool> {
        match &mut self.steps {
            Steps::Running(running) => {
                let Some(h) = running.advance()? else { return Ok(false) };
                taken.h = h;
                taken.end.copy_from(&running.run.integrator.step.new);
                (taken.closed, taken.is_on_grid) = (running.run.locator.closed, running.run.is_on_grid);
            }
            Steps::Recorded { next, end, .. } if next == end => return Ok(false),
            Steps::Recorded { recording, next, .. } => {
                taken.h = recording.load(*next, &mut taken.end);
                *next += 1;
            }
        }
        let (position, velocity) = self.scheme.newmark_coefficients(taken.h);
        self.system.assemble(self.mechanism, &taken.end, Linearization::step(position, velocity), &mut self.rows);
        diagnostics::factorize(&mut self.system, self.mechanism, &taken.end)?;
        self.system.swap_factor(&mut taken.factor);
        Ok(true)
    }

    /// The outputs and the work of a simulation that ran.
    pub fn finish(self) -> Option<(Record, Work)> {
        match self.steps {
            Steps::Running(running) => Some((running.record, running.run.work())),
            Steps::Recorded { .. } => None,
        }
    }
}

/// A simulation whose outputs are recorded as it runs.
struct Running<'m> {
    run: TimeStepper<'m>,
    record: Record,
    times: &'m [f64],
    /// Number of `times` that have been passed.
    passed: usize,
    at: State<f64>,
}

impl Running<'_> {
    /// Takes a step, if the last of the times has not been reached.
    fn advance(&mut self) -> Result<Option<f64>> {
        if self.passed == self.times.len() {
            return Ok(None);
        }
        let h = self.run.advance()?;
        self.sample()?;
        Ok(Some(h))
    }

    /// Outputs at the times that the step has reached.
    fn sample(&mut self) -> Result<()> {
        while let Some(&t) = self.times.get(self.passed).filter(|&&t| !self.run.is_before(t)) {
            let step = &self.run.integrator.step;
            interpolate(&step.old, &step.new, t, &mut self.at);
            self.record.values(self.passed, self.run.integrator.mechanism, &self.at)?;
            self.passed += 1;
        }
        Ok(())
    }
}
