//! Location of events: a step ends where a rigid contact closes or a switch crosses zero.

use crate::events::event::Event;
use crate::events::held_outputs::HeldOutputs;
use crate::events::impact::{
    POSITION_ROUNDING, TIME_ROUNDING, are_coupled, event_offset, gap_rounding, locked_with, simultaneous_switches,
};
use crate::events::mode_transition::{SHORTEST_FLIGHT, events_at_once, find_transition, state_after};
use crate::events::unilateral::{AT_REST, TOUCHING};
use crate::integrators::consistent_ends;
use crate::integrators::generalized_alpha::{Integrator, Step};
use crate::integrators::settings::StepSize;
use crate::mechanism::output::EventSide;
use crate::mechanism::{EventCondition, EventElement, Mechanism, Unilateral};
use crate::system::System;
use crate::system::state::State;
use crate::{Error, Result};
use error::Seconds;

/// Largest number of trial steps in the search for the time at which a contact closes.
const MAX_TRIALS: usize = 100;

/// Largest number of halvings of a step in the search for a time at which the force of a held part is inside its limits.
const MAX_HALVINGS: usize = 20;

/// Fraction of the estimated remaining distance to a switch that a trial step covers.
const MOST: f64 = 0.99;

/// Change of the opening between two steps of nearly the same length, as a fraction of that over the whole step, which is a jump.
const JUMPS: f64 = 1e-3;

/// Shortest time between two events of a part, in nominal steps: less than the shortest flight, whose length is an estimate.
const SHORTEST_TIME: f64 = 0.1 * SHORTEST_FLIGHT;

/// Largest number of events within the time of a nominal step. A ball with the restitution 0.999 comes to rest after 7000 impacts within this time.
const MOST_EVENTS: usize = 10_000;

/// Remaining gap, as a fraction of the gap at the beginning of the step, at which a contact counts as closed: rounding errors are as large.
const CLOSED_GAP: f64 = 1e-6;

/// Time that separates simultaneous impacts without an effect on each other, in nominal steps.
const SIMULTANEOUS_STEP: f64 = 1e-9;

/// Length of a step that ends at an event, in nominal steps, up to which its end is extrapolated from its beginning.
const VERY_SHORT: f64 = 1e-6;

/// Returns whether the end of an implicit step that ends at an event after the time `h` (s) is extrapolated from its beginning, and so are its
/// derivatives: the formulas of the scheme divide rounding errors by the square of the length.
pub(crate) fn is_very_short(h: f64, step: StepSize) -> bool {
    h <= VERY_SHORT * step.nominal()
}

/// Time after the beginning of a step, in nominal steps, that decides whether a condition at its border becomes true.
const AHEAD: f64 = 1e-3;

/// Opening at the beginning of a mode, used instead of a value that consists of rounding errors.
const INITIAL_OPENING: f64 = f64::MIN_POSITIVE;

/// Fraction of the time within which two contacts close at the same time.
const SAME_TIME: f64 = 16.0 * f64::EPSILON;

/// A step whose length is varied until it ends at an event.
pub(crate) trait TrialStep {
    /// A solution of the step, to which it can return.
    type Solution;

    /// The mechanism.
    fn mechanism(&self) -> &Mechanism<f64>;

    /// Its equations.
    fn system(&self) -> &System;

    /// Prepares the step, as it has been solved, for the search.
    fn begin(&mut self) -> Result<()> {
        Ok(())
    }

    /// The states at the beginning and at the end.
    fn ends(&self) -> [&State<f64>; 2];

    /// Repeats the step with the length `h` (s).
    fn solve(&mut self, h: f64) -> Result<()>;

    /// Repeats the step with the length `h` (s), starting from the step `earlier`, which ends before a switch.
    fn solve_after(&mut self, earlier: &StepBeforeSwitch, h: f64) -> Result<()>;

    /// The current solution, of the length `h` (s).
    fn solution(&self, h: f64) -> Self::Solution;

    /// Sets the end of a very short step of the length `h` (s) if its velocities are rounding errors of positions divided by its length:
    /// those of implicit steps.
    fn extrapolate(&mut self, _h: f64) -> Result<()> {
        Ok(())
    }

    /// Returns to a solution.
    fn restore(&mut self, solution: Self::Solution) -> Result<()>;
}

