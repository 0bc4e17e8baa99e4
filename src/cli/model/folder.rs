//! The results of a run in a folder.
//!
//! | file | what |
//! |---|---|
//! | `model.toml` | a copy of the model file; `resume` reads this one, [method] and bounds may be edited |
//! | `run.json` | versions, a number that tells the problem from others, and when the model was edited |
//! | `state.json` | everything that `resume` needs, written whole after every cycle |
//! | `cycles.csv` | the history, written whole after every cycle |
//! | `responses.csv`, `constraints.csv` | histories of the last accepted design |
//! | `summary.json` | the result, at the end |
//! | `report.html`, `figures/` | what `report` makes of the others |
//!
//! Every file appears whole or not at all: it is written beside its place and then moved there. A kill at any moment
//! leaves the cycle before.

use super::{load, tables};
use crate::cli::output::folder;
use crate::model::Model;
use crate::problem::Problem;
use crate::sao::State;
use anyhow::{Context, bail};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Version of the files of a folder.
pub const VERSION: u32 = 1;

/// What a run needs to know about itself.
#[derive(Serialize, Deserialize)]
struct Run {
    version: u32,
    program: String,
    title: String,
    /// The model's fingerprint, in hexadecimal.
    fingerprint: String,
    /// The model as it was last used.
    model: String,
    /// When it was edited.
    edits: Vec<Edit>,
}

/// An edit of the model between two parts of a run.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Edit {
    /// Number of tries that were done with the model before.
    pub after_tries: usize,
    /// Lines that the edited model has and the one before has not.
    pub lines: Vec<String>,
}

/// The folder of a run.
pub struct Folder {
    path: PathBuf,
    run: Run,
}

impl Folder {
    /// A folder for a new run. Refuses one that has a run in it.
    pub fn create(path: &Path, model: &Model, text: &str) -> anyhow::Result<Self> {
        let run = Run {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            title: model.title().to_owned(),
            fingerprint: format!("{:016x}", model.fingerprint()),
            model: text.to_owned(),
            edits: vec![],
        };
        let made = Self { path: path.to_owned(), run };
        if made.state().exists() {
            let path = path.display();
            bail!("{path} has a run in it; continue it with `linkwright resume {path}`, or give another folder");
        }
        folder(path)?;
        made.write("model.toml", text)?;
        made.write("run.json", &serde_json::to_string_pretty(&made.run)?)?;
        Ok(made)
    }

    /// The folder of a run that has begun, with its model.
    pub fn open(path: &Path) -> anyhow::Result<(Self, Model, String)> {
        let name = path.join("run.json");
        let text = std::fs::read_to_string(&name).with_context(|| format!("{} has no run in it", path.display()))?;
        let run: Run = serde_json::from_str(&text).with_context(|| format!("{} is not readable", name.display()))?;
        if run.version != VERSION {
            bail!("{} has version {}, this program reads version {VERSION}", name.display(), run.version);
        }
        let file = path.join("model.toml");
        let (model, text) = load(&file)?;
        if format!("{:016x}", model.fingerprint()) != run.fingerprint {
            bail!("{} has another problem than the run; title, bounds and [method] may be edited", file.display());
        }
        Ok((Self { path: path.to_owned(), run }, model, text))
    }

    /// The last state of the run for going on with it, as [`Folder::stored`]; notes that the model was edited, if it was.
    pub fn resume(&mut self, problem: &Problem, text: &str) -> anyhow::Result<Option<State>> {
        let Some(state) = self.stored(problem)? else { return Ok(None) };
        problem.check_design(&state.design).context("the bounds exclude the last accepted design")?;
        self.note(&state, text)?;
        Ok(Some(state))
    }

    /// The last state of the run, or none if not even the start design was analysed. Bounds may have changed since.
    pub fn stored(&self, problem: &Problem) -> anyhow::Result<Option<State>> {
        if !self.state().exists() {
            return Ok(None);
        }
        let name = self.state();
        let stored = std::fs::read_to_string(&name).with_context(|| format!("cannot read {}", name.display()))?;
        let mut stored: serde_json::Value =
            serde_json::from_str(&stored).with_context(|| format!("{} is not readable", name.display()))?;
        // The model's own fingerprint has been compared; that of the problem has the bounds in it.
        stored["fingerprint"] = problem.fingerprint().into();
        stored["problem"] = problem.name.clone().into();
        Ok(Some(State::from_json(&stored.to_string(), problem)?))
    }

    /// Notes that the model was edited, if it was.
    fn note(&mut self, state: &State, text: &str) -> anyhow::Result<()> {
        if self.run.model == text {
            return Ok(());
        }
        let new = text.lines().filter(|line| !self.run.model.lines().any(|old| old == *line)).map(str::to_owned);
        self.run.edits.push(Edit { after_tries: state.history.len() - 1, lines: new.collect() });
        self.run.model = text.to_owned();
        self.write("run.json", &serde_json::to_string_pretty(&self.run)?)
    }

    /// The version of the program that began the run.
    pub fn program(&self) -> &str {
        &self.run.program
    }

    /// When the model was edited.
    pub fn edits(&self) -> &[Edit] {
        &self.run.edits
    }

    /// The state file.
    pub fn state(&self) -> PathBuf {
        self.path.join("state.json")
    }

    /// Writes the state and the history up to it.
    pub fn save(&self, problem: &Problem, state: &State) -> anyhow::Result<()> {
        state.save(&self.state())?;
        self.write("cycles.csv", &tables::cycles(problem, state)?.csv())
    }

    /// Writes the results of a run that has ended.
    pub fn finish(&self, problem: &Problem, state: &State, summary: &str) -> anyhow::Result<()> {
        self.write("responses.csv", &tables::responses(problem, &state.responses)?.csv())?;
        self.write("constraints.csv", &tables::constraints(problem, &state.evaluation)?.csv())?;
        self.write("summary.json", summary)
    }

    /// Writes a file whole or not at all.
    pub fn write(&self, name: &str, text: &str) -> anyhow::Result<()> {
        let (place, beside) = (self.path.join(name), self.path.join(format!("{name}.part")));
        let written = std::fs::write(&beside, text).and_then(|()| std::fs::rename(&beside, &place));
        written.with_context(|| format!("cannot write {}; earlier cycles are kept", place.display()))
    }
}
