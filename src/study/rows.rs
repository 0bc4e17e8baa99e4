//! Rows: the result of each run, and the lines in which they are stored.
//!
//! A row file has a header and a line of JSON for each finished run, in any order. Each line ends with a checksum of the text before it, so
//! that a damaged line is recognised. An incomplete last line, which a kill may leave, is ignored.

use crate::storage::fnv1a;
use crate::{Error, Result};
use serde::{Deserialize, Serialize};

/// The result of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Number of the phase, from 0.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub phase: usize,
    /// Number of the run in its phase, from 0.
    pub run: usize,
    /// A value for each column of the phase; `None` if there is none.
    pub values: Vec<Option<f64>>,
    /// The end of the run: `done`, the status of an optimization, or `failed`.
    pub status: String,
    /// The reason of a failure; empty otherwise.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub failure: String,
}

/// Failures of programs that were not started.
const PROGRAM_NOT_STARTED: [&str; 2] =
    ["a model file starts no program unless that is allowed", "the program cannot be started"];

fn is_zero(n: &usize) -> bool {
    *n == 0
}

impl Row {
    /// True for a row that an earlier version wrote for a program that was not started: the run still has to be done.
    fn is_of_missing_program(&self) -> bool {
        PROGRAM_NOT_STARTED.iter().any(|why| self.failure.contains(why))
    }

    /// True if the run has no results.
    pub fn has_failed(&self) -> bool {
        !self.failure.is_empty()
    }

    /// A value; NaN if there is none.
    pub fn value(&self, column: usize) -> f64 {
        self.values.get(column).copied().flatten().unwrap_or(f64::NAN)
    }

    /// The line of a row file, with its end.
    pub fn line(&self) -> String {
        with_checksum(&serde_json::to_string(self).expect("a row is representable in JSON"))
    }
}

/// The first line of a row file.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct RowHeader {
    /// Checksum of the study: file, model and version.
    pub study: String,
    /// Version of the format.
    pub version: u32,
}

impl RowHeader {
    /// The line, with its end.
    pub fn line(&self) -> String {
        with_checksum(&serde_json::to_string(self).expect("a header is representable in JSON"))
    }
}

/// The text of a JSON object with a checksum as its last key.
fn with_checksum(object: &str) -> String {
    let open = &object[..object.len() - 1];
    format!("{open},\"check\":\"{:016x}\"}}\n", fnv1a(open))
}

/// The object of a line without its checksum, if the checksum is right.
fn without_checksum(line: &str) -> Option<String> {
    let (open, check) = line.rsplit_once(",\"check\":\"")?;
    let check = check.strip_suffix("\"}")?;
    (u64::from_str_radix(check, 16).ok()? == fnv1a(open)).then(|| format!("{open}}}"))
}

/// The rows of a study so far.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Rows {
    phases: Vec<Vec<Option<Row>>>,
}

/// A row file that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredRows {
    /// Its header; `None` for a file without a complete line.
    pub header: Option<RowHeader>,
    /// Its rows.
    pub rows: Rows,
    /// Number of bytes up to the end of the last complete line. The bytes after it are an incomplete line.
    pub length: usize,
}

impl Rows {
    /// No rows yet, for phases of these numbers of runs.
    pub fn new(runs: &[usize]) -> Self {
        Self { phases: runs.iter().map(|n| vec![None; *n]).collect() }
    }

    /// The row of a run.
    pub fn get(&self, phase: usize, run: usize) -> Option<&Row> {
        self.phases.get(phase)?.get(run)?.as_ref()
    }

    /// The finished runs of a phase, in the order of their numbers.
    pub fn of(&self, phase: usize) -> impl Iterator<Item = &Row> + Clone {
        self.phases.get(phase).into_iter().flatten().flatten()
    }

    /// All rows, in the order of phases and runs.
    pub fn all(&self) -> impl Iterator<Item = &Row> {
        self.phases.iter().flatten().flatten()
    }

    /// Number of finished runs.
    pub fn len(&self) -> usize {
        self.all().count()
    }

    /// True without a finished run.
    pub fn is_empty(&self) -> bool {
        self.all().next().is_none()
    }

    /// Adds a row. A row of the same run must be equal.
    ///
    /// # Errors
    /// [`Error::Definition`] for a run that the study does not have, or that has another row.
    pub fn add(&mut self, row: Row) -> Result<()> {
        let (phase, run) = (row.phase, row.run);
        let what = || format!("run {run} of phase {phase}");
        let place = self.phases.get_mut(phase).and_then(|runs| runs.get_mut(run));
        match place {
            None => Err(Error::definition(what(), "the study has no such run", "give rows of this study")),
            Some(Some(known)) if *known != row => {
                Err(Error::definition(what(), "there are two different rows", "remove one of them"))
            }
            Some(place) => {
                *place = Some(row);
                Ok(())
            }
        }
    }

