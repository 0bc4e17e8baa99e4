//! Events by a condition: they deactivate joints, switch forces on and off, and end a motion.

use crate::elements::element::ElementWorkspace;
use crate::events::impact::{POSITION_ROUNDING, TIME_ROUNDING};
use crate::mechanism::element::{Element, ElementState};
use crate::mechanism::output::{EventSide, HeldFrom};
use crate::mechanism::scalars::StateScalar;
use crate::mechanism::{
    AnyFormula, ElementIndex, ElementInstance, EventCondition, EventElement, Formula, MeasuredQuantity, Mechanism,
    WeightedQuantity,
};
use crate::system::state::{State, measure};
use crate::{Error, Result};
use autodiff::Scalar;
use error::Seconds;
use std::sync::Arc;

/// An event of a mechanism, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EventIndex(pub(crate) usize);

/// Effect of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Action {
    /// Activates an element that is inactive before.
    Activate(ElementIndex),
    /// Deactivates an element: a force ends, a joint is released.
    Deactivate(ElementIndex),
    /// Ends the motion. Outputs keep the values that they have at the event.
    Terminate,
}

/// # Events by a condition
///
/// An event happens once, when a function g of time and measured quantities becomes positive. At the time T(b) of the event
/// g(x(T, b), T, b) = 0, so that dT/db = −(∂g/∂b + g_x ∂x/∂b)/ġ. A step ends at T, where forces and joints change.
/// Positions and velocities are continuous except for errors of the steps: velocities are made consistent with the
/// joints before the event. Derivatives are exact for the discrete motion.
///
/// # Sources
///
/// Leine & Nijmeijer, *Dynamics and Bifurcations of Non-Smooth Mechanical Systems* (2004), Section 7.3.
impl<S: Scalar> Mechanism<S> {
    /// Adds an event: the `formula` of the `terms` becomes positive.
    ///
    /// An element is inactive at the start if the first action on it, in the order of the events, is [`Action::Activate`].
    ///
    /// # Errors
    ///
    /// [`Error::Definition`] if the formula uses an energy or a driving force, or if an action activates a joint: a
    /// joint that closes is an impact. Dry friction can only be deactivated. A rigid contact can be neither activated
    /// nor deactivated.
    pub fn when(
        &mut self,
        name: impl Into<String>,
        formula: impl Formula,
        terms: &[WeightedQuantity<S>],
        actions: &[Action],
    ) -> Result<EventIndex> {
        let (name, mut measured) = (name.into(), Vec::new());
        for term in terms {
            let MeasuredQuantity::Measure { element, .. } = term.source else {
                let why = "its condition uses an energy or the force of a driver";
                return Err(Error::definition(name, why, "use positions, velocities or reactions"));
            };
            measured.push((element, self.elements[element].clone()));
        }
        let changes = self.changes_by(&name, actions)?;
        let is_terminal = actions.contains(&Action::Terminate);
        let formula: Arc<dyn AnyFormula> = Arc::new(formula);
        let when = EventCondition { terms: terms.to_vec(), formula, measured, changes, is_terminal };
        let gap = ElementInstance::new(name, Arc::new(NoGap), &[], &[], 0);
        self.events.push(EventElement { gap, restitution: None, when: Some(when), unilateral: None });
        Ok(EventIndex(self.events.len() - 1))
    }

    /// The switches that the `actions` of the event `name` change, with their values after it.
    fn changes_by(&mut self, name: &str, actions: &[Action]) -> Result<Vec<(usize, bool)>> {
        let mut changes = Vec::new();
        for action in actions {
            match *action {
                Action::Deactivate(element) if self.is_dry_friction(element) => {
                    let law = self.unilateral(element);
                    changes.extend(law.into_iter().flat_map(|law| law.modes()).map(|mode| (mode, false)));
                }
                Action::Activate(element) | Action::Deactivate(element) if self.unilateral(element).is_some() => {
                    let why =
                        format!("it changes `{}`, whose modes follow from the motion", self.elements[element.0].name);
                    let remedy = match self.is_dry_friction(element) {
                        true => "use a smooth friction, which can begin; dry friction can only end",
                        false => "use a compliant contact",
                    };
                    return Err(Error::definition(name, why, remedy));
                }
                Action::Activate(element) if self.elements[element.0].num_constraints > 0 => {
                    let why = format!("it activates the joint `{}`", self.elements[element.0].name);
                    return Err(Error::definition(name, why, "activate forces only: a joint that closes is an impact"));
                }
                Action::Activate(element) => changes.push((self.switch_of(element, false), true)),
                Action::Deactivate(element) => changes.push((self.switch_of(element, true), false)),
                Action::Terminate => {}
            }
        }
        Ok(changes)
    }

