//! Sensitivities of a motion by explicit steps in relative coordinates, for a few design variables at a time.
//!
//! At a stage the rows of the joints vanish, r(q, v, v̇, b) = 0. Every stage is linearized once for all design variables: the
//! derivatives of each joint with respect to its neighbours, and those of each force with respect to its coordinates and parameters.
//! Each design variable then takes two sweeps over the tree, and one solution A δv̇ = −δr with the factorized mass matrix of the values.

use crate::Result;
use crate::analyses::sampling::OutputRecorder;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::explicit_steps::{ExplicitSteps, StepEvent};
use crate::derivatives::forward::explicit::linearize::{ElementWorkspaces, Linearizer};
use crate::derivatives::forward::explicit::nystrom::{NystromWeights, StepDerivatives};
use crate::derivatives::forward::explicit::sensitivity_block::{DualOutputs, columns};
use crate::derivatives::forward::initial_conditions::InitialDerivatives;
use crate::derivatives::history::OutputGradients;
use crate::derivatives::propagation::{Schedule, StepConsumer, StepSource, propagate};
use crate::derivatives::seeding::Activity;
use crate::integrators::explicit::grading::Grading;
use crate::integrators::explicit::mechanism::{ConsistentState, MechanismRhs, SAMPLE, sample};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::relative::RelativeStageRecord;
use crate::integrators::explicit::tableau::Tableau;
use crate::integrators::settings::Work;
use crate::linalg::simd::Gradient;
use crate::linalg::simd::{Kernel, WideKernel, dispatch, dispatch_wide};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Dual8;
use crate::system::Unknown;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::tree::articulated::ArticulatedWorkspace;
use crate::tree::linearize::{Directions, TreeGradients, TreeLinearization};
use crate::tree::{Tree, TreeDynamics};
use autodiff::WIDTH;
use pulp::Simd;
use std::ops::Range;

/// Smallest product of joint coordinates and design variables for which threads are faster.
const WORTH_THREADS: usize = 1600;

/// Propagates the derivatives with respect to the design variables of all `chunks` along the steps of `driver`, whose unknowns are
/// joint coordinates, to the last of `times`, in blocks of `W` variables. The stages of the steps are recorded.
pub(crate) fn propagate_relative_blocks<const W: usize>(
    chunks: &[Mechanism<Dual8>],
    mut driver: OdeDriver<MechanismRhs<'_>>,
    begin: &ConsistentState,
    times: &[f64],
) -> Result<(OutputRecorder, Work, OutputGradients)> {
    let (method, rhs) = (driver.stepper.method, &mut driver.stepper.rhs);
    let (mechanism, system) = (rhs.mechanism, &mut rhs.system);
    let dynamics = rhs.relative.as_ref().expect("the coordinates are relative").dynamics.clone();
    let activity = Activity::of(chunks, mechanism);
    let linearizer = Linearizer::of_elements(mechanism, &activity, (system, &Modes::initial(mechanism)), |k| {
        dynamics.tree.forces.contains(&k)
    });
    let shared = RelativeBlockData {
        method,
        weights: NystromWeights::table(method, Grading::Even),
        tree: dynamics.tree.clone(),
        unknowns: system.unknowns().to_vec(),
        multipliers: (0..mechanism.multipliers).map(Unknown::Multiplier).collect(),
        moving: activity.moving_coordinates().collect(),
    };
    let initial =
        |chunk| InitialDerivatives::new(mechanism, chunk, &mut *system).consistent(&begin.state, &begin.projection);
    let states = chunks.iter().map(initial).collect::<Result<Vec<_>>>()?;
    let block = |(chunks, states)| RelativeBlock::new(&shared, chunks, states, &linearizer, &begin.state, times.len());
    let blocks = chunks.chunks(W / WIDTH).zip(states.chunks(W / WIDTH));
    let mut blocks: Vec<RelativeBlock<'_, W>> = blocks.map(block).collect();
    let is_parallel = shared.tree.count * chunks.len() * WIDTH >= WORTH_THREADS;
    let mut source = RelativeSource {
        mechanism,
        recorder: OutputRecorder::new(mechanism, times.len()),
        steps: ExplicitSteps::new(driver, times),
        linearizer,
        dynamics,
        start: begin.state.clone(),
        workspaces: ElementWorkspaces::default(),
        is_dense: false,
    };
    propagate(&mut source, &mut blocks, if is_parallel { Schedule::Parallel } else { Schedule::Sequential })?;
    let derivatives = blocks.into_iter().map(|block| block.derivatives).collect();
    let gradients = OutputGradients::new(mechanism.outputs.len(), W, derivatives);
    Ok((source.recorder, source.steps.driver.work(), gradients))
}

