//! Design variables, constants and named expressions.

use super::axis;
use super::key::{Accepts, Key, default, optional, required};
use super::section::{Read, Section, ordered, tree, wrong_type};
use crate::Readable;
use crate::model_file::expression::{ExpressionTree, Names, Scope, TableFunction};
use crate::model_file::unit::{KnownDimension, Unit};
use crate::model_file::{Diagnostic, limits};
use crate::problem::DesignVariable;

pub const DESIGN: &[Key] = &[
    required(
        "start",
        Accepts::Number,
        "start value; with a unit, as in \"120 mm\", tables and axes show the variable in this unit",
    )
    .of_any_unit(),
    optional("lower", Accepts::Number, "lower bound; none by default").of_any_unit(),
    optional("upper", Accepts::Number, "upper bound; none by default").of_any_unit(),
    default("unit", Accepts::Text, "", "unit for tables and axes; values with units are converted to it"),
];

/// Keys of `[table.NAME]`.
pub const TABLE: &[Key] = &[
    optional("x", Accepts::Numbers, "increasing numbers").of_any_unit(),
    optional("y", Accepts::Numbers, "the values at these numbers").of_any_unit(),
    optional("file", Accepts::Text, "in place of both: a file with two columns, in the folder of this one or below"),
    default(
        "interpolation",
        Accepts::Choice(&["cubic", "linear"]),
        "cubic",
        "between the points: a natural cubic spline, or straight lines; beyond the ends it is extrapolated linearly",
    ),
];

/// A constant of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Constant {
    /// Its name.
    pub name: String,
    /// Its value, in its unit.
    pub value: f64,
    /// The unit with which it is written; without one, the value is in SI.
    pub unit: Option<Unit>,
}

/// Design variables, whose values have not been read yet, and constants.
pub struct NamedNumbers<'a> {
    pub names: Names,
    pub constants: Vec<Constant>,
    designs: Vec<(String, Section<'a>)>,
    /// Variables with wrong units, whose numbers cannot be checked.
    without_unit: Vec<String>,
}

/// A design variable with the unit of its values.
pub struct VariableUnit {
    pub name: String,
    /// The unit, or the key `unit`; may be empty.
    pub label: String,
    pub unit: Option<Unit>,
}

impl NamedNumbers<'_> {
    /// The units of the design variables.
    pub fn units(&self) -> Read<Vec<VariableUnit>> {
        let one = |(name, section): &(String, Section<'_>)| {
            let unit = self.names.unit_of(name).cloned();
            let label = unit.as_ref().map_or_else(|| section.text("unit"), |unit| Ok(unit.text.clone()))?;
            Ok(VariableUnit { name: name.clone(), label, unit })
        };
        self.designs.iter().map(one).collect()
    }
}

/// Reads `[constants]`, and names and units of `[design]`.
pub fn read_names<'a>(file: &Section<'a>) -> Read<NamedNumbers<'a>> {
    let mut names = Names::default();
    let designs = designs(file)?;
    let log = file.source().log;
    for (name, design) in &designs {
        log.locate(name, design.span.clone());
        if log.keep(names.check(name, design.span.clone())).is_none() {
            log.poison_all();
        }
        names.design(name);
    }
    let constants = constants(file, &mut names);
    let mut without_unit = vec![];
    for (name, design) in &designs {
        match log.keep(unit_of(design, &names)) {
            Some(unit) => unit.into_iter().for_each(|unit| names.set_unit(name, unit)),
            None => without_unit.push(name.clone()),
        }
    }
    Ok(NamedNumbers { names, constants: constants?, designs, without_unit })
}

/// Reads `[constants]`, `[design]`, `[table]` and `[expressions]`.
pub fn read(file: &Section<'_>) -> Read<(Names, Vec<DesignVariable>, Vec<Constant>)> {
    let NamedNumbers { mut names, constants, designs, without_unit } = read_names(file)?;
    let log = file.source().log;
    tables(file, &mut names)?;
    names.set_axis(axis::read_name(file, &names)?);
    // A variable with errors is defined nevertheless, because other parts of the file name it.
    let read = |(name, section): &(String, Section<'_>)| {
        let is_known = !without_unit.contains(name);
        let variable = is_known.then(|| log.keep(variable(name, section, &names))).flatten();
        variable.unwrap_or_else(|| DesignVariable::new(name, "", 0.0))
    };
    let variables = designs.iter().map(read).collect();
    expressions(file, &mut names)?;
    Ok((names, variables, constants))
}