    /// Makes the output that was added last keep the value that it has just before the `event`, from the event on.
    ///
    /// With the time as its formula it is the time of the event. Its derivatives include that of the time of the event. It is an error
    /// of the analysis if the event does not happen.
    pub fn hold_output(&mut self, event: EventIndex) {
        self.hold_output_on(EventSide::Before, event, true);
    }

    /// Makes the output that was added last keep the value that it has on this `side` of the `event`, from the event on.
    ///
    /// If the event does not happen, the output keeps changing, or the analysis fails if the event `is_required`. After an event that ends
    /// the motion, the value is the one before it.
    pub fn hold_output_on(&mut self, side: EventSide, event: EventIndex, is_required: bool) {
        if let Some(output) = self.outputs.last_mut() {
            output.held = Some(HeldFrom { event: event.0, side, is_required });
        }
    }

    /// The switch of an element, which begins in the state `is_active` if it is a new one.
    fn switch_of(&mut self, element: ElementIndex, is_active: bool) -> usize {
        if let Some(switch) = self.elements[element.0].switch {
            return switch;
        }
        let switch = Some(self.switches.len());
        self.switches.push(is_active);
        self.elements[element.0].switch = switch;
        let measured = self.events.iter_mut().filter_map(|event| event.when.as_mut()).flat_map(|w| &mut w.measured);
        measured.filter(|(number, _)| *number == element.0).for_each(|(_, instance)| instance.switch = switch);
        self.switches.len() - 1
    }
}

impl<S> EventCondition<S> {
    /// Returns whether the condition uses forces or accelerations.
    pub fn uses_forces(&self) -> bool {
        self.has_term(|unit| !UNITS_OF_POSITION.contains(&unit) && !UNITS_OF_VELOCITY.contains(&unit))
    }

    /// Returns whether the condition uses more than positions.
    pub fn uses_velocities(&self) -> bool {
        self.has_term(|unit| !UNITS_OF_POSITION.contains(&unit))
    }

    /// Returns whether a quantity of the condition has a unit, or one of several, for which `is_such` is true.
    fn has_term(&self, is_such: impl Fn(&str) -> bool) -> bool {
        self.terms.iter().any(|term| {
            let MeasuredQuantity::Measure { element, measure } = term.source else { return false };
            let instance = self.measured.iter().find(|(k, _)| *k == element);
            instance.is_some_and(|(_, instance)| instance.element.measures()[measure].unit.split(" or ").any(&is_such))
        })
    }
}

/// Units of measures that depend on positions only.
const UNITS_OF_POSITION: [&str; 3] = ["m", "rad", "1"];

/// Units of measures that depend on positions and velocities only.
const UNITS_OF_VELOCITY: [&str; 3] = ["m/s", "rad/s", "J"];

impl EventCondition<f64> {
    /// A small positive value that the function g of a condition at its border passes almost at once; `None` for other
    /// conditions. At the border, g is zero in `state` and positive after the time `ahead` (s).
    ///
    /// Zero is also a rounding error, and the value that g has reached by an event of the same time.
    pub fn just_above_zero(&self, state: &State<f64>, ahead: f64) -> Option<f64> {
        let value = self.value(state);
        if value < 0.0 {
            return None;
        }
        let size = self.size(state);
        let (rounding, later) = (POSITION_ROUNDING * size, self.value(&moved(state, &state.v, ahead)));
        let passed = PASSED.max(TIME_ROUNDING * state.t.abs() / ahead) * later;
        (value <= rounding.max(AT_BORDER * later) && rounding < later).then(|| (value + passed).max(2.0 * rounding))
    }
}

