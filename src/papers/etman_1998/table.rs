//! One of the paper's tables: the printed one, ours, and the difference.

use super::printed;
use crate::error::{Error, Result};

/// A table of the paper beside ours.
#[derive(Clone, Debug)]
pub struct Table {
    /// File stem: `table1`.
    pub name: &'static str,
    /// Heading.
    pub title: String,
    /// Column names, those of the CSV files.
    pub columns: Vec<String>,
    /// The printed cells, row by row.
    pub printed: Vec<Vec<String>>,
    /// Our cells, row by row.
    pub ours: Vec<Vec<Cell>>,
    /// What a reader must know: stand-ins, misprints, levels of rounding.
    pub notes: Vec<String>,
}

/// One cell of ours.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// A number.
    Number(f64),
    /// A word, a count or a label.
    Text(String),
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}
impl From<usize> for Cell {
    fn from(value: usize) -> Self {
        Self::Text(value.to_string())
    }
}
impl From<&str> for Cell {
    fn from(value: &str) -> Self {
        Self::Text(value.to_owned())
    }
}

impl Cell {
    /// Full precision: the shortest text that reads back with the same bits.
    pub fn exact(&self) -> String {
        match self {
            Self::Number(v) if v.abs() >= 1e-4 && v.abs() < 1e15 || *v == 0.0 => v.to_string(),
            Self::Number(v) => format!("{v:e}"),
            Self::Text(t) => t.clone(),
        }
    }

    fn like(&self, printed: Option<&str>) -> String {
        match (self, printed) {
            (Self::Number(v), Some(p)) => printed::like(*v, p),
            (Self::Number(v), None) => format!("{v:.4e}"),
            (Self::Text(t), _) => t.clone(),
        }
    }

    fn agrees(&self, printed: &str) -> bool {
        match self {
            Self::Number(v) => printed::agrees(*v, printed),
            Self::Text(t) => t == printed,
        }
    }
}

impl Table {
    /// A table from the CSV text of the printed one.
    pub fn new(name: &'static str, title: &str, csv: &str, ours: Vec<Vec<Cell>>) -> Result<Self> {
        let split = |line: &str| line.split(',').map(|c| c.trim().to_owned()).collect::<Vec<_>>();
        let mut lines = csv.lines().filter(|l| !l.trim().is_empty()).map(split);
        let empty = || Error::File {
            file: format!("{name}.csv"),
            why: "it is empty".to_owned(),
            remedy: "give a header line".to_owned(),
        };
        let columns = lines.next().ok_or_else(empty)?;
        let printed: Vec<Vec<String>> = lines.collect();
        for row in ours.iter().map(Vec::len).chain(printed.iter().map(Vec::len)) {
            Error::check_length(&format!("a row of {name}"), columns.len(), row)?;
        }
        Ok(Self { name, title: title.to_owned(), columns, printed, ours, notes: vec![] })
    }

    /// The same table with a note under it.
    #[must_use]
    pub fn noting(mut self, note: impl Into<String>) -> Self {
        self.notes.push(note.into());
        self
    }

    /// Cells of ours that differ from the printed ones, as (row, column); rows that the other side lacks count whole.
    pub fn differences(&self) -> Vec<(usize, usize)> {
        let rows = 0..self.ours.len().max(self.printed.len());
        let cells = rows.flat_map(|r| (0..self.columns.len()).map(move |c| (r, c)));
        cells.filter(|&(r, c)| !self.same(r, c)).collect()
    }

    fn same(&self, row: usize, column: usize) -> bool {
        match (self.ours.get(row), self.printed.get(row)) {
            (Some(ours), Some(printed)) => ours[column].agrees(&printed[column]),
            _ => false,
        }
    }

    /// Ours in full precision, with the columns of the printed table.
    pub fn csv(&self) -> String {
        let rows = self.ours.iter().map(|row| row.iter().map(Cell::exact).collect::<Vec<_>>().join(","));
        std::iter::once(self.columns.join(",")).chain(rows).map(|line| line + "\n").collect()
    }