/// The sections `[design.NAME]` in the order of the file.
fn designs<'a>(file: &Section<'a>) -> Read<Vec<(String, Section<'a>)>> {
    let Some(value) = file.get("design") else { return Ok(vec![]) };
    let Some(table) = value.get_ref().as_table() else {
        return Err(wrong_type(value, "`design`", "tables [design.NAME]"));
    };
    if table.len() > limits::VARIABLES {
        let message = format!("{} design variables are too many, at most {} are read", table.len(), limits::VARIABLES);
        return Err(file.error_at("design", message));
    }
    let mut found = vec![];
    for (word, value) in ordered(table) {
        let title = format!("design variable `{}`", word.text);
        match file.source().log.keep(Section::open(value, &title, &[DESIGN], file.source())) {
            Some(mut section) => {
                section.span = word.span;
                found.push((word.text, section));
            }
            None => file.source().log.poison(&word.text),
        }
    }
    Ok(found)
}

/// The unit of the values of a design variable: `unit`, or that of `start`; if a formula gives the start, that of its dimension in the
/// formula or of a bound. `None` if `start` has none: then `unit` is a label.
fn unit_of(section: &Section<'_>, names: &Names) -> Read<Option<Unit>> {
    let Some(start) = section.tree("start")? else { return Ok(None) };
    let known = names.dimension(&start, &Scope::NUMBER)?;
    let bounds = ["lower", "upper"].into_iter().filter_map(|key| section.tree(key).ok()??.unit().cloned()).collect();
    let Some(own) = unit_of_number(&start, known, bounds) else { return Ok(None) };
    let Some(word) = section.word("unit")? else { return Ok(Some(own)) };
    let Some(unit) = Unit::parse(&word.text) else {
        let error = Diagnostic::unknown(word.span, "unit", &word.text, Unit::known());
        return Err(error);
    };
    if unit.dimension == own.dimension {
        return Ok(Some(unit));
    }
    let message = format!("`unit` is {}, and the start is {}", unit.dimension, own.dimension);
    Err(Diagnostic::new(word.span, message).help("leave `unit` out, or give one of the same kind"))
}

/// The unit of a number: the one with which it is written. That of a formula is the first one of its dimension among its own and `others`,
/// or the SI unit; if the dimension is not known, the first of the others. Angles and numbers that a formula gives have none.
fn unit_of_number(tree: &ExpressionTree, known: Option<KnownDimension>, others: Vec<Unit>) -> Option<Unit> {
    if let Some(unit) = tree.unit() {
        return Some(unit.clone());
    }
    match known.filter(|known| known.is_firm) {
        Some(KnownDimension { dimension, .. }) if dimension.is_number() => None,
        Some(KnownDimension { dimension, .. }) => {
            let all = tree.units().into_iter().chain(others);
            all.into_iter().find(|unit| unit.dimension == dimension).or_else(|| Unit::parse(&dimension.si_unit()))
        }
        None if tree.is_formula() => others.into_iter().find(|unit| !unit.dimension.is_number()),
        None => None,
    }
}

/// The design variable of a table with the keys [`DESIGN`].
pub fn variable(name: &str, section: &Section<'_>, names: &Names) -> Read<DesignVariable> {
    let unit = names.unit_of(name);
    let start = number_in(unit, "start", section, names)?.unwrap_or(f64::NAN);
    let variable = variable_from(start, name, section, names, unit)?;
    Ok(match unit {
        Some(unit) => DesignVariable { unit: unit.text.clone(), ..variable },
        None => variable,
    })
}

/// The number of a key in a unit, or in SI without one. A value and the unit of its variable have the same dimension.
fn number_in(unit: Option<&Unit>, key: &str, section: &Section<'_>, names: &Names) -> Read<Option<f64>> {
    let Some(tree) = section.tree(key)? else { return Ok(None) };
    let known = names.dimension(&tree, &Scope::NUMBER)?;
    match unit {
        None if known.is_some_and(|known| known.is_firm && !known.dimension.is_number()) => {
            let message = format!("`{key}` has a unit, and the start has none");
            Err(Diagnostic::new(tree.span, message).help("write the start with its unit, as in start = \"120 mm\""))
        }
        None => section.number(key, names),
        Some(unit) if tree.as_number().is_some_and(|number| number != 0.0) => {
            let number = Readable(tree.as_number().unwrap_or(0.0));
            let message = format!("the start has the unit {}, and `{key}` has none", unit.text);
            Err(Diagnostic::new(tree.span, message).help(format!("for instance \"{number} {}\"", unit.text)))
        }
        Some(unit) => names.evaluate_in(&tree, key, unit).map(Some),
    }
}

