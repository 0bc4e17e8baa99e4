//! Derivatives of the equations with respect to their own variables, once per stage for all design variables.

use crate::derivatives::forward::explicit::constraint::{ConstraintDerivative, ConstraintTerms};
use crate::derivatives::forward::explicit::entries::Entries;
use crate::derivatives::seeding::Activity;
use crate::elements::element::{ElementWorkspace, Variable};
use crate::integrators::explicit::mechanism::Projected;
use crate::mechanism::scalars::{Dual4, Dual8, ElementScalar, Jet2};
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::System;
use crate::system::dof_map::ConstantEntry;
use crate::system::modes::Modes;
use crate::system::state::State;
use autodiff::{DualVec, WIDTH};
use std::collections::BTreeSet;

/// Kind of a local variable of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum VariableKind {
    Position,
    Velocity,
    Acceleration,
    Parameter,
}

/// A local variable of an element that can change with the design.
#[derive(Clone, Copy, Debug)]
struct DifferentiatedVariable {
    kind: VariableKind,
    /// Its number among those of its kind in the element.
    local: usize,
    /// Its number among the sources of [`Entries`].
    source: usize,
}

/// A row of an element.
#[derive(Clone, Copy, Debug)]
struct LinearizedRow {
    /// Its number in the element.
    local: usize,
    equation: usize,
    /// The first of the element's variables on which it can depend. If a constraint is linear in a coordinate, its force
    /// on this coordinate does not depend on positions.
    first: usize,
}

/// Rows of one element that are differentiated, and the variables.
struct LinearizedElement {
    variables: Vec<DifferentiatedVariable>,
    rows: Vec<LinearizedRow>,
    /// The `variables` as arguments of a constraint; empty for other elements.
    constraint_variables: Vec<Variable>,
}

/// The elements of a mechanism whose residuals are differentiated with respect to their own few variables.
///
/// An element's local derivatives are used for all design variables. With few nonzero entries per row they are cheaper than one
/// dual evaluation per chunk. Coordinates in which an element is linear are omitted: their derivatives are the same at
/// every stage.
pub(crate) struct Linearizer {
    elements: Vec<LinearizedElement>,
    /// Derivatives that are the same at every stage: of the accelerations' rows, of the position projection, and of the
    /// velocity constraints.
    constants: [Entries; 3],
    /// Element and local number of each active parameter.
    pub parameters: Vec<(usize, usize)>,
    /// Prescribed coordinates whose motion depends on the design.
    pub moving: Vec<usize>,
    coordinates: usize,
}

/// Workspace of one linearization.
#[derive(Clone, Default)]
pub(crate) struct ElementWorkspaces {
    narrow: ElementWorkspace<Dual4>,
    wide: ElementWorkspace<Dual8>,
    constraint: ConstraintTerms,
    momenta: ElementWorkspace<Jet2<Dual8>>,
}

impl Linearizer {
    /// Linearizer with respect to the state and the active parameters. Elements that are inactive at the start of the motion
    /// have no derivatives.
    pub fn new(mechanism: &Mechanism<f64>, activity: &Activity, system: &System, modes: &Modes) -> Self {
        Self::of_elements(mechanism, activity, (system, modes), |_| true)
    }

    /// [`Linearizer::new`] without the elements for which `includes` is false.
    pub fn of_elements(
        mechanism: &Mechanism<f64>,
        activity: &Activity,
        (system, modes): (&System, &Modes),
        includes: impl Fn(usize) -> bool,
    ) -> Self {
        let n = mechanism.coordinates.len();
        let moving: Vec<usize> = activity.moving_coordinates().collect();
        let mut parameters = Vec::new();
        let element = |k| match includes(k) {
            true => LinearizedElement::new(mechanism, k, activity, (system, modes), &mut parameters),
            false => LinearizedElement::none(),
        };
        let elements: Vec<_> = (0..mechanism.elements.len()).map(element).collect();
        let mut constants = [(); 3].map(|()| Entries::new(3 * n));
        for (k, (instance, element)) in mechanism.elements.iter().zip(&elements).enumerate() {
            if element.rows.is_empty() {
                continue;
            }
            let is_differentiated =
                |entry: &&ConstantEntry| activity.is_differentiated(mechanism, instance.coordinates[entry.coordinate]);
            for entry in system.coefficients(k).iter().filter(is_differentiated) {
                add_constants(instance, entry, &element.rows, n, &moving, &mut constants);
            }
        }
        Self { elements, constants, parameters, moving, coordinates: n }
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        3 * self.coordinates + self.parameters.len()
    }