/// The explicit steps of a mechanism, whose outputs are recorded and whose stages are linearized.
struct RelativeSource<'m> {
    mechanism: &'m Mechanism<f64>,
    steps: ExplicitSteps<'m, MechanismRhs<'m>>,
    recorder: OutputRecorder,
    linearizer: Linearizer,
    /// Repeats the recorded stages.
    dynamics: TreeDynamics,
    start: State<f64>,
    workspaces: ElementWorkspaces,
    /// True after the stages for dense output of the current step are linearized.
    is_dense: bool,
}

/// The stages of a step, linearized once for all design variables.
struct LinearizedTree {
    event: StepEvent,
    /// Evaluations of the accelerations, moved here from the equations while derivatives are computed.
    records: Option<Vec<RelativeStageRecord>>,
    /// Derivatives of the joints at each stage.
    stages: Vec<TreeLinearization>,
    /// Derivatives of the forces at each stage.
    forces: Vec<Entries>,
    /// The state of all coordinates at the stage that was linearized last.
    state: State<f64>,
}

impl RelativeSource<'_> {
    /// The recorded stages of the step.
    fn records(&mut self) -> &mut Option<Vec<RelativeStageRecord>> {
        &mut self.steps.driver.stepper.rhs.relative.as_mut().expect("the coordinates are relative").stages
    }

    /// Linearizes the stages `slots`.
    fn linearize(&mut self, step: &mut LinearizedTree, slots: Range<usize>) {
        let Self { mechanism, dynamics, linearizer, workspaces, .. } = self;
        let LinearizedTree { records, stages, forces, state, .. } = step;
        let records = records.as_ref().expect("the stages are here while derivatives are computed");
        for slot in slots {
            let RelativeStageRecord { t, y, a, .. } = &records[slot];
            dynamics.place(mechanism, *t, y, state);
            dynamics.complete(mechanism, (y, a), state);
            stages[slot].update(dynamics, (y, a), state);
            if stages[slot].has_forces() {
                linearizer.accelerations(mechanism, state, workspaces, &mut forces[slot]);
            }
        }
    }
}

impl StepSource for RelativeSource<'_> {
    type Block = LinearizedTree;

    fn block(&mut self) -> LinearizedTree {
        let stage = TreeLinearization::new(&self.dynamics.tree, &self.dynamics, self.mechanism);
        LinearizedTree {
            event: StepEvent::Start,
            records: None,
            stages: vec![stage; SAMPLE + 1],
            forces: vec![self.linearizer.entries(); SAMPLE + 1],
            state: self.start.clone(),
        }
    }

    /// Fills the block with one step, or with the state at one output time.
    fn fill(&mut self, step: &mut LinearizedTree) -> Result<bool> {
        if step.records.is_some() {
            *self.records() = step.records.take();
        }
        let Some(event) = self.steps.advance(sample)? else { return Ok(false) };
        (step.event, step.records) = (event, self.records().take());
        let method = self.steps.driver.stepper.method;
        match event {
            StepEvent::Start => self.linearize(step, 0..1),
            StepEvent::Step(_) => {
                self.is_dense = false;
                self.linearize(step, 1..method.end + 1);
            }
            StepEvent::Output { is_dense, .. } => {
                self.recorder.record(self.mechanism, &self.steps.driver.stepper.rhs.state)?;
                if is_dense && !std::mem::replace(&mut self.is_dense, true) {
                    self.linearize(step, method.end + 1..method.slots());
                }
                self.linearize(step, SAMPLE..SAMPLE + 1);
            }
        }
        Ok(true)
    }
}

/// Data that the blocks of all design variables share.
struct RelativeBlockData {
    method: &'static Tableau,
    weights: Vec<NystromWeights>,
    tree: Tree,
    unknowns: Vec<Unknown>,
    multipliers: Vec<Unknown>,
    /// Prescribed coordinates whose motion depends on the design.
    moving: Vec<usize>,
}

