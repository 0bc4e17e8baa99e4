//! The discrete adjoint of a motion by explicit steps in relative coordinates.
//!
//! At a stage the joints' rows vanish, r(q, v, v̇, p) = 0 with the mass matrix A = ∂r/∂v̇. With ψ = −A⁻¹ ā the derivatives with respect
//! to everything else are ψᵀ ∂r = ∂(ψ_absᵀ r_abs), where ψ_abs = J ψ are the virtual displacements of the bodies: products of the
//! elements, and one transposed sweep of the tree. A reaction λ is a power as well: that of a virtual displacement that opens its joint.

mod stage;
mod sweeps;

use crate::Result;
use crate::checkpointing::recording::ExplicitRecording;
use crate::derivatives::adjoint::problem::{
    AdjointProblem, OutputTerm, ReplayStatistics, ReverseSteps, propagate_backwards,
};
use crate::derivatives::adjoint::stage_replay::StageReplay;
use crate::integrators::explicit::mechanism::SAMPLE;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::tableau::Tableau;
use crate::tree::dynamics::TreeDynamics;
use nalgebra::DMatrix;
use stage::RelativeStage;
use sweeps::{RelativeAdjoint, Target};

/// Computes gradients from the `recording` of a motion whose unknowns are those of `dynamics`.
pub(crate) fn solve_relative(
    problem: &AdjointProblem<'_>,
    settings: &Explicit,
    times: &[f64],
    recording: &ExplicitRecording,
    dynamics: TreeDynamics,
) -> Result<(DMatrix<f64>, ReplayStatistics)> {
    let mut steps = ReverseRelativeSteps::new(problem, settings, times, recording, dynamics)?;
    propagate_backwards(problem, &mut steps)?;
    steps.finish()?;
    steps.replay.gradients(problem, steps.adjoints.iter_mut().map(|adjoint| &mut adjoint.batch).collect())
}

/// The explicit steps of a motion, repeated for their stages, with the adjoint states of all responses.
struct ReverseRelativeSteps<'m> {
    adjoints: Vec<RelativeAdjoint>,
    replay: StageReplay<'m>,
    stage: RelativeStage<'m>,
    method: &'static Tableau,
    /// Length of the step in s.
    h: f64,
    /// End of the step to load next in s: the beginning of the last one.
    next_end: Option<f64>,
}

impl<'m> ReverseRelativeSteps<'m> {
    fn new(
        problem: &'m AdjointProblem<'m>,
        settings: &'m Explicit,
        times: &'m [f64],
        recording: &'m ExplicitRecording,
        dynamics: TreeDynamics,
    ) -> Result<Self> {
        let (replay, begin) = StageReplay::new(problem, settings, times, recording)?;
        let (method, system) = (replay.driver.stepper.method, &replay.driver.stepper.rhs.system);
        let new = |_| RelativeAdjoint::new(&problem.mechanism, system, &dynamics.tree, method);
        let adjoints = (0..problem.batches()).map(new).collect();
        let stage = RelativeStage::new(problem, system, dynamics, begin);
        Ok(Self { adjoints, replay, stage, method, h: 0.0, next_end: None })
    }

    /// Computes the stage in `slot`.
    fn load_stage(&mut self, slot: usize) -> Result<()> {
        let relative = self.replay.driver.stepper.rhs.relative.as_ref().expect("the coordinates are relative");
        let stage = &relative.stages.as_ref().expect("the stages are recorded")[slot];
        self.stage.load(stage.t, &stage.y, slot == SAMPLE)
    }

    /// Propagates from the rates at the stage in `slot` to the beginning of the step and to the rates of earlier stages.
    fn differentiate_stage(&mut self, slot: usize) -> Result<()> {
        self.load_stage(slot)?;
        for adjoint in &mut self.adjoints {
            adjoint.differentiate_rates(&mut self.stage, slot);
            adjoint.add_joints(1.0, Target::Begin);
            for &(j, weight) in self.method.stages[slot] {
                adjoint.add_joints(self.h * weight, Target::Rates(j));
            }
        }
        Ok(())
    }

    /// Propagates from the rates at the start of the motion to the built state, whose derivatives are then in the batches.
    fn finish(&mut self) -> Result<()> {
        self.replay.evaluate_start()?;
        self.load_stage(0)?;
        let (end, begin) = (self.method.end, &self.replay.recording.start.state);
        for adjoint in &mut self.adjoints {
            adjoint.differentiate_rates(&mut self.stage, end);
            adjoint.add_joints(1.0, Target::End);
            adjoint.take_joint_state(&self.stage.problem.mechanism, &self.stage.dynamics.tree, begin);
        }
        Ok(())
    }
}

impl ReverseSteps for ReverseRelativeSteps<'_> {
    fn steps_to(&self, t: f64) -> usize {
        self.replay.steps_to(t)
    }

    fn load_step(&mut self, k: usize) -> Result<()> {
        let StageReplay { playback, driver, first, is_dense, .. } = &mut self.replay;
        let end = match self.next_end {
            Some(end) => end,
            None => playback.row(k)?[0],
        };
        let begin = if k > 0 { playback.row(k - 1)? } else { &*first };
        self.next_end = Some(begin[0]);
        driver.stepper.put(begin, false);
        driver.stepper.attempt(end, None)?;
        (self.h, *is_dense) = (driver.stepper.length(), false);
        Ok(())
    }

    fn contains(&self, k: usize, t: f64) -> bool {
        self.steps_to(t) > k
    }

    fn add_outputs(&mut self, t: f64, terms: &[OutputTerm]) -> Result<()> {
        let weights = self.replay.sample(t)?.map(|fraction| self.method.dense_weights(fraction));
        self.load_stage(SAMPLE)?;
        for (k, adjoint) in self.adjoints.iter_mut().enumerate() {
            let mut terms = terms.iter().filter(|term| term.batch == k).peekable();
            if terms.peek().is_some() {
                adjoint.add_outputs(&mut self.stage, terms, weights, self.h);
            }
        }
        Ok(())
    }

    fn propagate_to_step_start(&mut self) -> Result<()> {
        let (method, end) = (self.method, self.method.end);
        if self.replay.is_dense {
            (end + 1..method.slots()).rev().try_for_each(|slot| self.differentiate_stage(slot))?;
        }
        self.load_stage(end)?;
        for adjoint in &mut self.adjoints {
            adjoint.differentiate_rates(&mut self.stage, end);
            adjoint.add_joints(1.0, Target::End);
        }
        // The projection places the bodies elsewhere.
        let relative = self.replay.driver.stepper.rhs.relative.as_ref().expect("the coordinates are relative");
        for adjoint in &mut self.adjoints {
            self.stage.dynamics.tree.space.transpose_normalization(&relative.unprojected, &mut adjoint.end);
            if !self.stage.dynamics.tree.cuts.is_empty() {
                adjoint.differentiate_projection(&mut self.stage, &relative.projection);
            }
            adjoint.differentiate_end(method, self.h);
        }
        (1..end).rev().try_for_each(|slot| self.differentiate_stage(slot))?;
        self.adjoints.iter_mut().for_each(|adjoint| adjoint.move_to_earlier_step(end));
        Ok(())
    }

    fn load_start(&mut self) -> Result<()> {
        self.replay.driver.stepper.put(&self.replay.first, false);
        self.h = 0.0;
        Ok(())
    }
}
