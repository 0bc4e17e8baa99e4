//! Initial velocities that satisfy the constraints: given ones are kept, the others have the least kinetic energy.
//!
//! With the given velocities g of the held coordinates E, the free velocities v solve
//!
//! $$ M v + \Phi_q^T \nu - E\,p = 0, \qquad \dot\Phi = 0, \qquad E^T v = g $$
//!
//! They minimize ½ vᵀ M v, so that they do not depend on the units of length, mass and angle. Of given velocities that depend on
//! each other through the constraints, those are held whose share of the inertia moves most freely; the others follow.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Multipliers ν of the velocities, coordinates that are held at their given velocities, and their impulses p.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VelocityProjection {
    /// Multipliers ν, one per constraint equation.
    pub multipliers: Vec<f64>,
    /// Coordinates whose given velocities are kept, increasing.
    pub held: Vec<usize>,
}

/// Share of a coordinate's inertia that is free to move, below which its velocity follows from the others.
const DETERMINED: f64 = 1e-9;

/// Weight of a coordinate without mass, relative to the smallest mass: among velocities of the same kinetic energy, the smallest
/// ones are taken.
const MASSLESS: f64 = 1e-6;

/// Part of the largest velocity (m/s or rad/s) below which two velocities are equal, and part of a velocity by which it may differ
/// from the given one without a warning.
const EQUAL: [f64; 2] = [1e-9, 1e-3];

/// The matrix of the velocities, factorized in a [`System`], with the columns of the held coordinates.
pub(crate) struct VelocityMatrix {
    /// Held coordinates and their equations.
    held: Vec<(usize, usize)>,
    /// A⁻¹ E by held coordinate, A being the matrix of M and Φ_q.
    columns: Vec<Vec<f64>>,
    /// (Eᵀ A⁻¹ E)⁻¹.
    inverse: DMatrix<f64>,
    /// Weights of coordinates without mass.
    massless: Vec<(usize, f64)>,
    /// Diagonal of M by coordinate.
    masses: Vec<f64>,
}

impl VelocityMatrix {
    /// Factorizes the matrix at the positions of `at` for the `held` coordinates.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming the coordinate or joint without a pivot.
    pub fn new(system: &mut System, mechanism: &Mechanism<f64>, at: &State<f64>, held: &[usize]) -> Result<Self> {
        let mut rest = at.clone();
        [&mut rest.v, &mut rest.a, &mut rest.l].into_iter().for_each(|x| x.fill(0.0));
        system.assemble(mechanism, &rest, Linearization::velocities(), &mut vec![[0.0]; system.size()]);
        let masses: Vec<f64> = (0..at.q.len()).map(|i| system.diagonal(mechanism, i).map_or(0.0, |d| *d)).collect();
        let smallest = masses.iter().copied().filter(|m| *m > 0.0).fold(f64::INFINITY, f64::min);
        let weight = if smallest.is_finite() { MASSLESS * smallest } else { 1.0 };
        let mut massless = Vec::new();
        for i in 0..at.q.len() {
            if let Some(diagonal) = system.diagonal(mechanism, i).filter(|diagonal| **diagonal == 0.0) {
                *diagonal = weight;
                massless.push((i, weight));
            }
        }
        system.factorize(mechanism, at.t)?;
        let mut matrix =
            Self { held: Vec::new(), columns: Vec::new(), inverse: DMatrix::zeros(0, 0), massless, masses };
        matrix.hold(system, held)?;
        Ok(matrix)
    }

    /// Holds the coordinates `held`.
    fn hold(&mut self, system: &mut System, held: &[usize]) -> Result<()> {
        self.held = held.iter().filter_map(|&i| Some((i, system.equation_of(i)?))).collect();
        self.columns = self.held.iter().map(|&(_, equation)| mobility(system, equation)).collect();
        let count = self.held.len();
        let gram = DMatrix::from_fn(count, count, |i, j| self.columns[j][self.held[i].1]);
        self.inverse = gram.try_inverse().ok_or_else(|| {
            let why = "given initial velocities depend on each other through the joints";
            Error::analysis("the mechanism", why, "give fewer initial velocities; the others follow from the joints")
        })?;
        Ok(())
    }

    /// Solves for velocities, multipliers and impulses: `rows` by equation, `given` by held coordinate.
    pub fn solve<const L: usize>(&self, system: &mut System, rows: &mut [[f64; L]], given: &mut [[f64; L]]) {
        system.factor().solve(rows);
        let rest: Vec<_> = self.held.iter().zip(&*given).map(|(&(_, i), g)| less(g, &rows[i])).collect();
        self.impulses(&rest, given);
        self.add_columns(rows, given, 1.0);
    }

    /// Solves the transposed equations, whose right-hand sides are `rows` and zero for the held coordinates. Writes the unknowns
    /// of the latter to `held`.
    pub fn solve_transposed<const L: usize>(
        &self,
        system: &mut System,
        rows: &mut [[f64; L]],
        held: &mut Vec<[f64; L]>,
    ) {
        system.factor().solve_transposed(rows);
        let at_held: Vec<_> = self.held.iter().map(|&(_, i)| rows[i]).collect();
        held.clear();
        held.resize(at_held.len(), [0.0; L]);
        self.impulses(&at_held, held);
        self.add_columns(rows, held, -1.0);
    }

