//! `[[output]]`: responses of the analysis.

use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::label::Labels;
use super::measured::MeasuredFormula;
#[cfg(feature = "report")]
use super::measures::MeasureRef;
use super::measures::Sensors;
use super::parts::{BuildContext, Parts};
use super::section::{Read, Section, Value, Word, find, ordered, tree};
use crate::Result;
use crate::model_file::expression::{CompiledExpression, ExpressionTree, Inputs, Names, OtherUnit, Scope};
use crate::model_file::unit::{KnownDimension, Unit};
use crate::model_file::{Diagnostic, limits};
use crate::problem::{DesignVariable, Intermediate, IntermediateMap, Intermediates, TimeGrid};
use crate::responses::mechanism::{ModalQuantity, NaturalFrequency};
use autodiff::Scalar;
use mechanics::mechanism::EventSide;
use std::f64::consts::PI;
use toml::de::DeValue;

const KEYS: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    optional("value", Accepts::Quantity, "a formula of measures such as `crank.theta`, of the design and of `time`")
        .of_any_unit(),
    optional(
        "frequency",
        Accepts::Count,
        "in place of `value`, with the analysis `statics`: number of a natural frequency, from 1, the lowest; in rad/s",
    ),
    optional(
        "mode",
        Accepts::Count,
        "with the analysis `statics`: number of a natural mode, from 1, the lowest; the output is the amplitude of `value` in this mode, \
         whose shape is normalized by mass",
    ),
    optional(
        "program",
        Accepts::Choice(&["history", "number"]),
        "in place of `value`, with the analysis `program`: its answer is a number for each time point, or one number",
    ),
    optional(
        "at_event",
        Accepts::Name,
        "an event: the output is a number, its value just before this event; of `time` it is the time of the event",
    ),
    optional(
        "after_event",
        Accepts::Name,
        "an event: the output is a number, its value just after this event, with the forces and joints that it changes",
    ),
    default("unit", Accepts::Text, "", "unit, for tables and axes"),
    SHOWN_IN,
    optional("linear_in", Accepts::Intermediate, "intermediate variables in which the output is linearized"),
    EACH,
];

/// The key of [`shown_in`].
pub const SHOWN_IN: Key = optional(
    "shown_in",
    Accepts::Text,
    "in place of `unit`: a unit such as \"mm\", to which the values in SI are converted for tables and axes",
);

/// The unit to which values are converted, if the section has `shown_in`.
pub fn shown_in(section: &Section<'_>) -> Read<Option<Unit>> {
    let Some(word) = section.word("shown_in")? else { return Ok(None) };
    if section.has("unit") {
        let message = "`unit` and `shown_in` exclude each other";
        return Err(section.error_at("unit", message).help("`unit` is a label; `shown_in` converts the values"));
    }
    match Unit::parse(&word.text) {
        Some(unit) => Ok(Some(unit)),
        None => Err(Diagnostic::unknown(word.span, "unit", &word.text, Unit::known())),
    }
}

/// The formula in a unit, whose dimension it must have if its own is known.
pub fn converted(tree: ExpressionTree, known: Option<KnownDimension>, unit: &Unit) -> Read<ExpressionTree> {
    match known.filter(|known| !(unit.dimension.fits(known.dimension) || !known.is_firm && known.dimension.is_number()))
    {
        None => Ok(tree.per(unit)),
        Some(known) => {
            let message = format!("this is {}, and cannot be shown in {}", known.dimension, unit.text);
            let error = Diagnostic::new(tree.span, message);
            Err(match unit.dimension.is_like(known.dimension) {
                true if unit.dimension.counts_cycles() => {
                    error.help("write shown_in = \"rpm\" or \"rev/s\", or divide by 2*pi, which gives the frequency")
                }
                true => error.help("multiply it by 2*pi, which gives the angular velocity"),
                false => error,
            })
        }
    }
}

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] =
    &[TableKeys { name: "output", kind: None, about: "a response of the analysis", keys: KEYS }];

/// The event, by its number, and the side of it at which an output has its value; whether it is an error that it does not happen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AtEvent {
    pub event: usize,
    pub side: EventSide,
    pub is_required: bool,
}

/// A response.
#[derive(Clone, Debug)]
pub struct OutputSpec {
    pub name: String,
    pub unit: String,
    /// The unit of the values, if `unit` is not just a label.
    pub shown_in: Option<Unit>,
    /// The dimension, as far as it is known.
    known: Option<KnownDimension>,
    pub formula: MeasuredFormula,
    /// The quantity of a natural mode: a natural frequency in place of the formula, or the amplitude of the formula.
    pub modal: Option<ModalQuantity>,
    /// The event at which the output has its value.
    event: Option<AtEvent>,
    /// `true` if the output has a value at each time point.
    pub is_transient: bool,
    pub intermediates: Intermediates,
}

