//! Explicit steps in relative coordinates, repeated in numbers with derivatives: first and second derivatives.
//!
//! The stages of a step are the formulas of the method in numbers with derivatives. At each stage the rows of the joints vanish,
//! r(q, v, v̇, b) = 0. The factorized mass matrix A = ∂r/∂v̇ of the values gives the derivatives of accelerations by one correction
//! v̇ ← v̇ − A⁻¹ r for each order: the recursion itself is not differentiated.

use crate::Result;
use crate::analyses::sampling::OutputRecorder;
use crate::derivatives::forward::explicit::explicit_steps::{ExplicitSteps, StepEvent};
use crate::derivatives::forward::initial_conditions::InitialDerivatives;
use crate::derivatives::history::OutputGradients;
use crate::derivatives::propagation::{Schedule, StepConsumer, StepSource, propagate};
use crate::diagnostics::check_finite;
use crate::integrators::explicit::mechanism::{ConsistentState, MechanismRhs, SAMPLE, sample};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::relative::RelativeStageRecord;
use crate::integrators::explicit::tableau::Tableau;
use crate::integrators::settings::Work;
use crate::linalg::simd::{Kernel, dispatch};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{DerivativeScalar, ElementScalar, Jet2};
use crate::system::System;
use crate::system::outputs::Sampler;
use crate::system::state::State;
use crate::tree::Tree;
use crate::tree::articulated::ArticulatedWorkspace;
use crate::tree::dynamics::{ProjectionRecord, TreeResidual};

/// Smallest product of joint coordinates, mechanisms and derivatives of each for which threads are faster.
const WORTH_THREADS: usize = 400;

/// Propagates the `L` derivatives of each of the `mechanisms` along the steps of `driver`, whose unknowns are the joint coordinates
/// of `tree`, to the last of `times`. The stages of the steps are recorded.
pub(crate) fn propagate_relative<T: DerivativeScalar<L>, const L: usize>(
    mechanisms: &[Mechanism<T>],
    tree: &Tree,
    mut driver: OdeDriver<MechanismRhs<'_>>,
    begin: &ConsistentState,
    times: &[f64],
) -> Result<(OutputRecorder, Work, OutputGradients)>
where
    Jet2<T>: ElementScalar,
{
    let (method, rhs) = (driver.stepper.method, &mut driver.stepper.rhs);
    let plain = rhs.mechanism;
    let steps = |mechanism| RelativeSteps::new((plain, mechanism), tree, &mut rhs.system, method, begin, times.len());
    let mut consumers = mechanisms.iter().map(steps).collect::<Result<Vec<_>>>()?;
    let recorder = OutputRecorder::new(plain, times.len());
    let mut source = RecordedTreeSteps { mechanism: plain, steps: ExplicitSteps::new(driver, times), recorder };
    let is_parallel = tree.count * mechanisms.len() * L >= WORTH_THREADS && mechanisms.len() > 1;
    propagate(&mut source, &mut consumers, if is_parallel { Schedule::Parallel } else { Schedule::Sequential })?;
    let derivatives = consumers.into_iter().map(|steps| steps.derivatives).collect();
    let gradients = OutputGradients::new(plain.outputs.len(), L, derivatives);
    Ok((source.recorder, source.steps.driver.work(), gradients))
}

/// The explicit steps of a mechanism, whose outputs are recorded.
struct RecordedTreeSteps<'m> {
    mechanism: &'m Mechanism<f64>,
    steps: ExplicitSteps<'m, MechanismRhs<'m>>,
    recorder: OutputRecorder,
}

impl RecordedTreeSteps<'_> {
    /// The recorded stages of the step.
    fn stages(&mut self) -> &mut Option<Vec<RelativeStageRecord>> {
        &mut self.steps.driver.stepper.rhs.relative.as_mut().expect("the coordinates are relative").stages
    }
}

impl StepSource for RecordedTreeSteps<'_> {
    type Block = RecordedTreeStep;

    fn block(&mut self) -> RecordedTreeStep {
        let relative = self.steps.driver.stepper.rhs.relative.as_ref().expect("the coordinates are relative");
        RecordedTreeStep { event: StepEvent::Start, stages: None, projection: relative.projection.clone() }
    }

    /// Fills the block with one step, or with the state at one output time.
    fn fill(&mut self, step: &mut RecordedTreeStep) -> Result<bool> {
        if step.stages.is_some() {
            *self.stages() = step.stages.take();
        }
        let Some(event) = self.steps.advance(sample)? else { return Ok(false) };
        if let StepEvent::Output { .. } = event {
            self.recorder.record(self.mechanism, &self.steps.driver.stepper.rhs.state)?;
        }
        step.event = event;
        step.stages = self.stages().take();
        if let (StepEvent::Step(_), Some(relative)) = (event, &mut self.steps.driver.stepper.rhs.relative) {
            std::mem::swap(&mut step.projection, &mut relative.projection);
        }
        Ok(true)
    }
}

