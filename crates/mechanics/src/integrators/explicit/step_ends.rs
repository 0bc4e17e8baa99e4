//! Events of a mechanism along explicit steps.

use crate::Result;
use crate::integrators::event_location::{Before, EventLocator, TrialStep};
use crate::integrators::explicit::mechanism::MechanismRhs;
use crate::integrators::explicit::stepper::Stepper;
use crate::mechanism::Mechanism;
use crate::system::state::State;

/// States at both ends of the current explicit step of a mechanism with events.
#[derive(Clone)]
pub(crate) struct StepEnds {
    /// States with accelerations and multipliers: after an event at the beginning, and before one at the end.
    pub states: [State<f64>; 2],
    /// Length of the step in s.
    pub length: f64,
    /// Slot of the evaluation at the end.
    end: usize,
}

/// Fractions of a step at which a contact may be closed, or a condition hold, for less than the step.
const SAMPLES: [f64; 3] = [0.25, 0.5, 0.75];

impl StepEnds {
    /// The initial `state` of a motion by steps whose ends are evaluated in the slot `end`.
    pub fn new(state: &State<f64>, end: usize) -> Self {
        Self { states: [state.clone(), state.clone()], length: 0.0, end }
    }

    /// Stores the state that was evaluated in `slot`, if it is one of the ends.
    pub fn store(&mut self, slot: usize, state: &State<f64>) {
        match slot {
            0 => self.states[0].copy_from(state),
            _ if slot == self.end => self.states[1].copy_from(state),
            _ => {}
        }
    }
}

/// A completed explicit step that is repeated with other lengths.
struct Repeated<'s, 'm> {
    stepper: &'s mut Stepper<MechanismRhs<'m>>,
}

impl TrialStep for Repeated<'_, '_> {
    type Solution = f64;

    fn mechanism(&self) -> &Mechanism<f64> {
        self.stepper.rhs.mechanism
    }

    fn ends(&self) -> [&State<f64>; 2] {
        self.stepper.rhs.step_ends.as_ref().expect("a mechanism with events").states.each_ref()
    }

    fn solve(&mut self, h: f64) -> Result<()> {
        self.stepper.attempt(self.stepper.t[0] + h, None).map(|_| ())
    }

    fn solve_after(&mut self, _earlier: &Before, h: f64) -> Result<()> {
        self.solve(h)
    }

    fn solution(&self, h: f64) -> f64 {
        h
    }

    fn restore(&mut self, h: f64) -> Result<()> {
        self.solve(h)
    }
}

/// Shortens the completed step so that it ends at the first event in it, if there is one. The step may become a little longer
/// if a contact is almost closed at its end.
pub(crate) fn end_at_event(stepper: &mut Stepper<MechanismRhs<'_>>) -> Result<()> {
    let Some(mut locator) = stepper.rhs.locator.take() else { return Ok(()) };
    let h = end_near_event(&locator, stepper)?;
    let length = locator.locate(&mut Repeated { stepper }, h)?;
    stepper.rhs.locator = Some(locator);
    stepper.rhs.step_ends.iter_mut().for_each(|ends| ends.length = length);
    Ok(())
}

/// Shortens the step if an event happens in it that has no trace at its end. Returns the length of the step in s.
fn end_near_event(locator: &EventLocator, stepper: &mut Stepper<MechanismRhs<'_>>) -> Result<f64> {
    let ([begin, end], mut y) = (stepper.t, stepper.new.clone());
    let states = stepper.rhs.step_ends.as_ref().map(|ends| &ends.states);
    let Some([old, new]) = states else { return Ok(end - begin) };
    let mut inside = new.clone();
    let is_closed = |fraction: &f64| {
        stepper.interpolate_coarsely(*fraction, &mut y);
        let (q, v) = y.split_at(inside.q.len());
        inside.t = begin + fraction * (end - begin);
        inside.q.copy_from_slice(q);
        inside.v.copy_from_slice(v);
        locator.has_closed(stepper.rhs.mechanism, [old, &inside], fraction * (end - begin))
    };
    let Some(fraction) = SAMPLES.into_iter().find(is_closed) else { return Ok(end - begin) };
    let h = fraction * (end - begin);
    stepper.attempt(begin + h, None)?;
    Ok(h)
}

/// Begins the next step after an event at the end of the last one, if there is one. Returns whether there is.
pub(crate) fn begin_after_event(stepper: &mut Stepper<MechanismRhs<'_>>) -> Result<bool> {
    let MechanismRhs { mechanism, system, state, locator, step_ends, .. } = &mut stepper.rhs;
    let (Some(locator), Some(ends)) = (locator, step_ends) else { return Ok(false) };
    let [begin, end] = &mut ends.states;
    let Some(after) = locator.apply(system, mechanism, end, ends.length)? else {
        begin.copy_from(end);
        return Ok(false);
    };
    state.modes.copy_from(&after.modes);
    stepper.restart(&MechanismRhs::vector(&after))?;
    Ok(true)
}
