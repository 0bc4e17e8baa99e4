//! Model files and designs on the command line.

use super::output::{argument, complain};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use linkwright::model_file::{
    DiagnosticReport, Model, number_in, read, read_of_run, settings, with_files, with_setting, with_start,
};
use linkwright::problem::{DesignVariable, Problem};
use linkwright::report::number::{DIGITS, with_unit};
use linkwright::storage::{Directory, read_file};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

/// Largest size of a model file in bytes. The reader rejects files of more than half of it with a diagnostic.
const LIMIT: u64 = 2 << 20;

/// True if model files may start the programs that they name.
static PROGRAMS: AtomicBool = AtomicBool::new(false);

/// Allows model files to start the programs that they name.
pub fn allow_programs() {
    PROGRAMS.store(true, Ordering::Relaxed);
}

/// True if model files may start the programs that they name.
#[cfg(feature = "app")]
pub fn programs_are_allowed() -> bool {
    PROGRAMS.load(Ordering::Relaxed)
}

/// Lets a model start its program in the folder of its file, if that was allowed.
pub fn with_program(mut model: Model, file: &Path) -> Model {
    if PROGRAMS.load(Ordering::Relaxed) {
        model.allow_programs(file.parent().unwrap_or(Path::new("")));
    }
    model
}

/// The folder in which the program of a model file may run, if that was allowed.
pub fn program_folder(file: &Path) -> Option<PathBuf> {
    PROGRAMS.load(Ordering::Relaxed).then(|| file.parent().unwrap_or(Path::new("")).to_owned())
}

/// Settings of a model on the command line.
#[derive(Args, Default)]
pub struct ModelSettings {
    /// Another value of a setting, for instance --set time.points=51; without a value, as in --set analysis.step=, the setting is
    /// left out; the file stays as it is
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
}

/// Values of design variables on the command line.
#[derive(Args, Default)]
pub struct At {
    /// Values of design variables, for instance k=0.4,c=0.5 or k="400 mm"; the others have their start values
    #[arg(long, visible_alias = "start", value_name = "NAME=VALUE", value_parser = assignments)]
    at: Vec<Assignments>,
}

/// Assignments in one argument, `k=0.4,c="atan2(1, 2)"`: commas separate them outside parentheses and quotes only.
#[derive(Clone)]
struct Assignments(Vec<String>);

fn assignments(text: &str) -> Result<Assignments, std::convert::Infallible> {
    let (mut all, mut depth, mut is_quoted) = (vec![String::new()], 0i32, false);
    for c in text.chars() {
        match c {
            '"' | '\'' => is_quoted = !is_quoted,
            '(' | '[' if !is_quoted => depth += 1,
            ')' | ']' if !is_quoted => depth -= 1,
            ',' if depth <= 0 && !is_quoted => {
                all.push(String::new());
                continue;
            }
            _ => {}
        }
        all.last_mut().expect("there is one").push(c);
    }
    Ok(Assignments(all))
}

/// Settings of a model and of its method on the command line.
#[derive(Args, Default)]
pub struct Edits {
    #[command(flatten)]
    settings: ModelSettings,
    /// Another method: a preset, as `linkwright compare --list` names them
    #[arg(long, value_name = "NAME")]
    method: Option<String>,
    /// Another limit on the number of cycles
    #[arg(long, value_name = "N")]
    max_cycles: Option<u32>,
}

/// Start values of design variables on the command line.
#[derive(Args, Default)]
pub struct StartValues {
    /// Other start values of design variables, for instance k=0.4,c=0.5 or k="400 mm"
    #[arg(long, visible_alias = "at", value_name = "NAME=VALUE", value_parser = assignments)]
    start: Vec<Assignments>,
}

impl ModelSettings {
    /// Reads a model file with these settings. Returns the model and its text.
    pub fn load(&self, path: &Path) -> anyhow::Result<(Model, String)> {
        read_edited(path, &self.pairs()?, &[], read)
    }

    /// Rejects settings for a problem of the library, which has no file.
    pub fn check_none(&self, problem: &str) -> anyhow::Result<()> {
        anyhow::ensure!(
            self.set.is_empty(),
            "`--set` changes a model file, and `{problem}` is a problem of the library"
        );
        Ok(())
    }

    fn pairs(&self) -> anyhow::Result<Vec<(String, String)>> {
        once(self.set.iter().map(|item| pair(item, "KEY=VALUE")).collect::<anyhow::Result<Vec<_>>>()?)
    }
}

