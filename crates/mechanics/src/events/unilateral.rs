//! Rigid contacts that last and dry friction that sticks: parts whose modes follow from the motion.
//!
//! A rigid contact is open, with a gap Φ > 0, or closed: a joint Φ = 0 with the contact force −λ ≥ 0. Dry friction slides in one of
//! two directions, or it sticks: a joint with a force of at most the static limit. The mode changes where the gap, the
//! contact force, the sliding velocity or the margin of the static limit becomes zero. This is an event: the step ends there, and the
//! derivatives include that of its time. Between events the motion is that of a mechanism with joints.
//!
//! Where drives, closed contacts or other friction prevent sliding as well, the force of friction at rest is not determined. Such friction
//! *rests*: it has no constraint, and no force, or its Coulomb force if it has broken away and others still prevent sliding.
//!
//! `mode_transition` finds the modes after an event.
//!
//! # Sources
//!
//! Pfeiffer & Glocker, *Multibody Dynamics with Unilateral Contacts* (1996), Chapters 5 and 8; Leine & Nijmeijer, *Dynamics and
//! Bifurcations of Non-Smooth Mechanical Systems* (2004), Chapter 5.

use crate::events::impact::{TIME_ROUNDING, make_consistent};
use crate::initial_conditions::AccelerationSolver;
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{ElementIndex, EventCondition, EventElement, Mechanism, Unilateral};
use crate::system::System;
use crate::system::modes::Modes;
use crate::system::state::State;
use crate::{Error, Result};
use autodiff::Scalar;
use error::Seconds;

/// Gap in m or rad, and its rate in m/s or rad/s, up to which a rigid contact begins closed.
pub(crate) const TOUCHING: f64 = 1e-9;

/// Sliding velocity in m/s or rad/s up to which friction is at rest at an event.
pub(crate) const AT_REST: f64 = 1e-9;

/// Parameters of dry friction in the order of its event.
pub(crate) const STATIC_LIMIT: usize = 0;

