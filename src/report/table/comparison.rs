//! Comparison of a computed table with a printed one, in the printed digits.

use std::fmt;

use super::{Cell, Table, aligned, csv, text_of};
use crate::{Error, Result};

/// A printed table; numbers are texts and keep their digits.
#[derive(Clone, Debug, PartialEq)]
pub struct Printed {
    columns: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Printed {
    /// Reads a printed table from CSV with the names of the columns in the first line; `file` is its name in errors.
    ///
    /// # Errors
    /// [`Error::File`] if the text is empty, not CSV, or has rows of different lengths.
    pub fn from_csv(file: &str, text: &str) -> Result<Self> {
        let mut records = csv::records(file, text)?;
        let columns = records.remove(0);
        Ok(Self { columns, rows: records })
    }
}

/// Comparison of two tables.
#[derive(Clone, Debug, PartialEq)]
pub struct TableComparison {
    /// Title, pairs of computed and printed columns, and a line of summary.
    pub text: String,
    /// Number of printed values with a computed counterpart.
    pub compared: usize,
    /// Number of these that differ in the printed digits.
    pub differing: usize,
}

/// A computed row and its printed counterpart.
type RowPair<'a> = (Option<&'a Vec<Cell>>, Option<&'a Vec<String>>);

impl fmt::Display for TableComparison {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str(&self.text)
    }
}

impl Table {
    /// Compares this table with a printed one.
    ///
    /// The first `keys` columns identify a row, such as cycle and acceptance. Rows with equal keys are paired in the order of both
    /// tables; a row without counterpart is paired with dashes. Every other number is rounded to the digits and the form (`0.3628`,
    /// `4.703e-1`) of its counterpart, and marked `≠` if it then differs.
    ///
    /// # Errors
    /// [`Error::Definition`] if the names of the columns differ from the printed ones, or all columns are keys.
    pub fn compare(&self, printed: &Printed, keys: usize) -> Result<TableComparison> {
        if self.columns != printed.columns || keys >= self.columns.len() {
            let why = format!("its columns are {:?}, the printed ones {:?}", self.columns, printed.columns);
            return Err(Error::definition(format!("table '{}'", self.title), why, "name the columns as printed"));
        }
        let mut names: Vec<String> = self.headings()[..keys].to_vec();
        names.extend(self.headings()[keys..].iter().flat_map(|name| [name.clone(), "printed".to_owned()]));
        let (mut compared, mut differing) = (0, 0);
        let mut rows = Vec::new();
        for (ours, theirs) in self.pairs(printed, keys) {
            let mut line: Vec<String> = match (ours, theirs) {
                (Some(ours), _) => ours[..keys].iter().map(text_of).collect(),
                (None, Some(theirs)) => theirs[..keys].to_vec(),
                (None, None) => continue,
            };
            for c in keys..self.columns.len() {
                let cells = pair(ours.map(|row| &row[c]), theirs.map(|row| row[c].as_str()));
                compared += usize::from(cells.1.is_some());
                differing += usize::from(cells.1 == Some(false));
                line.extend(cells.0);
            }
            rows.push(line);
        }
        let agree = compared - differing;
        let summary = format!("{agree} of {compared} printed values agree in every digit; ≠ marks the others.\n");
        let text = format!("{}\n{}{summary}", self.title, aligned(&names, &rows));
        Ok(TableComparison { text, compared, differing })
    }

    /// Pairs of rows with equal keys, in the order of both tables: the longest common subsequence.
    fn pairs<'a>(&'a self, printed: &'a Printed, keys: usize) -> Vec<RowPair<'a>> {
        let (ours, theirs) = (&self.rows, &printed.rows);
        let same = |a: usize, b: usize| (0..keys).all(|c| agrees(&like(&ours[a][c], &theirs[b][c]), &theirs[b][c]));
        let mut longest = vec![vec![0; theirs.len() + 1]; ours.len() + 1];
        for a in (0..ours.len()).rev() {
            for b in (0..theirs.len()).rev() {
                let skip = longest[a + 1][b].max(longest[a][b + 1]);
                longest[a][b] = if same(a, b) { skip.max(1 + longest[a + 1][b + 1]) } else { skip };
            }
        }
        let (mut a, mut b, mut pairs) = (0, 0, Vec::new());
        while a < ours.len() || b < theirs.len() {
            let both = a < ours.len() && b < theirs.len();
            if both && same(a, b) && longest[a][b] == 1 + longest[a + 1][b + 1] {
                pairs.push((Some(&ours[a]), Some(&theirs[b])));
                (a, b) = (a + 1, b + 1);
            } else if b == theirs.len() || (both && longest[a + 1][b] >= longest[a][b + 1]) {
                pairs.push((Some(&ours[a]), None));
                a += 1;
            } else {
                pairs.push((None, Some(&theirs[b])));
                b += 1;
            }
        }
        pairs
    }
}