impl EventCondition<f64> {
    /// The largest value of the function g of a condition that counts as zero in `state`.
    pub fn border(&self, state: &State<f64>) -> f64 {
        (POSITION_ROUNDING * self.size(state)).max(ZERO)
    }

    /// The largest absolute value of its quantities in `state`.
    pub fn size(&self, state: &State<f64>) -> f64 {
        self.terms_of(state).iter().fold(0.0, |size: f64, term| size.max(term.abs()))
    }
}

/// Value of a condition that may be a rounding error of a motion at rest.
pub(crate) const ZERO: f64 = 1e-12;

/// Value of a condition at its border, and one that it passes almost at once, as fractions of the value shortly after.
const AT_BORDER: f64 = 1e-6;
const PASSED: f64 = 1e-9;

/// The `state` after the time `offset` (s), by velocities `v` and accelerations.
fn moved<T: StateScalar>(state: &State<T>, v: &[T], offset: f64) -> State<T> {
    let mut moved = state.clone();
    moved.t += offset;
    moved.q.iter_mut().zip(v.iter().zip(&state.a)).for_each(|(q, (&v, &a))| *q += (v + a * (0.5 * offset)) * offset);
    moved.v.iter_mut().zip(&state.a).for_each(|(v, &a)| *v += a * offset);
    moved
}

impl<T: StateScalar> EventCondition<T> {
    /// The function g of the condition.
    pub fn value(&self, state: &State<T>) -> T {
        T::formula(self.formula.as_ref(), state.t, &self.terms_of(state))
    }

    /// The quantities of the condition.
    fn terms_of(&self, state: &State<T>) -> Vec<T> {
        let (mut workspace, mut measures) = (ElementWorkspace::default(), Vec::new());
        let quantity = |term: &WeightedQuantity<T>| {
            let MeasuredQuantity::Measure { element, measure: number } = term.source else { return T::from(0.0) };
            let (_, instance) = self.measured.iter().find(|(k, _)| *k == element).expect("it is stored");
            measures.clear();
            measures.resize(instance.element.measures().len(), T::from(0.0));
            measure(instance, state, &mut workspace, &mut measures);
            measures[number] * term.weight
        };
        self.terms.iter().map(quantity).collect()
    }

    /// Rate of the function in 1/s with the velocities `v`, by a central difference at constant multipliers.
    pub fn rate(&self, state: &State<T>, v: &[T]) -> T {
        let at = |offset: f64| self.value(&moved(state, v, offset));
        (at(RATE_STEP) - at(-RATE_STEP)) * (0.5 / RATE_STEP)
    }
}

/// Time step in s of the rate of a condition, which is an estimate: it separates events at the same time.
const RATE_STEP: f64 = 1e-6;

/// Placeholder for the gap in an event with a condition.
struct NoGap;

impl Element for NoGap {
    fn residual<T: Scalar>(&self, _x: &ElementState<'_, T>, _dynamics: &mut [T], _constraint: &mut [T]) {}
}

/// Explanation of an event that has not happened because its condition holds from the start.
pub(crate) const HOLDS_FROM_START: &str =
    "its condition holds from the start of the motion, and an event happens when the condition becomes true";

/// Error of an output at an event that has not happened by the time `t` (s). This is the last output time, or the time
/// of the event `ended_by` that ends the motion.
pub(crate) fn not_happened(name: &str, t: f64, (holds, ended_by): (bool, Option<&str>)) -> Error {
    if holds {
        let why = format!("{HOLDS_FROM_START}; an output is its value there");
        return Error::analysis(name, why, "start before it is true, or change the condition");
    }
    if let Some(other) = ended_by {
        let why = format!(
            "it has not happened when `{other}` ends the motion at t = {t}, and an output is its value there",
            t = Seconds(t)
        );
        return Error::analysis(name, why, "change its condition, or let the motion continue");
    }
    let why = format!(
        "it has not happened until the last time point, t = {t}, and an output is its value there",
        t = Seconds(t)
    );
    Error::analysis(name, why, "extend the time points, or change its condition or the design")
}
