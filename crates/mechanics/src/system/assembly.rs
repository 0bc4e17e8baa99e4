//! Assembly of the residual in any number type, and of the matrix with its right-hand side.

use crate::elements::element::{ElementState, ElementWorkspace, JacobianWorkspace};
use crate::linalg::factor::Factor;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::System;
use crate::system::dof_map::DofMap;
use crate::system::linearization::{HELD, Linearization};
use crate::system::modes::Modes;
use crate::system::state::{State, evaluate, gather};
use nalgebra::DMatrix;

/// Storage for the constraints' Jacobian that is used again.
#[derive(Clone, Debug, Default)]
pub(crate) struct ConstraintWorkspace {
    jacobian: JacobianWorkspace,
    elements: ElementWorkspace<f64>,
    columns: Vec<f64>,
}

impl System {
    /// Writes the residual by equation: equations of motion, and constraints times `constraint`.
    pub fn residual<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        constraint: f64,
        workspace: &mut ElementWorkspace<T>,
        rows: &mut [T],
    ) {
        self.add_up(mechanism, state, workspace, constraint, rows, |_| true);
    }

    /// Writes the residual of the equations of motion without the forces that depend on reactions, by equation.
    pub fn impulse_rows<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        workspace: &mut ElementWorkspace<T>,
        rows: &mut [T],
    ) {
        self.add_up(mechanism, state, workspace, 1.0, rows, |instance| instance.num_reactions == 0);
    }

    /// Writes the residual of the projection onto the constraints: Φ_qᵀ λ in the rows of coordinates, Φ in the rows of
    /// constraints.
    pub fn constraint_rows<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        workspace: &mut ElementWorkspace<T>,
        rows: &mut [T],
    ) {
        self.add_up(mechanism, state, workspace, 1.0, rows, |instance| instance.num_constraints > 0);
    }

    /// Adds M v of the free `velocities`, by coordinate, at the positions of `state` to the rows of the coordinates.
    pub(crate) fn add_momenta<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        (state, velocities): (&State<T>, &[T]),
        jets: &mut ElementWorkspace<Jet2<T>>,
        rows: &mut [T],
    ) where
        Jet2<T>: ElementScalar,
    {
        for (instance, map) in mechanism.elements.iter().zip(&self.maps) {
            let has_mass = instance.num_constraints == 0 && instance.num_reactions == 0 && !map.active.is_empty();
            if has_mass && state.modes.is_active(instance) {
                momentum_jets(self, instance, (state, velocities), jets);
                let n = instance.coordinates.len();
                for (&r, &equation) in map.active.iter().zip(&map.equations).filter(|(r, _)| **r < n) {
                    rows[equation] += jets.dynamics[r].v1;
                }
            }
        }
    }

    /// Sums the rows of the selected elements, those of constraints times `constraint`.
    fn add_up<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        workspace: &mut ElementWorkspace<T>,
        constraint: f64,
        rows: &mut [T],
        is_wanted: impl Fn(&ElementInstance<T>) -> bool,
    ) {
        rows.fill(T::from(0.0));
        for (instance, map) in mechanism.elements.iter().zip(&self.maps) {
            if !map.active.is_empty() && is_wanted(instance) {
                evaluate(instance, state, workspace);
                scatter(instance, map, workspace, constraint, rows);
            }
        }
    }

    /// Overwrites the constraint rows of active elements with the constraints (`order` 0) or their time derivative of `order` 1 or 2 along the
    /// motion.
    pub fn constraint_rates<T: StateScalar>(
        &self,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        order: usize,
        workspace: &mut ElementWorkspace<Jet2<T>>,
        rows: &mut [T],
    ) where
        Jet2<T>: ElementScalar,
    {
        let constraints = mechanism.elements.iter().filter(|instance| instance.num_constraints > 0);
        for instance in constraints.filter(|instance| state.modes.is_active(instance)) {
            constraint_jets(instance, state, workspace);
            for (k, constraint) in workspace.constraint.iter().enumerate() {
                let rate = [constraint.re, constraint.v1, constraint.v2][order];
                rows[self.multiplier_equation[instance.first_multiplier + k]] = rate;
            }
        }
    }
}

