//! Where a motion starts: assembled positions, consistent velocities and accelerations.

use crate::diagnostics;
use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{Jet2, StateScalar};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown, name_of};
use crate::{Error, Result};

/// Settings of the assembly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assembly {
    /// Largest correction (m or rad) of the last iteration.
    pub tolerance: f64,
    /// Most iterations.
    pub iterations: usize,
}

impl Default for Assembly {
    fn default() -> Self {
        Self { tolerance: 1e-12, iterations: 50 }
    }
}

/// Multipliers of the two projections, needed for their derivatives.
#[derive(Clone, Debug, Default)]
pub struct Projection {
    /// Of the positions; where the motion starts in equilibrium, the reactions there.
    pub position: Vec<f64>,
    /// Of the velocities.
    pub velocity: Vec<f64>,
}

/// Moves the free coordinates of `state` to the nearest point on the constraints, keeping the branch.
///
/// Minimizes ½ |q − q_guess|² subject to Φ(q, t) = 0 by Newton's method on the optimality conditions; a step is
/// shortened when it would move anything by more than half a metre or radian.
///
/// **Errors.** [`Error::Analysis`] naming the joint that stays open.
pub fn assemble(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: Assembly,
) -> Result<Projection> {
    let mut rows = vec![[0.0]; system.size()];
    if mechanism.multipliers == 0 {
        return Ok(Projection::default());
    }
    let guess = state.q.clone();
    state.l.fill(0.0);
    for _ in 0..settings.iterations {
        system.assemble(mechanism, state, Linearization::projection(), &mut rows);
        for (row, unknown) in rows.iter_mut().zip(system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown {
                row[0] += state.q[i] - guess[i];
            }
        }
        system.factorize(mechanism, state.t).map_err(|error| explained(system, mechanism, state, error))?;
        system.factor().solve(&mut rows);
        if rows.iter().any(|row| !row[0].is_finite()) {
            break;
        }
        let largest = apply(system, &rows, state);
        // Newton's next correction would be of the size of this one's square.
        if largest <= settings.tolerance || largest * largest <= 0.01 * settings.tolerance {
            check_independence(system, mechanism, state, &mut rows)?;
            let position = std::mem::replace(&mut state.l, vec![0.0; mechanism.multipliers]);
            return Ok(Projection { position, velocity: Vec::new() });
        }
    }
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return Err(error);
    }
    system.assemble(mechanism, state, Linearization::projection(), &mut rows);
    for (row, unknown) in rows.iter_mut().zip(system.unknowns()) {
        row[0] = if matches!(unknown, Unknown::Multiplier(_)) { row[0] } else { 0.0 };
    }
    let what = system.dominant_residual(mechanism, &rows);
    let why = format!("the mechanism cannot be assembled at t = {:.6e} s", state.t);
    Err(Error::analysis(what, why, "check the lengths and the initial positions: the loop may be too short to close"))
}

/// Answers of the projection above this size mean that closures depend on each other: by rounding alone a redundant
/// closure leaves a pivot near 1e-16.
const INDEPENDENT: f64 = 1e12;

/// Refuses closures that depend on each other although rounding lets the matrix be factorized.
///
/// One back-substitution with the factor of the projection and a right-hand side that favours no direction; the joints are
/// looked through only if its answer is suspiciously large.
fn check_independence(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    rows: &mut [[f64; 1]],
) -> Result<()> {
    rows.iter_mut().enumerate().for_each(|(i, row)| row[0] = (1.0 + 2.3 * i as f64).sin());
    system.factor().solve(rows);
    if rows.iter().all(|row| row[0].abs() < INDEPENDENT) {
        return Ok(());
    }
    let redundant = redundant_closures(system, mechanism, state);
    if redundant.is_empty() { Ok(()) } else { Err(dependent(&redundant, state.t)) }
}

/// Subtracts a Newton step from positions and multipliers; returns the largest change of a position.
fn apply(system: &System, step: &[[f64; 1]], state: &mut State<f64>) -> f64 {
    let coordinate = |u: &Unknown| matches!(u, Unknown::Coordinate(_));
    let sizes = system.unknowns().iter().zip(step).filter(|(u, _)| coordinate(u)).map(|(_, s)| s[0].abs());
    let largest = sizes.fold(0.0, |a, b| if b > a || b.is_nan() { b } else { a });
    let part = if largest > 0.5 { 0.5 / largest } else { 1.0 };
    for (unknown, change) in system.unknowns().iter().zip(step) {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] -= part * change[0],
            Unknown::Multiplier(m) => state.l[m] -= part * change[0],
        }
    }
    largest
}

