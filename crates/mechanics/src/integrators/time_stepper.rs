//! Implicit time stepping of a mechanism, with step control and events.

use crate::analyses::sampling::interpolate;
use crate::elements::spatial::bodies::normalization::normalized_frame;
use crate::events::impact::simultaneous_switches;
use crate::events::mode_transition::{assemble_closed, set_initial_modes};
use crate::events::unilateral::{TOUCHING, refuse_friction};
use crate::initial_conditions::{
    AccelerationSolver, Projection, assemble, equilibrium_reactions, make_velocities_consistent,
};
use crate::integrators::event_location::EventLocator;
use crate::integrators::generalized_alpha::Integrator;
use crate::integrators::inspection::{InspectionTimes, Inspector, breaks};
use crate::integrators::prescribed_jumps::{StepKind, refuse_position_jumps, refuse_velocity_jumps};
use crate::integrators::settings::{
    Dynamics, InitialAcceleration, InitialConfiguration, StepCount, StepSize, Work, is_before,
};
use crate::integrators::step_events::StepEvents;
use crate::mechanism::{ElementInstance, EventElement, Mechanism};
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

/// A simulation in progress, advanced step by step.
pub struct TimeStepper<'m> {
    /// Integrator with the current step.
    pub integrator: Integrator<'m>,
    /// Multipliers of the initial projections.
    pub projection: Projection,
    pub(crate) locator: EventLocator,
    /// True if the current step ends at a given time: of the grid of fixed steps, or an inspected one.
    has_given_end: bool,
    /// Events at the ends of the current step.
    pub(crate) events: StepEvents,
    /// True if several events have ended one of the steps.
    pub(crate) has_simultaneous_events: bool,
    inspections: InspectionTimes,
    inspector: Inspector,
    settings: Dynamics,
    /// The first steps, if they are given.
    given: Vec<GivenStep>,
    end: f64,
    count: StepCount,
    /// Length of the next trial step in s.
    pub(crate) next: f64,
    /// Length of the current step in s.
    pub(crate) length: f64,
    pub(crate) steps: usize,
    pub(crate) grid_steps: usize,
    pub(crate) failed_steps: usize,
}

/// Fraction of a grid step. After an event, a remainder of the step that is shorter is merged with the next grid step: accelerations at the end
/// of a short step have rounding errors divided by the square of its length.
const TINY: f64 = 1e-2;

/// Smallest trial step, as a fraction of the first one.
const SMALLEST: f64 = 1.0 / 1024.0;

/// Rotation in rad of a body in space in an implicit step, above which the velocities of its Euler parameters can grow without bound:
/// those along the parameters are not held to zero.
const LONGEST_TURN: f64 = 0.1;

/// A step of a simulation, to be taken in that of a neighbouring design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GivenStep {
    /// Length in s.
    length: f64,
    /// The event at its end, which determines the length.
    event: Option<usize>,
}

/// Lengths of the trial steps to the event at the end of a given step, in lengths of this step: the event may be later.
const TO_EVENT: [f64; 5] = [1.0, 1.1, 2.0, 8.0, 64.0];

