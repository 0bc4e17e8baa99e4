//! Modes of rigid contacts and dry friction after an event and at the start of a motion.
//!
//! A contact or friction is released if its force is not admissible: all parts at rest are held first, and the part that violates its
//! limit most is released, until no limit is violated. A part that was released must then move in the direction in which it was
//! released. Friction at rest sticks, as a constraint, only if its constraint is independent of those before it: joints, drives, closed
//! contacts, and other friction. It rests otherwise (see `unilateral`).
//! If several friction elements prevent the same motion, the force of the one that reaches its static limit first becomes its Coulomb force,
//! and the others carry the remaining load. If a released part moves in the opposite direction, the modes are those of a complementarity
//! problem. During an impact at another contact, closed contacts are joints as well. The one with the largest tensile impulse is opened, until
//! no impulse is tensile.

use crate::constraint_rank::ConstraintRank;
use crate::events::condition::ZERO;
use crate::events::consistent_modes::{
    ModeSearch, RestingParts, find, largest, returns, slide_where_driven, without_forces,
};
use crate::events::impact::{apply_impact, apply_switch, event_offset, gap_rounding, make_consistent};
use crate::events::repeated_impacts::dying_out;
use crate::events::sticking_friction::{EXCESS, hold, is_friction, sliding_gradients};
use crate::events::unilateral::{AT_REST, TOUCHING, sign, sliding};
use crate::initial_conditions::{AccelerationSolver, Assembly, Projection, assemble, make_velocities_consistent};
use crate::integrators::consistent_ends;
use crate::mechanism::{EventElement, Mechanism, Unilateral};
use crate::system::System;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

/// Modes during and after an event.
pub(crate) struct ModeTransition {
    /// True if the rigid contact of the event stays closed.
    pub stays: bool,
    /// Modes during the jump of the velocities: friction does not stick, because its force is bounded and has no impulse.
    pub jump: Modes,
    /// Modes after the event.
    pub after: Modes,
}

/// Time of flight after an impact below which a contact stays closed, in nominal steps.
///
/// The flights between the impacts of a ball become shorter by a constant factor: infinitely many of them end at a finite time. A flight
/// whose height is a rounding error of the gap is the last one as well.
pub(crate) const SHORTEST_FLIGHT: f64 = 1e-6;

/// Sliding velocity, as a fraction of the largest velocity, that counts as zero.
const STOPPED: f64 = 1e-12;

/// Finds the modes in which the motion continues after an event in the state `end`. `step` is the nominal length of the steps in s.
///
/// * `contact`: the event that ends the step; `at_event`: this event and those at the same time.
///
/// # Errors
///
/// [`Error::Analysis`] naming the parts without consistent modes.
pub(crate) fn find_transition(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    (contact, at_event): (usize, &[usize]),
    end: &State<f64>,
    step: f64,
) -> Result<ModeTransition> {
    let is_impact = mechanism.events[contact].is_open_contact(&end.modes);
    let mut after = end.modes.clone();
    after.apply(mechanism, at_event);
    // Joints that an event of the same time releases transmit the impulse of an impact: it may be the cause of the event.
    let mut jump = end.modes.clone();
    if mechanism.events.iter().all(|event| event.unilateral.is_none()) {
        return Ok(ModeTransition { stays: false, jump, after });
    }
    for law in mechanism.events.iter().filter_map(|event| event.unilateral) {
        if let (Unilateral::Friction { sticking, .. }, true) = (law, law.is_held(&jump)) {
            jump.set(sticking, false);
        }
    }
    let mut before = end.clone();
    AccelerationSolver::default().solve(system, mechanism, &mut before)?;
    let search = TransitionSearch { mechanism, contact, at_event, before: &before, step };
    if is_impact {
        let landing = State { modes: jump.clone(), ..before.clone() };
        let closing = dying_out(system, mechanism, (contact, SHORTEST_FLIGHT * step), &landing);
        if !closing.is_empty() {
            for law in closing.iter().filter_map(|&k| mechanism.events[k].unilateral) {
                [&mut jump, &mut after].into_iter().for_each(|modes| law.close(modes));
            }
            mechanism.events[contact].unilateral.iter().for_each(|law| law.close(&mut after));
            return search.with_closed_contact(system, [jump, after]);
        }
    }
    let (state, rebound) = search.continue_in(system, false, [jump.clone(), after.clone()])?;
    if is_impact {
        let event = &mechanism.events[contact];
        let stays = event.restitution == Some(0.0) || !is_leaving(event, &state, step);
        if let Some(law) = event.unilateral.filter(|_| stays) {
            law.close(&mut after);
            return search.with_closed_contact(system, [jump, after]);
        }
    }
    Ok(ModeTransition { stays: false, jump: rebound, after: state.modes })
}