/// As [`variable`], with a start value that may be from elsewhere.
pub fn variable_from(
    start: f64,
    name: &str,
    section: &Section<'_>,
    names: &Names,
    unit: Option<&Unit>,
) -> Read<DesignVariable> {
    let bound = |key, none| Ok(number_in(unit, key, section, names)?.unwrap_or(none));
    let (lower, upper) = (bound("lower", f64::NEG_INFINITY)?, bound("upper", f64::INFINITY)?);
    let shown = |numbers: [f64; 3]| {
        let unit = unit.map_or("", |unit| unit.text.as_str());
        // At most nine digits.
        let rounded = |number: f64| format!("{number:.8e}").parse().unwrap_or(number);
        numbers.map(|number| format!("{} {unit}", Readable(rounded(number))).trim_end().to_owned())
    };
    if lower > upper {
        let [lower, upper, _] = shown([lower, upper, start]);
        let message = format!("the lower bound {lower} of `{name}` is above the upper bound {upper}");
        return Err(section.error_at("lower", message).help("raise the upper bound or lower the lower bound"));
    }
    if !(section.source().is_of_run || (lower..=upper).contains(&start)) {
        let [start, lower, upper] = shown([start, lower, upper]);
        let message = format!("the start {start} of `{name}` is outside its bounds, {lower} to {upper}");
        return Err(section.error_at("start", message).help("move the start inside or widen the bounds"));
    }
    Ok(DesignVariable::new(name, section.text("unit")?, start).within(lower, upper))
}

fn tables(file: &Section<'_>, names: &mut Names) -> Read<()> {
    let Some(value) = file.get("table") else { return Ok(()) };
    let Some(tables) = value.get_ref().as_table() else {
        return Err(wrong_type(value, "`table`", "tables [table.NAME]"));
    };
    let log = file.source().log;
    for (word, value) in ordered(tables) {
        let read = names.check(&word.text, word.span.clone()).and_then(|()| {
            let section = Section::open(value, &format!("table `{}`", word.text), &[TABLE], file.source())?;
            let list = |key: &str| match section.numbers(key, names)? {
                Some(list) => Ok(list),
                None => Err(section
                    .error_at(key, format!("{} lacks `{key}`", section.title))
                    .help("give x and y, or a file")),
            };
            let is_cubic = section.choice("interpolation", &[("cubic", true), ("linear", false)])?;
            let (x, y) = (list("x")?, list("y")?);
            if x.len() != y.len() {
                let message = format!("{} has {} x and {} y", section.title, x.len(), y.len());
                return Err(section.error_at("y", message));
            }
            TableFunction::new(x, y, is_cubic).map_err(|_| {
                let message = format!("`x` of {} must have two or more increasing numbers", section.title);
                section.error_at("x", message)
            })
        });
        match log.keep(read) {
            Some(table) => names.table(&word.text, table),
            None => log.poison(&word.text),
        }
    }
    Ok(())
}

fn constants(file: &Section<'_>, names: &mut Names) -> Read<Vec<Constant>> {
    let trees = named(file, "constants", names)?;
    names.expressions(trees.clone())?;
    let (mut all, mut last) = (vec![], Ok(()));
    for (name, tree) in trees {
        let known = names.dimension(&tree, &Scope::NUMBER).ok().flatten();
        match names.evaluate(&tree, &name, "") {
            Ok(si) => {
                names.define_constant(&name, si, known);
                let unit = unit_of_number(&tree, known, vec![]);
                let value = unit.as_ref().map_or(si, |unit| tree.number_of(unit, si));
                unit.iter().for_each(|unit| names.set_constant_unit(&name, unit.clone()));
                all.push(Constant { name, value, unit });
            }
            // Bounds and limits need the constants, so reading ends with the first wrong one.
            Err(error) => last = last.and(Err(error)).inspect_err(|e: &Diagnostic| file.source().log.note(e.clone())),
        }
    }
    last.map(|()| all)
}

fn expressions(file: &Section<'_>, names: &mut Names) -> Read<()> {
    let trees = named(file, "expressions", names)?;
    names.expressions(trees.clone())?;
    for (name, tree) in &trees {
        if file.source().log.keep(names.compile(tree, &Scope::MOTION)).is_none() {
            // The value does not matter: references to the expression must not cause further errors.
            names.define_constant(name, 1.0, None);
        }
    }
    Ok(())
}

/// Names and parsed expressions of a table.
fn named(file: &Section<'_>, key: &str, names: &Names) -> Read<Vec<(String, ExpressionTree)>> {
    let Some(value) = file.get(key) else { return Ok(vec![]) };
    let Some(table) = value.get_ref().as_table() else { return Err(wrong_type(value, &format!("`{key}`"), "a table")) };
    let mut found = vec![];
    for (word, value) in ordered(table) {
        let read = names.check(&word.text, word.span).and_then(|()| tree(value, &word.text, file.source()));
        match file.source().log.keep(read) {
            Some(tree) => found.push((word.text, tree)),
            None => file.source().log.poison(&word.text),
        }
    }
    Ok(found)
}

/// Rejects a file without design variables. Those with errors count.
pub fn check_any(file: &Section<'_>) -> Read<()> {
    let tables = file.get("design").and_then(|value| value.get_ref().as_table());
    if tables.is_some_and(|tables| !tables.is_empty()) {
        return Ok(());
    }
    let help = "add a table such as\n    [design.length]\n    start = 1.0";
    Err(Diagnostic::new(file.span.start..file.span.start, "there is no design variable").help(help))
}