    /// Storage for entries.
    pub fn entries(&self) -> Entries {
        Entries::new(3 * self.coordinates)
    }

    /// Coordinates on whose position or velocity the accelerations' rows can depend, increasing.
    pub fn state_coordinates(&self) -> Vec<usize> {
        let n = self.coordinates;
        let variables = self.elements.iter().flat_map(|element| element.variables.iter().map(|v| v.source));
        let sources = variables.chain(self.constants[0].states.iter().map(|entry| entry.source as usize));
        let coordinates: BTreeSet<usize> = sources.filter(|&source| source < 2 * n).map(|source| source % n).collect();
        coordinates.into_iter().collect()
    }

    /// Writes the derivatives of M q̈ + Φ_qᵀ λ − f and Φ̈ at fixed accelerations and multipliers.
    pub fn accelerations(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        workspaces: &mut ElementWorkspaces,
        out: &mut Entries,
    ) {
        out.copy_from(&self.constants[0]);
        let ElementWorkspaces { narrow, wide, constraint, .. } = workspaces;
        for (instance, element) in mechanism.elements.iter().zip(&self.elements) {
            if instance.num_constraints > 0 {
                self.constraint(instance, element, state, ConstraintDerivative::Accelerations, constraint, out);
            } else {
                match element.variables.len() {
                    0 => {}
                    1..=4 => element.dynamics(instance, &element.variables, state, narrow, out),
                    _ => element.variables.chunks(WIDTH).for_each(|c| element.dynamics(instance, c, state, wide, out)),
                }
            }
        }
    }

    /// Writes the derivatives of both projections: of the position step, the velocity constraints and the velocity step.
    pub fn projections(
        &self,
        mechanism: &Mechanism<f64>,
        projected: &Projected,
        corrections: &State<f64>,
        workspaces: &mut ElementWorkspaces,
        out: &mut [Entries; 3],
    ) {
        let cases = [
            (&projected.before, ConstraintDerivative::Positions),
            (&projected.after, ConstraintDerivative::Velocities),
            (corrections, ConstraintDerivative::Corrections),
        ];
        for (out, (state, derivative)) in out.iter_mut().zip(cases) {
            self.constraints(mechanism, state, derivative, workspaces, out);
        }
    }

    /// Writes the derivatives of all constraints.
    pub fn constraints(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        derivative: ConstraintDerivative,
        workspaces: &mut ElementWorkspaces,
        out: &mut Entries,
    ) {
        let [_, positions, velocities] = &self.constants;
        match derivative {
            ConstraintDerivative::Positions => out.copy_from(positions),
            ConstraintDerivative::Velocities | ConstraintDerivative::Rates => out.copy_from(velocities),
            ConstraintDerivative::Accelerations | ConstraintDerivative::Corrections => out.clear(),
        }
        for (instance, element) in
            mechanism.elements.iter().zip(&self.elements).filter(|(instance, _)| instance.num_constraints > 0)
        {
            self.constraint(instance, element, state, derivative, &mut workspaces.constraint, out);
        }
    }

    /// Adds the derivatives of M v with respect to positions and parameters, where v are the accelerations of `state`.
    pub fn momenta(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        workspaces: &mut ElementWorkspaces,
        out: &mut Entries,
    ) {
        let elements = mechanism.elements.iter().zip(&self.elements);
        let massive = elements.filter(|(instance, _)| instance.num_constraints == 0 && instance.num_reactions == 0);
        for (instance, element) in massive {
            let is_fixed =
                |v: &&DifferentiatedVariable| matches!(v.kind, VariableKind::Position | VariableKind::Parameter);
            let variables: Vec<_> = element.variables.iter().filter(is_fixed).copied().collect();
            variables.chunks(WIDTH).for_each(|c| element.momenta(instance, c, state, &mut workspaces.momenta, out));
        }
    }