/// The state with accelerations and multipliers in which the motion continues after the events `at_event`. One of them, `contact`, ends
/// the step in the state `end`. Forces that jump at the event are evaluated after it, for steps of the length `nominal` (s).
pub(crate) fn state_after(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    (contact, at_event): (usize, &[usize]),
    transition: ModeTransition,
    end: &State<f64>,
    nominal: f64,
) -> Result<State<f64>> {
    let mut state = State { modes: transition.jump, ..end.clone() };
    match mechanism.events[contact].is_open_contact(&end.modes) {
        true => apply_impact(system, mechanism, (contact, transition.stays), &mut state)?,
        false => make_consistent(system, mechanism, &mut state)?,
    };
    state.modes = transition.after;
    let offset = event_offset(mechanism, at_event, &state, nominal);
    apply_switch(system, mechanism, offset, &mut state)?;
    Ok(state)
}

/// All events at the time of the event `contact` and the `simultaneous` ones, which ends a step in the state `end`, in the order in which they
/// change the mechanism: these in the order of their numbers, and then those whose conditions become true because the motion jumps. Velocities jump
/// at an impact, forces and accelerations at a switch. Events that these cause in turn are included.
///
/// # Errors
///
/// As [`find_transition`].
pub(crate) fn events_at_once(
    system: &System,
    mechanism: &Mechanism<f64>,
    (contact, simultaneous): (usize, &[usize]),
    end: &State<f64>,
    step: f64,
) -> Result<Vec<usize>> {
    let mut at_event = [simultaneous, &[contact]].concat();
    at_event.sort_unstable();
    let is_pending =
        |k: &usize| mechanism.events[*k].when.is_some() && !end.modes.has_happened(*k) && !at_event.contains(k);
    let pending: Vec<usize> = (0..mechanism.events.len()).filter(is_pending).collect();
    if pending.is_empty() {
        return Ok(at_event);
    }
    let mut system = system.clone();
    let before = consistent_ends::at_event(&mut system, mechanism, end);
    loop {
        let transition = find_transition(&mut system, mechanism, (contact, &at_event), end, step)?;
        let after = state_after(&mut system, mechanism, (contact, &at_event), transition, end, 0.0)?;
        let happens = |k: &usize| {
            let event = &mechanism.events[*k];
            !at_event.contains(k) && event.gap(&before) >= 0.0 && event.gap(&after) < -ZERO
        };
        let new: Vec<usize> = pending.iter().copied().filter(happens).collect();
        if new.is_empty() {
            return Ok(at_event);
        }
        at_event.extend(&new);
    }
}

/// Search for the modes after an event.
struct TransitionSearch<'a> {
    mechanism: &'a Mechanism<f64>,
    /// The event that ends the step.
    contact: usize,
    /// This event and those at the same time.
    at_event: &'a [usize],
    /// The state at the end of the step, with its accelerations and multipliers.
    before: &'a State<f64>,
    /// Nominal length of the steps in s.
    step: f64,
}

