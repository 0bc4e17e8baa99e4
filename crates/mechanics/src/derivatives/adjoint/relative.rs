//! The discrete adjoint of a motion by explicit steps in relative coordinates.
//!
//! At a stage the joints' rows vanish, r(q, v, v̇, p) = 0 with the mass matrix A = ∂r/∂v̇. With ψ = −A⁻¹ ā the derivatives with respect
//! to everything else are ψᵀ ∂r = ∂(ψ_absᵀ r_abs), where ψ_abs = J ψ are the virtual displacements of the bodies: products of the
//! elements, and one transposed sweep of the tree. A reaction λ is a power as well: that of a virtual displacement that opens its joint.

use crate::Result;
use crate::checkpointing::recording::ExplicitRecording;
use crate::checkpointing::reverse_playback::ReversePlayback;
use crate::checkpointing::trajectory_store::Checkpointable;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::element_vjp::{ElementRows, ElementVariable, ElementVjp};
use crate::derivatives::adjoint::initial_conditions::gradients_from_start;
use crate::derivatives::adjoint::problem::{
    AdjointProblem, OutputTerm, ReplayStatistics, ReverseSteps, propagate_backwards,
};
use crate::derivatives::forward::explicit::constraint::ConstraintDerivative;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::{ElementWorkspaces, Linearizer};
use crate::integrators::explicit::mechanism::{MechanismRhs, SAMPLE, sample, start};
use crate::integrators::explicit::ode_driver::OdeDriver;
use crate::integrators::explicit::settings::Explicit;
use crate::integrators::explicit::stepper::OdeRhs;
use crate::integrators::explicit::tableau::{DenseWeights, Tableau};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Dual8;
use crate::system::System;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::tree::articulated::ArticulatedWorkspace;
use crate::tree::cut;
use crate::tree::dynamics::{ProjectionRecord, TreeDynamics};
use crate::tree::joint::TreeBody;
use crate::tree::joint::{Joint, joint_coordinate, motion_of};
use crate::tree::plan::CutRow;
use crate::tree::plan::Tree;
use crate::tree::space::placed::Twist;
use crate::tree::space::transpose::BodyAdjoint;
use crate::tree::space::transpose::{NodeJacobian, SpacePoint, StartVariable};
use crate::tree::transpose::{TreePoint, VirtualDisplacements};
use autodiff::WIDTH;
use nalgebra::DMatrix;

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
    let ReverseRelativeSteps { mut adjoints, playback, .. } = steps;
    let statistics = ReplayStatistics::of(recording.store.steps(), &playback);
    let batches = adjoints.iter_mut().map(|adjoint| &mut adjoint.batch).collect();
    Ok((gradients_from_start(problem, recording, batches)?, statistics))
}

/// The explicit steps of a motion, repeated for their stages, with the adjoint states of all responses.
struct ReverseRelativeSteps<'m> {
    adjoints: Vec<RelativeAdjoint>,
    playback: ReversePlayback<'m, OdeDriver<MechanismRhs<'m>>>,
    recording: &'m ExplicitRecording,
    /// Repeats the steps and stores their stages.
    driver: OdeDriver<MechanismRhs<'m>>,
    stage: RelativeStage<'m>,
    method: &'static Tableau,
    /// Length of the step in s.
    h: f64,
    /// Time, state and rates at the start of the motion.
    first: Vec<f64>,
    /// End of the step to load next in s: the beginning of the last one.
    next_end: Option<f64>,
    /// True after the evaluation of an output inside the step.
    is_dense: bool,
    at: Vec<f64>,
}

impl<'m> ReverseRelativeSteps<'m> {
    fn new(
        problem: &'m AdjointProblem<'m>,
        settings: &'m Explicit,
        times: &'m [f64],
        recording: &'m ExplicitRecording,
        dynamics: TreeDynamics,
    ) -> Result<Self> {
        let mechanism = &problem.mechanism;
        let playback = ReversePlayback::new(&recording.store, || Ok(start(mechanism, settings, times, false)?.0))?;
        let (driver, begin) = start(mechanism, settings, times, true)?;
        let (method, system) = (driver.stepper.method, &driver.stepper.rhs.system);
        let new = |_| RelativeAdjoint::new(mechanism, system, &dynamics.tree, method);
        let adjoints = (0..problem.batches()).map(new).collect();
        let stage = RelativeStage::new(problem, system, dynamics, begin.state);
        let (mut first, at) = (Vec::new(), driver.stepper.old.clone());
        driver.write(&mut first);
        let (h, next_end, is_dense) = (0.0, None, false);
        Ok(Self { adjoints, playback, recording, driver, stage, method, h, first, next_end, is_dense, at })
    }