impl OutputSpec {
    /// This history at an event, as a number.
    pub fn at_event(&self, name: String, at: AtEvent) -> Self {
        Self { name, event: Some(at), is_transient: false, ..self.clone() }
    }

    /// The time of an event in s.
    pub fn time_of_event(name: String, at: AtEvent) -> Self {
        Self {
            name,
            unit: "s".to_owned(),
            shown_in: None,
            known: None,
            formula: MeasuredFormula::time(),
            modal: None,
            event: Some(at),
            is_transient: false,
            intermediates: Intermediates::Identity,
        }
    }

    /// True for an ordinary value of the formula: neither a quantity of a natural mode nor a value at an event.
    pub fn is_plain(&self) -> bool {
        self.modal.is_none() && self.event.is_none()
    }
}

/// Reads the outputs. With a mechanism they are histories of its measures.
pub fn read(
    file: &Section<'_>,
    names: &Names,
    parts: Option<&Parts>,
    variables: &[DesignVariable],
    has_program: bool,
    grid: Option<&TimeGrid>,
    labels: &Labels,
) -> Read<Vec<OutputSpec>> {
    let mut outputs: Vec<OutputSpec> = vec![];
    let points = grid.map_or(1, TimeGrid::len);
    let kind = file.get("analysis").and_then(|value| value.get_ref().as_table()?.get("kind")?.get_ref().as_str());
    let is_static = parts.is_some() && kind == Some("statics");
    let (factor, of) =
        if points >= variables.len() { (points, "time points") } else { (variables.len(), "design variables") };
    let most = limits::VALUES / factor.max(1);
    file.read_each("output", |table, span| {
        let section = Section::of(table, span, "output", &[KEYS], file.source())?;
        let word = section.need_word("name")?;
        names.check(&word.text, word.span.clone())?;
        if outputs.iter().any(|o| o.name == word.text) {
            return Err(Diagnostic::used_again(word.span, &word.text));
        }
        if outputs.len() >= most {
            let (count, limit) = (outputs.len() + 1, limits::VALUES);
            let message = format!("{count} outputs × {factor} {of} exceed the limit of {limit} values");
            return Err(section.error_at("name", message));
        }
        outputs.push(match has_program {
            true => output_of_program(word.text, &section, names, variables)?,
            false if section.has("frequency") => {
                natural_frequency(word.text, &section, names, variables, labels, is_static)?
            }
            false => output(word.text, &section, names, parts, variables, labels, is_static)?,
        });
        Ok(())
    })?;
    Ok(outputs)
}

fn output(
    name: String,
    section: &Section<'_>,
    names: &Names,
    parts: Option<&Parts>,
    variables: &[DesignVariable],
    labels: &Labels,
    is_static: bool,
) -> Read<OutputSpec> {
    let modal = mode(section, is_static)?.map(ModalQuantity::Amplitude);
    if section.has("program") {
        let message = "there is no program that could compute this output";
        return Err(section.error_at("program", message).help("give a `value`, or [analysis] with kind = \"program\""));
    }
    let Some(tree) = section.tree("value")? else {
        return Err(section.error_at("value", format!("{} lacks `value`", section.title)));
    };
    let (shown_in, mut known) = (shown_in(section)?, None);
    let formula = MeasuredFormula::compile(tree, "`value`", names, parts, |tree, dimension| {
        known = dimension;
        match &shown_in {
            Some(unit) => converted(tree, dimension, unit),
            None => Ok(tree),
        }
    })?;
    let event = at_event(section, parts)?;
    let unit = match (modal, &shown_in) {
        // The unit of an amplitude is that of the value per unit of the modal coordinate.
        (Some(_), _) => {
            known = None;
            section.text("unit")?
        }
        (None, Some(unit)) => unit.text.clone(),
        (None, None) => labels.read(section, known, None)?,
    };
    Ok(OutputSpec {
        name,
        unit,
        known: shown_in.as_ref().map(|unit| KnownDimension { dimension: unit.dimension, is_firm: true }).or(known),
        shown_in,
        is_transient: event.is_none() && (parts.is_some() || formula.expression.uses_time()),
        formula,
        modal,
        event,
        intermediates: intermediates(section, "linear_in", names, variables)?,
    })
}

/// The keys of [`AtEvent`], for its two sides.
const EVENT_KEYS: [&str; 2] = ["at_event", "after_event"];

