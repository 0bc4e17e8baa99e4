//! Initial conditions: assembled positions, static equilibrium, consistent velocities and accelerations.
//!
//! Every analysis begins with [`assemble`]. Dynamics continues with [`make_velocities_consistent`] and
//! [`AccelerationSolver`]; statics with [`find_equilibrium`].

pub use crate::constraint_rank::redundant_constraints;
pub use crate::equilibrium::{Statics, find_equilibrium};

pub(crate) use crate::equilibrium::equilibrium_reactions;

use crate::assembly_failures::{conflicting_drives, driven_positions};
use crate::constraint_rank::ConstraintRank;
use crate::elements::element::ElementWorkspace;
use crate::initial_velocities::{VelocityProjection, solve_velocities};
use crate::mechanism::scalars::{ElementScalar, Jet2, StateScalar};
use crate::mechanism::{Mechanism, Unilateral};
use crate::system::coordinate_scales::CoordinateScales;
use crate::system::linearization::Linearization;
use crate::system::state::State;
use crate::system::{System, Unknown, name_of};
use crate::{Error, Result, diagnostics, reaction_loads};
use error::Seconds;

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
    /// Multipliers of the velocities, and those that are kept.
    pub velocity: VelocityProjection,
    /// Multipliers of the nearest consistent velocities, if the velocities are these: where drives determine all of them.
    pub nearest_velocity: Vec<f64>,
}

/// Moves the free coordinates of `state` to the nearest point that satisfies the constraints.
///
/// Minimizes ½ |q − q_guess|² subject to Φ(q, t) = 0 by Newton's method on the optimality conditions. To stay on the branch
/// of the guess, steps are shortened so that no coordinate changes by more than 0.5 m or rad; in a mechanism of more than 10 m, or in other units, so
/// that no joint opens by more than 5 % of its size.
///
/// If some constraints follow from the others in all positions, as in a platform on three parallel cranks, `system` computes
/// the multipliers of least norm from now on.
///
/// # Errors
///
/// [`Error::Analysis`] naming the joint that cannot be closed, joints that depend on each other in this position only, or a
/// joint that is closed in a wrong way, such as with opposite axes.
pub fn assemble(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: Assembly,
) -> Result<Projection> {
    let guess = state.clone();
    let projection = assemble_nearest(system, mechanism, state, settings);
    let projection = projection.map_err(|error| conflicting_drives(mechanism, &guess).unwrap_or(error))?;
    diagnostics::check_assembly(mechanism, state)?;
    Ok(projection)
}

/// Moves the free coordinates of `state` to the nearest point that satisfies the constraints, see [`assemble`].
fn assemble_nearest(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: Assembly,
) -> Result<Projection> {
    let guess = state.clone();
    let failure = match close_joints(system, mechanism, state, settings) {
        Err(failure) if !system.allows_redundancy() && guess.q.iter().all(|q| q.is_finite()) => failure,
        done => return done.map_err(AssemblyFailure::into_error),
    };
    state.copy_from(&guess);
    system.allow_redundancy(true);
    match close_joints(system, mechanism, state, settings) {
        Ok(projection) if has_redundant_constraints(system, mechanism, state, settings) => Ok(projection),
        _ => {
            system.allow_redundancy(false);
            state.copy_from(&guess);
            Err(match failure {
                AssemblyFailure::OpenLoop(error) => error,
                AssemblyFailure::Other(error) => with_largest_gap(error, system, mechanism, &guess),
            })
        }
    }
}

/// Returns whether constraints depend on each other in the assembled `state` and in positions next to it.
///
/// At a dead centre they depend on each other in one position only.
fn has_redundant_constraints(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    settings: Assembly,
) -> bool {
    let here = ConstraintRank::of(system, mechanism, state);
    if here.redundant.is_empty() {
        return false;
    }
    // An arbitrary direction whose components have no simple ratios.
    let mut direction: Vec<f64> = (0..state.q.len())
        .map(|i| if system.equation_of(i).is_some() { (1.0 + 2.3 * i as f64).sin() } else { 0.0 })
        .collect();
    here.project(&mut direction);
    let largest = direction.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    let scale = if largest > 1e-6 { NEARBY / largest } else { 0.0 };
    [0.1, 0.01, 0.0].into_iter().any(|later| {
        let mut moved = state.clone();
        moved.t += later;
        moved.q.iter_mut().zip(&direction).for_each(|(q, d)| *q += scale * d);
        moved.prescribe(mechanism);
        let is_closed = close_joints(system, mechanism, &mut moved, settings).is_ok();
        is_closed && ConstraintRank::of(system, mechanism, &moved).rank() == here.rank()
    })
}