    /// Computes the stage in `slot`.
    fn load_stage(&mut self, slot: usize) -> Result<()> {
        let relative = self.driver.stepper.rhs.relative.as_ref().expect("the coordinates are relative");
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
        let OdeDriver { stepper, scratch, .. } = &mut self.driver;
        scratch.resize(stepper.old.len(), 0.0);
        stepper.rhs.rates(0, stepper.t[0], &stepper.old, scratch)?;
        self.load_stage(0)?;
        let (end, begin) = (self.method.end, &self.recording.start.state);
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
        self.recording.store.steps_to(t)
    }

    fn load_step(&mut self, k: usize) -> Result<()> {
        let end = match self.next_end {
            Some(end) => end,
            None => self.playback.row(k)?[0],
        };
        let begin = if k > 0 { self.playback.row(k - 1)? } else { &self.first };
        self.next_end = Some(begin[0]);
        self.driver.stepper.put(begin, false);
        self.driver.stepper.attempt(end, None)?;
        (self.h, self.is_dense) = (self.driver.stepper.length(), false);
        Ok(())
    }

    fn contains(&self, k: usize, t: f64) -> bool {
        self.steps_to(t) > k
    }

    fn add_outputs(&mut self, t: f64, terms: &[OutputTerm]) -> Result<()> {
        let is_dense = sample(&mut self.driver, &mut self.at, t)?;
        let stepper = &self.driver.stepper;
        let weights = is_dense.then(|| stepper.method.dense_weights((t - stepper.t[0]) / stepper.length()));
        self.is_dense |= is_dense;
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
        if self.is_dense {
            (end + 1..method.slots()).rev().try_for_each(|slot| self.differentiate_stage(slot))?;
        }
        self.load_stage(end)?;
        for adjoint in &mut self.adjoints {
            adjoint.differentiate_rates(&mut self.stage, end);
            adjoint.add_joints(1.0, Target::End);
        }
        // The projection places the bodies elsewhere.
        let relative = self.driver.stepper.rhs.relative.as_ref().expect("the coordinates are relative");
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
        self.driver.stepper.put(&self.first, false);
        self.h = 0.0;
        Ok(())
    }
}

/// One stage of a step, which all responses share.
struct RelativeStage<'m> {
    problem: &'m AdjointProblem<'m>,
    dynamics: TreeDynamics,
    /// The state with its accelerations and reactions.
    state: State<f64>,
    /// Joint coordinates and velocities.
    y: Vec<f64>,
    /// Accelerations of the joint coordinates.
    accelerations: Vec<f64>,
    /// Elements and the variables with respect to which their rows are differentiated.
    variables: Vec<(usize, Vec<ElementVariable>)>,
    /// Derivatives that are the same in every state: coordinate of the row, coordinate, and derivatives with respect to position,
    /// velocity and acceleration.
    constants: Vec<([usize; 2], [f64; 3])>,
    /// Derivatives of the bodies in space, for the current stage.
    jacobians: Vec<NodeJacobian>,
    element: ElementVjp,
    cut: CutStage,
}

/// Cut joints at a stage.
struct CutStage {
    linearizer: Linearizer,
    entries: Entries,
    workspaces: ElementWorkspaces,
    /// Derivatives of the equations with respect to coordinates.
    gradients: Vec<Vec<(usize, f64)>>,
    /// Equations of all coordinates, and of the multipliers of the cut joints.
    equations: Vec<Option<usize>>,
    multipliers: Vec<usize>,
    sources: Vec<BatchValues>,
}

impl CutStage {
    fn new(problem: &AdjointProblem<'_>, system: &System, tree: &Tree) -> Self {
        let AdjointProblem { mechanism, activity, .. } = problem;
        let linearizer = Linearizer::of_elements(mechanism, activity, (system, &Modes::initial(mechanism)), |k| {
            tree.cut_elements.contains(&k)
        });
        Self {
            entries: linearizer.entries(),
            workspaces: ElementWorkspaces::default(),
            gradients: Vec::new(),
            equations: (0..mechanism.coordinates.len()).map(|i| system.equation_of(i)).collect(),
            multipliers: tree.cuts.iter().map(|cut| system.equation_of_multiplier(cut.multiplier)).collect(),
            sources: vec![[0.0; BATCH]; linearizer.sources()],
            linearizer,
        }
    }

    /// Linearizes the equations in the position of `state`: accelerations, or another `derivative` of the constraints.
    fn linearize(
        &mut self,
        mechanism: &Mechanism<f64>,
        cuts: &[CutRow],
        state: &State<f64>,
        derivative: ConstraintDerivative,
    ) {
        let Self { linearizer, entries, workspaces, .. } = self;
        if derivative == ConstraintDerivative::Accelerations {
            linearizer.accelerations(mechanism, state, workspaces, entries);
        } else {
            linearizer.constraints(mechanism, state, derivative, workspaces, entries);
        }
        self.gradients = cut::gradients(mechanism, cuts, state);
    }

