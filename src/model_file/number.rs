//! Numbers that a user gives for a quantity of a model: plain ones are in its unit, others are converted to it.

use super::expression::{ExpressionTree, Names, Scope, TextPlace};
use super::unit::{Dimension, Unit};
use super::{Diagnostic, DiagnosticReport, file, with_setting};

/// A number of the quantity `name` whose unit or label is `unit`: a plain number or formula is in this unit, a quantity such as `0.3 m` is
/// converted to it.
///
/// # Errors
/// If the expression is not a number, or has a unit of another dimension.
pub(crate) fn number_of(tree: &ExpressionTree, unit: &str, name: &str) -> Result<f64, Diagnostic> {
    let names = Names::default();
    let known = names.dimension(tree, &Scope::NUMBER)?;
    let has_unit = tree.unit().is_some() || known.is_some_and(|k| k.is_firm && k.dimension != Dimension::NUMBER);
    match Unit::parse(unit) {
        _ if !has_unit => names.evaluate(tree, name, ""),
        Some(unit) => names.evaluate_in(tree, name, &unit),
        None => {
            let error = Diagnostic::new(tree.span.clone(), format!("`{name}` has no unit in the file"));
            Err(error.help("give a number without a unit"))
        }
    }
}

/// A text as a number of a design variable with the unit or label `unit`: a plain number or formula is in this unit, a quantity such as `0.3 m` is
/// converted to it.
///
/// # Errors
/// If the text is not a number, or has a unit of another dimension. The report shows the place in the text.
pub fn number_in(unit: &str, name: &str, text: &str) -> Result<f64, Box<DiagnosticReport>> {
    let text = text.trim().trim_matches('"');
    let read = ExpressionTree::parse(text, TextPlace::From(0)).and_then(|tree| number_of(&tree, unit, name));
    read.map_err(|error| on_command_line(text, error))
}

/// The text of a file with another start value of a design variable.
///
/// The value is as for [`number_in`]; it is written in the unit of the file.
///
/// # Errors
/// If there is no such design variable, its unit cannot be read, or as [`number_in`].
pub fn with_start(file: &str, text: &str, name: &str, value: &str) -> Result<String, Box<DiagnosticReport>> {
    let variables = file::variable_units(file, text)?;
    let Some(variable) = variables.iter().find(|variable| variable.name == name) else {
        let names = variables.iter().map(|variable| variable.name.as_str());
        return Err(on_command_line(value, Diagnostic::unknown(0..0, "design variable", name, names)));
    };
    let number = number_in(&variable.label, name, value)?;
    with_setting(file, text, &format!("design.{name}.start"), &Unit::written(variable.unit.as_ref(), number))
}

fn on_command_line(text: &str, error: Diagnostic) -> Box<DiagnosticReport> {
    Box::new(DiagnosticReport { file: "command line".to_owned(), text: text.to_owned(), diagnostics: vec![error] })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_has_the_unit_of_the_file() {
        let text = "version = 2\n[constants]\nl0 = \"120 mm\"\n[design]\na = { start = \"100 mm\" }\nb = { start = 2.0, unit = \"m\" }\nc = { start = 1 }\n\
            d = { start = \"l0\", lower = \"1 cm\" }\ne = { start = \"l0 + 1 m\" }\n";
        let set = |name: &str, value: &str| with_start("m", text, name, value);
        for (name, value, old, new) in [
            ("a", "0.3 m", "100 mm", "300 mm"),
            ("a", "\"0.3 m\"", "100 mm", "300 mm"),
            ("a", "120", "100 mm", "120 mm"),
            ("b", "300 mm", "start = 2.0", "start = 0.3"),
            ("b", "3", "start = 2.0", "start = 3"),
            ("c", "2*(1 + 1)", "start = 1 ", "start = 4 "),
            ("d", "0.3 m", "start = \"l0\"", "start = \"30 cm\""),
            ("e", "300 mm + 2 cm", "start = \"l0 + 1 m\"", "start = \"0.32 m\""),
        ] {
            assert_eq!(set(name, value).unwrap(), text.replacen(old, new, 1), "{name} {value}");
        }
        for (name, value, why) in [
            ("a", "3 kg", "mass"),
            ("b", "3 s", "time"),
            ("c", "3 mm", "`c` has no unit in the file"),
            ("q", "3", "q"),
            ("a", "3 xx", "xx"),
        ] {
            let error = set(name, value).unwrap_err().to_string();
            assert!(error.contains(why), "{error}");
        }
    }
}
