//! Design variables, constants and named expressions.

use super::key::{Accepts, Key, default, optional, required};
use super::section::{Read, Section, constant, ordered, tree, wrong_type};
use crate::Readable;
use crate::model_file::expression::{Names, Scope, Tree};
use crate::model_file::{Diagnostic, limits};
use crate::problem::DesignVariable;

pub const DESIGN: &[Key] = &[
    required("start", Accepts::Number, "start value, in the unit"),
    optional("lower", Accepts::Number, "lower bound; none by default"),
    optional("upper", Accepts::Number, "upper bound; none by default"),
    default("unit", Accepts::Text, "", "unit, for tables and axes"),
];

/// Reads `[constants]`, `[design]` and `[expressions]`.
pub fn read(file: &Section<'_>) -> Read<(Names, Vec<DesignVariable>)> {
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
    constants(file, &mut names)?;
    // A variable with errors is defined nevertheless, because other parts of the file name it.
    let read = |(name, section): &(String, Section<'_>)| {
        log.keep(variable(name, section, &names)).unwrap_or_else(|| DesignVariable::new(name, "", 0.0))
    };
    let variables = designs.iter().map(read).collect();
    expressions(file, &mut names)?;
    Ok((names, variables))
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

/// The design variable of a table with the keys [`DESIGN`].
pub fn variable(name: &str, section: &Section<'_>, names: &Names) -> Read<DesignVariable> {
    let start = section.number("start", names)?.unwrap_or(f64::NAN);
    variable_from(start, name, section, names)
}

/// As [`variable`], with a start value that may be from elsewhere.
pub fn variable_from(start: f64, name: &str, section: &Section<'_>, names: &Names) -> Read<DesignVariable> {
    let bound = |key, none| Ok(section.number(key, names)?.unwrap_or(none));
    let (lower, upper) = (bound("lower", f64::NEG_INFINITY)?, bound("upper", f64::INFINITY)?);
    if lower > upper {
        let [lower, upper] = [lower, upper].map(Readable);
        let message = format!("the lower bound {lower} of `{name}` is above the upper bound {upper}");
        return Err(section.error_at("lower", message).help("raise the upper bound or lower the lower bound"));
    }
    if !(lower..=upper).contains(&start) {
        let [start, lower, upper] = [start, lower, upper].map(Readable);
        let message = format!("the start {start} of `{name}` is outside its bounds {lower} to {upper}");
        return Err(section.error_at("start", message).help("move the start inside or widen the bounds"));
    }
    Ok(DesignVariable::new(name, section.text("unit")?, start).within(lower, upper))
}

fn constants(file: &Section<'_>, names: &mut Names) -> Read<()> {
    let trees = named(file, "constants", names)?;
    names.expressions(trees.clone())?;
    let mut last = Ok(());
    for (name, tree) in &trees {
        match constant(tree, name, names) {
            Ok(value) => names.define_constant(name, value),
            // Bounds and limits need the constants, so reading ends with the first wrong one.
            Err(error) => last = last.and(Err(error)).inspect_err(|e: &Diagnostic| file.source().log.note(e.clone())),
        }
    }
    last
}

fn expressions(file: &Section<'_>, names: &mut Names) -> Read<()> {
    let trees = named(file, "expressions", names)?;
    names.expressions(trees.clone())?;
    for (name, tree) in &trees {
        if file.source().log.keep(names.compile(tree, &Scope::MOTION)).is_none() {
            // Any number: references to the expression raise no follow-up errors.
            names.define_constant(name, 1.0);
        }
    }
    Ok(())
}

/// Names and parsed expressions of a table.
fn named(file: &Section<'_>, key: &str, names: &Names) -> Read<Vec<(String, Tree)>> {
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

/// Rejects a file without design variables.
pub fn check_any(variables: &[DesignVariable], file: &Section<'_>) -> Read<()> {
    if !variables.is_empty() {
        return Ok(());
    }
    let help = "add a table such as\n    [design.length]\n    start = 1.0";
    Err(Diagnostic::new(file.span.start..file.span.start, "there is no design variable").help(help))
}
