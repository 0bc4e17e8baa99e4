//! Rejection of jumps of prescribed positions, which no finite force can cause, and of jumps of prescribed velocities along explicit
//! and adaptive steps, which do not have their impulses, and along any steps with dry friction and rigid contacts, which have limits. A motion is prescribed of a coordinate, or by a drive between two bodies.

use crate::constraint_rank::ConstraintRank;
use crate::elements::element::ElementWorkspace;
use crate::events::impact::{Jump, factorize_jump, joint_rows};
use crate::mechanism::element::Family;
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::scalars::{ElementScalar, Jet2};
use crate::mechanism::{ElementInstance, Mechanism};
use crate::system::state::State;
use crate::system::{System, Unknown};
use crate::{Error, Result};
use error::Seconds;
use std::cell::LazyCell;

/// Number of halvings of a step in the search for a jump.
const HALVINGS: usize = 24;

/// Error of the trapezoidal rule or of the cubic, as a fraction of the velocities, below which the velocity counts as smooth.
const SMOOTH: f64 = 1e-6;

/// Smallest jump as a fraction of the velocities. A smooth change that takes more than about 6e-5 of the step is smaller in the interval
/// that is left after [`HALVINGS`] halvings.
const LEAST: f64 = 1e-3;

/// Rounding error of a mean velocity, as a fraction of the change of the velocity, up to which differences of positions have enough digits.
const ROUNDED: f64 = 1e-2;

/// Largest effect of a jump on the equations, per unit of the jump, that counts as rounding.
const ROUNDING: f64 = 1e-12;

/// Jump of a velocity, as a fraction of the velocity one step later, up to which it is ignored: the step ends where a smooth motion has
/// just begun, and all its velocities are rounding errors.
const BEGINNING: f64 = 1e-6;

/// Fraction of a change of position over a step that must remain in the smallest interval if it is a jump.
const KEPT: f64 = 1e-3;

/// Change of a position over a step, in units of the largest of three velocities times the length, below which nothing jumps.
const CONTINUOUS: f64 = 4.0;

/// Steps that do not have the impulse of a velocity that jumps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StepKind {
    /// Explicit steps: they have no impulses.
    Explicit,
    /// Adaptive implicit steps: they have the impulse within a step of constant length, and lose a part of it when the length changes.
    Adaptive,
    /// Fixed implicit steps with friction or rigid contacts: the impulse is a force that grows with shorter steps, at which they stick.
    Limited,
}

impl StepKind {
    /// The kind of implicit steps, adaptive or fixed; `None` if they have all impulses.
    pub fn of_implicit(mechanism: &Mechanism<f64>, is_adaptive: bool) -> Option<Self> {
        match is_adaptive {
            true => Some(Self::Adaptive),
            false => has_limits(mechanism).then_some(Self::Limited),
        }
    }
}

/// Returns whether a mechanism has dry friction, friction from reactions, or rigid contacts.
fn has_limits(mechanism: &Mechanism<f64>) -> bool {
    mechanism.has_reactions_as_loads() || mechanism.events.iter().any(|event| event.unilateral.is_some())
}

/// Checks that no prescribed velocity jumps between the `ends` of a step (s), the last one with this `state`, in such a way that free
/// coordinates would jump with it.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the coordinate, the time and the jump.
pub(crate) fn refuse_velocity_jumps(
    system: &System,
    mechanism: &Mechanism<f64>,
    ends: [f64; 2],
    kind: StepKind,
    state: impl Fn() -> State<f64>,
) -> Result<()> {
    let end = LazyCell::new(state);
    for drive in PrescribedMotion::all(mechanism) {
        let motion = |t: f64| drive.at(mechanism, &end, t);
        let Some((t, jump)) = velocity_jump(motion, ends) else { continue };
        if jump.abs() <= BEGINNING * soon_after(motion, ends) {
            continue;
        }
        if drive.takes_impulse(system, mechanism, &end, jump) {
            let (lost, other) = match kind {
                StepKind::Explicit => ("explicit steps have none", "an implicit scheme with fixed steps, or "),
                StepKind::Adaptive => {
                    ("adaptive steps lose a part of it", "fixed steps (`step` in place of `tolerance`), or ")
                }
                StepKind::Limited => ("friction and rigid contacts have impulses at impacts only", ""),
            };
            let other = if has_limits(mechanism) { "" } else { other };
            let why = format!(
                "its prescribed velocity jumps by {jump:.3e} m/s or rad/s at t = {t}, which takes an impulse: {lost}",
                t = Seconds(t)
            );
            let remedy = format!("use {other}a motion with a continuous velocity, such as a smooth ramp");
            return Err(Error::unsupported(drive.name(mechanism), why, remedy));
        }
    }
    Ok(())
}