/// Texts of a computed and a printed cell, and whether they agree if both exist.
fn pair(ours: Option<&Cell>, printed: Option<&str>) -> ([String; 2], Option<bool>) {
    let dash = || "–".to_owned();
    match (ours, printed) {
        (Some(ours), Some(printed)) if !printed.is_empty() => {
            let text = like(ours, printed);
            let equal = agrees(&text, printed);
            ([if equal { text } else { format!("≠ {text}") }, printed.to_owned()], Some(equal))
        }
        (Some(ours), _) => ([text_of(ours), dash()], None),
        (None, Some(printed)) => ([dash(), printed.to_owned()], None),
        (None, None) => ([dash(), dash()], None),
    }
}

/// A computed cell in the form of the printed one: with as many decimals, and with an exponent if that has one.
fn like(ours: &Cell, printed: &str) -> String {
    let value = match ours {
        Cell::Number(value) => *value,
        Cell::Whole(value) => *value as f64,
        _ => return text_of(ours),
    };
    if printed.parse::<f64>().is_err() {
        return text_of(ours);
    }
    let mantissa = printed.split(['e', 'E']).next().unwrap_or(printed);
    let decimals = mantissa.split_once('.').map_or(0, |(_, digits)| digits.len());
    let text =
        if mantissa.len() < printed.len() { format!("{value:.decimals$e}") } else { format!("{value:.decimals$}") };
    match text.parse::<f64>() {
        Ok(0.0) => text.trim_start_matches('-').to_owned(),
        _ => text,
    }
}

fn agrees(ours: &str, printed: &str) -> bool {
    match (ours.parse::<f64>(), printed.parse::<f64>()) {
        (Ok(a), Ok(b)) => a == b,
        _ => ours == printed,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn computed_numbers_have_the_printed_form() {
        let cases = [
            (0.47034, "4.703e-1", "4.703e-1"),
            (0.36276112, "0.3628", "0.3628"),
            (-1e-9, "0.000", "0.000"),
            (356.84, "356.8", "356.8"),
            (2.0, "2", "2"),
            (5.4e2, "5.46e2", "5.40e2"),
            (-0.7296, "-7.296e-1", "-7.296e-1"),
        ];
        for (value, printed, text) in cases {
            assert_eq!(like(&Cell::Number(value), printed), text);
        }
    }

    #[test]
    fn differences_and_missing_rows_are_marked() {
        let printed =
            Printed::from_csv("table.csv", "cycle,accepted,b,V\n0,y,1.000,-1.938e1\n1,y,0.6640,2.0e0\n2,y,0.5,\n")
                .unwrap();
        let mut ours = Table::new("Table", ["cycle", "accepted", "b", "V"]);
        ours.push([0usize.into(), "y".into(), 1.0.into(), (-19.383).into()]).unwrap();
        ours.push([1usize.into(), "n".into(), 0.9.into(), 1.0.into()]).unwrap();
        ours.push([1usize.into(), "y".into(), 0.644.into(), 2.04.into()]).unwrap();
        let comparison = ours.compare(&printed, 2).unwrap();
        let expected = "Table
cycle  accepted         b  printed         V   printed
──────────────────────────────────────────────────────
    0         y     1.000    1.000  -1.938e1  -1.938e1
    1         n   0.90000        –    1.0000         –
    1         y  ≠ 0.6440   0.6640     2.0e0     2.0e0
    2         y         –      0.5         –
3 of 4 printed values agree in every digit; ≠ marks the others.
";
        assert_eq!(comparison.to_string(), expected);
        assert_eq!((comparison.compared, comparison.differing), (4, 1));
        assert!(ours.compare(&Printed::from_csv("other", "a,b\n1,2\n").unwrap(), 1).is_err());
        assert!(ours.compare(&printed, 4).is_err());
    }
}
