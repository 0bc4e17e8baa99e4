//! Adjoint equations of a batch of responses, and the vector-Jacobian products of a mechanism's elements.

use crate::derivatives::adjoint::adjoint_state::{AdjointState, BATCH, BatchValues, DesignAdjoint, add};
use crate::derivatives::adjoint::element_vjp::{ElementRows, ElementVariable, ElementVjp};
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::forward::explicit::linearize::Linearizer;
use crate::derivatives::seeding::Activity;
use crate::integrators::generalized_alpha::Prescribed;
use crate::linalg::factor::Factor;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::State;
use crate::system::{System, Unknown};

/// Derivatives of up to [`BATCH`] responses, which are propagated backwards in time.
#[derive(Clone)]
pub(crate) struct AdjointBatch {
    /// With respect to the current state.
    pub state: AdjointState,
    /// With respect to parameters, summed from the end of the motion to the current state.
    pub design: DesignAdjoint,
    /// ψ by equation.
    pub multipliers: Vec<BatchValues>,
}

impl AdjointBatch {
    /// Zeros for the responses of `mechanism`, which has `size` equations.
    pub fn new(mechanism: &Mechanism<f64>, size: usize) -> Self {
        let (state, design) = (AdjointState::new(mechanism), DesignAdjoint::new(mechanism));
        Self { state, design, multipliers: vec![[0.0; BATCH]; size] }
    }

    /// Solves Aᵀ ψ = −x̄ with the factorization of `system`, where `adjoint` returns x̄ of an unknown.
    pub fn solve(&mut self, system: &mut System, adjoint: impl Fn(&AdjointState, Unknown) -> BatchValues) {
        for (psi, unknown) in self.multipliers.iter_mut().zip(system.unknowns()) {
            *psi = adjoint(&self.state, *unknown).map(|x| -x);
        }
        system.factor().solve_transposed(&mut self.multipliers);
    }

    /// Solves Aᵀ ψ = −x̄, where x̄ are the derivatives with respect to accelerations and multipliers; these become zero.
    pub fn solve_accelerations(&mut self, unknowns: &[Unknown], factor: &mut Factor) {
        for (psi, unknown) in self.multipliers.iter_mut().zip(unknowns) {
            let adjoint = match *unknown {
                Unknown::Coordinate(i) => &mut self.state.a[i],
                Unknown::Multiplier(m) => &mut self.state.l[m],
            };
            *psi = std::mem::take(adjoint).map(|x| -x);
        }
        factor.solve_transposed(&mut self.multipliers);
    }

    /// Solves Aᵀ ψ = −x̄, where x̄ is in `coordinates` and zero for multipliers.
    pub fn solve_coordinates(&mut self, unknowns: &[Unknown], factor: &mut Factor, coordinates: &[BatchValues]) {
        for (psi, unknown) in self.multipliers.iter_mut().zip(unknowns) {
            *psi = match *unknown {
                Unknown::Coordinate(i) => coordinates[i].map(|x| -x),
                Unknown::Multiplier(_) => [0.0; BATCH],
            };
        }
        factor.solve_transposed(&mut self.multipliers);
    }

    /// Adds ψᵀ times the `entries` to the derivatives; `sources` is a workspace.
    pub fn add_vjp(&mut self, entries: &Entries, linearizer: &Linearizer, sources: &mut [BatchValues]) {
        sources.fill([0.0; BATCH]);
        entries.vjp(&self.multipliers, sources);
        let AdjointState { q, v, a, .. } = &mut self.state;
        let (by_state, by_parameter) = sources.split_at(3 * q.len());
        let parameters = linearizer.parameters.iter();
        q.iter_mut().chain(v).chain(a).zip(by_state).for_each(|(to, from)| add(to, 1.0, from));
        parameters.zip(by_parameter).for_each(|(&(k, i), from)| add(&mut self.design.parameters[k][i], 1.0, from));
    }

