//! Designs and undefined values in words.

use super::{DesignVariable, TimeGrid};
use error::{Error, Readable};

/// A design in words: `k = 1 N/m, c = 0.3 N·s/m`.
pub(super) fn design(variables: &[DesignVariable], b: &[f64]) -> String {
    let one = |(v, b): (&DesignVariable, &f64)| {
        format!("{} = {} {}", v.name, Readable(rounded(*b)), v.unit).trim_end().to_owned()
    };
    variables.iter().zip(b).map(one).collect::<Vec<_>>().join(", ")
}

/// The error about a value that is NaN or infinite at a design; `why` explains it, as in `asin(1.2) is not defined`.
pub fn not_finite(
    what: String,
    value: f64,
    time: Option<(&TimeGrid, usize)>,
    variables: &[DesignVariable],
    b: &[f64],
    why: Option<String>,
) -> Error {
    let time = time.map(|(grid, p)| grid.point_in_words(p));
    let design = Some(design(variables, b)).filter(|words| !words.is_empty());
    let place: Vec<String> = time.into_iter().chain(design).collect();
    let place = if place.is_empty() { "every design".to_owned() } else { place.join(" and ") };
    Error::NotFinite {
        what,
        value,
        place: why.map_or(place.clone(), |why| format!("{place} ({why})")),
        remedy: "bound the design away from where it is undefined: a root of a negative number, a level that `crossing` does not reach",
    }
}

/// A number for messages: at most nine significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.8e}").parse().unwrap_or(value)
}
