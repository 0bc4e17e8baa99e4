//! `[[output]]`: responses of the analysis.

use super::key::{Accepts, EACH, Key, Table, default, optional, required};
use super::measures::{self, Measure, Sensors};
use super::parts::{BuildContext, Parts};
use super::section::{Read, Section, Value, Word, constant, find, ordered, tree};
use crate::Result;
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use crate::model_file::{Diagnostic, limits};
use crate::problem::{DesignVariable, Intermediate, IntermediateMap, Intermediates, TimeGrid};
use autodiff::Scalar;
use mechanics::mechanism::Formula;
use mechanics::mechanism::Term;
use std::cell::RefCell;
use toml::de::DeValue;

const KEYS: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    required("value", Accepts::Quantity, "a formula of measures such as `crank.theta`, of the design and of `time`"),
    default("unit", Accepts::Text, "", "unit, for tables and axes"),
    optional("linear_in", Accepts::Intermediate, "intermediate variables in which the output is linearized"),
    EACH,
];

/// Declarations for documentation and schema.
pub const TABLES: &[Table] = &[Table { name: "output", kind: None, about: "a response of the analysis", keys: KEYS }];

/// A response.
#[derive(Clone, Debug)]
pub struct Output {
    pub name: String,
    pub unit: String,
    pub program: Program,
    measures: Vec<Measure>,
    /// Whether the output has a value at each time point.
    pub is_transient: bool,
    pub intermediates: Intermediates,
}

/// Reads the outputs. With a mechanism they are histories of its measures.
pub fn read(
    file: &Section<'_>,
    names: &Names,
    parts: Option<&Parts>,
    variables: &[DesignVariable],
    grid: Option<&TimeGrid>,
) -> Read<Vec<Output>> {
    let mut outputs: Vec<Output> = vec![];
    let points = grid.map_or(1, TimeGrid::len);
    let (factor, of) =
        if points >= variables.len() { (points, "time points") } else { (variables.len(), "design variables") };
    let most = limits::VALUES / factor.max(1);
    file.read_each("output", |table, span| {
        let section = Section::of(table, span, "output", &[KEYS], file.source())?;
        let word = section.need_word("name")?;
        names.check(&word.text, word.span.clone())?;
        if outputs.iter().any(|o| o.name == word.text) {
            return Err(
                Diagnostic::new(word.span, format!("two outputs have the name `{}`", word.text)).label("second use")
            );
        }
        if outputs.len() >= most {
            let (count, limit) = (outputs.len() + 1, limits::VALUES);
            let message = format!("{count} outputs × {factor} {of} exceed the limit of {limit} values");
            return Err(section.error_at("name", message));
        }
        outputs.push(output(word.text, &section, names, parts, variables)?);
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
) -> Read<Output> {
    let found = RefCell::new(vec![]);
    let others = |text: &str| {
        let measure = measures::find(text, parts?)?;
        let mut found = found.borrow_mut();
        Some(found.iter().position(|known| *known == measure).unwrap_or_else(|| {
            found.push(measure);
            found.len() - 1
        }))
    };
    let suggestions = || parts.map(measures::suggestions).unwrap_or_default();
    let wants = Wants { others: &others, suggestions: &suggestions, ..Wants::MOTION };
    let program = section.program("value", names, &wants)?;
    Ok(Output {
        name,
        unit: section.text("unit")?,
        is_transient: parts.is_some() || program.uses_time(),
        program,
        measures: found.into_inner(),
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
            _ => Ok(Intermediate::Power(constant(&tree(value, key, section.source())?, key, names)?)),
        }
    };
    let Some(table) = value.get_ref().as_table() else {
        return Ok(Intermediates::all(variables.len(), choice(value)?));
    };
    let mut each = vec![Intermediate::Identity; variables.len()];
    let mut programs: Vec<Program> = (0..variables.len()).map(Program::variable).collect();
    let mut is_map = false;
    for (word, value) in ordered(table) {
        let Some(k) = variables.iter().position(|v| v.name == word.text) else {
            let known = variables.iter().map(|v| v.name.as_str());
            return Err(Diagnostic::unknown(word.span, "design variable", &word.text, known));
        };
        match value.get_ref() {
            // Any other text is a formula of the whole design.
            DeValue::String(text) if !WORDS.iter().any(|(w, _)| w == text) => {
                programs[k] = names.compile(&tree(value, key, section.source())?, &Wants::DESIGN)?;
                is_map = true;
            }
            _ => each[k] = choice(value)?,
        }
    }
    Ok(if is_map { Intermediates::map(FormulaMap { each, programs }) } else { Intermediates::Each(each) })
}

/// Intermediate variables of which some are formulas of the whole design.
struct FormulaMap {
    each: Vec<Intermediate>,
    programs: Vec<Program>,
}

impl IntermediateMap for FormulaMap {
    fn component<S: Scalar>(&self, k: usize, design: &[S]) -> S {
        // The variable that bounds a peak has no choice and is not transformed.
        match (self.each.get(k), self.programs.get(k)) {
            (Some(Intermediate::Identity), Some(program)) => program.value(&Inputs::design(design)),
            (Some(choice), _) => choice.of(design[k]),
            _ => design[k],
        }
    }
}

impl Output {
    /// A history of one measure, for drawings.
    #[cfg(feature = "report")]
    pub fn of_measure(name: String, measure: Measure) -> Self {
        Self {
            name,
            unit: String::new(),
            program: Program::other(0),
            measures: vec![measure],
            is_transient: true,
            intermediates: Intermediates::Identity,
        }
    }

    /// Adds the output to a mechanism.
    pub fn build<S: Scalar>(&self, sensors: &mut Sensors<'_>, context: &mut BuildContext<S>, b: &[S]) -> Result<()> {
        let mut terms: Vec<Term<S>> = vec![];
        let mut counts = vec![];
        for measure in &self.measures {
            let of_one = sensors.terms(measure, context, b)?;
            counts.push(of_one.len());
            terms.extend(of_one);
        }
        if self.measures.len() == 1 && self.program.is_other(0) {
            context.mechanism.output(&self.name, &terms);
            return Ok(());
        }
        let used = self.program.uses();
        for &i in &used {
            terms.push(sensors.design(i, context, b)?);
        }
        let formula = MeasureFormula { program: self.program.clone().with_design(&used), counts };
        context.mechanism.output_formula(&self.name, formula, &terms);
        Ok(())
    }
}

/// A formula of quantities, each a sum of `counts` terms, followed by design variables.
struct MeasureFormula {
    program: Program,
    counts: Vec<usize>,
}

impl Formula for MeasureFormula {
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T {
        let mut rest = x;
        let sum = |count: &usize| {
            let (terms, remaining) = rest.split_at(*count);
            rest = remaining;
            terms.iter().copied().sum()
        };
        let others: Vec<T> = self.counts.iter().map(sum).collect();
        self.program.value(&Inputs { design: rest, time: t, others: &others })
    }
}
