//! The directory of a run. `docs/results.md` has the files, the order in which they are written, and what a reader may rely on.
//!
//! | file | content |
//! |---|---|
//! | `state_file` | `state.json`: the state with its checksum |
//! | `history` | `history.jsonl`: the events of the run |
//! | `records` | `run.json` and `summary.json` |
//! | `lock` | the claim of a folder |
//!
//! A kill at any moment leaves the previous cycle: lines of the history are flushed before the state that refers to them, and the
//! state is replaced atomically.

mod history;
mod lock;
mod records;
mod state_file;

pub use lock::{FolderLock, LOCK};
pub use records::{
    ModelEdit, NamedValue, Nearest, RunRecord, SUMMARY, SettingChange, Summary, changes, fingerprint, shown_cycle,
};

use super::budget::Sizes;
use super::model::{located, parsed, with_program};
use super::output::{argument, complain};
use super::output_folder::{MANIFEST, Occupied, OutputFolder, RUN, STUDY};
use super::tables;
use anyhow::{Context, bail};
use history::{HISTORY, HistoryFile, RunHistory, explained};
use linkwright::model_file::Model;
use linkwright::problem::Problem;
#[cfg(feature = "database")]
use linkwright::problem::Responses;
use linkwright::sao::RunState;
use linkwright::storage::{Appender, Directory};
use state_file::{PREVIOUS, STATE, StoredState};
use std::path::Path;

/// The copy of the model.
pub const MODEL: &str = "model.toml";
/// File name of the page.
pub const PAGE: &str = "report.html";
const CYCLES: &str = "cycles.csv";
const RESPONSES: &str = "responses.csv";
const CONSTRAINTS: &str = "constraints.csv";
/// Answers of the program of a model.
pub const ANSWERS: &str = "answers.jsonl";
/// A note of the user about the run. It belongs to the user: no list has it, and a new run in the folder leaves it.
pub const NOTE: &str = "note.txt";
/// Largest size of a note in bytes.
const NOTE_LIMIT: u64 = 64 << 10;
/// Largest size of a state that is read without its problem.
#[cfg(feature = "database")]
const STATE_LIMIT: u64 = 1 << 30;
/// Files that every run writes, from its start on.
const FIRST: [&str; 6] = [STATE, HISTORY, CYCLES, SUMMARY, MODEL, RUN];
/// Files that a run may write. The state comes first, since a history without its state cannot be continued.
const FILES: [&str; 14] = [
    STATE,
    PREVIOUS,
    HISTORY,
    CYCLES,
    SUMMARY,
    RESPONSES,
    CONSTRAINTS,
    ANSWERS,
    "cycles.parquet",
    "responses.parquet",
    "constraints.parquet",
    PAGE,
    MODEL,
    RUN,
];

/// The directory of a run.
pub struct RunDirectory {
    folder: OutputFolder,
    record: RunRecord,
    /// Lock and growing files, while this process runs in the folder.
    active: Option<Active>,
}

struct Active {
    /// `None` while other processes may run in the folder.
    claim: Option<FolderLock>,
    history: Option<HistoryFile>,
    cycles: Option<CycleTable>,
    /// Number of trial steps in the stored state.
    stored: Option<usize>,
    /// The stored state.
    text: String,
}

/// `cycles.csv`, to which rows are appended.
struct CycleTable {
    file: Appender,
    rows: usize,
}

/// The state of a run, with the history that was read for it.
pub struct LastState {
    pub state: RunState,
    history: RunHistory,
    is_old: bool,
}

impl RunDirectory {
    /// Claims a folder for a new run, and then inspects it: a folder in which a process runs, one with a run, and one
    /// with other people's files are rejected. With `force`, an earlier run is replaced when the new one begins, and other files stay.
    pub fn reserve(directory: Directory, force: bool) -> anyhow::Result<Reserved> {
        let claim = FolderLock::of(&directory)?;
        match inspected(&directory, force) {
            Ok(folder) => Ok(Reserved { folder, claim }),
            Err(error) => {
                claim.withdraw(&directory);
                Err(error)
            }
        }
    }

