//! Keys that may stand in a file: one declaration for reader, documentation and schema.

/// What a key takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accepts {
    /// A number or an expression of constants.
    Number,
    /// A number or an expression of constants and design variables.
    Expression,
    /// Two of them.
    Pair,
    /// An expression of time, or a table that names a kind of motion.
    Motion,
    /// An expression of time, and of positions and velocities.
    Feedback,
    /// A number or expression that may name outputs, too.
    Quantity,
    /// Several numbers or expressions of constants.
    Numbers,
    /// A whole number.
    Count,
    /// `true` or `false`.
    Flag,
    /// Any words.
    Text,
    /// A name.
    Name,
    /// The name of a body, beam node or point, or a table with `body` and `at`.
    Marker,
    /// A coordinate such as `crank.theta`.
    Coordinate,
    /// One of these words.
    Choice(&'static [&'static str]),
    /// Intermediate variables: a word, an exponent, or a table with one of them for each design variable.
    Intermediate,
    /// A number or one of these words.
    NumberOr(&'static [&'static str]),
    /// A table.
    Table,
    /// Tables, one for each part: `[[name]]`.
    Tables,
    /// Words, or the first and last of a row of whole numbers, for each letter.
    Each,
}

/// Whether a key can be left out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// It cannot.
    Required,
    /// It can, and then means this.
    Default(&'static str),
    /// It can.
    Optional,
}

/// A key with what it takes and means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// As it is written.
    pub name: &'static str,
    /// What it takes.
    pub accepts: Accepts,
    /// Whether it can be left out.
    pub need: Need,
    /// What it means, with unit.
    pub about: &'static str,
}

/// A table of a file, or one kind of it, with its keys.
#[derive(Clone, Copy, Debug)]
pub struct Table {
    /// Name, as it stands in brackets.
    pub name: &'static str,
    /// The value of `kind`, where there are several.
    pub kind: Option<&'static str>,
    /// What it is.
    pub about: &'static str,
    /// Its keys; those that all kinds share stand in the table without a kind.
    pub keys: &'static [Key],
}

pub(super) const fn required(name: &'static str, accepts: Accepts, about: &'static str) -> Key {
    Key { name, accepts, need: Need::Required, about }
}

pub(super) const fn optional(name: &'static str, accepts: Accepts, about: &'static str) -> Key {
    Key { name, accepts, need: Need::Optional, about }
}

pub(super) const fn default(name: &'static str, accepts: Accepts, value: &'static str, about: &'static str) -> Key {
    Key { name, accepts, need: Need::Default(value), about }
}

/// The key by which a table stands for several.
pub(super) const EACH: Key =
    optional("each", Accepts::Each, "makes one copy for every value; `{i}`, `{i+1}` in texts stand for it");

impl Accepts {
    /// What it takes, in words.
    pub fn words(&self) -> String {
        let words = match self {
            Self::Number => "number",
            Self::Expression => "expression",
            Self::Pair => "two expressions",
            Self::Motion => "expression of time, or motion",
            Self::Feedback => "expression of time and motion",
            Self::Quantity => "expression of outputs",
            Self::Numbers => "list of numbers",
            Self::Count => "whole number",
            Self::Flag => "true or false",
            Self::Text => "text",
            Self::Name => "name",
            Self::Marker => "point",
            Self::Coordinate => "coordinate",
            Self::Intermediate => "intermediate variables",
            Self::Table => "table",
            Self::Tables => "tables",
            Self::Each => "table of lists",
            Self::Choice(words) => return quoted(words),
            Self::NumberOr(words) => return format!("number or {}", quoted(words)),
        };
        words.to_owned()
    }
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ")
}