    /// Converts the derivatives with respect to prescribed coordinates at time `t` (s) into those with respect to the
    /// parameters of their motions.
    pub fn take_motions(&mut self, mechanism: &Mechanism<f64>, activity: &Activity, t: f64) {
        for i in activity.moving_coordinates() {
            let AdjointState { q, v, a, .. } = &mut self.state;
            let adjoints = [&mut q[i], &mut v[i], &mut a[i]].map(std::mem::take);
            self.design.add_motion(mechanism, i, t, Prescribed::Exact, adjoints.each_ref());
        }
    }

    /// Adds derivatives with respect to a variable of element number `k`, which is `instance`.
    pub fn add(
        &mut self,
        k: usize,
        instance: &ElementInstance<f64>,
        variable: ElementVariable,
        derivative: &BatchValues,
    ) {
        let Self { state, design, .. } = self;
        let to = match variable {
            ElementVariable::Position(i) => &mut state.q[instance.coordinates[i]],
            ElementVariable::Velocity(i) => &mut state.v[instance.coordinates[i]],
            ElementVariable::Acceleration(i) => &mut state.a[instance.coordinates[i]],
            ElementVariable::Multiplier(i) => &mut state.l[instance.first_multiplier + i],
            ElementVariable::Parameter(i) => &mut design.parameters[k][i],
        };
        add(to, 1.0, derivative);
    }

    /// Writes ψ of the rows of element number `k`; those after the first `coordinates` are constraints.
    fn element_weights(
        &self,
        system: &System,
        k: usize,
        coordinates: usize,
        constraint_scale: f64,
        weights: &mut [BatchValues],
    ) {
        weights.fill([0.0; BATCH]);
        for (row, equation) in system.rows_of(k) {
            let scale = if row < coordinates { 1.0 } else { constraint_scale };
            add(&mut weights[row], scale, &self.multipliers[equation]);
        }
    }
}

/// Derivatives of an equation with respect to a coordinate that are the same in every state.
struct ConstantDerivatives {
    /// Number of the element.
    element: usize,
    equation: usize,
    is_constraint: bool,
    coordinate: usize,
    /// With respect to its position, velocity and acceleration.
    values: [f64; 3],
}

/// Vector-Jacobian products ψᵀ ∂F of all elements of a mechanism.
pub(crate) struct SystemVjp {
    /// The variables of each element with respect to which its rows are differentiated.
    variables: Vec<Vec<ElementVariable>>,
    /// Derivatives that are the same in every state; they are not among those of the variables.
    constants: Vec<ConstantDerivatives>,
    /// For each batch, ψ of the rows of one element.
    weights: Vec<Vec<BatchValues>>,
    /// Products of one element.
    pub element: ElementVjp,
}

impl SystemVjp {
    /// Products with respect to free coordinates and active parameters.
    pub fn new(mechanism: &Mechanism<f64>, activity: &Activity, system: &System, batches: usize) -> Self {
        let size = |instance: &ElementInstance<f64>| instance.coordinates.len() + instance.num_constraints;
        let most = mechanism.elements.iter().map(size).max().unwrap_or(0);
        Self {
            variables: variables(mechanism, activity),
            constants: constants(mechanism, activity, system),
            weights: vec![vec![[0.0; BATCH]; most]; batches],
            element: ElementVjp::default(),
        }
    }

    /// Products at an equilibrium: without velocities, accelerations, and the positions of free coordinates.
    pub fn at_rest(mechanism: &Mechanism<f64>, activity: &Activity, system: &System, batches: usize) -> Self {
        let mut vjp = Self::new(mechanism, activity, system, batches);
        vjp.constants.retain(|constant| activity.motions[constant.coordinate]);
        for (instance, variables) in mechanism.elements.iter().zip(&mut vjp.variables) {
            variables.retain(|variable| match *variable {
                ElementVariable::Position(i) => activity.motions[instance.coordinates[i]],
                ElementVariable::Parameter(_) => true,
                _ => false,
            });
        }
        vjp
    }

