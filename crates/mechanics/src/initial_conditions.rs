//! Initial conditions: assembled positions, static equilibrium, consistent velocities and accelerations.
//!
//! Every analysis begins with [`assemble`]. Dynamics continues with [`make_velocities_consistent`] and
//! [`AccelerationSolver`]; statics with [`find_equilibrium`].

use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown, name_of};
use crate::{Error, Result, diagnostics};

/// Settings of the assembly of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assembly {
    /// Largest correction (m or rad) of the last iteration.
    pub tolerance: f64,
    /// Largest number of Newton iterations.
    pub iterations: usize,
}

impl Default for Assembly {
    fn default() -> Self {
        Self { tolerance: 1e-12, iterations: 50 }
    }
}

/// Multipliers of the projections of initial positions and velocities, for their derivatives.
#[derive(Clone, Debug, Default)]
pub struct Projection {
    /// Multipliers of the positions, or the reactions if the motion starts in static equilibrium.
    pub position: Vec<f64>,
    /// Multipliers of the velocities.
    pub velocity: Vec<f64>,
}

/// Moves the free coordinates of `state` to the nearest point that satisfies the constraints.
///
/// Minimizes ½ |q − q_guess|² subject to Φ(q, t) = 0 by Newton's method on the optimality conditions. To stay on the branch
/// of the guess, steps are shortened so that no coordinate changes by more than 0.5 m or rad.
///
/// # Errors
///
/// [`Error::Analysis`] naming the joint that cannot be closed, or joints that depend on each other.
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
        // The next correction of Newton's method is about the square of this one.
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

/// Size of a solution of the projection above which constraints depend on each other: a redundant constraint has a pivot
/// near 1e-16 by rounding.
const INDEPENDENT: f64 = 1e12;

/// Checks that the constraints are independent, as rounding errors can make a singular matrix regular.
///
/// Solves once with the factor of the projection and a right-hand side that has components in all directions. The joints
/// are searched for redundant constraints only if the solution is very large.
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
    let redundant = redundant_constraints(system, mechanism, state);
    if redundant.is_empty() { Ok(()) } else { Err(dependent(&redundant, state.t)) }
}

/// Subtracts a Newton step from positions and multipliers; returns the largest change of a position.
fn apply(system: &System, step: &[[f64; 1]], state: &mut State<f64>) -> f64 {
    let largest = system.largest_coordinate_row(step);
    let fraction = if largest > 0.5 { 0.5 / largest } else { 1.0 };
    for (unknown, change) in system.unknowns().iter().zip(step) {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] -= fraction * change[0],
            Unknown::Multiplier(m) => state.l[m] -= fraction * change[0],
        }
    }
    largest
}

/// Moves the free velocities to the nearest ones that satisfy the constraints: Φ_q v + Φ_t = 0. Returns the multipliers.
///
/// # Errors
///
/// [`Error::Analysis`] naming joints that depend on each other.
pub fn make_velocities_consistent(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<Vec<f64>> {
    if mechanism.multipliers == 0 {
        return Ok(Vec::new());
    }
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, state, Linearization::projection(), &mut rows);
    system.factorize(mechanism, state.t).map_err(|error| explained(system, mechanism, state, error))?;
    rows.fill([0.0]);
    system.constraint_rates(mechanism, state, 1, &mut ElementWorkspace::default(), rows.as_flattened_mut());
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

/// Solver for consistent accelerations; it allocates only at its first use.
#[derive(Clone, Debug, Default)]
pub struct AccelerationSolver {
    rows: Vec<[f64; 1]>,
    jets: ElementWorkspace<Jet2<f64>>,
}

impl AccelerationSolver {
    /// Solves for the free accelerations and the multipliers: M q̈ + Φ_qᵀ λ = f, Φ̈ = 0.
    ///
    /// The factor of the saddle-point matrix stays in `system`.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming the coordinate or joint without a pivot.
    pub fn solve(&mut self, system: &mut System, mechanism: &Mechanism<f64>, state: &mut State<f64>) -> Result<()> {
        self.rows.resize(system.size(), [0.0]);
        state.l.fill(0.0);
        for unknown in system.unknowns() {
            if let Unknown::Coordinate(i) = *unknown {
                state.a[i] = 0.0;
            }
        }
        system.assemble(mechanism, state, Linearization::accelerations(), &mut self.rows);
        system.constraint_rates(mechanism, state, 2, &mut self.jets, self.rows.as_flattened_mut());
        system.factorize(mechanism, state.t).map_err(|error| explained(system, mechanism, state, error))?;
        system.factor().solve(&mut self.rows);
        if self.rows.iter().any(|row| !row[0].is_finite()) {
            let singular = || explained(system, mechanism, state, no_accelerations(state.t));
            return Err(diagnostics::not_finite(mechanism, state).unwrap_or_else(singular));
        }
        system.set_accelerations(&self.rows, state);
        Ok(())
    }
}

/// Residual of the accelerations in any number type: equations of motion, and Φ̈ in the rows of the constraints.
pub fn acceleration_rows<T: StateScalar>(
    system: &System,
    mechanism: &Mechanism<T>,
    state: &State<T>,
    workspace: &mut ElementWorkspace<T>,
    jets: &mut ElementWorkspace<Jet2<T>>,
    rows: &mut [T],
) where
    Jet2<T>: ElementScalar,
{
    system.residual(mechanism, state, 1.0, workspace, rows);
    system.constraint_rates(mechanism, state, 2, jets, rows);
}

/// The error of accelerations that are not finite although all elements are.
fn no_accelerations(t: f64) -> Error {
    let why = format!("the accelerations at t = {t:.6e} s are not finite");
    Error::analysis("the mechanism", why, "check its masses, and the rates of its prescribed motions")
}

/// The error of a singular system: what is not finite, redundant joints if there are any, or else `error`.
fn explained(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, error: Error) -> Error {
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return error;
    }
    let redundant = redundant_constraints(system, mechanism, state);
    if redundant.is_empty() { error } else { dependent(&redundant, state.t) }
}

