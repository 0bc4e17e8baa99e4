//! The folder of a study. `docs/studies.md` has the files.
//!
//! Rows are appended to `rows.jsonl` as runs end, each with a single write. When a study ends, the file is replaced by one with the rows in their
//! order, so that its bytes do not depend on the number of threads and on interruptions.

use crate::command::output::now;
use crate::command::output_folder::{MANIFEST, Occupied, OutputFolder, RUN, STUDY};
use crate::command::run_directory::{FolderLock, LOCK, changes};
use anyhow::{Context, bail};
use linkwright::model_file::{toml_string, with_setting};
use linkwright::report::page::{Page, PageSection};
use linkwright::report::table::Table;
use linkwright::storage::{Appender, Directory};
use linkwright::study::{Conclusions, Part, Row, RowHeader, Rows, Study, VERSION};
use serde::{Deserialize, Serialize};
use std::io;
use std::time::{Duration, Instant};

/// The rows.
pub const ROWS: &str = "rows.jsonl";
/// The page.
pub const PAGE: &str = "report.html";
/// The conclusions.
pub const SUMMARY: &str = "summary.json";
/// Copies of the study file and of the model with the settings of the study.
const FILES: [&str; 2] = ["study.toml", "model.toml"];
/// Tables of rows by phases, and of conclusions.
const TABLES: [&str; 12] = [
    "runs",
    "derivatives",
    "worst-case",
    "limits",
    "samples",
    "summary",
    "optima",
    "methods",
    "front",
    "moments",
    "reliability",
    "indices",
];
/// Largest sizes that are read.
const RECORD_LIMIT: u64 = 8 << 20;
const ROWS_LIMIT: u64 = 1 << 36;
/// Time between two flushes of rows to disk. A kill loses nothing; a power cut loses at most the rows of this time.
const FLUSH: Duration = Duration::from_secs(1);

/// `study.json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct StudyRecord {
    /// Version of the folder.
    pub version: u32,
    /// Version of linkwright.
    pub program: String,
    /// Title.
    pub title: String,
    /// Checksum of the settings of study and model.
    pub study: String,
    /// Number of the part and number of parts.
    pub part: [usize; 2],
    /// Runs of each phase.
    pub runs: Vec<usize>,
    /// Path of the study file as given.
    pub file: String,
    /// Start time in UTC.
    pub begun: String,
}

/// Progress of a study.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyProgress {
    /// Number of runs, of this part if it is one.
    pub runs: usize,
    /// Number of those that have ended.
    pub done: usize,
    /// Number of those that have failed.
    pub failed: usize,
}

impl StudyRecord {
    /// The progress in a folder.
    pub fn progress(&self, directory: &Directory) -> anyhow::Result<StudyProgress> {
        let place = directory.path().join(ROWS);
        let bytes = directory.read(ROWS, ROWS_LIMIT).with_context(|| format!("cannot read {}", place.display()))?;
        let rows = Rows::read(&place.display().to_string(), &bytes.unwrap_or_default(), &self.runs)?.rows;
        let part = Part { number: self.part[0], of: self.part[1].max(1) };
        let runs = self.runs.iter().map(|runs| (0..*runs).filter(|run| part.has(*run)).count()).sum();
        Ok(StudyProgress { runs, done: rows.len(), failed: rows.all().filter(|row| row.has_failed()).count() })
    }

    /// Reads the record of a folder; `None` if it has none.
    pub fn read(directory: &Directory) -> anyhow::Result<Option<Self>> {
        let place = directory.path().join(STUDY);
        let bytes = directory.read(STUDY, RECORD_LIMIT).with_context(|| format!("cannot read {}", place.display()))?;
        let Some(bytes) = bytes else { return Ok(None) };
        let record: Self =
            serde_json::from_slice(&bytes).with_context(|| format!("{} is not readable", place.display()))?;
        anyhow::ensure!(
            record.version == VERSION,
            "{} has version {}, expected {VERSION}",
            place.display(),
            record.version
        );
        Ok(Some(record))
    }
}

