//! What the folder of a run says about it.

use crate::command::model::{Claim, RunDirectory, Summary};
use linkwright::model_file::settings;
use linkwright::sao::Status;
use serde::Serialize;
use std::path::Path;

/// A run.
#[derive(Clone, Debug, Serialize)]
pub struct Record {
    /// Where it is.
    pub folder: String,
    /// When it began; empty if the folder does not say.
    pub begun: String,
    /// The title of the model.
    pub model: String,
    /// The preset of the method.
    pub method: String,
    /// How it ended, `Running`, `Interrupted`, or `Damaged`.
    pub status: String,
    /// Tells problems apart.
    pub fingerprint: String,
    /// How far it has come; none before the first analysis.
    pub result: Option<Summary>,
    /// What is wrong with the folder.
    pub fault: Option<String>,
    /// The model as it was last used.
    #[serde(skip)]
    pub text: String,
}

/// Folders inside each other that are looked into, and folders that are looked at.
const DEPTH: usize = 6;
const FOLDERS: usize = 100_000;

/// All runs in a folder and in those below it, the oldest first. Links are not followed.
pub fn below(folder: &Path) -> Vec<Record> {
    let (mut found, mut waiting, mut looked_at) = (vec![], vec![(folder.to_owned(), 0)], 0);
    while let Some((folder, depth)) = waiting.pop() {
        looked_at += 1;
        if folder.join("run.json").is_file() {
            found.push(Record::of(&folder));
            continue;
        }
        let Ok(entries) = std::fs::read_dir(&folder) else { continue };
        let inner = entries.flatten().filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir()));
        if depth < DEPTH && looked_at + waiting.len() < FOLDERS {
            waiting.extend(inner.map(|entry| (entry.path(), depth + 1)));
        }
    }
    found.sort_by(|a: &Record, b| (&a.begun, &a.folder).cmp(&(&b.begun, &b.folder)));
    found
}

impl Record {
    /// What the folder says; a damaged one says what is wrong with it.
    pub fn of(folder: &Path) -> Self {
        let place = folder.display().to_string();
        match Self::read(folder) {
            Ok(record) => record,
            Err(error) => Self {
                folder: place,
                begun: String::new(),
                model: String::new(),
                method: String::new(),
                status: "Damaged".to_owned(),
                fingerprint: String::new(),
                result: None,
                fault: Some(format!("{error:#}")),
                text: String::new(),
            },
        }
    }

    /// The same, or what is wrong with it.
    pub fn read(folder: &Path) -> anyhow::Result<Self> {
        let run = RunDirectory::read(folder)?;
        let (result, fault) = match Summary::read(folder) {
            Ok(result) => (result, None),
            Err(error) => (None, Some(format!("{error:#}"))),
        };
        let status = match result.as_ref().map(|r| r.status) {
            _ if Claim::is_taken(folder) => "Running".to_owned(),
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

/// The preset that a model names.
fn preset(text: &str) -> String {
    let named = settings("", text).ok().and_then(|all| all.get("method.preset").cloned());
    let name = named.as_deref().map_or("slp", |name| name.trim_matches('"'));
    linkwright::sao::preset(name).map_or(name, |preset| preset.name).to_owned()
}