/// The derivatives of a motion with respect to `W` design variables, which are propagated along explicit steps.
struct RelativeBlock<'m, const W: usize> {
    shared: &'m RelativeBlockData,
    /// Chunk by chunk of [`WIDTH`] design variables.
    outputs: Vec<DualOutputs<'m>>,
    parameters: TreeGradients<W>,
    /// Of the joint coordinates.
    step: StepDerivatives<W>,
    /// Joint coordinates, followed by their velocities, at a stage.
    y: Vec<Gradient<W>>,
    /// Positions, velocities and accelerations of all coordinates, and parameters of forces.
    sources: Vec<Gradient<W>>,
    /// For each parameter of a force, true if it depends on these design variables.
    active: Vec<bool>,
    /// Inertia − force by coordinate, and forces by equation.
    rows: Vec<Gradient<W>>,
    forces: Vec<Gradient<W>>,
    /// Accelerations of the joint coordinates.
    accelerations: Vec<Gradient<W>>,
    /// Rows of the joints, which the accelerations make zero.
    joint_rows: Vec<Gradient<W>>,
    reactions: Vec<Gradient<W>>,
    work: ArticulatedWorkspace<W>,
    is_dense: bool,
    /// Of the outputs, by time, output and design variable.
    derivatives: Vec<f64>,
}

impl<'m, const W: usize> RelativeBlock<'m, W> {
    /// Block at the initial state `values` of a motion, and its derivatives `start` in each of the `chunks`.
    fn new(
        shared: &'m RelativeBlockData,
        chunks: &'m [Mechanism<Dual8>],
        start: &[State<Dual8>],
        linearizer: &Linearizer,
        values: &State<f64>,
        times: usize,
    ) -> Self {
        let (n, count, zero) = (values.q.len(), shared.tree.count, [0.0; W]);
        let (mut sources, mut y) = (vec![zero; linearizer.sources()], vec![zero; 2 * count]);
        for (c, (chunk, state)) in chunks.iter().zip(start).enumerate() {
            let parameters =
                linearizer.parameters.iter().map(|&(element, local)| &chunk.elements[element].parameters[local]);
            let (coordinates, parameter_sources) = sources.split_at_mut(3 * n);
            let all = coordinates.iter_mut().zip(state.q.iter().chain(&state.v));
            all.chain(parameter_sources.iter_mut().zip(parameters))
                .for_each(|(source, x)| columns(source, c).copy_from_slice(&x.eps));
            let joints = shared.tree.joint_state(chunk, state);
            y.iter_mut().zip(&joints).for_each(|(y, x)| columns(y, c).copy_from_slice(&x.eps));
        }
        let active = sources[3 * n..].iter().map(|derivatives| derivatives.iter().any(|x| *x != 0.0)).collect();
        let outputs = chunks.first().map_or(0, |chunk| chunk.outputs.len());
        Self {
            shared,
            outputs: chunks.iter().map(|chunk| DualOutputs::new(chunk, values)).collect(),
            parameters: TreeGradients::new(&shared.tree, chunks),
            step: StepDerivatives::new(values.t, &y),
            y,
            sources,
            active,
            rows: vec![zero; n],
            forces: vec![zero; shared.unknowns.len()],
            accelerations: vec![zero; count],
            joint_rows: vec![zero; count],
            reactions: vec![zero; shared.multipliers.len()],
            work: ArticulatedWorkspace::default(),
            is_dense: false,
            derivatives: Vec::with_capacity(times * outputs * W),
        }
    }

    /// Propagates the derivatives from the beginning of the step between `t[0]` and `t[1]` to its end.
    fn advance(&mut self, stages: &LinearizedTree, t: [f64; 2]) {
        let end = self.shared.method.end;
        self.is_dense = false;
        self.step.advance(self.shared.method, t);
        (1..end).for_each(|slot| self.evaluate(stages, slot));
        self.step.combine(&self.shared.weights[end], 0..self.shared.tree.count, &mut self.y);
        self.step.finish(&self.y);
        self.accelerate(stages, end);
    }

    /// Records the derivatives of the outputs at `t`, inside the step (`is_dense`) or at its end.
    fn record_outputs(&mut self, stages: &LinearizedTree, t: f64, is_dense: bool) {
        let method = self.shared.method;
        if is_dense && !std::mem::replace(&mut self.is_dense, true) {
            (method.end + 1..method.slots()).for_each(|slot| self.evaluate(stages, slot));
        }
        if is_dense {
            self.step.interpolate(method, Grading::Even, t, &mut self.y);
        } else {
            self.step.end(&mut self.y);
        }
        self.solve(stages, SAMPLE);
        self.complete(stages);
        for (c, outputs) in self.outputs.iter_mut().enumerate() {
            outputs.evaluate(&stages.state, &self.sources, &self.reactions, &self.shared.multipliers, c);
        }
        for output in 0..self.outputs[0].values.len() {
            let first = self.derivatives.len();
            self.outputs.iter().for_each(|chunk| self.derivatives.extend(chunk.values[output].eps));
            self.derivatives.resize(first + W, 0.0);
        }
    }

