//! The error type of linkwright: one variant for each cause, with numbers and, where it is not obvious, a remedy.
//!
//! An [`Error`] is misuse of the library or a computation that broke down. The conclusion of an algorithm is a `Status`; a
//! panic is a bug of the library.
//!
//! # Examples
//!
//! ```
//! use linkwright_error::Error;
//! let error = Error::unknown("method", "gcma", ["mma", "gcmma"]);
//! assert!(matches!(&error, Error::Unknown { asked, .. } if asked == "gcma"));
//! assert_eq!(error.to_string(), "method `gcma`: there is no method of that name; try `gcmma`, `mma`");
//! ```

/// A [`std::result::Result`] with linkwright's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;

/// Cause of a failed call: misuse of the library, or a computation that broke down.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A vector has the wrong length.
    #[error("{what}: expected length {expected}, got {got}")]
    Length {
        /// The vector, by name.
        what: String,
        /// The required length.
        expected: usize,
        /// The given length.
        got: usize,
    },
    /// A setting is outside its range.
    #[error("{option} must be {must}, got {}", Readable(*.got))]
    Option {
        /// Name of the setting.
        option: String,
        /// Its range in words.
        must: &'static str,
        /// The given value.
        got: f64,
    },
    /// A quantity is NaN or infinite.
    #[error("{what} is {value} at {place}; {remedy}")]
    NotFinite {
        /// Name of the quantity.
        what: String,
        /// The offending value: NaN or infinite.
        value: f64,
        /// Time and design in words and numbers.
        place: String,
        /// The remedy.
        remedy: &'static str,
    },
    /// A problem, mechanism or setting is inconsistent.
    #[error("{what}: {why}; {remedy}")]
    Definition {
        /// The inconsistent item, by name.
        what: String,
        /// The inconsistency.
        why: String,
        /// The remedy.
        remedy: String,
    },
    /// A name is unknown.
    #[error("{kind} `{asked}`: there is no {kind} of that name; try {}", quoted(.nearest))]
    Unknown {
        /// Kind of the named thing: problem, method, response, …
        kind: String,
        /// The given name.
        asked: String,
        /// The most similar names, best first; at most three.
        nearest: Vec<String>,
    },
    /// The request is valid, but this method or analysis does not offer it.
    #[error("{what}: {why}; {remedy}")]
    Unsupported {
        /// The request, by name.
        what: String,
        /// The reason.
        why: String,
        /// The remedy.
        remedy: String,
    },
    /// An analysis failed at this design. During an optimization the design is rejected.
    #[error("analysis failed in {what}: {why}; {remedy}")]
    Analysis {
        /// The element, response or stage, by name.
        what: String,
        /// The failure, with numbers.
        why: String,
        /// The remedy.
        remedy: String,
    },
    /// A subproblem solver broke down.
    #[error("{solver} stopped with {status} after {iterations} iterations; {remedy}")]
    Subproblem {
        /// Name of the solver.
        solver: &'static str,
        /// Its final status.
        status: String,
        /// Iterations done.
        iterations: usize,
        /// The remedy.
        remedy: &'static str,
    },
    /// A file is missing, unreadable or of the wrong content, or a program cannot or must not be started. It ends a run: no other
    /// design can be analysed, either.
    #[error("{file}: {why}; {remedy}")]
    File {
        /// The file, as given.
        file: String,
        /// The defect.
        why: String,
        /// The remedy.
        remedy: String,
    },
}

impl Error {
    /// An error of an analysis, or of a request to it, whose reason is replaced by `with` of it; any other error itself.
    #[must_use]
    pub fn map_reason(self, with: impl FnOnce(&str) -> String) -> Self {
        match self {
            Self::Analysis { what, why, remedy } => Self::Analysis { why: with(&why), what, remedy },
            Self::Unsupported { what, why, remedy } => Self::Unsupported { why: with(&why), what, remedy },
            other => other,
        }
    }

    /// Returns an [`Error::Length`] unless the lengths agree.
    pub fn check_length(what: &str, expected: usize, got: usize) -> Result<()> {
        if expected == got { Ok(()) } else { Err(Self::Length { what: what.to_owned(), expected, got }) }
    }

    /// Returns an [`Error::Option`] unless `good`.
    pub fn check_option(option: &str, must: &'static str, got: f64, good: bool) -> Result<()> {
        if good { Ok(()) } else { Err(Self::Option { option: option.to_owned(), must, got }) }
    }

    /// True if no other design can be analysed, either: an [`Error::File`]. Other errors of an analysis reject its design only.
    pub fn ends_run(&self) -> bool {
        matches!(self, Self::File { .. })
    }

    /// An [`Error::Definition`].
    pub fn definition(what: impl Into<String>, why: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Definition { what: what.into(), why: why.into(), remedy: remedy.into() }
    }

