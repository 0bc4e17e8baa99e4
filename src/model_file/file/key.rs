//! Keys of a file: one declaration for reader, documentation and schema.

/// Type of the value of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Accepts {
    /// A number or an expression of constants.
    Number,
    /// A number or an expression of constants and design variables.
    Expression,
    /// Two expressions.
    Pair,
    /// A list of pairs of expressions.
    Pairs,
    /// Three expressions.
    Triple,
    /// Two expressions, or three in space.
    Vector,
    /// A point in space: three expressions, or the name of a point.
    Place,
    /// A direction in space: three expressions, or the names of two points.
    Direction,
    /// An expression of time, or a table that names a kind of motion.
    Motion,
    /// An expression of time, and of positions and velocities.
    Feedback,
    /// An expression that may name outputs, too.
    Quantity,
    /// An expression that may name outputs, or a list of them.
    Quantities,
    /// Several numbers or expressions of constants.
    Numbers,
    /// A whole number.
    Count,
    /// `true` or `false`.
    Flag,
    /// Any text.
    Text,
    /// Several texts.
    Texts,
    /// A comparison of expressions of time and motion.
    Condition,
    /// A name, or several names.
    Names,
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
    /// Tables `[[name]]`, one for each part.
    Tables,
    /// Values of each index of copies: a list of words, or a range of whole numbers; or a list of tables.
    Each,
}

/// Required, optional, or with a default value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The key is required.
    Required,
    /// The key is optional and has this default.
    Default(&'static str),
    /// The key is optional.
    Optional,
}

/// Declaration of a key: name, type and description.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Name of the key.
    pub name: &'static str,
    /// Type of the value.
    pub accepts: Accepts,
    /// Required, optional, or with a default value.
    pub need: Need,
    /// Description for the documentation, with the unit.
    pub about: &'static str,
    /// Units of a value that has one, as in "N/m or N·m/rad": "1" for a plain number, empty for any unit.
    pub unit: &'static str,
}

/// Declaration of a table of a file, or of one kind of it, with its keys.
#[derive(Clone, Copy, Debug)]
pub struct TableKeys {
    /// Name in brackets.
    pub name: &'static str,
    /// The value of `kind`, if the table has several kinds.
    pub kind: Option<&'static str>,
    /// Description for the documentation.
    pub about: &'static str,
    /// Keys. Keys that all kinds share are in the table without a kind.
    pub keys: &'static [Key],
}

pub(crate) const fn required(name: &'static str, accepts: Accepts, about: &'static str) -> Key {
    Key { name, accepts, need: Need::Required, about, unit: "1" }
}

pub(crate) const fn optional(name: &'static str, accepts: Accepts, about: &'static str) -> Key {
    Key { name, accepts, need: Need::Optional, about, unit: "1" }
}

pub(crate) const fn default(name: &'static str, accepts: Accepts, value: &'static str, about: &'static str) -> Key {
    Key { name, accepts, need: Need::Default(value), about, unit: "1" }
}

/// The key that replicates a table.
pub(super) const EACH: Key = optional(
    "each",
    Accepts::Each,
    "makes one copy for each value, or for each table of a list; `{i}`, `{i+1}` in texts are replaced by it",
);

impl Key {
    /// Sets the units of the value.
    pub(super) const fn of(self, unit: &'static str) -> Self {
        Self { unit, ..self }
    }

    /// The value may have any unit.
    pub(super) const fn of_any_unit(self) -> Self {
        self.of("")
    }
}

impl Accepts {
    /// The type in words.
    pub fn words(&self) -> String {
        let words = match self {
            Self::Number => "number",
            Self::Expression => "expression",
            Self::Pair => "two expressions",
            Self::Pairs => "list of pairs of expressions",
            Self::Triple => "three expressions",
            Self::Vector => "two expressions, three in space",
            Self::Place => "three expressions, or a point",
            Self::Direction => "three expressions, or two points",
            Self::Motion => "expression of time, or motion",
            Self::Feedback => "expression of time and motion",
            Self::Quantity => "expression of outputs",
            Self::Quantities => "expression of outputs, or a list",
            Self::Numbers => "list of numbers",
            Self::Count => "whole number",
            Self::Flag => "true or false",
            Self::Text => "text",
            Self::Texts => "list of texts",
            Self::Condition => "comparison",
            Self::Names => "name, or a list of names",
            Self::Name => "name",
            Self::Marker => "point",
            Self::Coordinate => "coordinate",
            Self::Intermediate => "intermediate variables",
            Self::Table => "table",
            Self::Tables => "tables",
            Self::Each => "table of lists, or list of tables",
            Self::Choice(words) => return quoted(words),
            Self::NumberOr(words) => return format!("number or {}", quoted(words)),
        };
        words.to_owned()
    }
}

fn quoted(words: &[&str]) -> String {
    words.iter().map(|w| format!("\"{w}\"")).collect::<Vec<_>>().join(", ")
}
