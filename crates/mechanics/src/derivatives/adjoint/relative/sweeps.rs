//! Adjoint states of a batch of responses at the stages of a step, and their propagation through a stage.

use super::stage::RelativeStage;
use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, add};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::element_vjp::ElementRows;
use crate::derivatives::adjoint::problem::OutputTerm;
use crate::derivatives::forward::explicit::constraint::ConstraintDerivative;
use crate::integrators::explicit::tableau::{DenseWeights, Tableau};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::Dual8;
use crate::system::System;
use crate::system::state::State;
use crate::tree::articulated::ArticulatedWorkspace;
use crate::tree::dynamics::ProjectionRecord;
use crate::tree::joint::TreeBody;
use crate::tree::joint::{Joint, joint_coordinate, motion_of};
use crate::tree::space::placed::Twist;
use crate::tree::space::transpose::BodyAdjoint;
use crate::tree::space::transpose::StartVariable;
use crate::tree::topology::Tree;
use crate::tree::transpose::{TreePoint, VirtualDisplacements};
use autodiff::WIDTH;

/// Derivatives to which those with respect to a stage are added.
pub(super) enum Target {
    Begin,
    End,
    Rates(usize),
}

/// Adjoint states of a batch of responses at the stages of a step, as in [`explicit`](crate::derivatives::adjoint::explicit).
pub(super) struct RelativeAdjoint {
    pub batch: AdjointBatch,
    /// With respect to the components at the end of the step: joint coordinates and then their velocities.
    pub end: Vec<BatchValues>,
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
    sweep: ResponseSweep,
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

impl ResponseSweep {
    /// Loads ψ of the joint coordinates for one response, and the derivatives with respect to `reactions`, if it has any.
    fn load(&mut self, lane: usize, psi: &[BatchValues], reactions: Option<&[BatchValues]>) {
        self.joints.iter_mut().zip(psi).for_each(|(to, from)| *to = from[lane]);
        match reactions {
            Some(reactions) => self.gaps.iter_mut().zip(reactions).for_each(|(to, from)| *to = from[lane]),
            None => self.gaps.fill(0.0),
        }
    }

    /// Loads the derivatives of one response with respect to all coordinates.
    fn load_adjoint(&mut self, lane: usize, state: &AdjointState) {
        let BodyAdjoint { q, v, a } = &mut self.adjoint;
        for (to, from) in [(q, &state.q), (v, &state.v), (a, &state.a)] {
            to.iter_mut().zip(from).for_each(|(to, from)| *to = from[lane]);
        }
    }

    /// Stores the derivatives of one response with respect to all coordinates, or adds them to those of `state`.
    fn store_adjoint(&self, lane: usize, state: &mut AdjointState, is_added: bool) {
        let BodyAdjoint { q, v, a } = &self.adjoint;
        for (from, to) in [(q, &mut state.q), (v, &mut state.v), (a, &mut state.a)] {
            to.iter_mut().zip(from).for_each(|(to, from)| to[lane] = if is_added { to[lane] + from } else { *from });
        }
    }
}

impl RelativeAdjoint {
    pub fn new(mechanism: &Mechanism<f64>, system: &System, tree: &Tree, method: &Tableau) -> Self {
        let count = tree.count;
        let (n, zeros) = (mechanism.coordinates.len(), vec![[0.0; BATCH]; 2 * count]);
        let adjoint = BodyAdjoint { q: vec![0.0; n], v: vec![0.0; n], a: vec![0.0; n] };
        let (joints, bodies, out) = (vec![0.0; count], vec![0.0; n], vec![0.0; 2 * count]);
        let twists = vec![[0.0; 6]; tree.space.nodes.len()];
        let wrenches = twists.clone();
        let sweep =
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
            sweep,
        }
    }

    /// Adds `factor` times the derivatives with respect to the current stage to others.
    pub fn add_joints(&mut self, factor: f64, target: Target) {
        let to = match target {
            Target::Begin => &mut self.begin,
            Target::End => &mut self.end,
            Target::Rates(slot) => &mut self.rates[slot],
        };
        to.iter_mut().zip(&self.joints).for_each(|(to, from)| add(to, factor, from));
    }

    /// Adds the derivatives of outputs of the current stage: inside a step of the length `h` (s) with the weights of dense output,
    /// or at its end.
    pub fn add_outputs<'w>(
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
    pub fn differentiate_rates(&mut self, stage: &mut RelativeStage<'_>, slot: usize) {
        let count = self.joints.len() / 2;
        self.batch.state.clear();
        self.psi[..count].copy_from_slice(&self.rates[slot][count..]);
        self.psi[count..].fill([0.0; BATCH]);
        self.differentiate_accelerations(stage, false);
        for (to, from) in self.joints[count..].iter_mut().zip(&self.rates[slot][..count]) {
            add(to, 1.0, from);
        }
    }

