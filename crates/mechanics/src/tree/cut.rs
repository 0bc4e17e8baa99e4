//! Cut joints: constraints between bodies of a tree that the tree does not contain, which close loops.
//!
//! With the Jacobian G of these constraints with respect to the joint coordinates, the accelerations and the multipliers solve
//!
//! $$ \begin{bmatrix} A & G^T \\ G & 0 \end{bmatrix} \begin{bmatrix} \dot v \\ \lambda \end{bmatrix} =
//!    \begin{bmatrix} b \\ c \end{bmatrix} $$
//!
//! by the factorized mass matrix A of the tree and the Delassus matrix G A⁻¹ Gᵀ, which is dense and small. If some of the
//! constraints are redundant, the most independent ones in the current position are kept, and the multipliers of the others are zero.
//!
//! # Sources
//!
//! Featherstone, *Rigid Body Dynamics Algorithms* (2008), Chapter 8.

use crate::elements::element::{ElementState, ElementWorkspace, JacobianWorkspace};
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::Linearization;
use crate::system::assembly::constraint_jets;
use crate::system::state::{State, gather};
use crate::tree::articulated::{Articulated, ArticulatedWorkspace};
use crate::tree::placement::TreeGeometry;
use crate::tree::space::placed::Twist;
use crate::tree::topology::{CutRow, Tree};

/// Workspace for the Jacobian of cut joints.
#[derive(Clone, Default)]
pub(crate) struct CutWorkspace {
    rows: Vec<f64>,
    wrenches: Vec<Twist<f64>>,
    columns: Vec<f64>,
    jacobian: JacobianWorkspace,
    element: ElementWorkspace<f64>,
}

impl CutWorkspace {
    /// Writes the Jacobian G of the equations `cuts`, row by row, in the position of `state` with this `geometry`.
    pub fn jacobian(
        &mut self,
        tree: &Tree,
        mechanism: &Mechanism<f64>,
        (cuts, q): (&[CutRow], &[f64]),
        state: &State<f64>,
        geometry: &TreeGeometry<f64>,
        out: &mut Vec<f64>,
    ) {
        let Self { rows, wrenches, columns, jacobian, element } = self;
        let n = tree.count;
        out.clear();
        out.resize(cuts.len() * n, 0.0);
        rows.resize(state.q.len(), 0.0);
        wrenches.resize(tree.space.nodes.len(), [0.0; 6]);
        for (cut, out) in cuts.iter().zip(out.chunks_exact_mut(n.max(1))) {
            let instance = &mechanism.elements[cut.element];
            rows.fill(0.0);
            wrenches.fill([0.0; 6]);
            let row = gradient(instance, cut.row, state, (element, jacobian), columns);
            instance.coordinates.iter().zip(row).for_each(|(&i, x)| rows[i] += x);
            tree.space.add_rows(&geometry.placed, rows, wrenches);
            tree.collect(geometry, q, (rows, wrenches), out);
        }
    }
}

/// Derivatives of one equation of a joint with respect to the coordinates of its element.
fn gradient<'c>(
    instance: &ElementInstance<f64>,
    row: usize,
    state: &State<f64>,
    (element, jacobian): (&mut ElementWorkspace<f64>, &mut JacobianWorkspace),
    columns: &'c mut Vec<f64>,
) -> &'c [f64] {
    let (count, width) = (instance.coordinates.len(), instance.coordinates.len() + 1);
    gather(instance, state, element);
    element.l.fill(0.0);
    columns.clear();
    columns.resize((count + instance.num_constraints) * width, 0.0);
    let local = ElementState { p: &instance.parameters, ..element.local(state.t) };
    let all: Vec<usize> = (0..count).collect();
    instance.element.columns(&local, Linearization::statics().constraint_weights, &all, jacobian, columns);
    &columns[(count + row) * width + 1..(count + row + 1) * width]
}