impl Edits {
    /// Returns `true` if there is nothing to change.
    pub fn is_empty(&self) -> bool {
        self.settings.set.is_empty() && self.method.is_none() && self.max_cycles.is_none()
    }

    /// Reads a model file with these changes and start values. Returns the model and its text.
    pub fn load(&self, path: &Path, start: &StartValues) -> anyhow::Result<(Model, String)> {
        let start = start.start.iter().flat_map(|all| &all.0);
        let start = once(start.map(|item| pair(item, "NAME=VALUE")).collect::<anyhow::Result<Vec<_>>>()?)?;
        read_edited(path, &self.pairs()?, &start, read)
    }

    /// Reads the edited model file of a run that has begun, with these changes. Returns the model and its text.
    pub fn load_again(&self, path: &Path) -> anyhow::Result<(Model, String)> {
        read_edited(path, &self.pairs()?, &[], read_of_run)
    }

    /// The model of a run with these changes, and its text.
    pub fn change(&self, path: &Path, text: String) -> anyhow::Result<(Model, String)> {
        edited(path, text, &self.pairs()?, &[], read_of_run)
    }

    fn pairs(&self) -> anyhow::Result<Vec<(String, String)>> {
        let mut all = self.settings.pairs()?;
        all.extend(self.method.iter().map(|name| ("method.preset".to_owned(), name.clone())));
        all.extend(self.max_cycles.iter().map(|count| ("method.max_cycles".to_owned(), count.to_string())));
        Ok(all)
    }
}

/// The two sides of the first `=` outside quotes.
fn pair(item: &str, form: &str) -> anyhow::Result<(String, String)> {
    let mut is_quoted = false;
    let sign = item.find(|c| {
        is_quoted ^= c == '"';
        c == '=' && !is_quoted
    });
    match sign {
        Some(sign) => Ok((item[..sign].trim().to_owned(), item[sign + 1..].trim().to_owned())),
        None => bail!("`{item}` does not have the form {form}"),
    }
}

/// Rejects a name that is given twice, of which one value would be ignored.
fn once(pairs: Vec<(String, String)>) -> anyhow::Result<Vec<(String, String)>> {
    let mut seen = std::collections::BTreeSet::new();
    match pairs.iter().find(|(name, _)| !seen.insert(name.as_str())) {
        Some((name, _)) => bail!("`{name}` is given twice; give one value"),
        None => Ok(pairs),
    }
}

/// Reads a text as a model: [`read`] or [`read_of_run`].
type Reader = fn(&str, &str) -> Result<Model, Box<DiagnosticReport>>;

/// Reads a model file with other settings and start values. Returns the model and its text.
fn read_edited(
    path: &Path,
    settings: &[(String, String)],
    start: &[(String, String)],
    reader: Reader,
) -> anyhow::Result<(Model, String)> {
    let path = &model_file(path);
    let bytes = read_file(path, LIMIT).with_context(|| format!("cannot read the model {}", path.display()))?;
    let text = String::from_utf8(bytes).with_context(|| format!("the model {} is not UTF-8", path.display()))?;
    let text = with_files(&path.display().to_string(), &text, path.parent().unwrap_or(Path::new("")))?;
    edited(path, text, settings, start, reader)
}

fn edited(
    path: &Path,
    mut text: String,
    settings: &[(String, String)],
    start: &[(String, String)],
    reader: Reader,
) -> anyhow::Result<(Model, String)> {
    reject_study(path, &text)?;
    let name = path.display().to_string();
    for (key, value) in settings {
        text = with_setting(&name, &text, key, value)?;
    }
    for (variable, value) in start {
        text = with_start(&name, &text, variable, value)?;
    }
    let (model, text) = of_bytes(path, text.into_bytes(), reader).map_err(|error| {
        let starts = start.iter().map(|(variable, value)| format!("the start {variable} = {value}"));
        let changed = |(key, value): &(String, String)| match value.is_empty() {
            true => format!("no {key}"),
            false => format!("{key} = {value}"),
        };
        let changes: Vec<String> = settings.iter().map(changed).chain(starts).collect();
        // The remedy for a setting that excludes one of the file.
        let remedy = if settings.is_empty() { "" } else { " (`--set KEY=` leaves a setting out)" };
        match changes.is_empty() {
            true => error,
            false => anyhow!(
                "{error:#}\n  = note: the lines are those of {name} with {}, from the command line{remedy}",
                changes.join(", ")
            ),
        }
    })?;
    Ok((with_program(model, path), text))
}