    /// Begins a run in a folder that is [reserved](Self::reserve) for it.
    #[cfg(test)]
    pub fn create(directory: Directory, model: &Model, text: &str, file: &Path, force: bool) -> anyhow::Result<Self> {
        Self::reserve(directory, force)?.begin(model, text, file)
    }

    /// Opens the folder of an existing run to read it, with its model and the text of the model.
    pub fn open(path: &Path) -> anyhow::Result<(Self, Model, String)> {
        Self::read(super::output_folder::opened(path)?)
    }

    /// Locks the folder of an existing run against other processes, then opens it.
    pub fn claim(directory: Directory) -> anyhow::Result<(Self, Model, String)> {
        RunRecord::read(&directory)?;
        let claim = FolderLock::of(&directory)?;
        remove_temporary(&directory)?;
        let (mut opened, model, text) = Self::read(directory)?;
        opened.folder.check_free(&FILES)?;
        opened.active = Some(Active::new(claim));
        Ok((opened, model, text))
    }

    /// Reads the run of an open folder.
    pub fn read(directory: Directory) -> anyhow::Result<(Self, Model, String)> {
        let record = RunRecord::read(&directory)?;
        let mut folder = OutputFolder::of(directory)?;
        if !folder.has_list() {
            folder.accept_earlier(&FILES);
        }
        let (model, text) = parsed(folder.directory(), MODEL)?;
        // The program is in the folder of the model file with which the run began.
        let model = with_program(model.copied_from(&record.file), Path::new(&record.file));
        if fingerprint(&model) != record.fingerprint {
            let file = folder.place(MODEL);
            let all = changes(&record.model, &text)?;
            let forbidden: Vec<&SettingChange> = all.iter().filter(|change| !change.may_be_edited()).collect();
            let shown = if forbidden.is_empty() { all.iter().collect() } else { forbidden };
            let different: Vec<String> = shown.iter().map(ToString::to_string).collect();
            bail!(
                "{} has another problem than the run; title, bounds and [method] may be edited. What differs: {}. \
                 `linkwright optimize {}` begins a new run",
                file.display(),
                different.join("; "),
                argument(&file.display().to_string())
            );
        }
        if let Some(program) = located(&model, model.program_analysis())? {
            program.read_answers_from(folder.directory(), ANSWERS)?;
        }
        Ok((Self { folder, record, active: None }, model, text))
    }

    /// The folder, to write a report into it.
    pub fn folder(&mut self) -> &mut OutputFolder {
        &mut self.folder
    }

    /// The state with which the run continues, or `None` if the start design has not been analysed. With `previous` it is the state before
    /// the last one.
    ///
    /// # Errors
    /// If the bounds of the problem exclude its design.
    pub fn continued(&self, model: &Model, problem: &Problem, previous: bool) -> anyhow::Result<Option<LastState>> {
        let last = if previous {
            let offered = self.stored(PREVIOUS, model, problem)?;
            Some(offered.with_context(|| format!("there is no {}", self.folder.place(PREVIOUS).display()))?)
        } else {
            self.last(model, problem)?
        };
        let Some(last) = last else {
            for v in model.variables() {
                let is_inside = (v.lower..=v.upper).contains(&v.start);
                anyhow::ensure!(is_inside, "the bounds exclude the start of `{}`, {} {}", v.name, v.start, v.unit);
            }
            return Ok(None);
        };
        for (v, at) in problem.variables.iter().zip(&last.state.design) {
            anyhow::ensure!(
                (v.lower..=v.upper).contains(at),
                "the bounds exclude the last accepted design, with `{}` at {at} {}: widen them, or begin a new run with `linkwright optimize`",
                v.name,
                v.unit
            );
        }
        Ok(Some(last))
    }

    /// The last state of the run, or `None` if the start design has not been analysed. Records edits of the model.
    ///
    /// With `previous` it is the state before the last one.
    pub fn resume(
        &mut self,
        model: &Model,
        problem: &Problem,
        text: &str,
        previous: bool,
    ) -> anyhow::Result<Option<RunState>> {
        let last = self.continued(model, problem, previous)?;
        let Some(LastState { state, history, is_old }) = last else {
            // The start design is analysed again, and its line written again.
            self.open_history(RunHistory::read(self.folder.directory(), Some(&records::Prefix::default()))?)?;
            return Ok(None);
        };
        self.record_edit(&state, text)?;
        self.open_history(history)?;
        if let Some(active) = self.active.as_mut().filter(|_| !previous && !is_old) {
            active.stored = Some(state.history.len());
        }
        Ok(Some(state))
    }

