//! The directory of a run.
//!
//! | file | content |
//! |---|---|
//! | `model.toml` | a copy of the model file; `resume` reads this one, [method] and bounds may be edited |
//! | `run.json` | versions, hashes, the model that was used last, edits |
//! | `state.json` | everything that `resume` needs, replaced after every cycle |
//! | `history.jsonl` | the events of the run, a line for each cycle, edit and end; lines are only ever appended |
//! | `cycles.csv` | the history as a table, replaced after every cycle |
//! | `summary.json` | progress and, at the end, the result; replaced after every cycle |
//! | `responses.csv`, `constraints.csv` | histories of the last accepted design, at the end |
//! | `*.parquet` | the three tables again, at the end, with the feature `parquet` |
//! | `report.html`, `figures/` | written by `report` from the other files |
//! | `run.lock` | locked while a process runs in the folder |
//!
//! Files are replaced atomically. `state.json` and `history.jsonl` are flushed to disk before the next cycle begins; the others
//! can be computed from them. A kill at any moment leaves the previous cycle.

pub mod files;
mod history;
mod records;

pub use files::Lock;
pub use records::{Change, Edit, NamedValue, Nearest, RunRecord, Summary, changes, cycle_line, fingerprint};

use super::model::load;
use super::output::create_folder;
use super::tables;
use anyhow::{Context, bail};
use history::HistoryFile;
use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::sao::State;
use std::path::{Path, PathBuf};

/// The directory of a run.
pub struct RunDirectory {
    path: PathBuf,
    record: RunRecord,
    /// Lock and history, while this process runs in the folder.
    claim: Option<(Lock, HistoryFile)>,
}

impl RunDirectory {
    /// Creates the folder of a new run. Rejects one that has a run in it.
    pub fn create(path: &Path, model: &Model, text: &str, file: &Path) -> anyhow::Result<Self> {
        let mut created = Self { path: path.to_owned(), record: RunRecord::new(model, text, file)?, claim: None };
        if created.state_file().exists() {
            let path = path.display();
            bail!("{path} has a run in it; continue it with `linkwright resume {path}`, or give another folder");
        }
        create_folder(path)?;
        created.claim()?;
        files::replace(&path.join("model.toml"), text)?;
        created.write_record()?;
        Ok(created)
    }

    /// Opens the folder of an existing run, with its model and the text of the model.
    pub fn open(path: &Path) -> anyhow::Result<(Self, Model, String)> {
        let record = RunRecord::read(path)?;
        let file = path.join("model.toml");
        let (model, text) = load(&file)?;
        if fingerprint(&model) != record.fingerprint {
            bail!("{} has another problem than the run; title, bounds and [method] may be edited", file.display());
        }
        Ok((Self { path: path.to_owned(), record, claim: None }, model, text))
    }

    /// Locks the folder against other processes, and removes an incomplete last line of the history.
    pub fn claim(&mut self) -> anyhow::Result<()> {
        let lock = Lock::acquire(&self.path)?;
        self.claim = Some((lock, HistoryFile::open(&self.path)?));
        Ok(())
    }

    /// The last state of the run, or `None` if the start design has not been analysed. Records edits of the model.
    pub fn resume(&mut self, problem: &Problem, text: &str) -> anyhow::Result<Option<State>> {
        let state = self.last(problem)?;
        if let Some(state) = &state {
            problem.check_design(&state.design).context("the bounds exclude the last accepted design")?;
            self.record_edit(state, text)?;
        }
        Ok(state)
    }

    /// The last state of the run, or `None` if the start design has not been analysed. Bounds may have changed since.
    pub fn last(&self, problem: &Problem) -> anyhow::Result<Option<State>> {
        let name = self.state_file();
        if !name.exists() {
            return Ok(None);
        }
        let stored = std::fs::read_to_string(&name).with_context(|| format!("cannot read {}", name.display()))?;
        let mut stored: serde_json::Value =
            serde_json::from_str(&stored).with_context(|| format!("{} is not readable", name.display()))?;
        // The fingerprint of the problem includes the bounds; `open` has compared that of the model, which does not.
        stored["fingerprint"] = problem.fingerprint().into();
        stored["problem"] = problem.name.clone().into();
        Ok(Some(State::from_json(&stored.to_string(), problem)?))
    }

    fn record_edit(&mut self, state: &State, text: &str) -> anyhow::Result<()> {
        let before = &self.record.model;
        if before == text {
            return Ok(());
        }
        let new = text.lines().filter(|line| !before.lines().any(|old| old == *line)).map(str::to_owned);
        let edit = Edit { after_tries: state.history.len() - 1, lines: new.collect(), changes: changes(before, text)? };
        self.record.edits.push(edit);
        self.record.model = text.to_owned();
        self.write_record()
    }

    /// `run.json`.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    fn state_file(&self) -> PathBuf {
        self.path.join("state.json")
    }

    /// Writes the state, the history up to it, and the summary. Returns the summary.
    pub fn save(&mut self, model: &Model, problem: &Problem, state: &State) -> anyhow::Result<Summary> {
        files::replace(&self.state_file(), state.to_json())?;
        if let Some((_, history)) = &mut self.claim {
            history.update(&self.record, state)?;
        }
        let summary = Summary::new(model, problem, state, &self.record.edits);
        files::replace_unflushed(&self.path.join("cycles.csv"), &tables::cycles(problem, state)?.csv())?;
        files::replace_unflushed(&self.path.join("summary.json"), &serde_json::to_string_pretty(&summary)?)?;
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

    fn write_record(&self) -> anyhow::Result<()> {
        files::replace(&self.path.join("run.json"), serde_json::to_string_pretty(&self.record)?)
    }
}
