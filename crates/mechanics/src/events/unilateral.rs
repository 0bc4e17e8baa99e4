//! Rigid contacts that last and dry friction that sticks: parts whose modes follow from the motion.
//!
//! A rigid contact is open, with a gap Φ > 0, or closed: a joint Φ = 0 with the contact force −λ ≥ 0. Dry friction slides in one of
//! two directions, or it sticks: a joint with a force of at most the static limit. The mode changes where the gap, the
//! contact force, the sliding velocity or the margin of the static limit becomes zero. This is an event: the step ends there, and the
//! derivatives include that of its time. Between events the motion is that of a mechanism with joints.
//!
//! The modes after an event are found by the rule that a joint lets go if its force is not admissible: all parts at rest
//! are held first, and the part that violates its limit most is released, until no limit is violated. A part that was released must then
//! move in the direction in which it was released. During an impact at another place, closed contacts are joints as well, and the one
//! whose impulse pulls most lets go, until no impulse pulls.
//!
//! # Sources
//!
//! Pfeiffer & Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), Chapters 5 and 8; Leine & Nijmeijer, *Dynamics and
//! Bifurcations of Non-Smooth Mechanical Systems* (2004), Chapter 5.

use crate::events::impact::{apply_impact, gap_rounding, make_consistent};
use crate::events::modes::Modes;
use crate::initial_conditions::{AccelerationSolver, Assembly, Projection, assemble, make_velocities_consistent};
use crate::integrators::settings::StepSize;
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{ElementIndex, EventElement, Mechanism};
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};
use autodiff::Scalar;

/// A part whose mode follows from the motion, by numbers of switches and multipliers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unilateral {
    /// A rigid contact; `closed` is the switch of the joint that holds it closed.
    Contact { joint: usize, multiplier: usize, closed: usize },
    /// Dry friction with the multiplier of its force and the switches of its three modes.
    Friction { joint: usize, multiplier: usize, forward: usize, backward: usize, sticking: usize },
}

/// Parameters of dry friction in the order of its event.
pub(crate) const STATIC_LIMIT: usize = 0;

impl Unilateral {
    /// The function whose zero ends the mode, positive before it; `None` for an open contact, which ends by its gap.
    pub fn value<T: StateScalar>(&self, event: &EventElement<T>, state: &State<T>) -> Option<T> {
        match *self {
            Self::Contact { multiplier, closed, .. } => {
                state.modes.is_on(closed).then(|| T::from(0.0) - state.l[multiplier])
            }
            Self::Friction { multiplier, .. } => Some(match self.direction(&state.modes) {
                Some(direction) => sliding(event, &state.v) * direction,
                None => event.gap.parameters[STATIC_LIMIT] - state.l[multiplier] * sign(state.l[multiplier].value()),
            }),
        }
    }

    /// Rate of this function, if velocities and accelerations determine it, or else zero.
    pub fn rate<T: StateScalar>(&self, event: &EventElement<T>, state: &State<T>) -> Option<T> {
        match *self {
            Self::Contact { closed, .. } => state.modes.is_on(closed).then(|| T::from(0.0)),
            Self::Friction { .. } => {
                let direction = self.direction(&state.modes);
                Some(direction.map_or(T::from(0.0), |direction| sliding(event, &state.a) * direction))
            }
        }
    }

    /// Size of the numbers whose difference this function is, for their rounding.
    pub fn size(&self, event: &EventElement<f64>, state: &State<f64>) -> f64 {
        let largest = |x: &[f64]| event.gap.coordinates.iter().map(|&i| x[i].abs()).fold(0.0, f64::max);
        match *self {
            Self::Contact { multiplier, closed, .. } if state.modes.is_on(closed) => state.l[multiplier].abs(),
            Self::Contact { .. } => largest(&state.q),
            Self::Friction { .. } if self.direction(&state.modes).is_some() => largest(&state.v),
            Self::Friction { .. } => event.gap.parameters[STATIC_LIMIT],
        }
    }

    /// Direction in which friction slides; `None` if it sticks, and for a contact.
    fn direction(&self, modes: &Modes) -> Option<f64> {
        let Self::Friction { forward, backward, .. } = *self else { return None };
        match (modes.is_on(forward), modes.is_on(backward)) {
            (true, _) => Some(1.0),
            (_, true) => Some(-1.0),
            _ => None,
        }
    }

    /// Lets friction slide in a `direction`, or stick.
    fn slide(&self, modes: &mut Modes, direction: Option<f64>) {
        if let Self::Friction { forward, backward, sticking, .. } = *self {
            modes.set(forward, direction.is_some_and(|direction| direction > 0.0));
            modes.set(backward, direction.is_some_and(|direction| direction < 0.0));
            modes.set(sticking, direction.is_none());
        }
    }

