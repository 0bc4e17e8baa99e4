//! `[[event]]`: events by a condition, which deactivate joints, switch forces on and off, or end the motion.

use super::element_spec::ElementSpec;
use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::measured::MeasuredFormula;
use super::measures::{MeasureRef, Sensors};
use super::parts::{BuildContext, JointCoordinate, NamedPart, Parts};
use super::section::{Read, Section, Word};
use crate::Result;
use crate::model_file::Diagnostic;
use crate::model_file::expression::{ExpressionTree, Names};
use autodiff::Scalar;
use mechanics::elements::{Added, Family};
use mechanics::events::Action;

const KEYS: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    required(
        "when",
        Accepts::Condition,
        "comparison of measures, numbers and `time`, such as \"stone.y < 0\"; the event happens once, when it becomes true",
    ),
    optional("release", Accepts::Names, "joints, or `relative` and `length` drivers, that are released"),
    optional(
        "switch_on",
        Accepts::Names,
        "forces that begin; at the start they are off, unless an event before this one in the file switches them off",
    ),
    optional("switch_off", Accepts::Names, "forces that end"),
    default("terminal", Accepts::Flag, "false", "whether the motion ends; all outputs then keep their values"),
    EACH,
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[TableKeys {
    name: "event",
    kind: None,
    about: "an event by a condition, which changes the mechanism or ends the motion",
    keys: KEYS,
}];

/// Change of an element at an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum EventEffect {
    Release,
    SwitchOn,
    SwitchOff,
}

/// An event by a condition.
#[derive(Clone, Debug)]
pub struct EventSpec {
    name: String,
    /// Function that becomes positive at the event.
    condition: MeasuredFormula,
    /// Changes of elements, by their numbers.
    changes: Vec<(EventEffect, usize)>,
    is_terminal: bool,
}

impl EventSpec {
    /// The name.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Returns whether the event releases or switches something, so that forces may jump.
    pub fn changes_forces(&self) -> bool {
        !self.changes.is_empty()
    }

    /// Numbers of the released joints and drives.
    #[cfg(feature = "report")]
    pub fn released(&self) -> impl Iterator<Item = usize> {
        self.changes.iter().filter(|(change, _)| *change == EventEffect::Release).map(|(_, element)| *element)
    }
}

/// Reads the events and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts, elements: &[ElementSpec]) -> Read<Vec<EventSpec>> {
    let mut count = 0;
    file.read_each("event", |table, span| {
        let section = Section::of(table, span, "event", &[KEYS], file.source())?;
        let event = event(&section, names, parts, elements)?;
        parts.add(&section.need_word("name")?, NamedPart::Event(count))?;
        count += 1;
        Ok(event)
    })
}

fn event(section: &Section<'_>, names: &Names, parts: &Parts, elements: &[ElementSpec]) -> Read<EventSpec> {
    let Some(tree) = section.condition("when")? else {
        return Err(section.error_at("when", format!("{} lacks `when`", section.title)));
    };
    let condition = MeasuredFormula::compile(tree.clone(), "`when`", names, Some(parts), |tree, _| Ok(tree))?;
    check_condition(&tree, &condition, parts)?;
    let mut changes: Vec<(EventEffect, usize)> = vec![];
    for (key, change) in [
        ("release", EventEffect::Release),
        ("switch_on", EventEffect::SwitchOn),
        ("switch_off", EventEffect::SwitchOff),
    ] {
        for word in section.names(key)? {
            let element = changed(&word, change, parts, elements)?;
            if changes.iter().any(|(_, other)| *other == element) {
                let message = format!("`{}` is changed twice by one event", word.text);
                return Err(Diagnostic::new(word.span, message).help("name each part once"));
            }
            changes.push((change, element));
        }
    }
    Ok(EventSpec { name: section.text("name")?, condition, changes, is_terminal: section.flag("terminal")? })
}