impl TransitionSearch<'_> {
    fn is_impact(&self) -> bool {
        self.mechanism.events[self.contact].is_open_contact(&self.before.modes)
    }

    /// The transition after which the rigid contact of the event is closed, from the modes during the jump and after it before any part is
    /// released.
    fn with_closed_contact(&self, system: &mut System, modes: [Modes; 2]) -> Result<ModeTransition> {
        let (state, jump) = self.continue_in(system, true, modes)?;
        Ok(ModeTransition { stays: true, jump, after: state.modes })
    }

    /// The state after the event with its modes, accelerations and multipliers, and the modes during the jump.
    ///
    /// `modes`: those during the jump and after it, before any part is released. A rigid contact that `stays` closed has no restitution, and is
    /// a joint as long as its force is compressive.
    fn continue_in(&self, system: &mut System, stays: bool, modes: [Modes; 2]) -> Result<(State<f64>, Modes)> {
        let (mut state, [jump, after]) = self.jump(system, stays, modes)?;
        state.modes = after;
        let broken = self.release(system, &mut state);
        resolve_modes(system, self.mechanism, &mut state, broken)?;
        Ok((state, jump))
    }

    /// The state with the velocities after the event, and the modes during the jump and after it, in which contacts with a tensile impulse are
    /// open.
    fn jump(
        &self,
        system: &mut System,
        stays: bool,
        [mut jump, mut after]: [Modes; 2],
    ) -> Result<(State<f64>, [Modes; 2])> {
        let (mechanism, impact) = (self.mechanism, (self.contact, stays));
        let before_jump = |modes: &Modes| State { modes: modes.clone(), ..self.before.clone() };
        let mut state = before_jump(&jump);
        if !self.is_impact() {
            make_consistent(system, mechanism, &mut state)?;
            return Ok((state, [jump, after]));
        }
        while let Some((event, law)) = pulling_contact(system, mechanism, impact, &mut state)? {
            let mut opened = before_jump(&jump);
            law.open(&mut opened.modes);
            apply_impact(system, mechanism, impact, &mut opened)?;
            opened.modes = after.clone();
            law.open(&mut opened.modes);
            AccelerationSolver::default().solve(system, mechanism, &mut opened)?;
            if !is_leaving(event, &opened, self.step) {
                break; // rebounds would never end
            }
            [&mut jump, &mut after].into_iter().for_each(|modes| law.open(modes));
            state = before_jump(&jump);
        }
        Ok((state, [jump, after]))
    }

    /// Releases the parts that reach their limit at the event, in the `state` with the velocities after it, and sets the modes of friction by
    /// these velocities. Returns the released parts with the directions of their forces.
    fn release(&self, system: &System, state: &mut State<f64>) -> Vec<(usize, f64)> {
        let mechanism = self.mechanism;
        let unreleased = state.clone();
        let [mut frictions, contacts] = self.parts_at_limit(state);
        if !frictions.is_empty() {
            let error = velocity_error(mechanism, self.before);
            close_touching(mechanism, state, error, |k| {
                self.at_event.contains(&k)
                    || frictions.iter().any(|&released| opens_with(mechanism, &unreleased, k, released))
            });
        }
        release_together(system, mechanism, state, &self.resting_friction(state), &mut frictions);
        let starts = |k: usize| self.at_event.contains(&k) && mechanism.events[k].is_resting(&self.before.modes);
        let errors = self.sliding_errors(state);
        follow_velocities(mechanism, self.before, (state, &errors), starts);
        frictions.extend(contacts);
        frictions
    }

    /// The friction and the contacts that reach their limit at the event, with the directions of their forces. The contacts are opened.
    fn parts_at_limit(&self, state: &mut State<f64>) -> [Vec<(usize, f64)>; 2] {
        let (mut frictions, mut contacts) = (Vec::new(), Vec::new());
        for &k in self.at_event {
            let event = &self.mechanism.events[k];
            match event.unilateral.filter(|_| k != self.contact || !self.is_impact()) {
                Some(law @ Unilateral::Contact { .. }) => {
                    law.open(&mut state.modes);
                    contacts.push((k, 1.0));
                }
                Some(Unilateral::Friction { multiplier, .. }) if event.is_held(&state.modes) => {
                    frictions.push((k, sign(state.l[multiplier])));
                }
                _ => {}
            }
        }
        [frictions, contacts]
    }

    /// Friction that rests with its Coulomb force before and after the event, with the directions of these forces.
    fn resting_friction(&self, state: &State<f64>) -> Vec<(usize, f64)> {
        let resting = |k: usize| {
            let law = self.mechanism.events[k].unilateral?;
            let is_resting = law.is_resting(&self.before.modes) && !law.has_ended(&state.modes);
            let direction = law.direction(&self.before.modes).filter(|_| is_resting && !self.at_event.contains(&k))?;
            Some((k, direction))
        };
        (0..self.mechanism.events.len()).filter_map(resting).collect()
    }

    /// Numerical errors of the sliding velocities in `state`, by event.
    ///
    /// The velocity of friction that has stuck is an error of the steps, unless an impact has changed it. That of friction which stops at this
    /// event is an error of the time of the event.
    fn sliding_errors(&self, state: &State<f64>) -> Vec<f64> {
        let is_impact = self.is_impact();
        let errors = if is_impact { &self.before.v } else { &state.v };
        let error = |(k, event): (usize, &EventElement<f64>)| {
            let Some(law @ Unilateral::Friction { .. }) = event.unilateral else { return 0.0 };
            let stops = !is_impact && self.at_event.contains(&k) && event.is_sliding(&self.before.modes);
            if stops || law.is_held(&self.before.modes) { sliding(event, errors) } else { 0.0 }
        };
        self.mechanism.events.iter().enumerate().map(error).collect()
    }
}