impl TrialStep for Integrator<'_> {
    type Solution = Step<f64>;

    fn mechanism(&self) -> &Mechanism<f64> {
        self.mechanism
    }

    fn system(&self) -> &System {
        &self.system
    }

    fn begin(&mut self) -> Result<()> {
        self.consistent.as_mut().map_or(Ok(()), |ends| ends.begin(self.mechanism, [&self.step.old, &self.step.new]))
    }

    fn ends(&self) -> [&State<f64>; 2] {
        let consistent = self.consistent.as_ref().and_then(|ends| ends.states());
        consistent.unwrap_or([&self.step.old, &self.step.new])
    }

    fn solve(&mut self, h: f64) -> Result<()> {
        self.solve(h)?;
        self.update_end()
    }

    /// Starts from accelerations and multipliers extrapolated linearly from the beginning of the step and the earlier end.
    fn solve_after(&mut self, earlier: &StepBeforeSwitch, h: f64) -> Result<()> {
        let share = if earlier.h > 0.0 { (h - earlier.h) / earlier.h } else { 0.0 };
        let step = &mut self.step;
        let extrapolate = |to: &mut [f64], old: &[f64], end: &[f64]| {
            to.iter_mut().zip(old.iter().zip(end)).for_each(|(to, (old, end))| *to = end + share * (end - old));
        };
        extrapolate(&mut step.new.a, &step.old.a, &earlier.state.a);
        extrapolate(&mut step.new.l, &step.old.l, &earlier.state.l);
        self.solve_from_guess(h)?;
        self.update_end()
    }

    fn extrapolate(&mut self, h: f64) -> Result<()> {
        self.step.extrapolate(self.mechanism, h);
        self.update_end()
    }

    fn solution(&self, _h: f64) -> Step<f64> {
        self.step.clone()
    }

    fn restore(&mut self, solution: Step<f64>) -> Result<()> {
        self.step = solution;
        self.update_end()
    }
}

impl Integrator<'_> {
    /// Computes the forces of held parts at the end of the step.
    fn update_end(&mut self) -> Result<()> {
        self.consistent.as_mut().map_or(Ok(()), |ends| ends.end(self.mechanism, &self.step.new))
    }
}

/// Events of a motion, and the contacts or switches at the two ends of the current step.
#[derive(Clone)]
pub(crate) struct EventLocator {
    /// Events so far.
    pub events: Vec<Event>,
    /// Contact or switch at the end of the current step.
    pub closed: Option<usize>,
    /// Contact or switch at the beginning of the current step.
    pub opened: Option<usize>,
    /// Switches that cross zero at the time of the event at the beginning of the current step.
    simultaneous: Vec<usize>,
    /// True if the event at the beginning of the current step is an impact after which the contact opens.
    is_bounce: bool,
    /// Outputs that keep their value from an event on.
    pub held: Option<HeldOutputs<f64>>,
    step: StepSize,
    /// Events whose condition holds at the start of the motion.
    pub held_from_start: Vec<usize>,
    /// Number of events within the time of a nominal step, and the time in s of the steps since the first of them.
    recent: (usize, f64),
}

impl EventLocator {
    /// Locator for steps of the size `step`, at the initial `state` of a motion.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if a contact overlaps or closes at the start of the motion.
    pub fn new(mechanism: &Mechanism<f64>, state: &State<f64>, step: StepSize) -> Result<Self> {
        for impact in mechanism.events.iter().filter(|impact| impact.is_open_contact(&state.modes)) {
            let (gap, rate) = (impact.gap(state), impact.rate(state, &state.v));
            let is_open = gap > 0.0 || (gap >= -TOUCHING && rate >= -TOUCHING);
            if !is_open {
                let why = format!(
                    "the motion starts at t = {} with a gap of {gap:.3e} that is not opening",
                    Seconds(state.t)
                );
                return Err(Error::analysis(
                    &impact.gap.name,
                    why,
                    "start with the contact open, or at rest with a gap of 0",
                ));
            }
        }
        let held = HeldOutputs::new(mechanism);
        let holds = |k: &usize| mechanism.events[*k].when.as_ref().is_some_and(|when| when.value(state) > 0.0);
        let held_from_start = (0..mechanism.events.len()).filter(holds).collect();
        Ok(Self {
            events: Vec::new(),
            closed: None,
            opened: None,
            simultaneous: Vec::new(),
            is_bounce: false,
            held,
            step,
            held_from_start,
            recent: (0, 0.0),
        })
    }

