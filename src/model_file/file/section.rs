//! Tables of a model file with checked keys and typed access to their values.

use super::key::{Key, Need};
use super::replicate::replicate;
pub use super::value::{FileSource, Read, Value, Word, find, ordered, tree, vector, wrong_type};
use super::value::{count, numbers, text};
use crate::model_file::expression::{CompiledExpression, ExpressionTree, Names, Scope, TextPlace};
use crate::model_file::{Diagnostic, limits, visible};
use std::ops::Range;
use toml::Spanned;
use toml::de::DeTable;

/// A table whose keys have been checked.
#[derive(Clone, Debug)]
pub struct Section<'a> {
    pub table: DeTable<'a>,
    /// Its location.
    pub span: Range<usize>,
    /// Kind of table and name, for messages: "joint `A`".
    pub title: String,
    keys: Vec<&'static Key>,
    source: FileSource<'a>,
}

impl<'a> Section<'a> {
    /// The table `value` whose keys are in `keys`.
    ///
    /// # Errors
    /// If the value is not a table, has an unknown key or lacks a required key.
    pub fn open(value: &Value<'a>, title: &str, keys: &[&'static [Key]], source: FileSource<'a>) -> Read<Self> {
        let Some(table) = value.get_ref().as_table() else {
            return Err(wrong_type(value, title, "a table"));
        };
        Self::of(table.clone(), value.span(), title, keys, source)
    }

    /// A table whose keys are in `keys`.
    ///
    /// # Errors
    /// As [`Section::open`].
    pub fn of(
        table: DeTable<'a>,
        span: Range<usize>,
        title: &str,
        keys: &[&'static [Key]],
        source: FileSource<'a>,
    ) -> Read<Self> {
        let keys: Vec<&Key> = keys.iter().flat_map(|keys| keys.iter()).collect();
        let title = match table.get("name").and_then(|n| n.get_ref().as_str()) {
            Some(name) if !title.contains('`') => format!("{title} `{name}`"),
            _ => title.to_owned(),
        };
        if let Some(name) = table.get("name")
            && let Some(text) = name.get_ref().as_str()
        {
            source.log.locate(text, name.span());
        }
        let section = Self { table, span, title, keys, source };
        section.check_keys()?;
        Ok(section)
    }

    /// Rejects unknown keys first, then missing keys, because the unknown key may be the missing one, misspelt.
    fn check_keys(&self) -> Read<()> {
        let is_known = |key: &str| self.keys.iter().any(|known| known.name == key);
        let mut unknown = Ok(());
        for key in self.table.keys().filter(|key| !is_known(key.get_ref())) {
            let error = Diagnostic::unknown(key.span(), "key", key.get_ref(), self.keys.iter().map(|k| k.name));
            let message = error.message.replacen("there is", &format!("{} has", self.title), 1);
            let is_near = error.help.as_ref().is_some_and(|help| help.starts_with("did you mean"));
            let help = if is_near { None } else { self.elsewhere(key.get_ref()) }.or(error.help.clone());
            let error = Diagnostic { message, unknown_name: None, help, ..error };
            self.source.log.note(error.clone());
            unknown = Err(error);
        }
        unknown?;
        let lacks = |key: &&&Key| key.need == Need::Required && !self.table.contains_key(key.name);
        let Some(missing) = self.keys.iter().find(lacks) else { return Ok(()) };
        let message = format!("{} lacks `{}`", self.title, missing.name);
        let help = format!("`{}` takes: {} — {}", missing.name, missing.accepts.words(), missing.about);
        Err(Diagnostic::new(self.source.first_line(&self.span), message).help(help))
    }

    /// Names the tables to which a key belongs, if this table is not one of them and there are at most three.
    fn elsewhere(&self, key: &str) -> Option<String> {
        let owners = (self.source.owners)(key);
        let is_own = owners.iter().any(|name| !name.is_empty() && self.title.trim_start_matches('[').starts_with(name));
        let word = |name: &&str| match *name {
            "" => "the file, above its first table".to_owned(),
            name => format!("`{name}`"),
        };
        let words: Vec<String> = owners.iter().map(word).collect();
        (!is_own && (1..=3).contains(&words.len())).then(|| format!("`{key}` is a key of {}", words.join(", ")))
    }

    /// The value of a key, if the table has it.
    pub fn get(&self, key: &str) -> Option<&Value<'a>> {
        debug_assert!(self.keys.iter().any(|k| k.name == key), "key `{key}` is not declared for {}", self.title);
        self.table.get(key)
    }

    /// Returns whether the section may have a key.
    pub fn takes(&self, key: &str) -> bool {
        self.keys.iter().any(|known| known.name == key)
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// Selects one of `kinds` by the key `kind` of a table, or by a default. Other keys are not checked.
    pub fn kind<T: Copy>(
        table: &DeTable<'_>,
        what: &str,
        default: &str,
        kinds: impl Iterator<Item = (&'static str, T)>,
    ) -> Read<T> {
        let kinds: Vec<_> = kinds.collect();
        let word = match table.get("kind") {
            None => Word {
                text: default.to_owned(),
                span: table.keys().map(Spanned::span).min_by_key(|s| s.start).unwrap_or(0..0),
            },
            Some(value) => Word { text: text(value, "kind")?.to_owned(), span: value.span() },
        };
        if word.text.is_empty() {
            let known: Vec<String> = kinds.iter().map(|(k, _)| format!("`{k}`")).collect();
            let message = format!("this {what} lacks `kind`");
            return Err(Diagnostic::new(word.span, message).help(format!("choose from {}", known.join(", "))));
        }
        find(&word, &format!("kind of {what}"), &kinds)
    }

    /// The text of an optional key.
    pub fn word(&self, key: &str) -> Read<Option<Word>> {
        let word = |value| Ok(Word { text: text(value, key)?.to_owned(), span: value.span() });
        self.get(key).map(word).transpose()
    }

    /// The text of a key that is required, or of its default.
    pub fn need_word(&self, key: &str) -> Read<Word> {
        let default = self.default_of(key).unwrap_or_default();
        Ok(self.word(key)?.unwrap_or_else(|| Word { text: default.to_owned(), span: self.span.clone() }))
    }

    /// The text of a key for display, its default, or an empty text; control characters are made visible.
    pub fn text(&self, key: &str) -> Read<String> {
        Ok(visible(&self.need_word(key)?.text))
    }

    /// The Boolean value of a key, its default, or false.
    pub fn flag(&self, key: &str) -> Read<bool> {
        match self.get(key) {
            None => Ok(self.default_of(key) == Some("true")),
            Some(value) => {
                value.get_ref().as_bool().ok_or_else(|| wrong_type(value, &format!("`{key}`"), "true or false"))
            }
        }
    }

    /// A whole number from 0 to `most`.
    pub fn count(&self, key: &str, most: usize) -> Read<Option<usize>> {
        self.get(key).map(|value| count(value, key, most)).transpose()
    }

    /// The expression of a key, or of its default.
    pub fn tree(&self, key: &str) -> Read<Option<ExpressionTree>> {
        match self.get(key) {
            Some(value) => tree(value, key, self.source).map(Some),
            None => self
                .default_of(key)
                .map(|text| ExpressionTree::parse(text, TextPlace::Within(self.span.clone())))
                .transpose(),
        }
    }

    /// The comparison of a key, as the difference that is positive where it holds.
    pub fn condition(&self, key: &str) -> Read<Option<ExpressionTree>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let text = text(value, key)?;
        ExpressionTree::parse_condition(text, self.source.text_place(value, text)).map(Some)
    }

    /// The names of a key: one text, or a list of them.
    pub fn names(&self, key: &str) -> Read<Vec<Word>> {
        let Some(value) = self.get(key) else { return Ok(vec![]) };
        let word =
            |value: &Value<'_>| -> Read<Word> { Ok(Word { text: text(value, key)?.to_owned(), span: value.span() }) };
        match value.get_ref().as_array() {
            Some(list) => list.iter().map(word).collect(),
            None => Ok(vec![word(value)?]),
        }
    }

    /// The expressions of a key: one, or a list of them.
    pub fn trees(&self, key: &str) -> Read<Vec<ExpressionTree>> {
        let Some(value) = self.get(key) else { return Ok(vec![]) };
        match value.get_ref().as_array() {
            Some(list) => list.iter().map(|item| tree(item, key, self.source)).collect(),
            None => Ok(vec![tree(value, key, self.source)?]),
        }
    }

    /// The compiled expression of a key that is required or has a default.
    pub fn expression(&self, key: &str, names: &Names, scope: &Scope) -> Read<CompiledExpression> {
        match self.tree(key)? {
            Some(tree) => {
                names.compile(&tree, &Scope { place: &format!("`{key}`"), units: self.unit_of(key), ..*scope })
            }
            None => Err(Diagnostic::new(self.source.first_line(&self.span), format!("{} lacks `{key}`", self.title))),
        }
    }

    /// The number of a key, or of its default.
    pub fn number(&self, key: &str, names: &Names) -> Read<Option<f64>> {
        let Some(tree) = self.tree(key)? else { return Ok(None) };
        names.evaluate(&tree, key, self.unit_of(key)).map(Some)
    }

    /// A list of compiled expressions; zeros without the key.
    pub fn vector<const N: usize>(&self, key: &str, names: &Names, scope: &Scope) -> Read<[CompiledExpression; N]> {
        let Some(value) = self.get(key) else { return Ok(std::array::from_fn(|_| CompiledExpression::constant(0.0))) };
        vector(value, key, names, &Scope { units: self.unit_of(key), ..*scope }, self.source)
    }

    /// Three compiled expressions; three times the default without the key.
    pub fn triple(&self, key: &str, names: &Names, scope: &Scope) -> Read<[CompiledExpression; 3]> {
        if self.has(key) {
            return self.vector(key, names, scope);
        }
        let one = self.expression(key, names, scope)?;
        Ok([one.clone(), one.clone(), one])
    }

    /// A list of pairs of compiled expressions; empty without the key.
    pub fn pairs(&self, key: &str, names: &Names, scope: &Scope) -> Read<Vec<[CompiledExpression; 2]>> {
        let Some(value) = self.get(key) else { return Ok(vec![]) };
        let list = value.get_ref().as_array();
        let list =
            list.ok_or_else(|| wrong_type(value, &format!("`{key}`"), "a list of points [[x, y], [x, y], …]"))?;
        let scope = Scope { units: self.unit_of(key), ..*scope };
        list.iter().map(|item| vector(item, key, names, &scope, self.source)).collect()
    }

    /// A list of numbers.
    pub fn numbers(&self, key: &str, names: &Names) -> Read<Option<Vec<f64>>> {
        self.get(key).map(|value| numbers(value, key, self.unit_of(key), names, self.source)).transpose()
    }

    /// A list of texts; empty without the key.
    pub fn texts(&self, key: &str) -> Read<Vec<String>> {
        let Some(value) = self.get(key) else { return Ok(vec![]) };
        let list = value.get_ref().as_array();
        let list = list.ok_or_else(|| wrong_type(value, &format!("`{key}`"), "a list of texts in quotes"))?;
        list.iter().map(|item| Ok(text(item, key)?.to_owned())).collect()
    }

    /// The choice with the name given by a key.
    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&'static str, T)]) -> Read<T> {
        let word = self.need_word(key)?;
        find(&word, key, choices)
    }

    /// A table inside this one.
    pub fn inner(&self, key: &str, keys: &[&'static [Key]]) -> Read<Option<Self>> {
        self.get(key).map(|value| Self::open(value, &format!("[{key}]"), keys, self.source)).transpose()
    }

    /// The tables `[[key]]`, replicated by `each`, with renamed words replaced.
    pub fn tables(&self, key: &str) -> Read<Vec<(DeTable<'a>, Range<usize>)>> {
        let Some(value) = self.get(key) else { return Ok(vec![]) };
        let list = value.get_ref().as_array();
        let list = list.ok_or_else(|| wrong_type(value, &format!("`{key}`"), &format!("tables under [[{key}]]")))?;
        let mut all = vec![];
        for item in list.iter() {
            let table = item.get_ref().as_table().ok_or_else(|| wrong_type(item, &format!("`{key}`"), "a table"))?;
            let Some(tables) = self.source.log.keep(replicate(table, item.span())) else {
                self.source.log.poison_all();
                continue;
            };
            for mut table in tables {
                self.source.words.update(key, &mut table, self.source.text);
                all.push((table, item.span()));
            }
            if all.len() > limits::PARTS {
                return Err(Diagnostic::new(item.span(), format!("more than {} parts under [[{key}]]", limits::PARTS)));
            }
        }
        Ok(all)
    }

    /// Reads all tables `[[key]]`. An error in one of them is logged, and the others are read.
    pub fn read_each<T>(&self, key: &str, mut read: impl FnMut(DeTable<'a>, Range<usize>) -> Read<T>) -> Read<Vec<T>> {
        let log = self.source.log;
        let mut all = vec![];
        for (table, span) in self.tables(key)? {
            let name = table.get("name").map(|name| (name.get_ref().as_str().unwrap_or("").to_owned(), name.span()));
            match (read(table, span), name) {
                (Ok(item), _) => all.push(item),
                (Err(error), name) => {
                    match name {
                        Some((name, span)) if span != error.span => log.poison(&name),
                        // The name is missing or wrong.
                        _ => log.poison_all(),
                    }
                    log.note(error);
                }
            }
        }
        Ok(all)
    }

    pub fn source(&self) -> FileSource<'a> {
        self.source
    }

    /// An error at the value of a key, or at the table if it has no such key.
    pub fn error_at(&self, key: &str, message: impl Into<String>) -> Diagnostic {
        let span = self.table.get(key).map_or_else(|| self.source.first_line(&self.span), Spanned::span);
        Diagnostic::new(span, message)
    }

    /// Units of the value of a key.
    pub fn unit_of(&self, key: &str) -> &'static str {
        self.keys.iter().find(|known| known.name == key).map_or("", |known| known.unit)
    }

    fn default_of(&self, key: &str) -> Option<&'static str> {
        self.keys.iter().find(|k| k.name == key).and_then(|k| match k.need {
            Need::Default(value) => Some(value),
            _ => None,
        })
    }
}