    /// Adds ψᵀ ∂F/∂x for every variable x of every element to the `batches`; constraint rows are multiplied by
    /// `constraint_scale`.
    pub fn add(
        &mut self,
        mechanism: &Mechanism<f64>,
        system: &System,
        state: &State<f64>,
        constraint_scale: f64,
        batches: &mut [&mut AdjointBatch],
    ) {
        let Self { variables, constants, weights, element } = self;
        let is_active = |constant: &&ConstantDerivatives| state.modes.is_active(&mechanism.elements[constant.element]);
        for constant in constants.iter().filter(is_active) {
            let ConstantDerivatives { equation, is_constraint, coordinate, values: [stiffness, damping, mass], .. } =
                constant;
            let scale = if *is_constraint { constraint_scale } else { 1.0 };
            for AdjointBatch { state, multipliers, .. } in batches.iter_mut().map(|batch| &mut **batch) {
                let psi = &multipliers[*equation];
                add(&mut state.q[*coordinate], scale * *stiffness, psi);
                add(&mut state.v[*coordinate], scale * *damping, psi);
                add(&mut state.a[*coordinate], scale * *mass, psi);
            }
        }
        let instances = mechanism.elements.iter().zip(variables).enumerate();
        for (k, (instance, variables)) in instances.filter(|(_, (_, variables))| !variables.is_empty()) {
            let (rows, n) = (instance.coordinates.len() + instance.num_constraints, instance.coordinates.len());
            for (batch, weights) in batches.iter().zip(weights.iter_mut()) {
                batch.element_weights(system, k, n, constraint_scale, weights);
            }
            let sets = weights[..batches.len()].iter().map(|weights| &weights[..rows]);
            element.evaluate(instance, state, variables, ElementRows::Residual, sets, |set, variable, derivative| {
                batches[set].add(k, instance, variable, &derivative);
            });
        }
    }
}

/// The variables of each element with respect to which its rows are differentiated.
fn variables(mechanism: &Mechanism<f64>, activity: &Activity) -> Vec<Vec<ElementVariable>> {
    let of = |(k, instance): (usize, &ElementInstance<f64>)| {
        if instance.element.is_sensor() {
            return Vec::new();
        }
        let (mut variables, linear) = (Vec::new(), instance.linear());
        let is_differentiated = |&local: &usize| {
            activity.is_differentiated(mechanism, instance.coordinates[local]) && !linear.contains(&local)
        };
        let moving: Vec<usize> = (0..instance.coordinates.len()).filter(is_differentiated).collect();
        // A constraint adds λ Φ_q(q), which depends neither on velocities nor on accelerations.
        if instance.num_constraints == 0 {
            let driven = moving.iter().filter(|&&local| activity.motions[instance.coordinates[local]]);
            variables.extend(driven.map(|&local| ElementVariable::Acceleration(local)));
            variables.extend(moving.iter().map(|&local| ElementVariable::Velocity(local)));
        }
        variables.extend(moving.iter().map(|&local| ElementVariable::Position(local)));
        variables.extend(activity.parameters[k].iter().map(|&p| ElementVariable::Parameter(p)));
        variables
    };
    mechanism.elements.iter().enumerate().map(of).collect()
}

fn constants(mechanism: &Mechanism<f64>, activity: &Activity, system: &System) -> Vec<ConstantDerivatives> {
    let mut constants = Vec::new();
    for (k, instance) in mechanism.elements.iter().enumerate() {
        for entry in system.coefficients(k) {
            let coordinate = instance.coordinates[entry.coordinate];
            let row = system.rows_of(k).find(|(row, _)| *row == entry.row);
            let is_differentiated = activity.is_differentiated(mechanism, coordinate);
            let Some((row, equation)) = row.filter(|_| is_differentiated) else { continue };
            let [stiffness, damping, mass] = entry.values;
            // A new acceleration is an unknown, unless it is prescribed.
            let mass = if activity.motions[coordinate] { mass } else { 0.0 };
            let (is_constraint, values) = (row >= instance.coordinates.len(), [stiffness, damping, mass]);
            if values != [0.0; 3] {
                constants.push(ConstantDerivatives { element: k, equation, is_constraint, coordinate, values });
            }
        }
    }
    constants
}