/// Returns whether a contact that moves as in `state` separates: its flight is neither shorter than [`SHORTEST_FLIGHT`] nor lower than the
/// rounding error of its gap.
fn is_leaving(event: &EventElement<f64>, state: &State<f64>, step: f64) -> bool {
    let jet = event.gap_jet(state, &state.v);
    let (flight, height) = (2.0 * jet.v1 / -jet.v2, jet.v1 * jet.v1 / (-2.0 * jet.v2));
    let is_last = flight <= SHORTEST_FLIGHT * step || height <= gap_rounding(event, state, 0.0);
    jet.v1 > TOUCHING && !(jet.v2 < 0.0 && is_last)
}

/// Largest velocity (m/s or rad/s) of friction that sticks in `state`: the error of velocities that are zero.
fn velocity_error(mechanism: &Mechanism<f64>, state: &State<f64>) -> f64 {
    let stuck = mechanism.events.iter().filter(|event| event.is_held(&state.modes) && event.restitution.is_none());
    let frictions = stuck.filter(|event| event.unilateral.is_some());
    frictions.map(|event| sliding(event, &state.v).abs()).fold(0.0, f64::max)
}

/// Returns whether the gap of a contact opens where friction that is `released` slides in its direction.
fn opens_with(
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    contact: usize,
    (friction, direction): (usize, f64),
) -> bool {
    let (contact, still) = (&mechanism.events[contact], vec![0.0; state.v.len()]);
    let [a, b] = [0, 1].map(|end| mechanism.events[friction].gap.coordinates[end]);
    let mut along = still.clone();
    (along[a], along[b]) = (-direction, direction);
    contact.rate(state, &along) > contact.rate(state, &still)
}

/// Closes the contacts that touch at rest, because the forces after the event may be compressive. Those for which `stay` is true keep
/// their mode. `error` is that of velocities (m/s or rad/s).
fn close_touching(mechanism: &Mechanism<f64>, state: &mut State<f64>, error: f64, stay: impl Fn(usize) -> bool) {
    for event in (0..mechanism.events.len()).filter(|k| !stay(*k)).map(|k| &mechanism.events[k]) {
        if let Some(Unilateral::Contact { closed, .. }) = event.unilateral {
            let jet = event.gap_jet(state, &state.v);
            if jet.re.abs() <= TOUCHING && jet.v1.abs() <= TOUCHING.max(2.0 * error) {
                state.modes.set(closed, true);
            }
        }
    }
}

/// Applies the impact at a contact to the velocities of `state`. Returns the closed contact with the largest tensile impulse, if
/// there is one: a contact transmits compression only, so it has to open.
fn pulling_contact<'m>(
    system: &mut System,
    mechanism: &'m Mechanism<f64>,
    impact: (usize, bool),
    state: &mut State<f64>,
) -> Result<Option<(&'m EventElement<f64>, Unilateral)>> {
    let impulses = apply_impact(system, mechanism, impact, state)?;
    let largest = impulses.joints.iter().fold(impulses.contact.abs(), |a, x| a.max(x.abs()));
    let pull = mechanism.events.iter().filter_map(|event| match event.unilateral? {
        law @ Unilateral::Contact { multiplier, closed, .. } if state.modes.is_on(closed) => {
            Some((event, law, impulses.joints[multiplier]))
        }
        _ => None,
    });
    let worst = pull.filter(|(.., pull)| *pull > EXCESS * largest).max_by(|a, b| a.2.total_cmp(&b.2));
    Ok(worst.map(|(event, law, _)| (event, law)))
}

/// Sets the modes of dry friction by the velocities of `state`. Friction sticks where the sliding velocity is zero compared with the
/// largest velocity in `state` and `before` the event, unless it `starts` to slide. Friction that an event has deactivated keeps no mode.
/// `errors` are the numerical errors of the sliding velocities, by event.
fn follow_velocities(
    mechanism: &Mechanism<f64>,
    before: &State<f64>,
    (state, errors): (&mut State<f64>, &[f64]),
    starts: impl Fn(usize) -> bool,
) {
    let largest = before.v.iter().chain(&state.v).fold(0.0f64, |a, v| a.max(v.abs()));
    for (k, event) in mechanism.events.iter().enumerate() {
        let Some(law @ Unilateral::Friction { .. }) = event.unilateral else { continue };
        if law.has_ended(&state.modes) {
            continue;
        }
        let velocity = sliding(event, &state.v) - errors[k];
        let is_moving = starts(k) || velocity.abs() > AT_REST.max(STOPPED * largest);
        law.slide(&mut state.modes, is_moving.then(|| sign(velocity)));
    }
}

