//! The runs below a folder.

use crate::command::folder::RUN;
use crate::command::run_directory::{LOCK, RunRecord, Summary};
use anyhow::Context;
use linkwright::model_file::settings;
use linkwright::sao::{DEFAULT_PRESET, Status};
use linkwright::storage::Directory;
use serde::Serialize;
use std::path::Path;

/// A row of the list of runs.
#[derive(Clone, Debug, Default, Serialize)]
pub struct RunEntry {
    /// Path of the folder.
    pub folder: String,
    /// Time at which the run began, in UTC; empty if unknown.
    pub begun: String,
    /// Title of the model.
    pub model: String,
    /// Preset of the method.
    pub method: String,
    /// Status at the end, `Running`, `Interrupted`, or `Damaged`.
    pub status: String,
    /// Hash of the problem without bounds and method.
    pub fingerprint: String,
    /// Progress or result; `None` before the first analysis.
    pub result: Option<Summary>,
    /// Error of reading the folder.
    pub fault: Option<String>,
    /// Text of the model that was used last.
    #[serde(skip)]
    pub text: String,
}

/// Limits of the search: depth of nested folders, and number of folders.
const DEPTH: usize = 6;
const FOLDERS: usize = 100_000;

/// All runs in a folder and its subfolders, the oldest first. Symbolic links are not followed.
pub fn below(folder: &Path) -> Vec<RunEntry> {
    let (mut found, mut waiting, mut searched) = (vec![], vec![(folder.to_owned(), 0)], 0);
    while let Some((folder, depth)) = waiting.pop() {
        searched += 1;
        if folder.join(RUN).symlink_metadata().is_ok_and(|entry| !entry.is_dir()) {
            found.push(RunEntry::of(&folder));
            continue;
        }
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let inner = entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
        if depth < DEPTH && searched + waiting.len() < FOLDERS {
            waiting.extend(inner.map(|entry| (entry.path(), depth + 1)));
        }
    }
    found.sort_by(|a: &RunEntry, b| (&a.begun, &a.folder).cmp(&(&b.begun, &b.folder)));
    found
}

impl RunEntry {
    /// The run in a folder, `Damaged` if it cannot be read.
    fn of(folder: &Path) -> Self {
        Self::read(folder).unwrap_or_else(|error| Self {
            folder: folder.display().to_string(),
            status: "Damaged".to_owned(),
            fault: Some(format!("{error:#}")),
            ..Self::default()
        })
    }

    /// Reads the run in a folder.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let directory = Directory::open(folder).with_context(|| format!("{} has no run in it", folder.display()))?;
        let run = RunRecord::read(&directory)?;
        let (result, fault) = match Summary::read(&directory) {
            Ok(result) => (result, None),
            Err(error) => (None, Some(format!("{error:#}"))),
        };
        let status = match result.as_ref().map(|r| r.status) {
            _ if directory.is_locked(LOCK) => "Running".to_owned(),
            _ if fault.is_some() => "Damaged".to_owned(),
            None | Some(Status::Running) => "Interrupted".to_owned(),
            Some(status) => format!("{status:?}"),
        };
        Ok(Self {
            folder: folder.display().to_string(),
            begun: run.begun,
            model: run.title,
            method: preset(&run.model),
            status,
            fingerprint: run.fingerprint,
            result,
            fault,
            text: run.model,
        })
    }
}

/// The preset in the text of a model.
fn preset(text: &str) -> String {
    let named = settings("", text).ok().and_then(|all| all.get("method.preset").cloned());
    let name = named.as_deref().map_or(DEFAULT_PRESET, |name| name.trim_matches('"'));
    linkwright::sao::preset(name).map_or(name, |preset| preset.name).to_owned()
}