    /// Returns the state from which the next step begins, if the last one, of the length `h` (s), ends at an event, in the
    /// state `end`.
    ///
    /// Switches that cross zero at the same time are a part of the event.
    pub fn apply(
        &mut self,
        system: &mut System,
        mechanism: &Mechanism<f64>,
        end: &State<f64>,
        h: f64,
    ) -> Result<Option<State<f64>>> {
        self.opened = self.closed.take();
        self.simultaneous.clear();
        let (events, time) = self.recent;
        self.recent = if time + h > self.step.nominal() { (0, 0.0) } else { (events, time + h) };
        let Some(contact) = self.opened else { return Ok(None) };
        self.recent.0 += 1;
        if self.recent.0 > MOST_EVENTS {
            return Err(immediate(mechanism, end, contact));
        }
        let at_event = self.at_event(system, mechanism, contact, (end, h))?;
        self.simultaneous = at_event.iter().copied().filter(|k| *k != contact).collect();
        if let Some(held) = &mut self.held {
            held.hold(mechanism, EventSide::Before, &at_event, &consistent_ends::at_event(system, mechanism, end));
        }
        let is_impact = mechanism.events[contact].is_open_contact(&end.modes);
        let transition = find_transition(system, mechanism, (contact, &at_event), end, self.step.nominal())?;
        self.is_bounce = is_impact && !transition.stays;
        let nominal = self.step.nominal();
        let state = state_after(system, mechanism, (contact, &at_event), transition, end, nominal)?;
        if let Some(held) = &mut self.held {
            held.hold(mechanism, EventSide::After, &at_event, &state);
        }
        for &k in &at_event {
            let event = Event { contact: mechanism.events[k].gap.name.clone(), t: state.t };
            let is_same =
                |other: &&Event| other.contact == event.contact && event.t - other.t <= SAME_TIME * (event.t.abs() + h);
            if k == contact || !self.events.iter().rev().take(mechanism.events.len()).any(|other| is_same(&other)) {
                self.events.push(event);
            }
        }
        Ok(Some(state))
    }

    /// Time (s) after the event at the beginning of the step, the state `after`, at which forces are evaluated there.
    pub fn offset(&self, mechanism: &Mechanism<f64>, after: &State<f64>) -> f64 {
        let at_event: Vec<usize> = self.simultaneous.iter().copied().chain(self.opened).collect();
        event_offset(mechanism, &at_event, after, self.step.nominal())
    }

    /// The events at the time of event number `event` in their order, in the state at the `end` of a step, with its length in s.
    fn at_event(
        &self,
        system: &System,
        mechanism: &Mechanism<f64>,
        event: usize,
        (end, h): (&State<f64>, f64),
    ) -> Result<Vec<usize>> {
        let simultaneous = simultaneous_switches(mechanism, event, end, h);
        events_at_once(system, mechanism, (event, &simultaneous), end, self.step.nominal())
    }

    /// The steps, whose nominal length bounds the times between events.
    pub fn step(&self) -> StepSize {
        self.step
    }

    /// Returns whether the last step, of the length `h` (s), ends at an event that ends the motion, in `state`.
    pub fn has_ended(&self, system: &System, mechanism: &Mechanism<f64>, state: &State<f64>, h: f64) -> bool {
        let Some(contact) = self.closed.filter(|_| mechanism.may_end()) else { return false };
        let is_terminal = |k: usize| mechanism.events[k].is_terminal();
        let all = || self.at_event(system, mechanism, contact, (state, h)).unwrap_or_default();
        is_terminal(contact) || all().into_iter().any(is_terminal)
    }

    /// Repeats the step `h` so that it ends when the first contact closes. Returns the length of the step in s.
    ///
    /// A step without a closing contact is not repeated.
    ///
    /// # Errors
    ///
    /// [`Error::Analysis`] if two contacts close at the same time and the impulse of one changes the velocity of the other: the law of
    /// impact is stated for one of them. Without such an effect, the other one closes after a very short step.
    pub fn locate<S: TrialStep>(&mut self, step: &mut S, mut h: f64) -> Result<f64> {
        step.begin()?;
        let mut later = Vec::new();
        while let Some(contact) = self.first_closed(step, h, &later) {
            let earlier = self.closed.map(|other| (other, step.solution(h)));
            let Some(found) = self.close(step, contact, h)? else {
                later.push(contact);
                continue;
            };
            if let Some((other, solution)) = earlier
                && is_later(step, [other, contact], [h, found])?
            {
                step.restore(solution)?;
                later.push(contact);
                continue;
            }
            (h, self.closed) = (found, Some(contact));
        }
        if self.closed.is_some() && is_very_short(h, self.step) {
            step.extrapolate(h)?;
        }
        Ok(h)
    }

