//! Elements in dual numbers, once per stage for all design variables.

use crate::derivatives::activity::Dependence;
use crate::derivatives::forward::explicit::constraint::ConstraintTerms;
use crate::derivatives::forward::explicit::entries::Entries;
use crate::elements::element::{ElementWorkspace, Variable};
use crate::integrators::explicit::mechanism::Projected;
use crate::mechanism::ElementInstance;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Dual4, Dual8, ElementScalar};
use crate::system::System;
use crate::system::dof_map::ConstantEntry;
use crate::system::state::State;
use autodiff::{DualVec, WIDTH};
use std::collections::BTreeSet;

/// What a local variable of an element is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Position,
    Velocity,
    Acceleration,
    Parameter,
}

/// A local variable that can change with the design.
#[derive(Clone, Copy, Debug)]
struct DifferentiatedVariable {
    kind: Kind,
    local: usize,
    number: usize,
}

/// Which time derivative of Φ stands in the closure rows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ConstraintDerivative {
    /// Φ̈ with the accelerations of the state.
    Accelerations,
    /// Φ + Φ_q δ, where δ are the accelerations of the state.
    Positions,
    /// Φ̇, without the rows of forces.
    Velocities,
    /// Φ̇.
    Rates,
    /// Φ_q ε, where ε are the accelerations of the state.
    Corrections,
}

impl ConstraintDerivative {
    /// Whether positions move with the velocities of the state, and time goes on.
    pub fn follows_motion(self) -> bool {
        matches!(self, Self::Accelerations | Self::Velocities | Self::Rates)
    }

    /// Derivative of the closure row from those of Φ, Φ̇ and Φ̈.
    fn of(self, slopes: [f64; 3]) -> f64 {
        match self {
            Self::Accelerations => slopes[2],
            Self::Velocities | Self::Rates | Self::Corrections => slopes[1],
            Self::Positions => slopes[0] + slopes[1],
        }
    }
}

/// The elements of a mechanism whose residuals are differentiated with respect to their own few variables.
///
/// An element's local derivatives serve all design variables: with few nonzero entries per row they are cheaper than
/// one dual evaluation for each chunk. Coordinates that an element is linear in are left out; what they contribute is the
/// same at every stage.
pub(crate) struct Linearizer {
    /// Variables and rows of each element.
    elements: Vec<(Vec<DifferentiatedVariable>, Rows)>,
    /// The variables of each constraint once more, as it sees them.
    constraint_variables: Vec<Vec<Variable>>,
    /// Derivatives that are the same at every stage: of the accelerations' rows, of the position step's and of the
    /// velocities' closures.
    constants: [Entries; 3],
    /// Element and place of each parameter that changes with the design.
    pub parameters: Vec<(usize, usize)>,
    /// Prescribed coordinates whose motion changes with the design.
    pub moving: Vec<usize>,
    coordinates: usize,
}

/// The rows of an element.
type Rows = Vec<Row>;

/// A row of an element: its local number and its equation.
#[derive(Clone, Copy, Debug)]
struct Row {
    local: usize,
    equation: usize,
    /// The first of the element's variables that it can change with. A row of a constraint's forces does not change with
    /// positions if the constraint is linear in what it belongs to.
    first: usize,
}

/// Room for one linearization.
#[derive(Clone, Default)]
pub(crate) struct ElementWorkspaces {
    narrow: ElementWorkspace<Dual4>,
    wide: ElementWorkspace<Dual8>,
    constraint: ConstraintTerms,
}