impl<'m> TimeStepper<'m> {
    /// Assembles the mechanism at the start of the motion and makes its initial state consistent.
    ///
    /// # Errors
    ///
    /// Settings that [`Dynamics::check`] rejects; [`Error::Analysis`] if the mechanism cannot be assembled.
    pub fn new(mechanism: &'m Mechanism<f64>, settings: &Dynamics, times: &[f64]) -> Result<Self> {
        settings.check(times)?;
        let mut system = System::at(mechanism, settings.start)?;
        let mut state = State::built(mechanism, settings.start);
        let mut projection = assemble(&mut system, mechanism, &mut state, settings.assembly)?;
        if let InitialConfiguration::Equilibrium(statics) = &settings.initial_configuration {
            refuse_friction(mechanism, "a motion that starts in static equilibrium")?;
            let reactions = equilibrium_reactions(&mut system, mechanism, &mut state, statics);
            projection.position = reactions.map_err(|error| without_contacts(mechanism, error))?;
            check_overlaps(mechanism, &state)?;
        }
        projection.velocity = make_velocities_consistent(&mut system, mechanism, &mut state)?;
        if set_initial_modes(&mut system, mechanism, &mut state)? {
            let InitialConfiguration::Built = settings.initial_configuration else {
                return Err(closed_in_equilibrium(mechanism, &state));
            };
            projection = assemble_closed(&mut system, mechanism, &mut state, settings.assembly)?;
        }
        if settings.initial_acceleration == InitialAcceleration::Consistent {
            AccelerationSolver::default().solve(&mut system, mechanism, &mut state)?;
        }
        let (scheme, newton) = (settings.scheme, settings.newton);
        let integrator = Integrator::new(mechanism, system, scheme, settings.prescribed, newton, state);
        let next = match settings.step {
            StepSize::Fixed(h) => h,
            StepSize::Adaptive { first, longest, .. } => first.min(longest),
        };
        let end = times.last().copied().unwrap_or(settings.start);
        let locator = EventLocator::new(mechanism, &integrator.step.new, settings.step)?;
        let inspections = InspectionTimes::new(settings.start, end, times, &breaks(mechanism));
        let inspector = Inspector::new(&integrator);
        Ok(Self {
            integrator,
            projection,
            locator,
            has_given_end: false,
            events: StepEvents::default(),
            has_simultaneous_events: false,
            inspections,
            inspector,
            settings: *settings,
            given: Vec::new(),
            end,
            count: StepCount::new([settings.start, end], mechanism.may_end()),
            next,
            length: 0.0,
            steps: 0,
            grid_steps: 0,
            failed_steps: 0,
        })
    }

    /// The static equilibrium in which the motion starts, at rest and with its reactions; `None` if it starts as built. To be called before the
    /// first step.
    pub(crate) fn equilibrium_at_start(&self) -> Option<State<f64>> {
        let InitialConfiguration::Equilibrium(_) = self.settings.initial_configuration else { return None };
        let mut state = self.integrator.step.old.clone();
        state.l.copy_from_slice(&self.projection.position);
        state.v.fill(0.0);
        state.a.fill(0.0);
        Some(state)
    }

    /// Takes the given `steps` first, instead of those of the settings.
    pub(crate) fn with_given_steps(self, steps: &[GivenStep]) -> Self {
        Self { given: steps.to_vec(), ..self }
    }

    /// The current step, to be taken in another simulation.
    pub(crate) fn given_step(&self) -> GivenStep {
        GivenStep { length: self.length, event: self.locator.closed }
    }

    /// Takes steps until the current one ends at or after `t` (s).
    pub fn advance_to(&mut self, t: f64) -> Result<()> {
        while self.is_before(t) {
            self.advance()?;
        }
        Ok(())
    }

    /// Returns whether the current step ends at an event that ends the motion.
    pub fn has_ended(&self) -> bool {
        let Integrator { mechanism, system, step, .. } = &self.integrator;
        self.locator.has_ended(system, mechanism, &step.new, self.length)
    }

    /// The tolerance of the local error of positions in m or rad; `None` for fixed steps.
    pub fn tolerance(&self) -> Option<f64> {
        match self.settings.step {
            StepSize::Adaptive { tolerance, .. } => Some(tolerance),
            StepSize::Fixed(_) => None,
        }
    }

    /// Returns whether the motion continues and the current step ends before `t` (s).
    pub fn is_before(&self, t: f64) -> bool {
        !self.has_ended() && is_before(self.settings.start, self.integrator.step.new.t, t)
    }

    /// Writes the state at the time `t` (s) in the current step to `at`, or the state at an earlier event that ends the
    /// motion.
    pub(crate) fn sample(&mut self, t: f64, at: &mut State<f64>) {
        let t = if self.has_ended() { t.min(self.integrator.step.new.t) } else { t };
        let Self { integrator: Integrator { mechanism, step, .. }, inspector, locator, .. } = self;
        let end = locator.closed.map(|_| inspector.at_event(mechanism, &step.new));
        interpolate(&step.old, end.as_ref().unwrap_or(&step.new), t, at);
    }