    /// Opening of a contact at the beginning of the step and after the time `h` (s): positive is open.
    ///
    /// The opening is the gap, or the gap divided by the elapsed time if the step begins with an impact or with a gap
    /// of zero that opens. A contact that is released at the beginning of the step is open during the step. The sign of a switch is
    /// such that it begins open. A switch that crosses zero at the time of the event at the beginning of the step has crossed it.
    fn openings(&self, step: &impl TrialStep, contact: usize, h: f64) -> [f64; 2] {
        self.openings_between(step.mechanism(), step.ends(), contact, h)
    }

    /// Opening of a contact in two states of a step, a time `h` (s) apart.
    fn openings_between(
        &self,
        mechanism: &Mechanism<f64>,
        [old, new]: [&State<f64>; 2],
        contact: usize,
        h: f64,
    ) -> [f64; 2] {
        let event = &mechanism.events[contact];
        let has_begun = self.opened == Some(contact) || self.simultaneous.contains(&contact);
        let change = GapChange { event, old, new, before: event.gap(old), after: event.gap(new), h, has_begun };
        if let Some(condition) = &event.when {
            return match old.modes.has_happened(contact) {
                true => [1.0, 1.0],
                false => change.of_condition(condition, AHEAD * self.step.nominal()),
            };
        }
        if let Some(openings) = change.closing_at_once(self.step.nominal()) {
            return openings;
        }
        // Other parts hold the contact where it touches.
        if change.touches_throughout(|state| gap_rounding(event, state, 0.0)) {
            return [INITIAL_OPENING; 2];
        }
        let has_bounced = self.opened == Some(contact) && self.is_bounce;
        let is_at_rest = event.is_unilateral_at_rest(&old.modes, change.before, has_begun);
        if is_at_rest && !has_bounced && !change.is_opening() {
            return change.at_rest();
        }
        if event.is_held(&old.modes) || event.is_resting(&old.modes) {
            let end = if change.after == 0.0 { INITIAL_OPENING } else { change.after };
            return [change.before.max(INITIAL_OPENING), end];
        }
        change.of_gap()
    }

    /// Returns whether an event happens between two `states`, a time `h` (s) apart.
    pub fn has_closed(&self, mechanism: &Mechanism<f64>, states: [&State<f64>; 2], h: f64) -> bool {
        (0..mechanism.events.len()).any(|event| {
            let [begin, end] = self.openings_between(mechanism, states, event, h);
            begin > 0.0 && end <= 0.0
        })
    }

    /// The contact that closes in the step `h`, without those that close `later`; if several close, the first one by linear
    /// interpolation.
    fn first_closed(&self, step: &impl TrialStep, h: f64, later: &[usize]) -> Option<usize> {
        let is_other = |k: &usize| self.closed != Some(*k) && !later.contains(k);
        let others = (0..step.mechanism().events.len()).filter(is_other);
        let openings = others.map(|contact| (contact, self.openings(step, contact, h)));
        let closed = openings.filter(|(_, [begin, end])| {
            *end <= CLOSED_GAP * begin.max(0.0) && (*end < 0.0 || *begin > INITIAL_OPENING)
        });
        let share = |[begin, end]: [f64; 2]| begin.max(0.0) / (begin.max(0.0) - end);
        closed.min_by(|a, b| share(a.1).total_cmp(&share(b.1))).map(|(contact, _)| contact)
    }

