//! Versions of the format, and the words that version 2 has renamed.
//!
//! Only the words of version 2 are accepted. Old words in a file of version 1 are replaced before its tables are read, and a
//! note lists them; in a file of version 2 an old word is an error that names the new one. Both use the table [`RENAMED`].

use super::Diagnostic;
use std::cell::RefCell;
use std::collections::HashSet;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The version that this program documents and writes. It reads version 1, too.
pub const CURRENT: usize = 2;

/// Role of a renamed word in its table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WordRole {
    /// A value of `kind`.
    Kind,
    Key,
    /// A value of this key.
    ValueOf(&'static str),
    /// A measure of elements that the table defines, in the `value` of an output.
    Measure,
}

/// A word of version 1 with its name in version 2.
#[derive(Debug)]
struct RenamedWord {
    role: WordRole,
    table: &'static str,
    /// Kinds of the table that have the word, by their new names; all if empty.
    kinds: &'static [&'static str],
    old: &'static str,
    new: &'static str,
}

const fn renamed(role: WordRole, table: &'static str, old: &'static str, new: &'static str) -> RenamedWord {
    RenamedWord { role, table, kinds: &[], old, new }
}

const fn key(table: &'static str, kinds: &'static [&'static str], old: &'static str, new: &'static str) -> RenamedWord {
    RenamedWord { role: WordRole::Key, table, kinds, old, new }
}

/// All renamed words. Kinds come before the keys that depend on them.
static RENAMED: &[RenamedWord] = &[
    renamed(WordRole::Kind, "body", "slide", "slider"),
    renamed(WordRole::Kind, "body", "frame", "massless-node"),
    renamed(WordRole::Kind, "body", "pivot", "fixed-node"),
    renamed(WordRole::Kind, "joint", "weld", "fixed"),
    renamed(WordRole::Kind, "joint", "rod", "distance"),
    renamed(WordRole::Kind, "force", "stop", "bump-stop"),
    renamed(WordRole::Kind, "force", "state-load", "feedback"),
    key("joint", &["fixed", "prismatic"], "turn", "angle"),
    key("force", &["bushing"], "stiffness_turn", "stiffness_theta"),
    key("force", &["bushing"], "damping_turn", "damping_theta"),
    key("force", &["friction"], "effort", "coulomb_force"),
    key("force", &["load", "feedback"], "effort", "generalized_force"),
    key("analysis", &["dynamics"], "origin", "initial_configuration"),
    renamed(WordRole::ValueOf("prescribed"), "analysis", "steps", "newmark"),
    key("method", &[], "drifting", "moving_peaks"),
    renamed(WordRole::Measure, "driver", "effort", "driving_force"),
    renamed(WordRole::Measure, "force", "effort", "generalized_force"),
    renamed(WordRole::Measure, "force", "stretch", "elongation"),
    renamed(WordRole::Measure, "force", "push", "contact_force"),
    renamed(WordRole::Measure, "joint/force", "couple", "moment"),
];

impl RenamedWord {
    /// Description of the role, such as "kind of joint".
    fn role_in_words(&self) -> String {
        let Self { table, kinds, .. } = self;
        match self.role {
            WordRole::Kind => format!("kind of {table}"),
            WordRole::Key if kinds.is_empty() => format!("key of {table}"),
            WordRole::Key => format!("key of {} {table}", kinds.join("/")),
            WordRole::ValueOf(key) => format!("value of {key}"),
            WordRole::Measure => format!("measure of {table}"),
        }
    }

    /// Returns `true` if a table with these entries can have the word.
    fn applies(&self, entries: &DeTable<'_>) -> bool {
        let kind = entries.get("kind").and_then(|kind| kind.get_ref().as_str());
        self.kinds.is_empty() || kind.is_some_and(|kind| self.kinds.contains(&kind))
    }

    /// Replaces the old word by the new one in a table, or the new one by the old one. Returns the location of the word.
    fn replace(&self, entries: &mut DeTable<'_>, conversion: Conversion) -> Option<Range<usize>> {
        let (from, to) = match conversion {
            Conversion::ToCurrent => (self.old, self.new),
            Conversion::ToFirst => (self.new, self.old),
        };
        match self.role {
            WordRole::Kind => replace_value(entries, "kind", from, to),
            WordRole::ValueOf(key) => replace_value(entries, key, from, to),
            WordRole::Key if entries.contains_key(to) => None,
            WordRole::Key => {
                let (key, value) = entries.remove_entry(from)?;
                entries.insert(Spanned::new(key.span(), to.into()), value);
                Some(key.span())
            }
            WordRole::Measure => None,
        }
    }
}

fn replace_value(entries: &mut DeTable<'_>, key: &str, from: &str, to: &'static str) -> Option<Range<usize>> {
    let value = entries.get_mut(key).filter(|value| value.get_ref().as_str() == Some(from))?;
    *value.get_mut() = DeValue::String(to.into());
    Some(value.span())
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Conversion {
    ToCurrent,
    ToFirst,
}

/// The version of a file.
///
/// # Errors
/// If the file states none, or one that this program does not read.
pub fn version(table: &DeTable<'_>) -> Result<usize, Diagnostic> {
    let Some(value) = table.get("version") else {
        let help = format!("write version = {CURRENT} in the first line");
        return Err(Diagnostic::new(0..0, "the file lacks `version`").help(help));
    };
    match value.get_ref().as_integer().and_then(|i| i.as_str().parse().ok()) {
        Some(version @ 1..=CURRENT) => Ok(version),
        _ => {
            let message = format!("this program reads versions 1 and {CURRENT} of the format");
            Err(Diagnostic::new(value.span(), message).label(format!("expected {CURRENT}")))
        }
    }
}

/// Replaces old words by those of the current version, and stores the old words found with their locations.
#[derive(Debug, Default)]
pub struct Modernizer {
    found: RefCell<Vec<(&'static RenamedWord, Range<usize>)>>,
    /// Names of drivers: their measures are renamed differently from those of forces.
    drivers: RefCell<HashSet<String>>,
}

impl Modernizer {
    /// Replaces the old words of one table, of which `name` is the name in brackets and `text` the file. Copies by `each` have been
    /// made before. Drivers come before outputs.
    pub fn update(&self, name: &str, entries: &mut DeTable<'_>, text: &str) {
        for word in RENAMED.iter().filter(|word| word.table == name) {
            if word.applies(entries)
                && let Some(span) = word.replace(entries, Conversion::ToCurrent)
            {
                self.add(word, span);
            }
        }
        match name {
            "driver" => {
                let name = entries.get("name").and_then(|name| name.get_ref().as_str());
                self.drivers.borrow_mut().extend(name.map(str::to_owned));
            }
            "output" => self.update_measures(entries, text),
            _ => {}
        }
    }

    fn update_measures(&self, entries: &mut DeTable<'_>, text: &str) {
        let is_driver = |owner: &str| self.drivers.borrow().contains(owner);
        replace_measures(entries, |owner, measure, place| {
            let is_meant = |word: &&RenamedWord| {
                word.role == WordRole::Measure && word.old == measure && (word.table == "driver") == is_driver(owner)
            };
            let word = RENAMED.iter().find(is_meant)?;
            // If the text is written in the file without escapes, the word alone is underlined.
            let exact = place.quoted.start + 1 + place.word.start..place.quoted.start + 1 + place.word.end;
            let is_exact = text.get(exact.clone()) == Some(measure);
            self.add(word, if is_exact { exact } else { place.quoted });
            Some(word.new)
        });
    }

    fn add(&self, word: &'static RenamedWord, span: Range<usize>) {
        self.found.borrow_mut().push((word, span));
    }

    /// The old words of a file of version 2 as errors.
    pub fn errors(&self) -> Vec<Diagnostic> {
        let error = |(word, span): &(&RenamedWord, Range<usize>)| {
            let message =
                format!("the {} `{}` is called `{}` in version {CURRENT}", word.role_in_words(), word.old, word.new);
            Diagnostic::new(span.clone(), message).label("renamed").help(format!("write `{}`", word.new))
        };
        self.found.borrow().iter().map(error).collect()
    }

    /// The note about a file of version 1, with the new names of its old words.
    pub fn note(&self, table: &DeTable<'_>) -> Diagnostic {
        let span = table.get("version").map_or(0..0, Spanned::span);
        let found = self.found.borrow();
        let uses = |word: &&RenamedWord| found.iter().any(|(used, _)| std::ptr::eq(*used, *word));
        let words: Vec<String> = RENAMED
            .iter()
            .filter(uses)
            .map(|word| format!("\n{} `{}` as `{}`", word.role_in_words(), word.old, word.new))
            .collect();
        let with = if words.is_empty() { "" } else { ", and" };
        Diagnostic {
            severity: super::Severity::Note,
            ..Diagnostic::new(span, "this file has version 1 of the format, which is still read")
                .label(format!("the current version is {CURRENT}"))
                .help(format!("write `version = {CURRENT}`{with}{}", words.concat()))
        }
    }
}

/// Replaces the old words of a whole file by those of the current version; `each` is not expanded.
pub fn modernize(file: &mut DeTable<'_>) {
    let words = Modernizer::default();
    for_each_table(file, &mut |name, table| words.update(name, table, ""));
}

/// Replaces the words of a whole file by those of version 1; `each` is not expanded.
pub fn to_first_version(file: &mut DeTable<'_>) {
    for_each_table(file, &mut |name, table| {
        for word in RENAMED.iter().rev().filter(|word| word.table == name) {
            if word.applies(table) {
                word.replace(table, Conversion::ToFirst);
            }
        }
        if name == "output" {
            replace_measures(table, |_, measure, _| {
                Some(RENAMED.iter().find(|word| word.role == WordRole::Measure && word.new == measure)?.old)
            });
        }
    });
}

/// Calls `change` for each table of the file that can have a renamed word, drivers before outputs.
fn for_each_table<'a>(file: &mut DeTable<'a>, change: &mut impl FnMut(&str, &mut DeTable<'a>)) {
    for name in ["body", "joint", "driver", "force", "analysis", "method", "output"] {
        match file.get_mut(name).map(Spanned::get_mut) {
            Some(DeValue::Table(table)) => change(name, table),
            Some(DeValue::Array(list)) => {
                for item in list.iter_mut() {
                    if let DeValue::Table(table) = item.get_mut() {
                        change(name, table);
                    }
                }
            }
            _ => {}
        }
    }
}

/// Location of a measure: its bytes in the text of an expression, and the bytes of the quoted text in the file.
struct MeasurePlace {
    word: Range<usize>,
    quoted: Range<usize>,
}

/// Replaces measures of elements in the value of an output: `rename` gets owner, measure and location of each name with one dot.
/// Measures of beam nodes, with two dots, have not been renamed.
fn replace_measures(
    output: &mut DeTable<'_>,
    mut rename: impl FnMut(&str, &str, MeasurePlace) -> Option<&'static str>,
) {
    let Some(value) = output.get_mut("value") else { return };
    let quoted = value.span();
    let Some(text) = value.get_ref().as_str().map(str::to_owned) else { return };
    let mut new = String::new();
    let mut rest = 0;
    let is_part = |c: char| c.is_alphanumeric() || matches!(c, '_' | '.' | '{' | '}');
    let mut at = 0;
    for name in text.split(|c| !is_part(c)) {
        if let Some((owner, measure)) = name.split_once('.') {
            let word = at + owner.len() + 1..at + name.len();
            if let Some(to) = rename(owner, measure, MeasurePlace { word: word.clone(), quoted: quoted.clone() }) {
                new += &text[rest..word.start];
                new += to;
                rest = word.end;
            }
        }
        at += name.len();
        at += text[at..].chars().next().map_or(0, char::len_utf8);
    }
    if rest > 0 {
        new += &text[rest..];
        *value.get_mut() = DeValue::String(new.into());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_documentation_lists_all_renamed_words() {
        let page = include_str!("../../docs/model-file.md");
        for word in RENAMED {
            let row = format!("| {} | `{}` | `{}` |", word.role_in_words(), word.old, word.new);
            assert!(page.contains(&row), "{row}");
        }
    }
}
