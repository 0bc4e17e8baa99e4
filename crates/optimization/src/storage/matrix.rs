//! Matrices from a file: the number of entries is checked against rows and columns without overflow.
//!
//! The stored form is that of nalgebra: entries by columns, rows, columns.

use nalgebra::DMatrix;
use serde::de::Error;
use serde::{Deserialize, Deserializer};

/// A matrix in its stored form.
#[derive(Deserialize)]
struct StoredMatrix(Vec<f64>, usize, usize);

impl StoredMatrix {
    fn matrix<E: Error>(self) -> Result<DMatrix<f64>, E> {
        let Self(entries, rows, columns) = self;
        match rows.checked_mul(columns) {
            Some(count) if count == entries.len() => Ok(DMatrix::from_vec(rows, columns, entries)),
            _ => Err(E::custom(format!("a matrix of {rows} × {columns} has {} entries", entries.len()))),
        }
    }
}

/// For `#[serde(deserialize_with)]` of a matrix.
pub fn one<'de, D: Deserializer<'de>>(from: D) -> Result<DMatrix<f64>, D::Error> {
    StoredMatrix::deserialize(from)?.matrix()
}

/// For `#[serde(deserialize_with)]` of a list of matrices.
pub fn several<'de, D: Deserializer<'de>>(from: D) -> Result<Vec<DMatrix<f64>>, D::Error> {
    Vec::<StoredMatrix>::deserialize(from)?.into_iter().map(StoredMatrix::matrix).collect()
}

/// For `#[serde(deserialize_with)]` of an optional list of matrices.
pub fn maybe<'de, D: Deserializer<'de>>(from: D) -> Result<Option<Vec<DMatrix<f64>>>, D::Error> {
    let stored = Option::<Vec<StoredMatrix>>::deserialize(from)?;
    stored.map(|all| all.into_iter().map(StoredMatrix::matrix).collect()).transpose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, PartialEq, serde::Serialize, Deserialize)]
    struct Holder(#[serde(deserialize_with = "one")] DMatrix<f64>);

    #[test]
    fn matrices_read_back_and_impossible_sizes_are_rejected() {
        let matrix = Holder(DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let text = serde_json::to_string(&matrix).unwrap();
        assert_eq!(serde_json::from_str::<Holder>(&text).unwrap(), matrix);
        for bad in ["[[],8589934592,2147483648]", "[[1.0],2,3]", "[[],1,1]", "[[1.0],18446744073709551615,2]"] {
            assert!(serde_json::from_str::<Holder>(bad).is_err(), "{bad}");
        }
    }
}
