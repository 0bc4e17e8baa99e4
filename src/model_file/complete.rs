//! Completion of the text of a model file at a position.

use super::expression::REDUCTIONS;
use super::{Accepts, Key, Need, TableKeys, tables};
use crate::sao::presets;

/// Completions at a position of a text.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Completions {
    /// First byte of the word that is replaced; it ends at the position.
    pub from: usize,
    /// The words; those of required keys come first.
    pub words: Vec<Completion>,
}

/// A completion: a word that can be inserted at a position.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// The text that replaces the word.
    pub text: String,
    /// Description of the word.
    pub about: String,
}

impl Completion {
    fn new(text: impl Into<String>, about: impl Into<String>) -> Self {
        Self { text: text.into(), about: about.into() }
    }
}

/// Completions at byte `at` of a model file: tables after a bracket, keys that the current table does not have yet, and
/// after `=` the words, names and quantities that the key takes.
///
/// The text may have errors. Nothing is offered inside a comment, and none for plain numbers and texts.
///
/// ```
/// use linkwright::model_file::completions;
/// let text = "version = 2\n[[body]]\nma";
/// let found = completions(text, text.len());
/// assert_eq!((found.from, found.words[0].text.as_str()), (text.len() - 2, "mass = "));
/// ```
pub fn completions(text: &str, at: usize) -> Completions {
    let Some(before) = text.get(..at) else { return Completions::default() };
    let line = before.rsplit('\n').next().unwrap_or_default();
    if has_comment(line) {
        return Completions::default();
    }
    let (word, found) = match line.trim_start() {
        header if header.starts_with('[') && !header.contains(']') => (header, headers()),
        _ => {
            let (part, in_space) = enclosing(text, before.len() - line.len());
            match line.split_once('=') {
                Some((key, value)) => {
                    let word = current_word(value);
                    (word, part.values(text, key.trim(), &value[..value.len() - word.len()], in_space))
                }
                None => (line.trim_start(), part.missing_keys()),
            }
        }
    };
    let lower = word.to_lowercase();
    // A word that is written in quotes is also found by its beginning without them.
    let begins = |text: &str| {
        let text = text.to_lowercase();
        text.starts_with(&lower) || text.trim_start_matches('"').starts_with(&lower)
    };
    let words = found.into_iter().filter(|one| begins(&one.text) && one.text != word);
    Completions { from: at - word.len(), words: words.collect() }
}

/// Returns whether a line has a comment: a `#` outside of quotes.
fn has_comment(line: &str) -> bool {
    let mut quote = None;
    for c in line.chars() {
        match (c, quote) {
            ('#', None) => return true,
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(q)) if c == q => quote = None,
            _ => {}
        }
    }
    false
}

/// The name, or its beginning, at the end of a value.
fn current_word(value: &str) -> &str {
    let is_part = |c: char| c.is_alphanumeric() || "_.-".contains(c);
    let start =
        value.rfind(|c: char| !is_part(c)).map_or(0, |i| i + value[i..].chars().next().map_or(1, char::len_utf8));
    value[start..].trim_start_matches(['-', '.'])
}

/// Returns whether the tables of this name are a list, `[[name]]`.
fn is_list(name: &str) -> bool {
    let file = tables().into_iter().find(|table| table.name.is_empty());
    file.is_some_and(|file| file.keys.iter().any(|key| key.name == name && key.accepts == Accepts::Tables))
}

/// Brackets of all tables of a file.
fn headers() -> Vec<Completion> {
    let mut all: Vec<Completion> = vec![];
    for table in tables().iter().filter(|table| !table.name.is_empty() && !table.name.ends_with('3')) {
        let text = if is_list(table.name) { format!("[[{}]]", table.name) } else { format!("[{}]", table.name) };
        let is_nested = !is_list(table.name) && !table.name.contains('.') && !is_section(table.name);
        if !is_nested && all.iter().all(|known| known.text != text) {
            all.push(Completion::new(text, if table.kind.is_some() { "" } else { table.about }));
        }
    }
    all
}

/// Returns whether a file has one table of this name.
fn is_section(name: &str) -> bool {
    let file = tables().into_iter().find(|table| table.name.is_empty());
    file.is_some_and(|file| file.keys.iter().any(|key| key.name == name && key.accepts == Accepts::Table))
}

/// A table of a text: its keys, and those that it has.
struct TableWords {
    keys: Vec<Key>,
    kinds: Vec<(&'static str, &'static str)>,
    present: Vec<String>,
}