/// Derivatives of the equations `cuts` with respect to the coordinates of their elements, in the position of `state`.
pub(crate) fn gradients(mechanism: &Mechanism<f64>, cuts: &[CutRow], state: &State<f64>) -> Vec<Vec<(usize, f64)>> {
    let (mut element, mut jacobian, mut columns) =
        (ElementWorkspace::default(), JacobianWorkspace::default(), Vec::new());
    let of = |cut: &CutRow| {
        let instance = &mechanism.elements[cut.element];
        let row = gradient(instance, cut.row, state, (&mut element, &mut jacobian), &mut columns);
        instance.coordinates.iter().copied().zip(row.iter().copied()).filter(|(_, x)| *x != 0.0).collect()
    };
    cuts.iter().map(of).collect()
}

/// Factors of the equations of motion with cut joints.
#[derive(Clone, Debug)]
pub(crate) struct TreeFactor {
    /// Factorized mass matrix.
    pub mass: Articulated,
    /// The equations that are kept.
    kept: KeptRows,
    /// G of these, row by row.
    jacobian: Vec<f64>,
    /// A⁻¹ Gᵀ, by equation.
    solved: Vec<f64>,
    delassus: SymmetricFactor,
}

impl TreeFactor {
    /// Storage for `tree`, with the masses of its single coordinates.
    pub fn new(tree: &Tree, singles: &[f64]) -> Self {
        Self {
            mass: Articulated::new(tree, singles),
            kept: KeptRows::default(),
            jacobian: Vec::new(),
            solved: Vec::new(),
            delassus: SymmetricFactor::default(),
        }
    }

    /// Factorizes the Delassus matrix of the `jacobian` G, which closes the loops; the mass matrix must be factorized before.
    ///
    /// # Errors
    ///
    /// The number of an equation that depends on others.
    pub fn close(&mut self, tree: &Tree, jacobian: &mut Vec<f64>) -> std::result::Result<(), usize> {
        std::mem::swap(&mut self.jacobian, jacobian);
        self.kept.choose(tree, &mut self.jacobian)?;
        let (n, m) = (tree.count, tree.independent_cuts);
        self.solved.clear();
        self.solved.resize(n * m, 0.0);
        let mut workspace = ArticulatedWorkspace::default();
        let mut block = vec![[0.0; 4]; n];
        for first in (0..m).step_by(4) {
            for (i, row) in block.iter_mut().enumerate() {
                *row = std::array::from_fn(|k| if first + k < m { self.jacobian[(first + k) * n + i] } else { 0.0 });
            }
            self.mass.solve(tree, &mut block, &mut workspace);
            for k in 0..4.min(m - first) {
                let column = &mut self.solved[(first + k) * n..(first + k + 1) * n];
                column.iter_mut().zip(&block).for_each(|(to, from)| *to = from[k]);
            }
        }
        let (g, y) = (&self.jacobian, &self.solved);
        let factorized = self.delassus.factorize(m, |i, k| (0..n).map(|j| g[i * n + j] * y[k * n + j]).sum());
        factorized.map_err(|row| self.kept.number(row))
    }

    /// Solves for accelerations and multipliers in place: the rows of `b` are those of the joint coordinates, then those of the cut
    /// joints.
    #[inline(always)]
    pub fn solve<const W: usize>(&self, tree: &Tree, b: &mut [[f64; W]], workspace: &mut ArticulatedWorkspace<W>) {
        let n = tree.count;
        let (accelerations, multipliers) = b.split_at_mut(n);
        self.mass.solve(tree, accelerations, workspace);
        if multipliers.is_empty() {
            return;
        }
        let all = multipliers;
        let multipliers = self.kept.compress(all);
        for (k, row) in multipliers.iter_mut().enumerate() {
            *row = row.map(|x| -x);
            for (g, a) in self.jacobian[k * n..(k + 1) * n].iter().zip(&*accelerations) {
                for lane in 0..W {
                    row[lane] += g * a[lane];
                }
            }
        }
        self.delassus.solve(multipliers);
        for (k, row) in multipliers.iter().enumerate() {
            for (y, a) in self.solved[k * n..(k + 1) * n].iter().zip(&mut *accelerations) {
                for lane in 0..W {
                    a[lane] -= y * row[lane];
                }
            }
        }
        self.kept.expand(all);
    }
}