impl Unilateral {
    /// The function whose zero ends the mode, positive before it; `None` for an open contact, for which it is the gap.
    pub fn value<T: StateScalar>(&self, event: &EventElement<T>, state: &State<T>) -> Option<T> {
        match *self {
            Self::Contact { multiplier, closed, .. } => {
                state.modes.is_on(closed).then(|| T::from(0.0) - state.l[multiplier])
            }
            Self::Friction { .. } if self.is_resting(&state.modes) => {
                let velocity = sliding(event, &state.v);
                Some(-(velocity * sign(velocity.value())) + AT_REST)
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
            Self::Friction { .. } if self.is_resting(&state.modes) => {
                Some(sliding(event, &state.a) * -sign(sliding(event, &state.v).value()))
            }
            Self::Friction { .. } => {
                let direction = self.direction(&state.modes);
                Some(direction.map_or(T::from(0.0), |direction| sliding(event, &state.a) * direction))
            }
        }
    }

    /// Size of the terms whose difference this function is, from which its rounding error follows. A driven position has the rounding error of
    /// the time, too.
    pub fn size(&self, event: &EventElement<f64>, state: &State<f64>) -> f64 {
        let largest = |x: &[f64]| event.gap.coordinates.iter().map(|&i| x[i].abs()).fold(0.0, f64::max);
        match *self {
            Self::Contact { multiplier, closed, .. } if state.modes.is_on(closed) => state.l[multiplier].abs(),
            Self::Contact { .. } => largest(&state.q).max(largest(&state.v) * state.t.abs()),
            Self::Friction { sticking, .. } if !state.modes.is_on(sticking) => largest(&state.v),
            Self::Friction { .. } => event.gap.parameters[STATIC_LIMIT],
        }
    }

    /// Direction in which friction slides, or in which it would slide while it rests with its Coulomb force; `None` otherwise, and for a
    /// contact.
    pub fn direction(&self, modes: &Modes) -> Option<f64> {
        let Self::Friction { forward, backward, .. } = *self else { return None };
        match (modes.is_on(forward), modes.is_on(backward)) {
            (true, _) => Some(1.0),
            (_, true) => Some(-1.0),
            _ => None,
        }
    }

    /// Lets friction slide in a `direction`, or stick.
    pub fn slide(&self, modes: &mut Modes, direction: Option<f64>) {
        self.set_friction(modes, direction, [direction.is_none(), false]);
    }

    /// Lets friction rest, with its Coulomb force in a `direction` or without force.
    pub fn rest(&self, modes: &mut Modes, direction: Option<f64>) {
        self.set_friction(modes, direction, [false, true]);
    }

    fn set_friction(&self, modes: &mut Modes, direction: Option<f64>, [sticks, rests]: [bool; 2]) {
        if let Self::Friction { forward, backward, sticking, resting, .. } = *self {
            modes.set(forward, direction.is_some_and(|direction| direction > 0.0));
            modes.set(backward, direction.is_some_and(|direction| direction < 0.0));
            modes.set(sticking, sticks);
            modes.set(resting, rests);
        }
    }

    /// The modes of the part, by the numbers of their switches.
    pub fn modes(&self) -> Vec<usize> {
        match *self {
            Self::Contact { closed, .. } => vec![closed],
            Self::Friction { forward, backward, sticking, resting, .. } => vec![forward, backward, sticking, resting],
        }
    }

    /// Returns whether an event has deactivated friction: it is in none of its modes, and has no force.
    pub fn has_ended(&self, modes: &Modes) -> bool {
        matches!(self, Self::Friction { .. }) && self.modes().into_iter().all(|mode| !modes.is_on(mode))
    }

    /// Returns whether friction rests: something else prevents sliding.
    pub fn is_resting(&self, modes: &Modes) -> bool {
        matches!(*self, Self::Friction { resting, .. } if modes.is_on(resting))
    }

    /// Returns whether the part is held: a closed contact, or friction that sticks.
    pub fn is_held(&self, modes: &Modes) -> bool {
        match *self {
            Self::Contact { closed, .. } => modes.is_on(closed),
            Self::Friction { sticking, .. } => modes.is_on(sticking),
        }
    }

    /// Excess of the force of a part that is held over its limit, as a fraction of the limit or of the `largest` multiplier.
    pub fn excess(&self, event: &EventElement<f64>, state: &State<f64>, largest: f64) -> f64 {
        match *self {
            Self::Contact { multiplier, .. } => state.l[multiplier] / largest.max(f64::MIN_POSITIVE),
            Self::Friction { multiplier, .. } => {
                let limit = event.gap.parameters[STATIC_LIMIT];
                (state.l[multiplier].abs() - limit) / limit.max(f64::MIN_POSITIVE)
            }
        }
    }

    /// Closes a contact.
    pub fn close(&self, modes: &mut Modes) {
        if let Self::Contact { closed, .. } = *self {
            modes.set(closed, true);
        }
    }

    /// Opens a contact.
    pub fn open(&self, modes: &mut Modes) {
        if let Self::Contact { closed, .. } = *self {
            modes.set(closed, false);
        }
    }
}

/// Difference of the values `x` of the two coordinates of friction: the sliding displacement, velocity or acceleration.
pub(crate) fn sliding<T: StateScalar>(event: &EventElement<T>, x: &[T]) -> T {
    x[event.gap.coordinates[1]] - x[event.gap.coordinates[0]]
}

pub(crate) fn sign(x: f64) -> f64 {
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

    /// Returns whether its function depends on forces or accelerations: of a part that is held, or in a condition.
    pub(crate) fn needs_forces(&self, modes: &Modes) -> bool {
        self.is_held(modes) || self.when.as_ref().is_some_and(|when| when.uses_forces())
    }

    /// Returns whether it is friction that slides.
    pub(crate) fn is_sliding(&self, modes: &Modes) -> bool {
        self.unilateral.is_some_and(|law| law.direction(modes).is_some() && !law.is_resting(modes))
    }

    /// Returns whether it is friction that rests.
    pub(crate) fn is_resting(&self, modes: &Modes) -> bool {
        self.unilateral.is_some_and(|law| law.is_resting(modes))
    }

    /// Returns whether it is free and at rest: it was released at the beginning of the step, or its function is at most
    /// zero.
    ///
    /// Its function is then zero except for rounding, and does not determine the direction of the motion.
    pub(crate) fn is_unilateral_at_rest(&self, modes: &Modes, value: f64, has_begun: bool) -> bool {
        self.unilateral.is_some() && !self.is_held(modes) && !self.is_resting(modes) && (has_begun || value <= 0.0)
    }
}

impl EventElement<f64> {
    /// The function of the event at the end of an implicit step, with the forces and accelerations of its positions
    /// and velocities; NaN if these cannot be computed.
    ///
    /// `system` is that of this or another design, and `start` the start of the motion in s.
    pub(crate) fn value_after_step(
        &self,
        (system, start): (&System, f64),
        mechanism: &Mechanism<f64>,
        state: &State<f64>,
    ) -> f64 {
        let is_projected = mechanism.has_consistent_velocities();
        if !self.needs_forces(&state.modes) && !is_projected {
            return self.gap(state);
        }
        let mut state = state.clone();
        let solved = system.of_design(mechanism, start).and_then(|mut system| {
            if is_projected {
                make_consistent(&mut system, mechanism, &mut state)?;
            }
            AccelerationSolver::default().solve(&mut system, mechanism, &mut state)
        });
        solved.map_or(f64::NAN, |()| self.gap(&state))
    }

