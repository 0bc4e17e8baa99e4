//! Form of the output of a comparison.

use crate::command::output::say;
use linkwright::report::table::Table;

/// Form of the output.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum OutputForm {
    /// Text with this number of significant digits.
    Text(usize),
    Json,
    Nothing,
}

impl OutputForm {
    /// Prints a table, as text or as a line of JSON for each row.
    pub fn table(self, table: &Table) -> anyhow::Result<()> {
        match self {
            Self::Text(digits) => say(&table.text_with(digits)),
            Self::Json => table.json_lines().iter().try_for_each(|line| say(line)),
            Self::Nothing => Ok(()),
        }
    }

    /// Prints a line that is not part of the JSON.
    pub fn text(self, line: &str) -> anyhow::Result<()> {
        if matches!(self, Self::Text(_)) { say(line) } else { Ok(()) }
    }
}
