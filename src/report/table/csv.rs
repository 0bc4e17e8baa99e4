//! Comma-separated values after RFC 4180.

use super::{Cell, Table};
use crate::{Error, Result};

impl Table {
    /// The CSV file: names, then rows; every number in the fewest digits that give the same `f64` again.
    pub fn csv(&self) -> String {
        let names = self.columns.iter().map(|name| quoted(name)).collect::<Vec<_>>().join(",");
        let rows = self.rows.iter().map(|row| row.iter().map(exact).collect::<Vec<_>>().join(","));
        std::iter::once(names).chain(rows).map(|line| line + "\n").collect()
    }
}

fn exact(cell: &Cell) -> String {
    match cell {
        // Debug is the shortest text that reads back to the same bits, with an exponent where zeros would be long.
        Cell::Number(v) if v.fract() == 0.0 && v.abs() < 1e15 => format!("{v}"),
        Cell::Number(v) => format!("{v:?}"),
        Cell::Whole(v) => v.to_string(),
        Cell::Text(text) => quoted(text),
        Cell::Empty => String::new(),
    }
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n', '\r']) { format!("\"{}\"", text.replace('"', "\"\"")) } else { text.to_owned() }
}

/// The records of a CSV file, all of one length; `file` names it in errors.
pub(super) fn records(file: &str, text: &str) -> Result<Vec<Vec<String>>> {
    let bad =
        |why: String| Error::File { file: file.to_owned(), why, remedy: "give plain CSV after RFC 4180".to_owned() };
    let mut records: Vec<Vec<String>> = Vec::new();
    let (mut record, mut field, mut inside) = (Vec::new(), String::new(), false);
    let mut chars = text.chars().peekable();
    while let Some(c) = chars.next() {
        match c {
            '"' if inside && chars.peek() == Some(&'"') => field.extend(chars.next()),
            '"' => inside = !inside,
            ',' if !inside => record.push(std::mem::take(&mut field)),
            '\r' if !inside => {}
            '\n' if !inside => {
                record.push(std::mem::take(&mut field));
                records.push(std::mem::take(&mut record));
            }
            c => field.push(c),
        }
    }
    if inside {
        return Err(bad("a quoted field does not end".to_owned()));
    }
    if !(field.is_empty() && record.is_empty()) {
        record.push(field);
        records.push(record);
    }
    records.retain(|record| record.iter().any(|field| !field.is_empty()));
    let Some(first) = records.first() else { return Err(bad("it is empty".to_owned())) };
    match records.iter().position(|record| record.len() != first.len()) {
        Some(k) => Err(bad(format!("record {} has {} fields, the first {}", k + 1, records[k].len(), first.len()))),
        None => Ok(records),
    }
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
    fn quotes_survive_and_ragged_files_are_refused() {
        let mut table = Table::new("", ["a,b", "c"]);
        table.push(["say \"x\"".into(), "two\nlines".into()]).unwrap();
        let records = records("t.csv", &table.csv()).unwrap();
        assert_eq!(records, [["a,b", "c"], ["say \"x\"", "two\nlines"]]);
        for bad in ["", "a,b\n1\n", "a\n\"open\n"] {
            assert!(super::records("t.csv", bad).is_err());
        }
    }
}
