//! Labels: the key `unit`, which names the unit of values and does not convert them.
//!
//! Plain numbers are in SI units, and so is the value of a formula of known dimension. If a label names another unit, the SI unit is shown
//! in its place, with a note. A file without any number with a unit may be in another consistent system, such as inches, if the
//! labels of its design variables say so. Angles and ratios are the same in every system.

use super::section::{Read, Section};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{ExpressionTree, Node, TextPlace};
use crate::model_file::unit::{Dimension, KnownDimension, Unit};
use crate::problem::DesignVariable;
use toml::de::{DeTable, DeValue};

/// Keys whose texts are not formulas.
const TEXTS: &[&str] = &["title", "name", "unit", "file", "include", "command"];

/// Symbols of units other than SI in which the plain numbers of a file may be.
#[derive(Clone, Debug, Default)]
pub struct Labels {
    own: Vec<String>,
}

impl Labels {
    /// The labels of the design variables, unless a number of the file has a unit.
    pub fn of(file: &DeTable<'_>, variables: &[DesignVariable]) -> Self {
        if file.iter().any(|(key, value)| has_unit(key.get_ref(), value.get_ref())) {
            return Self::default();
        }
        let symbols = variables.iter().flat_map(|variable| symbols(&variable.unit));
        Self { own: symbols.map(str::to_owned).collect() }
    }

    /// The key `unit` of a section whose values are in `unit`, or in SI units. If the label is another unit, logs a note and returns their
    /// true unit.
    pub fn read(&self, section: &Section<'_>, known: Option<KnownDimension>, unit: Option<&Unit>) -> Read<String> {
        let text = section.text("unit")?;
        let (Some(word), Some(known)) = (section.word("unit")?, known) else { return Ok(text) };
        let Some(label) = Unit::parse(&text) else { return Ok(text) };
        // A sine may stand for a length, as a plain number may.
        if known.is_plain_number() && !label.dimension.is_number() {
            return Ok(text);
        }
        let is_like = label.dimension.is_written_like(known.dimension);
        let one = label.of_si(unit.map_or(1.0, |unit| unit.to_si(1.0)));
        let is_own = || !known.dimension.is_number() && unit.is_none() && self.is_own(&label);
        if is_like && ((one - 1.0).abs() <= 1e-12 || is_own()) {
            return Ok(text);
        }
        let shown = match unit {
            Some(unit) => unit.text.clone(),
            None if self.own.is_empty() || known.dimension.is_number() => known.dimension.si_unit(),
            None => String::new(),
        };
        let message = match &shown[..] {
            "" => format!("`{text}` is no unit of these values: each is {}", known.dimension),
            shown => format!("`{text}` is not the unit of these values: they are in {shown}, and are shown so"),
        };
        let note = Diagnostic::new(word.span, message).label("a label, which converts nothing");
        section.source().log.remark(match label.dimension.fits(known.dimension) && section.takes("shown_in") {
            true => note.help(format!("shown_in = \"{text}\" in place of `unit` converts the values")),
            false => note.help("leave `unit` out, or check the formula"),
        });
        Ok(shown)
    }

    /// Returns `true` if design variables have all symbols of a label that are not SI.
    fn is_own(&self, label: &Unit) -> bool {
        let is_si = |symbol: &str| Unit::parse(symbol).is_some_and(|unit| unit.of_si(1.0) == 1.0);
        symbols(&label.text).all(|symbol| is_si(symbol) || self.own.iter().any(|own| own == symbol))
    }
}

/// The symbols in the text of a unit.
fn symbols(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !(c.is_alphabetic() || c == '°' || c == '%')).filter(|symbol| !symbol.is_empty())
}

/// Returns `true` if a value contains a number with a unit other than that of an angle or a ratio.
fn has_unit(key: &str, value: &DeValue<'_>) -> bool {
    match value {
        DeValue::String(_) if TEXTS.contains(&key) => false,
        DeValue::String(text) if key == "shown_in" => Unit::parse(text).is_some_and(|unit| is_of_system(&unit)),
        DeValue::String(text) => {
            text.contains(|c: char| c.is_ascii_digit())
                && ExpressionTree::parse(text, TextPlace::from(0)).is_ok_and(|tree| of_tree(&tree))
        }
        DeValue::Array(items) => items.iter().any(|item| has_unit(key, item.get_ref())),
        DeValue::Table(table) => table.iter().any(|(key, value)| has_unit(key.get_ref(), value.get_ref())),
        _ => false,
    }
}

fn is_of_system(unit: &Unit) -> bool {
    !unit.dimension.is_number()
}

fn of_tree(tree: &ExpressionTree) -> bool {
    // Without recursion: a sum may have a thousand terms.
    let mut left = vec![tree];
    while let Some(tree) = left.pop() {
        match &tree.node {
            Node::Quantity(_, unit) if is_of_system(unit) => return true,
            node => left.extend(node.parts()),
        }
    }
    false
}

/// The dimension of a time, for the label of time points.
pub fn time() -> Option<KnownDimension> {
    KnownDimension::loose(Unit::parse("s").map_or(Dimension::NUMBER, |unit| unit.dimension))
}