/// Checks that no prescribed position that moves other coordinates jumps between the `ends` (s) of a step; `state` returns the state at
/// the last one.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the coordinate, the time and the jump.
pub(crate) fn refuse_position_jumps(
    system: &System,
    mechanism: &Mechanism<f64>,
    ends: [f64; 2],
    state: impl Fn() -> State<f64>,
) -> Result<()> {
    let end = LazyCell::new(state);
    for drive in PrescribedMotion::all(mechanism) {
        let Some((t, jump)) = position_jump(|t| drive.at(mechanism, &end, t), ends) else { continue };
        if drive.moves_others(system, mechanism, &end, jump) {
            let why = format!(
                "its prescribed position jumps by {jump:.3e} m or rad at t = {t}: no finite force does that",
                t = Seconds(t)
            );
            let remedy = "use a motion with a continuous position, such as a ramp over a short time";
            return Err(Error::unsupported(drive.name(mechanism), why, remedy));
        }
    }
    Ok(())
}

/// A motion that is a function of time.
#[derive(Clone, Copy)]
enum PrescribedMotion<'m> {
    /// Of a coordinate.
    Coordinate(usize),
    /// Of a drive, an element with one constraint that depends on time.
    Drive(&'m ElementInstance<f64>),
}

impl<'m> PrescribedMotion<'m> {
    /// All motions of a mechanism that are not at rest.
    fn all(mechanism: &'m Mechanism<f64>) -> impl Iterator<Item = Self> {
        let is_moving =
            |i: &usize| mechanism.coordinates[*i].motion.as_ref().is_some_and(|(motion, _)| !motion.is_fixed());
        let is_drive = |instance: &&ElementInstance<f64>| {
            instance.num_constraints == 1
                && instance.element.descriptor().is_some_and(|descriptor| descriptor.family == Family::Drive)
        };
        let coordinates = (0..mechanism.coordinates.len()).filter(is_moving).map(Self::Coordinate);
        coordinates.chain(mechanism.elements.iter().filter(is_drive).map(Self::Drive))
    }

