//! The results of a run in a folder.
//!
//! | file | what |
//! |---|---|
//! | `model.toml` | a copy of the model file; `resume` reads this one, [method] and bounds may be edited |
//! | `run.json` | versions, hashes, the model as it was last used, and when it was edited |
//! | `state.json` | everything that `resume` needs, written whole after every cycle |
//! | `history.jsonl` | what happened, a line for each cycle, edit and end; lines are only ever added |
//! | `cycles.csv` | the history as a table, written whole after every cycle |
//! | `summary.json` | how far the run has come, written whole after every cycle; at the end the result |
//! | `responses.csv`, `constraints.csv` | histories of the last accepted design, at the end |
//! | `*.parquet` | the three tables again, at the end, with the feature `parquet` |
//! | `report.html`, `figures/` | what `report` makes of the others |
//! | `run.lock` | locked while a process runs in the folder |
//!
//! A file appears whole or not at all: it is written beside its place and then moved there. What `resume` needs is on the disk
//! before the next cycle begins; the rest can be computed from it. A kill at any moment leaves the cycle before.

use super::files::{self, Claim};
use super::history::History;
use super::summary::Summary;
use super::{load, tables};
use crate::command::clock;
use crate::command::output::folder;
use anyhow::{Context, bail};
use linkwright::model_file::{Model, settings};
use linkwright::problem::Problem;
use linkwright::sao::{STATE_VERSION, State};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Version of the files of a folder.
pub const VERSION: u32 = 1;

/// Who wrote a folder.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Versions {
    /// Of the files of the folder.
    pub version: u32,
    /// Of linkwright.
    pub program: String,
    /// Of `state.json`.
    #[serde(default)]
    pub state: u32,
}

/// What a run needs to know about itself.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct RunDirectory {
    #[serde(flatten)]
    pub versions: Versions,
    pub title: String,
    /// When it began.
    #[serde(default)]
    pub begun: String,
    /// The model file, as it was named.
    #[serde(default)]
    pub file: String,
    /// The hash of its bytes.
    #[serde(default)]
    pub input: String,
    /// The model's fingerprint, in hexadecimal: that of the problem without bounds and method.
    pub fingerprint: String,
    /// The model as it was last used.
    pub model: String,
    /// When it was edited.
    pub edits: Vec<Edit>,
}

/// An edit of the model between two parts of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Edit {
    /// Number of tries that were done with the model before.
    pub after_tries: usize,
    /// Lines that the edited model has and the one before has not.
    pub lines: Vec<String>,
    /// Settings that are others than before.
    #[serde(default)]
    pub changes: Vec<Change>,
}

/// A setting in two models: absent where a model has no such key.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Change {
    pub key: String,
    pub before: Option<String>,
    pub after: Option<String>,
}

/// The folder of a run.
pub struct Folder {
    path: PathBuf,
    run: RunDirectory,
    /// There while this process runs in the folder.
    claim: Option<(Claim, History)>,
}

impl RunDirectory {
    /// Reads `run.json` of a folder.
    pub fn read(path: &Path) -> anyhow::Result<Self> {
        let name = path.join("run.json");
        let text = std::fs::read_to_string(&name).with_context(|| format!("{} has no run in it", path.display()))?;
        let run: Self = serde_json::from_str(&text).with_context(|| format!("{} is not readable", name.display()))?;
        if run.versions.version != VERSION {
            let got = run.versions.version;
            bail!("{} has version {got}, this program reads version {VERSION}", name.display());
        }
        Ok(run)
    }
}

impl Folder {
    /// A folder for a new run. Refuses one that has a run in it.
    pub fn create(path: &Path, model: &Model, text: &str, file: &Path) -> anyhow::Result<Self> {
        let versions =
            Versions { version: VERSION, program: env!("CARGO_PKG_VERSION").to_owned(), state: STATE_VERSION };
        let run = RunDirectory {
            versions,
            title: model.title().to_owned(),
            begun: clock::now(),
            file: file.display().to_string(),
            input: format!("fnv1a64:{:016x}", hash(text)),
            fingerprint: format!("{:016x}", model.fingerprint()),
            model: text.to_owned(),
            edits: vec![],
        };
        let mut made = Self { path: path.to_owned(), run, claim: None };
        if made.state().exists() {
            let path = path.display();
            bail!("{path} has a run in it; continue it with `linkwright resume {path}`, or give another folder");
        }
        folder(path)?;
        made.claim()?;
        files::replace(&path.join("model.toml"), text)?;
        made.write_run()?;
        Ok(made)
    }

