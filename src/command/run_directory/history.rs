//! `history.jsonl`: the events of a run, a line for each. Lines are appended; those of trial steps that are taken back are removed.
//!
//! | `event` | content |
//! |---|---|
//! | `begin` | versions and the hash of the model file |
//! | `cycle` | an accepted or rejected trial step |
//! | `edit` | an edit of the model before the run continued, or a decision by hand |
//! | `end` | the summary |
//!
//! A line is flushed to disk before the state that refers to it. The state names the part of the file up to its last cycle: length
//! and hash. When a run continues, lines of cycles after that part are removed; these cycles are computed again, with the same bits.

use super::records::{ModelEdit, Prefix, RunRecord, Summary, Versions, cycle_line};
use crate::command::output::argument;
use anyhow::{Context, bail};
use linkwright::sao::{Cycle, RunState};
use linkwright::storage::{Appender, Directory, Fnv1a};
use serde::Serialize;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};

/// Name of the file.
pub const HISTORY: &str = "history.jsonl";
/// Largest length of a line in bytes.
const LINE: usize = 1 << 30;

/// A history that was read.
#[derive(Default)]
pub struct RunHistory {
    /// Its cycles.
    pub cycles: Vec<Cycle>,
    /// The part up to the last of them.
    pub prefix: Prefix,
    /// Length and hash of the lines that are kept.
    length: u64,
    hash: Fnv1a,
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
    edit: &'e ModelEdit,
}

impl RunHistory {
    /// Reads the history of a folder: the part of a state with the lines after it that are not cycles, or all of it.
    pub fn read(directory: &Directory, wanted: Option<&Prefix>) -> anyhow::Result<Self> {
        let place = directory.path().join(HISTORY);
        let read = Self::first(directory, wanted.map_or(usize::MAX, |wanted| wanted.cycles))?;
        if let Some(wanted) = wanted.filter(|wanted| **wanted != read.prefix) {
            bail!(
                "{} is not the history of the state: it has {} cycles in {} bytes with hash {}, expected {} in {} bytes with {}",
                place.display(),
                read.prefix.cycles,
                read.prefix.bytes,
                read.prefix.hash,
                wanted.cycles,
                wanted.bytes,
                wanted.hash
            );
        }
        Ok(read)
    }

    /// Reads the first cycles of the history of a folder, with the lines after them that are not cycles.
    pub fn first(directory: &Directory, most: usize) -> anyhow::Result<Self> {
        let place = directory.path().join(HISTORY);
        let mut read = Self::default();
        let unreadable = || format!("cannot read {}", place.display());
        if let Some(file) = directory.reader(HISTORY).with_context(unreadable)? {
            let mut reader = BufReader::new(file);
            while let Some(line) = complete_line(&mut reader, &place)? {
                let is = |event: &str| line.starts_with(format!("{{\"event\":\"{event}\"").as_bytes());
                if is("cycle") && read.cycles.len() >= most {
                    break;
                }
                read.take(&line, is("cycle"), is("edit"), &place)?;
            }
        }
        Ok(read)
    }

    /// Adds a line with its end.
    fn take(&mut self, line: &[u8], is_cycle: bool, is_edit: bool, place: &Path) -> anyhow::Result<()> {
        self.add(line);
        self.edits += usize::from(is_edit);
        self.last = String::from_utf8_lossy(&line[..line.len() - 1]).into_owned();
        if is_cycle {
            let cycle = serde_json::from_slice(line);
            self.cycles.push(cycle.with_context(|| {
                format!("{}: the line of trial step {} is not readable", place.display(), self.cycles.len())
            })?);
            self.end_prefix(self.cycles.len());
        }
        Ok(())
    }

    fn add(&mut self, bytes: &[u8]) {
        self.hash.add(bytes);
        self.length += bytes.len() as u64;
    }

    fn end_prefix(&mut self, cycles: usize) {
        self.prefix = Prefix { cycles, bytes: self.length, hash: format!("{:016x}", self.hash.value()) };
    }
}