impl Linearizer {
    /// For the derivatives by what `dependence` names.
    pub fn new(mechanism: &Mechanism<f64>, dependence: &Dependence, system: &System) -> Self {
        let n = mechanism.coordinates.len();
        let moving: Vec<usize> = dependence.moving().collect();
        let mut parameters = Vec::new();
        let elements = (0..mechanism.parts.len()).map(|k| {
            let part = &mechanism.parts[k];
            if system.rows_of(k).next().is_none() {
                return (Vec::new(), Vec::new());
            }
            let mut variables = Vec::new();
            for (local, &i) in part.coordinates.iter().enumerate() {
                let prescribed = mechanism.coordinates[i].motion.is_some();
                let moves = dependence.motions[i];
                if (prescribed && !moves) || part.element.linear().contains(&local) {
                    continue;
                }
                variables.push(DifferentiatedVariable { kind: Kind::Position, local, number: i });
                if part.num_constraints == 0 {
                    variables.push(DifferentiatedVariable { kind: Kind::Velocity, local, number: n + i });
                    if moves {
                        variables.push(DifferentiatedVariable { kind: Kind::Acceleration, local, number: 2 * n + i });
                    }
                }
            }
            for &local in &dependence.parameters[k] {
                variables.push(DifferentiatedVariable {
                    kind: Kind::Parameter,
                    local,
                    number: 3 * n + parameters.len(),
                });
                parameters.push((k, local));
            }
            let first_parameter = variables.iter().take_while(|source| source.kind != Kind::Parameter).count();
            let still = |local| part.num_constraints > 0 && part.element.linear().contains(&local);
            let row =
                |(local, equation)| Row { local, equation, first: if still(local) { first_parameter } else { 0 } };
            (variables, system.rows_of(k).map(row).collect())
        });
        let elements: Vec<(_, Rows)> = elements.collect();
        let mut constants = [(); 3].map(|()| Entries::new(3 * n));
        for (k, (part, (_, rows))) in mechanism.parts.iter().zip(&elements).enumerate() {
            let carries = |c: &&ConstantEntry| {
                let i = part.coordinates[c.coordinate];
                mechanism.coordinates[i].motion.is_none() || moving.contains(&i)
            };
            for coefficient in system.coefficients(k).iter().filter(carries) {
                add_constants(part, coefficient, rows, n, &moving, &mut constants);
            }
        }
        let as_seen = |source: &DifferentiatedVariable| match source.kind {
            Kind::Parameter => Variable::Parameter(source.local),
            _ => Variable::Coordinate(source.local),
        };
        let seen = |(part, (sources, _)): (&ElementInstance<f64>, &(Vec<DifferentiatedVariable>, Rows))| {
            if part.num_constraints > 0 { sources.iter().map(as_seen).collect() } else { Vec::new() }
        };
        let constraint_variables = mechanism.parts.iter().zip(&elements).map(seen).collect();
        Self { elements, constraint_variables, constants, parameters, moving, coordinates: n }
    }

    /// Number of sources.
    pub fn sources(&self) -> usize {
        3 * self.coordinates + self.parameters.len()
    }

    /// No entries yet.
    pub fn entries(&self) -> Entries {
        Entries::new(3 * self.coordinates)
    }

    /// Coordinates whose position or velocity the accelerations' rows can depend on, increasing.
    pub fn felt(&self) -> Vec<usize> {
        let n = self.coordinates;
        let variables = self.elements.iter().flat_map(|(variables, _)| variables.iter().map(|v| v.number));
        let states = variables.chain(self.constants[0].states.iter().map(|entry| entry.source as usize));
        let felt: BTreeSet<usize> = states.filter(|&source| source < 2 * n).map(|source| source % n).collect();
        felt.into_iter().collect()
    }

    /// Derivatives of M q̈ + Φ_qᵀ λ − f and Φ̈ at fixed accelerations and multipliers.
    pub fn accelerations(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        workspaces: &mut ElementWorkspaces,
        out: &mut Entries,
    ) {
        out.copy_from(&self.constants[0]);
        for (k, (part, (sources, rows))) in mechanism.parts.iter().zip(&self.elements).enumerate() {
            if part.num_constraints > 0 {
                self.constraint(part, k, state, ConstraintDerivative::Accelerations, &mut workspaces.constraint, out);
            } else {
                match sources.len() {
                    0 => {}
                    1..=4 => dynamics(part, sources, rows, state, &mut workspaces.narrow, out),
                    _ => sources
                        .chunks(WIDTH)
                        .for_each(|chunk| dynamics(part, chunk, rows, state, &mut workspaces.wide, out)),
                }
            }
        }
    }