    /// Takes one step. Returns its length in s.
    pub fn advance(&mut self) -> Result<f64> {
        let Integrator { mechanism, system, step, .. } = &mut self.integrator;
        if let Some(state) = self.locator.apply(system, mechanism, &step.new, self.length)? {
            step.restart(&state);
        }
        if self.steps > 0 {
            self.integrator.accept();
            let Self { integrator, inspector, settings, .. } = self;
            if settings.rescales_velocities(integrator.mechanism)
                && integrator.step.may_rescale()
                && let Some(velocities) = inspector.consistent_velocities(integrator)
            {
                integrator.step.set_violation(&velocities);
            }
        }
        let Integrator { mechanism, step, .. } = &self.integrator;
        let name = |i: usize| format!("{} (velocity)", mechanism.coordinates[i].name);
        self.count.check(self.steps, step.new.t, &step.new.v, name)?;
        self.steps += 1;
        self.length = match (self.given.get(self.steps - 1).copied(), self.settings.step) {
            (Some(given), _) => self.advance_given(given)?,
            (None, StepSize::Fixed(h)) => self.advance_fixed(h)?,
            (None, StepSize::Adaptive { tolerance, longest, .. }) => self.advance_adaptive(tolerance, longest)?,
        };
        let Integrator { mechanism, system, step, .. } = &self.integrator;
        let (ends, state) = ([step.old.t, step.new.t], || step.new.clone());
        refuse_position_jumps(system, mechanism, ends, state)?;
        if let Some(kind) = StepKind::of_implicit(mechanism, matches!(self.settings.step, StepSize::Adaptive { .. })) {
            refuse_velocity_jumps(system, mechanism, ends, kind, state)?;
        }
        mechanism.tick(step.new.t);
        let ([is_moved, has_moved_history], [since_event, _]) =
            (self.events.moves(), self.integrator.step.steps_since_event());
        let (closed, has_given_end) = (self.locator.closed, self.has_given_end);
        let simultaneous = closed.map(|event| simultaneous_switches(mechanism, event, &step.new, self.length));
        self.has_simultaneous_events |= simultaneous.is_some_and(|events| !events.is_empty());
        self.events = StepEvents { closed, has_given_end, since_event, is_moved, has_moved_history };
        Ok(self.length)
    }

    /// Takes a given step: one of the same length, or to the same event.
    fn advance_given(&mut self, given: GivenStep) -> Result<f64> {
        let mut taken = given.length;
        for factor in if given.event.is_some() { &TO_EVENT[..] } else { &[1.0] } {
            let trial = given.length * factor;
            self.integrator.solve(trial)?;
            taken = self.locator.locate(&mut self.integrator, trial)?;
            if self.locator.closed.is_some() {
                break;
            }
        }
        if self.locator.closed == given.event {
            return Ok(taken);
        }
        let name = |event: usize| self.integrator.mechanism.events[event].gap.name.as_str();
        let why = format!(
            "the events near t = {} are others than those of the given steps",
            Seconds(self.integrator.step.old.t)
        );
        let what = self.locator.closed.or(given.event).map_or("the mechanism", name);
        Err(Error::analysis(what, why, "give the steps of a mechanism that differs less"))
    }