/// Evaluates the constraints of an element with their first and second time derivatives along the motion of `state`.
pub(crate) fn constraint_jets<T: StateScalar>(
    instance: &ElementInstance<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<Jet2<T>>,
) where
    Jet2<T>: ElementScalar,
{
    let (zero, one) = (T::from(0.0), T::from(1.0));
    let constant = |&x: &T| Jet2::new(x, zero, zero);
    workspace.p.clear();
    workspace.p.extend(instance.parameters.iter().map(constant));
    workspace.q.clear();
    workspace.q.extend(instance.coordinates.iter().map(|&i| Jet2::new(state.q[i], state.v[i], state.a[i])));
    for zeros in [&mut workspace.v, &mut workspace.a] {
        zeros.clear();
        zeros.resize(instance.coordinates.len(), constant(&zero));
    }
    workspace.l.clear();
    workspace.l.resize(instance.num_constraints, constant(&zero));
    Jet2::<T>::residual(instance.element.as_ref(), Jet2::new(state.t, one, zero), workspace);
}

/// Evaluates an element at rest with accelerations that grow at the rate of the free `velocities`: the rates of its rows are its part of
/// M v.
fn momentum_jets<T: StateScalar>(
    system: &System,
    instance: &ElementInstance<T>,
    (state, velocities): (&State<T>, &[T]),
    workspace: &mut ElementWorkspace<Jet2<T>>,
) where
    Jet2<T>: ElementScalar,
{
    let zero = T::from(0.0);
    let constant = |&x: &T| Jet2::new(x, zero, zero);
    let refill = |to: &mut Vec<Jet2<T>>, from: &[T]| {
        to.clear();
        to.extend(from.iter().map(constant));
    };
    refill(&mut workspace.p, &instance.parameters);
    workspace.q.clear();
    workspace.q.extend(instance.coordinates.iter().map(|&i| constant(&state.q[i])));
    workspace.v.clear();
    workspace.v.resize(instance.coordinates.len(), constant(&zero));
    let rate = |i: usize| if system.equation_of(i).is_some() { velocities[i] } else { zero };
    workspace.a.clear();
    workspace.a.extend(instance.coordinates.iter().map(|&i| Jet2::new(zero, rate(i), zero)));
    workspace.l.clear();
    workspace.sides = state.modes.sides_of(instance);
    Jet2::<T>::residual(instance.element.as_ref(), constant(&state.t), workspace);
}

/// Adds the residual of an element to the rows of its equations.
fn scatter<T: StateScalar>(
    instance: &ElementInstance<T>,
    map: &DofMap,
    workspace: &ElementWorkspace<T>,
    constraint: f64,
    rows: &mut [T],
) {
    let n = instance.coordinates.len();
    for (&r, &equation) in map.active.iter().zip(&map.equations) {
        rows[equation] += if r < n { workspace.dynamics[r] } else { workspace.constraint[r - n] * constraint };
    }
}

/// Φ_q with respect to the `wanted` coordinates, which may be prescribed ones, and zero for the others; one row per multiplier.
pub(crate) fn constraint_gradients(
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    wanted: impl Fn(usize) -> bool,
) -> Vec<Vec<f64>> {
    let mut gradients = vec![vec![0.0; mechanism.coordinates.len()]; mechanism.multipliers];
    for instance in &mechanism.elements {
        let active: Vec<usize> = (0..instance.coordinates.len()).filter(|&r| wanted(instance.coordinates[r])).collect();
        let add = &mut |m: usize, i: usize, value: f64| gradients[m][i] += value;
        visit_gradients(instance, &active, state, &mut ConstraintWorkspace::default(), add);
    }
    gradients
}