    /// Adds the derivatives of the rows of the constraint `instance`.
    fn constraint(
        &self,
        instance: &ElementInstance<f64>,
        element: &LinearizedElement,
        state: &State<f64>,
        derivative: ConstraintDerivative,
        terms: &mut ConstraintTerms,
        out: &mut Entries,
    ) {
        if element.variables.is_empty() {
            return;
        }
        terms.evaluate(instance, &element.constraint_variables, state, derivative);
        let (n, variables) = (instance.coordinates.len(), &element.variables);
        for &LinearizedRow { local, equation, first } in &element.rows {
            if local >= n {
                for (k, variable) in variables.iter().enumerate() {
                    self.push_constraint(variable, terms.constraint(local - n, k), equation, derivative, out);
                }
            } else if derivative != ConstraintDerivative::Velocities {
                for (k, variable) in variables.iter().enumerate().skip(first) {
                    out.push(equation, variable.source, terms.dynamics(local, k));
                }
            }
        }
    }

    /// Adds the derivatives of a constraint row with respect to one variable, from those of Φ, Φ̇ and Φ̈. Those with
    /// respect to the velocity and the acceleration of a coordinate follow from those with respect to its position.
    fn push_constraint(
        &self,
        variable: &DifferentiatedVariable,
        terms: [f64; 3],
        row: usize,
        derivative: ConstraintDerivative,
        out: &mut Entries,
    ) {
        let (n, source) = (self.coordinates, variable.source);
        out.push(row, source, derivative.of(terms));
        match derivative {
            ConstraintDerivative::Accelerations if variable.kind == VariableKind::Position => {
                out.push(row, source + n, 2.0 * terms[1]);
                if !self.moving.is_empty() && self.moving.contains(&source) {
                    out.push(row, source + 2 * n, terms[0]);
                }
            }
            ConstraintDerivative::Velocities | ConstraintDerivative::Rates
                if variable.kind == VariableKind::Position =>
            {
                out.push(row, source + n, terms[0])
            }
            _ => {}
        }
    }
}

impl LinearizedElement {
    /// Without derivatives.
    fn none() -> Self {
        Self { variables: Vec::new(), rows: Vec::new(), constraint_variables: Vec::new() }
    }

    /// Linearization of element number `k`; adds its active parameters to `parameters`.
    fn new(
        mechanism: &Mechanism<f64>,
        k: usize,
        activity: &Activity,
        (system, modes): (&System, &Modes),
        parameters: &mut Vec<(usize, usize)>,
    ) -> Self {
        let (instance, n) = (&mechanism.elements[k], mechanism.coordinates.len());
        let (mut variables, is_constraint) = (Vec::new(), instance.num_constraints > 0);
        if system.rows_of(k).next().is_none() || !modes.is_active(instance) {
            return Self::none();
        }
        let mut add = |kind, local, source| variables.push(DifferentiatedVariable { kind, local, source });
        for (local, &i) in instance.coordinates.iter().enumerate() {
            if !activity.is_differentiated(mechanism, i) || instance.linear().contains(&local) {
                continue;
            }
            add(VariableKind::Position, local, i);
            if !is_constraint {
                add(VariableKind::Velocity, local, n + i);
                if activity.motions[i] {
                    add(VariableKind::Acceleration, local, 2 * n + i);
                }
            }
        }
        for &local in &activity.parameters[k] {
            add(VariableKind::Parameter, local, 3 * n + parameters.len());
            parameters.push((k, local));
        }
        let first_parameter = variables.iter().take_while(|v| v.kind != VariableKind::Parameter).count();
        let is_linear = |local| is_constraint && instance.linear().contains(&local);
        let row = |(local, equation)| LinearizedRow {
            local,
            equation,
            first: if is_linear(local) { first_parameter } else { 0 },
        };
        let variable = |v: &DifferentiatedVariable| match v.kind {
            VariableKind::Parameter => Variable::Parameter(v.local),
            _ => Variable::Coordinate(v.local),
        };
        let constraint_variables = if is_constraint { variables.iter().map(variable).collect() } else { Vec::new() };
        Self { rows: system.rows_of(k).map(row).collect(), variables, constraint_variables }
    }