/// Factors of the projection of joint coordinates onto the constraints of cut joints: \[I Gᵀ; G 0\].
#[derive(Clone, Debug, Default)]
pub(crate) struct ProjectionFactor {
    kept: KeptRows,
    jacobian: Vec<f64>,
    gram: SymmetricFactor,
}

impl ProjectionFactor {
    /// Factorizes for the `jacobian` G, row by row.
    ///
    /// # Errors
    ///
    /// The number of an equation that depends on others.
    pub fn factorize(&mut self, tree: &Tree, jacobian: &mut Vec<f64>) -> std::result::Result<(), usize> {
        std::mem::swap(&mut self.jacobian, jacobian);
        self.kept.choose(tree, &mut self.jacobian)?;
        let (n, m, g) = (tree.count, tree.independent_cuts, &self.jacobian);
        let factorized = self.gram.factorize(m, |i, k| (0..n).map(|j| g[i * n + j] * g[k * n + j]).sum());
        factorized.map_err(|row| self.kept.number(row))
    }

    /// Solves for corrections and multipliers in place.
    pub fn solve<const W: usize>(&self, tree: &Tree, b: &mut [[f64; W]]) {
        let n = tree.count;
        let (corrections, all) = b.split_at_mut(n);
        let multipliers = self.kept.compress(all);
        for (k, row) in multipliers.iter_mut().enumerate() {
            *row = row.map(|x| -x);
            for (g, a) in self.jacobian[k * n..(k + 1) * n].iter().zip(&*corrections) {
                for lane in 0..W {
                    row[lane] += g * a[lane];
                }
            }
        }
        self.gram.solve(multipliers);
        for (k, row) in multipliers.iter().enumerate() {
            for (g, a) in self.jacobian[k * n..(k + 1) * n].iter().zip(&mut *corrections) {
                for lane in 0..W {
                    a[lane] -= g * row[lane];
                }
            }
        }
        self.kept.expand(all);
    }
}

/// The most independent equations of cut joints in a position, if some follow from the others; otherwise all.
///
/// Equations that were independent at the start can depend on each other in other positions. Others are then chosen instead.
#[derive(Clone, Debug, Default)]
struct KeptRows {
    /// Their numbers in ascending order; `None` if all are kept.
    numbers: Option<Vec<usize>>,
}

impl KeptRows {
    /// Chooses among the rows of `jacobian`, and keeps these only. Returns the number of a dependent equation if too few are independent.
    fn choose(&mut self, tree: &Tree, jacobian: &mut Vec<f64>) -> std::result::Result<(), usize> {
        self.numbers = None;
        if tree.independent_cuts == tree.cuts.len() {
            return Ok(());
        }
        let numbers = independent_rows(jacobian, tree.count, tree.independent_cuts);
        if numbers.len() < tree.independent_cuts {
            return Err((0..tree.cuts.len()).find(|row| !numbers.contains(row)).unwrap_or(0));
        }
        for (to, &from) in numbers.iter().enumerate() {
            jacobian.copy_within(from * tree.count..(from + 1) * tree.count, to * tree.count);
        }
        jacobian.truncate(numbers.len() * tree.count);
        self.numbers = Some(numbers);
        Ok(())
    }

    /// The number of the equation with this place among the kept ones.
    fn number(&self, place: usize) -> usize {
        self.numbers.as_ref().map_or(place, |numbers| numbers[place])
    }

    /// Moves the values of the kept equations to the front, and returns them.
    fn compress<'v, const W: usize>(&self, values: &'v mut [[f64; W]]) -> &'v mut [[f64; W]] {
        let Some(numbers) = &self.numbers else { return values };
        numbers.iter().enumerate().for_each(|(to, &from)| values[to] = values[from]);
        &mut values[..numbers.len()]
    }

    /// Moves the values at the front to the places of their equations. The others become zero.
    fn expand<const W: usize>(&self, values: &mut [[f64; W]]) {
        let Some(numbers) = &self.numbers else { return };
        values[numbers.len()..].fill([0.0; W]);
        for (from, &to) in numbers.iter().enumerate().rev() {
            let value = std::mem::replace(&mut values[from], [0.0; W]);
            values[to] = value;
        }
    }
}

