//! Rejection of jumps of prescribed positions, which no finite force can cause, and of jumps of prescribed velocities along explicit
//! and adaptive steps, which do not have their impulses.

use crate::events::impact::{Jump, joint_rows};
use crate::mechanism::Mechanism;
use crate::mechanism::scalars::StateScalar;
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

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
    for i in moving(mechanism) {
        let Some((t, jump)) = velocity_jump(motion_of(mechanism, i), ends) else { continue };
        if jump.abs() <= BEGINNING * soon_after(motion_of(mechanism, i), ends) {
            continue;
        }
        if moves_others(system, mechanism, &state(), (i, jump)) {
            let (lost, scheme) = match kind {
                StepKind::Explicit => ("explicit steps have none", "an implicit scheme with fixed steps"),
                StepKind::Adaptive => {
                    ("adaptive steps lose a part of it", "fixed steps (`step` in place of `tolerance`)")
                }
            };
            let why = format!(
                "its prescribed velocity jumps by {jump:.3e} m/s or rad/s at t = {t}, which takes an impulse: {lost}",
                t = Seconds(t)
            );
            let remedy = format!("use {scheme}, or a motion with a continuous velocity, such as a smooth ramp");
            return Err(Error::unsupported(&mechanism.coordinates[i].name, why, remedy));
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
    for i in moving(mechanism) {
        let Some((t, jump)) = position_jump(motion_of(mechanism, i), ends) else { continue };
        if moves_others(system, mechanism, &state(), (i, jump)) {
            let why = format!(
                "its prescribed position jumps by {jump:.3e} m or rad at t = {t}: no finite force does that",
                t = Seconds(t)
            );
            let remedy = "use a motion with a continuous position, such as a ramp over a short time";
            return Err(Error::unsupported(&mechanism.coordinates[i].name, why, remedy));
        }
    }
    Ok(())
}

/// The coordinates with a prescribed motion.
fn moving(mechanism: &Mechanism<f64>) -> impl Iterator<Item = usize> + use<'_> {
    let is_moving = |i: &usize| mechanism.coordinates[*i].motion.as_ref().is_some_and(|(motion, _)| !motion.is_fixed());
    (0..mechanism.coordinates.len()).filter(is_moving)
}

/// The largest velocity (m/s or rad/s) within a step after the one with these `ends` (s).
fn soon_after(at: impl Fn(f64) -> [f64; 2], [begin, end]: [f64; 2]) -> f64 {
    [1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.1, 1.0]
        .iter()
        .fold(0.0, |largest: f64, part| largest.max(at(end + part * (end - begin))[1].abs()))
}

/// Position and velocity of the prescribed coordinate number `i` at a time.
fn motion_of(mechanism: &Mechanism<f64>, i: usize) -> impl Fn(f64) -> [f64; 2] + use<'_> {
    move |t| {
        let coordinate = &mechanism.coordinates[i];
        let (motion, parameters) = coordinate.motion.as_ref().expect("it is prescribed");
        let [q, v, _] = f64::motion(motion.as_ref(), parameters, t);
        [q, v]
    }
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

/// Returns whether a jump of the velocity of coordinate number `i` violates constraints, or changes the momentum of free coordinates.
fn moves_others(system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, (i, by): (usize, f64)) -> bool {
    let rows = |by: f64| {
        let mut rows = vec![0.0; system.size()];
        let mut jump = Jump::none(state);
        jump.velocity[i] = by;
        joint_rows(system, mechanism, state, &jump, &mut rows);
        rows
    };
    rows(by).iter().zip(rows(0.0)).any(|(with, without)| (with - without).abs() > ROUNDING * by.abs())
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
