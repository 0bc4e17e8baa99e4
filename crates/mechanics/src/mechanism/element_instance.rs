//! Elements as parts of a mechanism, with their coordinates, multipliers and parameters; elements with events.

use crate::mechanism::body::Coordinate;
use crate::mechanism::element::{AnyElement, Input, Role};
use crate::mechanism::output::{AnyFormula, WeightedQuantity};
use crate::{Error, Result};
use autodiff::Scalar;
use std::ops::Range;
use std::sync::Arc;

/// One element of a mechanism, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ElementIndex(pub(crate) usize);

#[derive(Clone)]
pub(crate) struct ElementInstance<S> {
    pub name: String,
    pub element: Arc<dyn AnyElement>,
    pub coordinates: Vec<usize>,
    /// The first of its own multipliers, or of those of the joint whose reactions it reads.
    pub first_multiplier: usize,
    pub num_constraints: usize,
    /// Number of multipliers of another element, a joint, on which its forces depend.
    pub num_reactions: usize,
    pub parameters: Vec<S>,
    /// Number of its entry in the switches of the mechanism, if events activate or deactivate it.
    pub switch: Option<usize>,
    /// Number of its entry in the held sides of the modes, if it has switching functions.
    pub sides: Option<usize>,
}

impl ElementInstance<f64> {
    /// The scalar inputs of its descriptor with their values; none without a descriptor.
    pub fn values(&self) -> Vec<(&'static Input, f64)> {
        let (mut at, mut values) = (0, Vec::new());
        for input in self.element.descriptor().map_or(&[][..], |descriptor| descriptor.inputs) {
            let is_scalar = matches!(input.role, Role::Parameter | Role::Gravity);
            if is_scalar {
                values.push((input, self.parameters.get(at).copied().unwrap_or(0.0)));
            }
            at += match input.role {
                Role::Marker => 2,
                Role::Marker3 => 7,
                _ => usize::from(is_scalar),
            };
        }
        values
    }
}

impl<S> ElementInstance<S> {
    /// The multipliers in the state of the element: its own, or the reactions that it reads.
    pub(crate) fn multipliers(&self) -> Range<usize> {
        self.first_multiplier..self.first_multiplier + self.num_constraints + self.num_reactions
    }

    /// Coordinates in which the element is linear at all times: none for one that events activate or deactivate.
    pub(crate) fn linear(&self) -> &'static [usize] {
        if self.switch.is_some() { &[] } else { self.element.linear() }
    }
}

impl<S: Scalar> ElementInstance<S> {
    pub(crate) fn new(
        name: String,
        element: Arc<dyn AnyElement>,
        coordinates: &[Coordinate],
        parameters: &[S],
        first_multiplier: usize,
    ) -> Self {
        let (num_constraints, parameters) = (element.num_constraints(), parameters.to_vec());
        let coordinates = coordinates.iter().map(|c| c.0).collect();
        let (num_reactions, switch, sides) = (0, None, None);
        Self { name, element, coordinates, first_multiplier, num_constraints, num_reactions, parameters, switch, sides }
    }
}

/// An element with events: a rigid contact, open as long as its gap is positive, a switch, or an event by a condition.
pub(crate) struct EventElement<S> {
    /// The constraint with one equation, the gap; its multiplier is the impulse.
    pub gap: ElementInstance<S>,
    /// Coefficient of restitution; `None` for a switch.
    pub restitution: Option<S>,
    /// Condition and effects of an event that happens once; the gap then has only its name.
    pub when: Option<EventCondition<S>>,
    /// Modes of a rigid contact or of dry friction.
    pub unilateral: Option<Unilateral>,
}

impl<S> EventElement<S> {
    /// Returns whether it is a switch, at which an element itself jumps.
    pub(crate) fn is_switch(&self) -> bool {
        self.restitution.is_none() && self.when.is_none() && self.unilateral.is_none()
    }

    /// Returns whether it ends the motion.
    pub(crate) fn is_terminal(&self) -> bool {
        self.when.as_ref().is_some_and(|when| when.is_terminal)
    }
}

/// Checks that a mechanism has no switch, at which an element itself jumps.
///
/// # Errors
///
/// [`Error::Unsupported`] naming the switch, with the reason and the remedy.
pub(crate) fn refuse_switches<S>(events: &[EventElement<S>], why: &str, remedy: &str) -> Result<()> {
    let switch = events.iter().find(|event| event.is_switch());
    switch.map_or(Ok(()), |switch| Err(Error::unsupported(&switch.gap.name, why, remedy)))
}

/// Condition and effects of an event.
pub(crate) struct EventCondition<S> {
    /// Quantities of the function g whose rise through zero is the event.
    pub terms: Vec<WeightedQuantity<S>>,
    /// The function g of these quantities and of the time.
    pub formula: Arc<dyn AnyFormula>,
    /// Elements of the quantities, by their number in the mechanism.
    pub measured: Vec<(usize, ElementInstance<S>)>,
    /// Switches of elements, and whether the element is active after the event.
    pub changes: Vec<(usize, bool)>,
    /// True if the event ends the motion.
    pub is_terminal: bool,
}

/// A part whose mode follows from the motion, by numbers of switches and multipliers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Unilateral {
    /// A rigid contact; `closed` is the switch of the joint that holds it closed.
    Contact { joint: usize, multiplier: usize, closed: usize },
    /// Dry friction with the multiplier of its force and the switches of its modes. While it rests, `forward` or `backward` may be on.
    Friction { joint: usize, multiplier: usize, forward: usize, backward: usize, sticking: usize, resting: usize },
}
