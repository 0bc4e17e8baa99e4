//! Explicit steps in relative coordinates, repeated in numbers with derivatives: first and second derivatives.
//!
//! The stages of a step are the formulas of the method in numbers with derivatives. At each stage the rows of the joints vanish,
//! r(q, v, v̇, b) = 0. The factorized mass matrix A = ∂r/∂v̇ of the values gives the derivatives of accelerations by one correction
//! v̇ ← v̇ − A⁻¹ r for each order: the recursion itself is not differentiated.

use crate::Result;
use crate::analyses::sampling::{OutputRecorder, Sampler};
use crate::derivatives::forward::explicit::explicit_steps::{ExplicitSteps, StepEvent};
use crate::derivatives::forward::initial_conditions::InitialDerivatives;
use crate::derivatives::history::OutputGradients;
use crate::derivatives::propagation::{Schedule, StepConsumer, StepSource, propagate};
use crate::diagnostics::check_finite;
use crate::integrators::explicit::mechanism::{ConsistentState, MechanismRhs, sample};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::tableau::Tableau;
use crate::integrators::settings::Work;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::system::System;
use crate::system::state::State;
use crate::tree::TreeDynamics;
use crate::tree::dynamics::TreeResidual;

/// Smallest product of joint coordinates, mechanisms and derivatives of each for which threads are faster.
const WORTH_THREADS: usize = 400;

/// Propagates the `L` derivatives of each of the `mechanisms` along the steps of `driver`, whose unknowns are those of
/// `dynamics`, to the last of `times`.
pub(crate) fn propagate_relative<T: DerivativeScalar<L>, const L: usize>(
    mechanisms: &[Mechanism<T>],
    dynamics: &TreeDynamics,
    mut driver: OdeDriver<MechanismRhs<'_>>,
    begin: &ConsistentState,
    times: &[f64],
) -> Result<(OutputRecorder, Work, OutputGradients)>
where
    Jet2<T>: ElementScalar,
{
    let (method, rhs) = (driver.stepper.method, &mut driver.stepper.rhs);
    let plain = rhs.mechanism;
    let steps =
        |mechanism| RelativeSteps::new((plain, mechanism), dynamics, &mut rhs.system, method, begin, times.len());
    let mut consumers = mechanisms.iter().map(steps).collect::<Result<Vec<_>>>()?;
    let recorder = OutputRecorder::new(plain, times.len());
    let mut source = RecordedSteps { mechanism: plain, steps: ExplicitSteps::new(driver, times), recorder };
    let is_parallel = dynamics.tree.count * mechanisms.len() * L >= WORTH_THREADS && mechanisms.len() > 1;
    propagate(&mut source, &mut consumers, if is_parallel { Schedule::Parallel } else { Schedule::Sequential })?;
    let derivatives = consumers.into_iter().map(|steps| steps.derivatives).collect();
    let gradients = OutputGradients::new(plain.outputs.len(), L, derivatives);
    Ok((source.recorder, source.steps.driver.work(), gradients))
}

/// The explicit steps of a mechanism, whose outputs are recorded.
struct RecordedSteps<'m> {
    mechanism: &'m Mechanism<f64>,
    steps: ExplicitSteps<'m, MechanismRhs<'m>>,
    recorder: OutputRecorder,
}

impl StepSource for RecordedSteps<'_> {
    type Block = StepEvent;

    fn block(&mut self) -> StepEvent {
        StepEvent::Start
    }

    /// Fills the block with one step, or with the state at one output time.
    fn fill(&mut self, event: &mut StepEvent) -> Result<bool> {
        let Some(next) = self.steps.advance(sample)? else { return Ok(false) };
        if let StepEvent::Output { .. } = next {
            self.recorder.record(self.mechanism, &self.steps.driver.stepper.rhs.state)?;
        }
        *event = next;
        Ok(true)
    }
}