    fn name(self, mechanism: &'m Mechanism<f64>) -> &'m str {
        match self {
            Self::Coordinate(i) => &mechanism.coordinates[i].name,
            Self::Drive(instance) => &instance.name,
        }
    }

    /// Position and velocity at the time `t` (s). Those of a drive are minus its constraint and its rate with the positions of `end`.
    fn at(
        self,
        mechanism: &Mechanism<f64>,
        end: &LazyCell<State<f64>, impl FnOnce() -> State<f64>>,
        t: f64,
    ) -> [f64; 2] {
        match self {
            Self::Coordinate(i) => {
                let (motion, parameters) = mechanism.coordinates[i].motion.as_ref().expect("it is prescribed");
                let [q, v, _] = f64::motion(motion.as_ref(), parameters, t);
                [q, v]
            }
            Self::Drive(instance) => {
                let constant = |x: f64| Jet2::new(x, 0.0, 0.0);
                let count = instance.coordinates.len();
                let mut workspace = ElementWorkspace::<Jet2<f64>> {
                    p: instance.parameters.iter().map(|&p| constant(p)).collect(),
                    q: instance.coordinates.iter().map(|&i| constant(end.q[i])).collect(),
                    v: vec![constant(0.0); count],
                    a: vec![constant(0.0); count],
                    l: vec![constant(0.0)],
                    ..ElementWorkspace::default()
                };
                Jet2::<f64>::residual(instance.element.as_ref(), Jet2::new(t, 1.0, 0.0), &mut workspace);
                let constraint = workspace.constraint[0];
                [-constraint.re, -constraint.v1]
            }
        }
    }

    /// Returns whether a jump `by` of the position or the velocity violates constraints, or changes the momentum of free coordinates.
    fn moves_others(self, system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, by: f64) -> bool {
        let i = match self {
            Self::Coordinate(i) => i,
            Self::Drive(instance) => return state.modes.is_active(instance),
        };
        let rows = |by: f64| {
            let mut rows = vec![0.0; system.size()];
            let mut jump = Jump::none(state);
            jump.velocity[i] = by;
            joint_rows(system, mechanism, state, &jump, &mut rows);
            rows
        };
        rows(by).iter().zip(rows(0.0)).any(|(with, without)| (with - without).abs() > ROUNDING * by.abs())
    }

    /// Returns whether a jump of the velocity `by` takes an impulse that changes velocities other than those that the constraints determine.
    ///
    /// The velocities of bodies that a drive moves follow from its constraint, in steps of any kind.
    fn takes_impulse(self, system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, by: f64) -> bool {
        let Self::Drive(instance) = self else { return self.moves_others(system, mechanism, state, by) };
        let mut system = system.clone();
        if !state.modes.is_active(instance) || factorize_jump(&mut system, mechanism, state).is_err() {
            return false;
        }
        let is_of_drive = |unknown: &Unknown| *unknown == Unknown::Multiplier(instance.first_multiplier);
        let mut change: Vec<[f64; 1]> =
            system.unknowns().iter().map(|unknown| [if is_of_drive(unknown) { by } else { 0.0 }]).collect();
        system.factor().solve(&mut change);
        let rank = ConstraintRank::of(&system, mechanism, state);
        let is_determined = |i: usize| {
            let mut row = vec![0.0; state.q.len()];
            row[i] = 1.0;
            rank.depends(row)
        };
        let changes = system.unknowns().iter().zip(&change);
        let coordinates = changes.filter_map(|(unknown, [change])| match unknown {
            Unknown::Coordinate(i) => Some((*i, change.abs())),
            Unknown::Multiplier(_) => None,
        });
        let coordinates: Vec<(usize, f64)> = coordinates.collect();
        let largest = coordinates.iter().fold(0.0, |largest: f64, (_, change)| largest.max(*change));
        coordinates.into_iter().any(|(i, change)| change > FOLLOWED * largest && !is_determined(i))
    }
}

/// Change of a velocity, as a fraction of the largest one, that counts as rounding.
const FOLLOWED: f64 = 1e-9;

/// The largest velocity (m/s or rad/s) within a step after the one with these `ends` (s).
fn soon_after(at: impl Fn(f64) -> [f64; 2], [begin, end]: [f64; 2]) -> f64 {
    [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0]
        .iter()
        .fold(0.0, |largest: f64, part| largest.max(at(end + part * (end - begin))[1].abs()))
}

/// Time in s of a jump of the position between the `ends` (s), and the jump: a change that remains in intervals of vanishing length.
fn position_jump(at: impl Fn(f64) -> [f64; 2], [mut begin, mut end]: [f64; 2]) -> Option<(f64, f64)> {
    let (mut first, mut last) = (at(begin), at(end));
    let (whole, inside) = ((last[0] - first[0]).abs(), at(0.5 * (begin + end)));
    let fastest = [first, inside, last].iter().fold(0.0f64, |a, [_, v]| a.max(v.abs()));
    if !(whole > CONTINUOUS * fastest * (end - begin) && whole > 1e3 * f64::EPSILON * first[0].abs().max(last[0].abs()))
    {
        return None;
    }
    loop {
        let middle = 0.5 * (begin + end);
        if !(begin < middle && middle < end) {
            break;
        }
        let inside = at(middle);
        match (inside[0] - first[0]).abs() >= (last[0] - inside[0]).abs() {
            true => (end, last) = (middle, inside),
            false => (begin, first) = (middle, inside),
        }
    }
    let jump = last[0] - first[0];
    (jump.abs() > KEPT * whole).then_some((end, jump))
}

/// Time in s of a jump of the velocity between the `ends` (s), and the jump, for the position and the velocity `at` a time.
///
/// The error of the trapezoidal rule, and of the cubic through the ends in the middle, is of second order in the length of an
/// interval, relative to it, where the velocity is smooth. Where it jumps, one of them is a fixed part of the jump. In intervals that are
/// too short for differences of positions, the half with the larger change of the velocity is taken.
fn velocity_jump(at: impl Fn(f64) -> [f64; 2], [mut begin, mut end]: [f64; 2]) -> Option<(f64, f64)> {
    let (mut first, mut last) = (at(begin), at(end));
    let error = |[q0, v0]: [f64; 2], [q, _]: [f64; 2], [q1, v1]: [f64; 2], h: f64| {
        let (rule, cubic) = ((q1 - q0) / h - 0.5 * (v0 + v1), (q - 0.5 * (q0 + q1)) / h - 0.125 * (v0 - v1));
        rule.abs().max(cubic.abs())
    };
    let mut size = 0.0f64;
    for _ in 0..HALVINGS {
        let (h, middle) = (end - begin, 0.5 * (begin + end));
        if !(begin < middle && middle < end) {
            break;
        }
        let inside = at(middle);
        size = [first, inside, last].iter().fold(size, |size, [_, v]| size.max(v.abs()));
        let rounding = f64::EPSILON * first[0].abs().max(last[0].abs()) / h;
        let has_digits = rounding <= ROUNDED * (last[1] - first[1]).abs().max(SMOOTH * size);
        if has_digits && error(first, inside, last, h) <= SMOOTH * size {
            return None;
        }
        let quarter = |begin: f64| at(begin + 0.25 * h);
        let [before, after] = match has_digits {
            true => [error(first, quarter(begin), inside, 0.5 * h), error(inside, quarter(middle), last, 0.5 * h)],
            false => [(inside[1] - first[1]).abs(), (last[1] - inside[1]).abs()],
        };
        match before >= after {
            true => (end, last) = (middle, inside),
            false => (begin, first) = (middle, inside),
        }
    }
    let jump = last[1] - first[1];
    (jump.abs() > LEAST * size).then_some((end, jump))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jumps_of_the_position_are_found_and_nothing_else() {
        let found = |f: &dyn Fn(f64) -> f64, ends: [f64; 2]| {
            let rate = |t: f64| (f(t + 1e-9) - f(t - 1e-9)) / 2e-9;
            position_jump(|t| [f(t), if (f(t + 1e-9) - f(t - 1e-9)).abs() > 1e-3 { 0.0 } else { rate(t) }], ends)
        };
        for place in [0.001, 0.25, 0.5, 0.505, 0.999] {
            let step = |t: f64| 0.2 * t + if t > place { 3.0 } else { 0.0 };
            let (t, jump) = found(&step, [0.0, 1.0]).unwrap();
            assert!((t - place).abs() < 1e-12 && (jump - 3.0).abs() < 1e-9, "{place}: {t} {jump}");
        }
        let ramp = |t: f64| 0.1 * ((t - 0.4) / 1e-6).clamp(0.0, 1.0);
        let steep = |t: f64| (1e7 * (t - 0.3)).tanh();
        for smooth in [&ramp as &dyn Fn(f64) -> f64, &steep, &|t| (30.0 * t).sin(), &|_| 5.0] {
            assert_eq!(found(smooth, [0.0, 1.0]), None);
        }
    }

    #[test]
    fn jumps_of_the_velocity_are_found_and_nothing_else() {
        let found = |f: &dyn Fn(f64) -> [f64; 2], ends: [f64; 2]| velocity_jump(f, ends);
        for kink in [0.0, 0.1, 0.25, 0.5, 0.505, 0.7, 0.999] {
            let ramp = |t: f64| if t <= kink { [0.3, 0.0] } else { [0.3 + 2.0 * (t - kink), 2.0] };
            let (t, jump) = found(&ramp, [0.0, 1.0]).unwrap();
            assert!((t - kink).abs() < 1e-6 && (jump - 2.0).abs() < 1e-9, "{kink}: {t} {jump}");
            for h in [1e-3, 1e-6, 1e-9, 1e-12] {
                let short = [kink - 0.3 * h, kink + 0.7 * h];
                assert!(found(&ramp, short).is_some_and(|(_, jump)| (jump - 2.0).abs() < 1e-9), "{kink} {h}");
            }
        }
        let sine = |t: f64| [(30.0 * t).sin(), 30.0 * (30.0 * t).cos()];
        let cubic = |t: f64| if t <= 0.4 { [1.0, 0.0] } else { [1.0 + (t - 0.4).powi(2), 2.0 * (t - 0.4)] };
        let steep = |t: f64| [(1e4 * (t - 0.3)).tanh(), 1e4 / (1e4 * (t - 0.3)).cosh().powi(2)];
        for smooth in [&sine as &dyn Fn(f64) -> [f64; 2], &cubic, &steep, &|_| [5.0, 0.0]] {
            assert_eq!(found(smooth, [0.0, 1.0]), None);
            for h in [0.14, 1e-3, 1e-6, 1e-9, 1e-12] {
                assert_eq!(found(smooth, [0.4 - 0.3 * h, 0.4 + 0.7 * h]), None, "{h}");
            }
        }
    }
}
