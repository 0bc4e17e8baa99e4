//! A table of the file while it is read: every key is known, every value has its place.

use super::each::copies;
use super::key::{Key, Need};
use super::log::FileSource;
use crate::model_file::expression::{Names, Program, TextPlace, Tree, Wants};
use crate::model_file::{Diagnostic, limits};
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A value with its place.
pub type Value<'a> = Spanned<DeValue<'a>>;

/// A result of reading.
pub type Read<T> = Result<T, Diagnostic>;

/// A word with its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Word {
    pub text: String,
    pub span: Range<usize>,
}

/// A table whose keys have been checked.
#[derive(Clone, Debug)]
pub struct Section<'a> {
    pub table: DeTable<'a>,
    /// Where it begins.
    pub span: Range<usize>,
    /// What it is, for messages: "joint `A`".
    pub title: String,
    keys: Vec<&'static Key>,
    source: FileSource<'a>,
}

impl<'a> Section<'a> {
    /// The table `value` whose keys are in `keys`.
    ///
    /// **Errors.** Something that is no table; a key that is not known; a required key that is missing.
    pub fn open(value: &Value<'a>, title: &str, keys: &[&'static [Key]], source: FileSource<'a>) -> Read<Self> {
        let Some(table) = value.get_ref().as_table() else {
            return Err(wrong_type(value, title, "a table"));
        };
        Self::of(table.clone(), value.span(), title, keys, source)
    }

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
            source.log.place(text, name.span());
        }
        let section = Self { table, span, title, keys, source };
        section.check_keys()?;
        Ok(section)
    }

    /// Refuses keys that are not known, and then tables in which a key is missing, which may be the one that is misspelt.
    fn check_keys(&self) -> Read<()> {
        let is_known = |key: &str| self.keys.iter().any(|known| known.name == key);
        let mut unknown = Ok(());
        for key in self.table.keys().filter(|key| !is_known(key.get_ref())) {
            let complaint = Diagnostic::unknown(key.span(), "key", key.get_ref(), self.keys.iter().map(|k| k.name));
            let message = complaint.message.replacen("there is", &format!("{} has", self.title), 1);
            let complaint = Diagnostic { message, asked: None, ..complaint };
            self.source.log.note(complaint.clone());
            unknown = Err(complaint);
        }
        unknown?;
        let lacks = |key: &&&Key| key.need == Need::Required && !self.table.contains_key(key.name);
        let Some(missing) = self.keys.iter().find(lacks) else { return Ok(()) };
        let message = format!("{} lacks `{}`", self.title, missing.name);
        let help = format!("`{}` takes: {} — {}", missing.name, missing.accepts.words(), missing.about);
        Err(Diagnostic::new(heading(&self.span, self.source), message).help(help))
    }

    /// The value of a key, if it is there.
    pub fn get(&self, key: &str) -> Option<&Value<'a>> {
        debug_assert!(self.keys.iter().any(|k| k.name == key), "key `{key}` is not declared for {}", self.title);
        self.table.get(key)
    }

    pub fn has(&self, key: &str) -> bool {
        self.get(key).is_some()
    }

    /// The kind of a table that is not opened yet, by its key `kind` or a default.
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
            Some(value) => match value.get_ref().as_str() {
                Some(text) => Word { text: text.to_owned(), span: value.span() },
                None => return Err(wrong_type(value, "`kind`", "text in quotes")),
            },
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
        let Some(value) = self.get(key) else { return Ok(None) };
        match value.get_ref().as_str() {
            Some(text) => Ok(Some(Word { text: text.to_owned(), span: value.span() })),
            None => Err(wrong_type(value, &format!("`{key}`"), "text in quotes")),
        }
    }

    /// The text of a key that is required, or of its default.
    pub fn need_word(&self, key: &str) -> Read<Word> {
        let default = self.default_of(key).unwrap_or_default();
        Ok(self.word(key)?.unwrap_or_else(|| Word { text: default.to_owned(), span: self.span.clone() }))
    }

    /// The text of a key, empty if it is not there.
    pub fn text(&self, key: &str) -> Read<String> {
        Ok(self.need_word(key)?.text)
    }

    /// `true` or `false`; not there is false.
    pub fn flag(&self, key: &str) -> Read<bool> {
        match self.get(key) {
            None => Ok(self.default_of(key) == Some("true")),
            Some(value) => {
                value.get_ref().as_bool().ok_or_else(|| wrong_type(value, &format!("`{key}`"), "true or false"))
            }
        }
    }

    /// A whole number.
    pub fn count(&self, key: &str, most: usize) -> Read<Option<usize>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let whole = value.get_ref().as_integer().and_then(|i| usize::from_str_radix(i.as_str(), i.radix()).ok());
        match (whole, value.get_ref().is_integer()) {
            (Some(count), _) if count <= most => Ok(Some(count)),
            (_, true) => {
                let message = format!("`{key}` must be a whole number from 0 to {most}");
                Err(Diagnostic::new(value.span(), message).label("out of range"))
            }
            _ => Err(wrong_type(value, &format!("`{key}`"), "a whole number")),
        }
    }

    /// The expression of a key, or of its default.
    pub fn tree(&self, key: &str) -> Read<Option<Tree>> {
        match self.get(key) {
            Some(value) => tree(value, key, self.source).map(Some),
            None => {
                self.default_of(key).map(|text| Tree::parse(text, TextPlace::Within(self.span.clone()))).transpose()
            }
        }
    }

    /// The program of a key that is required or has a default.
    pub fn program(&self, key: &str, names: &Names, wants: &Wants) -> Read<Program> {
        match self.tree(key)? {
            Some(tree) => names.compile(&tree, &Wants { place: &format!("`{key}`"), ..*wants }),
            None => Err(Diagnostic::new(heading(&self.span, self.source), format!("{} lacks `{key}`", self.title))),
        }
    }

    /// The number of a key, or of its default.
    pub fn number(&self, key: &str, names: &Names) -> Read<Option<f64>> {
        let Some(tree) = self.tree(key)? else { return Ok(None) };
        constant(&tree, key, names).map(Some)
    }

    /// Two programs.
    pub fn pair(&self, key: &str, names: &Names, wants: &Wants) -> Read<[Program; 2]> {
        let Some(value) = self.get(key) else { return Ok([Program::constant(0.0), Program::constant(0.0)]) };
        pair(value, key, names, wants, self.source)
    }

    /// Numbers of a list.
    pub fn numbers(&self, key: &str, names: &Names) -> Read<Option<Vec<f64>>> {
        let Some(value) = self.get(key) else { return Ok(None) };
        let list = value.get_ref().as_array().ok_or_else(|| wrong_type(value, &format!("`{key}`"), "a list [ … ]"))?;
        if list.len() > limits::POINTS {
            return Err(Diagnostic::new(value.span(), format!("{} values are too many", list.len())));
        }
        list.iter().map(|item| constant(&tree(item, key, self.source)?, key, names)).collect::<Read<_>>().map(Some)
    }

    /// The word of a key among those of a table, with what it stands for.
    pub fn choice<T: Copy>(&self, key: &str, choices: &[(&'static str, T)]) -> Read<T> {
        let word = self.need_word(key)?;
        find(&word, key, choices)
    }

    /// A table inside this one.
    pub fn inner(&self, key: &str, keys: &[&'static [Key]]) -> Read<Option<Self>> {
        self.get(key).map(|value| Self::open(value, &format!("[{key}]"), keys, self.source)).transpose()
    }

    /// The tables `[[key]]`, copies by `each` included.
    pub fn tables(&self, key: &str) -> Read<Vec<(DeTable<'a>, Range<usize>)>> {
        let Some(value) = self.get(key) else { return Ok(vec![]) };
        let list = value.get_ref().as_array();
        let list = list.ok_or_else(|| wrong_type(value, &format!("`{key}`"), &format!("tables under [[{key}]]")))?;
        let mut all = vec![];
        for item in list.iter() {
            let table = item.get_ref().as_table().ok_or_else(|| wrong_type(item, &format!("`{key}`"), "a table"))?;
            let Some(tables) = self.source.log.keep(copies(table, item.span())) else {
                self.source.log.poison_all();
                continue;
            };
            all.extend(tables.into_iter().map(|table| (table, item.span())));
            if all.len() > limits::PARTS {
                return Err(Diagnostic::new(item.span(), format!("more than {} parts under [[{key}]]", limits::PARTS)));
            }
        }
        Ok(all)
    }

    /// Reads each of the tables `[[key]]`; a mistake in one of them is noted, and the others are read.
    pub fn each<T>(&self, key: &str, mut read: impl FnMut(DeTable<'a>, Range<usize>) -> Read<T>) -> Read<Vec<T>> {
        let log = self.source.log;
        let mut all = vec![];
        for (table, span) in self.tables(key)? {
            let name = table.get("name").map(|name| (name.get_ref().as_str().unwrap_or("").to_owned(), name.span()));
            match (read(table, span), name) {
                (Ok(item), _) => all.push(item),
                (Err(mistake), name) => {
                    match name {
                        Some((name, span)) if span != mistake.span => log.poison(&name),
                        // What it should be called, nobody knows.
                        _ => log.poison_all(),
                    }
                    log.note(mistake);
                }
            }
        }
        Ok(all)
    }

    pub fn source(&self) -> FileSource<'a> {
        self.source
    }

    /// A complaint about the value of a key, or about the table if the key is not there.
    pub fn complain(&self, key: &str, message: impl Into<String>) -> Diagnostic {
        let span = self.table.get(key).map_or_else(|| heading(&self.span, self.source), Spanned::span);
        Diagnostic::new(span, message)
    }

    fn default_of(&self, key: &str) -> Option<&'static str> {
        self.keys.iter().find(|k| k.name == key).and_then(|k| match k.need {
            Need::Default(value) => Some(value),
            _ => None,
        })
    }
}

/// The entries of a table in the order of the file.
pub fn ordered<'t, 'a>(table: &'t DeTable<'a>) -> Vec<(Word, &'t Value<'a>)> {
    let word = |key: &Spanned<std::borrow::Cow<'a, str>>| Word { text: key.get_ref().to_string(), span: key.span() };
    let mut entries: Vec<_> = table.iter().map(|(key, value)| (word(key), value)).collect();
    entries.sort_by_key(|(key, _)| key.span.start);
    entries
}

/// The first line of a table.
fn heading(span: &Range<usize>, source: FileSource<'_>) -> Range<usize> {
    let line = source.text.get(span.clone()).and_then(|text| text.find('\n')).unwrap_or(span.len());
    span.start..span.start + line
}

/// The entry of that word.
pub fn find<T: Copy>(word: &Word, key: &str, choices: &[(&'static str, T)]) -> Read<T> {
    match choices.iter().find(|(known, _)| *known == word.text) {
        Some((_, value)) => Ok(*value),
        None => Err(Diagnostic::unknown(word.span.clone(), key, &word.text, choices.iter().map(|c| c.0))),
    }
}

/// A number, or an expression in quotes.
pub fn tree(value: &Value<'_>, key: &str, source: FileSource<'_>) -> Read<Tree> {
    let number = match value.get_ref() {
        DeValue::String(text) => return Tree::parse(text, place(value, text, source)),
        DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
        DeValue::Float(f) => f.as_str().parse::<f64>().ok(),
        _ => return Err(wrong_type(value, &format!("`{key}`"), "a number, or an expression in quotes")),
    };
    match number.filter(|x| x.is_finite()) {
        Some(x) => Ok(Tree::number(x, value.span())),
        None => {
            let complaint = Diagnostic::new(value.span(), format!("`{key}` must be a finite number"));
            Err(complaint.help("leave a bound out where there is none"))
        }
    }
}

/// Where the letters of a text stand.
pub fn place(value: &Value<'_>, text: &str, source: FileSource<'_>) -> TextPlace {
    let span = value.span();
    let quoted = source.text.get(span.clone()).unwrap_or("");
    if quoted.len() == text.len() + 2 && &quoted[1..=text.len()] == text {
        TextPlace::From(span.start + 1)
    } else {
        TextPlace::Within(span)
    }
}

/// The number that an expression of constants is.
pub fn constant(tree: &Tree, key: &str, names: &Names) -> Read<f64> {
    let program = names.compile(tree, &Wants { place: &format!("`{key}`"), ..Wants::NUMBER })?;
    Ok(program.as_constant().expect("an expression of constants is folded"))
}

/// A list of two expressions.
pub fn pair(value: &Value<'_>, key: &str, names: &Names, wants: &Wants, source: FileSource<'_>) -> Read<[Program; 2]> {
    let two = "two values [x, y]";
    let list = value.get_ref().as_array().ok_or_else(|| wrong_type(value, &format!("`{key}`"), two))?;
    if list.len() != 2 {
        return Err(Diagnostic::new(value.span(), format!("`{key}` takes {two}, got {}", list.len())));
    }
    let one = |k: usize| -> Read<Program> {
        let tree = tree(&list[k], key, source)?;
        names.compile(&tree, &Wants { place: &format!("`{key}`"), ..*wants })
    };
    Ok([one(0)?, one(1)?])
}

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
