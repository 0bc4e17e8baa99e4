//! Rows and columns of each element in the equations, and its constant derivatives.

use crate::elements::element::{ElementState, ElementWorkspace, JacobianWorkspace, TangentWeights};
use crate::linalg::factor::Factor;
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::{State, gather};

/// A derivative that does not depend on the state: of a local row with respect to a local coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ConstantEntry {
    /// Local row.
    pub row: usize,
    /// Local coordinate.
    pub coordinate: usize,
    /// Derivatives with respect to position, velocity and acceleration.
    pub values: [f64; 3],
}

/// Rows and columns of one element in the system.
#[derive(Clone, Debug)]
pub(crate) struct DofMap {
    /// Local variables that are unknowns and have a row: coordinates first, then the element's own multipliers.
    pub active: Vec<usize>,
    /// Equation of each active variable.
    pub equations: Vec<usize>,
    /// Local numbers and equations of the multipliers of a joint on which the forces depend: columns without a row.
    pub reactions: Vec<(usize, usize)>,
    /// Unknown coordinates in which the element is not linear, and reactions that it reads: the columns to evaluate.
    pub varying: Vec<usize>,
    /// For each varying entry of a coordinate row: its position in the evaluated rows, and its slot of the matrix.
    pub dynamics: Vec<(usize, usize)>,
    /// For each varying entry of a constraint row: its position in the evaluated rows, and two slots of the matrix, as the
    /// transposed entry is in the column of the multiplier.
    pub constraint: Vec<(usize, [usize; 2])>,
}

/// Constant entries of the matrix, by slot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Constants {
    /// Derivatives of coordinate rows with respect to position, velocity and acceleration.
    pub dynamics: Vec<(usize, [f64; 3])>,
    /// Entries of Φ_q and of its transpose.
    pub constraint: Vec<([usize; 2], f64)>,
}

impl DofMap {
    /// Map of an element whose variables (coordinates, followed by multipliers) have the unknowns `unknown`, without slots.
    pub fn new(instance: &ElementInstance<f64>, unknown: &[Option<usize>]) -> Self {
        let linear = instance.linear();
        let rows = instance.coordinates.len() + instance.num_constraints;
        let active: Vec<usize> = (0..rows).filter(|&k| !instance.element.is_sensor() && unknown[k].is_some()).collect();
        let equations = active.iter().filter_map(|&k| unknown[k]).collect();
        let varies = |k: &usize| *k < instance.coordinates.len() && !linear.contains(k);
        let reactions: Vec<_> = (rows..unknown.len()).filter_map(|k| Some((k, unknown[k]?))).collect();
        let varying = active.iter().copied().filter(varies).chain(reactions.iter().map(|(k, _)| *k)).collect();
        Self { active, equations, reactions, varying, dynamics: Vec::new(), constraint: Vec::new() }
    }

    /// Renumbers the unknowns.
    pub fn renumber(&mut self, number: &[usize]) {
        let equations = self.equations.iter_mut().chain(self.reactions.iter_mut().map(|(_, equation)| equation));
        equations.for_each(|equation| *equation = number[*equation]);
    }

    /// Local numbers and equations of the variables that are unknowns.
    pub fn unknowns(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.active.iter().copied().zip(self.equations.iter().copied()).chain(self.reactions.iter().copied())
    }

    /// Equation of a local variable, if it is an unknown.
    pub fn equation(&self, local: usize) -> Option<usize> {
        self.unknowns().find(|(k, _)| *k == local).map(|(_, equation)| equation)
    }

    /// Local rows and columns of the varying entries, and their positions in the evaluated rows.
    ///
    /// Columns of multipliers are the transposed constraint rows. Coordinate rows of a constraint vary only if their coordinate
    /// does.
    fn entries(&self, instance: &ElementInstance<f64>) -> Vec<(usize, usize, usize)> {
        let (n, width) = (instance.coordinates.len(), self.varying.len() + 1);
        let row = |&r: &usize| instance.num_constraints == 0 || r >= n || self.varying.contains(&r);
        let columns = |r: usize| self.varying.iter().enumerate().map(move |(k, &c)| (r, c, r * width + 1 + k));
        self.active.iter().copied().filter(row).flat_map(columns).collect()
    }