    /// Both tables interleaved for reading: a line of ours under each printed line, `≠` behind every cell that differs.
    pub fn text(&self) -> String {
        let mut lines = vec![self.header()];
        for row in 0..self.ours.len().max(self.printed.len()) {
            if let Some(printed) = self.printed.get(row) {
                lines
                    .push(std::iter::once("paper".to_owned()).chain(printed.iter().map(|c| format!("{c} "))).collect());
            }
            if let Some(ours) = self.ours.get(row) {
                let cell = |(c, cell): (usize, &Cell)| {
                    let printed = self.printed.get(row).map(|p| p[c].as_str());
                    let mark = if self.same(row, c) { " " } else { "≠" };
                    cell.like(printed) + mark
                };
                lines.push(std::iter::once("ours".to_owned()).chain(ours.iter().enumerate().map(cell)).collect());
            }
        }
        let notes: String = self.notes.iter().map(|n| format!("  {n}\n")).collect();
        format!("{}\n{}{notes}", self.title, align(&lines))
    }

    fn header(&self) -> Vec<String> {
        std::iter::once(String::new()).chain(self.columns.iter().map(|c| short(c) + " ")).collect()
    }

    /// A Markdown table of ours beside the printed one: `ours (printed)` where they differ.
    pub fn markdown(&self) -> String {
        let mut text = format!("| {} |\n|{}\n", self.columns.join(" | "), "---|".repeat(self.columns.len()));
        for (r, ours) in self.ours.iter().enumerate() {
            let cell = |(c, cell): (usize, &Cell)| {
                let printed = self.printed.get(r).map(|p| p[c].as_str());
                let value = cell.like(printed);
                if self.same(r, c) { value } else { format!("**{value}** ({})", printed.unwrap_or("–")) }
            };
            text += &format!("| {} |\n", ours.iter().enumerate().map(cell).collect::<Vec<_>>().join(" | "));
        }
        text
    }
}

/// Column names as the paper's letters, short enough for a terminal.
fn short(column: &str) -> String {
    match column {
        "accepted" => "ok",
        "active_move_limits" => "mvlm",
        "max_approximation_error_pct" => "E_g %",
        "objective_error_pct" => "E_f %",
        "max_violation_pct" => "V %",
        "max_variable_change_pct" => "max Δb %",
        "objective" => "F",
        "b3_objective" => "b3 = F",
        "mass_kg" => "F kg",
        other => other,
    }
    .to_owned()
}

/// Columns of equal width, the first flush left, the others flush right.
fn align(lines: &[Vec<String>]) -> String {
    let width = |c: usize| lines.iter().map(|l| l[c].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..lines[0].len()).map(width).collect();
    let line = |cells: &Vec<String>| {
        let cell = |(c, text): (usize, &String)| {
            let pad = " ".repeat(widths[c] - text.chars().count());
            if c == 0 { format!("  {text}{pad}") } else { format!("  {pad}{text}") }
        };
        cells.iter().enumerate().map(cell).collect::<String>().trim_end().to_owned() + "\n"
    };
    lines.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        let ours = vec![vec![Cell::from(0usize), 0.6232.into()], vec![1usize.into(), 0.644.into()]];
        Table::new("table9", "Table IX", "cycle,b1\n0,0.6232\n1,0.6640\n2,1.0\n", ours).unwrap()
    }

    #[test]
    fn marks_what_differs() {
        assert_eq!(table().differences(), [(1, 1), (2, 0), (2, 1)]);
        let text = table().noting("a misprint").text();
        assert!(text.contains("0.6440≠") && text.contains("a misprint") && !text.contains("0.6232≠"), "{text}");
        assert!(table().markdown().contains("**0.6440** (0.6640)"));
    }

    #[test]
    fn writes_full_precision() {
        assert_eq!(table().csv(), "cycle,b1\n0,0.6232\n1,0.644\n");
        assert_eq!(Cell::from(1.5e-9).exact(), "1.5e-9");
    }

    #[test]
    fn a_row_of_the_wrong_length_is_refused() {
        assert!(Table::new("t", "T", "a,b\n1\n", vec![]).is_err());
        assert!(Table::new("t", "T", "", vec![]).unwrap_err().to_string().contains("empty"));
    }
}