    /// Repeats the step so that it ends where `contact` closes, within the step `h` or shortly after it.
    ///
    /// Returns the length of the step in s, or `None` if the contact does not close.
    fn close(&self, step: &mut impl TrialStep, contact: usize, h: f64) -> Result<Option<f64>> {
        let [begin, end] = self.openings(step, contact, h);
        let (event, old) = (&step.mechanism().events[contact], step.ends()[0]);
        let (is_held, begins_to_slide) = (event.is_held(&old.modes), begins_to_slide(event, old));
        if !(begin > INITIAL_OPENING || is_held || begins_to_slide) {
            return Err(immediate(step.mechanism(), step.ends()[0], contact));
        }
        let found = match is_impact(step, contact) {
            true => self.close_gap(step, contact, h, [begin, end])?,
            false => {
                let before = match begin < -CLOSED_GAP * end && (is_held || begins_to_slide) {
                    true => self.open_inside(step, contact, h)?,
                    false => None,
                };
                if before.is_none() && begins_to_slide && !(begin > INITIAL_OPENING) {
                    return Ok(None);
                }
                let at_begin = || StepBeforeSwitch { h: 0.0, opening: begin, state: step.ends()[0].clone() };
                if before.is_none() && !(begin > INITIAL_OPENING) {
                    return Err(immediate(step.mechanism(), step.ends()[0], contact));
                }
                let before = before.unwrap_or_else(at_begin);
                self.end_before_switch(step, contact, (before, h), end)?
            }
        };
        let is_short = found.is_some_and(|found| found <= SHORTEST_TIME * self.step.nominal());
        if is_short && self.opened == Some(contact) {
            return Err(immediate(step.mechanism(), step.ends()[0], contact));
        }
        Ok(found)
    }

    /// A shorter step for a part that begins at its limit: at its end, the force of a held part is inside its limits,
    /// or friction that begins to slide has moved. `None` if none is found.
    fn open_inside(&self, step: &mut impl TrialStep, contact: usize, h: f64) -> Result<Option<StepBeforeSwitch>> {
        let mut trial = h;
        for _ in 0..MAX_HALVINGS {
            trial *= 0.5;
            step.solve(trial)?;
            let opening = self.openings(step, contact, trial)[1];
            if opening > INITIAL_OPENING {
                return Ok(Some(StepBeforeSwitch { h: trial, opening, state: step.ends()[1].clone() }));
            }
        }
        step.solve(h)?;
        Ok(None)
    }

    /// Repeats the step so that it ends where the gap of a rigid contact closes, by the Illinois method.
    ///
    /// # Sources
    ///
    /// Dowell & Jarratt, *BIT* 11 (1971) 168–174.
    fn close_gap(
        &self,
        step: &mut impl TrialStep,
        contact: usize,
        h: f64,
        [begin, mut end]: [f64; 2],
    ) -> Result<Option<f64>> {
        let mut longest = h;
        if end > 0.0 {
            longest = h + 2.0 * h * end / (begin - end);
            step.solve(longest)?;
            end = self.openings(step, contact, longest)[1];
            if end > 0.0 {
                step.solve(h)?;
                return Ok(None);
            }
        }
        let (mut low, mut high) = ([0.0, begin], [longest, end]);
        // Valid even where the step is much longer than the distance to the event.
        let small = (4.0 * f64::EPSILON * (begin - end)).min(CLOSED_GAP * begin);
        let mut trial = longest;
        for _ in 0..MAX_TRIALS {
            let root = (low[0] * high[1] - high[0] * low[1]) / (high[1] - low[1]);
            if !(low[0] < root && root < high[0]) {
                break;
            }
            trial = root;
            step.solve(trial)?;
            let open = self.openings(step, contact, trial)[1];
            if open.abs() <= small || high[0] - low[0] <= 4.0 * f64::EPSILON * high[0] {
                break;
            }
            // The Illinois method halves the value at the retained end, which moves the next estimate towards it.
            if open > 0.0 {
                low = [trial, open];
                high[1] *= 0.5;
            } else {
                high = [trial, open];
                low[1] *= 0.5;
            }
        }
        step.solve(trial)?;
        Ok(Some(trial))
    }

