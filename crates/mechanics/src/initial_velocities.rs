//! Initial velocities that satisfy the constraints: given ones are kept, the others have the least kinetic energy.
//!
//! With the given velocities g of the held coordinates E, the free velocities v solve
//!
//! $$ M v + \Phi_q^T \nu - E\,p = 0, \qquad \dot\Phi = 0, \qquad E^T v = g $$
//!
//! They minimize ½ vᵀ M v, so that they do not depend on the units of length, mass and angle. If given velocities depend on
//! each other through the constraints, those with the largest mobility relative to their mass are held; the others follow. If the others
//! then differ from the given ones, these contradict the constraints. All velocities are then the nearest ones in the metric of the
//! kinetic energy, where those that are not given count as zero:
//!
//! $$ M (v - g) + \Phi_q^T \nu = 0, \qquad \dot\Phi = 0 $$

use crate::constraint_rank::ConstraintRank;
use crate::elements::element::ElementWorkspace;
use crate::elements::spatial::bodies::normalization::normalized_frame;
use crate::mechanism::rotation::{e_times, square};
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::mechanism::{EventElement, Mechanism, Unilateral};
use crate::system::linearization::Linearization;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use nalgebra::{DMatrix, DVector};

/// Multipliers ν of the velocities, and the coordinates that are held at their given velocities.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct VelocityProjection {
    /// Multipliers ν, one per constraint equation.
    pub multipliers: Vec<f64>,
    /// Coordinates whose given velocities are kept, increasing.
    pub held: Vec<usize>,
    /// True if given velocities contradict the constraints: the velocities are the nearest ones to those that are given.
    pub is_nearest: bool,
}

impl VelocityProjection {
    /// The velocities that are multiplied by M in the equations: `velocities` by coordinate, minus the given ones if the velocities
    /// are the nearest ones.
    pub(crate) fn deviations<T: StateScalar>(&self, mechanism: &Mechanism<T>, velocities: &[T]) -> Vec<T> {
        let mut deviations = velocities.to_vec();
        if self.is_nearest {
            let all = deviations.iter_mut().zip(&mechanism.coordinates);
            all.filter(|(_, coordinate)| coordinate.is_given).for_each(|(v, coordinate)| *v -= coordinate.velocity);
        }
        deviations
    }
}

/// Mobility of a coordinate times its mass (from 0 to 1), below which its velocity follows from the others.
const DETERMINED: f64 = 1e-9;

/// Weight of a coordinate without mass, relative to the power of two below the smallest mass: among velocities of the same kinetic
/// energy, the smallest ones are taken. It is constant next to a design, so that it has no derivatives.
const MASSLESS: f64 = 1.0 / (1u64 << 40) as f64;

/// Distance (m or rad) between the positions of the model and those in which masses are detected. In the positions of
/// the model, a coordinate with mass can have a zero on the diagonal of M, such as an Euler parameter of an axis that
/// is parallel to a world axis.
const NEARBY: f64 = 0.1;

