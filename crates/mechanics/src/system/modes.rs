//! Discrete part of a state: which elements are active, which events have happened, and which sides of switching functions are held.

use crate::mechanism::element::SwitchSides;
use crate::mechanism::{ElementInstance, Mechanism};
use autodiff::Scalar;

/// Elements that are active, events that have happened, and sides of switching functions. The first list is empty without rigid contacts,
/// dry friction and events that switch elements, the second one without [`Mechanism::when`], the third one without ropes and compliant
/// contacts.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Modes {
    /// For each element that an event activates or deactivates, true if it is active.
    active: Vec<bool>,
    /// For each event, true if it has happened.
    happened: Vec<bool>,
    /// For each element with switching functions, their sides if they are held.
    sides: Vec<SwitchSides>,
}

impl Modes {
    /// Modes at the start of the motion.
    pub(crate) fn initial<T>(mechanism: &Mechanism<T>) -> Self {
        let has_modes = mechanism.events.iter().any(|event| event.when.is_some());
        let events = if has_modes { mechanism.events.len() } else { 0 };
        let sides = vec![SwitchSides::default(); mechanism.sided];
        Self { active: mechanism.switches.clone(), happened: vec![false; events], sides }
    }

    /// Returns whether an element is active. The residual of an inactive one is λ = 0, without forces.
    pub(crate) fn is_active<T>(&self, instance: &ElementInstance<T>) -> bool {
        instance.switch.is_none_or(|switch| self.active.get(switch).copied().unwrap_or(true))
    }

    /// Sides of the switching functions of an element.
    pub(crate) fn sides_of<T>(&self, instance: &ElementInstance<T>) -> SwitchSides {
        instance.sides.and_then(|number| self.sides.get(number)).copied().unwrap_or_default()
    }

    /// Sets the sides of the switching functions of an element.
    pub(crate) fn set_sides<T>(&mut self, instance: &ElementInstance<T>, sides: SwitchSides) {
        if let Some(number) = instance.sides {
            self.sides[number] = sides;
        }
    }

    /// Returns whether the switch with the number `switch` is on.
    pub(crate) fn is_on(&self, switch: usize) -> bool {
        self.active[switch]
    }

    /// Sets the switch with the number `switch`.
    pub(crate) fn set(&mut self, switch: usize, is_on: bool) {
        self.active[switch] = is_on;
    }

    /// Returns whether event number `event` has happened.
    pub(crate) fn has_happened(&self, event: usize) -> bool {
        self.happened.get(event).copied().unwrap_or(false)
    }

    /// Applies the changes of the `events`, which happen now.
    pub(crate) fn apply<T: Scalar>(&mut self, mechanism: &Mechanism<T>, events: &[usize]) {
        for &event in events {
            let Some(when) = &mechanism.events[event].when else { continue };
            self.happened[event] = true;
            when.changes.iter().for_each(|&(switch, is_active)| self.active[switch] = is_active);
        }
    }

    /// Number of values that [`Modes::write`] appends.
    pub(crate) fn width(&self) -> usize {
        self.active.len() + self.happened.len()
    }

    /// Appends the modes to a row of a recording, 1 for true and 0 for false.
    pub(crate) fn write(&self, to: &mut Vec<f64>) {
        to.extend(self.active.iter().chain(&self.happened).map(|&is_set| f64::from(u8::from(is_set))));
    }

    /// Reads the modes from the values of [`Modes::write`].
    pub(crate) fn read(&mut self, values: &[f64]) {
        let modes = self.active.iter_mut().chain(&mut self.happened);
        modes.zip(values).for_each(|(mode, value)| *mode = *value != 0.0);
    }

    /// Copies `other` without allocating.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.active.clone_from(&other.active);
        self.happened.clone_from(&other.happened);
        self.sides.clone_from(&other.sides);
    }
}
