//! `history.jsonl`: what happened in a run, line by line; lines are only ever added.
//!
//! | `event` | what |
//! |---|---|
//! | `begin` | versions and the hash of the model file |
//! | `cycle` | a cycle or a rejected try of it |
//! | `edit` | the model was edited before the run went on |
//! | `end` | the summary |
//!
//! A line is written after the state that it tells of. What a kill has kept from being written is added when the run goes on, so
//! the lines of a run that was killed are those of a run that was not.

use super::files;
use super::folder::{Edit, RunDirectory};
use super::progress::Line;
use super::summary::Summary;
use linkwright::sao::State;
use serde::Serialize;
use std::path::{Path, PathBuf};

/// The history of a run with what is known of its lines.
pub struct History {
    path: PathBuf,
    cycles: usize,
    edits: usize,
    last: String,
}

#[derive(Serialize)]
struct Begin<'r> {
    event: &'static str,
    #[serde(flatten)]
    versions: &'r super::folder::Versions,
    fingerprint: &'r str,
    input: &'r str,
}

#[derive(Serialize)]
struct Edited<'e> {
    event: &'static str,
    #[serde(flatten)]
    edit: &'e Edit,
}

impl History {
    /// The history in this folder, mended where a kill has cut it.
    pub fn open(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join("history.jsonl");
        let text = files::whole_lines(&path)?;
        let count =
            |event: &str| text.lines().filter(|line| line.starts_with(&format!("{{\"event\":\"{event}\""))).count();
        let last = text.lines().last().unwrap_or("").to_owned();
        Ok(Self { path, cycles: count("cycle"), edits: count("edit"), last })
    }

    /// Adds what the state and the run have that the history has not yet.
    pub fn follow(&mut self, run: &RunDirectory, state: &State) -> anyhow::Result<()> {
        let mut lines = vec![];
        if self.last.is_empty() {
            let RunDirectory { versions, fingerprint, input, .. } = run;
            lines.push(serde_json::to_string(&Begin { event: "begin", versions, fingerprint, input })?);
        }
        for cycle in state.history.iter().skip(self.cycles) {
            lines.push(serde_json::to_string(&Line { event: "cycle", cycle })?);
        }
        for edit in run.edits.iter().skip(self.edits) {
            lines.push(serde_json::to_string(&Edited { event: "edit", edit })?);
        }
        self.add(lines)?;
        (self.cycles, self.edits) = (state.history.len().max(self.cycles), run.edits.len());
        Ok(())
    }

    /// Adds the summary, unless the history ends with it.
    pub fn end(&mut self, summary: &Summary) -> anyhow::Result<()> {
        let line = serde_json::to_string(summary)?;
        if line == self.last { Ok(()) } else { self.add(vec![line]) }
    }

    fn add(&mut self, lines: Vec<String>) -> anyhow::Result<()> {
        let Some(last) = lines.last() else { return Ok(()) };
        files::append(&self.path, &(lines.join("\n") + "\n"))?;
        self.last = last.clone();
        Ok(())
    }
}