    /// Adds the products of the linearized equations to the `batch`: the weights `bodies` of the rows of all coordinates, and `psi` of the
    /// equations of the cut joints.
    fn add_vjp(&mut self, batch: &mut AdjointBatch, bodies: &[BatchValues], psi: &[BatchValues]) {
        batch.multipliers.fill([0.0; BATCH]);
        for (equation, weight) in self.equations.iter().zip(bodies) {
            if let Some(equation) = *equation {
                batch.multipliers[equation] = *weight;
            }
        }
        self.multipliers.iter().zip(psi).for_each(|(&equation, psi)| batch.multipliers[equation] = *psi);
        batch.add_vjp(&self.entries, &self.linearizer, &mut self.sources);
    }
}

impl<'m> RelativeStage<'m> {
    fn new(problem: &'m AdjointProblem<'m>, system: &System, dynamics: TreeDynamics, state: State<f64>) -> Self {
        let AdjointProblem { mechanism, activity, .. } = problem;
        let (mut variables, mut constants) = (Vec::new(), Vec::new());
        for &k in dynamics.tree.bodies.iter().chain(&dynamics.tree.forces) {
            let instance = &mechanism.elements[k];
            let local = |&i: &usize| {
                let is_linear = instance.element.linear().contains(&i);
                !is_linear && activity.is_differentiated(mechanism, instance.coordinates[i])
            };
            let varying: Vec<usize> = (0..instance.coordinates.len()).filter(local).collect();
            let velocities = varying.iter().map(|&i| ElementVariable::Velocity(i));
            let positions = varying.iter().map(|&i| ElementVariable::Position(i));
            let parameters = activity.parameters[k].iter().map(|&i| ElementVariable::Parameter(i));
            variables.push((k, velocities.chain(positions).chain(parameters).collect()));
            let constant = system.coefficients(k).iter();
            constants.extend(
                constant.map(|entry| {
                    ([entry.row, entry.coordinate].map(|local| instance.coordinates[local]), entry.values)
                }),
            );
        }
        for &(k, _) in &dynamics.tree.space.bodies {
            let all = 0..mechanism.elements[k].coordinates.len();
            let orders = [ElementVariable::Position, ElementVariable::Velocity, ElementVariable::Acceleration];
            let state = orders.into_iter().flat_map(|order| all.clone().map(order));
            let parameters = activity.parameters[k].iter().map(|&i| ElementVariable::Parameter(i));
            variables.push((k, state.chain(parameters).collect()));
        }
        variables.retain(|(_, variables): &(usize, Vec<_>)| !variables.is_empty());
        let count = dynamics.tree.count;
        let cut = CutStage::new(problem, system, &dynamics.tree);
        Self {
            problem,
            state,
            y: vec![0.0; 2 * count],
            accelerations: vec![0.0; count],
            dynamics,
            variables,
            constants,
            jacobians: Vec::new(),
            element: ElementVjp::default(),
            cut,
        }
    }

    /// Computes the stage at the time `t` (s) with the joint coordinates and velocities `y`, for the derivatives of reactions as well if
    /// `has_reactions`.
    fn load(&mut self, t: f64, y: &[f64], has_reactions: bool) -> Result<()> {
        let Self { problem, dynamics, state, accelerations, jacobians, cut, .. } = self;
        let mechanism = &problem.mechanism;
        self.y.copy_from_slice(y);
        dynamics.place(mechanism, t, y, state);
        dynamics.accelerations(mechanism, y, state, accelerations)?;
        dynamics.complete(mechanism, (y, accelerations), state);
        if !dynamics.tree.cuts.is_empty() {
            cut.linearize(mechanism, &dynamics.tree.cuts, state, ConstraintDerivative::Accelerations);
        }
        let (q, v) = y.split_at(dynamics.tree.count);
        let point = SpacePoint {
            state,
            joints: [q, v, accelerations],
            placed: &dynamics.geometry.placed,
            wrenches: &dynamics.wrenches,
            own: &dynamics.own_wrenches,
        };
        let parameters = |k: usize| &mechanism.elements[k].parameters[..];
        let is_active = |k: usize| !problem.activity.parameters[k].is_empty();
        *jacobians = dynamics.tree.space.jacobians(&point, parameters, is_active, has_reactions);
        Ok(())
    }
}

