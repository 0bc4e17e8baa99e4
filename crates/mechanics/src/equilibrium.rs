//! Static equilibria: Newton's iteration, and the load path where it fails.

use crate::elements::element::ElementWorkspace;
use crate::mechanism::Mechanism;
use crate::system::coordinate_scales::CoordinateScales;
use crate::system::linearization::Linearization;
use crate::system::state::{State, evaluate};
use crate::system::{System, Unknown};
use crate::{Error, Result, diagnostics};
use error::Seconds;

/// Settings of Newton's iteration for a static equilibrium.
///
/// Changes of positions of bodies are in m, or in the extent of the mechanism if it is larger than 1 m: the largest distance of two bodies
/// along an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statics {
    /// Largest correction (m, extents or rad) of the last iteration.
    pub tolerance: f64,
    /// Largest number of Newton iterations at one time.
    pub iterations: usize,
    /// Largest change of a position (m, extents or rad) in one iteration, unless the equations are nearly linear along it.
    pub longest: f64,
}

impl Default for Statics {
    fn default() -> Self {
        Self { tolerance: 1e-10, iterations: 100, longest: 0.5 }
    }
}

/// Moves `state` to the static equilibrium at its time: the equations of motion with v = q̈ = 0, and Φ = 0.
///
/// Newton's iteration begins at the given positions. If it does not converge, the residual forces of the given positions
/// are removed gradually: the path of equilibria from these positions to the load is followed by its arc length. It passes
/// limit points, at which the load has a largest or smallest value, and may end at distant positions, as after a snap-through.
///
/// The factor of the last iteration stays in `system`.
///
/// # Errors
///
/// [`Error::Analysis`] naming the unknown with the largest residual and the element with the largest share in it.
///
/// # Sources
///
/// Riks, *Int. J. Solids Struct.* 15 (1979) 529–551; Crisfield, *Non-linear Finite Element Analysis of Solids and
/// Structures*, vol. 1 (1991), Chapter 9.
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
    let start = state.clone();
    let outcome = newton(system, mechanism, state, settings, &mut rows);
    if outcome != Ok(true) {
        let failed = state.clone();
        state.copy_from(&start);
        let path = LoadPath::new(system, mechanism, settings, &start).follow(state);
        if !matches!(path, Ok(None)) {
            outcome?;
            state.copy_from(&failed);
            return Err(no_equilibrium(system, mechanism, state, &mut rows, path.ok().flatten().as_ref()));
        }
    }
    if system.allows_redundancy() {
        state.l.fill(0.0);
        guess_reactions(system, mechanism, state, &mut rows)?;
        system.assemble(mechanism, state, Linearization::statics(), &mut rows);
        diagnostics::factorize_stiffness(system, mechanism, state)?;
    }
    Ok(())
}

/// Moves `state` from the equilibrium at its time to that at the time `t` (s).
///
/// If drives move parts in between, they do so in substeps that are so short that the first correction of Newton's iteration predicts each
/// equilibrium: the assembly stays on its branch, and rotations count turns. Loads alone are applied in one step.
///
/// # Errors
///
/// As [`find_equilibrium`].
pub(crate) fn advance_equilibrium(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    t: f64,
    settings: &Statics,
) -> Result<()> {
    if t != state.t && is_driven_until(system, mechanism, state, t) {
        let start = state.clone();
        if !matches!(advance_in_substeps(system, mechanism, state, t, settings), Ok(true)) {
            state.copy_from(&start);
        }
    }
    state.t = t;
    find_equilibrium(system, mechanism, state, settings)
}

/// Smallest substep, as a fraction of the interval.
const SMALLEST_SUBSTEP: f64 = 1.0 / 256.0;

/// Largest motion of a prescribed coordinate in a substep (m, extents or rad).
const LONGEST_MOTION: f64 = 0.5;

/// Largest error of a predicted equilibrium for which a substep is accepted, relative to the predicted change.
const GOOD_PREDICTION: f64 = 0.2;