    /// Checks that the time of an event follows from its condition, which has the value `gap` in `state` at this time.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if the condition jumps over its limit, as where a load jumps.
    pub(crate) fn check_crossing(&self, gap: f64, state: &State<f64>) -> Result<()> {
        let rounding = AT_JUMP[1].max(TIME_ROUNDING * state.t.abs());
        let jumps = |when: &EventCondition<f64>| gap.abs() > (AT_JUMP[0] * when.size(state)).max(rounding);
        if !self.when.as_ref().is_some_and(jumps) {
            return Ok(());
        }
        let why = format!(
            "a load jumps at t = {}, and its value with it: the time of the event does not follow from its condition, and there is no derivative",
            Seconds(state.t)
        );
        Err(Error::analysis(&self.gap.name, why, "smooth the load (smooth_step), or switch it by an event"))
    }
}

/// Value of a condition at its event, relative to its largest term and absolute, above which it jumps there.
const AT_JUMP: [f64; 2] = [1e-4, 1e-9];

impl<S> Mechanism<S> {
    /// Returns whether the velocities at events of implicit steps are made consistent with the constraints, which those
    /// of the steps satisfy only up to an error. Dry friction needs this, because other parts that stick may hold it at
    /// rest. Conditions that use velocities, accelerations or forces need it, because their rates would have an error of
    /// the order of the step.
    pub(crate) fn has_consistent_velocities(&self) -> bool {
        let is_friction = |event: &EventElement<S>| matches!(event.unilateral, Some(Unilateral::Friction { .. }));
        let uses_velocities = |event: &EventElement<S>| event.when.as_ref().is_some_and(|when| when.uses_velocities());
        self.events.iter().any(|event| is_friction(event) || uses_velocities(event))
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

    /// Adds a switch that activates no element.
    pub(crate) fn add_mode(&mut self) -> usize {
        self.switches.push(false);
        self.switches.len() - 1
    }

    /// The modes of an element, if they follow from the motion.
    pub(crate) fn unilateral(&self, element: ElementIndex) -> Option<Unilateral> {
        let is_joint = |law: &Unilateral| match *law {
            Unilateral::Contact { joint, .. } | Unilateral::Friction { joint, .. } => joint == element.0,
        };
        self.events.iter().filter_map(|event| event.unilateral).find(is_joint)
    }

    /// Returns whether an element is dry friction that sticks.
    pub(crate) fn is_dry_friction(&self, element: ElementIndex) -> bool {
        matches!(self.unilateral(element), Some(Unilateral::Friction { .. }))
    }
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
