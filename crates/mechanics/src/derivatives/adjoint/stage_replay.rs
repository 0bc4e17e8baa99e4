//! The explicit steps of a motion in reverse, repeated for their stages.

use crate::Result;
use crate::checkpointing::recording::ExplicitRecording;
use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::checkpointing::trajectory_store::Checkpointable;
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::initial_conditions::gradients_from_start;
use crate::derivatives::adjoint::problem::{AdjointProblem, ReplayStatistics};
use crate::integrators::explicit::mechanism::{MechanismRhs, sample, start};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::system::state::State;
use nalgebra::DMatrix;

/// The recorded explicit steps of a motion, which a driver repeats one by one and stores the stages of each.
pub(super) struct StageReplay<'m> {
    pub recording: &'m ExplicitRecording,
    pub playback: ReversePlayback<'m, OdeDriver<MechanismRhs<'m>>>,
    /// Repeats the steps and stores their stages.
    pub driver: OdeDriver<MechanismRhs<'m>>,
    /// Time, state and rates at the start of the motion.
    pub first: Vec<f64>,
    /// True after the evaluation of an output inside the loaded step.
    pub is_dense: bool,
    /// Workspace for the state at an output time.
    at: Vec<f64>,
}

impl<'m> StageReplay<'m> {
    /// Replay of a `recording`, and the initial state of its motion.
    pub fn new(
        problem: &'m AdjointProblem<'m>,
        settings: &'m Explicit,
        times: &'m [f64],
        recording: &'m ExplicitRecording,
    ) -> Result<(Self, State<f64>)> {
        let mechanism = &problem.mechanism;
        let playback = ReversePlayback::new(&recording.store, || Ok(start(mechanism, settings, times, false)?.0))?;
        let (driver, begin) = start(mechanism, settings, times, true)?;
        let (mut first, at) = (Vec::new(), driver.stepper.old.clone());
        driver.write(&mut first);
        Ok((Self { recording, playback, driver, first, is_dense: false, at }, begin.state))
    }

    /// Number of steps of the motion that reach the output time `t` (s).
    pub fn steps_to(&self, t: f64) -> usize {
        self.recording.store.steps_to(t)
    }

    /// Evaluates the stage for outputs at the time `t` (s). Returns the elapsed fraction of the loaded step, or `None` at its end.
    pub fn sample(&mut self, t: f64) -> Result<Option<f64>> {
        let is_dense = sample(&mut self.driver, &mut self.at, t)?;
        self.is_dense |= is_dense;
        let stepper = &self.driver.stepper;
        Ok(is_dense.then(|| (t - stepper.t[0]) / stepper.length()))
    }

    /// Evaluates the first stage at the start of the motion.
    pub fn evaluate_start(&mut self) -> Result<()> {
        let OdeDriver { stepper, scratch, .. } = &mut self.driver;
        scratch.resize(stepper.old.len(), 0.0);
        stepper.rhs.rates(0, stepper.t[0], &stepper.old, scratch)
    }

    /// Gradients from the adjoint states at the start of the motion, and the cost of the reverse pass.
    pub fn gradients(
        &self,
        problem: &AdjointProblem<'_>,
        batches: Vec<&mut AdjointBatch>,
    ) -> Result<(DMatrix<f64>, ReplayStatistics)> {
        let statistics = ReplayStatistics::of(self.recording.store.steps(), &self.playback);
        Ok((gradients_from_start(problem, self.recording, batches)?, statistics))
    }
}