    /// Returns whether the part is held: a closed contact, or friction that sticks.
    fn is_held(&self, modes: &Modes) -> bool {
        match *self {
            Self::Contact { closed, .. } => modes.is_on(closed),
            Self::Friction { sticking, .. } => modes.is_on(sticking),
        }
    }

    /// Excess of the force of a part that is held over its limit, as a fraction of the limit or of the `largest` multiplier.
    fn excess(&self, event: &EventElement<f64>, state: &State<f64>, largest: f64) -> f64 {
        match *self {
            Self::Contact { multiplier, .. } => state.l[multiplier] / largest.max(f64::MIN_POSITIVE),
            Self::Friction { multiplier, .. } => {
                let limit = event.gap.parameters[STATIC_LIMIT];
                (state.l[multiplier].abs() - limit) / limit.max(f64::MIN_POSITIVE)
            }
        }
    }

    /// Opens a contact.
    fn open(&self, modes: &mut Modes) {
        if let Self::Contact { closed, .. } = *self {
            modes.set(closed, false);
        }
    }

    /// Releases a part that is held, friction in the direction of the load. Returns that direction, 1 for a contact.
    fn release(&self, state: &mut State<f64>) -> f64 {
        match *self {
            Self::Contact { .. } => {
                self.open(&mut state.modes);
                1.0
            }
            Self::Friction { multiplier, .. } => {
                let direction = sign(state.l[multiplier]);
                self.slide(&mut state.modes, Some(direction));
                direction
            }
        }
    }
}

/// Sliding value of friction: the difference of the values `x` of its two coordinates.
fn sliding<T: StateScalar>(event: &EventElement<T>, x: &[T]) -> T {
    x[event.gap.coordinates[1]] - x[event.gap.coordinates[0]]
}

fn sign(x: f64) -> f64 {
    if x < 0.0 { -1.0 } else { 1.0 }
}

impl<S> EventElement<S> {
    /// Returns whether it is a rigid contact that is open in these modes, and ends a step by an impact.
    pub(crate) fn is_open_contact(&self, modes: &Modes) -> bool {
        self.restitution.is_some() && !self.is_held(modes)
    }

    /// Returns whether it is held: a closed contact, or friction that sticks.
    pub(crate) fn is_held(&self, modes: &Modes) -> bool {
        self.unilateral.is_some_and(|law| law.is_held(modes))
    }

    /// Returns whether it is friction that slides.
    pub(crate) fn is_sliding(&self, modes: &Modes) -> bool {
        self.unilateral.is_some_and(|law| law.direction(modes).is_some())
    }

    /// Returns whether it is free and at rest, in the step after its release or with a function of no more than zero.
    ///
    /// Its function then is zero but for rounding, and says nothing about the direction of the motion.
    pub(crate) fn is_unilateral_at_rest(&self, modes: &Modes, value: f64, has_begun: bool) -> bool {
        self.unilateral.is_some() && !self.is_held(modes) && (has_begun || value <= 0.0)
    }
}

impl EventElement<f64> {
    /// The function of the event at the end of an implicit step, with the forces of held parts of its positions and velocities;
    /// not a number if there are none.
    pub(crate) fn value_after_step(&self, mechanism: &Mechanism<f64>, state: &State<f64>, start: f64) -> f64 {
        if !self.is_held(&state.modes) {
            return self.gap(state);
        }
        let mut state = state.clone();
        let solved = System::at(mechanism, start)
            .and_then(|mut system| AccelerationSolver::default().solve(&mut system, mechanism, &mut state));
        solved.map_or(f64::NAN, |()| self.gap(&state))
    }
}

impl<S: Scalar> Mechanism<S> {
    /// Modes of a rigid contact that the `joint` holds closed.
    pub(crate) fn closed_contact(&mut self, ElementIndex(joint): ElementIndex) -> Unilateral {
        let multiplier = self.elements[joint].first_multiplier;
        Unilateral::Contact { joint, multiplier, closed: self.add_switch(joint, false) }
    }

    /// Adds a switch of an element, which begins on or off.
    pub(crate) fn add_switch(&mut self, element: usize, is_on: bool) -> usize {
        self.switches.push(is_on);
        self.elements[element].switch = Some(self.switches.len() - 1);
        self.switches.len() - 1
    }

    /// Returns whether the modes of an element follow from the motion.
    pub(crate) fn is_unilateral(&self, element: ElementIndex) -> bool {
        let is_joint = |law: Unilateral| match law {
            Unilateral::Contact { joint, .. } | Unilateral::Friction { joint, .. } => joint == element.0,
        };
        self.events.iter().filter_map(|event| event.unilateral).any(is_joint)
    }
}

/// Modes during and after an event.
pub(crate) struct Passage {
    /// True if the rigid contact of the event stays closed.
    pub stays: bool,
    /// Modes during the jump of the velocities: friction does not stick, as its force has no impulse.
    pub jump: Modes,
    /// Modes after the event.
    pub after: Modes,
}