/// Checks that a condition can change during the motion, and that it is a function of the state.
fn check_condition(tree: &ExpressionTree, condition: &MeasuredFormula, parts: &Parts) -> Read<()> {
    if condition.measures.is_empty() && !condition.expression.uses_time() {
        let message = "this condition does not change during the motion";
        return Err(
            Diagnostic::new(tree.span.clone(), message).help("compare a measure or `time`, as in \"stone.y < 0\"")
        );
    }
    let is_other = |measure: &MeasureRef| match measure {
        MeasureRef::KineticEnergy | MeasureRef::PotentialEnergy => true,
        MeasureRef::Element(k, _) => {
            parts.elements().any(|(number, descriptor)| number == *k && descriptor.kind == "coordinate")
        }
        _ => false,
    };
    if condition.measures.iter().any(is_other) {
        let message = "the condition of an event cannot use an energy or the force of a `coordinate` driver";
        let help = "use positions, velocities, accelerations, or measures of other joints and forces";
        return Err(Diagnostic::new(tree.span.clone(), message).help(help));
    }
    Ok(())
}

/// The number of the named element, which must be able to change in this way.
fn changed(word: &Word, change: EventEffect, parts: &Parts, elements: &[ElementSpec]) -> Read<usize> {
    let can = |element: &ElementSpec| match (change, element.kind.descriptor.family) {
        (EventEffect::Release, Family::Joint) => JointCoordinate::of_element(element.kind.descriptor).is_none(),
        (EventEffect::Release, Family::Drive) => !element.kind.is_prescribed(),
        (EventEffect::SwitchOn, Family::Force | Family::Contact) => !element.kind.has_modes(),
        (EventEffect::SwitchOff, Family::Force | Family::Contact) => !element.kind.is_rigid_contact(),
        _ => false,
    };
    let number = |name: &str| match parts.get(name) {
        Some(NamedPart::Element(k, _)) => Some(*k),
        _ => None,
    };
    let (verb, what) = match change {
        EventEffect::Release => ("released", "joint"),
        EventEffect::SwitchOn => ("switched on", "force"),
        EventEffect::SwitchOff => ("switched off", "force"),
    };
    match number(&word.text) {
        Some(k) if can(&elements[k]) => Ok(k),
        Some(k) => {
            let kind = elements[k].kind.descriptor.kind;
            let message = format!("`{}` is of kind `{kind}` and cannot be {verb}", word.text);
            let help = match (change, elements[k].kind.descriptor.family) {
                (EventEffect::Release, Family::Drive) => {
                    "use a driver of kind `relative` against the ground, which can be released"
                }
                (EventEffect::Release, _) => "forces have `switch_on` and `switch_off`",
                (_, Family::Joint | Family::Drive) => "a joint is released by `release`; it cannot close again",
                (_, Family::Force) => {
                    "take friction of kind `friction`, which is smooth; dry friction can only be switched off"
                }
                _ => "use a compliant contact, with stiffness and damping",
            };
            Err(Diagnostic::new(word.span.clone(), message).help(help))
        }
        None => {
            let known = parts.order.iter().filter(|name| number(name).is_some_and(|k| can(&elements[k])));
            Err(Diagnostic::unknown(word.span.clone(), what, &word.text, known.map(String::as_str)))
        }
    }
}

impl EventSpec {
    /// Adds the event to a mechanism.
    pub fn build<S: Scalar>(&self, sensors: &mut Sensors<'_>, context: &mut BuildContext<S>, b: &[S]) -> Result<()> {
        let (terms, formula) = self.condition.build(sensors, context, b)?;
        let formula = formula.expect("the condition is a difference");
        let action = |&(change, element): &(EventEffect, usize)| {
            let Added::Element(element) = context.elements[element] else { unreachable!("such a part was refused") };
            match change {
                EventEffect::SwitchOn => Action::Activate(element),
                EventEffect::Release | EventEffect::SwitchOff => Action::Deactivate(element),
            }
        };
        let mut actions: Vec<Action> = self.changes.iter().map(action).collect();
        if self.is_terminal {
            actions.push(Action::Terminate);
        }
        let event = context.mechanism.when(&self.name, formula, &terms, &actions)?;
        context.events.push(event);
        Ok(())
    }
}

/// Change of the distance of the points of a released joint from which on it is not drawn: relative to the largest distance, and in m.
#[cfg(feature = "report")]
const APART: [f64; 2] = [1e-3, 1e-8];

/// For each of the `distances` of the two points of a joint along a motion, true if it has come apart there.
#[cfg(feature = "report")]
pub fn came_apart(distances: &[f64]) -> impl Iterator<Item = bool> {
    let first = distances.first().copied().unwrap_or(0.0);
    let largest = distances.iter().copied().fold(0.0, f64::max);
    distances.iter().map(move |distance| (distance - first).abs() > (APART[0] * largest).max(APART[1]))
}
