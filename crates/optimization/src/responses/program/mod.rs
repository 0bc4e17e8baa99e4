//! Responses that another program computes, for instance a simulator with a small script around it.
//!
//! The program is started once and kept: it reads one request from its standard input, a line of JSON, and answers with one
//! line on its standard output, until its input ends. `docs/programs.md` describes the two lines.
//!
//! | file | content |
//! |---|---|
//! | `protocol` | names and sizes of variables and responses; requests and answers, and the checks of an answer |
//! | `process` | one running program: a request and its answer within a time limit |
//! | `processes` | up to `jobs` running programs, and repeated requests |
//! | `answers` | answers by design, in memory and in a file |
//! | `analysis` | the [`Analysis`](crate::problem::Analysis) |
//!
//! Nothing runs through a shell. If the program fails at a design, breaks down, gives an invalid answer or exceeds the time limit, the analysis has
//! failed ([`Error::Analysis`](crate::Error::Analysis)), so that an optimization rejects the design. If the program cannot be
//! started, the error is [`Error::File`](crate::Error::File), which ends the run.

mod analysis;
mod answers;
mod process;
mod processes;
mod protocol;
#[cfg(all(test, unix))]
mod tests;

pub use analysis::{ProgramAnalysis, WithThreads};
pub use process::{end_programs, permit_programs};

use std::path::PathBuf;
use std::time::Duration;

/// A program that analyses designs, and how it is run.
#[derive(Clone, Debug, PartialEq)]
pub struct ExternalProgram {
    /// The program and its arguments. A name without a slash is looked up in `PATH`; a relative path with one starts at
    /// `folder`.
    pub command: Vec<String>,
    /// The working folder of the program; `None` for that of this process.
    pub folder: Option<PathBuf>,
    /// Longest time between a request and its answer, the start of the program included.
    pub time_limit: Duration,
    /// Number of repetitions of a request, each by a new process, after a program broke down or was late. An answer with
    /// `error` is not repeated.
    pub retries: usize,
    /// Largest number of processes at once.
    pub jobs: usize,
}

impl ExternalProgram {
    /// A program with a limit of ten minutes for each answer, one repetition and one process.
    pub fn new(command: impl IntoIterator<Item = impl Into<String>>) -> Self {
        Self {
            command: command.into_iter().map(Into::into).collect(),
            folder: None,
            time_limit: Duration::from_secs(600),
            retries: 1,
            jobs: 1,
        }
    }
}
