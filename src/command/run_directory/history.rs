//! `history.jsonl`: the events of a run, a line for each; lines are only ever appended.
//!
//! | `event` | content |
//! |---|---|
//! | `begin` | versions and the hash of the model file |
//! | `cycle` | an accepted or rejected trial step |
//! | `edit` | an edit of the model before the run continued |
//! | `end` | the summary |
//!
//! A line is written after the state that it describes. Lines that a kill prevented are appended when the run continues, so
//! the file of an interrupted run ends up the same as that of an uninterrupted one.

use super::files;
use super::records::{Edit, RunRecord, Summary, Versions, cycle_line};
use linkwright::sao::State;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The history file with the number of its lines of each kind.
pub struct HistoryFile {
    path: PathBuf,
    cycles: usize,
    edits: usize,
    last: String,
}

#[derive(Serialize)]
struct BeginLine<'r> {
    event: &'static str,
    #[serde(flatten)]
    versions: &'r Versions,
    fingerprint: &'r str,
    input: &'r str,
}

#[derive(Serialize)]
struct EditLine<'e> {
    event: &'static str,
    #[serde(flatten)]
    edit: &'e Edit,
}

impl HistoryFile {
    /// Opens the history of a folder and removes an incomplete last line.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join("history.jsonl");
        let text = files::complete_lines(&path)?;
        let count =
            |event: &str| text.lines().filter(|line| line.starts_with(&format!("{{\"event\":\"{event}\""))).count();
        let last = text.lines().last().unwrap_or("").to_owned();
        Ok(Self { path, cycles: count("cycle"), edits: count("edit"), last })
    }

    /// Appends the cycles and edits that are not in the file yet.
    pub fn update(&mut self, run: &RunRecord, state: &State) -> anyhow::Result<()> {
        let mut lines = vec![];
        if self.last.is_empty() {
            let RunRecord { versions, fingerprint, input, .. } = run;
            lines.push(serde_json::to_string(&BeginLine { event: "begin", versions, fingerprint, input })?);
        }
        for cycle in state.history.iter().skip(self.cycles) {
            lines.push(cycle_line(cycle)?);
        }
        for edit in run.edits.iter().skip(self.edits) {
            lines.push(serde_json::to_string(&EditLine { event: "edit", edit })?);
        }
        self.append(lines)?;
        (self.cycles, self.edits) = (state.history.len().max(self.cycles), run.edits.len());
        Ok(())
    }

    /// Appends the summary, unless it is the last line already.
    pub fn end(&mut self, summary: &Summary) -> anyhow::Result<()> {
        let line = serde_json::to_string(summary)?;
        if line == self.last { Ok(()) } else { self.append(vec![line]) }
    }

    fn append(&mut self, lines: Vec<String>) -> anyhow::Result<()> {
        let Some(last) = lines.last() else { return Ok(()) };
        files::append(&self.path, &(lines.join("\n") + "\n"))?;
        self.last = last.clone();
        Ok(())
    }
}
