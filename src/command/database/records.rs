//! Runs and studies: taken from folders, and listed.

use super::analyses::{Record, take_answers};
use super::{Database, absolute, explained};
use crate::command::run_directory::{RunRecord, last_analysis};
use crate::command::run_entry::RunEntry;
use crate::command::study::stored_study;
use linkwright::model_file;
use linkwright::storage::Directory;
use rusqlite::{OptionalExtension, Transaction, params};
use serde_json::{Map, Value};
use std::path::Path;

/// Numbers of new records found in folders.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ImportCounts {
    /// Runs and studies.
    pub entries: usize,
    /// Rows of studies.
    pub rows: usize,
    /// Analyses, and answers of programs.
    pub analyses: usize,
}

/// Takes a run or a study from its folder, unless the database has it as it is. A damaged one is left out.
pub fn take(database: &mut Database, entry: &RunEntry, taken: &mut ImportCounts) -> anyhow::Result<()> {
    if entry.begun.is_empty() || entry.status == "Damaged" {
        return Ok(());
    }
    let stored = RunEntry { folder: absolute(&entry.path)?, ..entry.clone() };
    let line = serde_json::to_string(&stored)?;
    let key = (&stored.folder, &stored.begun);
    let known = database.connection.query_row(
        "SELECT entry FROM runs WHERE (folder, begun) = (?, ?)",
        params![key.0, key.1],
        |row| row.get::<_, String>(0),
    );
    let known = known.optional().map_err(|why| explained(&database.path, &why))?;
    if known.as_deref() == Some(&line) {
        return Ok(());
    }
    let directory = Directory::open(&entry.path)?;
    // Read before the change begins, for which other processes wait.
    let rows = if entry.kind == "study" { rows_of(&directory)? } else { vec![] };
    let new = database.change(|change| {
        let row = params![key.0, key.1, line, stored.text];
        change.execute("INSERT OR REPLACE INTO runs (folder, begun, entry, text) VALUES (?, ?, ?, ?)", row)?;
        let mut new = ImportCounts { entries: 1, rows: 0, analyses: 0 };
        let mut insert = change.prepare("INSERT OR IGNORE INTO study_rows VALUES (?, ?, ?, ?, ?, ?, ?)")?;
        for (phase, run, status, failure, numbers) in &rows {
            new.rows += insert.execute(params![key.0, key.1, phase, run, status, failure, numbers])?;
        }
        if entry.kind == "run" {
            new.analyses = take_analyses(change, &directory, &stored.text)?;
        }
        Ok(new)
    })?;
    taken.entries += new.entries;
    taken.rows += new.rows;
    taken.analyses += new.analyses;
    Ok(())
}

/// Phase, number, status, reason of a failure, and numbers by column, of each row of a study.
type StudyRow = (&'static str, i64, String, String, String);

fn rows_of(directory: &Directory) -> anyhow::Result<Vec<StudyRow>> {
    let (study, rows) = stored_study(directory)?;
    let all = rows.all().map(|row| {
        let phase = &study.phases()[row.phase];
        let numbers: Map<String, Value> = phase
            .columns
            .iter()
            .zip(&row.values)
            .map(|(column, value)| {
                let word = value.and_then(|v| column.words.get(v as usize));
                (column.name.clone(), word.map_or_else(|| Value::from(*value), |word| Value::from(word.as_str())))
            })
            .collect();
        (phase.name, row.run as i64, row.status.clone(), row.failure.clone(), Value::from(numbers).to_string())
    });
    Ok(all.collect())
}

/// Adds the responses of the last design of a run, and the answers of its program. Returns the number of new ones.
fn take_analyses(change: &Transaction<'_>, directory: &Directory, text: &str) -> anyhow::Result<usize> {
    let record = RunRecord::read(directory)?;
    let Ok(model) = model_file::read_of_run("model.toml", text) else { return Ok(0) };
    if model.program().is_some() {
        return take_answers(change, &model, Path::new(&record.file), directory);
    }
    let Some((design, responses)) = last_analysis(directory, &record.fingerprint) else { return Ok(0) };
    let name = format!("{:016x}", model.analysis_fingerprint());
    let design = &design[..model.variables().len().min(design.len())];
    let new = Record::of_responses(&responses).insert(change, &name, &record.versions.program, design)?;
    Ok(usize::from(new))
}

/// All runs and studies, the oldest first.
pub fn entries(database: &Database) -> anyhow::Result<Vec<RunEntry>> {
    let explain = |why: rusqlite::Error| explained(&database.path, &why);
    let mut select =
        database.connection.prepare("SELECT entry, text FROM runs ORDER BY begun, folder").map_err(explain)?;
    let rows = select.query_map([], |row| Ok((row.get::<_, String>(0)?, row.get::<_, String>(1)?))).map_err(explain)?;
    rows.map(|row| {
        let (entry, text) = row.map_err(explain)?;
        let entry: RunEntry = serde_json::from_str(&entry)
            .map_err(|why| anyhow::anyhow!("{} has a row that is not readable: {why}", database.path.display()))?;
        Ok(RunEntry { text, ..entry })
    })
    .collect()
}