/// Time of flight after an impact below which a contact stays closed, in nominal steps.
///
/// The flights between the impacts of a ball become shorter by a constant factor: infinitely many of them end at a finite time. A flight
/// whose height is a rounding error of the gap is the last one as well.
pub(crate) const SHORTEST_FLIGHT: f64 = 1e-6;

/// Sliding velocity, as a fraction of the largest velocity, that is zero but for rounding.
const STOPPED: f64 = 1e-12;

/// Largest excess of a force that is rounding.
const EXCESS: f64 = 1e-9;

/// Finds the modes in which the motion goes on from an event in the state `end`, by steps of the size `step`.
///
/// * `contact`: the event that ends the step; `at_event`: this event and those at the same time.
///
/// # Errors
///
/// [`Error::Analysis`] naming the parts without consistent modes.
pub(crate) fn passage(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    (contact, at_event): (usize, &[usize]),
    end: &State<f64>,
    step: StepSize,
) -> Result<Passage> {
    let is_impact = mechanism.events[contact].is_open_contact(&end.modes);
    let mut after = end.modes.clone();
    after.apply(mechanism, at_event);
    let mut jump = if is_impact { after.clone() } else { end.modes.clone() };
    if mechanism.events.iter().all(|event| event.unilateral.is_none()) {
        return Ok(Passage { stays: false, jump, after });
    }
    for law in mechanism.events.iter().filter_map(|event| event.unilateral) {
        if let (Unilateral::Friction { sticking, .. }, true) = (law, law.is_held(&jump)) {
            jump.set(sticking, false);
        }
    }
    let mut held = end.clone();
    AccelerationSolver::default().solve(system, mechanism, &mut held)?;
    let events = (contact, at_event);
    let (state, rebound) = after_event(system, mechanism, (events, false), &held, [jump.clone(), after.clone()])?;
    if is_impact {
        let event = &mechanism.events[contact];
        let jet = event.gap_jet(&state, &state.v);
        let (flight, height) = (2.0 * jet.v1 / -jet.v2, jet.v1 * jet.v1 / (-2.0 * jet.v2));
        let is_last = flight <= SHORTEST_FLIGHT * step.nominal() || height <= gap_rounding(event, &state, 0.0);
        let stays = event.restitution == Some(0.0) || jet.v1 <= TOUCHING || (jet.v2 < 0.0 && is_last);
        if let Some(Unilateral::Contact { closed, .. }) = event.unilateral.filter(|_| stays) {
            after.set(closed, true);
            let (state, jump) = after_event(system, mechanism, (events, true), &held, [jump, after])?;
            return Ok(Passage { stays: true, jump, after: state.modes });
        }
    }
    Ok(Passage { stays: false, jump: rebound, after: state.modes })
}

/// The state with accelerations and multipliers after an event in the state `held`, with its modes, and the modes during the jump.
///
/// `jump` and `after` are the modes before anything lets go. A rigid contact that `stays` closed has no restitution, and is held as long
/// as it is pressed together.
fn after_event(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    ((contact, at_event), stays): ((usize, &[usize]), bool),
    held: &State<f64>,
    [mut jump, mut after]: [Modes; 2],
) -> Result<(State<f64>, Modes)> {
    let is_impact = mechanism.events[contact].is_open_contact(&held.modes);
    let mut state = State { modes: jump.clone(), ..held.clone() };
    if is_impact {
        while let Some((event, law)) = pulling_contact(system, mechanism, (contact, stays), &mut state)? {
            let mut opened = State { modes: jump.clone(), ..held.clone() };
            law.open(&mut opened.modes);
            apply_impact(system, mechanism, (contact, stays), &mut opened)?;
            if event.gap_jet(&opened, &opened.v).v1 <= TOUCHING {
                break; // rebounds would never end
            }
            [&mut jump, &mut after].into_iter().for_each(|modes| law.open(modes));
            state = State { modes: jump.clone(), ..held.clone() };
        }
    } else {
        make_consistent(system, mechanism, &mut state)?;
    }
    state.modes = after;
    for &k in at_event {
        let Some(law) = mechanism.events[k].unilateral.filter(|_| k != contact || !is_impact) else { continue };
        match law.is_held(&state.modes) {
            true => drop(law.release(&mut state)),
            false => law.slide(&mut state.modes, None),
        }
    }
    if is_impact {
        follow_velocities(mechanism, held, &mut state);
    }
    settle(system, mechanism, &mut state, &mut Vec::new())?;
    Ok((state, jump))
}

/// Applies the impact at a contact to the velocities of `state`. Returns the closed contact whose impulse pulls most, if there is one:
/// a contact can only push, so it has to let go.
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