    /// Takes a step to the next time of the grid; the step is halved as often as Newton's iteration fails.
    fn advance_fixed(&mut self, h: f64) -> Result<f64> {
        let grid = |k: usize| self.settings.start + h * k as f64;
        if grid(self.grid_steps + 1) - self.integrator.step.old.t < TINY * h {
            self.grid_steps += 1; // an event is at this time of the grid
        }
        let target = grid(self.grid_steps + 1);
        let rest = target - self.integrator.step.old.t;
        let mut trial = self.next.min(rest);
        if rest - trial < TINY * h {
            trial = rest;
        }
        let (mut inspected, mut shortened) = (None, None);
        loop {
            match self.integrator.solve(trial) {
                Ok(()) => match self.first_miss(None)? {
                    Some(t) => {
                        trial = t - self.integrator.step.old.t;
                        inspected = Some(trial);
                    }
                    None => break,
                },
                Err(error) if trial < h * SMALLEST => return Err(self.with_turn(error, h)),
                Err(_) => {
                    self.failed_steps += 1;
                    trial = fraction(h, 0.5 * trial);
                    shortened = Some(trial);
                }
            }
        }
        let taken = self.locator.locate(&mut self.integrator, trial)?;
        self.has_given_end = taken == rest || inspected == Some(taken);
        if taken == rest {
            self.grid_steps += 1;
            self.integrator.step.new.t = target;
        }
        // The rest of a grid step, or the time to an event, is no estimate of the length of the next one.
        let length = shortened.unwrap_or(self.next);
        self.next = (2.0 * length).min(h);
        Ok(taken)
    }

    /// The `error` of steps of the length `h` (s) that do not converge, with the body in space that turns too far in them.
    fn with_turn(&self, error: Error, h: f64) -> Error {
        let Error::Analysis { what, why, .. } = &error else { return error };
        let Integrator { mechanism, step, .. } = &self.integrator;
        let turn = |instance: &ElementInstance<f64>| {
            2.0 * h * instance.coordinates[3..].iter().map(|&i| step.old.v[i].powi(2)).sum::<f64>().sqrt()
        };
        let frames = mechanism.elements.iter().filter_map(|instance| Some((normalized_frame(instance)?, instance)));
        let turns = frames.map(|(name, instance)| (name, turn(instance)));
        match turns.max_by(|a, b| a.1.total_cmp(&b.1)) {
            Some((name, turn)) if turn > LONGEST_TURN => {
                let why = format!(
                    "{why}; {name} turns by {turn:.2} rad in a time step of {h} s, and implicit steps of more than \
                     {LONGEST_TURN} rad are unstable in space"
                );
                let remedy = "use more than 60 steps in a turn, give a tolerance, or use the scheme rk8";
                Error::analysis(what.clone(), why, remedy)
            }
            _ => error,
        }
    }

    /// Takes the longest step whose local error is below the tolerance.
    fn advance_adaptive(&mut self, tolerance: f64, longest: f64) -> Result<f64> {
        let (wanted, old) = (self.next, self.integrator.step.old.t);
        let mut trial = wanted;
        loop {
            let is_smallest = trial < wanted * SMALLEST * SMALLEST || old + 0.1 * trial == old;
            let error = match self.integrator.solve(trial) {
                Ok(()) => self.local_error(trial) / tolerance,
                Err(error) if is_smallest => return Err(error),
                Err(_) => f64::INFINITY,
            };
            if is_smallest && !(error <= 1.0) {
                return Err(self.too_small(trial));
            }
            let growth = (0.9 * error.powf(-1.0 / 3.0)).clamp(0.25, 2.0);
            if error <= 1.0
                && let Some(t) = self.first_miss(Some(tolerance / self.error_of_acceleration(trial)))?
            {
                self.failed_steps += 1;
                trial = t - old;
                continue;
            }
            if error <= 1.0 {
                self.next = (trial * growth).min(longest);
                return self.locator.locate(&mut self.integrator, trial);
            }
            self.failed_steps += 1;
            trial *= growth.min(0.9);
        }
    }

    /// The first time in s inside the solved step that has to be its end, if there is one.
    fn first_miss(&mut self, tolerated: Option<f64>) -> Result<Option<f64>> {
        let Self { integrator, locator, inspections, inspector, .. } = self;
        inspector.first_miss(integrator, locator, inspections, tolerated)
    }