/// A claimed folder of a study, with its rows.
pub struct StudyFolder {
    folder: OutputFolder,
    header: RowHeader,
    appender: Appender,
    flushed: Instant,
    /// True if the rows in the file are in their order.
    is_sorted: bool,
    _claim: FolderLock,
}

/// A row file that was read.
struct StoredFile {
    rows: Rows,
    /// Bytes up to the end of the last complete line.
    length: u64,
    is_sorted: bool,
}

impl StudyFolder {
    /// Begins a study in a folder, or continues it. Returns the rows that are there.
    ///
    /// A folder with another study or with other files is rejected with [`Occupied`]; with `force`, an earlier study is removed.
    pub fn open(
        directory: Directory,
        study: &Study,
        part: Part,
        file: &str,
        force: bool,
    ) -> anyhow::Result<(Self, Rows)> {
        let claim = FolderLock::of(&directory)?;
        match Self::begin(&directory, study, part, file, force) {
            Ok((folder, rows)) => {
                let (header, place) = (study.header(), folder.place(ROWS));
                let appender = explained(&place, directory.appender(ROWS))?;
                let mut opened =
                    Self { folder, header, appender, flushed: Instant::now(), is_sorted: false, _claim: claim };
                let rows = opened.restore(rows)?;
                Ok((opened, rows))
            }
            Err(error) => {
                claim.withdraw(&directory);
                Err(error)
            }
        }
    }

    /// Checks the folder, and writes the record and the copies of a new study, or reads the rows of a study that is continued.
    fn begin(
        directory: &Directory,
        study: &Study,
        part: Part,
        file: &str,
        force: bool,
    ) -> anyhow::Result<(OutputFolder, Option<StoredFile>)> {
        let mut folder = OutputFolder::of(directory.clone())?;
        let own = own_files();
        directory.remove_temporary(&own.iter().map(String::as_str).chain([MANIFEST]).collect::<Vec<_>>())?;
        let known = StudyRecord::read(directory)?.filter(|_| !force);
        let header = study.header();
        if let Some(record) = known {
            check_continued(&record, directory, study, part)?;
            let rows = stored(directory, study)?;
            return Ok((folder, rows));
        }
        check_replaceable(&folder, force)?;
        folder.check_free(&own)?;
        folder.remove(&own)?;
        folder.own(&[&FILES[..], &[STUDY, ROWS]].concat())?;
        let copy = runnable(study);
        for (name, text) in FILES.into_iter().zip([&copy, &study.source().text]) {
            explained(&folder.place(name), directory.replace(name, text.as_bytes(), true))?;
        }
        let record = StudyRecord {
            version: VERSION,
            program: env!("CARGO_PKG_VERSION").to_owned(),
            title: study.title().to_owned(),
            study: header.study,
            part: [part.number, part.of],
            runs: study.runs(),
            file: file.to_owned(),
            begun: now()?,
        };
        let text = serde_json::to_string_pretty(&record)?;
        explained(&folder.place(STUDY), directory.replace(STUDY, text.as_bytes(), true))?;
        Ok((folder, None))
    }

    /// Removes an incomplete line that a kill left at the end of the row file; writes the header of a new file.
    fn restore(&mut self, stored: Option<StoredFile>) -> anyhow::Result<Rows> {
        let place = self.folder.place(ROWS);
        match stored {
            Some(StoredFile { rows, length, is_sorted }) => {
                if explained(&place, self.appender.length())? > length {
                    explained(&place, self.appender.cut(length))?;
                }
                self.is_sorted = is_sorted;
                Ok(rows)
            }
            None => {
                explained(&place, self.appender.cut(0))?;
                explained(&place, self.appender.append(self.header.line().as_bytes()))?;
                Ok(Rows::default())
            }
        }
    }

