//! The steps of an explicit integration, and their linearized stages.

use crate::Result;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::{ElementWorkspaces, Linearizer};
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::mechanism::{Projected, SAMPLE, StageRecord, StepRecord};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::mechanism::Mechanism;
use crate::system::state::State;
use rayon::prelude::*;
use std::ops::Range;

/// Latest action of an integration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum StepEvent {
    /// Evaluated the initial state.
    Start,
    /// Accepted the step between these times (s).
    Step([f64; 2]),
    /// Evaluated the state at the output time `t` (s), by dense output or at the end of the step.
    Output { t: f64, is_dense: bool },
}

/// An integration up to the last of its output times.
pub(crate) struct ExplicitSteps<'t, F> {
    pub driver: OdeDriver<F>,
    times: &'t [f64],
    /// Number of output times that have been reached.
    reached: usize,
    is_started: bool,
    /// The state at the last output time.
    pub output_state: Vec<f64>,
}

impl<'t, F: OdeRhs> ExplicitSteps<'t, F> {
    pub fn new(driver: OdeDriver<F>, times: &'t [f64]) -> Self {
        let output_state = driver.stepper.old.clone();
        Self { driver, times, reached: 0, is_started: false, output_state }
    }

    /// Takes the next step, or evaluates the next output time by `sample`, which returns whether it used dense output.
    pub fn advance(
        &mut self,
        sample: impl FnOnce(&mut OdeDriver<F>, &mut [f64], f64) -> Result<bool>,
    ) -> Result<Option<StepEvent>> {
        if !std::mem::replace(&mut self.is_started, true) {
            return Ok(Some(StepEvent::Start));
        }
        let Some(&t) = self.times.get(self.reached) else { return Ok(None) };
        if self.driver.is_before(t) {
            self.driver.advance()?;
            return Ok(Some(StepEvent::Step(self.driver.stepper.t)));
        }
        let is_dense = sample(&mut self.driver, &mut self.output_state, t)?;
        self.reached += 1;
        Ok(Some(StepEvent::Output { t, is_dense }))
    }
}

/// The stages of a step with their derivatives, linearized once for all design variables.
pub(crate) struct LinearizedStages {
    pub event: StepEvent,
    /// States and factorizations of the step, moved here from the equations while derivatives are computed.
    record: Option<StepRecord>,
    /// Derivatives of the accelerations' rows at each stage.
    pub entries: Vec<Entries>,
    /// Derivatives of both projections, see [`Linearizer::projections`].
    pub projections: [Entries; 3],
    /// True if the rates at the beginning of the step are on other sides of switching functions than those at the end of the last one.
    pub is_restarted: bool,
    /// Distribution of the stages.
    pub grading: Grading,
    /// True if there are no constraints to project onto.
    pub is_free: bool,
    /// Positions before the projection, with the correction of the velocities.
    corrections: State<f64>,
    workspaces: Vec<ElementWorkspaces>,
}

impl LinearizedStages {
    /// Storage for the stages of a mechanism in the state `state`.
    pub fn new(linearizer: &Linearizer, state: &State<f64>) -> Self {
        Self {
            event: StepEvent::Start,
            record: None,
            entries: vec![linearizer.entries(); SAMPLE + 1],
            projections: [(); 3].map(|()| linearizer.entries()),
            is_restarted: false,
            grading: Grading::Even,
            is_free: state.l.is_empty(),
            corrections: state.clone(),
            workspaces: vec![ElementWorkspaces::default(); SAMPLE + 2],
        }
    }

    /// Takes the record of the step from the equations.
    pub fn take_record(&mut self, from: &mut Option<StepRecord>) {
        self.record = from.take();
    }

    /// Returns the record of the step to the equations.
    pub fn return_record(&mut self, to: &mut Option<StepRecord>) {
        if self.record.is_some() {
            *to = self.record.take();
        }
    }

    /// The states and factorizations of the step.
    pub fn record(&self) -> &StepRecord {
        self.record.as_ref().expect("the record is here while derivatives are computed")
    }

    /// The states and factorizations of the step, for solutions in place.
    pub fn record_mut(&mut self) -> &mut StepRecord {
        self.record.as_mut().expect("the record is here while derivatives are computed")
    }

    /// The projections at the end of the step, for solutions in place, and their derivatives.
    pub fn projected_mut(&mut self) -> (&mut Projected, &[Entries; 3]) {
        let record = self.record.as_mut().expect("the record is here while derivatives are computed");
        (&mut record.projected, &self.projections)
    }

    /// Differentiates the rows at the stages `slots`.
    pub fn linearize(
        &mut self,
        linearizer: &Linearizer,
        mechanism: &Mechanism<f64>,
        slots: Range<usize>,
        is_parallel: bool,
    ) {
        let Self { record, entries, workspaces, .. } = self;
        let stages = &record.as_ref().expect("the record is here").stages[slots.clone()];
        let tasks = (&mut entries[slots.clone()], stages, &mut workspaces[slots]);
        let task = |(entries, stage, workspaces): (&mut Entries, &StageRecord, &mut ElementWorkspaces)| {
            linearizer.accelerations(mechanism, &stage.state, workspaces, entries);
        };
        if is_parallel {
            tasks.into_par_iter().for_each(task);
        } else {
            tasks.0.iter_mut().zip(tasks.1).zip(tasks.2).for_each(|((e, s), w)| task((e, s, w)));
        }
    }

    /// Differentiates the projections at the end of the step.
    pub fn linearize_projections(&mut self, linearizer: &Linearizer, mechanism: &Mechanism<f64>) {
        let Self { record, corrections, workspaces, projections, is_free, .. } = self;
        if *is_free {
            return;
        }
        let projected = &record.as_ref().expect("the record is here").projected;
        corrections.copy_from(&projected.before);
        corrections.a.copy_from_slice(&projected.after.a);
        corrections.l.copy_from_slice(&projected.after.l);
        linearizer.projections(mechanism, projected, corrections, &mut workspaces[SAMPLE + 1], projections);
    }
}