/// The table that contains the line that begins at byte `at`, and whether it is in space.
fn enclosing(text: &str, at: usize) -> (TableWords, bool) {
    let is_header = |line: &str| line.trim_start().starts_with('[');
    let start = line_starts(text).filter(|(from, line)| *from < at && is_header(line)).last();
    let header =
        start.map_or("", |(_, line)| line.trim().trim_start_matches('[').split(']').next().unwrap_or_default());
    let first = start.map_or(0, |(from, line)| from + line.len());
    let lines: Vec<&str> = line_starts(text)
        .filter(|(from, _)| *from >= first)
        .take_while(|(_, line)| !is_header(line))
        .filter(|(from, _)| *from != at)
        .map(|(_, line)| line)
        .collect();
    let settings: Vec<(&str, &str)> = lines.iter().filter_map(|line| line.split_once('=')).collect();
    let value = |name: &str| settings.iter().find(|(key, _)| key.trim() == name).map(|(_, value)| unquoted(value));
    let in_space = line_starts(text).any(|(_, line)| {
        line.split_once('=').is_some_and(|(key, value)| key.trim() == "space" && unquoted(value) == "3")
    });
    let kind = value("kind");
    let all = own_tables(header.trim(), in_space);
    let mut kinds: Vec<(&str, &str)> = all.iter().filter_map(|table| Some((table.kind?, table.about))).collect();
    kinds.dedup_by_key(|(kind, _)| *kind);
    let is_own = |table: &&TableKeys| kind.is_none() || table.kind.is_none() || table.kind == kind;
    let mut keys: Vec<Key> = vec![];
    for key in all.iter().filter(is_own).flat_map(|table| table.keys) {
        if !keys.iter().any(|known| known.name == key.name) {
            keys.push(*key);
        }
    }
    let present = settings.iter().map(|(key, _)| key.trim().to_owned()).collect();
    (TableWords { keys, kinds, present }, in_space)
}

/// The declarations of the table with a header; the names of those in space end with 3.
fn own_tables(header: &str, in_space: bool) -> Vec<TableKeys> {
    let group = header.split_once('.').map_or_else(|| header.to_owned(), |(group, _)| format!("{group}.NAME"));
    let named = |name: &str| tables().into_iter().filter(|table| table.name == name).collect::<Vec<_>>();
    let spatial = if in_space { named(&format!("{group}3")) } else { vec![] };
    if spatial.is_empty() { named(&group) } else { spatial }
}

/// The lines of a text with their first bytes.
fn line_starts(text: &str) -> impl Iterator<Item = (usize, &str)> {
    text.split_inclusive('\n').scan(0, |at, line| {
        let from = *at;
        *at += line.len();
        Some((from, line))
    })
}

/// A value without its quotes and a comment after it.
fn unquoted(value: &str) -> &str {
    let value = value.trim();
    match value.strip_prefix('"') {
        Some(rest) => rest.split('"').next().unwrap_or_default(),
        None => value.split('#').next().unwrap_or_default().trim(),
    }
}

impl TableWords {
    /// Keys that the table does not have, the required ones first.
    fn missing_keys(&self) -> Vec<Completion> {
        let missing = |key: &&Key| !self.present.iter().any(|present| present == key.name);
        let of = |is_required: bool| self.keys.iter().filter(move |key| (key.need == Need::Required) == is_required);
        let word = |key: &Key| match key.accepts {
            Accepts::Table | Accepts::Tables => None,
            _ => Some(Completion::new(format!("{} = ", key.name), described(key))),
        };
        of(true).chain(of(false)).filter(missing).filter_map(word).collect()
    }