    /// Repeats the step so that it ends shortly before a switch crosses zero, by the size of rounding errors.
    ///
    /// Where the force jumps at the switch, a step that ends near the switch has two solutions, with the force before and after
    /// it, if the force pushes across the switch; if it pushes back, a step that ends shortly after has none. The
    /// solution before the switch is followed: each trial covers most of the remaining distance, estimated by the secant, and starts
    /// from the last solution. A trial without such a solution is too long. The search continues from `before`, the beginning of the step or a
    /// shorter step; `end` is the opening at the end of the step `h` (s).
    fn end_before_switch(
        &self,
        step: &mut impl TrialStep,
        switch: usize,
        (mut before, h): (StepBeforeSwitch, f64),
        end: f64,
    ) -> Result<Option<f64>> {
        let (start, begin) = (before.h, before.opening);
        let root = start + (h - start) * begin / (begin - end);
        let mut longest = h;
        if end > 0.0 {
            longest = 2.0 * root - h;
            before = StepBeforeSwitch { h, opening: end, state: step.ends()[1].clone() };
        }
        let (before, after) = match self.approach(step, switch, before, [root, longest]) {
            RootSearch::Reached(h) => return Ok(Some(h)),
            RootSearch::Stopped { before, after } => (*before, after),
        };
        // Where a load jumps, the value of a condition or a force jumps over its limit: the event happens after the jump.
        let jumps = |(after, opening): &(f64, f64)| {
            after - before.h <= CLOSED_GAP * h && before.opening - opening > JUMPS * (begin - end.min(0.0))
        };
        if let Some((after, _)) = after.filter(|after| after.0 <= h && jumps(after)) {
            step.solve_after(&before, after)?;
            return Ok(Some(after));
        }
        if before.h == 0.0 {
            return Err(immediate(step.mechanism(), step.ends()[0], switch));
        }
        step.solve_after(&before, before.h)?;
        // The step ends before the switch, by less than the rounding errors of its state.
        if end > 0.0 && after.is_some() {
            return Ok(Some(before.h));
        }
        let is_spent = step.mechanism().events[switch].unilateral.is_some() && before.opening <= CLOSED_GAP * begin;
        if before.h >= h * (1.0 - CLOSED_GAP) && !is_spent {
            // The switch opens again, the step ends before it, or at it.
            let is_closed = end == 0.0 && self.opening_after(step, switch, &before, h * (1.0 + CLOSED_GAP))? < 0.0;
            let opening = self.opening_after(step, switch, &before, h)?;
            return Ok((is_closed || opening < 0.0).then_some(h));
        }
        Ok(Some(before.h))
    }

    /// Opening of a switch at the end of a step of the length `h` (s), solved from the step `before`.
    fn opening_after(
        &self,
        step: &mut impl TrialStep,
        switch: usize,
        before: &StepBeforeSwitch,
        h: f64,
    ) -> Result<f64> {
        step.solve_after(before, h)?;
        Ok(self.openings(step, switch, h)[1])
    }

    /// Repeats the step so that its end approaches a switch from `before`, with the estimate `root` of the time of the switch and the `longest`
    /// length of the step (s).
    fn approach(
        &self,
        step: &mut impl TrialStep,
        switch: usize,
        mut before: StepBeforeSwitch,
        [mut root, mut longest]: [f64; 2],
    ) -> RootSearch {
        let mut part = MOST;
        let mut after: Option<(f64, f64)> = None;
        for _ in 0..MAX_TRIALS {
            let trial = before.h + part * (root.min(longest) - before.h);
            if !(trial > before.h) {
                break;
            }
            let opening = match step.solve_after(&before, trial) {
                Ok(()) => self.openings(step, switch, trial)[1],
                Err(_) => 0.0,
            };
            if !(opening > 0.0) {
                if opening < 0.0 && opening >= -stopping_error(step, switch, trial) {
                    return RootSearch::Reached(trial);
                }
                if opening < 0.0 {
                    (longest, after) = (trial, Some((trial, opening)));
                }
                part *= 0.5;
                continue;
            }
            root = trial + (trial - before.h) * opening / (before.opening - opening);
            if !(root > trial) {
                root = longest; // the gap increases
            }
            before = StepBeforeSwitch { h: trial, opening, state: step.ends()[1].clone() };
            part = MOST;
            if is_at_switch(step, switch, trial) {
                return RootSearch::Reached(trial);
            }
        }
        RootSearch::Stopped { before: Box::new(before), after }
    }
}

/// Result of trial steps towards a switch.
enum RootSearch {
    /// The step has this length in s and ends at the switch.
    Reached(f64),
    /// The last trial step before the switch, and the shortest one after it: its length in s and the opening.
    Stopped { before: Box<StepBeforeSwitch>, after: Option<(f64, f64)> },
}

/// Gap of a contact, or value of a switch, in two states of a step.
struct GapChange<'a> {
    event: &'a EventElement<f64>,
    old: &'a State<f64>,
    new: &'a State<f64>,
    /// Gap in the old state.
    before: f64,
    /// Gap in the new one.
    after: f64,
    /// Time between the states in s.
    h: f64,
    /// True if the event happens at the beginning of the step.
    has_begun: bool,
}

