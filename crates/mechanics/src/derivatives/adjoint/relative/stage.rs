//! One stage of an explicit step in relative coordinates, at which the equations are differentiated.

use crate::Result;
use crate::derivatives::adjoint::adjoint_state::{BATCH, BatchValues};
use crate::derivatives::adjoint::batch::AdjointBatch;
use crate::derivatives::adjoint::element_vjp::{ElementVariable, ElementVjp};
use crate::derivatives::adjoint::problem::AdjointProblem;
use crate::derivatives::forward::explicit::constraint::ConstraintDerivative;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::{ElementWorkspaces, Linearizer};
use crate::mechanism::Mechanism;
use crate::system::System;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::tree::cut;
use crate::tree::dynamics::TreeDynamics;
use crate::tree::space::transpose::{NodeJacobian, SpacePoint};
use crate::tree::topology::CutRow;
use crate::tree::topology::Tree;

/// One stage of a step, which all responses share.
pub(super) struct RelativeStage<'m> {
    pub problem: &'m AdjointProblem<'m>,
    pub dynamics: TreeDynamics,
    /// The state with its accelerations and reactions.
    pub state: State<f64>,
    /// Joint coordinates and velocities.
    pub y: Vec<f64>,
    /// Accelerations of the joint coordinates.
    pub accelerations: Vec<f64>,
    /// Elements and the variables with respect to which their rows are differentiated.
    pub variables: Vec<(usize, Vec<ElementVariable>)>,
    /// Derivatives that are the same in every state: coordinate of the row, coordinate, and derivatives with respect to position,
    /// velocity and acceleration.
    pub constants: Vec<([usize; 2], [f64; 3])>,
    /// Derivatives of the bodies in space, for the current stage.
    pub jacobians: Vec<NodeJacobian>,
    pub element: ElementVjp,
    pub cut: CutStage,
}

/// Cut joints at a stage.
pub(super) struct CutStage {
    pub linearizer: Linearizer,
    pub entries: Entries,
    pub workspaces: ElementWorkspaces,
    /// Derivatives of the equations with respect to coordinates.
    pub gradients: Vec<Vec<(usize, f64)>>,
    /// Equations of all coordinates, and of the multipliers of the cut joints.
    pub equations: Vec<Option<usize>>,
    pub multipliers: Vec<usize>,
    pub sources: Vec<BatchValues>,
}

impl CutStage {
    pub fn new(problem: &AdjointProblem<'_>, system: &System, tree: &Tree) -> Self {
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
    pub fn linearize(
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
    pub fn add_vjp(&mut self, batch: &mut AdjointBatch, bodies: &[BatchValues], psi: &[BatchValues]) {
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
    pub fn new(problem: &'m AdjointProblem<'m>, system: &System, dynamics: TreeDynamics, state: State<f64>) -> Self {
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
    pub fn load(&mut self, t: f64, y: &[f64], has_reactions: bool) -> Result<()> {
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
    pub fn place_at_rest(&mut self, t: f64, y: &[f64], correction: Option<(&[f64], &[f64])>) {
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
    pub fn cut_vjp(
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
