//! Checks of the data of figures.

use crate::{Error, Result};

/// [`Error::NotFinite`] at `place`.
pub(crate) fn not_finite(what: &str, value: f64, place: String) -> Error {
    Error::NotFinite { what: what.to_owned(), value, place, remedy: "remove values that are not finite before drawing" }
}

/// Checks for at least one number, all finite.
pub(crate) fn finite(what: &str, values: &[f64]) -> Result<()> {
    not_empty(what, values.len())?;
    match values.iter().position(|v| !v.is_finite()) {
        None => Ok(()),
        Some(k) => Err(not_finite(what, values[k], format!("position {k}"))),
    }
}

/// Checks for at least one point, all finite.
pub(crate) fn finite_points(what: &str, points: &[[f64; 2]]) -> Result<()> {
    finite(what, points.as_flattened())
}

/// Checks that there is something to draw.
pub(crate) fn not_empty(what: &str, count: usize) -> Result<()> {
    if count > 0 { Ok(()) } else { Err(Error::definition(what, "there is nothing to draw", "give at least one value")) }
}

/// Checks for at least two finite, increasing numbers.
pub(crate) fn increasing(what: &str, values: &[f64]) -> Result<()> {
    finite(what, values)?;
    if values.len() >= 2 && values.windows(2).all(|pair| pair[1] > pair[0]) {
        return Ok(());
    }
    Err(Error::definition(what, "its values do not increase", "give two or more increasing numbers"))
}

/// Checks for the expected number of finite values.
pub(crate) fn series(what: &str, expected: usize, values: &[f64]) -> Result<()> {
    Error::check_length(what, expected, values.len())?;
    finite(what, values)
}