    fn impulses<const L: usize>(&self, velocities: &[[f64; L]], out: &mut [[f64; L]]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out =
                std::array::from_fn(|k| velocities.iter().enumerate().map(|(j, v)| self.inverse[(i, j)] * v[k]).sum());
        }
    }

    fn add_columns<const L: usize>(&self, rows: &mut [[f64; L]], impulses: &[[f64; L]], factor: f64) {
        for (column, p) in self.columns.iter().zip(impulses) {
            for (row, x) in rows.iter_mut().zip(column) {
                row.iter_mut().zip(p).for_each(|(row, p)| *row += factor * x * p);
            }
        }
    }

    /// Adds M v of the free velocities of `state` to the `rows`.
    pub fn add_momenta<T: StateScalar>(
        &self,
        system: &System,
        mechanism: &Mechanism<T>,
        state: &State<T>,
        jets: &mut ElementWorkspace<Jet2<T>>,
        rows: &mut [T],
    ) where
        Jet2<T>: ElementScalar,
    {
        system.add_momenta(mechanism, state, jets, rows);
        for &(i, weight) in &self.massless {
            if let Some(equation) = system.equation_of(i) {
                rows[equation] += state.v[i] * weight;
            }
        }
    }

    /// Of the `given` coordinates, those whose velocities are independent: a Cholesky decomposition of Eᵀ A⁻¹ E with pivots,
    /// scaled by the masses.
    fn independent(&self, system: &mut System, given: &[usize]) -> Vec<usize> {
        let mut candidates: Vec<(usize, usize, f64)> = Vec::new();
        for &i in given {
            if let Some(equation) = system.equation_of(i) {
                let own = self.massless.iter().find(|(k, _)| *k == i).map_or(self.masses[i], |(_, weight)| *weight);
                candidates.push((i, equation, own.abs().sqrt()));
            }
        }
        let count = candidates.len();
        let mut shares = DMatrix::zeros(count, count);
        for (j, &(_, equation, scale)) in candidates.iter().enumerate() {
            let column = mobility(system, equation);
            for (i, &(_, row, other)) in candidates.iter().enumerate() {
                shares[(i, j)] = column[row] * scale * other;
            }
        }
        let mut held = Vec::new();
        loop {
            // Of equal shares the first one is taken: rounding must not choose.
            let of = |k: usize| shares[(k, k)];
            let Some(pivot) = (0..count).reduce(|a, b| if of(b) > of(a) * (1.0 + 1e-6) { b } else { a }) else { break };
            let share = shares[(pivot, pivot)];
            if !(share > DETERMINED) {
                break;
            }
            held.push(candidates[pivot].0);
            let column: DVector<f64> = shares.column(pivot).into_owned();
            shares.ger(-1.0 / share, &column, &column, 1.0);
            shares.row_mut(pivot).fill(0.0);
            shares.column_mut(pivot).fill(0.0);
        }
        held.sort_unstable();
        held
    }
}

/// A⁻¹ e for the unit vector of an equation.
fn mobility(system: &mut System, equation: usize) -> Vec<f64> {
    let mut column = vec![[0.0]; system.size()];
    column[equation] = [1.0];
    system.factor().solve(&mut column);
    column.into_iter().map(|[x]| x).collect()
}

fn less<const L: usize>(a: &[f64; L], b: &[f64; L]) -> [f64; L] {
    std::array::from_fn(|k| a[k] - b[k])
}

/// Which velocities of a state are kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kept {
    /// Those that the model gives.
    Given,
    /// None: drives determine all.
    None,
}

/// Sets the free velocities of `state`, whose given ones are in it, see the [module](self).
pub(crate) fn solve_velocities(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    kept: Kept,
) -> Result<VelocityProjection> {
    let mut matrix = VelocityMatrix::new(system, mechanism, state, &[])?;
    let is_kept = |i: &usize| kept == Kept::Given && mechanism.coordinates[*i].is_given;
    let given: Vec<usize> = (0..state.v.len()).filter(is_kept).collect();
    let held = matrix.independent(system, &given);
    matrix.hold(system, &held)?;
    let velocities: Vec<f64> = held.iter().map(|&i| state.v[i]).collect();
    for unknown in system.unknowns() {
        if let Unknown::Coordinate(i) = *unknown {
            state.v[i] = 0.0;
        }
    }
    let mut rows = vec![[0.0]; system.size()];
    system.constraint_rates(mechanism, state, 1, &mut ElementWorkspace::default(), rows.as_flattened_mut());
    rows.iter_mut().for_each(|row| row[0] = -row[0]);
    let mut own: Vec<[f64; 1]> = velocities.iter().map(|&v| [v]).collect();
    matrix.solve(system, &mut rows, &mut own);
    let mut multipliers = vec![0.0; mechanism.multipliers];
    for (unknown, row) in system.unknowns().iter().zip(&rows) {
        match *unknown {
            Unknown::Coordinate(i) => state.v[i] = row[0],
            Unknown::Multiplier(m) => multipliers[m] = row[0],
        }
    }
    held.iter().zip(velocities).for_each(|(&i, v)| state.v[i] = v);
    Ok(VelocityProjection { multipliers, held })
}

/// Warnings about given velocities that the joints do not allow in the consistent initial `state`.
pub(crate) fn velocities_that_do_not_fit(mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<String> {
    let given = || mechanism.coordinates.iter().zip(&state.v).filter(|(c, _)| c.is_given && c.motion.is_none());
    let largest = given().map(|(c, v)| c.velocity.abs().max(v.abs())).fold(0.0, f64::max);
    let [absolute, relative] = EQUAL;
    let differs =
        |(given, v): (f64, f64)| (given - v).abs() > (relative * given.abs().max(v.abs())).max(absolute * largest);
    let changed = given().filter(|(c, v)| differs((c.velocity, **v)));
    let names: Vec<String> =
        changed.map(|(c, v)| format!("{} is given {:.6} and becomes {v:.6}", c.name, c.velocity)).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the initial velocities do not fit the joints: {} (m/s or rad/s); leave out velocities that follow from others",
            names.join(", ")
        )
    })
}