/// Sets the modes of dry friction to the velocities of `state`: where they are zero, compared with those `before` an event, it sticks,
/// unless its limit is exceeded.
fn follow_velocities(mechanism: &Mechanism<f64>, before: &State<f64>, state: &mut State<f64>) {
    let largest = before.v.iter().chain(&state.v).fold(0.0f64, |a, v| a.max(v.abs()));
    for event in &mechanism.events {
        let Some(law @ Unilateral::Friction { .. }) = event.unilateral else { continue };
        let velocity = sliding(event, &state.v);
        let is_moving = velocity.abs() > STOPPED * largest;
        law.slide(&mut state.modes, is_moving.then(|| sign(velocity)));
    }
}

/// Releases parts that are held until no force exceeds its limit, and solves for accelerations and multipliers.
///
/// `released` receives the events of these parts with their directions.
fn settle(
    system: &mut System,
    mechanism: &Mechanism<f64>,
    state: &mut State<f64>,
    released: &mut Vec<(usize, f64)>,
) -> Result<()> {
    loop {
        AccelerationSolver::default().solve(system, mechanism, state)?;
        let largest = state.l.iter().fold(0.0f64, |a, l| a.max(l.abs()));
        let held = mechanism.events.iter().enumerate().filter_map(|(k, event)| Some((k, event, event.unilateral?)));
        let held = held.filter(|(.., law)| law.is_held(&state.modes));
        let excesses = held.map(|(k, event, law)| (k, law, law.excess(event, state, largest)));
        let worst = excesses.filter(|(.., excess)| *excess > EXCESS).max_by(|a, b| a.2.total_cmp(&b.2));
        let Some((k, law, _)) = worst else { break };
        let direction = law.release(state);
        released.push((k, direction));
    }
    let size = state.a.iter().fold(0.0f64, |a, x| a.max(x.abs()));
    let returns = |&&(k, direction): &&(usize, f64)| {
        let event = &mechanism.events[k];
        let acceleration = match event.unilateral {
            Some(Unilateral::Contact { .. }) => event.gap_jet(state, &state.v).v2,
            _ => direction * sliding(event, &state.a),
        };
        acceleration < -EXCESS * size
    };
    released.iter().find(returns).map_or(Ok(()), |&(k, _)| {
        let name = &mechanism.events[k].gap.name;
        let why = format!(
            "at t = {:.6e} s it can neither be held nor let go: no state of contact and friction is consistent",
            state.t
        );
        let remedy =
            "reduce the friction, or model the contact with stiffness and damping (a wall contact, a bump stop)";
        Err(Error::analysis(name, why, remedy))
    })
}

/// Gap in m or rad, and rate of it, up to which a rigid contact begins closed.
pub(crate) const TOUCHING: f64 = 1e-9;

/// Sets the modes at the start of a motion in `state`, with consistent velocities: contacts that touch are closed if they are pressed
/// together, and dry friction at rest sticks. Returns whether contacts are closed.
///
/// # Errors
///
/// As [`passage`].
pub(crate) fn settle_start(system: &mut System, mechanism: &Mechanism<f64>, state: &mut State<f64>) -> Result<bool> {
    if mechanism.events.iter().all(|event| event.unilateral.is_none()) {
        return Ok(false);
    }
    let is_closed = |law: Unilateral, modes: &Modes| matches!(law, Unilateral::Contact { .. }) && law.is_held(modes);
    for event in &mechanism.events {
        if let Some(Unilateral::Contact { closed, .. }) = event.unilateral {
            let jet = event.gap_jet(state, &state.v);
            state.modes.set(closed, jet.re.abs() <= TOUCHING && jet.v1.abs() <= TOUCHING);
        }
    }
    follow_velocities(mechanism, &state.clone(), state);
    let mut settled = state.clone();
    settle(system, mechanism, &mut settled, &mut Vec::new())?;
    state.modes = settled.modes;
    Ok(mechanism.events.iter().filter_map(|event| event.unilateral).any(|law| is_closed(law, &state.modes)))
}

/// Checks that the mechanism has no dry friction, for an `analysis` of a state at rest: there, the force of friction that sticks is not
/// determined.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the friction.
pub(crate) fn refuse_friction<T>(mechanism: &Mechanism<T>, analysis: &str) -> Result<()> {
    let friction = mechanism.events.iter().find(|event| matches!(event.unilateral, Some(Unilateral::Friction { .. })));
    friction.map_or(Ok(()), |friction| {
        let why = format!("it may stick, and {analysis} does not determine how much friction carries");
        Err(Error::unsupported(
            &friction.gap.name,
            why,
            "simulate over time from the built positions, or remove the friction",
        ))
    })
}

/// Assembles the mechanism again, with contacts that begin closed as joints: in designs around, they are closed as well.
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
