//! Model files and designs on the command line.

use super::output::complain;
use anyhow::{Context, bail};
use linkwright::model_file::{Model, read};
use linkwright::problem::Problem;
use linkwright::storage::{Directory, read_file};
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest size of a model file in bytes. The reader rejects files of more than half of it with a diagnostic.
const LIMIT: u64 = 2 << 20;

/// True if model files may start the programs that they name.
static PROGRAMS: AtomicBool = AtomicBool::new(false);

/// Allows model files to start the programs that they name.
pub fn allow_programs() {
    PROGRAMS.store(true, Ordering::Relaxed);
}

/// Lets a model start its program in the folder of its file, if that was allowed.
pub fn with_program(mut model: Model, file: &Path) -> Model {
    if PROGRAMS.load(Ordering::Relaxed) {
        model.allow_programs(file.parent().unwrap_or(Path::new("")));
    }
    model
}

/// Reads a model file and prints a note if its version is old. Returns the model and its text.
pub fn load(path: &Path) -> anyhow::Result<(Model, String)> {
    let unreadable = || format!("cannot read the model {}", path.display());
    let (model, text) = of_bytes(path, read_file(path, LIMIT).with_context(unreadable)?)?;
    Ok((with_program(model, path), text))
}

/// As [`load`], for a file of an open folder, without following a link.
pub fn parsed(directory: &Directory, name: &str) -> anyhow::Result<(Model, String)> {
    let path = directory.path().join(name);
    let unreadable = || format!("cannot read the model {}", path.display());
    let bytes = directory.read(name, LIMIT).with_context(unreadable)?;
    of_bytes(&path, bytes.with_context(unreadable)?)
}

fn of_bytes(path: &Path, bytes: Vec<u8>) -> anyhow::Result<(Model, String)> {
    let text = String::from_utf8(bytes).with_context(|| format!("the model {} is not UTF-8", path.display()))?;
    let model = read(&path.display().to_string(), &text)?;
    if let Some(note) = model.note() {
        complain(&note.to_string());
    }
    Ok((model, text))
}

/// Adds the location in the model file to an error, if the error names a part of the file.
pub fn located<'m, T>(model: impl Into<Option<&'m Model>>, result: linkwright::Result<T>) -> anyhow::Result<T> {
    result.map_err(|error| match model.into().and_then(|model| model.locate(&error)) {
        Some(report) => report.into(),
        None => error.into(),
    })
}

/// Returns `true` if an argument is a model file rather than the name of a problem of the library.
pub fn is_file(what: &str) -> bool {
    let is_known = linkwright::cases::suite::problems().any(|entry| entry.name == what);
    let path = Path::new(what);
    !is_known && (path.exists() || path.extension().is_some())
}

/// The start design with changes such as `--at k=0.5,c=0.2`.
pub fn design(problem: &Problem, at: &[String]) -> anyhow::Result<Vec<f64>> {
    let mut design = problem.start();
    for item in at {
        let Some((name, value)) = item.split_once('=') else { bail!("`{item}` does not have the form NAME=VALUE") };
        let Some(k) = problem.variables.iter().position(|v| v.name == name.trim()) else {
            let known: Vec<&str> = problem.variables.iter().map(|v| v.name.as_str()).collect();
            bail!("there is no design variable `{}`; choose from {}", name.trim(), known.join(", "));
        };
        design[k] = value.trim().parse().with_context(|| format!("`{}` is not a number", value.trim()))?;
    }
    problem.check_design(&design)?;
    Ok(design)
}