/// Violation of a constraint (m, extents or rad) by which a drive has moved.
const MOVED: f64 = 1e-9;

/// Returns whether the drives are elsewhere at the time `t` (s) than at the equilibrium `state`.
fn is_driven_until(system: &mut System, mechanism: &Mechanism<f64>, state: &State<f64>, t: f64) -> bool {
    let (mut moved, mut rows) = (state.clone(), vec![[0.0]; system.size()]);
    moved.t = t;
    moved.prescribe(mechanism);
    moved.v.fill(0.0);
    moved.a.fill(0.0);
    system.assemble(mechanism, &moved, Linearization::statics(), &mut rows);
    let gap = MOVED * CoordinateScales::at(mechanism, &moved.q).length();
    let is_open =
        |(unknown, row): (&Unknown, &[f64; 1])| matches!(unknown, Unknown::Multiplier(_)) && row[0].abs() > gap;
    moved.q != state.q || system.unknowns().iter().zip(&rows).any(is_open)
}

/// Moves `state` to the time `t` (s) in substeps. Returns whether each of them has led to an equilibrium.
fn advance_in_substeps(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    t: f64,
    settings: &Statics,
) -> Result<bool> {
    let mut substep = t - state.t;
    let smallest = SMALLEST_SUBSTEP * substep.abs();
    while state.t != t {
        let before = state.clone();
        state.t = if (t - before.t).abs() <= substep.abs() * (1.0 + 1e-9) { t } else { before.t + substep };
        let is_smallest = substep.abs() <= smallest;
        match advance_substep(system, mechanism, state, settings) {
            Ok(Substep::Predicted) => substep *= 2.0,
            Ok(Substep::Distant) if is_smallest => {}
            Ok(Substep::Failed) if is_smallest => return Ok(false),
            Err(error) if is_smallest => return Err(error),
            _ => {
                state.copy_from(&before);
                substep *= 0.5;
            }
        }
    }
    Ok(true)
}

/// Outcome of a substep to the next equilibrium.
enum Substep {
    /// Newton's iteration has converged near its first correction.
    Predicted,
    /// It has converged elsewhere.
    Distant,
    Failed,
}

/// Moves `state`, whose time has advanced, to the equilibrium at its time by Newton's iteration.
fn advance_substep(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: &Statics,
) -> Result<Substep> {
    let (before, mut rows) = (state.q.clone(), vec![[0.0]; system.size()]);
    state.prescribe(mechanism);
    state.v.fill(0.0);
    state.a.fill(0.0);
    let scales = CoordinateScales::at(mechanism, &before);
    let is_short = scales.distance(&state.q, &before) <= LONGEST_MOTION;
    system.assemble(mechanism, state, Linearization::statics(), &mut rows);
    diagnostics::factorize_stiffness(system, mechanism, state)?;
    system.factor().solve(&mut rows);
    let mut predicted = state.q.clone();
    for (unknown, change) in system.unknowns().iter().zip(&rows) {
        if let Unknown::Coordinate(i) = *unknown {
            predicted[i] -= change[0];
        }
    }
    if !newton(system, mechanism, state, settings, &mut rows)? {
        return Ok(Substep::Failed);
    }
    let is_near = scales.distance(&state.q, &predicted) <= GOOD_PREDICTION * scales.distance(&predicted, &before);
    Ok(if is_short && is_near { Substep::Predicted } else { Substep::Distant })
}

/// Ratio of two consecutive corrections up to which the equations are nearly linear along the first of them: its full step is taken then,
/// however long it is.
const NEARLY_LINEAR: f64 = 1e-2;