impl RelativeStage<'_> {
    /// Places the bodies for the joint coordinates and velocities `y`, without accelerations. With a correction of the joint coordinates
    /// and its multipliers, the accelerations of the state are the corrections of all coordinates.
    fn place_at_rest(&mut self, t: f64, y: &[f64], correction: Option<(&[f64], &[f64])>) {
        let Self { problem, dynamics, state, jacobians, .. } = self;
        let mechanism = &problem.mechanism;
        self.y.copy_from_slice(y);
        dynamics.place(mechanism, t, y, state);
        let n = dynamics.tree.count;
        let zeros = vec![0.0; n];
        dynamics.tree.place_accelerations(y, &zeros, state, &mut dynamics.geometry);
        let (q, v) = y.split_at(n);
        let none = vec![[0.0; 6]; dynamics.tree.space.nodes.len()];
        let point = SpacePoint {
            state,
            joints: [q, v, &zeros],
            placed: &dynamics.geometry.placed,
            wrenches: &none,
            own: &none,
        };
        let parameters = |k: usize| &mechanism.elements[k].parameters[..];
        let is_active = |k: usize| !problem.activity.parameters[k].is_empty();
        *jacobians = dynamics.tree.space.jacobians(&point, parameters, is_active, false);
        if let Some((correction, multipliers)) = correction {
            let mut twists = none;
            let mut bodies = vec![0.0; state.a.len()];
            dynamics.tree.place_virtual(y, correction, None, &dynamics.geometry, (&mut twists, &mut bodies));
            state.a.copy_from_slice(&bodies);
            dynamics.tree.cuts.iter().zip(multipliers).for_each(|(cut, l)| state.l[cut.multiplier] = *l);
        }
    }

    /// Linearizes a derivative of the cut joints in this position, and adds its products to the `batch`.
    fn cut_vjp(
        &mut self,
        batch: &mut AdjointBatch,
        bodies: &[BatchValues],
        psi: &[BatchValues],
        derivative: ConstraintDerivative,
    ) {
        let Self { problem, dynamics, state, cut, .. } = self;
        cut.linearize(&problem.mechanism, &dynamics.tree.cuts, state, derivative);
        cut.add_vjp(batch, bodies, psi);
    }
}

/// Derivatives to which those with respect to a stage are added.
enum Target {
    Begin,
    End,
    Rates(usize),
}

/// Adjoint states of a batch of responses at the stages of a step, as in [`explicit`](super::explicit).
struct RelativeAdjoint {
    batch: AdjointBatch,
    /// With respect to the components at the end of the step: joint coordinates and then their velocities.
    end: Vec<BatchValues>,
    /// With respect to those at its beginning.
    begin: Vec<BatchValues>,
    /// With respect to the rates of each slot.
    rates: Vec<Vec<BatchValues>>,
    /// With respect to the components at the current stage.
    joints: Vec<BatchValues>,
    /// Virtual displacements ψ of the joint coordinates, and of all coordinates.
    psi: Vec<BatchValues>,
    body_psi: Vec<BatchValues>,
    work: ArticulatedWorkspace<BATCH>,
    lane: ResponseSweep,
}

/// Workspace for the sweeps of one response.
#[derive(Clone, Default)]
struct ResponseSweep {
    joints: Vec<f64>,
    bodies: Vec<f64>,
    /// Virtual displacements of the bodies in space, and wrenches.
    twists: Vec<Twist<f64>>,
    wrenches: Vec<Twist<f64>>,
    gaps: Vec<f64>,
    adjoint: BodyAdjoint,
    out: Vec<f64>,
}

impl RelativeAdjoint {
    fn new(mechanism: &Mechanism<f64>, system: &System, tree: &Tree, method: &Tableau) -> Self {
        let count = tree.count;
        let (n, zeros) = (mechanism.coordinates.len(), vec![[0.0; BATCH]; 2 * count]);
        let adjoint = BodyAdjoint { q: vec![0.0; n], v: vec![0.0; n], a: vec![0.0; n] };
        let (joints, bodies, out) = (vec![0.0; count], vec![0.0; n], vec![0.0; 2 * count]);
        let twists = vec![[0.0; 6]; tree.space.nodes.len()];
        let wrenches = twists.clone();
        let lane =
            ResponseSweep { joints, bodies, twists, wrenches, gaps: vec![0.0; mechanism.multipliers], adjoint, out };
        Self {
            batch: AdjointBatch::new(mechanism, system.size()),
            rates: vec![zeros.clone(); method.slots()],
            psi: vec![[0.0; BATCH]; count + tree.cuts.len()],
            body_psi: vec![[0.0; BATCH]; n],
            work: ArticulatedWorkspace::default(),
            joints: zeros.clone(),
            begin: zeros.clone(),
            end: zeros,
            lane,
        }
    }

