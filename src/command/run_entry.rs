//! The runs and studies below folders.

use crate::command::output_folder::{MANIFEST, OutputFolder, RUN, STUDY, opened};
use crate::command::run_directory::{LOCK, RunRecord, Summary, note};
use crate::command::study::{StudyProgress, StudyRecord};
use anyhow::Context;
use linkwright::model_file::settings;
use linkwright::sao::{DEFAULT_PRESET, Status};
use linkwright::storage::{Directory, EntryKind};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A row of the list of runs.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct RunEntry {
    /// `run` or `study`.
    pub kind: String,
    /// Path of the folder, as text.
    pub folder: String,
    /// Path of the folder, which need not be UTF-8. Empty for an entry of a database.
    #[serde(skip)]
    pub path: PathBuf,
    /// Time at which the run began, in UTC; empty if unknown.
    pub begun: String,
    /// Title of the model.
    pub model: String,
    /// Preset of the method; kind of a study.
    pub method: String,
    /// Status at the end, for a study `Complete`, or `Failed` if all runs failed, `Running`, `Interrupted`, or `Damaged`.
    pub status: String,
    /// Hash of the problem without bounds and method; of the settings of study and model.
    pub fingerprint: String,
    /// Progress or result; `None` before the first analysis.
    pub result: Option<Summary>,
    /// Progress of a study; `None` for a run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub study: Option<StudyProgress>,
    /// Note of the user about the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Error of reading the folder.
    pub fault: Option<String>,
    /// Text of the model that was used last.
    #[serde(skip)]
    pub text: String,
}

/// Limits of the search: depth of nested folders, and number of folders.
const DEPTH: usize = 6;
const FOLDERS: usize = 100_000;

/// Largest size of the copies of a study file and of its model.
const TEXT_LIMIT: u64 = 8 << 20;

/// All runs and studies in folders and their subfolders, the oldest first. Symbolic links are not followed.
pub fn below(folders: &[PathBuf]) -> Vec<RunEntry> {
    let (mut found, mut searched) = (vec![], 0);
    let mut waiting: Vec<(PathBuf, usize)> = folders.iter().map(|folder| (folder.clone(), 0)).collect();
    while let Some((folder, depth)) = waiting.pop() {
        searched += 1;
        let has = |name: &str| folder.join(name).symlink_metadata().is_ok_and(|entry| !entry.is_dir());
        if has(RUN) || has(STUDY) || has_lost_results(&folder) {
            found.push(RunEntry::of(&folder));
        }
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let inner = entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
        if depth < DEPTH && searched + waiting.len() < FOLDERS {
            waiting.extend(inner.map(|entry| (entry.path(), depth + 1)));
        }
    }
    found.sort_by(|a: &RunEntry, b| (&a.begun, &a.path).cmp(&(&b.begun, &b.path)));
    found.dedup_by(|a, b| a.path == b.path);
    found
}

/// Returns `true` for a folder with results of a run or study whose own file is missing.
fn has_lost_results(folder: &Path) -> bool {
    let has_list = folder.join(MANIFEST).symlink_metadata().is_ok_and(|entry| entry.is_file());
    has_list
        && opened(folder).and_then(OutputFolder::of).is_ok_and(|folder| matches!(folder.lost_results(), Ok(Some(_))))
}

impl RunEntry {
    /// The run in a folder, `Damaged` if it cannot be read.
    fn of(folder: &Path) -> Self {
        Self::read(folder).unwrap_or_else(|error| Self {
            folder: folder.display().to_string(),
            path: folder.to_owned(),
            status: "Damaged".to_owned(),
            fault: Some(format!("{error:#}")),
            ..Self::default()
        })
    }

    /// Reads the run in a folder.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let directory = opened(folder)?;
        if matches!(directory.entry(STUDY)?, Some(EntryKind::File)) {
            return Self::of_study(&directory);
        }
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
            kind: "run".to_owned(),
            folder: folder.display().to_string(),
            path: folder.to_owned(),
            begun: run.begun,
            model: run.title,
            method: preset(&run.model),
            status,
            fingerprint: run.fingerprint,
            result,
            study: None,
            note: note(&directory),
            fault,
            text: run.model,
        })
    }

    /// The study of an open folder.
    fn of_study(directory: &Directory) -> anyhow::Result<Self> {
        let shown = directory.path().display();
        let record = StudyRecord::read(directory)?.with_context(|| format!("{shown} has no study in it"))?;
        let (study, fault) = match record.progress(directory) {
            Ok(progress) => (Some(progress), None),
            Err(error) => (None, Some(format!("{error:#}"))),
        };
        let status = match &study {
            _ if directory.is_locked(LOCK) => "Running",
            None => "Damaged",
            Some(progress) if progress.done < progress.runs => "Interrupted",
            Some(progress) if progress.runs > 0 && progress.failed == progress.runs => "Failed",
            Some(_) => "Complete",
        };
        let copy = |name: &str| directory.read(name, TEXT_LIMIT).ok().flatten().map(String::from_utf8);
        let text = |name: &str| copy(name).and_then(Result::ok).unwrap_or_default();
        let kind = settings("", &text("study.toml")).ok().and_then(|all| all.get("kind").cloned()).unwrap_or_default();
        Ok(Self {
            kind: "study".to_owned(),
            folder: shown.to_string(),
            path: directory.path().to_owned(),
            begun: record.begun,
            model: record.title,
            method: kind.trim_matches('"').to_owned(),
            status: status.to_owned(),
            fingerprint: record.study,
            result: None,
            study,
            note: None,
            fault,
            text: text("model.toml"),
        })
    }
}

/// The preset in the text of a model.
fn preset(text: &str) -> String {
    let named = settings("", text).ok().and_then(|all| all.get("method.preset").cloned());
    let name = named.as_deref().map_or(DEFAULT_PRESET, |name| name.trim_matches('"'));
    linkwright::sao::preset(name).map_or(name, |preset| preset.name).to_owned()
}