    /// The last state of the run, or `None` if the start design has not been analysed. Bounds may have changed since.
    pub fn last(&self, model: &Model, problem: &Problem) -> anyhow::Result<Option<LastState>> {
        let previous = || self.stored(PREVIOUS, model, problem);
        match self.stored(STATE, model, problem) {
            Ok(Some(last)) => Ok(Some(last)),
            // The process was killed between the two renamings of a save, or is between them now; then the state is there when it is read again.
            Ok(None) => match previous()? {
                Some(last) => Ok(Some(self.stored(STATE, model, problem)?.unwrap_or(last))),
                None => self.no_state().map(|()| None),
            },
            Err(error) => {
                let path = self.folder.directory().path().display();
                let remedy = match previous() {
                    Ok(Some(older)) => format!(
                        "the state before it, after {} trial steps, is intact: `linkwright resume {} --previous` continues from it",
                        older.state.history.len() - 1,
                        argument(&path.to_string())
                    ),
                    _ => format!(
                        "no older state is intact; restore the folder, or start anew with `linkwright optimize FILE --force --out {}`",
                        argument(&path.to_string())
                    ),
                };
                bail!("{error:#}; {remedy}")
            }
        }
    }

    /// Rejects a history without a state, except that of the start design: a kill may have come before its state was written.
    fn no_state(&self) -> anyhow::Result<()> {
        let history = RunHistory::read(self.folder.directory(), None)?;
        anyhow::ensure!(
            history.cycles.len() <= 1,
            "{} is missing, but {} has {} cycles; restore it, or start anew with `linkwright optimize FILE --force --out {}`",
            self.folder.place(STATE).display(),
            self.folder.place(HISTORY).display(),
            history.cycles.len(),
            argument(&self.folder.directory().path().display().to_string())
        );
        Ok(())
    }

    /// A state file with its part of the history, if both fit to the problem; `None` if the file does not exist.
    fn stored(&self, name: &str, model: &Model, problem: &Problem) -> anyhow::Result<Option<LastState>> {
        let place = self.folder.place(name);
        let directory = self.folder.directory();
        let limit = Sizes::of(problem, model.method()).state_limit();
        let fits = |result: linkwright::Result<RunState>| result.with_context(|| format!("{}", place.display()));
        match state_file::read(directory, name, &self.record.fingerprint, limit)? {
            None => Ok(None),
            Some(StoredState::Bound(state, prefix)) => {
                let mut history = RunHistory::read(directory, Some(&prefix))?;
                let state = fits(state.complete(Some(std::mem::take(&mut history.cycles)), problem))?;
                Ok(Some(LastState { state, history, is_old: false }))
            }
            Some(StoredState::Old(state)) => {
                let state = fits(state.complete(None, problem))?;
                let history = RunHistory::read(directory, None)?;
                check_old(&place, problem, &state, &history)?;
                Ok(Some(LastState { state, history, is_old: true }))
            }
        }
    }

    fn record_edit(&mut self, state: &RunState, text: &str) -> anyhow::Result<()> {
        let before = &self.record.model;
        if before == text {
            return Ok(());
        }
        let new = text.lines().filter(|line| !before.lines().any(|old| old == *line)).map(str::to_owned);
        let edit =
            ModelEdit { after_tries: state.history.len() - 1, lines: new.collect(), changes: changes(before, text)? };
        self.record.edits.push(edit);
        self.record.model = text.to_owned();
        self.write_record()
    }

    /// Settings of the model with other values than before.
    pub fn changes(&self, text: &str) -> anyhow::Result<Vec<SettingChange>> {
        changes(&self.record.model, text)
    }

    /// Replaces the copy of the model by an edited one of the same problem.
    pub fn edit(&self, text: &str) -> anyhow::Result<()> {
        self.replace(MODEL, text.as_bytes())
    }