    /// The error of a step that becomes too small, naming the coordinate whose acceleration changes most.
    fn too_small(&self, h: f64) -> Error {
        let step = &self.integrator.step;
        let change = |i: &usize| (step.new.a[*i] - step.old.a[*i]).abs();
        let worst = (0..step.new.a.len()).max_by(|i, j| change(i).total_cmp(&change(j)));
        let what = worst.map_or("the mechanism", |i| &self.integrator.mechanism.coordinates[i].name);
        let why = format!("the step becomes too small ({h:.1e} s) at t = {}", Seconds(step.old.t));
        Error::analysis(what, why, "loosen the tolerance, or smooth the force or motion that jumps")
    }

    /// Local error of the positions in m or rad: h² |β − 1/6| times the change of the acceleration, for Newmark's method.
    ///
    /// # Sources
    ///
    /// Zienkiewicz & Xie, *Earthq. Eng. Struct. Dyn.* 20 (1991) 871–887.
    fn local_error(&self, h: f64) -> f64 {
        let step = &self.integrator.step;
        let changes = step.new.a.iter().zip(&step.old.a).map(|(new, old)| (new - old).abs());
        self.error_of_acceleration(h) * changes.fold(0.0, f64::max)
    }

    /// Local error of a position per change of its acceleration, in s².
    fn error_of_acceleration(&self, h: f64) -> f64 {
        h * h * (self.settings.scheme.beta - 1.0 / 6.0).abs()
    }

    /// Numbers of steps and iterations so far.
    pub fn work(&self) -> Work {
        Work { steps: self.steps, failed_steps: self.failed_steps, iterations: self.integrator.iterations }
    }

    /// The last output time in s.
    pub fn end(&self) -> f64 {
        self.end
    }
}

/// The longest of the lengths h, h/2, h/4, … that is not above `length` (s), except by rounding.
///
/// Lengths of steps that do not end on the grid are such fractions. They do not depend on the design, as the time since an event does:
/// derivatives keep them.
fn fraction(h: f64, length: f64) -> f64 {
    let mut fraction = h;
    while fraction > length * (1.0 + 1e-6) {
        fraction *= 0.5;
    }
    fraction
}

/// Remedy for rigid contacts that matter in the equilibrium at the start.
const OPEN: &str =
    "start from the built positions, or model the contacts with stiffness and damping (a bump stop, a wall)";

/// The `error` of a missing equilibrium, which says that rigid contacts are left out, if there are any.
fn without_contacts(mechanism: &Mechanism<f64>, error: Error) -> Error {
    let contact = mechanism.events.iter().find(|event| event.restitution.is_some());
    match (error, contact) {
        (Error::Analysis { what, why, .. }, Some(contact)) => {
            let contact = &contact.gap.name;
            Error::analysis(what, format!("{why}; this equilibrium is without rigid contacts, such as {contact}"), OPEN)
        }
        (error, _) => error,
    }
}

/// Checks that no rigid contact overlaps in the equilibrium at the start.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the contact.
fn check_overlaps(mechanism: &Mechanism<f64>, state: &State<f64>) -> Result<()> {
    let contacts = mechanism.events.iter().filter(|event| event.restitution.is_some());
    let mut gaps = contacts.map(|contact| (contact, contact.gap(state)));
    gaps.find(|(_, gap)| *gap < -TOUCHING).map_or(Ok(()), |(contact, gap)| {
        let why = format!(
            "the static equilibrium at the start is without rigid contacts, and this one overlaps in it by {:.3e} m or rad",
            -gap
        );
        Err(Error::unsupported(&contact.gap.name, why, OPEN))
    })
}

/// The error of a motion from an equilibrium in which rigid contacts are closed.
fn closed_in_equilibrium(mechanism: &Mechanism<f64>, state: &State<f64>) -> Error {
    let is_closed = |event: &&EventElement<f64>| event.restitution.is_some() && event.is_held(&state.modes);
    let contact = mechanism.events.iter().find(is_closed).map_or("initial = \"equilibrium\"", |event| &event.gap.name);
    let why = "a motion that starts in static equilibrium begins with its rigid contacts open";
    Error::unsupported(contact, why, OPEN)
}