impl GapChange<'_> {
    /// Rate of the gap in the old state.
    fn rate(&self) -> f64 {
        self.event.rate(self.old, &self.old.v)
    }

    fn is_open_contact(&self) -> bool {
        self.event.is_open_contact(&self.old.modes)
    }

    /// Returns whether an open contact touches in the old state.
    fn is_touching(&self) -> bool {
        self.is_open_contact() && self.before.abs() <= TOUCHING
    }

    /// Returns whether an open contact touches in the old state and opens.
    fn is_opening(&self) -> bool {
        self.is_touching() && self.rate() > TOUCHING
    }

    /// Returns whether an open contact touches at rest in both states, with a gap of at most `tolerance`.
    fn touches_throughout(&self, tolerance: impl Fn(&State<f64>) -> f64) -> bool {
        let rests = |state: &State<f64>, gap: f64| {
            gap.abs() <= tolerance(state) && self.event.rate(state, &state.v).abs() <= TOUCHING
        };
        self.is_open_contact() && rests(self.old, self.before) && rests(self.new, self.after)
    }

    /// Openings of an event by a `condition` that has not happened; `ahead` is a short time in s.
    fn of_condition(&self, condition: &EventCondition<f64>, ahead: f64) -> [f64; 2] {
        if let Some(shift) = condition.just_above_zero(self.old, ahead) {
            return [shift, self.after + shift];
        }
        let rate = self.rate();
        match self.before {
            before if before > 0.0 => [before, self.after],
            0.0 if rate > 0.0 => [rate, self.after / self.h],
            // At its border, from which it may move away later in the step.
            before if -before <= condition.border(self.old) => {
                let border = condition.border(self.old);
                [border, self.after - before + border]
            }
            _ => [1.0, 1.0], // it holds, and has to become false first
        }
    }

    /// Openings of a contact that closes at the time of the event at the beginning of the step, because its velocity after that event is a closing
    /// one; `None` otherwise. `nominal` is the nominal length of the steps in s.
    fn closing_at_once(&self, nominal: f64) -> Option<[f64; 2]> {
        let is_closed = self.is_touching() && !self.has_begun && self.before <= gap_rounding(self.event, self.old, 0.0);
        (is_closed && self.rate() < -TOUCHING).then(|| {
            let flight = (SIMULTANEOUS_STEP * nominal).max(TIME_ROUNDING * self.old.t.abs());
            let overlap = -self.rate() * flight - self.before.min(0.0);
            [overlap, self.after + overlap]
        })
    }

    /// Openings of a free part that is at rest in the old state.
    fn at_rest(&self) -> [f64; 2] {
        let Self { event, old, before, after, h, has_begun, .. } = *self;
        let rate = self.rate();
        // Other parts hold the contact where it touches.
        let is_held_open = self.touches_throughout(|_| TOUCHING);
        let is_leaving = has_begun || after > before || is_held_open;
        let has_opened = self.is_open_contact() && has_begun;
        match event.is_sliding(&old.modes) && rate > 0.0 && has_begun {
            // The velocity has the error of the step, even where friction begins to slide.
            true => [rate, (after - before.min(0.0)) / h],
            // It may have returned in the step; an overlap of the size of rounding errors does not count.
            false if has_opened => [TOUCHING, after + TOUCHING - before.min(0.0)],
            false if begins_to_slide(event, old) => match (-AT_REST..=0.0).contains(&after) {
                true => [INITIAL_OPENING; 2],
                false => [INITIAL_OPENING, after],
            },
            false if is_leaving => [INITIAL_OPENING; 2],
            false => [INITIAL_OPENING, after],
        }
    }

    /// Openings by the gap, or by its mean rate if it begins at zero.
    fn of_gap(&self) -> [f64; 2] {
        let Self { event, before, after, h, .. } = *self;
        let is_at_zero = self.is_opening() || self.has_begun || before == 0.0;
        // A switch has crossed zero with a gap of rounding size, from which it returns; a contact may overlap by as much.
        let passed = if event.restitution.is_none() { before } else { before.min(0.0) };
        let [begin, end] = match is_at_zero {
            true => [self.rate(), (after - passed) / h],
            false => [before, after],
        };
        let side = if event.restitution.is_none() && begin < 0.0 { -1.0 } else { 1.0 };
        [side * begin, side * end]
    }
}