/// Newton's iteration with the full load. Returns whether it has converged.
///
/// A correction that is longer than [`Statics::longest`] is shortened, unless the next one after its full step is so much smaller that the
/// equilibrium is certainly near: soft springs give by any length.
fn newton(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: &Statics,
    rows: &mut [[f64; 1]],
) -> Result<bool> {
    let scales = CoordinateScales::at(mechanism, &state.q);
    let mut full_step: Option<(State<f64>, Vec<[f64; 1]>, f64)> = None;
    for _ in 0..settings.iterations {
        let mut largest = correction(system, mechanism, state, &scales, rows);
        if let Some((start, step, length)) = full_step.take()
            && !largest.as_ref().is_ok_and(|largest| *largest <= NEARLY_LINEAR * length)
        {
            state.copy_from(&start);
            subtract(system, &step, settings.longest / length, state);
            largest = correction(system, mechanism, state, &scales, rows);
        }
        let largest = largest?;
        if !largest.is_finite() {
            return Ok(false);
        }
        if largest > settings.longest {
            full_step = Some((state.clone(), rows.to_vec(), largest));
        }
        subtract(system, rows, 1.0, state);
        if largest <= settings.tolerance.max(scales.rounding(&state.q)) {
            return Ok(true);
        }
    }
    Ok(false)
}

/// Solves for the correction of Newton's iteration at `state`. Returns its largest scaled coordinate.
fn correction(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    scales: &CoordinateScales,
    rows: &mut [[f64; 1]],
) -> Result<f64> {
    system.assemble(mechanism, state, Linearization::statics(), rows);
    diagnostics::factorize_stiffness(system, mechanism, state)?;
    system.factor().solve(rows);
    Ok(scales.largest(system.unknowns(), rows.as_flattened()))
}

/// Subtracts a correction from the multipliers of `state`, and `fraction` of it from its coordinates.
fn subtract(system: &System, correction: &[[f64; 1]], fraction: f64, state: &mut State<f64>) {
    for (unknown, change) in system.unknowns().iter().zip(correction) {
        match *unknown {
            Unknown::Coordinate(i) => state.q[i] -= fraction * change[0],
            Unknown::Multiplier(m) => state.l[m] -= change[0],
        }
    }
}

/// The error of a load without equilibrium, with the end of the path towards it.
fn no_equilibrium(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    rows: &mut [[f64; 1]],
    end: Option<&PathEnd>,
) -> Error {
    system.assemble(mechanism, state, Linearization::statics(), rows);
    if let Some(error) = diagnostics::not_finite(mechanism, state) {
        return error;
    }
    let what = diagnostics::dominant_residual(system, mechanism, state, rows);
    let end = end.filter(|end| end.reached > 0.0 && end.reached < 1.0).map_or(String::new(), |end| {
        let ends = if end.is_behind_limit_point { "turns back (limit point)" } else { "ends" };
        format!(
            ". From the positions before, their unbalanced forces were removed gradually: this path of equilibria {ends} where {:.3} % of \
             them are removed; others were not searched",
            100.0 * end.reached
        )
    });
    let why = format!("no static equilibrium found for the load at t = {}{end}", Seconds(state.t));
    Error::analysis(what, why, "reduce the load, apply it in more steps, or add stiffness to free motions")
}

/// Where a path of equilibria ends before the load.
struct PathEnd {
    /// The largest load fraction that was reached.
    reached: f64,
    /// True if the load fraction is below it at the end.
    is_behind_limit_point: bool,
}

/// The path of equilibria of r(x) = (1 − s) r(x₀) from the start x₀ with s = 0 to the load with s = 1.
struct LoadPath<'s, 'm> {
    system: &'s mut System,
    mechanism: &'m Mechanism<f64>,
    settings: &'s Statics,
    /// r(x₀), by equation.
    start: Vec<f64>,
    /// ω, the weight of the load fraction in the arc length: the largest unbalanced force relative to the largest force of the parts. A
    /// small change of a large load may lead along a path on which the whole load is reversed.
    weight: f64,
    scales: CoordinateScales,
    rows: Vec<[f64; 1]>,
}

/// A direction in the space of unknowns and load fraction.
#[derive(Clone)]
struct PathDirection {
    unknowns: Vec<f64>,
    load: f64,
}

