//! Tables as text, CSV, JSON lines, HTML and Parquet, and their comparison with printed ones.

mod comparison;
mod csv;
mod html;
#[cfg(feature = "parquet")]
mod parquet;

pub use comparison::{Printed, TableComparison};

use crate::report::number::{DIGITS, in_column};
use crate::{Error, Result};

/// A cell of a table.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A number.
    Number(f64),
    /// An integer.
    Whole(i64),
    /// A text.
    Text(String),
    /// No value.
    Empty,
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        // A count that does not fit would exceed any memory.
        Self::Whole(i64::try_from(value).unwrap_or(i64::MAX))
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

/// Rows of cells under named columns.
///
/// ```
/// use linkwright::report::table::Table;
///
/// let mut table = Table::new("Two cycles", ["cycle", "objective"]);
/// table.push([0usize.into(), 0.85.into()])?;
/// table.push([1usize.into(), 0.1_f64.exp().into()])?;
/// assert_eq!(table.csv(), "cycle,objective\n0,0.85\n1,1.1051709180756477\n");
/// assert_eq!(table.text().lines().last(), Some("    1     1.1052"));
/// # Ok::<(), linkwright::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// Title, shown above the table.
    pub title: String,
    columns: Vec<String>,
    headings: Option<Vec<String>>,
    rows: Vec<Vec<Cell>>,
}

impl Table {
    /// An empty table.
    pub fn new<N: Into<String>>(title: impl Into<String>, columns: impl IntoIterator<Item = N>) -> Self {
        Self {
            title: title.into(),
            columns: columns.into_iter().map(Into::into).collect(),
            headings: None,
            rows: Vec::new(),
        }
    }

    /// Sets headings for text and HTML; CSV and JSON keep the names of the columns.
    ///
    /// # Errors
    /// [`Error::Length`] unless every column has a heading.
    pub fn headed<N: Into<String>>(mut self, headings: impl IntoIterator<Item = N>) -> Result<Self> {
        let headings: Vec<String> = headings.into_iter().map(Into::into).collect();
        Error::check_length(&format!("headings of the table '{}'", self.title), self.columns.len(), headings.len())?;
        self.headings = Some(headings);
        Ok(self)
    }

    /// The headings, or the names of the columns.
    fn headings(&self) -> &[String] {
        self.headings.as_deref().unwrap_or(&self.columns)
    }

    /// Appends a row.
    ///
    /// # Errors
    /// [`Error::Length`] unless the row has a cell for every column.
    pub fn push(&mut self, row: impl IntoIterator<Item = Cell>) -> Result<()> {
        let row: Vec<Cell> = row.into_iter().collect();
        Error::check_length(&format!("row of the table '{}'", self.title), self.columns.len(), row.len())?;
        self.rows.push(row);
        Ok(())
    }

    /// Names of the columns.
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// The rows.
    pub fn rows(&self) -> &[Vec<Cell>] {
        &self.rows
    }

    /// A JSON object for each row; empty cells and numbers that are not finite are null.
    pub fn json_lines(&self) -> Vec<String> {
        use serde_json::{Map, Value};
        let value = |cell: &Cell| match cell {
            Cell::Number(v) => Value::from(*v),
            Cell::Whole(v) => Value::from(*v),
            Cell::Text(text) => Value::from(text.as_str()),
            Cell::Empty => Value::Null,
        };
        let object = |row: &Vec<Cell>| -> Map<String, Value> {
            self.columns.iter().cloned().zip(row.iter().map(value)).collect()
        };
        self.rows.iter().map(|row| Value::Object(object(row)).to_string()).collect()
    }

    /// The table as text: title, headings, and columns aligned on the right; numbers have five significant digits.
    pub fn text(&self) -> String {
        self.text_with(DIGITS)
    }

