//! The plan of a study: phases of runs, a row for each run, and conclusions from all rows.

use super::error::StudyError;
use super::rows::{Row, Rows};
use crate::Result;
use crate::report::figure::Figure;
use crate::report::table::{Cell, Table};
use std::ops::Range;

/// A column of the rows of a phase.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Its unit; may be empty.
    pub unit: String,
    /// The words of which its values are the indices; empty for a column of numbers.
    pub words: Vec<String>,
    /// True if an earlier column has the same values, which tables do not repeat.
    pub is_repeated: bool,
    /// True if its values have equal ratios: figures show them on a logarithmic axis.
    pub is_logarithmic: bool,
    /// True if its values are counts: tables show integers.
    pub is_count: bool,
}

impl Column {
    /// A column of numbers.
    pub fn new(name: impl Into<String>, unit: impl Into<String>) -> Self {
        let (name, unit) = (name.into(), unit.into());
        Self { name, unit, words: vec![], is_repeated: false, is_logarithmic: false, is_count: false }
    }

    /// A column of counts.
    pub fn of_counts(name: impl Into<String>) -> Self {
        Self { is_count: true, ..Self::new(name, "") }
    }

    /// This column with a logarithmic axis if its range `is_logarithmic`.
    #[must_use]
    pub fn on_scale(self, is_logarithmic: bool) -> Self {
        Self { is_logarithmic, ..self }
    }

    /// The name with the unit, for tables.
    pub fn heading(&self) -> String {
        let name = self.name.strip_suffix("_pct").filter(|_| self.unit == "%").unwrap_or(&self.name);
        if self.unit.is_empty() { name.to_owned() } else { format!("{name} [{}]", self.unit) }
    }

    /// A column of words, stored as their numbers.
    pub fn of_words(name: impl Into<String>, words: Vec<String>) -> Self {
        Self { words, ..Self::new(name, "") }
    }
}

/// The heading of a column whose name is defined by the library.
pub fn in_words(name: &str) -> String {
    name.replace('_', " ")
}

/// Runs of one kind, with a table of rows.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Phase {
    /// Name, for the files of its table.
    pub name: &'static str,
    /// Columns of its rows.
    pub columns: Vec<Column>,
    /// Number of runs.
    pub runs: usize,
    /// Runs that need the rows of earlier ones: the runs of a wave need those of earlier waves. `None` if no run needs another one.
    pub waves: Option<Vec<Vec<usize>>>,
}

impl Phase {
    /// A phase of independent runs.
    pub fn independent(name: &'static str, columns: Vec<Column>, runs: usize) -> Self {
        Self { name, columns, runs, waves: None }
    }

    /// A row of a finished run.
    pub fn row(&self, phase: usize, run: usize, result: RunResult) -> Row {
        let RunResult { values, status, failure } = result;
        let finite = |v: f64| v.is_finite().then_some(v);
        let mut values: Vec<Option<f64>> = values.into_iter().map(finite).collect();
        values.resize(self.columns.len(), None);
        Row { phase, run, values, status, failure }
    }

    /// The rows as a table: number of the run, columns, status and reason of a failure.
    ///
    /// # Errors
    /// Never fails: every row has a value for each column.
    pub fn table<'r>(&self, title: &str, rows: impl Iterator<Item = &'r Row>) -> Result<Table> {
        let columns = || self.columns.iter().filter(|column| !column.is_repeated);
        let name = |c: &Column| c.name.clone();
        let names = ["run".to_owned()].into_iter().chain(columns().map(name));
        let ends = ["status".to_owned(), "failure".to_owned()];
        let headings = ["run".to_owned()].into_iter().chain(columns().map(Column::heading));
        let headings = headings.chain(ends.clone());
        let mut table = Table::new(title, names.chain(ends)).headed(headings)?;
        for row in rows {
            let cell = |(column, value): (&Column, &Option<f64>)| match (value, column.words.as_slice()) {
                (None, _) => Cell::Empty,
                (Some(v), []) if column.is_count => Cell::Whole(*v as i64),
                (Some(v), []) => Cell::Number(*v),
                (Some(v), words) => words.get(*v as usize).map_or(Cell::Empty, |word| Cell::Text(word.clone())),
            };
            let values = self.columns.iter().zip(&row.values).filter(|(column, _)| !column.is_repeated).map(cell);
            let ends = [
                row.status.as_str().into(),
                if row.failure.is_empty() { Cell::Empty } else { row.failure.as_str().into() },
            ];
            table.push(std::iter::once(row.run.into()).chain(values).chain(ends))?;
        }
        Ok(table)
    }
}