    /// An [`Error::Unsupported`].
    pub fn unsupported(what: impl Into<String>, why: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Unsupported { what: what.into(), why: why.into(), remedy: remedy.into() }
    }

    /// An [`Error::Unknown`] with the three most similar of the `known` names.
    pub fn unknown<'k>(kind: &str, asked: &str, known: impl IntoIterator<Item = &'k str>) -> Self {
        let nearest = nearest(asked, known).into_iter().take(3).map(|(name, _)| name.to_owned()).collect();
        Self::Unknown { kind: kind.to_owned(), asked: asked.to_owned(), nearest }
    }

    /// An [`Error::Analysis`].
    pub fn analysis(what: impl Into<String>, why: impl Into<String>, remedy: impl Into<String>) -> Self {
        Self::Analysis { what: what.into(), why: why.into(), remedy: remedy.into() }
    }
}

/// A number as text for a message: with an exponent where zeros would be long.
///
/// ```
/// use linkwright_error::Readable;
/// assert_eq!([0.0, 0.25, -4e3, 1e308, 2e-9].map(|v| Readable(v).to_string()), ["0", "0.25", "-4000", "1e308", "2e-9"]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Readable(pub f64);

impl std::fmt::Display for Readable {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let is_plain = self.0 == 0.0 || !self.0.is_finite() || (1e-5..1e16).contains(&self.0.abs());
        if is_plain { write!(f, "{}", self.0) } else { write!(f, "{:e}", self.0) }
    }
}

/// A time as text for a message: in at most seven digits, with its unit.
///
/// ```
/// use linkwright_error::Seconds;
/// assert_eq!([0.0, 0.1 + 0.2, 12.3456789, 2.5e-9].map(|t| Seconds(t).to_string()), ["0 s", "0.3 s", "12.34568 s", "2.5e-9 s"]);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Seconds(pub f64);

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&seconds(self.0, 6))
    }
}

/// A time in s with `decimals` of its mantissa.
fn seconds(t: f64, decimals: usize) -> String {
    let rounded = format!("{t:.decimals$e}").parse().unwrap_or(t);
    format!("{} s", Readable(rounded))
}

/// Two times as text for a message, each as [`Seconds`], with more digits if they would look equal.
///
/// ```
/// use linkwright_error::two_times;
/// assert_eq!(two_times([0.25, 12.3456789]), ["0.25 s", "12.34568 s"]);
/// assert_eq!(two_times([12.34567891, 12.34567895]), ["12.34567891 s", "12.34567895 s"]);
/// ```
pub fn two_times(times: [f64; 2]) -> [String; 2] {
    let texts = |decimals| times.map(|t| seconds(t, decimals));
    (6..16).map(texts).find(|[a, b]| a != b).unwrap_or_else(|| texts(16))
}

/// A message in which each time, "t = 0.3 s", is replaced by the words `of` it, for points of another quantity than the time.
///
/// ```
/// use linkwright_error::{Seconds, replace_times};
/// let message = format!("it locks at t = {}, before the end", Seconds(0.3));
/// assert_eq!(replace_times(&message, |x| format!("lift {} mm", x * 1e3)), "it locks at lift 300 mm, before the end");
/// ```
pub fn replace_times(message: &str, mut of: impl FnMut(f64) -> String) -> String {
    const BEGIN: &str = "t = ";
    let mut parts = message.split(BEGIN);
    let mut replaced = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let time = part.split_once(' ').and_then(|(number, rest)| {
            let rest = rest.strip_prefix('s').filter(|rest| !rest.starts_with(char::is_alphanumeric))?;
            Some((number.parse().ok()?, rest))
        });
        match time {
            Some((time, rest)) => replaced += &(of(time) + rest),
            None => replaced += &format!("{BEGIN}{part}"),
        }
    }
    replaced
}

fn quoted(names: &[String]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// The known names with their edit distances from `asked`, the most similar first.
pub fn nearest<'k>(asked: &str, known: impl IntoIterator<Item = &'k str>) -> Vec<(&'k str, usize)> {
    let mut names: Vec<(&str, usize)> = known.into_iter().map(|known| (known, distance(known, asked))).collect();
    names.sort_by_key(|(_, steps)| *steps);
    names
}

/// Edit distance of two names: letters added, removed, changed or swapped with their neighbour.
/// Zero if `asked` is a substring of `known`.
fn distance(known: &str, asked: &str) -> usize {
    if !asked.is_empty() && known.contains(asked) { 0 } else { strsim::osa_distance(known, asked) }
}

/// Tests the README's listing.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_names_are_suggested() {
        assert_eq!([distance("abc", "abd"), distance("abc", "xyz"), distance("kitten", "sitting")], [1, 3, 3]);
        let message = Error::unknown("animal", "kat", ["dog", "cat", "horse", "ant"]).to_string();
        assert_eq!(message, "animal `kat`: there is no animal of that name; try `cat`, `ant`, `dog`");
    }
}