/// The stages of a step.
struct RecordedTreeStep {
    event: StepEvent,
    /// Evaluations of the accelerations, moved here from the equations while derivatives are computed.
    stages: Option<Vec<RelativeStageRecord>>,
    /// The projection at the end of the step.
    projection: ProjectionRecord,
}

/// Joint coordinates and velocities with `L` derivatives, which are propagated along explicit steps.
struct RelativeSteps<'m, T, const L: usize> {
    mechanism: &'m Mechanism<T>,
    method: &'static Tableau,
    tree: &'m Tree,
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
    /// The state of all coordinates at a stage.
    state: State<T>,
    accelerations: Vec<T>,
    rows: Vec<T>,
    changes: Vec<[f64; L]>,
    work: ArticulatedWorkspace<L>,
    sampler: Sampler<T>,
    outputs: Vec<T>,
    /// Of the outputs, by time, output and design variable.
    derivatives: Vec<f64>,
}

/// Accelerations of the joint coordinates at the stage of `steps`, whose values are in the `record`.
struct StageAccelerations<'a, 'm, T, const L: usize> {
    steps: &'a mut RelativeSteps<'m, T, L>,
    record: &'a RelativeStageRecord,
}

impl<T: DerivativeScalar<L>, const L: usize> Kernel for StageAccelerations<'_, '_, T, L>
where
    Jet2<T>: ElementScalar,
{
    #[inline(always)]
    fn run(self) {
        let RelativeStageRecord { t, y, a, l, factor } = self.record;
        let RelativeSteps { mechanism, tree, residual, stage, state, accelerations, rows, changes, work, .. } =
            self.steps;
        stage.iter_mut().zip(y).for_each(|(stage, &value)| *stage = T::with(value, stage.derivatives()));
        accelerations.iter_mut().zip(a).for_each(|(a, &value)| *a = T::from(value));
        tree.cuts.iter().zip(l).for_each(|(cut, &l)| state.l[cut.multiplier] = T::from(l));
        state.t = T::from(*t);
        residual.place(tree, mechanism, stage, state);
        for _ in 0..T::ORDER {
            residual.evaluate(tree, mechanism, (stage, accelerations), state, rows);
            changes.iter_mut().zip(&*rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
            factor.solve(tree, changes, work);
            accelerations.iter_mut().zip(&*changes).for_each(|(a, change)| *a += T::with(0.0, *change));
            for (cut, change) in tree.cuts.iter().zip(&changes[tree.count..]) {
                state.l[cut.multiplier] += T::with(0.0, *change);
            }
        }
    }
}

impl<'m, T: DerivativeScalar<L>, const L: usize> RelativeSteps<'m, T, L>
where
    Jet2<T>: ElementScalar,
{
    /// Derivatives at the start of a motion with a number of output `times`.
    fn new(
        (plain, mechanism): (&Mechanism<f64>, &'m Mechanism<T>),
        tree: &'m Tree,
        system: &mut System,
        method: &'static Tableau,
        begin: &ConsistentState,
        times: usize,
    ) -> Result<Self> {
        let state = InitialDerivatives::new(plain, mechanism, system).consistent(&begin.state, &begin.projection)?;
        let (y, zero, count) = (tree.joint_state(mechanism, &state), T::from(0.0), tree.count);
        Ok(Self {
            mechanism,
            method,
            tree,
            residual: TreeResidual::new(tree, mechanism),
            t: [begin.state.t; 2],
            rates: vec![vec![zero; y.len()]; method.slots()],
            begin: y.clone(),
            end: y.clone(),
            stage: y,
            is_started: false,
            is_dense: false,
            state,
            accelerations: vec![zero; count],
            rows: vec![zero; count + tree.cuts.len()],
            changes: vec![[0.0; L]; count + tree.cuts.len()],
            work: ArticulatedWorkspace::default(),
            sampler: Sampler::new(mechanism),
            outputs: Vec::new(),
            derivatives: Vec::with_capacity(times * mechanism.outputs.len() * L),
        })
    }

    /// Propagates the derivatives to the end of the step between `t[0]` and `t[1]`.
    fn advance(&mut self, stages: &[RelativeStageRecord], projection: &ProjectionRecord, t: [f64; 2]) {
        let end = self.method.end;
        if self.is_started {
            self.rates.swap(0, end);
            std::mem::swap(&mut self.begin, &mut self.end);
        }
        (self.t, self.is_started, self.is_dense) = (t, true, false);
        (1..end).for_each(|slot| self.evaluate(stages, slot));
        self.combine(end);
        self.project(projection);
        self.accelerate(&stages[end]);
        self.store_rates(end);
        self.end.copy_from_slice(&self.stage);
    }

    /// The rates of a slot.
    fn evaluate(&mut self, stages: &[RelativeStageRecord], slot: usize) {
        self.combine(slot);
        self.accelerate(&stages[slot]);
        self.store_rates(slot);
    }

    /// Projects the components at the end of the step onto the constraints of cut joints, and Euler parameters onto their length one.
    fn project(&mut self, record: &ProjectionRecord) {
        let Self { mechanism, tree, residual, stage, state, rows, changes, .. } = self;
        let n = tree.count;
        if !tree.cuts.is_empty() {
            state.t = T::from(record.t);
            stage.iter_mut().zip(&record.y).for_each(|(y, &value)| *y = T::with(value, y.derivatives()));
            let base = stage.clone();
            for (order, values) in record.solutions.iter().enumerate() {
                let mut solution: Vec<T> = values.iter().map(|&value| T::from(value)).collect();
                for _ in 0..T::ORDER {
                    let at = ([&base[..], &stage[..]], order);
                    residual.correction(tree, mechanism, at, solution.split_at(n), state, rows);
                    changes.iter_mut().zip(&*rows).for_each(|(change, row)| *change = row.derivatives().map(|x| -x));
                    record.factor.solve(tree, changes);
                    solution.iter_mut().zip(&*changes).for_each(|(x, change)| *x += T::with(0.0, *change));
                }
                stage[order * n..(order + 1) * n].iter_mut().zip(&solution).for_each(|(y, change)| *y += *change);
            }
        }
        let (q, v) = stage.split_at_mut(n);
        tree.space.normalize(q, v);
    }

    /// Solves for the accelerations of the joint coordinates at the stage, whose values are in the `record`.
    fn accelerate(&mut self, record: &RelativeStageRecord) {
        dispatch(StageAccelerations { steps: self, record });
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

    /// Stores the rates at the stage in a slot.
    fn store_rates(&mut self, slot: usize) {
        let n = self.accelerations.len();
        let (velocities, accelerations) = self.rates[slot].split_at_mut(n);
        velocities.copy_from_slice(&self.stage[n..]);
        accelerations.copy_from_slice(&self.accelerations);
    }

    /// Records the derivatives of the outputs at `t` (s), inside the step (`is_dense`) or at its end.
    fn record_outputs(&mut self, stages: &[RelativeStageRecord], t: f64, is_dense: bool) -> Result<()> {
        if is_dense {
            self.interpolate(stages, t);
        } else {
            self.stage.copy_from_slice(&self.end);
        }
        self.accelerate(&stages[SAMPLE]);
        let Self { residual, tree, mechanism, stage, accelerations, state, rows, .. } = self;
        residual.evaluate(tree, mechanism, (stage, accelerations), state, rows);
        residual.reactions(tree, stage, state);
        self.sampler.outputs(mechanism, state, &mut self.outputs);
        check_finite(mechanism, &self.outputs, t)?;
        self.derivatives.extend(self.outputs.iter().flat_map(|output| output.derivatives()));
        Ok(())
    }

    /// Writes the components at `t` (s) to the stage, by dense output.
    fn interpolate(&mut self, stages: &[RelativeStageRecord], t: f64) {
        if !std::mem::replace(&mut self.is_dense, true) {
            (self.method.end + 1..self.method.slots()).for_each(|slot| self.evaluate(stages, slot));
        }
        let Self { method, begin, end, stage, rates, t: [from, to], .. } = self;
        let h = *to - *from;
        let weights = method.dense_weights((t - *from) / h);
        for (i, y) in stage.iter_mut().enumerate() {
            let slots = rates.iter().zip(weights.slots).filter(|(_, weight)| *weight != 0.0);
            let change = (end[i] - begin[i]) * weights.change;
            *y = slots.fold(begin[i] + change, |sum, (slot, weight)| sum + slot[i] * (h * weight));
        }
    }
}

impl<T: DerivativeScalar<L>, const L: usize> StepConsumer<RecordedTreeStep> for RelativeSteps<'_, T, L>
where
    Jet2<T>: ElementScalar,
{
    fn propagate(&mut self, step: &RecordedTreeStep) -> Result<()> {
        let stages = step.stages.as_ref().expect("the stages are here while derivatives are computed");
        match step.event {
            StepEvent::Start => {
                self.accelerate(&stages[0]);
                self.store_rates(0);
            }
            StepEvent::Step(t) => self.advance(stages, &step.projection, t),
            StepEvent::Output { t, is_dense } => self.record_outputs(stages, t, is_dense)?,
        }
        Ok(())
    }
}
