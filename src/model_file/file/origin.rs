//! Where what fails in an analysis stands in the file.

use crate::Error;
use crate::model_file::{Diagnostic, DiagnosticReport};
use std::collections::HashMap;
use std::ops::Range;

/// A file that has been read, with the places of its parts.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    pub file: String,
    pub text: String,
    pub places: HashMap<String, Range<usize>>,
}

impl Origin {
    /// The error at the part that it names; none if it names none.
    pub fn locate(&self, error: &Error) -> Option<DiagnosticReport> {
        let (what, message, remedy) = match error {
            Error::Analysis { what, why, remedy } => {
                (what, format!("analysis failed in {what}: {why}"), remedy.clone())
            }
            Error::Definition { what, why, remedy } | Error::Unsupported { what, why, remedy } => {
                (what, format!("{what}: {why}"), remedy.clone())
            }
            Error::NotFinite { what, value, place, remedy } => {
                (what, format!("{what} is {value} at {place}"), (*remedy).to_owned())
            }
            _ => return None,
        };
        let span = self.named_in(what)?.clone();
        let complaint = Diagnostic::new(span, message).label("here").help(remedy);
        Some(DiagnosticReport { file: self.file.clone(), text: self.text.clone(), complaint, others: vec![] })
    }

    /// The place of the first part that a text names.
    fn named_in(&self, text: &str) -> Option<&Range<usize>> {
        if let Some(span) = self.places.get(text) {
            return Some(span);
        }
        let words = text.split(|c: char| !(c.is_alphanumeric() || c == '_')).filter(|word| !word.is_empty());
        words.into_iter().find_map(|word| self.places.get(word))
    }
}