    /// Writes the derivatives with respect to accelerations of the joint coordinates to ψ, from those with respect to
    /// accelerations of bodies and to reactions, which are in the batch.
    pub fn load_reactions(&mut self, stage: &RelativeStage<'_>) {
        let (dynamics, tree, geometry) = (&stage.dynamics, &stage.dynamics.tree, &stage.dynamics.geometry);
        let q = &stage.y[..tree.count];
        let ResponseSweep { joints, bodies, twists, wrenches, gaps, adjoint, .. } = &mut self.sweep;
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
        self.psi.iter_mut().for_each(|psi| *psi = psi.map(|x| -x));
        stage.dynamics.factor.solve(&stage.dynamics.tree, &mut self.psi, &mut self.work);
        self.place_virtual(stage, has_reactions);
        self.add_element_vjps(stage);
        if !stage.dynamics.tree.cuts.is_empty() {
            self.add_cut_vjps(stage);
        }
        self.transpose(stage, has_reactions);
        self.take_motions(stage);
    }

    /// Writes the virtual displacements of all coordinates for ψ, and for the derivatives with respect to reactions if `has_reactions`.
    fn place_virtual(&mut self, stage: &RelativeStage<'_>, has_reactions: bool) {
        let reactions = has_reactions.then_some(&self.batch.state.l[..]);
        for lane in 0..BATCH {
            self.sweep.load(lane, &self.psi, reactions);
            let ResponseSweep { joints, bodies, twists, gaps, .. } = &mut self.sweep;
            let gaps = has_reactions.then_some(&gaps[..]);
            stage.dynamics.tree.place_virtual(&stage.y, joints, gaps, &stage.dynamics.geometry, (twists, bodies));
            self.body_psi.iter_mut().zip(&*bodies).for_each(|(to, from)| to[lane] = *from);
        }
    }

    /// Adds the derivatives of the power of the elements on the virtual displacements.
    fn add_element_vjps(&mut self, stage: &mut RelativeStage<'_>) {
        let (Self { batch, body_psi, .. }, mechanism) = (self, &stage.problem.mechanism);
        for &([row, coordinate], [stiffness, damping, mass]) in &stage.constants {
            let weight = body_psi[row];
            add(&mut batch.state.q[coordinate], stiffness, &weight);
            add(&mut batch.state.v[coordinate], damping, &weight);
            add(&mut batch.state.a[coordinate], mass, &weight);
        }
        for (k, variables) in &stage.variables {
            let instance = &mechanism.elements[*k];
            let weights: Vec<BatchValues> = instance.coordinates.iter().map(|&i| body_psi[i]).collect();
            let sets = std::iter::once(&weights[..]);
            let rows = ElementRows::Residual;
            stage.element.evaluate(instance, &stage.state, variables, rows, sets, |_, variable, derivative| {
                batch.add(*k, instance, variable, &derivative);
            });
        }
    }

    /// Adds the derivatives of the equations of the cut joints.
    fn add_cut_vjps(&mut self, stage: &mut RelativeStage<'_>) {
        let (Self { batch, body_psi, psi, .. }, cut) = (self, &mut stage.cut);
        let by_cuts = &psi[stage.dynamics.tree.count..];
        cut.add_vjp(batch, body_psi, by_cuts);
        // The derivatives with respect to prescribed accelerations that depend on the design are among those of the equations.
        for (gradient, psi) in cut.gradients.iter().zip(by_cuts) {
            for &(i, x) in gradient.iter().filter(|(i, _)| !cut.linearizer.moving.contains(i)) {
                add(&mut batch.state.a[i], x, psi);
            }
        }
    }

    /// Propagates from the derivatives with respect to all coordinates to the components of the current stage and to parameters of joints.
    fn transpose(&mut self, stage: &RelativeStage<'_>, has_reactions: bool) {
        let RelativeStage { dynamics, state, y, accelerations, jacobians, .. } = stage;
        let point = TreePoint {
            state,
            y,
            a: accelerations,
            geometry: &dynamics.geometry,
            wrenches: &dynamics.rows,
            in_space: [&dynamics.wrenches, &dynamics.own_wrenches],
            jacobians,
        };
        let AdjointBatch { state: by, design, .. } = &mut self.batch;
        for lane in 0..BATCH {
            self.sweep.load(lane, &self.psi, has_reactions.then_some(&by.l[..]));
            self.sweep.bodies.iter_mut().zip(&self.body_psi).for_each(|(to, from)| *to = from[lane]);
            self.sweep.load_adjoint(lane, by);
            let ResponseSweep { joints, bodies, gaps, adjoint, out, .. } = &mut self.sweep;
            let displacements = VirtualDisplacements { joints, bodies, gaps };
            dynamics.tree.transpose(&point, &displacements, adjoint, out, |k, i, derivative| {
                design.parameters[k][i][lane] += derivative;
            });
            self.joints.iter_mut().zip(&*out).for_each(|(to, from)| to[lane] = *from);
            self.sweep.store_adjoint(lane, by, false);
        }
    }