/// Calls `visit(multiplier, coordinate, value)` for the terms of Φ_q of an element in the `active` ones of its coordinates, if it has constraints
/// and is active.
fn visit_gradients(
    instance: &ElementInstance<f64>,
    active: &[usize],
    state: &State<f64>,
    ConstraintWorkspace { jacobian, elements, columns }: &mut ConstraintWorkspace,
    visit: &mut impl FnMut(usize, usize, f64),
) {
    if instance.num_constraints == 0 || !state.modes.is_active(instance) {
        return;
    }
    gather(instance, state, elements);
    let (width, n) = (active.len() + 1, instance.coordinates.len());
    columns.resize((n + instance.num_constraints) * width, 0.0);
    let local = ElementState { p: &instance.parameters, ..elements.local(state.t) };
    instance.element.columns(&local, Linearization::statics().constraint_weights, active, jacobian, columns);
    for k in 0..instance.num_constraints {
        let row = &columns[(n + k) * width + 1..(n + k + 1) * width];
        for (&local, &value) in active.iter().zip(row).filter(|(local, _)| **local < n) {
            visit(instance.first_multiplier + k, instance.coordinates[local], value);
        }
    }
}

/// Adds the equations λ = 0 of an element that is not active, times the `scale` of the constraints.
fn add_inactive(
    instance: &ElementInstance<f64>,
    map: &DofMap,
    (state, scale): (&State<f64>, f64),
    factor: &mut Factor,
    rows: &mut [[f64; 1]],
) {
    let n = instance.coordinates.len();
    for (&r, &equation) in map.active.iter().zip(&map.equations).filter(|(r, _)| **r >= n) {
        rows[equation][0] += state.l[instance.first_multiplier + r - n] * scale;
        let slot = factor.slot(equation, equation);
        factor.entries_mut()[slot] += scale;
    }
}

impl System {
    /// Assembles the residual into `rows` and the matrix, to be factorized by [`System::factorize`].
    pub fn assemble(
        &mut self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        linearization: Linearization,
        rows: &mut [[f64; 1]],
    ) {
        rows.fill([0.0]);
        self.begin_matrix(linearization);
        if linearization == Linearization::velocity_projection() {
            self.hold_followers(&state.modes);
        }
        for (instance, map) in mechanism.elements.iter().zip(&self.maps) {
            let constraint = instance.num_constraints > 0;
            let is_load = instance.num_reactions > 0 && !linearization.reaction_loads;
            if map.active.is_empty() || is_load || (linearization.projection && !constraint) {
                continue;
            }
            if !state.modes.is_active(instance) {
                add_inactive(instance, map, (state, linearization.constraint_scale), &mut self.factor, rows);
                continue;
            }
            gather(instance, state, &mut self.workspace);
            let (width, n) = (map.varying.len() + 1, instance.coordinates.len());
            let size = (n + instance.num_constraints) * width;
            if self.columns.len() < size {
                self.columns.resize(size, 0.0);
            }
            let columns = &mut self.columns[..size];
            let tangent_weights =
                if constraint { linearization.constraint_weights } else { linearization.dynamics_weights };
            let local = ElementState { p: &instance.parameters, ..self.workspace.local(state.t) };
            instance.element.columns(&local, tangent_weights, &map.varying, &mut self.jacobian_workspace, columns);
            for (&r, &equation) in map.active.iter().zip(&map.equations) {
                rows[equation][0] += columns[r * width] * if r < n { 1.0 } else { linearization.constraint_scale };
            }
            let entries = self.factor.entries_mut();
            if !constraint || linearization.geometric_stiffness {
                for &(from, slot) in &map.dynamics {
                    entries[slot] += columns[from];
                }
            }
            for &(from, [slot, mirrored]) in &map.constraint {
                entries[slot] += columns[from] * linearization.constraint_scale;
                entries[mirrored] += columns[from] / tangent_weights.position;
            }
        }
    }

    /// Gives followers that a switch holds their weight in the projection of velocities.
    fn hold_followers(&mut self, modes: &Modes) {
        let entries = self.factor.entries_mut();
        for &(slot, switch) in &self.held_diagonal {
            entries[slot] = if modes.is_on(switch) { HELD } else { 0.0 };
        }
    }