/// Joint coordinates and velocities with `L` derivatives, which are propagated along explicit steps.
struct RelativeSteps<'m, T, const L: usize> {
    plain: &'m Mechanism<f64>,
    mechanism: &'m Mechanism<T>,
    method: &'static Tableau,
    dynamics: TreeDynamics,
    residual: TreeResidual<T>,
    /// Beginning and end of the step in s.
    t: [f64; 2],
    /// Joint coordinates, followed by their velocities, at the beginning, the end and a stage of the step.
    begin: Vec<T>,
    end: Vec<T>,
    stage: Vec<T>,
    /// Rates of the components, slot by slot.
    rates: Vec<Vec<T>>,
    is_started: bool,
    /// True after the evaluation of the slots for dense output.
    is_dense: bool,
    /// The state of all coordinates at a stage, and its values.
    state: State<T>,
    values: State<f64>,
    stage_values: Vec<f64>,
    acceleration_values: Vec<f64>,
    accelerations: Vec<T>,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
    work: Vec<[[f64; L]; 3]>,
    sampler: Sampler<T>,
    outputs: Vec<T>,
    /// Of the outputs, by time, output and design variable.
    derivatives: Vec<f64>,
}

impl<'m, T: DerivativeScalar<L>, const L: usize> RelativeSteps<'m, T, L>
where
    Jet2<T>: ElementScalar,
{
    /// Derivatives at the start of a motion with a number of output `times`.
    fn new(
        (plain, mechanism): (&'m Mechanism<f64>, &'m Mechanism<T>),
        dynamics: &TreeDynamics,
        system: &mut System,
        method: &'static Tableau,
        begin: &ConsistentState,
        times: usize,
    ) -> Result<Self> {
        let state = InitialDerivatives::new(plain, mechanism, system).consistent(&begin.state, &begin.projection)?;
        let (y, zero) = (dynamics.tree.joint_state(mechanism, &state), T::from(0.0));
        let count = dynamics.tree.count;
        Ok(Self {
            plain,
            mechanism,
            method,
            dynamics: dynamics.clone(),
            residual: TreeResidual::new(&dynamics.tree, mechanism),
            t: [begin.state.t; 2],
            rates: vec![vec![zero; y.len()]; method.slots()],
            stage_values: vec![0.0; y.len()],
            begin: y.clone(),
            end: y.clone(),
            stage: y,
            is_started: false,
            is_dense: false,
            values: begin.state.clone(),
            state,
            acceleration_values: vec![0.0; count],
            accelerations: vec![zero; count],
            rows: vec![zero; count],
            changes: vec![[0.0; L]; count],
            work: Vec::new(),
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            derivatives: Vec::with_capacity(times * mechanism.outputs.len() * L),
        })
    }

    /// Propagates the derivatives to the end of the step between `t[0]` and `t[1]`.
    fn advance(&mut self, t: [f64; 2]) -> Result<()> {
        let end = self.method.end;
        if self.is_started {
            self.rates.swap(0, end);
            std::mem::swap(&mut self.begin, &mut self.end);
        }
        (self.t, self.is_started, self.is_dense) = (t, true, false);
        for slot in 1..end {
            self.evaluate(slot)?;
        }
        self.combine(end);
        self.end.copy_from_slice(&self.stage);
        self.accelerate(t[1])?;
        self.store_rates(end);
        Ok(())
    }

    /// The rates of a slot.
    fn evaluate(&mut self, slot: usize) -> Result<()> {
        self.combine(slot);
        self.accelerate(self.t[0] + self.method.nodes[slot] * (self.t[1] - self.t[0]))?;
        self.store_rates(slot);
        Ok(())
    }

    /// Writes the components at which a slot is evaluated to the stage: y = y₀ + h Σ a k.
    fn combine(&mut self, slot: usize) {
        let Self { method, begin, stage, rates, t, .. } = self;
        let h = t[1] - t[0];
        stage.copy_from_slice(begin);
        for &(j, weight) in method.stages[slot] {
            stage.iter_mut().zip(&rates[j]).for_each(|(y, k)| *y += *k * (h * weight));
        }
    }

    /// Solves for the accelerations of the joint coordinates at the stage, at the time `t` (s).
    fn accelerate(&mut self, t: f64) -> Result<()> {
        let Self { dynamics, stage_values, stage, acceleration_values, values, plain, .. } = self;
        stage_values.iter_mut().zip(&*stage).for_each(|(value, y)| *value = y.value());
        dynamics.place(plain, t, stage_values, values);
        dynamics.accelerations(plain, stage_values, values, acceleration_values)?;
        self.accelerations.iter_mut().zip(&*acceleration_values).for_each(|(a, &value)| *a = T::from(value));
        self.state.t = T::from(t);
        self.residual.place(&dynamics.tree, self.mechanism, stage, &mut self.state);
        for _ in 0..T::ORDER {
            self.residual.evaluate(
                &dynamics.tree,
                self.mechanism,
                (stage, &self.accelerations),
                &mut self.state,
                &mut self.rows,
            );
            self.changes.iter_mut().zip(&self.rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
            dynamics.factor.solve(&dynamics.tree, &mut self.changes, &mut self.work);
            self.accelerations.iter_mut().zip(&self.changes).for_each(|(a, change)| *a += T::with(0.0, *change));
        }
        Ok(())
    }

    /// Stores the rates at the stage in a slot.
    fn store_rates(&mut self, slot: usize) {
        let n = self.accelerations.len();
        let (velocities, accelerations) = self.rates[slot].split_at_mut(n);
        velocities.copy_from_slice(&self.stage[n..]);
        accelerations.copy_from_slice(&self.accelerations);
    }

    /// Records the derivatives of the outputs at `t` (s), inside the step (`is_dense`) or at its end.
    fn record_outputs(&mut self, t: f64, is_dense: bool) -> Result<()> {
        if is_dense {
            self.interpolate(t)?;
        } else {
            self.stage.copy_from_slice(&self.end);
        }
        self.accelerate(t)?;
        let Self { residual, dynamics, mechanism, stage, accelerations, state, rows, .. } = self;
        residual.evaluate(&dynamics.tree, mechanism, (stage, accelerations), state, rows);
        residual.reactions(&dynamics.tree, stage, state);
        self.sampler.outputs(mechanism, state, &mut self.outputs);
        check_finite(mechanism, &self.outputs, t)?;
        self.derivatives.extend(self.outputs.iter().flat_map(|output| output.derivatives()));
        Ok(())
    }

    /// Writes the components at `t` (s) to the stage, by dense output.
    fn interpolate(&mut self, t: f64) -> Result<()> {
        if !std::mem::replace(&mut self.is_dense, true) {
            for slot in self.method.end + 1..self.method.slots() {
                self.evaluate(slot)?;
            }
        }
        let Self { method, begin, end, stage, rates, t: [from, to], .. } = self;
        let h = *to - *from;
        let weights = method.dense_weights((t - *from) / h);
        for (i, y) in stage.iter_mut().enumerate() {
            let slots = rates.iter().zip(weights.slots).filter(|(_, weight)| *weight != 0.0);
            let change = (end[i] - begin[i]) * weights.change;
            *y = slots.fold(begin[i] + change, |sum, (slot, weight)| sum + slot[i] * (h * weight));
        }
        Ok(())
    }
}

impl<T: DerivativeScalar<L>, const L: usize> StepConsumer<StepEvent> for RelativeSteps<'_, T, L>
where
    Jet2<T>: ElementScalar,
{
    fn propagate(&mut self, event: &StepEvent) -> Result<()> {
        match *event {
            StepEvent::Start => {
                self.accelerate(self.t[0])?;
                self.store_rates(0);
                Ok(())
            }
            StepEvent::Step(t) => self.advance(t),
            StepEvent::Output { t, is_dense } => self.record_outputs(t, is_dense),
        }
    }
}