/// The error of `redundant` constraints.
fn dependent(redundant: &[String], t: f64) -> Error {
    let why = format!("redundant or contradictory at t = {t:.6e} s");
    let remedy = "remove these constraints, or free the directions that other joints hold already; \
                  a dead centre makes constraints dependent for an instant";
    Error::analysis(redundant.join(", "), why, remedy)
}

/// Names of the constraints whose gradients depend on those of the constraints before them.
///
/// Applies Gram–Schmidt to the rows of Φ_q with respect to the free coordinates, in the order of the joints.
pub fn redundant_constraints(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Vec<String> {
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut redundant = Vec::new();
    for (m, mut row) in system.constraint_jacobian(mechanism, state).into_iter().enumerate() {
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

/// Settings of Newton's iteration for a static equilibrium.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statics {
    /// Largest correction (m or rad) of the last iteration.
    pub tolerance: f64,
    /// Largest number of Newton iterations at one time.
    pub iterations: usize,
    /// Largest change of a position (m or rad) in one iteration.
    pub longest: f64,
}

impl Default for Statics {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 100, longest: 0.5 }
    }
}

/// Moves `state` to the static equilibrium at its time: the equations of motion with v = q̈ = 0, and Φ = 0.
///
/// The factor of the last iteration stays in `system`.
///
/// # Errors
///
/// [`Error::Analysis`] naming the unknown with the largest residual and the element with the largest share in it.
pub fn find_equilibrium(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: &Statics,
) -> Result<()> {
    let mut rows = vec![[0.0]; system.size()];
    state.prescribe(mechanism);
    state.v.fill(0.0);
    state.a.fill(0.0);
    if mechanism.multipliers > 0 && state.l.iter().all(|l| *l == 0.0) {
        guess_reactions(system, mechanism, state, &mut rows)?;
    }
    for _ in 0..settings.iterations {
        system.assemble(mechanism, state, Linearization::statics(), &mut rows);
        diagnostics::factorize(system, mechanism, state)?;
        system.factor().solve(&mut rows);
        let largest = system.largest_coordinate_row(&rows);
        if !largest.is_finite() {
            break;
        }
        let fraction = if largest > settings.longest { settings.longest / largest } else { 1.0 };
        for (unknown, change) in system.unknowns().iter().zip(&rows) {
            match *unknown {
                Unknown::Coordinate(i) => state.q[i] -= fraction * change[0],
                Unknown::Multiplier(m) => state.l[m] -= change[0],
            }
        }
        if largest <= settings.tolerance {
            return Ok(());
        }
    }
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return Err(error);
    }
    let what = diagnostics::dominant_residual(system, mechanism, state, &rows);
    let why = format!("no static equilibrium found at t = {:.6e} s", state.t);
    Err(Error::analysis(what, why, "apply the load in more steps, or add stiffness to free motions"))
}

/// Sets the reactions that minimize the residual forces at the given positions.
///
/// A pendulum has no stiffness except that of its reactions: without this guess its equations are singular.
fn guess_reactions(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    rows: &mut [[f64; 1]],
) -> Result<()> {
    let mut forces = vec![[0.0]; rows.len()];
    system.assemble(mechanism, state, Linearization::statics(), &mut forces);
    system.assemble(mechanism, state, Linearization::projection(), rows);
    diagnostics::factorize(system, mechanism, state)?;
    for ((row, force), unknown) in rows.iter_mut().zip(&forces).zip(system.unknowns()) {
        *row = if matches!(unknown, Unknown::Coordinate(_)) { *force } else { [0.0] };
    }
    system.factor().solve(rows);
    for (unknown, row) in system.unknowns().iter().zip(rows.iter()) {
        if let Unknown::Multiplier(m) = *unknown {
            state.l[m] = -row[0];
        }
    }
    Ok(())
}

/// Moves `state` to the static equilibrium at its time and keeps its velocities. Returns the reactions, one per multiplier.
pub(crate) fn equilibrium_reactions(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    statics: &Statics,
) -> Result<Vec<f64>> {
    let velocities = state.v.clone();
    find_equilibrium(system, mechanism, state, statics)?;
    state.v = velocities;
    state.prescribe(mechanism);
    Ok(std::mem::replace(&mut state.l, vec![0.0; mechanism.multipliers]))
}