    /// Sets the matrix to its constant entries.
    fn begin_matrix(&mut self, linearization: Linearization) {
        let entries = self.factor.entries_mut();
        entries.fill(0.0);
        if linearization.projection {
            self.free_diagonal.iter().for_each(|&slot| entries[slot] = 1.0);
        } else {
            let tangent_weights = linearization.dynamics_weights;
            for &(slot, [stiffness, damping, mass]) in &self.constants.dynamics {
                entries[slot] += stiffness * tangent_weights.position
                    + damping * tangent_weights.velocity
                    + mass * tangent_weights.acceleration;
            }
        }
        for &([slot, mirrored], gradient) in &self.constants.constraint {
            entries[slot] += gradient * linearization.constraint_scale * linearization.constraint_weights.position;
            entries[mirrored] += gradient;
        }
    }

    /// Φ_q with respect to all coordinates, zero for prescribed ones; one row per multiplier.
    pub fn constraint_jacobian(&self, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<Vec<f64>> {
        let mut gradients = vec![vec![0.0; mechanism.coordinates.len()]; mechanism.multipliers];
        self.visit_constraint_jacobian(mechanism, state, &mut ConstraintWorkspace::default(), |m, i, value| {
            gradients[m][i] += value;
        });
        gradients
    }

    /// Calls `visit(multiplier, coordinate, value)` for the terms of Φ_q; terms of one entry are added up.
    pub(crate) fn visit_constraint_jacobian(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        workspace: &mut ConstraintWorkspace,
        mut visit: impl FnMut(usize, usize, f64),
    ) {
        for (instance, map) in mechanism.elements.iter().zip(&self.maps) {
            visit_gradients(instance, &map.active, state, workspace, &mut visit);
        }
    }

    /// The assembled matrix as a dense one, before it is factorized.
    pub fn dense(&mut self) -> DMatrix<f64> {
        let n = self.size();
        let mut dense = DMatrix::zeros(n, n);
        for (i, row) in self.pattern.iter().enumerate() {
            for &j in row {
                let slot = self.factor.slot(i, j);
                dense[(i, j)] = self.factor.entries_mut()[slot];
            }
        }
        dense
    }

    /// The matrix as a dense one, from derivatives with respect to every unknown of every element.
    ///
    /// Ignores the sparsity that elements declare. Slow; for checks.
    pub fn dense_by_seeding(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        linearization: Linearization,
    ) -> DMatrix<f64> {
        let (mut jacobian_workspace, mut workspace, mut columns) =
            (JacobianWorkspace::default(), ElementWorkspace::default(), Vec::new());
        let mut dense = DMatrix::zeros(self.size(), self.size());
        for (instance, map) in mechanism.elements.iter().zip(&self.maps) {
            if !state.modes.is_active(instance) {
                let n = instance.coordinates.len();
                let multipliers = map.active.iter().zip(&map.equations).filter(|(r, _)| **r >= n);
                multipliers.for_each(|(_, &i)| dense[(i, i)] += linearization.constraint_scale);
                continue;
            }
            gather(instance, state, &mut workspace);
            let (variables, equations): (Vec<usize>, Vec<usize>) = map.unknowns().unzip();
            let (width, n) = (variables.len() + 1, instance.coordinates.len());
            columns.resize((n + instance.num_constraints) * width, 0.0);
            let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
            let tangent_weights = if instance.num_constraints > 0 {
                linearization.constraint_weights
            } else {
                linearization.dynamics_weights
            };
            instance.element.columns(&local, tangent_weights, &variables, &mut jacobian_workspace, &mut columns);
            let is_geometric = |r: usize, c: usize| instance.num_constraints > 0 && r < n && c < n;
            for (&r, &i) in map.active.iter().zip(&map.equations) {
                let entries = variables.iter().zip(&equations).zip(&columns[r * width + 1..]);
                let entries = entries.filter(|((c, _), _)| linearization.geometric_stiffness || !is_geometric(r, **c));
                for ((_, &j), value) in entries {
                    dense[(i, j)] += value * if r < n { 1.0 } else { linearization.constraint_scale };
                }
            }
        }
        dense
    }
}