/// Result of a run.
#[derive(Clone, Debug, PartialEq)]
pub struct RunResult {
    /// A value for each column, or for the first ones; NaN where there is none.
    pub values: Vec<f64>,
    /// `done`, the status of an optimization, or `failed`.
    pub status: String,
    /// The reason of a failure; empty otherwise.
    pub failure: String,
}

impl RunResult {
    /// A finished run.
    pub fn done(values: Vec<f64>) -> Self {
        Self { values, status: "done".to_owned(), failure: String::new() }
    }

    /// A run without results, with its inputs.
    ///
    /// # Errors
    /// The error itself if it [ends](crate::Error::ends_run) the study, as it is then not a result of this run.
    pub fn failed(inputs: Vec<f64>, why: impl Into<StudyError>) -> Result<Self> {
        let why = why.into();
        if let StudyError::Other(error) = &why
            && error.ends_run()
        {
            return Err(error.clone());
        }
        let failure = why.to_string();
        // The first line says what failed; the others show the place in the file.
        let failure = failure
            .lines()
            .next()
            .filter(|line| !line.trim().is_empty())
            .unwrap_or("no reason given")
            .trim()
            .to_owned();
        Ok(Self { values: inputs, status: "failed".to_owned(), failure })
    }
}

/// The conclusions of a study: text, tables and figures.
#[derive(Clone, Debug, Default)]
pub struct Conclusions {
    /// Sentences, the most important one first.
    pub sentences: Vec<String>,
    /// Tables, by the names of their files.
    pub tables: Vec<(String, Table)>,
    /// Figures: name of the file, caption, figure.
    pub figures: Vec<(String, String, Figure)>,
}

/// A kind of study.
///
/// A run is a pure function of its number and of the rows of earlier waves and phases: it may be done by any thread or process, and
/// twice.
pub trait StudyPlan: Send + Sync {
    /// The phases, in their order.
    fn phases(&self) -> &[Phase];

    /// Does a run.
    ///
    /// # Errors
    /// Those that [end](crate::Error::ends_run) the study; any other error makes a failed run.
    fn run(&self, phase: usize, run: usize, done: &Rows) -> Result<RunResult>;

    /// The conclusions from all rows. Failed runs are left out.
    ///
    /// # Errors
    /// If too many runs failed for a conclusion, or a figure cannot be drawn.
    fn conclude(&self, rows: &Rows) -> Result<Conclusions>;
}

/// Waves of numbers 0 … n − 1 in which each number is near one of an earlier wave: the middle first, then the middles of the remaining intervals.
///
/// Returns for each wave its numbers.
pub fn bisection(n: usize) -> Vec<Vec<usize>> {
    let mut waves: Vec<Vec<usize>> = vec![];
    let mut open: Vec<Range<usize>> = (n > 0).then_some(0..n).into_iter().collect();
    while !open.is_empty() {
        let middle = |range: &Range<usize>| range.start + (range.len() - 1) / 2;
        waves.push(open.iter().map(middle).collect());
        let halves = |range: Range<usize>| {
            let m = middle(&range);
            [range.start..m, m + 1..range.end].into_iter().filter(|half| !half.is_empty())
        };
        open = open.into_iter().flat_map(halves).collect();
    }
    waves
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Error;

    #[test]
    fn bisection_has_every_number_once() {
        assert_eq!(bisection(5), [vec![2], vec![0, 3], vec![1, 4]]);
        for n in 0..40 {
            let mut all = bisection(n).concat();
            all.sort_unstable();
            assert_eq!(all, (0..n).collect::<Vec<_>>());
        }
    }

    #[test]
    fn a_row_has_a_cell_for_every_column() {
        let method = Column::of_words("method", vec!["mma".into(), "slp".into()]);
        let columns = vec![method, Column::new("f", "N"), Column::of_counts("cycles")];
        let phase = Phase::independent("runs", columns, 2);
        let rows = [
            phase.row(0, 0, RunResult::done(vec![1.0, f64::NAN, 17.0])),
            phase.row(0, 1, RunResult::failed(vec![0.0], Error::definition("k", "too stiff\n in a file", "")).unwrap()),
        ];
        let table = phase.table("", rows.iter()).unwrap();
        assert_eq!(table.csv(), "run,method,f,cycles,status,failure\n0,slp,,17,done,\n1,mma,,,failed,k: too stiff\n");
        assert!(table.text().contains(" 17 ") && !table.text().contains("17.0"), "{}", table.text());
    }
}