/// The next line with its end; `None` at the end of the file. An incomplete last line, which a kill may leave, is ignored.
fn complete_line(reader: &mut impl BufRead, place: &Path) -> anyhow::Result<Option<Vec<u8>>> {
    let mut line = vec![];
    loop {
        let part = reader.fill_buf().with_context(|| format!("cannot read {}", place.display()))?;
        if part.is_empty() {
            return Ok(None);
        }
        let end = part.iter().position(|byte| *byte == b'\n');
        let part = &part[..end.map_or(part.len(), |end| end + 1)];
        line.extend_from_slice(part);
        let count = part.len();
        // JSON has no control characters. Reading stops at the first of them, as in a sparse file.
        let is_text = part[..count - usize::from(end.is_some())].iter().all(|byte| *byte >= b' ');
        anyhow::ensure!(
            is_text && line.len() <= LINE,
            "{} is not a file with a line of JSON for each event",
            place.display()
        );
        reader.consume(count);
        if end.is_some() {
            return Ok(Some(line));
        }
    }
}

/// The history file of a run of this process.
pub struct HistoryFile {
    place: PathBuf,
    file: Appender,
    read: RunHistory,
}

impl HistoryFile {
    /// Opens the file of a history that was read; removes all bytes that are not a part of it.
    pub fn open(directory: &Directory, mut read: RunHistory) -> anyhow::Result<Self> {
        let place = directory.path().join(HISTORY);
        let open = || {
            let file = directory.appender(HISTORY)?;
            if file.length()? > read.length {
                file.cut(read.length)?;
            }
            Ok(file)
        };
        let file = explained(&place, open())?;
        read.cycles = vec![];
        Ok(Self { place, file, read })
    }

    /// True if the file has no line of another process.
    #[cfg(feature = "app")]
    pub fn is_whole(&self) -> bool {
        self.file.length().is_ok_and(|length| length == self.read.length)
    }

    /// Appends the cycles and edits that are not in the file yet, and flushes them. Returns the part up to the last cycle.
    pub fn update(&mut self, run: &RunRecord, state: &RunState) -> anyhow::Result<&Prefix> {
        let mut lines = vec![];
        if self.read.length == 0 {
            let RunRecord { versions, fingerprint, input, .. } = run;
            lines.push((serde_json::to_string(&BeginLine { event: "begin", versions, fingerprint, input })?, None));
        }
        for (k, cycle) in state.history.iter().enumerate().skip(self.read.prefix.cycles) {
            lines.push((cycle_line(cycle)?, Some(k + 1)));
        }
        for edit in run.edits.iter().skip(self.read.edits) {
            lines.push((serde_json::to_string(&EditLine { event: "edit", edit })?, None));
        }
        self.append(lines)?;
        self.read.edits = run.edits.len();
        Ok(&self.read.prefix)
    }

    /// Appends the summary, unless it is the last line already.
    pub fn end(&mut self, summary: &Summary) -> anyhow::Result<()> {
        let line = serde_json::to_string(summary)?;
        if line == self.read.last { Ok(()) } else { self.append(vec![(line, None)]) }
    }

    /// Appends lines; the line of a cycle comes with the number of cycles up to it.
    fn append(&mut self, lines: Vec<(String, Option<usize>)>) -> anyhow::Result<()> {
        let Some((last, _)) = lines.last() else { return Ok(()) };
        self.read.last = last.clone();
        let mut bytes = vec![];
        for (line, cycles) in lines {
            let begin = bytes.len();
            bytes.extend_from_slice(line.as_bytes());
            bytes.push(b'\n');
            self.read.add(&bytes[begin..]);
            if let Some(cycles) = cycles {
                self.read.end_prefix(cycles);
            }
        }
        let written = self.file.append(&bytes).and_then(|()| self.file.flush());
        explained(&self.place, written)
    }
}

/// Adds the name of the file and the remedy to an error.
pub fn explained<T>(place: &Path, done: std::io::Result<T>) -> anyhow::Result<T> {
    done.with_context(|| {
        let folder: PathBuf = place.parent().unwrap_or(place).to_owned();
        format!(
            "cannot write {}; earlier cycles are kept: free disk space, or make the folder writable, then `linkwright resume {}`",
            place.display(),
            argument(&folder.display().to_string())
        )
    })
}