    /// `run.json`.
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    /// Lets the program of a model, if it has one, find the answers of this run in the folder and add all further ones.
    pub fn keep_answers(&mut self, model: &Model) -> anyhow::Result<()> {
        let Some(program) = located(model, model.program_analysis())? else { return Ok(()) };
        self.own_answers()?;
        Ok(program.keep_answers_in(self.folder.directory(), ANSWERS)?)
    }

    /// Adds the file of answers to the files of the run.
    pub fn own_answers(&mut self) -> anyhow::Result<()> {
        self.folder.own(&[ANSWERS])
    }

    /// Appends the cycles that are not in the files yet, and writes the state and the summary. Returns the summary.
    pub fn save(&mut self, model: &Model, problem: &Problem, state: &mut RunState) -> anyhow::Result<Summary> {
        self.save_state(state)?;
        let summary = Summary::new(model, problem, state, &self.record.edits);
        self.save_cycles(problem, state)?;
        self.replace_unflushed(SUMMARY, serde_json::to_string_pretty(&summary)?.as_bytes())?;
        Ok(summary)
    }

    /// History first, then the state that refers to it. The former state becomes the previous one.
    fn save_state(&mut self, state: &mut RunState) -> anyhow::Result<()> {
        let Some(active) = &mut self.active else { return Ok(()) };
        let Some(history) = &mut active.history else { return Ok(()) };
        let prefix = history.update(&self.record, state)?;
        let text = state_file::sealed(state, &self.record.fingerprint, prefix)?;
        if text == active.text {
            return Ok(());
        }
        if active.stored.is_some_and(|stored| stored != state.history.len()) {
            self.folder.own(&[PREVIOUS])?;
            let renamed = self.folder.directory().rename(STATE, PREVIOUS);
            explained(&self.folder.place(PREVIOUS), renamed)?;
        }
        let written = self.folder.directory().replace(STATE, text.as_bytes(), true);
        explained(&self.folder.place(STATE), written)?;
        (active.stored, active.text) = (Some(state.history.len()), text);
        Ok(())
    }

    /// Makes an earlier state that of the run, and records why. The state is written before the later cycles are removed from the
    /// history, so that a kill leaves a state with its history.
    #[cfg(feature = "app")]
    pub fn rewind(&mut self, state: &mut RunState, reason: SettingChange) -> anyhow::Result<()> {
        let after_tries = state.history.len() - 1;
        self.record.edits.push(ModelEdit { after_tries, lines: vec![], changes: vec![reason] });
        self.write_record()?;
        let directory = self.folder.directory();
        let history = RunHistory::first(directory, state.history.len())?;
        let text = state_file::sealed(state, &self.record.fingerprint, &history.prefix)?;
        explained(&self.folder.place(STATE), directory.replace(STATE, text.as_bytes(), true))?;
        explained(&self.folder.place(PREVIOUS), directory.remove(PREVIOUS))?;
        self.open_history(history)?;
        if let Some(active) = &mut self.active {
            (active.cycles, active.stored, active.text) = (None, Some(state.history.len()), text);
        }
        Ok(())
    }

    /// Replaces the note about the run of a folder; an empty text removes it.
    #[cfg(feature = "app")]
    pub fn write_note(directory: &Directory, text: &str) -> anyhow::Result<()> {
        anyhow::ensure!(text.len() as u64 <= NOTE_LIMIT, "a note has at most {NOTE_LIMIT} bytes");
        let text = text.trim();
        let done =
            if text.is_empty() { directory.remove(NOTE) } else { directory.replace(NOTE, text.as_bytes(), true) };
        explained(&directory.path().join(NOTE), done)
    }

    /// Lets other processes run in the folder until this one claims it again.
    #[cfg(feature = "app")]
    pub fn release(&mut self) {
        if let Some(active) = &mut self.active {
            active.claim = None;
        }
    }

    /// Claims a released folder again. Returns `false`, without a claim, if another process has written to it since.
    #[cfg(feature = "app")]
    pub fn reclaim(&mut self) -> anyhow::Result<bool> {
        let directory = self.folder.directory();
        let Some(active) = self.active.as_mut().filter(|active| active.claim.is_none()) else { return Ok(true) };
        let claim = FolderLock::of(directory)?;
        let limit = active.text.len() as u64 + 1;
        let is_same = directory.read(STATE, limit).is_ok_and(|text| text.as_deref() == Some(active.text.as_bytes()))
            && active.history.as_ref().is_some_and(HistoryFile::is_whole);
        active.claim = is_same.then_some(claim);
        Ok(is_same)
    }