    /// Appends a row.
    pub fn append(&mut self, row: &Row) -> anyhow::Result<()> {
        let place = self.folder.place(ROWS);
        self.is_sorted = false;
        explained(&place, self.appender.append(row.line().as_bytes()))?;
        if self.flushed.elapsed() >= FLUSH {
            self.flush()?;
        }
        Ok(())
    }

    /// Flushes the rows to disk.
    pub fn flush(&mut self) -> anyhow::Result<()> {
        self.flushed = Instant::now();
        explained(&self.folder.place(ROWS), self.appender.flush())
    }

    /// Puts the rows into their order.
    pub fn sort(&mut self, rows: &Rows) -> anyhow::Result<()> {
        if self.is_sorted {
            return Ok(());
        }
        let text = rows.text(&self.header);
        explained(&self.folder.place(ROWS), self.folder.directory().replace(ROWS, text.as_bytes(), true))
    }

    /// Writes a table as `NAME.csv`, and as `NAME.parquet` with the feature `parquet`.
    pub fn write_table(&mut self, name: &str, table: &Table) -> anyhow::Result<()> {
        self.write(&format!("{name}.csv"), table.csv().as_bytes())?;
        #[cfg(feature = "parquet")]
        self.write(&format!("{name}.parquet"), &table.parquet()?)?;
        Ok(())
    }

    /// Writes the page.
    pub fn write_page(&mut self, study: &Study, rows: &Rows, conclusion: &Conclusions) -> anyhow::Result<()> {
        self.write(PAGE, page(study, rows, conclusion).html()?.as_bytes())
    }

    /// Writes a file as a whole.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
        self.folder.own(&[name])?;
        explained(&self.folder.place(name), self.folder.directory().replace(name, bytes, false))
    }

    /// Its path, for messages.
    pub fn shown(&self) -> String {
        self.folder.directory().path().display().to_string()
    }
}

/// Rejects the folder of another study, or of another part of the study, with [`Occupied`].
fn check_continued(record: &StudyRecord, directory: &Directory, study: &Study, part: Part) -> anyhow::Result<()> {
    let shown = directory.path().display();
    if record.study != study.header().study {
        let changed = differences(directory, study)?;
        let why = format!(
            "{shown} has another study in it; give another folder with --out, or replace it with --force. What differs: {changed}"
        );
        return Err(Occupied(why).into());
    }
    if record.part != [part.number, part.of] {
        let why = format!(
            "{shown} has part {}/{} of this study; give another folder with --out",
            record.part[0], record.part[1]
        );
        return Err(Occupied(why).into());
    }
    Ok(())
}

/// Rejects a folder with files that are not those of a study, or with results that would be lost, with [`Occupied`]; with `force` only
/// one that has a run in it.
fn check_replaceable(folder: &OutputFolder, force: bool) -> anyhow::Result<()> {
    let directory = folder.directory();
    let shown = directory.path().display();
    let is_foreign = |name: &String| name != LOCK && !folder.owns(name);
    let names = directory.names().with_context(|| format!("cannot read {shown}"))?;
    if names.iter().any(|name| name == RUN) || (!force && names.iter().any(is_foreign)) {
        let why = format!("{shown} is not empty and has no study in it; give another folder with --out");
        return Err(Occupied(why).into());
    }
    match folder.lost_results()?.filter(|_| !force) {
        Some(lost) => {
            let why = format!("{lost}, give another folder with --out, or replace it with --force");
            Err(Occupied(why).into())
        }
        None => Ok(()),
    }
}

/// The page: what the study answers, tables, failures, and the files.
fn page(study: &Study, rows: &Rows, conclusion: &Conclusions) -> Page {
    let tables = study.phases().iter().map(|phase| (format!("{}.csv", phase.name), "rows as a table".to_owned()));
    let files = tables.chain([
        (ROWS.to_owned(), "rows as they are stored".to_owned()),
        (SUMMARY.to_owned(), "the result as JSON".to_owned()),
        ("study.toml".to_owned(), "the study file".to_owned()),
        ("model.toml".to_owned(), "the model".to_owned()),
    ]);
    let listing = PageSection::new("files", "Files").links(files).listing("the study file", runnable(study));
    study.page(rows, conclusion).with(listing).foot(format!(
        "Written by linkwright {}. The page is self-contained: it can be sent and stored as one file.",
        env!("CARGO_PKG_VERSION")
    ))
}

