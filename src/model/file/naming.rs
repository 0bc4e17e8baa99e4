//! Design variables, constants and named expressions.

use super::key::{Accepts, Key, default, optional, required};
use super::section::{Read, Section, constant, tree, wrong_type};
use crate::model::Complaint;
use crate::model::expression::{Names, Wants};
use crate::problem::DesignVariable;

pub const DESIGN: &[Key] = &[
    required("start", Accepts::Number, "start value, in the unit"),
    optional("lower", Accepts::Number, "lower bound; none if left out"),
    optional("upper", Accepts::Number, "upper bound; none if left out"),
    default("unit", Accepts::Text, "", "unit, for tables and axes"),
];

/// Reads `[constants]`, `[design]` and `[expressions]`.
pub fn read(file: &Section<'_>) -> Read<(Names, Vec<DesignVariable>)> {
    let mut names = Names::default();
    let designs = designs(file)?;
    for (name, design) in &designs {
        names.check(name, design.span.clone())?;
        names.design(name);
    }
    constants(file, &mut names)?;
    let variables = designs.iter().map(|(name, section)| variable(name, section, &names)).collect::<Read<_>>()?;
    expressions(file, &mut names)?;
    Ok((names, variables))
}

/// The sections `[design.NAME]` in the order of the file.
fn designs<'a>(file: &Section<'a>) -> Read<Vec<(String, Section<'a>)>> {
    let Some(value) = file.get("design") else { return Ok(vec![]) };
    let Some(table) = value.get_ref().as_table() else {
        return Err(wrong_type(value, "`design`", "tables [design.NAME]"));
    };
    let mut found = vec![];
    for (word, value) in super::section::ordered(table) {
        let title = format!("design variable `{}`", word.text);
        let mut section = Section::open(value, &title, &[DESIGN], file.source())?;
        section.span = word.span;
        found.push((word.text, section));
    }
    Ok(found)
}

fn variable(name: &str, section: &Section<'_>, names: &Names) -> Read<DesignVariable> {
    let bound = |key, none| Ok(section.number(key, names)?.unwrap_or(none));
    let (lower, upper) = (bound("lower", f64::NEG_INFINITY)?, bound("upper", f64::INFINITY)?);
    let start = section.number("start", names)?.unwrap_or(f64::NAN);
    if lower > upper {
        let message = format!("the lower bound {lower} of `{name}` is above the upper bound {upper}");
        return Err(section.complain("lower", message).help("leave room between the bounds"));
    }
    if !(lower..=upper).contains(&start) {
        let message = format!("the start {start} of `{name}` is outside its bounds {lower} to {upper}");
        return Err(section.complain("start", message).help("move the start inside or widen the bounds"));
    }
    Ok(DesignVariable::new(name, section.text("unit")?, start).within(lower, upper))
}

/// A design variable from a table that is written elsewhere, such as the bound of a peak.
pub fn extra(name: &str, section: &Section<'_>, names: &Names) -> Read<DesignVariable> {
    variable(name, section, names)
}

fn constants(file: &Section<'_>, names: &mut Names) -> Read<()> {
    let trees = named(file, "constants", names)?;
    names.expressions(trees.clone())?;
    for (name, tree) in &trees {
        let value = constant(tree, name, names)?;
        names.settle(name, value);
    }
    Ok(())
}

fn expressions(file: &Section<'_>, names: &mut Names) -> Read<()> {
    let trees = named(file, "expressions", names)?;
    names.expressions(trees.clone())?;
    trees.iter().try_for_each(|(_, tree)| names.compile(tree, &Wants::MOTION).map(drop))
}

/// The entries of a table of expressions.
fn named(file: &Section<'_>, key: &str, names: &Names) -> Read<Vec<(String, crate::model::expression::Tree)>> {
    let Some(value) = file.get(key) else { return Ok(vec![]) };
    let Some(table) = value.get_ref().as_table() else { return Err(wrong_type(value, &format!("`{key}`"), "a table")) };
    let mut found = vec![];
    for (word, value) in super::section::ordered(table) {
        names.check(&word.text, word.span)?;
        found.push((word.text.clone(), tree(value, &word.text, file.source())?));
    }
    Ok(found)
}

/// Refuses a file without design variables.
pub fn some(variables: &[DesignVariable], file: &Section<'_>) -> Read<()> {
    if !variables.is_empty() {
        return Ok(());
    }
    let help = "add a table such as\n    [design.length]\n    start = 1.0";
    Err(Complaint::new(file.span.start..file.span.start, "there is no design variable").help(help))
}