/// The event at which an output has its value, if the section has one.
fn at_event(section: &Section<'_>, parts: Option<&Parts>) -> Read<Option<AtEvent>> {
    if EVENT_KEYS.into_iter().all(|key| section.has(key)) {
        let error = section.error_at("after_event", "`at_event` and `after_event` exclude each other");
        return Err(error.help("write two outputs for the two sides of an event"));
    }
    for (key, side) in EVENT_KEYS.into_iter().zip([EventSide::Before, EventSide::After]) {
        match (section.word(key)?, parts) {
            (None, _) => {}
            (Some(word), Some(parts)) => {
                return Ok(Some(AtEvent { event: parts.event(&word)?, side, is_required: true }));
            }
            (Some(word), None) => return Err(Diagnostic::new(word.span, "events belong to a mechanism")),
        }
    }
    Ok(None)
}

fn output_of_program(
    name: String,
    section: &Section<'_>,
    names: &Names,
    variables: &[DesignVariable],
) -> Read<OutputSpec> {
    if let Some(key) = EVENT_KEYS.into_iter().find(|key| section.has(key)) {
        return Err(section.error_at(key, "events belong to a mechanism, and a program computes this output"));
    }
    if section.has("shown_in") {
        return Err(section
            .error_at("shown_in", "the program gives its outputs as they are shown")
            .help("give `unit`"));
    }
    let help = "with kind = \"program\" an output has program = \"history\" or program = \"number\"";
    if section.has("value") {
        let message = "the program computes the outputs, so they have no `value`";
        return Err(section.error_at("value", message).help(help));
    }
    if !section.has("program") {
        return Err(section.error_at("program", format!("{} lacks `program`", section.title)).help(help));
    }
    Ok(OutputSpec {
        name,
        unit: section.text("unit")?,
        shown_in: None,
        known: None,
        is_transient: section.choice("program", &[("history", true), ("number", false)])?,
        formula: MeasuredFormula::constant(0.0),
        modal: None,
        event: None,
        intermediates: intermediates(section, "linear_in", names, variables)?,
    })
}

/// The number of the mode, from zero, in which an output has its amplitude.
fn mode(section: &Section<'_>, is_static: bool) -> Read<Option<usize>> {
    let Some(number) = section.count("mode", limits::ELEMENTS)? else { return Ok(None) };
    if !is_static {
        let message = "modes are those of small vibrations about a static equilibrium";
        return Err(section.error_at("mode", message).help("use [analysis] with kind = \"statics\""));
    }
    if let Some(key) = ["at_event", "after_event", "shown_in"].into_iter().find(|key| section.has(key)) {
        let message = format!("`{key}` and `mode` exclude each other");
        return Err(section.error_at(key, message).help("`unit` is the label of an amplitude, such as \"1/√kg\""));
    }
    match number.checked_sub(1) {
        Some(mode) => Ok(Some(mode)),
        None => Err(section.error_at("mode", "modes are counted from 1, that of the lowest frequency")),
    }
}

fn natural_frequency(
    name: String,
    section: &Section<'_>,
    names: &Names,
    variables: &[DesignVariable],
    labels: &Labels,
    is_static: bool,
) -> Read<OutputSpec> {
    if !is_static {
        let message = "natural frequencies are those of small vibrations about a static equilibrium";
        return Err(section.error_at("frequency", message).help("use [analysis] with kind = \"statics\""));
    }
    if let Some(key) = ["value", "mode", "at_event", "after_event", "program"].into_iter().find(|key| section.has(key))
    {
        return Err(section.error_at(key, format!("`{key}` and `frequency` exclude each other")));
    }
    let number = section.count("frequency", limits::ELEMENTS)?.unwrap_or(1);
    let Some(mode) = number.checked_sub(1) else {
        return Err(section.error_at("frequency", "natural frequencies are counted from 1, the lowest one"));
    };
    let natural = Unit::parse("rad/s").expect("it is a unit");
    let shown_in = shown_in(section)?;
    if let Some(unit) = shown_in.as_ref().filter(|unit| !unit.dimension.is_like(natural.dimension)) {
        let message = format!("a natural frequency is in rad/s, and cannot be shown in {}", unit.text);
        return Err(section.error_at("shown_in", message));
    }
    let dimension = shown_in.as_ref().map_or(natural.dimension, |unit| unit.dimension);
    // Revolutions per second are converted, as they are not an angular velocity in rad/s.
    let of_turns = if dimension.is_written_like(natural.dimension) { 1.0 } else { 2.0 * PI };
    let unit = shown_in.as_ref().map_or(1.0, |unit| of_turns * unit.to_si(1.0));
    Ok(OutputSpec {
        name,
        unit: match &shown_in {
            Some(unit) => unit.text.clone(),
            None if section.has("unit") => labels.read(section, KnownDimension::loose(natural.dimension), None)?,
            None => "rad/s".to_owned(),
        },
        known: Some(KnownDimension { dimension, is_firm: true }),
        shown_in,
        is_transient: true,
        formula: MeasuredFormula::constant(0.0),
        modal: Some(ModalQuantity::Frequency(NaturalFrequency { mode, unit })),
        event: None,
        intermediates: intermediates(section, "linear_in", names, variables)?,
    })
}