/// Rejects the text of a study file where a model file is needed.
pub fn reject_study(path: &Path, text: &str) -> anyhow::Result<()> {
    let name = path.display().to_string();
    anyhow::ensure!(
        !is_study(text),
        "{name} is a study, and a model file is needed; `linkwright study {}` does its runs",
        argument(&name)
    );
    Ok(())
}

/// Returns `true` for the text of a study file, which names a model, its kind, and what varies.
fn is_study(text: &str) -> bool {
    settings("", text).is_ok_and(|all| {
        let has = |name: &str| all.contains_key(name);
        has("model") && has("kind") && !all.keys().any(|key| is_of_model(key))
    })
}

/// Returns `true` for the text of a model file, where a study file is expected.
pub fn is_model(text: &str) -> bool {
    settings("", text).is_ok_and(|all| !all.contains_key("model") && all.keys().any(|key| is_of_model(key)))
}

/// Returns `true` for a key that only model files have.
fn is_of_model(key: &str) -> bool {
    ["design", "output", "objective", "body"].contains(&key.split('.').next().unwrap_or_default())
}

/// The model file of a name: `lift` means `lift.toml` if there is no file `lift`.
pub fn model_file(path: &Path) -> PathBuf {
    let named = path.with_extension("toml");
    if path.extension().is_none() && !path.is_file() && named.exists() { named } else { path.to_owned() }
}

/// Reads the model of a run in its open folder, without following a link.
pub fn parsed(directory: &Directory, name: &str) -> anyhow::Result<(Model, String)> {
    let path = directory.path().join(name);
    let unreadable = || format!("cannot read the model {}", path.display());
    let bytes = directory.read(name, LIMIT).with_context(unreadable)?;
    of_bytes(&path, bytes.with_context(unreadable)?, read_of_run)
}

fn of_bytes(path: &Path, bytes: Vec<u8>, reader: Reader) -> anyhow::Result<(Model, String)> {
    let text = String::from_utf8(bytes).with_context(|| format!("the model {} is not UTF-8", path.display()))?;
    let model = reader(&path.display().to_string(), &text)?;
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

/// Returns `true` if an argument is a model file rather than the name of a problem of the library. A file is preferred to a problem with its name, as
/// in the commands that accept only files; a folder is not.
pub fn is_file(what: &str) -> bool {
    let path = Path::new(what);
    let is_known = linkwright::cases::suite::problems().any(|entry| entry.name == what);
    if is_known { model_file(path).is_file() } else { model_file(path).exists() || path.extension().is_some() }
}

/// The start design with changes such as `--at k=0.5,c=0.2`.
pub fn design(problem: &Problem, at: &At) -> anyhow::Result<Vec<f64>> {
    let design = changed(&problem.variables, at, problem.objective.peak().map(|peak| peak.variable))?;
    problem.check_design(&design)?;
    Ok(design)
}

/// The start values of design variables with changes; messages do not name the variable that bounds a peak.
pub fn changed(variables: &[DesignVariable], at: &At, bound: Option<usize>) -> anyhow::Result<Vec<f64>> {
    let mut design: Vec<f64> = variables.iter().map(|variable| variable.start).collect();
    let given = at.at.iter().flat_map(|all| &all.0).map(|item| pair(item, "NAME=VALUE"));
    for (name, value) in once(given.collect::<anyhow::Result<Vec<_>>>()?)? {
        let Some(k) = variables.iter().position(|v| v.name == name) else {
            let own = variables.iter().enumerate().filter(|(k, _)| Some(*k) != bound);
            let known: Vec<&str> = own.map(|(_, v)| v.name.as_str()).collect();
            anyhow::ensure!(!known.is_empty(), "there is no design variable `{name}`: the model has none");
            bail!("there is no design variable `{name}`; choose from {}", known.join(", "));
        };
        let DesignVariable { unit, lower, upper, .. } = &variables[k];
        design[k] = number_in(unit, &name, &value)?;
        if !(*lower..=*upper).contains(&design[k]) {
            let [value, lower, upper] = [design[k], *lower, *upper].map(|number| with_unit(number, unit, DIGITS));
            bail!(
                "{name} = {value} is outside its bounds, {lower} and {upper}; give a value between them, or widen the bounds"
            );
        }
    }
    Ok(design)
}