/// Moves the free velocities to the nearest ones that the constraints allow: Φ_q v + Φ_t = 0.
pub fn make_velocities_consistent(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<Vec<f64>> {
    if mechanism.multipliers == 0 {
        return Ok(Vec::new());
    }
    let mut rows = vec![[0.0]; system.size()];
    let mut rates = vec![0.0; system.size()];
    system.closure_rates(mechanism, state, 1, &mut ElementWorkspace::default(), &mut rates);
    system.assemble(mechanism, state, Linearization::projection(), &mut rows);
    system.factorize(mechanism, state.t).map_err(|error| explained(system, mechanism, state, error))?;
    rows.iter_mut().zip(&rates).for_each(|(row, rate)| row[0] = *rate);
    system.factor().solve(&mut rows);
    let mut multipliers = vec![0.0; mechanism.multipliers];
    for (unknown, change) in system.unknowns().iter().zip(&rows) {
        match *unknown {
            Unknown::Coordinate(i) => state.v[i] -= change[0],
            Unknown::Multiplier(m) => multipliers[m] = -change[0],
        }
    }
    Ok(multipliers)
}

/// Room for solving for accelerations again and again without allocating.
#[derive(Clone, Debug, Default)]
pub struct AccelerationSolver {
    rows: Vec<[f64; 1]>,
    rates: Vec<f64>,
    jets: ElementWorkspace<Jet2<f64>>,
}

impl AccelerationSolver {
    /// Solves for the free accelerations and the multipliers: M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    ///
    /// The factor of the saddle-point matrix stays in `system`.
    ///
    /// **Errors.** [`Error::Analysis`] naming the coordinate or joint without a pivot.
    pub fn solve(&mut self, system: &mut System, mechanism: &Mechanism<f64>, state: &mut State<f64>) -> Result<()> {
        self.rows.resize(system.size(), [0.0]);
        self.rates.resize(system.size(), 0.0);
        state.l.fill(0.0);
        for unknown in system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                state.a[i] = 0.0;
            }
        }
        system.assemble(mechanism, state, Linearization::accelerations(), &mut self.rows);
        system.closure_rates(mechanism, state, 2, &mut self.jets, &mut self.rates);
        system.factorize(mechanism, state.t).map_err(|error| explained(system, mechanism, state, error))?;
        for ((row, rate), unknown) in self.rows.iter_mut().zip(&self.rates).zip(system.unknowns()) {
            if matches!(unknown, Unknown::Multiplier(_)) {
                row[0] = *rate;
            }
        }
        system.factor().solve(&mut self.rows);
        if self.rows.iter().any(|row| !row[0].is_finite()) {
            let singular = || explained(system, mechanism, state, no_accelerations(state.t));
            return Err(diagnostics::not_finite(mechanism, state).unwrap_or_else(singular));
        }
        for (unknown, change) in system.unknowns().iter().zip(&self.rows) {
            match *unknown {
                Unknown::Coordinate(i) => state.a[i] = -change[0],
                Unknown::Multiplier(m) => state.l[m] = -change[0],
            }
        }
        Ok(())
    }
}

/// Rows of the acceleration problem in any number type: balance, and Φ̈ in the closure rows.
pub fn acceleration_rows<T: StateScalar>(
    system: &System,
    mechanism: &Mechanism<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
    jets: &mut ElementWorkspace<Jet2<T>>,
    rows: &mut [T],
) where
    Jet2<T>: crate::mechanism::scalars::ElementScalar,
{
    system.residual(mechanism, state, 1.0, workspace, rows);
    system.closure_rates(mechanism, state, 2, jets, rows);
}

fn no_accelerations(t: f64) -> Error {
    let why = format!("the accelerations at t = {t:.6e} s are not finite");
    Error::analysis("the mechanism", why, "check its masses, and the rates of its prescribed motions")
}

/// A singular system explained by what is not finite, or by redundant joints, if that is what it is.
fn explained(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, error: Error) -> Error {
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return error;
    }
    let redundant = redundant_closures(system, mechanism, state);
    if redundant.is_empty() { error } else { dependent(&redundant, state.t) }
}

fn dependent(redundant: &[String], t: f64) -> Error {
    let why = format!("redundant or contradictory at t = {t:.6e} s");
    let remedy = "remove these constraints, or free the directions that other joints hold already; \
                  a dead centre makes constraints dependent for an instant";
    Error::analysis(redundant.join(", "), why, remedy)
}

/// Names of the closures whose gradient depends on those of the closures before them.
///
/// Gram–Schmidt on the rows of Φ_q with respect to the free coordinates, in the order of the joints.
pub fn redundant_closures(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut redundant = Vec::new();
    for (m, mut row) in system.closure_gradients(mechanism, state).into_iter().enumerate() {
        let norm = |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>().sqrt();
        let whole = norm(&row);
        for _ in 0..2 {
            for other in &basis {
                let share: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
                row.iter_mut().zip(other).for_each(|(a, b)| *a -= share * b);
            }
        }
        let rest = norm(&row);
        if rest <= 1e-9 * whole.max(1e-300) {
            redundant.push(name_of(mechanism, Unknown::Multiplier(m)));
        } else {
            basis.push(row.iter().map(|x| x / rest).collect());
        }
    }
    redundant
}