    /// The folder of a run that has begun, with its model.
    pub fn open(path: &Path) -> anyhow::Result<(Self, Model, String)> {
        let run = RunDirectory::read(path)?;
        let file = path.join("model.toml");
        let (model, text) = load(&file)?;
        if format!("{:016x}", model.fingerprint()) != run.fingerprint {
            bail!("{} has another problem than the run; title, bounds and [method] may be edited", file.display());
        }
        Ok((Self { path: path.to_owned(), run, claim: None }, model, text))
    }

    /// Keeps other processes from running in the folder, and mends what a kill has cut.
    pub fn claim(&mut self) -> anyhow::Result<()> {
        let claim = Claim::new(&self.path)?;
        self.claim = Some((claim, History::open(&self.path)?));
        Ok(())
    }

    /// The last state of the run, to go on from, or none if not even the start design was analysed. Notes what was edited.
    pub fn resume(&mut self, problem: &Problem, text: &str) -> anyhow::Result<Option<State>> {
        let state = self.last(problem)?;
        if let Some(state) = &state {
            problem.check_design(&state.design).context("the bounds exclude the last accepted design")?;
            self.note(state, text)?;
        }
        Ok(state)
    }

    /// The last state of the run, or none if not even the start design was analysed. Bounds may have changed since.
    pub fn last(&self, problem: &Problem) -> anyhow::Result<Option<State>> {
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
        let edit = Edit {
            after_tries: state.history.len() - 1,
            lines: new.collect(),
            changes: changes(&self.run.model, text)?,
        };
        self.run.edits.push(edit);
        self.run.model = text.to_owned();
        self.write_run()
    }

    /// The version of the program that began the run.
    pub fn program(&self) -> &str {
        &self.run.versions.program
    }

    /// When the model was edited.
    pub fn edits(&self) -> &[Edit] {
        &self.run.edits
    }

    /// The state file.
    pub fn state(&self) -> PathBuf {
        self.path.join("state.json")
    }

    /// Writes the state, the history up to it, and the summary. Returns the summary.
    pub fn save(&mut self, model: &Model, problem: &Problem, state: &State) -> anyhow::Result<Summary> {
        files::replace(&self.state(), state.to_json())?;
        if let Some((_, history)) = &mut self.claim {
            history.follow(&self.run, state)?;
        }
        let summary = Summary::of(model, problem, state, &self.run.edits);
        files::replace_soon(&self.path.join("cycles.csv"), &tables::cycles(problem, state)?.csv())?;
        files::replace_soon(&self.path.join("summary.json"), &serde_json::to_string_pretty(&summary)?)?;
        Ok(summary)
    }

    /// Writes the results of a run that has ended.
    pub fn finish(&mut self, problem: &Problem, state: &State, summary: &Summary) -> anyhow::Result<()> {
        let responses = tables::responses(problem, &state.responses)?;
        let constraints = tables::constraints(problem, &state.evaluation)?;
        files::replace(&self.path.join("responses.csv"), responses.csv())?;
        files::replace(&self.path.join("constraints.csv"), constraints.csv())?;
        #[cfg(feature = "parquet")]
        for (name, table) in
            [("cycles", tables::cycles(problem, state)?), ("responses", responses), ("constraints", constraints)]
        {
            files::replace(&self.path.join(format!("{name}.parquet")), table.parquet()?)?;
        }
        files::replace(&self.path.join("summary.json"), serde_json::to_string_pretty(summary)?)?;
        self.claim.as_mut().map_or(Ok(()), |(_, history)| history.end(summary))
    }

    fn write_run(&self) -> anyhow::Result<()> {
        files::replace(&self.path.join("run.json"), serde_json::to_string_pretty(&self.run)?)
    }
}

/// The settings in which two models differ.
pub fn changes(before: &str, after: &str) -> anyhow::Result<Vec<Change>> {
    let [old, new] = [settings("the model before", before)?, settings("the model after", after)?];
    let keys: std::collections::BTreeSet<&String> = old.keys().chain(new.keys()).collect();
    let different = keys.into_iter().filter(|key| old.get(*key) != new.get(*key));
    let change =
        |key: &String| Change { key: key.clone(), before: old.get(key).cloned(), after: new.get(key).cloned() };
    Ok(different.map(change).collect())
}

/// FNV-1a: tells files apart that were not made to deceive.
fn hash(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