/// Finds the modes of the parts at rest, and solves for accelerations and multipliers.
///
/// `broken`: the events of the parts that have reached their limit, with the directions of their forces. Those that are held are
/// released one after the other; if that leads to no consistent modes, they are [found](find) by complementarity.
fn resolve_modes(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    broken: Vec<(usize, f64)>,
) -> Result<()> {
    let mut trial = state.clone();
    let friction: Vec<(usize, f64)> = broken.iter().filter(|(k, _)| is_friction(mechanism, *k)).copied().collect();
    let outcome = release_one_by_one(system, mechanism, &mut trial, friction);
    let returning = match &outcome {
        Ok(released) => released.iter().find(|&&part| returns((mechanism, largest(&trial)), &trial, part)),
        Err(_) => None,
    };
    if outcome.is_ok() && returning.is_none() {
        *state = trial;
        return Ok(());
    }
    let at_rest = |k: &usize| mechanism.events[*k].is_held(&state.modes) || broken.iter().any(|(other, _)| other == k);
    let all: Vec<usize> = (0..mechanism.events.len()).filter(at_rest).collect();
    let tried = match find(system, mechanism, state, RestingParts { all: &all, broken: &broken }) {
        ModeSearch::Found(found) => {
            *state = *found;
            return Ok(());
        }
        ModeSearch::Inconsistent(states) => Some(states),
        ModeSearch::Unknown => None,
    };
    let Some(&(k, _)) = returning.filter(|part| !broken.contains(part)) else {
        outcome?;
        *state = trial;
        AccelerationSolver::default().solve(system, mechanism, state)?;
        return Ok(());
    };
    let name = &mechanism.events[k].gap.name;
    let why = match tried {
        Some(states) => format!(
            "at t = {} it can neither be held nor released: none of the {states} states of contact and friction is consistent \
             (Painlevé's paradox: friction depends on the reactions that it causes)",
            Seconds(state.t)
        ),
        None => format!("no consistent state of contact and friction has been found at t = {}", Seconds(state.t)),
    };
    let remedy = "reduce the friction, or model the contact with stiffness and damping (a wall contact, a bump stop)";
    Err(Error::analysis(name, why, remedy))
}

/// Releases parts that are held, the one that exceeds its limit most first, until no force exceeds its limit, and solves for accelerations and
/// multipliers. Returns the parts that are released or that drives slide, without friction that rests.
///
/// `released`: the events of friction that breaks away, with its directions; it is at rest.
fn release_one_by_one(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    mut released: Vec<(usize, f64)>,
) -> Result<Vec<(usize, f64)>> {
    let is_at_rest = |k: &usize| mechanism.events[*k].is_held(&state.modes);
    let parts: Vec<usize> = (0..mechanism.events.len()).filter(is_at_rest).collect();
    let (mut sliding, mut free_size) = (Vec::new(), None);
    let at_rest = |k: &usize| is_friction(mechanism, *k) && mechanism.events[*k].is_held(&state.modes);
    let mut at_rest: Vec<usize> = (0..mechanism.events.len()).filter(at_rest).collect();
    loop {
        hold(system, mechanism, state, (&at_rest, &released));
        AccelerationSolver::default().solve(system, mechanism, state)?;
        let force = state.l.iter().fold(0.0f64, |a, l| a.max(l.abs()));
        let held = mechanism.events.iter().enumerate().filter_map(|(k, event)| Some((k, event, event.unilateral?)));
        let held = held.filter(|(.., law)| law.is_held(&state.modes));
        let excesses = held.map(|(k, event, law)| (k, law, law.excess(event, state, force)));
        let worst = excesses.filter(|(.., excess)| *excess > EXCESS).max_by(|a, b| a.2.total_cmp(&b.2));
        if let Some((k, law, _)) = worst {
            law.open(&mut state.modes);
            let force = if let Unilateral::Friction { multiplier, .. } = law { state.l[multiplier] } else { 1.0 };
            released.push((k, sign(force)));
            continue;
        }
        if !mechanism.events.iter().any(|event| event.is_resting(&state.modes)) {
            break;
        }
        let free = || without_forces(system, mechanism, state, &parts).map_or(f64::INFINITY, |free| largest(&free));
        let size = *free_size.get_or_insert_with(free);
        let driven = slide_where_driven(mechanism, size.max(largest(state)), state);
        if driven.is_empty() {
            break;
        }
        let is_driven = |k: usize| driven.iter().any(|(other, _)| *other == k);
        at_rest.retain(|k| !is_driven(*k));
        released.retain(|(k, _)| !is_driven(*k));
        sliding.extend(driven);
    }
    sliding.extend(released);
    sliding.retain(|part| !mechanism.events[part.0].is_resting(&state.modes));
    Ok(sliding)
}