/// Fraction of the largest velocity (m/s or rad/s) below which two velocities count as equal, and fraction of a velocity by which it may
/// differ from the given one without a warning.
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
        let weights = massless_weights(system, mechanism, &rest);
        system.assemble(mechanism, &rest, Linearization::velocities(), &mut vec![[0.0]; system.size()]);
        let masses: Vec<f64> = (0..at.q.len()).map(|i| system.diagonal(mechanism, i).map_or(0.0, |d| *d)).collect();
        let mut massless = Vec::new();
        for (i, weight) in weights {
            if let Some(diagonal) = system.diagonal(mechanism, i) {
                *diagonal += weight;
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

    /// Writes the change of the velocities by the impulses that stop the held coordinates, whose `rates` are given: `rows` by equation.
    pub fn stopping_change<const L: usize>(&self, rates: &[[f64; L]], rows: &mut [[f64; L]]) {
        let mut impulses = vec![[0.0; L]; rates.len()];
        self.impulses(rates, &mut impulses);
        rows.fill([0.0; L]);
        self.add_columns(rows, &impulses, -1.0);
    }

    /// The transpose of [`Self::stopping_change`]: from derivatives with respect to velocities, by equation, to those with respect to the rates of
    /// the held coordinates.
    pub fn stop_transposed<const L: usize>(&self, velocities: &[[f64; L]]) -> Vec<[f64; L]> {
        let along = |column: &Vec<f64>| {
            std::array::from_fn(|k| column.iter().zip(velocities).map(|(x, v)| -x * v[k]).sum::<f64>())
        };
        let along: Vec<_> = self.columns.iter().map(along).collect();
        let mut rates = vec![[0.0; L]; along.len()];
        self.impulses(&along, &mut rates);
        rates
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

    /// Adds M v of the free `velocities` at the positions of `state` to the `rows`.
    pub fn add_momenta<T: StateScalar>(
        &self,
        system: &System,
        mechanism: &Mechanism<T>,
        (state, velocities): (&State<T>, &[T]),
        jets: &mut ElementWorkspace<Jet2<T>>,
        rows: &mut [T],
    ) where
        Jet2<T>: ElementScalar,
    {
        system.add_momenta(mechanism, (state, velocities), jets, rows);
        for &(i, weight) in &self.massless {
            if let Some(equation) = system.equation_of(i) {
                rows[equation] += velocities[i] * weight;
            }
        }
    }

    /// Sets the free velocities of `state` and the multipliers of the `projection`, which says which given velocities are held.
    fn solve_for(
        &self,
        system: &mut System,
        mechanism: &Mechanism<f64>,
        state: &mut State<f64>,
        projection: &mut VelocityProjection,
    ) {
        for unknown in system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                state.v[i] = 0.0;
            }
        }
        let mut rows = vec![0.0; system.size()];
        let mut jets = ElementWorkspace::default();
        system.constraint_rates(mechanism, state, 1, &mut jets, &mut rows);
        let deviations = projection.deviations(mechanism, &state.v);
        self.add_momenta(system, mechanism, (state, &deviations), &mut jets, &mut rows);
        let mut changes: Vec<[f64; 1]> = rows.iter().map(|row| [-row]).collect();
        let mut own: Vec<[f64; 1]> = projection.held.iter().map(|&i| [mechanism.coordinates[i].velocity]).collect();
        self.solve(system, &mut changes, &mut own);
        projection.multipliers = vec![0.0; mechanism.multipliers];
        for (unknown, row) in system.unknowns().iter().zip(&changes) {
            match *unknown {
                Unknown::Coordinate(i) => state.v[i] = row[0],
                Unknown::Multiplier(m) => projection.multipliers[m] = row[0],
            }
        }
        projection.held.iter().for_each(|&i| state.v[i] = mechanism.coordinates[i].velocity);
    }

    /// The `given` coordinates whose velocities are independent at the positions `at`: the pivots of a Cholesky
    /// decomposition of Eᵀ A⁻¹ E, scaled by the masses.
    fn independent(
        &self,
        system: &mut System,
        mechanism: &Mechanism<f64>,
        at: &State<f64>,
        given: &[usize],
    ) -> Vec<usize> {
        let candidates = self.scaled_equations(system, mechanism, at, given);
        let count = candidates.len();
        let mut shares = DMatrix::zeros(count, count);
        for (j, &(_, equation, scale)) in candidates.iter().enumerate() {
            let column = mobility(system, equation);
            for (i, &(_, row, other)) in candidates.iter().enumerate() {
                shares[(i, j)] = column[row] * scale * other;
            }
        }
        let mut held: Vec<usize> = pivots(shares).into_iter().map(|k| candidates[k].0).collect();
        held.sort_unstable();
        held
    }

    /// The unknowns among the `given` coordinates, with their equations and scales: scaled velocities have mobilities
    /// of about one.
    fn scaled_equations(
        &self,
        system: &mut System,
        mechanism: &Mechanism<f64>,
        at: &State<f64>,
        given: &[usize],
    ) -> Vec<(usize, usize, f64)> {
        let is_massless = |i: usize| self.massless.iter().any(|(k, _)| *k == i);
        let rank = given.iter().any(|&i| is_massless(i)).then(|| ConstraintRank::of(system, mechanism, at));
        let mut scaled = Vec::new();
        for &i in given {
            let Some(equation) = system.equation_of(i) else { continue };
            let scale = match &rank {
                // It may move masses of other coordinates: it is scaled by its mobility, if it can move at all.
                Some(rank) if is_massless(i) => {
                    let mut direction = vec![0.0; at.q.len()];
                    direction[i] = 1.0;
                    let own = mobility(system, equation)[equation];
                    if rank.depends(direction) || !(own > 0.0) { 0.0 } else { own.sqrt().recip() }
                }
                _ => self.masses[i].abs().sqrt(),
            };
            scaled.push((i, equation, scale));
        }
        scaled
    }
}

/// Pivots of the Cholesky decomposition of a positive semidefinite matrix with pivoting: rows that are linearly independent.
fn pivots(mut matrix: DMatrix<f64>) -> Vec<usize> {
    let mut pivots = Vec::new();
    loop {
        // Of equal entries the first one is chosen, so that rounding does not decide.
        let of = |k: usize| matrix[(k, k)];
        let largest = (0..matrix.nrows()).reduce(|a, b| if of(b) > of(a) * (1.0 + 1e-6) { b } else { a });
        let Some(pivot) = largest.filter(|&k| of(k) > DETERMINED) else { return pivots };
        let share = matrix[(pivot, pivot)];
        pivots.push(pivot);
        let column: DVector<f64> = matrix.column(pivot).into_owned();
        matrix.ger(-1.0 / share, &column, &column, 1.0);
        matrix.row_mut(pivot).fill(0.0);
        matrix.column_mut(pivot).fill(0.0);
    }
}