    /// Adds the rows of another study of the same size.
    ///
    /// # Errors
    /// As [`add`](Self::add).
    pub fn join(&mut self, other: Self) -> Result<()> {
        other.phases.into_iter().flatten().flatten().try_for_each(|row| self.add(row))
    }

    /// The whole row file: header, and all rows in their order.
    pub fn text(&self, header: &RowHeader) -> String {
        std::iter::once(header.line()).chain(self.all().map(Row::line)).collect()
    }

    /// Reads a row file; `file` is its name in errors, `runs` the number of runs of each phase.
    ///
    /// A last line that is not complete is left out, and so are rows of runs that failed because a program was not started.
    ///
    /// # Errors
    /// [`Error::File`] for a damaged line before the last one, with its number.
    pub fn read(file: &str, bytes: &[u8], runs: &[usize]) -> Result<StoredRows> {
        let mut stored = StoredRows { header: None, rows: Self::new(runs), length: 0 };
        let mut number = 0;
        while let Some(end) = bytes[stored.length..].iter().position(|b| *b == b'\n') {
            number += 1;
            let next = stored.length + end + 1;
            let damaged = |why: &str| Error::File {
                file: file.to_owned(),
                why: format!("line {number} {why}"),
                remedy: "remove this line, and the run is done again; or restore the file".to_owned(),
            };
            let line = std::str::from_utf8(&bytes[stored.length..next - 1]).ok().and_then(without_checksum);
            let Some(line) = line else {
                // An interrupted write can leave any bytes at the end.
                if next == bytes.len() && number > 1 {
                    break;
                }
                return Err(damaged("is damaged: its checksum does not fit"));
            };
            if number == 1 {
                stored.header = Some(serde_json::from_str(&line).map_err(|_| damaged("is not the header of a study"))?);
            } else {
                let row: Row = serde_json::from_str(&line).map_err(|_| damaged("is not a row"))?;
                if row.is_of_missing_program() {
                    stored.length = next;
                    continue;
                }
                stored.rows.add(row).map_err(|error| damaged(&format!("does not fit: {error}")))?;
            }
            stored.length = next;
        }
        Ok(stored)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(run: usize) -> Row {
        let values = vec![Some(0.1 * run as f64), None, Some(f64::MIN_POSITIVE)];
        Row { phase: 0, run, values, status: "done".to_owned(), failure: String::new() }
    }

    fn file() -> (Rows, String) {
        let mut rows = Rows::new(&[3]);
        (0..3).for_each(|run| rows.add(row(run)).unwrap());
        let header = RowHeader { study: "00".to_owned(), version: 1 };
        let text = rows.text(&header);
        (rows, text)
    }

    #[test]
    fn a_row_file_is_read_back_and_every_cut_of_it_is_a_part() {
        let (rows, text) = file();
        assert_eq!(Rows::read("r", text.as_bytes(), &[3]).unwrap().rows, rows);
        for cut in 0..text.len() {
            let read = Rows::read("r", &text.as_bytes()[..cut], &[3]).unwrap();
            assert!(
                read.length <= cut
                    && text[..read.length].lines().count() == read.rows.len() + usize::from(read.header.is_some())
            );
        }
    }

    #[test]
    fn a_run_whose_program_was_not_started_is_done_again() {
        let header = RowHeader { study: "00".to_owned(), version: 1 };
        let why = |why: &str| Row { status: "failed".to_owned(), failure: why.to_owned(), ..row(1) };
        for failure in PROGRAM_NOT_STARTED {
            let text =
                [header.line(), row(0).line(), why(&format!("the program `p`: {failure}; start it")).line()].concat();
            let read = Rows::read("r", text.as_bytes(), &[3]).unwrap();
            assert_eq!((read.rows.len(), read.length), (1, text.len()));
            // Its new row may follow in the same file.
            let read = Rows::read("r", (text + &row(1).line()).as_bytes(), &[3]).unwrap();
            assert_eq!(read.rows.get(0, 1), Some(&row(1)));
        }
        let other = [header.line(), why("no assembly").line()].concat();
        assert_eq!(Rows::read("r", other.as_bytes(), &[3]).unwrap().rows.len(), 1);
    }

    #[test]
    fn a_damaged_line_is_named() {
        let (_, text) = file();
        let damaged = text.replacen("0.1", "0.2", 1);
        assert_ne!(text, damaged);
        let error = Rows::read("rows.jsonl", damaged.as_bytes(), &[3]).unwrap_err().to_string();
        assert!(error.contains("rows.jsonl") && error.contains("line 3"), "{error}");
        let error = Rows::read("r", text.as_bytes(), &[2]).unwrap_err().to_string();
        assert!(error.contains("line 4") && error.contains("no such run"), "{error}");
    }

    #[test]
    fn two_rows_of_one_run_must_be_equal() {
        let (mut rows, _) = file();
        rows.add(row(1)).unwrap();
        assert!(rows.add(Row { values: vec![], ..row(1) }).is_err());
    }
}