/// First and largest step along the path, in scaled coordinates (root mean square over all) and weighted load fraction.
const FIRST_STEP: f64 = 0.02;
const LONGEST_STEP: f64 = 0.2;

/// Smallest step along the path.
const SMALLEST_STEP: f64 = 1e-9;

/// Largest number of steps along the path, and of corrections in a step.
const MOST_PATH_STEPS: usize = 3000;
const MOST_CORRECTIONS: usize = 12;

/// Weighted load fraction in the opposite direction beyond which the path is not followed.
const LARGEST_REVERSAL: f64 = 10.0;

/// Smallest weight of the load fraction.
const SMALLEST_WEIGHT: f64 = 1e-6;

/// Largest correction (m, extents or rad) of the last iteration at an intermediate load.
const ON_THE_WAY: f64 = 1e-7;

impl<'s, 'm> LoadPath<'s, 'm> {
    fn new(system: &'s mut System, mechanism: &'m Mechanism<f64>, settings: &'s Statics, start: &State<f64>) -> Self {
        let mut rows = vec![[0.0]; system.size()];
        system.assemble(mechanism, start, Linearization::statics(), &mut rows);
        let unbalanced = system.largest_coordinate_row(&rows);
        let scales = CoordinateScales::at(mechanism, &start.q);
        let ratio = unbalanced / largest_force(mechanism, start);
        let weight = if ratio > 0.0 { ratio.clamp(SMALLEST_WEIGHT, 1.0) } else { 1.0 };
        let start = rows.as_flattened().to_vec();
        Self { system, mechanism, settings, start, weight, scales, rows }
    }

    /// Follows the path. Returns `None` at the load, or else the end of the path.
    fn follow(mut self, state: &mut State<f64>) -> Result<Option<PathEnd>> {
        let (mut load, mut reached, mut step) = (0.0, 0.0f64, FIRST_STEP);
        let mut before: Option<PathDirection> = None;
        for _ in 0..MOST_PATH_STEPS {
            self.factorize(state)?;
            let tangent = self.tangent(before.as_ref());
            loop {
                let (mut trial, is_last) = (state.clone(), load + step * tangent.load >= 1.0);
                let length = if is_last { (1.0 - load) / tangent.load } else { step };
                self.add(&tangent.unknowns, length, &mut trial);
                let target = if is_last { 1.0 } else { load + length * tangent.load };
                match self.correct(&mut trial, target, (!is_last).then_some(&tangent), length) {
                    Ok((_, _)) if is_last => {
                        state.copy_from(&trial);
                        let Self { system, mechanism, settings, rows, .. } = &mut self;
                        let has_converged = newton(system, mechanism, state, settings, rows)?;
                        return Ok((!has_converged).then_some(PathEnd { reached: 1.0, is_behind_limit_point: false }));
                    }
                    Ok((at, count)) => {
                        state.copy_from(&trial);
                        load = at;
                        reached = reached.max(load);
                        step = (step
                            * if count <= 4 {
                                1.7
                            } else if count <= 7 {
                                1.0
                            } else {
                                0.6
                            })
                        .min(LONGEST_STEP);
                        break;
                    }
                    Err(_) if step < SMALLEST_STEP => {
                        return Ok(Some(PathEnd { reached, is_behind_limit_point: load < reached }));
                    }
                    Err(_) => step *= 0.4,
                }
            }
            if load * self.weight < -LARGEST_REVERSAL {
                break;
            }
            before = Some(tangent);
        }
        Ok(Some(PathEnd { reached, is_behind_limit_point: load < reached }))
    }

    /// Factorizes the stiffness matrix at `state`; the residual is then in the rows.
    fn factorize(&mut self, state: &State<f64>) -> Result<()> {
        self.system.assemble(self.mechanism, state, Linearization::statics(), &mut self.rows);
        diagnostics::factorize_stiffness(self.system, self.mechanism, state)
    }