fn is_contact(law: Unilateral) -> bool {
    matches!(law, Unilateral::Contact { .. })
}

/// Adds friction that rests with its Coulomb force to the `released` friction if they slide together: the motion of a
/// released one slides it in the direction of that force, while the friction that sticks holds.
fn release_together(
    system: &System,
    mechanism: &Mechanism<f64>,
    state: &State<f64>,
    resting: &[(usize, f64)],
    released: &mut Vec<(usize, f64)>,
) {
    if resting.is_empty() || released.is_empty() {
        return;
    }
    let (mut rank, mut gradients) = sliding_gradients(system, mechanism, state);
    let is_stuck = |k: &usize| {
        is_friction(mechanism, *k)
            && mechanism.events[*k].is_held(&state.modes)
            && !released.iter().any(|(other, _)| other == k)
    };
    for k in (0..mechanism.events.len()).filter(is_stuck) {
        rank.add(k, gradients[k].clone());
    }
    gradients.iter_mut().filter(|row| !row.is_empty()).for_each(|row| rank.project(row));
    let alike = |&(j, to): &(usize, f64), &(k, direction): &(usize, f64)| {
        gradients[j].iter().zip(&gradients[k]).map(|(a, b)| a * b).sum::<f64>() * to * direction > 0.0
    };
    let together: Vec<_> = resting.iter().filter(|j| released.iter().any(|k| alike(j, k))).copied().collect();
    released.extend(together);
}

/// Sets the modes at the start of a motion in `state`, with consistent velocities: contacts that touch are closed if their force is
/// compressive, and dry friction at rest sticks. Returns whether contacts are closed.
///
/// # Errors
///
/// As [`find_transition`].
pub(crate) fn set_initial_modes(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
) -> Result<bool> {
    if mechanism.events.iter().all(|event| event.unilateral.is_none()) {
        return Ok(false);
    }
    let is_closed = |law: Unilateral, modes: &Modes| is_contact(law) && law.is_held(modes);
    close_touching(mechanism, state, 0.0, |_| false);
    follow_velocities(mechanism, &state.clone(), (state, &vec![0.0; mechanism.events.len()]), |_| false);
    let mut resolved = state.clone();
    // If more contacts touch than can carry independent forces, the forces of least norm decide.
    let is_touching =
        mechanism.events.iter().filter_map(|event| event.unilateral).any(|law| is_closed(law, &state.modes));
    let is_dependent = is_touching
        && !system.allows_redundancy()
        && !ConstraintRank::of(system, mechanism, &resolved).redundant.is_empty();
    if is_dependent {
        system.allow_redundancy(true);
    }
    let outcome = resolve_modes(system, mechanism, &mut resolved, Vec::new());
    if is_dependent {
        system.allow_redundancy(false); // `assemble_closed` allows it again if contacts stay closed
    }
    outcome?;
    state.modes = resolved.modes;
    Ok(mechanism.events.iter().filter_map(|event| event.unilateral).any(|law| is_closed(law, &state.modes)))
}

/// Assembles the mechanism again, with contacts that begin closed as joints: they are closed in neighbouring designs as well.
///
/// # Errors
///
/// As [`assemble`] and [`make_velocities_consistent`].
pub(crate) fn assemble_closed(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    settings: Assembly,
) -> Result<Projection> {
    *state = State { modes: state.modes.clone(), ..State::built(mechanism, state.t) };
    let mut projection = assemble(system, mechanism, state, settings)?;
    projection.velocity = make_velocities_consistent(system, mechanism, state)?;
    Ok(projection)
}