    /// Appends rows to the table of cycles. The first time, the table is written as a whole.
    fn save_cycles(&mut self, problem: &Problem, state: &RunState) -> anyhow::Result<()> {
        let place = self.folder.place(CYCLES);
        let Some(active) = &mut self.active else { return Ok(()) };
        match &mut active.cycles {
            Some(table) => {
                let rows = tables::cycles(problem, state, table.rows)?.csv_rows();
                explained(&place, table.file.append(rows.as_bytes()))?;
                table.rows = state.history.len();
            }
            none => {
                let text = tables::cycles(problem, state, 0)?.csv();
                explained(&place, self.folder.directory().replace(CYCLES, text.as_bytes(), false))?;
                let file = explained(&place, self.folder.directory().appender(CYCLES))?;
                *none = Some(CycleTable { file, rows: state.history.len() });
            }
        }
        Ok(())
    }

    /// Writes the results of a run that has ended.
    pub fn finish(&mut self, problem: &Problem, state: &RunState, summary: &Summary) -> anyhow::Result<()> {
        let responses = tables::responses(problem, &state.responses)?;
        let constraints = tables::constraints(problem, &state.design, &state.evaluation)?;
        self.folder.own(&[RESPONSES, CONSTRAINTS])?;
        self.replace(RESPONSES, responses.csv().as_bytes())?;
        self.replace(CONSTRAINTS, constraints.csv().as_bytes())?;
        #[cfg(feature = "parquet")]
        for (name, table) in
            [("cycles", tables::cycles(problem, state, 0)?), ("responses", responses), ("constraints", constraints)]
        {
            let file = format!("{name}.parquet");
            self.folder.own(&[&file])?;
            self.replace(&file, &table.parquet()?)?;
        }
        self.replace(SUMMARY, serde_json::to_string_pretty(summary)?.as_bytes())?;
        let history = self.active.as_mut().and_then(|active| active.history.as_mut());
        history.map_or(Ok(()), |history| history.end(summary))
    }

    fn open_history(&mut self, history: RunHistory) -> anyhow::Result<()> {
        let file = HistoryFile::open(self.folder.directory(), history)?;
        if let Some(active) = &mut self.active {
            active.history = Some(file);
        }
        Ok(())
    }

    fn write_record(&self) -> anyhow::Result<()> {
        self.replace(RUN, serde_json::to_string_pretty(&self.record)?.as_bytes())
    }

    /// Replaces a file and flushes it to disk.
    fn replace(&self, name: &str, content: &[u8]) -> anyhow::Result<()> {
        explained(&self.folder.place(name), self.folder.directory().replace(name, content, true))
    }

    /// Replaces a file that can be computed again; the system flushes it to disk later.
    fn replace_unflushed(&self, name: &str, content: &[u8]) -> anyhow::Result<()> {
        explained(&self.folder.place(name), self.folder.directory().replace(name, content, false))
    }
}

/// A claimed folder in which a run is to begin. Nothing in it has been changed yet.
pub struct Reserved {
    folder: OutputFolder,
    claim: FolderLock,
}

impl Reserved {
    /// Its path.
    pub fn path(&self) -> &Path {
        self.folder.directory().path()
    }

    /// Returns `true` if the run replaces an earlier one.
    pub fn has_run(&self) -> anyhow::Result<bool> {
        let directory = self.folder.directory();
        Ok(directory.entry(RUN)?.is_some() || self.folder.lost_results()?.is_some())
    }

    /// Removes the files of an earlier run, and begins the new one.
    pub fn begin(mut self, model: &Model, text: &str, file: &Path) -> anyhow::Result<RunDirectory> {
        let record = RunRecord::new(model, text, file)?;
        let old: Vec<&str> = FILES.into_iter().filter(|name| *name != RUN && *name != MODEL).collect();
        self.folder.remove(&old)?;
        self.folder.own(&FIRST)?;
        let mut created = RunDirectory { folder: self.folder, record, active: Some(Active::new(self.claim)) };
        created.replace(MODEL, text.as_bytes())?;
        created.write_record()?;
        created.open_history(RunHistory::default())?;
        Ok(created)
    }