/// The end of a trial step before a switch.
pub(crate) struct StepBeforeSwitch {
    /// Length of the step in s.
    h: f64,
    /// Opening of the switch.
    opening: f64,
    state: State<f64>,
}

/// Returns whether an event is friction that begins to slide in `state`: it may stop again within the step.
fn begins_to_slide(event: &EventElement<f64>, state: &State<f64>) -> bool {
    event.is_sliding(&state.modes) && event.gap(state).abs() <= AT_REST
}

/// Error of the velocity of friction that slides, in m/s or rad/s, at the end of a step `h` (s): positions have rounding errors.
fn stopping_error(step: &impl TrialStep, switch: usize, h: f64) -> f64 {
    let (switch, [_, end]) = (&step.mechanism().events[switch], step.ends());
    let largest = switch.gap.coordinates.iter().map(|&i| end.q[i].abs()).fold(0.0, f64::max);
    if switch.is_sliding(&end.modes) { POSITION_ROUNDING * largest / h } else { 0.0 }
}

/// True if the step `h` (s) ends at a switch, up to half of the rounding within which others count as simultaneous.
fn is_at_switch(step: &impl TrialStep, switch: usize, h: f64) -> bool {
    let (switch, [_, end]) = (&step.mechanism().events[switch], step.ends());
    switch.gap(end).abs() <= 0.5 * gap_rounding(switch, end, h)
}

fn is_impact(step: &impl TrialStep, contact: usize) -> bool {
    step.mechanism().events[contact].is_open_contact(&step.ends()[0].modes)
}

/// Returns whether the second of two events, after steps of the `lengths` (s), is later than the first one or at the same time. The step ends at
/// the second one.
///
/// # Errors
///
/// [`Error::Analysis`] for two contacts that close at the same time and affect each other.
fn is_later(step: &impl TrialStep, events: [usize; 2], [first, second]: [f64; 2]) -> Result<bool> {
    let both_are_impacts = events.iter().all(|&k| is_impact(step, k));
    let rounding = if both_are_impacts { SAME_TIME } else { TIME_ROUNDING } * (first + step.ends()[1].t.abs());
    let is_simultaneous = both_are_impacts && (second - first).abs() <= rounding;
    if is_simultaneous && are_coupled(step.system(), step.mechanism(), step.ends()[1], events)? {
        return Err(simultaneous(step, events));
    }
    Ok(is_simultaneous || second >= first - rounding)
}

/// The error of two contacts that close at the same time.
fn simultaneous(step: &impl TrialStep, contacts: [usize; 2]) -> Error {
    let [first, second] = contacts.map(|k| &step.mechanism().events[k].gap.name);
    let why = format!("it closes at the same time as `{second}`, t = {}", Seconds(step.ends()[1].t));
    let remedy = "model one of them with stiffness and damping (a wall contact, a bump stop), or move it a little";
    Error::analysis(first, why, remedy)
}

/// The error of an event in `state` that follows the one before it at once.
fn immediate(mechanism: &Mechanism<f64>, state: &State<f64>, event: usize) -> Error {
    if let Some(other) = locked_with(mechanism, state, event) {
        let why = format!(
            "a drive presses it against `{}` at t = {}: there is no way left for the prescribed motion",
            mechanism.events[other].gap.name,
            Seconds(state.t)
        );
        let remedy = "let the motion stop or turn back before, or drive by a force instead of a prescribed motion";
        return Error::analysis(&mechanism.events[event].gap.name, why, remedy);
    }
    let (event, t) = (&mechanism.events[event], state.t);
    let (why, remedy) = match event.unilateral {
        Some(Unilateral::Friction { .. }) => (
            "sticks and slides in turns without end",
            "use shorter steps or another scheme, a larger static_ratio, or smooth friction",
        ),
        Some(Unilateral::Contact { .. }) => (
            "opens and closes in turns without end",
            "use shorter steps, or model the contact with stiffness and damping (a wall contact, a bump stop)",
        ),
        None => ("happens again at once", "end the motion before, or smooth the force that jumps"),
    };
    Error::analysis(&event.gap.name, format!("it {why} at t = {t}", t = Seconds(t)), remedy)
}