    /// Change of the unknowns with the load fraction: −K⁻¹ r(x₀).
    fn rate(&mut self) -> Vec<f64> {
        let mut rate: Vec<[f64; 1]> = self.start.iter().map(|r| [-r]).collect();
        self.system.factor().solve(&mut rate);
        rate.into_flattened()
    }

    /// The unit tangent of the path, which continues the direction `before`.
    fn tangent(&mut self, before: Option<&PathDirection>) -> PathDirection {
        let rate = self.rate();
        let square = self.weight * self.weight;
        let length = (self.product(&rate, &rate) + square).sqrt();
        let turn = before.map_or(1.0, |before| self.product(&before.unknowns, &rate) + square * before.load);
        let scale = turn.signum() / length;
        PathDirection { unknowns: rate.iter().map(|x| x * scale).collect(), load: scale }
    }

    /// Mean product of the scaled coordinates of two directions.
    fn product(&self, a: &[f64], b: &[f64]) -> f64 {
        let mut sum = (0.0, 0);
        for ((a, b), unknown) in a.iter().zip(b).zip(self.system.unknowns()) {
            if let Some(scale) = self.scales.of_unknown(unknown) {
                sum = (sum.0 + (a / scale) * (b / scale), sum.1 + 1);
            }
        }
        sum.0 / f64::from(sum.1.max(1))
    }

    /// Adds `factor` times a direction to the unknowns.
    fn add(&self, direction: &[f64], factor: f64, state: &mut State<f64>) {
        for (unknown, x) in self.system.unknowns().iter().zip(direction) {
            match *unknown {
                Unknown::Coordinate(i) => state.q[i] += factor * x,
                Unknown::Multiplier(m) => state.l[m] += factor * x,
            }
        }
    }

    /// Corrects `state` in the plane normal to `tangent`, or at the load fraction `load` if there is none.
    ///
    /// Returns the load fraction and the number of corrections.
    fn correct(
        &mut self,
        state: &mut State<f64>,
        load: f64,
        tangent: Option<&PathDirection>,
        length: f64,
    ) -> Result<(f64, usize)> {
        let (mut at, mut previous) = (load, f64::INFINITY);
        for count in 1..=MOST_CORRECTIONS {
            self.factorize(state)?;
            self.rows.iter_mut().zip(&self.start).for_each(|(row, start)| row[0] -= (1.0 - at) * start);
            let mut residual = std::mem::take(&mut self.rows);
            self.system.factor().solve(&mut residual);
            let mut change: Vec<f64> = residual.iter().map(|row| -row[0]).collect();
            self.rows = residual;
            if let Some(tangent) = tangent {
                // The correction stays in the plane: no component along the tangent.
                let rate = self.rate();
                let along = self.product(&tangent.unknowns, &rate) + self.weight * self.weight * tangent.load;
                let shift = -self.product(&tangent.unknowns, &change) / along;
                change.iter_mut().zip(&rate).for_each(|(x, r)| *x += shift * r);
                at += shift;
            }
            self.add(&change, 1.0, state);
            let largest = self.scales.largest(self.system.unknowns(), &change);
            if largest <= ON_THE_WAY {
                return Ok((at, count));
            }
            if !(largest < 20.0 * length.max(1e-6)) || (count > 3 && largest > 2.0 * previous) {
                break;
            }
            previous = largest;
        }
        Err(Error::analysis("load path", "does not converge", "use a shorter step"))
    }
}

/// The largest sum of the magnitudes of the forces of all elements on a coordinate.
pub(crate) fn largest_force(mechanism: &Mechanism<f64>, state: &State<f64>) -> f64 {
    let mut sums = vec![0.0; state.q.len()];
    let mut workspace = ElementWorkspace::default();
    for instance in mechanism.elements.iter().filter(|instance| !instance.element.is_sensor()) {
        evaluate(instance, state, &mut workspace);
        instance.coordinates.iter().zip(&workspace.dynamics).for_each(|(&i, force)| sums[i] += force.abs());
    }
    sums.into_iter().fold(0.0, f64::max)
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