    /// Pairs of equations that this element couples.
    pub fn couplings<'a>(
        &'a self,
        instance: &ElementInstance<f64>,
        constant: &'a [ConstantEntry],
    ) -> impl Iterator<Item = (usize, usize)> + 'a {
        let varying = self.entries(instance).into_iter().map(|(r, c, _)| (r, c));
        let constant = constant.iter().map(|k| (k.row, k.coordinate));
        varying.chain(constant).filter_map(|(r, c)| Some((self.equation(r)?, self.equation(c)?)))
    }

    /// Looks up the slots of all entries and adds the constant ones to `constants`.
    pub fn find_slots(
        &mut self,
        instance: &ElementInstance<f64>,
        constant: &[ConstantEntry],
        factor: &Factor,
        constants: &mut Constants,
    ) {
        let n = instance.coordinates.len();
        for (r, c, from) in self.entries(instance) {
            let (i, j) = (self.equation(r).expect("it is active"), self.equation(c).expect("it is active"));
            if r < n {
                self.dynamics.push((from, factor.slot(i, j)));
            } else {
                self.constraint.push((from, [factor.slot(i, j), factor.slot(j, i)]));
            }
        }
        for entry in constant {
            let Some((i, j)) = self.equation(entry.row).zip(self.equation(entry.coordinate)) else {
                continue;
            };
            if entry.row < n {
                constants.dynamics.push((factor.slot(i, j), entry.values));
            } else {
                constants.constraint.push(([factor.slot(i, j), factor.slot(j, i)], entry.values[0]));
            }
        }
    }
}

/// Nonzero derivatives of an element with respect to the coordinates in which it is linear.
pub(crate) fn constant_entries(
    instance: &ElementInstance<f64>,
    state: &State<f64>,
    workspace: &mut ElementWorkspace<f64>,
    jacobian_workspace: &mut JacobianWorkspace,
) -> Vec<ConstantEntry> {
    let (linear, n) = (instance.linear(), instance.coordinates.len());
    if linear.is_empty() || instance.element.is_sensor() {
        return Vec::new();
    }
    gather(instance, state, workspace);
    let local = ElementState { p: &instance.parameters, ..workspace.local(state.t) };
    let width = linear.len() + 1;
    let [stiffness, damping, mass] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|[p, v, a]| {
        let mut columns = vec![0.0; (n + instance.num_constraints) * width];
        let tangent_weights = TangentWeights { position: p, velocity: v, acceleration: a };
        instance.element.columns(&local, tangent_weights, linear, jacobian_workspace, &mut columns);
        columns
    });
    let rows = if instance.num_constraints > 0 { n..n + instance.num_constraints } else { 0..n };
    let all = rows.flat_map(|row| linear.iter().enumerate().map(move |(k, &c)| (row, c, row * width + 1 + k)));
    let entries =
        all.map(|(row, coordinate, k)| ConstantEntry { row, coordinate, values: [stiffness[k], damping[k], mass[k]] });
    entries.filter(|entry| entry.values != [0.0; 3]).collect()
}

/// The symmetric pattern of the `pairs` and the diagonal.
pub(crate) fn pattern(unknowns: usize, pairs: impl Iterator<Item = (usize, usize)>) -> Vec<Vec<usize>> {
    let mut rows: Vec<Vec<usize>> = (0..unknowns).map(|i| vec![i]).collect();
    for (i, j) in pairs {
        rows[i].push(j);
        rows[j].push(i);
    }
    for row in &mut rows {
        row.sort_unstable();
        row.dedup();
    }
    rows
}

/// Node of each variable of an element; nodes are all coordinates, followed by all multipliers.
pub(crate) fn nodes_of(mechanism: &Mechanism<f64>, instance: &ElementInstance<f64>) -> Vec<usize> {
    let n = mechanism.coordinates.len();
    debug_assert!(instance.coordinates.iter().all(|&c| c < n));
    instance.coordinates.iter().copied().chain(instance.multipliers().map(|m| n + m)).collect()
}