/// Distance of the position (m or rad) in which the rank of the constraints is compared.
const NEARBY: f64 = 0.02;

/// Largest error of a constraint in m or rad after the assembly with redundant constraints; in mechanisms of more than 1 m, in their extents.
const CLOSED: f64 = 1e-9;

/// Why joints cannot be closed.
enum AssemblyFailure {
    /// Dependent constraints stay open; the error names their gap.
    OpenLoop(Error),
    /// Any other reason.
    Other(Error),
}

impl AssemblyFailure {
    fn into_error(self) -> Error {
        match self {
            Self::OpenLoop(error) | Self::Other(error) => error,
        }
    }
}

impl From<Error> for AssemblyFailure {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}

/// Closes the joints by Newton's method, see [`assemble`].
fn close_joints(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: Assembly,
) -> Result<Projection, AssemblyFailure> {
    let mut rows = vec![[0.0]; system.size()];
    if mechanism.multipliers == 0 {
        return Ok(Projection::default());
    }
    let guess = state.q.clone();
    state.l.fill(0.0);
    for _ in 0..settings.iterations {
        system.assemble(mechanism, state, Linearization::projection(), &mut rows);
        for (row, unknown) in rows.iter_mut().zip(system.unknowns()) {
            if let Unknown::Coordinate(i) = *unknown
                && !mechanism.coordinates[i].is_follower
            {
                row[0] += state.q[i] - guess[i];
            }
        }
        if let Err(error) = system.factorize(mechanism, state.t) {
            let error = explained(system, mechanism, state, error);
            let open = open_loop(system, mechanism, state, &mut rows);
            return Err(open.map_or(AssemblyFailure::Other(error), AssemblyFailure::OpenLoop));
        }
        system.factor().solve(&mut rows);
        if rows.iter().any(|row| !row[0].is_finite()) {
            break;
        }
        let largest = apply(system, mechanism, &rows, state);
        // Relative to the size of the mechanism, the next correction of Newton's method is about the square of this one.
        let size = (SMALL * state.q.iter().fold(0.0, |size: f64, q| size.max(q.abs()))).min(1.0);
        if largest <= settings.tolerance || largest * largest <= 0.01 * settings.tolerance * size * size {
            let closed = CLOSED * CoordinateScales::at(mechanism, &state.q).length();
            if system.allows_redundancy() && largest_gap(system, mechanism, state, &mut rows) > closed {
                break;
            }
            check_independence(system, mechanism, state, &mut rows)?;
            let position = std::mem::replace(&mut state.l, vec![0.0; mechanism.multipliers]);
            return Ok(Projection { position, ..Projection::default() });
        }
    }
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return Err(error.into());
    }
    largest_gap(system, mechanism, state, &mut rows);
    let what = system.dominant_residual(mechanism, &rows);
    let driven = driven_positions(mechanism, state);
    let why = format!("the mechanism cannot be assembled at t = {}{driven}", Seconds(state.t));
    let remedy = match driven.is_empty() {
        true => "check the lengths and the initial positions: the loop may be too short to close",
        false => {
            "check the lengths, the initial positions and the stroke of the drives: the loop may be too short to close"
        }
    };
    Err(Error::analysis(what, why, remedy).into())
}

/// The error of dependent constraints that stay open in a singular position, such as a rod that is in line with a crank and too short.
/// `None` if all constraints are closed, independent, or not finite.
fn open_loop(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    rows: &mut [[f64; 1]],
) -> Option<Error> {
    if diagnostics::not_finite(mechanism, state).is_some() {
        return None;
    }
    let Error::Analysis { what: dependent, .. } = dependent(system, mechanism, state)? else { return None };
    let gap = largest_gap(system, mechanism, state, rows);
    let open = system.dominant_residual(mechanism, rows);
    let others = match dependent.split(", ").any(|name| name == open) {
        true => String::new(),
        false => format!(", and these constraints depend on others: {dependent}"),
    };
    let why = format!(
        "the loop cannot be closed from these positions, or constraints are contradictory at t = {}: a gap of {gap:.3} m or rad remains{others}",
        Seconds(state.t)
    );
    let remedy = "check the lengths: the loop may be too short; if it can be closed, begin with positions that are not in line; if other joints \
                  hold these directions already, remove this constraint";
    let is_open = gap > LARGE_GAP && gap.is_finite();
    is_open.then(|| Error::analysis(open, why, remedy))
}

/// Inverse of the size in m below which a mechanism counts as small: convergence of its assembly is then measured relative to its size.
const SMALL: f64 = 10.0;