/// Names of all files that a study of any kind writes.
fn own_files() -> Vec<String> {
    let tables = TABLES.iter().flat_map(|name| [format!("{name}.csv"), format!("{name}.parquet")]);
    FILES.iter().chain(&[STUDY, ROWS, PAGE, SUMMARY]).map(|name| (*name).to_owned()).chain(tables).collect()
}

/// The row file of a folder; `None` without a complete header.
fn stored(directory: &Directory, study: &Study) -> anyhow::Result<Option<StoredFile>> {
    let place = directory.path().join(ROWS);
    let bytes = directory.read(ROWS, ROWS_LIMIT).with_context(|| format!("cannot read {}", place.display()))?;
    let bytes = bytes.unwrap_or_default();
    let read = Rows::read(&place.display().to_string(), &bytes, &study.runs())?;
    let Some(header) = read.header else { return Ok(None) };
    let expected = study.header();
    if header != expected {
        bail!(
            "{} belongs to another study: it has the checksum {}, expected {}; restore the file, or start anew with --force",
            place.display(),
            header.study,
            expected.study
        );
    }
    let is_sorted = read.rows.text(&header).as_bytes() == bytes;
    Ok(Some(StoredFile { rows: read.rows, length: read.length as u64, is_sorted }))
}

/// The rows of a finished or unfinished part, for `merge`.
pub fn read_rows(directory: &Directory, study: &Study) -> anyhow::Result<Rows> {
    let shown = directory.path().display();
    let record = StudyRecord::read(directory)?.with_context(|| format!("{shown} has no study in it"))?;
    if record.study != study.header().study {
        bail!("{shown} has another study than the first folder. What differs: {}", differences(directory, study)?);
    }
    Ok(stored(directory, study)?.map_or_else(|| study.no_rows(), |stored| stored.rows))
}

/// The copies of study file and model in a folder.
pub fn copies(directory: &Directory) -> anyhow::Result<[String; 2]> {
    let read = |name: &str| -> anyhow::Result<String> {
        let place = directory.path().join(name);
        let bytes = directory.read(name, RECORD_LIMIT).with_context(|| format!("cannot read {}", place.display()))?;
        let bytes = bytes.with_context(|| format!("there is no {}", place.display()))?;
        String::from_utf8(bytes).with_context(|| format!("{} is not UTF-8", place.display()))
    };
    Ok([read(FILES[0])?, read(FILES[1])?])
}

/// The study file with the copy of the model as its model, so that both copies in a folder are a study that can be run.
fn runnable(study: &Study) -> String {
    let text = &study.file().text;
    with_setting(FILES[0], text, "model", &toml_string(FILES[1])).unwrap_or_else(|_| text.clone())
}

/// The settings in which a stored study differs.
fn differences(directory: &Directory, study: &Study) -> anyhow::Result<String> {
    let [file, model] = copies(directory)?;
    let mut all = vec![];
    for (name, before, after) in [("study", file, &study.file().text), ("model", model, &study.source().text)] {
        // The copy of the study names that of the model.
        let all_changes = changes(&before, after)?;
        let own = all_changes.iter().filter(|change| name != "study" || change.key != "model");
        all.extend(own.map(|change| format!("{name}: {change}")));
    }
    Ok(all.join("; "))
}

/// Adds the name of the file and the remedy to an error.
fn explained<T>(place: &std::path::Path, done: io::Result<T>) -> anyhow::Result<T> {
    done.with_context(|| {
        format!("cannot write {}; finished runs are kept: free disk space, or make the folder writable, then give the same command again", place.display())
    })
}