    /// Adds the derivatives of the rows of an element without constraints, for one chunk of its variables.
    fn dynamics<const N: usize>(
        &self,
        instance: &ElementInstance<f64>,
        chunk: &[DifferentiatedVariable],
        state: &State<f64>,
        workspace: &mut ElementWorkspace<DualVec<N>>,
        out: &mut Entries,
    ) where
        DualVec<N>: ElementScalar,
    {
        workspace.p.clear();
        workspace.p.extend(instance.parameters.iter().map(|&p| DualVec::constant(p)));
        for (to, from) in [(&mut workspace.q, &state.q), (&mut workspace.v, &state.v), (&mut workspace.a, &state.a)] {
            to.clear();
            to.extend(instance.coordinates.iter().map(|&i| DualVec::constant(from[i])));
        }
        workspace.l.clear();
        workspace.l.extend(state.l[instance.multipliers()].iter().map(|&l| DualVec::constant(l)));
        workspace.sides = state.modes.sides_of(instance);
        for (k, variable) in chunk.iter().enumerate() {
            let values = match variable.kind {
                VariableKind::Position => &mut workspace.q,
                VariableKind::Velocity => &mut workspace.v,
                VariableKind::Acceleration => &mut workspace.a,
                VariableKind::Parameter => &mut workspace.p,
            };
            values[variable.local].eps[k] = 1.0;
        }
        DualVec::<N>::residual(instance.element.as_ref(), DualVec::constant(state.t), workspace);
        for row in &self.rows {
            let derivatives = workspace.dynamics[row.local].eps;
            chunk.iter().zip(derivatives).for_each(|(variable, x)| out.push(row.equation, variable.source, x));
        }
    }

    /// Adds the derivatives of the element's part of M v with respect to one chunk of its positions and parameters, where v are the
    /// accelerations of `state`.
    ///
    /// M v is the rate of the rows at rest if the accelerations grow at the rate v. Large forces at rest do not cause cancellation.
    fn momenta(
        &self,
        instance: &ElementInstance<f64>,
        chunk: &[DifferentiatedVariable],
        state: &State<f64>,
        workspace: &mut ElementWorkspace<Jet2<Dual8>>,
        out: &mut Entries,
    ) {
        let number = DualVec::constant;
        let constant = |x: f64| Jet2::new(number(x), number(0.0), number(0.0));
        workspace.p.clear();
        workspace.p.extend(instance.parameters.iter().map(|&p| constant(p)));
        workspace.q.clear();
        workspace.q.extend(instance.coordinates.iter().map(|&i| constant(state.q[i])));
        workspace.v.clear();
        workspace.v.resize(instance.coordinates.len(), constant(0.0));
        workspace.a.clear();
        let growing = |&i: &usize| Jet2::new(number(0.0), number(state.a[i]), number(0.0));
        workspace.a.extend(instance.coordinates.iter().map(growing));
        workspace.l.clear();
        workspace.sides = state.modes.sides_of(instance);
        for (k, variable) in chunk.iter().enumerate() {
            match variable.kind {
                VariableKind::Parameter => workspace.p[variable.local].re.eps[k] = 1.0,
                _ => workspace.q[variable.local].re.eps[k] = 1.0,
            }
        }
        Jet2::<Dual8>::residual(instance.element.as_ref(), constant(state.t), workspace);
        for row in &self.rows {
            let derivatives = workspace.dynamics[row.local].v1.eps;
            chunk.iter().zip(derivatives).for_each(|(variable, x)| out.push(row.equation, variable.source, x));
        }
    }
}

/// Adds the entries of a derivative that is the same in every state.
fn add_constants(
    instance: &ElementInstance<f64>,
    entry: &ConstantEntry,
    rows: &[LinearizedRow],
    n: usize,
    moving: &[usize],
    [accelerations, positions, velocities]: &mut [Entries; 3],
) {
    let Some(&LinearizedRow { equation: row, .. }) = rows.iter().find(|row| row.local == entry.row) else { return };
    let (i, [stiffness, damping, mass]) = (instance.coordinates[entry.coordinate], entry.values);
    let inertia = if instance.num_constraints > 0 { stiffness } else { mass };
    if moving.contains(&i) {
        accelerations.push(row, 2 * n + i, inertia);
    }
    if instance.num_constraints > 0 {
        positions.push(row, i, stiffness);
        velocities.push(row, n + i, stiffness);
    } else {
        accelerations.push(row, i, stiffness);
        accelerations.push(row, n + i, damping);
    }
}