    /// Completions of the value of a key; `opened` is the value before the current word.
    fn values(&self, text: &str, key: &str, opened: &str, in_space: bool) -> Vec<Completion> {
        let Some(accepts) = self.keys.iter().find(|known| known.name == key).map(|known| known.accepts) else {
            return vec![];
        };
        let is_quoted = opened.matches('"').count() % 2 == 1;
        let quoted = |word: &str, about: &str| {
            Completion::new(if is_quoted { word.to_owned() } else { format!("\"{word}\"") }, about)
        };
        let names = |groups: &[&'static str]| named_parts(text, groups);
        let quantity = |with_outputs: bool| {
            let groups: &[&'static str] =
                if with_outputs { &["design", "constant", "output"] } else { &["design", "constant"] };
            let mut all: Vec<Completion> =
                names(groups).into_iter().map(|(name, group)| Completion::new(name, group)).collect();
            if with_outputs {
                all.extend(REDUCTIONS.iter().map(|(name, _, _, about)| Completion::new(format!("{name}("), *about)));
            }
            if is_quoted { all } else { vec![] }
        };
        let places = || names(&["body", "point", "beam"]).into_iter().chain([("ground".to_owned(), "the ground")]);
        if key == "kind" {
            return self.kinds.iter().map(|(kind, about)| quoted(kind, about)).collect();
        }
        if key == "preset" {
            return presets().iter().map(|preset| quoted(preset.name, preset.title)).collect();
        }
        match accepts {
            Accepts::Choice(words) | Accepts::NumberOr(words) => words.iter().map(|word| quoted(word, "")).collect(),
            Accepts::Flag => ["true", "false"].map(|word| Completion::new(word, "")).into(),
            Accepts::Marker | Accepts::Name | Accepts::Names | Accepts::Place => {
                places().map(|(name, group)| quoted(&name, group)).collect()
            }
            Accepts::Coordinate => {
                let ends: &[&str] = if in_space { &["x", "y", "z"] } else { &["x", "y", "theta"] };
                let of = |(name, group): (String, &'static str)| {
                    ends.iter().map(move |end| (format!("{name}.{end}"), group)).collect::<Vec<_>>()
                };
                names(&["body"]).into_iter().flat_map(of).map(|(name, group)| quoted(&name, group)).collect()
            }
            Accepts::Quantity | Accepts::Quantities => quantity(true),
            Accepts::Number
            | Accepts::Expression
            | Accepts::Pair
            | Accepts::Pairs
            | Accepts::Triple
            | Accepts::Vector
            | Accepts::Motion
            | Accepts::Feedback => quantity(false),
            _ => vec![],
        }
    }
}

/// The description of a key with what it takes and its default.
fn described(key: &Key) -> String {
    let need = match key.need {
        Need::Required => "required; ".to_owned(),
        Need::Default("") | Need::Optional => String::new(),
        Need::Default(value) => format!("default {value}; "),
    };
    format!("{need}{}: {}", key.accepts.words(), key.about)
}

/// The names of the parts of a text: of lists by their `name`, of `[group.NAME]` by the header, and of keys in `[group]`.
fn named_parts(text: &str, groups: &[&'static str]) -> Vec<(String, &'static str)> {
    let (mut header, mut found): (&str, Vec<(String, &'static str)>) = ("", vec![]);
    for (_, line) in line_starts(text) {
        let line = line.trim();
        if line.starts_with('[') {
            header = line.trim_start_matches('[').split(']').next().unwrap_or_default().trim();
        }
        let group = groups.iter().find(|group| header.split('.').next() == Some(**group));
        let Some(group) = group else { continue };
        let name = match (line.split_once('='), header.split_once('.')) {
            (None, Some((_, name))) if line.starts_with('[') => name,
            (Some((key, _)), None) if !is_list(header) => key.trim(),
            (Some((key, value)), None) if key.trim() == "name" => unquoted(value),
            _ => continue,
        };
        if !name.is_empty() && !name.contains('{') {
            found.push((name.to_owned(), group));
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words that are offered at the mark `|` of a text.
    fn at(marked: &str) -> Vec<String> {
        let at = marked.find('|').unwrap();
        let text = marked.replacen('|', "", 1);
        completions(&text, at).words.into_iter().map(|word| word.text).collect()
    }

    #[test]
    fn tables_keys_kinds_words_and_names_are_offered() {
        assert!(at("[[bo|").contains(&"[[body]]".to_owned()));
        assert!(at("[obj|").contains(&"[objective]".to_owned()));
        // Required keys come first; keys that the table has already are not offered.
        let keys = at("[[constraint]]\nname = \"a\"\n|\n");
        assert_eq!(keys[0], "value = ");
        assert!(keys.contains(&"at_most = ".to_owned()) && !keys.contains(&"name = ".to_owned()), "{keys:?}");
        let kinds = at("[[joint]]\nkind = \"re|\n");
        assert!(kinds.contains(&"revolute".to_owned()), "{kinds:?}");
        assert!(at("[[joint]]\nkind = r|").contains(&"\"revolute\"".to_owned()));
        // Keys of one kind only, wherever the kind stands.
        let keys = at("[[joint]]\n|\nkind = \"revolute\"\n");
        assert!(!keys.contains(&"kind = ".to_owned()) && !keys.is_empty());
        let text = "[design.k]\nstart = 1\n[constants]\ng = 9.81\n[[output]]\nname = \"torque\"\n[objective]\nminimize = \"t|\"\n";
        assert_eq!(at(text)[0], "torque");
        assert!(
            at("[[body]]\nname = \"arm\"\n[[joint]]\nkind = \"revolute\"\nbodies = [\"a|\n").iter().all(|w| w == "arm")
        );
        assert_eq!(at("[method]\npreset = \"gcm|"), ["gcmma"]);
        assert!(at("space = 3\n[[joint]]\nkind = \"sph|").contains(&"spherical".to_owned()));
    }

    #[test]
    fn nothing_is_offered_in_comments_and_at_places_that_are_none() {
        assert!(at("[[body]]\n# ma|").is_empty());
        assert!(at("[[body]]\ntitle = \"#\" # |").is_empty());
        assert!(at("[nothing]\nma|").is_empty());
        assert_eq!(completions("ä", 1), Completions::default());
        assert_eq!(completions("", 5), Completions::default());
    }
}
