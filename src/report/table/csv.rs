//! Comma-separated values according to RFC 4180.

use super::{Cell, Table};
use crate::{Error, Result};
use csv::{ReaderBuilder, Writer};

impl Table {
    /// The table as CSV: names, then rows. Numbers have the fewest digits that read back as the same `f64`.
    pub fn csv(&self) -> String {
        records_as_text(std::iter::once(self.columns.clone())) + &self.csv_rows()
    }

    /// The rows of the table as CSV, without the names: to append them to a file.
    pub fn csv_rows(&self) -> String {
        records_as_text(self.rows.iter().map(|row| row.iter().map(exact).collect()))
    }
}

fn records_as_text(records: impl Iterator<Item = Vec<String>>) -> String {
    let mut writer = Writer::from_writer(vec![]);
    for record in records {
        writer.write_record(record).expect("a vector takes all bytes, and rows have equal lengths");
    }
    let bytes = writer.into_inner().expect("a vector takes all bytes");
    String::from_utf8(bytes).expect("the fields are UTF-8")
}

fn exact(cell: &Cell) -> String {
    match cell {
        // Debug is the shortest text that reads back to the same bits, with an exponent where zeros would be long.
        Cell::Number(v) if v.fract() == 0.0 && v.abs() < 1e15 => format!("{v}"),
        Cell::Number(v) => format!("{v:?}"),
        Cell::Whole(v) => v.to_string(),
        Cell::Text(text) => text.clone(),
        Cell::Empty => String::new(),
    }
}

/// The records of a CSV file, all of one length; `file` is its name in errors.
pub(super) fn records(file: &str, text: &str) -> Result<Vec<Vec<String>>> {
    let bad = |why: String| Error::File { file: file.to_owned(), why, remedy: "give plain CSV (RFC 4180)".to_owned() };
    // The reader accepts a quoted field without an end.
    if text.matches('"').count() % 2 == 1 {
        return Err(bad("a quoted field does not end".to_owned()));
    }
    let mut reader = ReaderBuilder::new().has_headers(false).from_reader(text.as_bytes());
    let records: Vec<Vec<String>> =
        reader.deserialize().collect::<std::result::Result<_, csv::Error>>().map_err(|e| bad(e.to_string()))?;
    if records.is_empty() { Err(bad("it is empty".to_owned())) } else { Ok(records) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_with_the_same_bits() {
        for value in [0.1 + 0.2, 1e-300, -4.703e-1, 6.0, 1e22, f64::MIN_POSITIVE, -0.0, f64::MAX] {
            let text = exact(&Cell::Number(value));
            assert_eq!(text.parse::<f64>().unwrap().to_bits(), value.to_bits(), "{text}");
            assert!(text.len() < 26, "{text}");
        }
    }

    #[test]
    fn quotes_are_read_back_and_ragged_files_are_rejected() {
        let mut table = Table::new("", ["a,b", "c"]);
        table.push(["say \"x\"".into(), "two\nlines".into()]).unwrap();
        assert_eq!(table.csv(), "\"a,b\",c\n\"say \"\"x\"\"\",\"two\nlines\"\n");
        let records = records("t.csv", &table.csv()).unwrap();
        assert_eq!(records, [["a,b", "c"], ["say \"x\"", "two\nlines"]]);
        for bad in ["", "a,b\n1\n", "a\n\"open\n"] {
            assert!(super::records("t.csv", bad).is_err());
        }
    }
}