/// Error of a constraint in the positions of the model, in m or rad, from which on a failure names it.
pub(crate) const LARGE_GAP: f64 = 1e-2;

/// The `error` of a failed assembly from `guess`. If `guess` has the positions of the model, it names the largest error of a constraint in them: the
/// usual reason is a drive that prescribes another position than the model has.
fn with_largest_gap(error: Error, system: &mut System, mechanism: &Mechanism<f64>, guess: &State<f64>) -> Error {
    let mut rows = vec![[0.0]; system.size()];
    let gap = largest_gap(system, mechanism, guess, &mut rows);
    let is_built = guess.q == State::built(mechanism, guess.t).q;
    match error {
        Error::Analysis { what, why, remedy } if is_built && gap > LARGE_GAP && gap.is_finite() => {
            let worst = system.dominant_residual(mechanism, &rows);
            let why =
                format!("{why}; in the positions of the model the largest error is {gap:.3} m or rad, of {worst}");
            Error::Analysis { what, why, remedy }
        }
        error => error,
    }
}

/// Writes Φ to the rows of the constraints, and zero to the others. Returns the largest absolute value.
pub(crate) fn largest_gap(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    rows: &mut [[f64; 1]],
) -> f64 {
    system.assemble(mechanism, state, Linearization::projection(), rows);
    for (row, unknown) in rows.iter_mut().zip(system.unknowns()) {
        row[0] = if matches!(unknown, Unknown::Multiplier(_)) { row[0] } else { 0.0 };
    }
    rows.iter().fold(0.0, |a, row| a.max(row[0].abs()))
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
    if system.allows_redundancy() {
        return Ok(());
    }
    rows.iter_mut().enumerate().for_each(|(i, row)| row[0] = (1.0 + 2.3 * i as f64).sin());
    system.factor().solve(rows);
    if rows.iter().all(|row| row[0].abs() < INDEPENDENT) {
        return Ok(());
    }
    dependent(system, mechanism, state).map_or(Ok(()), Err)
}

/// Largest change of a coordinate in an iteration, in m or rad, and as a fraction of the size of the mechanism.
const LARGEST_CHANGE: [f64; 2] = [0.5, 0.05];

/// Part of a Newton step for which no coordinate changes too much: by more than 0.5 m or rad, and by so much that a joint opens by more than 5 % of
/// the size of the mechanism. The size is the largest coordinate: lengths may have any unit.
fn fraction_of_step(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, step: &[[f64; 1]]) -> f64 {
    let [absolute, relative] = LARGEST_CHANGE;
    let largest = system.largest_coordinate_row(step);
    if largest <= absolute {
        return 1.0;
    }
    let opening = relative * state.q.iter().fold(0.0, |size: f64, q| size.max(q.abs()));
    if opening <= absolute {
        return absolute / largest;
    }
    let jacobian = system.constraint_jacobian(mechanism, state);
    let allowed = |i: usize| opening / jacobian.iter().fold(1.0, |most: f64, row| most.max(row[i].abs()));
    let fractions = system.unknowns().iter().zip(step).map(|(unknown, change)| match *unknown {
        Unknown::Coordinate(i) => absolute.max(allowed(i)) / change[0].abs(),
        Unknown::Multiplier(_) => 1.0,
    });
    fractions.fold(1.0, f64::min)
}

/// Subtracts a Newton step from positions and multipliers; returns the largest change of a position.
fn apply(system: &System, mechanism: &Mechanism<f64>, step: &[[f64; 1]], state: &mut State<f64>) -> f64 {
    let largest = system.largest_coordinate_row(step);
    let fraction = fraction_of_step(system, mechanism, state, step);
    for (unknown, change) in system.unknowns().iter().zip(step) {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] -= fraction * change[0],
            Unknown::Multiplier(m) => state.l[m] -= fraction * change[0],
        }
    }
    largest
}