const WORDS: &[(&str, Intermediate)] = &[
    ("identity", Intermediate::Identity),
    ("reciprocal", Intermediate::Reciprocal),
    ("area", Intermediate::AreaOfDiameter),
];

/// Intermediate variables: one choice for all design variables, or a table of choices, or of expressions.
pub fn intermediates(
    section: &Section<'_>,
    key: &str,
    names: &Names,
    variables: &[DesignVariable],
) -> Read<Intermediates> {
    let Some(value) = section.get(key) else { return Ok(Intermediates::Identity) };
    let choice = |value: &Value<'_>| -> Read<Intermediate> {
        match value.get_ref() {
            DeValue::String(text) => {
                find(&Word { text: text.to_string(), span: value.span() }, "intermediate variable", WORDS)
            }
            _ => Ok(Intermediate::Power(names.evaluate(&tree(value, key, section.source())?, key, "1")?)),
        }
    };
    let Some(table) = value.get_ref().as_table() else {
        return Ok(Intermediates::all(variables.len(), choice(value)?));
    };
    let mut each = vec![Intermediate::Identity; variables.len()];
    let mut expressions: Vec<CompiledExpression> = (0..variables.len()).map(CompiledExpression::variable).collect();
    let mut is_map = false;
    for (word, value) in ordered(table) {
        let Some(k) = variables.iter().position(|v| v.name == word.text) else {
            let known = variables.iter().map(|v| v.name.as_str());
            return Err(Diagnostic::unknown(word.span, "design variable", &word.text, known));
        };
        match value.get_ref() {
            // Any other text is a formula of the whole design.
            DeValue::String(text) if !WORDS.iter().any(|(w, _)| w == text) => {
                expressions[k] = names.compile(&tree(value, key, section.source())?, &Scope::DESIGN)?;
                is_map = true;
            }
            _ => each[k] = choice(value)?,
        }
    }
    Ok(if is_map { Intermediates::map(FormulaMap { each, expressions }) } else { Intermediates::Each(each) })
}

/// Intermediate variables of which some are formulas of the whole design.
struct FormulaMap {
    each: Vec<Intermediate>,
    expressions: Vec<CompiledExpression>,
}

impl IntermediateMap for FormulaMap {
    fn component<S: Scalar>(&self, k: usize, design: &[S]) -> S {
        // The variable that bounds a peak is not transformed.
        match (self.each.get(k), self.expressions.get(k)) {
            (Some(Intermediate::Identity), Some(expression)) => expression.value(&Inputs::design(design)),
            (Some(choice), _) => choice.of(design[k]),
            _ => design[k],
        }
    }
}

impl OutputSpec {
    /// A history of one measure, for drawings.
    #[cfg(feature = "report")]
    pub fn of_measure(name: String, measure: MeasureRef) -> Self {
        Self {
            name,
            unit: String::new(),
            shown_in: None,
            known: None,
            formula: MeasuredFormula::of_measure(measure),
            modal: None,
            event: None,
            is_transient: true,
            intermediates: Intermediates::Identity,
        }
    }

    /// The dimension of the output in formulas, as far as it is known.
    pub fn other_unit(&self) -> Option<OtherUnit> {
        Some(OtherUnit { known: self.known?, shown: self.shown_in.clone() })
    }

    /// Adds the output to a mechanism.
    pub fn build<S: Scalar>(&self, sensors: &mut Sensors<'_>, context: &mut BuildContext<S>, b: &[S]) -> Result<()> {
        let (terms, formula) = self.formula.build(sensors, context, b)?;
        match formula {
            None => context.mechanism.output(&self.name, &terms),
            Some(formula) => context.mechanism.output_formula(&self.name, formula, &terms),
        }
        if let Some(event) = self.event {
            let AtEvent { event, side, is_required } = event;
            context.mechanism.hold_output_on(side, context.events[event], is_required);
        }
        Ok(())
    }
}