    /// Derivatives of both projections: of the position step, of the velocities' closures, of the velocity step.
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
        for (out, (state, constraint)) in out.iter_mut().zip(cases) {
            out.clear();
            self.num_constraints(mechanism, state, constraint, workspaces, out);
        }
    }

    /// Derivatives of all constraints.
    pub fn num_constraints(
        &self,
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
        constraint: ConstraintDerivative,
        workspaces: &mut ElementWorkspaces,
        out: &mut Entries,
    ) {
        let [_, positions, velocities] = &self.constants;
        match constraint {
            ConstraintDerivative::Positions => out.copy_from(positions),
            ConstraintDerivative::Velocities | ConstraintDerivative::Rates => out.copy_from(velocities),
            ConstraintDerivative::Accelerations | ConstraintDerivative::Corrections => {}
        }
        for (k, part) in mechanism.parts.iter().enumerate().filter(|(_, part)| part.num_constraints > 0) {
            self.constraint(part, k, state, constraint, &mut workspaces.constraint, out);
        }
    }

    /// Derivatives of the rows of the constraint `part`, the `k`-th element.
    fn constraint(
        &self,
        part: &ElementInstance<f64>,
        k: usize,
        state: &State<f64>,
        constraint: ConstraintDerivative,
        slopes: &mut ConstraintTerms,
        out: &mut Entries,
    ) {
        let (sources, rows) = &self.elements[k];
        if sources.is_empty() {
            return;
        }
        slopes.evaluate(part, &self.constraint_variables[k], state, constraint);
        let n = part.coordinates.len();
        for &Row { local, equation, first } in rows {
            if local >= n {
                let sources = sources.iter().enumerate().map(|(k, source)| (source, slopes.constraint(local - n, k)));
                self.push_closure(sources, equation, constraint, out);
            } else if constraint != ConstraintDerivative::Velocities {
                for (k, source) in sources.iter().enumerate().skip(first) {
                    out.push(equation, source.number, slopes.dynamics(local, k));
                }
            }
        }
    }

    /// Derivatives of a closure row: those with respect to velocities and accelerations come from those to positions.
    fn push_closure<'s>(
        &self,
        sources: impl Iterator<Item = (&'s DifferentiatedVariable, [f64; 3])>,
        row: usize,
        constraint: ConstraintDerivative,
        out: &mut Entries,
    ) {
        let n = self.coordinates;
        for (source, slopes) in sources {
            out.push(row, source.number, constraint.of(slopes));
            match constraint {
                ConstraintDerivative::Accelerations if source.kind == Kind::Position => {
                    out.push(row, source.number + n, 2.0 * slopes[1]);
                    if !self.moving.is_empty() && self.moving.contains(&source.number) {
                        out.push(row, source.number + 2 * n, slopes[0]);
                    }
                }
                ConstraintDerivative::Velocities | ConstraintDerivative::Rates if source.kind == Kind::Position => {
                    out.push(row, source.number + n, slopes[0])
                }
                _ => {}
            }
        }
    }
}

/// Adds the entries of a derivative that never changes.
fn add_constants(
    part: &ElementInstance<f64>,
    coefficient: &ConstantEntry,
    rows: &[Row],
    n: usize,
    moving: &[usize],
    [accelerations, positions, velocities]: &mut [Entries; 3],
) {
    let Some(&Row { equation: row, .. }) = rows.iter().find(|row| row.local == coefficient.row) else { return };
    let (i, [stiffness, damping, mass]) = (part.coordinates[coefficient.coordinate], coefficient.values);
    let inertia = if part.num_constraints > 0 { stiffness } else { mass };
    if moving.contains(&i) {
        accelerations.push(row, 2 * n + i, inertia);
    }
    if part.num_constraints > 0 {
        positions.push(row, i, stiffness);
        velocities.push(row, n + i, stiffness);
    } else {
        accelerations.push(row, i, stiffness);
        accelerations.push(row, n + i, damping);
    }
}

/// Derivatives of the rows of an element without closures, for one chunk of its variables.
fn dynamics<const N: usize>(
    part: &ElementInstance<f64>,
    chunk: &[DifferentiatedVariable],
    rows: &[Row],
    state: &State<f64>,
    workspace: &mut ElementWorkspace<DualVec<N>>,
    out: &mut Entries,
) where
    DualVec<N>: ElementScalar,
{
    workspace.p.clear();
    workspace.p.extend(part.parameters.iter().map(|&p| DualVec::constant(p)));
    for (to, from) in [(&mut workspace.q, &state.q), (&mut workspace.v, &state.v), (&mut workspace.a, &state.a)] {
        to.clear();
        to.extend(part.coordinates.iter().map(|&i| DualVec::constant(from[i])));
    }
    for (k, source) in chunk.iter().enumerate() {
        let values = match source.kind {
            Kind::Position => &mut workspace.q,
            Kind::Velocity => &mut workspace.v,
            Kind::Acceleration => &mut workspace.a,
            Kind::Parameter => &mut workspace.p,
        };
        values[source.local].eps[k] = 1.0;
    }
    DualVec::<N>::residual(part.element.as_ref(), DualVec::constant(state.t), workspace);
    for row in rows {
        let slopes = workspace.dynamics[row.local].eps;
        chunk.iter().zip(slopes).for_each(|(source, slope)| out.push(row.equation, source.number, slope));
    }
}