    /// Derivatives of the joint coordinates and their accelerations at a stage.
    fn evaluate(&mut self, stages: &LinearizedTree, slot: usize) {
        self.step.combine(&self.shared.weights[slot], 0..self.shared.tree.count, &mut self.y);
        self.accelerate(stages, slot);
    }

    /// Derivatives of the accelerations at a stage.
    fn accelerate(&mut self, stages: &LinearizedTree, slot: usize) {
        self.solve(stages, slot);
        for (slots, &derivatives) in self.step.accelerations.iter_mut().zip(&self.accelerations) {
            slots[slot] = derivatives;
        }
    }

    /// Solves for the derivatives of the accelerations of the joint coordinates.
    fn solve(&mut self, stages: &LinearizedTree, slot: usize) {
        let record = &stages.records.as_ref().expect("the stages are here while derivatives are computed")[slot];
        for (c, outputs) in self.outputs.iter().enumerate() {
            outputs.prescribe(&self.shared.moving, record.t, c, &mut self.sources);
        }
        self.sweep(stages, slot, false);
        dispatch(AccelerationSolve { block: self, record });
    }

    /// Derivatives of the accelerations of all coordinates, and of the reactions, at the stage for outputs.
    fn complete(&mut self, stages: &LinearizedTree) {
        self.sweep(stages, SAMPLE, true);
        let Self { shared, parameters, y, accelerations, sources, rows, reactions, .. } = self;
        let directions = Directions { y, a: Some(accelerations) };
        stages.stages[SAMPLE].reactions(&shared.tree, parameters, (&directions, sources), rows, reactions);
    }

    /// Derivatives of all coordinates, and of the rows of the joints, for fixed accelerations of the joint coordinates, or for those
    /// of the motion if it `is_complete`.
    fn sweep(&mut self, stages: &LinearizedTree, slot: usize, is_complete: bool) {
        let stage = &stages.stages[slot];
        dispatch_wide(Outwards { block: self, stage, is_complete });
        self.rows.fill([0.0; W]);
        if stage.has_forces() {
            self.forces.fill([0.0; W]);
            stages.forces[slot].subtract(&self.sources, &self.active, &mut self.forces);
            for (unknown, force) in self.shared.unknowns.iter().zip(&self.forces) {
                if let Unknown::Coordinate(i) = *unknown {
                    self.rows[i] = force.map(|x| -x);
                }
            }
        }
        dispatch_wide(Inwards { block: self, stage, is_complete });
    }
}

impl<const W: usize> StepConsumer<LinearizedTree> for RelativeBlock<'_, W> {
    fn propagate(&mut self, stages: &LinearizedTree) -> Result<()> {
        match stages.event {
            StepEvent::Start => self.accelerate(stages, 0),
            StepEvent::Step(t) => self.advance(stages, t),
            StepEvent::Output { t, is_dense } => self.record_outputs(stages, t, is_dense),
        }
        Ok(())
    }
}

/// The sweep from the ground to the tips.
struct Outwards<'a, 'm, const W: usize> {
    block: &'a mut RelativeBlock<'m, W>,
    stage: &'a TreeLinearization,
    is_complete: bool,
}

impl<const W: usize> WideKernel for Outwards<'_, '_, W> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let RelativeBlock { shared, parameters, y, accelerations, sources, .. } = self.block;
        let directions = Directions { y, a: self.is_complete.then_some(accelerations) };
        let all = self.is_complete || self.stage.has_forces();
        self.stage.place(simd, &shared.tree, parameters, &directions, all, sources);
    }
}

/// The sweep from the tips to the ground.
struct Inwards<'a, 'm, const W: usize> {
    block: &'a mut RelativeBlock<'m, W>,
    stage: &'a TreeLinearization,
    is_complete: bool,
}

impl<const W: usize> WideKernel for Inwards<'_, '_, W> {
    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let RelativeBlock { shared, parameters, y, accelerations, sources, rows, joint_rows, .. } = self.block;
        let directions = Directions { y, a: self.is_complete.then_some(accelerations) };
        self.stage.collect(simd, &shared.tree, parameters, (&directions, sources), rows, joint_rows);
    }
}

/// The solution A δv̇ = −δr.
struct AccelerationSolve<'a, 'm, const W: usize> {
    block: &'a mut RelativeBlock<'m, W>,
    record: &'a RelativeStageRecord,
}

impl<const W: usize> Kernel for AccelerationSolve<'_, '_, W> {
    #[inline(always)]
    fn run(self) {
        let RelativeBlock { shared, accelerations, joint_rows, work, .. } = self.block;
        accelerations.copy_from_slice(joint_rows);
        self.record.factor.solve(&shared.tree, accelerations, work);
    }
}
