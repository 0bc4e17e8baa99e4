//! Commands that work on a model file.
//!
//! | file | command or part |
//! |---|---|
//! | `optimize` | `optimize`, `resume` |
//! | `analyze` | `analyze`, `sensitivities` |
//! | `starter` | `new`, `schema` |
//! | `folder` | the results of a run in a folder, safe against a kill at any moment |
//! | `progress` | the table of cycles while it grows, as text or JSON lines |
//! | `report` | `report`: a run as a page |
//! | `tables` | cycles, histories and derivatives as tables |

mod analyze;
mod folder;
mod optimize;
mod progress;
mod report;
mod starter;
mod tables;

pub use analyze::{Analyze, Sensitivities};
pub use optimize::{Optimize, Resume};
pub use report::Report;
pub use starter::{New, Schema};

use crate::model::{Model, read};
use crate::problem::Problem;
use anyhow::{Context, bail};
use std::path::Path;

/// Reads a model file. Returns its text, too.
pub(super) fn load(path: &Path) -> anyhow::Result<(Model, String)> {
    let text = std::fs::read_to_string(path).with_context(|| format!("cannot read the model {}", path.display()))?;
    let model = read(&path.display().to_string(), &text)?;
    Ok((model, text))
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