/// L D Lᵀ factors of a small symmetric positive definite matrix, row by row.
#[derive(Clone, Debug, Default)]
struct SymmetricFactor {
    entries: Vec<f64>,
    size: usize,
}

/// Fraction of a diagonal entry below which a pivot consists of rounding errors.
const DEPENDENT: f64 = 1e-12;

impl SymmetricFactor {
    fn factorize(&mut self, size: usize, entry: impl Fn(usize, usize) -> f64) -> std::result::Result<(), usize> {
        self.size = size;
        self.entries.clear();
        self.entries.resize(size * size, 0.0);
        for i in 0..size {
            for k in 0..=i {
                let known: f64 = (0..k).map(|j| self.at(i, j) * self.at(k, j) * self.at(j, j)).sum();
                let value = entry(i, k) - known;
                if i == k && !(value > DEPENDENT * entry(i, i) && value.is_finite()) {
                    return Err(i);
                }
                self.entries[i * size + k] = if i == k { value } else { value / self.at(k, k) };
            }
        }
        Ok(())
    }

    fn at(&self, i: usize, k: usize) -> f64 {
        self.entries[i * self.size + k]
    }

    fn solve<const W: usize>(&self, b: &mut [[f64; W]]) {
        for i in 0..self.size {
            for k in 0..i {
                let (factor, other) = (self.at(i, k), b[k]);
                (0..W).for_each(|lane| b[i][lane] -= factor * other[lane]);
            }
        }
        for i in 0..self.size {
            let inverse = 1.0 / self.at(i, i);
            b[i].iter_mut().for_each(|x| *x *= inverse);
        }
        for i in (0..self.size).rev() {
            for k in i + 1..self.size {
                let (factor, other) = (self.at(k, i), b[k]);
                (0..W).for_each(|lane| b[i][lane] -= factor * other[lane]);
            }
        }
    }
}

/// Writes Φ (`order` 0), Φ̇ (1) or Φ̈ (2) of the equations `cuts` along the motion of `state`.
pub(crate) fn rates<T: StateScalar>(
    mechanism: &Mechanism<T>,
    cuts: &[CutRow],
    state: &State<T>,
    order: usize,
    workspace: &mut ElementWorkspace<Jet2<T>>,
    out: &mut [T],
) where
    Jet2<T>: ElementScalar,
{
    let mut evaluated = None;
    for (cut, out) in cuts.iter().zip(out) {
        if evaluated.replace(cut.element) != Some(cut.element) {
            constraint_jets(&mechanism.elements[cut.element], state, workspace);
        }
        let constraint = &workspace.constraint[cut.row];
        *out = [constraint.re, constraint.v1, constraint.v2][order];
    }
}

/// Numbers of at most `most` independent rows of length `n`, by elimination with the largest row first.
pub(crate) fn independent_rows(rows: &[f64], n: usize, most: usize) -> Vec<usize> {
    let mut rest: Vec<(usize, Vec<f64>)> = rows.chunks_exact(n.max(1)).map(<[f64]>::to_vec).enumerate().collect();
    let square = |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>();
    let own: Vec<f64> = rest.iter().map(|(_, row)| square(row)).collect();
    // A row of rounding errors is compared with the other rows.
    let largest = own.iter().fold(0.0, |a: f64, b| a.max(*b));
    let sizes: Vec<f64> = own.iter().map(|size| size.max(DEPENDENT * largest)).collect();
    let mut kept = Vec::new();
    while let Some(best) = (0..rest.len()).max_by(|&i, &k| {
        let share = |j: usize| square(&rest[j].1) / sizes[rest[j].0].max(f64::MIN_POSITIVE);
        share(i).total_cmp(&share(k))
    }) {
        let (number, row) = rest.swap_remove(best);
        let size = square(&row);
        if !(size > DEPENDENT * sizes[number]) || size == 0.0 || kept.len() == most {
            break;
        }
        kept.push(number);
        for (_, other) in &mut rest {
            let factor = row.iter().zip(&*other).map(|(a, b)| a * b).sum::<f64>() / size;
            other.iter_mut().zip(&row).for_each(|(x, r)| *x -= factor * r);
        }
    }
    kept.sort_unstable();
    kept
}