    /// As [`text`](Self::text), with another number of significant digits, at least one.
    pub fn text_with(&self, digits: usize) -> String {
        let text = |cell: &Cell| cell_text(cell, digits.max(1));
        let rows: Vec<Vec<String>> = self.rows.iter().map(|row| row.iter().map(text).collect()).collect();
        format!("{}\n{}", one_line(&self.title), aligned(self.headings(), &rows))
    }
}

/// A text of a user, such as a name or a unit, in one line: ends of lines are shown as other control characters are.
pub fn one_line(text: &str) -> String {
    text.replace('\n', "\\u000a")
}

/// A cell as text with five significant digits of a number.
fn text_of(cell: &Cell) -> String {
    cell_text(cell, DIGITS)
}

/// A cell as text with this number of significant digits of a number.
fn cell_text(cell: &Cell, digits: usize) -> String {
    match cell {
        Cell::Number(v) => in_column(*v, digits),
        Cell::Whole(v) => v.to_string(),
        Cell::Text(text) => text.clone(),
        Cell::Empty => String::new(),
    }
}

/// Columns aligned on the right, under headings that are broken at spaces and underscores, and a rule.
pub(super) fn aligned(names: &[String], rows: &[Vec<String>]) -> String {
    let lines = |texts: &[String]| -> Vec<String> { texts.iter().map(|text| one_line(text)).collect() };
    let (names, rows) = (&lines(names), &rows.iter().map(|row| lines(row)).collect::<Vec<_>>());
    let cells: Vec<usize> =
        (0..names.len()).map(|c| rows.iter().map(|row| width(&row[c])).max().unwrap_or(0)).collect();
    let broken: Vec<Vec<String>> = names.iter().zip(&cells).map(|(name, &w)| broken(name, w.max(10))).collect();
    let widths: Vec<usize> =
        broken.iter().zip(&cells).map(|(parts, &w)| parts.iter().map(|p| width(p)).fold(w, usize::max)).collect();
    let line = |cells: Vec<&str>| -> String {
        let padded = cells.iter().zip(&widths).map(|(cell, w)| format!("{}{cell}", " ".repeat(w - width(cell))));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    let height = broken.iter().map(Vec::len).max().unwrap_or(0);
    // Headings are aligned at their last line.
    let part = |parts: &'_ Vec<String>, k: usize| (k + parts.len()).checked_sub(height).map(|k| parts[k].clone());
    let header = (0..height).map(|k| {
        let parts: Vec<String> = broken.iter().map(|parts| part(parts, k).unwrap_or_default()).collect();
        line(parts.iter().map(String::as_str).collect())
    });
    let rule = "─".repeat(widths.iter().sum::<usize>() + 2 * widths.len().saturating_sub(1)) + "\n";
    let body = rows.iter().map(|row| line(row.iter().map(String::as_str).collect()));
    header.chain([rule]).chain(body).collect()
}

fn width(text: &str) -> usize {
    text.chars().count()
}

/// A name broken at spaces and underscores into lines of at most `most` characters if possible.
fn broken(name: &str, most: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in name.split([' ', '_']).filter(|word| !word.is_empty()) {
        let last = lines.len() - 1;
        if lines[last].is_empty() {
            lines[last].push_str(word);
        } else if width(&lines[last]) + 1 + width(word) <= most {
            lines[last] = format!("{} {word}", lines[last]);
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_names_are_broken() {
        assert_eq!(broken("max_approximation_error_pct", 10), ["max", "approximation", "error pct"]);
        let mut table = Table::new("t", ["active move_limits", "b"]);
        table.push([2usize.into(), 1.5.into()]).unwrap();
        assert_eq!(table.text(), "t\nactive\n  move\nlimits       b\n──────────────\n     2  1.5000\n");
    }

    #[test]
    fn rows_of_another_length_are_rejected() {
        let mut table = Table::new("t", ["a", "b"]);
        assert!(table.push([Cell::Empty]).is_err());
        table.push(["x".into(), Cell::Empty]).unwrap();
        assert_eq!(table.text(), "t\na  b\n────\nx\n");
    }
}