    /// Propagates from the projected end of a step to its end before the projection onto the constraints of cut joints.
    ///
    /// A correction w and its multipliers μ solve w + Gᵀ μ = 0 and G w + Φ = 0, where Φ is Φ̇ for velocities and G belongs to the position
    /// before both corrections.
    pub fn differentiate_projection(&mut self, stage: &mut RelativeStage<'_>, record: &ProjectionRecord) {
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
            self.place_virtual(stage, false);
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

    /// Propagates the derivatives with respect to bodies, which are in the batch, to the end of the step. With
    /// `multipliers` of the cut joints, the derivatives of two powers are added: that of their reactions on the virtual
    /// displacements ψ, and that of the reactions of ψ on `correction`.
    fn add_transposed(&mut self, stage: &RelativeStage<'_>, correction: &[f64], multipliers: Option<&[f64]>) {
        let n = stage.dynamics.tree.count;
        let zeros = vec![0.0; n];
        for lane in 0..BATCH {
            let by_cuts: Vec<f64> = self.psi[n..].iter().map(|psi| psi[lane]).collect();
            let by_joints: Vec<f64> = self.psi[..n].iter().map(|psi| psi[lane]).collect();
            let powers: &[(&[f64], &[f64])] = match multipliers {
                Some(multipliers) => &[(&by_joints, multipliers), (correction, &by_cuts)],
                None => &[(&zeros, &[])],
            };
            self.sweep.load_adjoint(lane, &self.batch.state);
            for (number, &(motion, forces)) in powers.iter().enumerate() {
                if number > 0 {
                    self.sweep.adjoint.clear();
                }
                self.transpose_power(stage, lane, motion, forces);
                // Those with respect to prescribed coordinates remain.
                self.sweep.store_adjoint(lane, &mut self.batch.state, number > 0);
            }
        }
    }

    /// Propagates the derivatives of one response with respect to bodies, which are in the sweep, to the end of the
    /// step, with those of the power of the cut joints: of their `forces` on the virtual `motion` of the joint
    /// coordinates.
    fn transpose_power(&mut self, stage: &RelativeStage<'_>, lane: usize, motion: &[f64], forces: &[f64]) {
        let RelativeStage { dynamics, state, y, jacobians, cut, .. } = stage;
        let (tree, geometry) = (&dynamics.tree, &dynamics.geometry);
        let ResponseSweep { bodies, twists, wrenches, adjoint, out, .. } = &mut self.sweep;
        let mut rows = vec![0.0; state.q.len()];
        for (gradient, force) in cut.gradients.iter().zip(forces) {
            gradient.iter().for_each(|&(i, x)| rows[i] += force * x);
        }
        wrenches.fill([0.0; 6]);
        tree.space.add_rows(&geometry.placed, &rows, wrenches);
        let own = wrenches.clone();
        let mut unused = vec![0.0; tree.count];
        tree.collect(geometry, &y[..tree.count], (&mut rows, wrenches), &mut unused);
        tree.place_virtual(y, motion, None, geometry, (twists, bodies));
        let (zeros, gaps) = (vec![0.0; tree.count], vec![0.0; state.l.len()]);
        let point = TreePoint { state, y, a: &zeros, geometry, wrenches: &rows, in_space: [wrenches, &own], jacobians };
        let displacements = VirtualDisplacements { joints: motion, bodies, gaps: &gaps };
        let design = &mut self.batch.design;
        tree.transpose(&point, &displacements, adjoint, out, |k, i, derivative| {
            design.parameters[k][i][lane] += derivative;
        });
        self.end.iter_mut().zip(&*out).for_each(|(to, from)| to[lane] += from);
    }

    /// Converts derivatives with respect to prescribed coordinates into those with respect to the parameters of their motions.
    pub fn take_motions(&mut self, stage: &RelativeStage<'_>) {
        self.batch.take_motions(&stage.problem.mechanism, &stage.problem.activity, stage.state.t);
    }

    /// Propagates from the end of a step of the length `h` (s) to its beginning and to the rates of the stages.
    pub fn differentiate_end(&mut self, method: &Tableau, h: f64) {
        let Self { end, begin, rates, .. } = self;
        let add_end =
            |to: &mut [BatchValues], factor: f64| to.iter_mut().zip(&*end).for_each(|(to, end)| add(to, factor, end));
        add_end(begin, 1.0);
        for &(j, weight) in method.stages[method.end] {
            add_end(&mut rates[j], h * weight);
        }
    }

    /// Makes the beginning of the step the end of the one before, whose last slot is `end`.
    pub fn move_to_earlier_step(&mut self, end: usize) {
        std::mem::swap(&mut self.begin, &mut self.end);
        self.begin.fill([0.0; BATCH]);
        self.rates.swap(0, end);
        self.rates.iter_mut().enumerate().filter(|(slot, _)| *slot != end).for_each(|(_, r)| r.fill([0.0; BATCH]));
    }

    /// Propagates from the joint coordinates at the start of the motion to the positions and velocities `values` of all bodies: the
    /// transpose of [`Tree::joint_state`].
    pub fn take_joint_state(&mut self, mechanism: &Mechanism<f64>, tree: &Tree, values: &State<f64>) {
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