/// Sets the free velocities: given ones are kept, the others follow through Φ_q v + Φ_t = 0, or have the least kinetic energy, see
/// [`initial_velocities`](crate::initial_velocities).
///
/// # Errors
///
/// [`Error::Analysis`] naming joints that depend on each other or contradict a drive, or a coordinate without mass or joint.
pub fn make_velocities_consistent(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<VelocityProjection> {
    if mechanism.multipliers == 0 {
        return Ok(VelocityProjection::default());
    }
    let projection = solve_velocities(system, mechanism, state);
    let projection = projection.map_err(|error| explained(system, mechanism, state, error))?;
    if system.allows_redundancy() {
        let mut rates = vec![0.0; system.size()];
        system.constraint_rates(mechanism, state, 1, &mut ElementWorkspace::default(), &mut rates);
        let largest_velocity = state.v.iter().fold(0.0f64, |a, v| a.max(v.abs()));
        check_contradictions(system, mechanism, state.t, (&rates, "m/s or rad/s"), CONTRADICTION * largest_velocity)?;
    }
    Ok(projection)
}

/// Error of a constraint in m or rad, or of its rate as a fraction of the largest velocity, above which redundant constraints contradict
/// each other.
pub(crate) const CONTRADICTION: f64 = 1e-6;

/// Checks that the constraints in `rows`, or their rates, are at most `largest` at the time `t` (s): redundant ones may contradict each other.
///
/// # Errors
///
/// [`Error::Analysis`] naming the one with the largest error.
pub(crate) fn check_contradictions(
    system: &System,
    mechanism: &Mechanism<f64>,
    t: f64,
    (rows, unit): (&[f64], &str),
    largest: f64,
) -> Result<()> {
    let constraints =
        system.unknowns().iter().zip(rows).filter(|(unknown, _)| matches!(unknown, Unknown::Multiplier(_)));
    let Some((unknown, error)) = constraints.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())) else { return Ok(()) };
    if error.abs() <= largest {
        return Ok(());
    }
    let why = format!(
        "joints and drives contradict each other at t = {t}: this one is violated by {:.3e} {unit}",
        error.abs(),
        t = Seconds(t)
    );
    let remedy = "remove a drive, or the joints that do not allow its motion";
    Err(Error::analysis(name_of(mechanism, *unknown), why, remedy))
}

/// Moves the free velocities to the nearest ones that satisfy the constraints, W (v − v_guess) + Φ_qᵀ ν = 0 and Φ_q v + Φ_t = 0. Returns the
/// multipliers. The weights W are those of [`ProjectedPart`](crate::derivatives::forward::initial_conditions::ProjectedPart).
///
/// # Errors
///
/// [`Error::Analysis`] naming joints that depend on each other.
pub(crate) fn nearest_consistent_velocities(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<Vec<f64>> {
    if mechanism.multipliers == 0 {
        return Ok(Vec::new());
    }
    let mut rows = vec![[0.0]; system.size()];
    system.assemble(mechanism, state, Linearization::velocity_projection(), &mut rows);
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
    /// Solves for the free accelerations and the multipliers: M q̈ + Φ_qᵀ λ = f, Φ̈ = 0. It iterates if f depends on λ.
    ///
    /// The factor of the saddle-point matrix stays in `system`.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] naming the coordinate or joint without a pivot, or friction that locks the mechanism.
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
        let load = system.largest_coordinate_row(&self.rows);
        system.factorize(mechanism, state.t).map_err(|error| explained(system, mechanism, state, error))?;
        system.factor().solve(&mut self.rows);
        if self.rows.iter().any(|row| !row[0].is_finite()) {
            let singular = || explained(system, mechanism, state, no_accelerations(state.t));
            return Err(diagnostics::not_finite(mechanism, state).unwrap_or_else(singular));
        }
        system.set_accelerations(&self.rows, state);
        if mechanism.has_reactions_as_loads() {
            reaction_loads::iterate(system, mechanism, state, (&mut self.rows, load), &mut self.jets)?;
        }
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
    let why = format!("the accelerations at t = {t} are not finite", t = Seconds(t));
    Error::analysis("the mechanism", why, "check its masses, and the rates of its prescribed motions")
}

/// The error of a singular system: what is not finite, redundant joints if there are any, or else `error`.
fn explained(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, error: Error) -> Error {
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return error;
    }
    dependent(system, mechanism, state).unwrap_or(error)
}

/// The error of constraints that depend on others, if there are any.
fn dependent(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>) -> Option<Error> {
    let redundant = ConstraintRank::of(system, mechanism, state).redundant;
    let names: Vec<String> = redundant.iter().map(|&m| name_of(mechanism, Unknown::Multiplier(m))).collect();
    let mut laws = mechanism.events.iter().filter_map(|event| event.unilateral);
    let is_contact = |law| matches!(law, Unilateral::Contact { multiplier, .. } if redundant.contains(&multiplier));
    let remedy = match laws.any(is_contact) {
        true => {
            "other rigid contacts or joints hold this place already: leave out the contact, or model it with stiffness and damping (a \
             wall contact, a bump stop)"
        }
        false => {
            "remove these constraints, or free the directions that other joints hold already; \
             a dead centre makes constraints dependent for an instant"
        }
    };
    let why = format!("redundant or contradictory at t = {}", Seconds(state.t));
    (!names.is_empty()).then(|| Error::analysis(names.join(", "), why, remedy))
}