    /// Adds `factor` times the derivatives with respect to the current stage to others.
    fn add_joints(&mut self, factor: f64, target: Target) {
        let to = match target {
            Target::Begin => &mut self.begin,
            Target::End => &mut self.end,
            Target::Rates(slot) => &mut self.rates[slot],
        };
        to.iter_mut().zip(&self.joints).for_each(|(to, from)| add(to, factor, from));
    }

    /// Adds the derivatives of outputs of the current stage: inside a step of the length `h` (s) with the weights of dense output,
    /// or at its end.
    fn add_outputs<'w>(
        &mut self,
        stage: &mut RelativeStage<'_>,
        terms: impl Iterator<Item = &'w OutputTerm>,
        dense: Option<DenseWeights>,
        h: f64,
    ) {
        self.batch.state.clear();
        for term in terms {
            self.batch.add_output(&stage.problem.mechanism, &stage.state, term, &mut stage.element);
        }
        self.load_reactions(stage);
        self.differentiate_accelerations(stage, true);
        let Some(weights) = dense else { return self.add_joints(1.0, Target::End) };
        self.add_joints(1.0 - weights.change, Target::Begin);
        self.add_joints(weights.change, Target::End);
        for (slot, weight) in weights.slots.into_iter().enumerate().filter(|(_, weight)| *weight != 0.0) {
            self.add_joints(h * weight, Target::Rates(slot));
        }
    }

    /// Propagates from the rates of `slot` to the components of the current stage.
    fn differentiate_rates(&mut self, stage: &mut RelativeStage<'_>, slot: usize) {
        let count = self.joints.len() / 2;
        self.batch.state.clear();
        self.psi[..count].copy_from_slice(&self.rates[slot][count..]);
        self.psi[count..].fill([0.0; BATCH]);
        self.differentiate_accelerations(stage, false);
        for (to, from) in self.joints[count..].iter_mut().zip(&self.rates[slot][..count]) {
            add(to, 1.0, from);
        }
    }

    /// Writes the derivatives with respect to accelerations of the joint coordinates, of accelerations of bodies and of reactions.
    fn load_reactions(&mut self, stage: &RelativeStage<'_>) {
        let (dynamics, tree, geometry) = (&stage.dynamics, &stage.dynamics.tree, &stage.dynamics.geometry);
        let q = &stage.y[..tree.count];
        let ResponseSweep { joints, bodies, twists, wrenches, gaps, adjoint, .. } = &mut self.lane;
        for lane in 0..BATCH {
            joints.fill(0.0);
            gaps.iter_mut().zip(&self.batch.state.l).for_each(|(gap, l)| *gap = l[lane]);
            tree.place_virtual(&stage.y, joints, Some(gaps), geometry, (twists, bodies));
            adjoint.a.iter_mut().zip(&self.batch.state.a).for_each(|(to, from)| *to = from[lane]);
            for &([row, coordinate], [_, _, mass]) in &stage.constants {
                adjoint.a[coordinate] += mass * bodies[row];
            }
            for (k, wrench) in wrenches.iter_mut().enumerate() {
                *wrench = dynamics.inertia_in_space_times(k, &twists[k]);
            }
            tree.space.add_rows(&geometry.placed, &adjoint.a, wrenches);
            tree.collect(geometry, q, (&mut adjoint.a, wrenches), joints);
            tree.space.collect_lengths(&geometry.placed, &adjoint.a, joints);
            self.psi.iter_mut().zip(&*joints).for_each(|(psi, joint)| psi[lane] = *joint);
            // Reactions of the joints of the tree depend on those of the cut joints.
            let cuts = tree.cuts.iter().zip(&stage.cut.gradients).zip(&mut self.psi[tree.count..]);
            for ((cut, gradient), psi) in cuts {
                let carried: f64 = gradient.iter().map(|&(i, x)| bodies[i] * x).sum();
                psi[lane] = self.batch.state.l[cut.multiplier][lane] + carried;
            }
        }
    }

    /// Propagates from accelerations of the joint coordinates (in ψ), and from what outputs have added to the batch, to the components
    /// of the current stage and to parameters.
    fn differentiate_accelerations(&mut self, stage: &mut RelativeStage<'_>, has_reactions: bool) {
        let RelativeStage { problem, dynamics, state, y, accelerations, variables, constants, jacobians, element, cut } =
            stage;
        let (tree, mechanism) = (&dynamics.tree, &problem.mechanism);
        self.psi.iter_mut().for_each(|psi| *psi = psi.map(|x| -x));
        dynamics.factor.solve(tree, &mut self.psi, &mut self.work);
        let Self {
            batch, psi, body_psi, lane: ResponseSweep { joints, bodies, twists, gaps, adjoint, out, .. }, ..
        } = self;
        let load = |lane: usize, psi: &[BatchValues], l: &[BatchValues], joints: &mut [f64], gaps: &mut [f64]| {
            joints.iter_mut().zip(psi).for_each(|(to, from)| *to = from[lane]);
            if has_reactions {
                gaps.iter_mut().zip(l).for_each(|(to, from)| *to = from[lane]);
            } else {
                gaps.fill(0.0);
            }
        };
        for lane in 0..BATCH {
            load(lane, psi, &batch.state.l, joints, gaps);
            let open = has_reactions.then_some(&gaps[..]);
            tree.place_virtual(y, joints, open, &dynamics.geometry, (twists, bodies));
            body_psi.iter_mut().zip(&*bodies).for_each(|(to, from)| to[lane] = *from);
        }
        for &([row, coordinate], [stiffness, damping, mass]) in &*constants {
            let weight = body_psi[row];
            add(&mut batch.state.q[coordinate], stiffness, &weight);
            add(&mut batch.state.v[coordinate], damping, &weight);
            add(&mut batch.state.a[coordinate], mass, &weight);
        }
        for (k, variables) in &*variables {
            let instance = &mechanism.elements[*k];
            let weights: Vec<BatchValues> = instance.coordinates.iter().map(|&i| body_psi[i]).collect();
            let sets = std::iter::once(&weights[..]);
            element.evaluate(instance, state, variables, ElementRows::Residual, sets, |_, variable, derivative| {
                batch.add(*k, instance, variable, &derivative);
            });
        }
        if !tree.cuts.is_empty() {
            let by_cuts = &psi[tree.count..];
            cut.add_vjp(batch, body_psi, by_cuts);
            // The derivatives with respect to prescribed accelerations that depend on the design are among those of the equations.
            for (gradient, psi) in cut.gradients.iter().zip(by_cuts) {
                for &(i, x) in gradient.iter().filter(|(i, _)| !cut.linearizer.moving.contains(i)) {
                    add(&mut batch.state.a[i], x, psi);
                }
            }
        }
        let point = TreePoint {
            state,
            y,
            a: accelerations,
            geometry: &dynamics.geometry,
            wrenches: &dynamics.rows,
            in_space: [&dynamics.wrenches, &dynamics.own_wrenches],
            jacobians,
        };
        for lane in 0..BATCH {
            load(lane, psi, &batch.state.l, joints, gaps);
            bodies.iter_mut().zip(&*body_psi).for_each(|(to, from)| *to = from[lane]);
            let AdjointBatch { state, design, .. } = batch;
            for (to, from) in [(&mut adjoint.q, &state.q), (&mut adjoint.v, &state.v), (&mut adjoint.a, &state.a)] {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = from[lane]);
            }
            let displacements = VirtualDisplacements { joints, bodies, gaps };
            tree.transpose(&point, &displacements, adjoint, out, |k, i, derivative| {
                design.parameters[k][i][lane] += derivative;
            });
            for (from, to) in [(&adjoint.q, &mut state.q), (&adjoint.v, &mut state.v), (&adjoint.a, &mut state.a)] {
                to.iter_mut().zip(from).for_each(|(to, from)| to[lane] = *from);
            }
            self.joints.iter_mut().zip(&*out).for_each(|(to, from)| to[lane] = *from);
        }
        batch.take_motions(mechanism, &problem.activity, state.t);
    }

    /// Propagates from the projected end of a step to its end before the projection onto the constraints of cut joints.
    ///
    /// A correction w and its multipliers μ solve w + Gᵀ μ = 0 and G w + Φ = 0, where Φ is Φ̇ for velocities and G belongs to the position
    /// before both corrections.
    fn differentiate_projection(&mut self, stage: &mut RelativeStage<'_>, record: &ProjectionRecord) {
        let n = stage.dynamics.tree.count;
        let mut between = record.y.clone();
        between[..n].iter_mut().zip(&record.solutions[0]).for_each(|(q, change)| *q += change);
        let velocities = self.solve_projection(stage, record, n..2 * n);
        stage.place_at_rest(record.t, &between, None);
        self.batch.state.clear();
        self.body_psi.fill([0.0; BATCH]);
        stage.cut_vjp(&mut self.batch, &self.body_psi, &velocities[n..], ConstraintDerivative::Velocities);
        self.psi.copy_from_slice(&velocities);
        self.add_transposed(stage, &vec![0.0; n], None);
        self.take_motions(stage);
        let positions = self.solve_projection(stage, record, 0..n);
        let still: Vec<f64> = record.y[..n].iter().copied().chain(vec![0.0; n]).collect();
        let kinds = [ConstraintDerivative::Positions, ConstraintDerivative::Corrections];
        for ((solution, psi), kind) in record.solutions.iter().zip([positions, velocities]).zip(kinds) {
            self.psi = psi;
            let (correction, multipliers) = solution.split_at(n);
            stage.place_at_rest(record.t, &still, Some((correction, multipliers)));
            self.batch.state.clear();
            for lane in 0..BATCH {
                let ResponseSweep { joints, bodies, twists, .. } = &mut self.lane;
                joints.iter_mut().zip(&self.psi).for_each(|(to, from)| *to = from[lane]);
                stage.dynamics.tree.place_virtual(&still, joints, None, &stage.dynamics.geometry, (twists, bodies));
                self.body_psi.iter_mut().zip(&*bodies).for_each(|(to, from)| to[lane] = *from);
            }
            stage.cut_vjp(&mut self.batch, &self.body_psi, &self.psi[n..], kind);
            self.add_transposed(stage, correction, Some(multipliers));
            self.take_motions(stage);
        }
    }

    /// Solves for ψ of a correction, from the derivatives with respect to the projected components in `range`.
    fn solve_projection(
        &self,
        stage: &RelativeStage<'_>,
        record: &ProjectionRecord,
        range: std::ops::Range<usize>,
    ) -> Vec<BatchValues> {
        let mut psi: Vec<BatchValues> = self.end[range].iter().map(|bar| bar.map(|x| -x)).collect();
        psi.resize(self.psi.len(), [0.0; BATCH]);
        record.factor.solve(&stage.dynamics.tree, &mut psi);
        psi
    }

    /// Adds the derivatives that the batch has with respect to bodies to those with respect to the end of the step, and with multipliers
    /// those of the powers of the cut joints' reactions: of the `multipliers` on the virtual displacements ψ, and of ψ on `correction`.
    fn add_transposed(&mut self, stage: &mut RelativeStage<'_>, correction: &[f64], multipliers: Option<&[f64]>) {
        let RelativeStage { dynamics, state, y, jacobians, cut, .. } = stage;
        let tree = &dynamics.tree;
        let n = tree.count;
        let zeros = vec![0.0; n];
        let gaps = vec![0.0; state.l.len()];
        for lane in 0..BATCH {
            let by_cuts: Vec<f64> = self.psi[n..].iter().map(|psi| psi[lane]).collect();
            let by_joints: Vec<f64> = self.psi[..n].iter().map(|psi| psi[lane]).collect();
            let Self { batch, lane: ResponseSweep { bodies, twists, wrenches, adjoint, out, .. }, end, .. } = self;
            let AdjointBatch { state: by, design, .. } = batch;
            for (to, from) in [(&mut adjoint.q, &by.q), (&mut adjoint.v, &by.v), (&mut adjoint.a, &by.a)] {
                to.iter_mut().zip(from).for_each(|(to, from)| *to = from[lane]);
            }
            let powers: &[(&[f64], &[f64])] = match multipliers {
                Some(multipliers) => &[(&by_joints, multipliers), (correction, &by_cuts)],
                None => &[(&zeros, &[])],
            };
            for (number, &(motion, forces)) in powers.iter().enumerate() {
                let mut rows = vec![0.0; state.q.len()];
                for (gradient, force) in cut.gradients.iter().zip(forces) {
                    gradient.iter().for_each(|&(i, x)| rows[i] += force * x);
                }
                wrenches.fill([0.0; 6]);
                tree.space.add_rows(&dynamics.geometry.placed, &rows, wrenches);
                let own = wrenches.clone();
                let mut unused = vec![0.0; n];
                tree.collect(&dynamics.geometry, &y[..n], (&mut rows, wrenches), &mut unused);
                tree.place_virtual(y, motion, None, &dynamics.geometry, (twists, bodies));
                if number > 0 {
                    [&mut adjoint.q, &mut adjoint.v, &mut adjoint.a].into_iter().for_each(|x| x.fill(0.0));
                }
                let point = TreePoint {
                    state,
                    y,
                    a: &zeros,
                    geometry: &dynamics.geometry,
                    wrenches: &rows,
                    in_space: [wrenches, &own],
                    jacobians,
                };
                let displacements = VirtualDisplacements { joints: motion, bodies, gaps: &gaps };
                tree.transpose(&point, &displacements, adjoint, out, |k, i, derivative| {
                    design.parameters[k][i][lane] += derivative;
                });
                end.iter_mut().zip(&*out).for_each(|(to, from)| to[lane] += from);
                for (from, to) in [(&adjoint.q, &mut by.q), (&adjoint.v, &mut by.v), (&adjoint.a, &mut by.a)] {
                    // Those with respect to prescribed coordinates remain.
                    to.iter_mut()
                        .zip(from)
                        .for_each(|(to, from)| to[lane] = if number > 0 { to[lane] + from } else { *from });
                }
            }
        }
    }

    /// Converts derivatives with respect to prescribed coordinates into those with respect to the parameters of their motions.
    fn take_motions(&mut self, stage: &RelativeStage<'_>) {
        self.batch.take_motions(&stage.problem.mechanism, &stage.problem.activity, stage.state.t);
    }

    /// Propagates from the end of a step of the length `h` (s) to its beginning and to the rates of the stages.
    fn differentiate_end(&mut self, method: &Tableau, h: f64) {
        let Self { end, begin, rates, .. } = self;
        let add_end =
            |to: &mut [BatchValues], factor: f64| to.iter_mut().zip(&*end).for_each(|(to, end)| add(to, factor, end));
        add_end(begin, 1.0);
        for &(j, weight) in method.stages[method.end] {
            add_end(&mut rates[j], h * weight);
        }
    }

    /// Makes the beginning of the step the end of the one before, whose last slot is `end`.
    fn move_to_earlier_step(&mut self, end: usize) {
        std::mem::swap(&mut self.begin, &mut self.end);
        self.begin.fill([0.0; BATCH]);
        self.rates.swap(0, end);
        self.rates.iter_mut().enumerate().filter(|(slot, _)| *slot != end).for_each(|(_, r)| r.fill([0.0; BATCH]));
    }

    /// Propagates from the joint coordinates at the start of the motion to the positions and velocities `values` of all bodies: the
    /// transpose of [`Tree::joint_state`].
    fn take_joint_state(&mut self, mechanism: &Mechanism<f64>, tree: &Tree, values: &State<f64>) {
        self.batch.state.clear();
        let n = tree.count;
        let take = |batch: &mut AdjointBatch, at: usize, i: usize, end: &[BatchValues]| {
            add(&mut batch.state.q[i], 1.0, &end[at]);
            add(&mut batch.state.v[i], 1.0, &end[n + at]);
        };
        let Self { batch, end, .. } = self;
        for node in &tree.nodes {
            match (node.joint, node.element) {
                (Joint::Free { .. }, _) => {
                    node.free_coordinates().enumerate().for_each(|(k, i)| take(batch, node.first + k, i, end));
                }
                (Joint::Revolute | Joint::Prismatic, Some(k)) => {
                    let adjoints = [&end[node.first], &end[n + node.first]];
                    take_joint(batch, node, k, &mechanism.elements[k].parameters, values, adjoints);
                }
                _ => {}
            }
        }
        tree.singles.iter().enumerate().for_each(|(k, &i)| take(batch, tree.first_single + k, i, end));
        let parameters = |k: usize| &mechanism.elements[k].parameters[..];
        tree.space.differentiate_joint_state(values, parameters, |at, variable, [coordinate, velocity]| {
            let to = match variable {
                StartVariable::Position(i) => &mut batch.state.q[i],
                StartVariable::Velocity(i) => &mut batch.state.v[i],
                StartVariable::Parameter(k, i) => &mut batch.design.parameters[k][i],
            };
            add(to, coordinate, &end[at]);
            add(to, velocity, &end[n + at]);
        });
    }
}