/// Sliding coordinates of dry friction that sticks at the start of a motion.
///
/// It sticks in neighbouring designs, too: friction stops the sliding velocities of these designs, within a time that decreases with the
/// velocities. The derivatives of the velocities are therefore those after an impulse of the friction.
pub(crate) fn sticking_coordinates(mechanism: &Mechanism<f64>, modes: &Modes) -> Vec<usize> {
    let sliding = |event: &EventElement<f64>| match event.unilateral {
        Some(Unilateral::Friction { joint, sticking, .. }) if modes.is_on(sticking) => {
            Some(mechanism.elements[joint].coordinates[2])
        }
        _ => None,
    };
    mechanism.events.iter().filter_map(sliding).collect()
}

/// Coordinates without mass at positions near `rest`, with their weights.
fn massless_weights(system: &mut System, mechanism: &Mechanism<f64>, rest: &State<f64>) -> Vec<(usize, f64)> {
    let mut moved = rest.clone();
    // An arbitrary direction whose components have no simple ratios.
    moved.q.iter_mut().enumerate().for_each(|(i, q)| *q += NEARBY * (1.0 + 2.3 * i as f64).sin());
    system.assemble(mechanism, &moved, Linearization::velocities(), &mut vec![[0.0]; system.size()]);
    let masses: Vec<(usize, f64)> =
        (0..rest.q.len()).filter_map(|i| Some((i, *system.diagonal(mechanism, i)?))).collect();
    let smallest = masses.iter().map(|(_, m)| *m).filter(|m| *m > 0.0 && m.is_finite()).fold(f64::INFINITY, f64::min);
    let weight = if smallest.is_finite() { MASSLESS * smallest.log2().floor().exp2() } else { 1.0 };
    masses.into_iter().filter(|(_, mass)| *mass == 0.0).map(|(i, _)| (i, weight)).collect()
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

/// Sets the free velocities of `state`, whose given ones are in it, see the [module](self).
pub(crate) fn solve_velocities(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<VelocityProjection> {
    let mut matrix = VelocityMatrix::new(system, mechanism, state, &[])?;
    let given: Vec<usize> = (0..state.v.len()).filter(|&i| mechanism.coordinates[i].is_given).collect();
    let held = matrix.independent(system, mechanism, state, &given);
    matrix.hold(system, &held)?;
    let mut projection = VelocityProjection { held, ..VelocityProjection::default() };
    matrix.solve_for(system, mechanism, state, &mut projection);
    if !changed_velocities(mechanism, state).is_empty() {
        matrix.hold(system, &[])?;
        projection = VelocityProjection { is_nearest: true, ..VelocityProjection::default() };
        matrix.solve_for(system, mechanism, state, &mut projection);
    }
    Ok(projection)
}

/// Coordinates whose velocities in `state` differ from the given ones.
fn changed_velocities(mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<usize> {
    let given = || {
        let all = mechanism.coordinates.iter().zip(&state.v).enumerate();
        all.filter(|(_, (c, _))| c.is_given && c.motion.is_none()).map(|(i, (c, v))| (i, c.velocity, *v))
    };
    let largest = given().map(|(_, given, v)| given.abs().max(v.abs())).fold(0.0, f64::max);
    let [absolute, relative] = EQUAL;
    let differs =
        |given: f64, v: f64| (given - v).abs() > (relative * given.abs().max(v.abs())).max(absolute * largest);
    given().filter(|(_, given, v)| differs(*given, *v)).map(|(i, ..)| i).collect()
}

/// Warning about given velocities that the joints do not allow in the consistent initial `state`.
///
/// For bodies in space it names the angular velocities, not the rates of the Euler parameters.
pub(crate) fn velocities_that_do_not_fit(mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<String> {
    let mut changed = changed_velocities(mechanism, state);
    let mut named = Vec::new();
    for instance in &mechanism.elements {
        let Some(body) = normalized_frame(instance) else { continue };
        let own = &instance.coordinates[3..];
        if changed.iter().any(|i| own.contains(i)) {
            changed.retain(|i| !own.contains(i));
            let of = |number: &dyn Fn(usize) -> f64| std::array::from_fn(|k| number(own[k]));
            let given = angular_velocity(
                of(&|i| mechanism.coordinates[i].position),
                of(&|i| mechanism.coordinates[i].velocity),
            );
            let found = angular_velocity(of(&|i| state.q[i]), of(&|i| state.v[i]));
            let in_words = |omega: [f64; 3]| omega.map(|x| format!("{:.6}", x + 0.0)).join(", ");
            named.push(format!(
                "the angular velocity of {body} is given ({}) and becomes ({})",
                in_words(given),
                in_words(found)
            ));
        }
    }
    let name = |i: usize| {
        let (coordinate, v) = (&mechanism.coordinates[i], state.v[i]);
        format!("{} is given {:.6} and becomes {v:.6}", coordinate.name, coordinate.velocity)
    };
    let names: Vec<String> = changed.into_iter().map(name).chain(named).collect();
    (!names.is_empty()).then(|| {
        format!(
            "the initial velocities do not fit the joints: {} (m/s or rad/s); leave out velocities that follow from others",
            names.join(", ")
        )
    })
}

/// Angular velocity in world axes in rad/s, from Euler parameters and their rates.
fn angular_velocity(e: [f64; 4], rates: [f64; 4]) -> [f64; 3] {
    e_times(&e, &rates).map(|x| 2.0 * x / square(&e))
}
