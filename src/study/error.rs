//! Errors of studies.

use crate::Error;
use crate::model_file::DiagnosticReport;

/// Error of a study: a mistake in a file, or an error of the library.
#[derive(Clone, Debug, PartialEq)]
pub enum StudyError {
    /// A mistake in the study file or in the model, with its place.
    File(Box<DiagnosticReport>),
    /// Any other error.
    Other(Error),
}

impl std::fmt::Display for StudyError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::File(report) => report.fmt(f),
            Self::Other(error) => error.fmt(f),
        }
    }
}

impl std::error::Error for StudyError {}

impl StudyError {
    /// The error of the library; a mistake in a file as a failed analysis, without its place.
    pub(super) fn into_error(self) -> Error {
        match self {
            Self::Other(error) => error,
            Self::File(report) => {
                let message = report.diagnostics.first().map_or("a mistake", |diagnostic| &diagnostic.message);
                Error::analysis(&report.file, message, "choose other values")
            }
        }
    }
}

impl From<Box<DiagnosticReport>> for StudyError {
    fn from(report: Box<DiagnosticReport>) -> Self {
        Self::File(report)
    }
}

impl From<Error> for StudyError {
    fn from(error: Error) -> Self {
        Self::Other(error)
    }
}
