//! Commands that work on a model file.
//!
//! | file | command or part |
//! |---|---|
//! | `optimize` | `optimize`, `resume` |
//! | `analyze` | `analyze`, `sensitivities` |
//! | `starter` | `new`, `schema` |
//! | `compare` | several methods on one file |
//! | `folder` | the results of a run in a folder, safe against a kill at any moment |
//! | `history`, `summary` | two of its files: what happened, and how far the run has come |
//! | `files` | files that outlive a kill, a full disk and a power cut; one process at a time |
//! | `progress` | the table of cycles while it grows, as text or JSON lines |
//! | `forecast` | how long a run may still take |
//! | `report` | `report`: a run as a page |
//! | `tables` | cycles, histories and derivatives as tables |

mod analyze;
pub(super) mod compare;
mod files;
mod folder;
mod forecast;
mod history;
mod optimize;
mod progress;
mod report;
mod starter;
mod summary;
mod tables;

pub use analyze::{Analyze, Sensitivities};
pub(super) use files::Claim;
pub(super) use folder::{Change, RunDirectory, changes};
pub use optimize::{Optimize, Resume};
pub use report::Report;
pub use starter::{New, Schema};
pub(super) use summary::{Named, Nearest, Summary};

use anyhow::{Context, bail};
use linkwright::model_file::{Model, read};
use linkwright::problem::Problem;
use std::path::Path;

/// Reads a model file and prints the note about an old version. Returns the text, too.
pub(super) fn load(path: &Path) -> anyhow::Result<(Model, String)> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read the model {}", path.display()))?;
    let model = read(&path.display().to_string(), &text)?;
    if let Some(note) = model.note() {
        eprintln!("{note}");
    }
    Ok((model, text))
}

/// A result, or an error that shows the part of the model file that is to blame.
pub(super) fn located<'m, T>(model: impl Into<Option<&'m Model>>, result: linkwright::Result<T>) -> anyhow::Result<T> {
    result.map_err(|error| match model.into().and_then(|model| model.locate(&error)) {
        Some(fault) => fault.into(),
        None => error.into(),
    })
}

/// Whether this is a model file rather than the name of a problem of the library.
pub(super) fn is_file(what: &str) -> bool {
    let is_known = linkwright::cases::catalogue().iter().any(|entry| entry.name == what);
    let path = Path::new(what);
    !is_known && (path.exists() || path.extension().is_some())
}

/// The start design with what `--at k=0.5,c=0.2` says instead.
pub(super) fn design(problem: &Problem, at: &[String]) -> anyhow::Result<Vec<f64>> {
    let mut design = problem.start();
    for item in at {
        let Some((name, value)) = item.split_once('=') else { bail!("`{item}` does not read NAME=VALUE") };
        let Some(k) = problem.variables.iter().position(|v| v.name == name.trim()) else {
            let known: Vec<&str> = problem.variables.iter().map(|v| v.name.as_str()).collect();
            bail!("there is no design variable `{}`; choose from {}", name.trim(), known.join(", "));
        };
        design[k] = value.trim().parse().with_context(|| format!("`{}` is no number", value.trim()))?;
    }
    problem.check_design(&design)?;
    Ok(design)
}