/// Adds the derivatives with respect to positions, velocities and parameters of a joint, from the `adjoints` of its coordinate and
/// velocity.
fn take_joint(
    batch: &mut AdjointBatch,
    node: &TreeBody,
    element: usize,
    parameters: &[f64],
    values: &State<f64>,
    adjoints: [&BatchValues; 2],
) {
    let bodies = [motion_of(values, node.parent), motion_of(values, node.coordinates)];
    let variables: Vec<f64> = bodies.as_flattened().as_flattened().iter().chain(parameters).copied().collect();
    for first in (0..variables.len()).step_by(WIDTH) {
        let seed = |(i, &x): (usize, &f64)| match i.checked_sub(first) {
            Some(k) if k < WIDTH => Dual8::variable(x, k),
            _ => Dual8::constant(x),
        };
        let seeded: Vec<Dual8> = variables.iter().enumerate().map(seed).collect();
        let of = |from: usize| [seeded[from], seeded[from + 1], seeded[from + 2]];
        let coordinate = joint_coordinate(node, &seeded[12..], [of(0), of(3)], [of(6), of(9)]);
        for k in 0..WIDTH.min(variables.len() - first) {
            let variable = first + k;
            let [body, local] = [variable / 6, variable % 3];
            let coordinates = if body == 0 { node.parent } else { node.coordinates };
            let to = match variable {
                12.. => &mut batch.design.parameters[element][variable - 12],
                _ if variable % 6 < 3 => &mut batch.state.q[coordinates[local]],
                _ => &mut batch.state.v[coordinates[local]],
            };
            coordinate.iter().zip(adjoints).for_each(|(x, adjoint)| add(to, x.eps[k], adjoint));
        }
    }
}