    /// Gives the folder back as it was.
    pub fn withdraw(self) {
        self.claim.withdraw(self.folder.directory());
    }
}

impl Active {
    fn new(claim: FolderLock) -> Self {
        Self { claim: Some(claim), history: None, cycles: None, stored: None, text: String::new() }
    }
}

/// The last accepted design of a run with its responses; `None` without an intact state of this version.
#[cfg(feature = "database")]
pub fn last_analysis(directory: &Directory, fingerprint: &str) -> Option<(Vec<f64>, Responses)> {
    match state_file::read(directory, STATE, fingerprint, STATE_LIMIT) {
        Ok(Some(StoredState::Bound(state, _))) => Some((state.design, state.responses)),
        _ => None,
    }
}

/// The note about the run of a folder: one line for each line of its text. `None` without one that can be read.
pub fn note(directory: &Directory) -> Option<String> {
    let bytes = directory.read(NOTE, NOTE_LIMIT).ok().flatten()?;
    let text = String::from_utf8(bytes).ok()?;
    let text = text.trim();
    (!text.is_empty()).then(|| text.to_owned())
}

/// Removes temporary files that a kill left. Those of a page may belong to a report that is being written.
fn remove_temporary(directory: &Directory) -> anyhow::Result<()> {
    let names: Vec<&str> = FILES.into_iter().filter(|name| *name != PAGE).chain([NOTE, MANIFEST]).collect();
    explained(&directory.path().join(MANIFEST), directory.remove_temporary(&names))
}

/// Inspects a claimed folder in which a run is to begin, without changing it.
fn inspected(directory: &Directory, force: bool) -> anyhow::Result<OutputFolder> {
    let shown = directory.path().display();
    remove_temporary(directory)?;
    let names = directory.names().with_context(|| format!("cannot read {shown}"))?;
    if names.iter().any(|name| name == STUDY) {
        return Err(Occupied(format!("{shown} has a study in it; give another folder")).into());
    }
    let has_run = names.iter().any(|name| name == RUN);
    let mut folder = OutputFolder::of(directory.clone())?;
    if has_run && !force {
        let remedy = "give another folder, or start anew in this one with --force";
        let why = format!(
            "{shown} has a run in it; continue it with `linkwright resume {}`, {remedy}",
            argument(&shown.to_string())
        );
        return Err(Occupied(why).into());
    }
    if let Some(lost) = folder.lost_results()?.filter(|_| !force) {
        return Err(Occupied(format!("{lost}, give another folder, or replace the run with --force")).into());
    }
    if has_run && !folder.has_list() {
        RunRecord::read(directory)?;
        folder.accept_earlier(&FILES);
    }
    let is_foreign = |name: &String| name != LOCK && !folder.owns(name);
    if !force && names.iter().any(is_foreign) {
        bail!(
            "{shown} is not empty and has no run in it; give another folder, or write next to the files in it with --force"
        );
    }
    folder.check_free(&FILES)?;
    Ok(folder)
}

/// Checks a state of an earlier version, which has no checksum: its responses are computed again, its history is compared.
fn check_old(place: &Path, problem: &Problem, state: &RunState, history: &RunHistory) -> anyhow::Result<()> {
    let shown = place.display();
    let again = problem.analyze(&state.design).with_context(|| format!("{shown}: its design cannot be analysed"))?;
    let near = |(one, other): (&Vec<f64>, &Vec<f64>)| {
        let scale = one.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        one.iter().zip(other).all(|(a, b)| (a - b).abs() <= 1e-6 * scale)
    };
    if !again.values.iter().zip(&state.responses.values).all(near) {
        bail!("{shown} is the state of another model: the responses of its design are not those of this model");
    }
    if !state.history.starts_with(&history.cycles) {
        bail!("{shown} and the history next to it are of different runs");
    }
    complain(&format!(
        "note: {shown} was written by an earlier version and has no checksum. Its shape and the responses of its design were \
         checked; objectives and errors of earlier cycles, move limits and stored derivatives were not."
    ));
    Ok(())
}
