//! Values of a model file with their locations: words, numbers, expressions, lists.

use crate::model_file::diagnostics::DiagnosticLog;
use crate::model_file::expression::{CompiledExpression, ExpressionTree, Names, Scope, TextPlace};
use crate::model_file::version::Modernizer;
use crate::model_file::{Diagnostic, limits};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value with its location.
pub type Value<'a> = Spanned<DeValue<'a>>;

/// The result of reading a part of a file.
pub type Read<T> = Result<T, Diagnostic>;

/// A word with its location.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    pub text: String,
    pub span: Range<usize>,
}

/// The file being read: its text, the log of errors, and the replacement of old words.
#[derive(Clone, Copy, Debug)]
pub struct FileSource<'a> {
    pub text: &'a str,
    pub log: &'a DiagnosticLog,
    pub words: &'a Modernizer,
    /// `true` for the model of a run that has begun: its bounds may have been edited so that they exclude the start.
    pub is_of_run: bool,
    /// The tables of the format that have a key of this name; that of the file itself is empty.
    pub owners: fn(&str) -> Vec<&'static str>,
}

impl FileSource<'_> {
    /// The first line of a span.
    pub fn first_line(self, span: &Range<usize>) -> Range<usize> {
        let line = self.text.get(span.clone()).and_then(|text| text.find('\n')).unwrap_or(span.len());
        span.start..span.start + line
    }

    /// Location of a quoted text without its quotes.
    pub fn text_place(self, value: &Value<'_>, text: &str) -> TextPlace {
        let span = value.span();
        let quoted = self.text.get(span.clone()).unwrap_or("");
        if quoted.len() == text.len() + 2 && &quoted[1..=text.len()] == text {
            TextPlace::From(span.start + 1)
        } else {
            TextPlace::Within(span)
        }
    }
}

/// The entries of a table in the order of the file.
pub fn ordered<'t, 'a>(table: &'t DeTable<'a>) -> Vec<(Word, &'t Value<'a>)> {
    let word = |key: &Spanned<Cow<'a, str>>| Word { text: key.get_ref().to_string(), span: key.span() };
    let mut entries: Vec<_> = table.iter().map(|(key, value)| (word(key), value)).collect();
    entries.sort_by_key(|(key, _)| key.span.start);
    entries
}

/// Selects the choice named by `word`.
pub fn find<T: Copy>(word: &Word, key: &str, choices: &[(&'static str, T)]) -> Read<T> {
    match choices.iter().find(|(known, _)| *known == word.text) {
        Some((_, value)) => Ok(*value),
        None => Err(Diagnostic::unknown(word.span.clone(), key, &word.text, choices.iter().map(|c| c.0))),
    }
}

/// The text of the value of `key`.
pub fn text<'v>(value: &'v Value<'_>, key: &str) -> Read<&'v str> {
    value.get_ref().as_str().ok_or_else(|| wrong_type(value, &format!("`{key}`"), "text in quotes"))
}

/// Parses a number, or an expression in quotes.
pub fn tree(value: &Value<'_>, key: &str, source: FileSource<'_>) -> Read<ExpressionTree> {
    let number = match value.get_ref() {
        DeValue::String(text) => return ExpressionTree::parse(text, source.text_place(value, text)),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
        DeValue::Float(f) => f.as_str().parse::<f64>().ok(),
        _ => return Err(wrong_type(value, &format!("`{key}`"), "a number, or an expression in quotes")),
    };
    match number.filter(|x| x.is_finite()) {
        Some(x) => Ok(ExpressionTree::number(x, value.span())),
        None => {
            let error = Diagnostic::new(value.span(), format!("`{key}` must be a finite number"));
            Err(error.help("leave a bound out where there is none"))
        }
    }
}

/// A whole number from 0 to `most`.
pub fn count(value: &Value<'_>, key: &str, most: usize) -> Read<usize> {
    let (integer, text) = (value.get_ref().as_integer(), value.get_ref().as_str().map(str::trim));
    let digits = text.filter(|text| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit()));
    let whole = match digits {
        // The text of a copy, such as "{i}".
        Some(digits) => digits.parse().ok(),
        None => integer.and_then(|i| usize::from_str_radix(i.as_str(), i.radix()).ok()),
    };
    match (whole, integer.is_some() || digits.is_some()) {
        (Some(count), _) if count <= most => Ok(count),
        (_, true) => {
            let message = format!("`{key}` must be a whole number from 0 to {most}");
            Err(Diagnostic::new(value.span(), message).label("out of range"))
        }
        _ => Err(wrong_type(value, &format!("`{key}`"), "a whole number")),
    }
}

/// A list of numbers.
pub fn numbers(value: &Value<'_>, key: &str, units: &str, names: &Names, source: FileSource<'_>) -> Read<Vec<f64>> {
    let list = value.get_ref().as_array().ok_or_else(|| wrong_type(value, &format!("`{key}`"), "a list [ … ]"))?;
    if list.len() > limits::POINTS {
        return Err(Diagnostic::new(value.span(), format!("{} values are too many", list.len())));
    }
    list.iter().map(|item| names.evaluate(&tree(item, key, source)?, key, units)).collect()
}

/// A list of `N` expressions, from two to four.
pub fn vector<const N: usize>(
    value: &Value<'_>,
    key: &str,
    names: &Names,
    scope: &Scope,
    source: FileSource<'_>,
) -> Read<[CompiledExpression; N]> {
    let wanted = ["two values [x, y]", "three values [x, y, z]", "four values"][N - 2];
    let list = value.get_ref().as_array().ok_or_else(|| wrong_type(value, &format!("`{key}`"), wanted))?;
    if list.len() != N {
        let error = Diagnostic::new(value.span(), format!("`{key}` takes {wanted}, got {}", list.len()));
        return Err(match (N, list.len()) {
            (2, 3) => error.help("with `space = 3` at the top of the file, mechanisms are in space"),
            (3, 2) => error.help("this file has `space = 3`; without it, mechanisms are in the plane"),
            _ => error,
        });
    }
    let one = |k: usize| -> Read<CompiledExpression> {
        let tree = tree(&list[k], key, source)?;
        names.compile(&tree, &Scope { place: &format!("`{key}`"), ..*scope })
    };
    let all: Vec<CompiledExpression> = (0..N).map(one).collect::<Read<_>>()?;
    Ok(all.try_into().expect("there are N values"))
}

/// The error about a value of another type than `wanted`.
pub fn wrong_type(value: &Value<'_>, what: &str, wanted: &str) -> Diagnostic {
    let got = match value.get_ref() {
        DeValue::String(_) => "text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    };
    Diagnostic::new(value.span(), format!("{what} must be {wanted}, got {got}")).label(format!("expected {wanted}"))
}
