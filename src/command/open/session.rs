//! The model file of a server, its unsaved edits, and their state for pages.
//!
//! The file on disk is authoritative: it is read again whenever it changes. Text that is edited in a page is kept in `FILE.unsaved`
//! until it is saved. The model in force is the last one without errors.

use super::super::budget::Budget;
use super::super::model::{reject_study, with_program};
use super::super::run_directory::fingerprint;
use super::guard::message;
use super::optimization::{Optimization, RunRequest};
use super::process::WorkerCommand;
use super::queue::{Queue, Reply};
use super::stored;
use super::worker::{ModelLine, WorkerRequest};
use anyhow::{Context, bail};
use linkwright::model_file::{self, DiagnosticReport, Model, Severity, read, with_files};
use linkwright::problem::{Constraint, DesignVariable, Goal, Problem, TimeGrid};
use linkwright::report::outcome;
use linkwright::storage::{Directory, fnv1a};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};
use std::time::SystemTime;
use tokio::sync::watch;

/// Largest size of a model file in bytes.
const LIMIT: u64 = 2 << 20;
/// Beginning of the last line in the file of an edited text, before the hash of the text on disk that was edited.
const BASE: &str = "\n# linkwright: unsaved edit of the text with hash ";
/// Largest number of words that are offered to complete a text.
const OFFERED: usize = 60;

/// The session of a model file, shared by all pages.
pub struct Session {
    path: PathBuf,
    directory: Directory,
    name: String,
    project: Mutex<Project>,
    queue: Queue,
    optimization: Optimization,
    /// The run of another method on the same problem, for a race.
    rival: Optimization,
    /// Number of changes that pages have to read.
    news: watch::Sender<u64>,
}

/// The file and the model in force.
struct Project {
    /// Text on disk, and the time and the length by which a change is noticed. While the file cannot be read, its last text.
    disk: String,
    stamp: FileStamp,
    /// Hash of what was found on disk last.
    found: String,
    /// Reason why the file cannot be read. A file that is being replaced is missing for a moment, so the second failure counts.
    failure: Option<String>,
    failures: u32,
    /// Text that was edited in a page and is not saved.
    draft: Option<Draft>,
    /// Stamp of the file in which it is kept.
    draft_stamp: FileStamp,
    /// The edited text, or that on disk, with the files that it names.
    whole: Whole,
    /// Errors of the edited text, or of that on disk; `None` if it is the model in force.
    errors: Option<DiagnosticReport>,
    /// Text and fingerprint of the model in force.
    text: String,
    fingerprint: String,
    /// The description of the model in force for pages; `Null` if there has never been one.
    model: Value,
    /// Number of the model in force.
    revision: u64,
}

/// A text with the files that it names, or why they cannot be read.
type Whole = Result<String, Box<DiagnosticReport>>;

/// Edited text that is not saved.
struct Draft {
    text: String,
    /// Hash of the text on disk that was edited.
    base: String,
}

/// Time of change and length of a file, from which it is seen whether it has changed.
type FileStamp = Option<(SystemTime, u64)>;

fn stamp(path: &Path) -> FileStamp {
    path.metadata().ok().and_then(|data| Some((data.modified().ok()?, data.len())))
}

/// The answer to a request to save.
pub enum Saved {
    Done,
    /// The file on disk is not the one that was edited.
    Changed,
}

/// Number of failed reads of the file after which pages show the failure.
const FAILURES: u32 = 2;

impl Project {
    /// Stores the text on disk and its hash.
    fn take_disk(&mut self, text: String) {
        (self.found, self.disk) = (hash(&text), text);
        (self.failure, self.failures) = (None, 0);
    }

    /// Notes that the file cannot be read.
    fn fail(&mut self, why: &anyhow::Error) {
        let why = message(why);
        self.found = hash(&why);
        self.failures += 1;
        self.failure = (self.failures >= FAILURES).then_some(why);
    }
}

impl Session {
    /// Opens a model file. If it has errors, the page shows them.
    pub fn open(file: &Path, budget: Budget) -> anyhow::Result<Self> {
        let cannot = || format!("cannot read the model {}", file.display());
        let path = file.canonicalize().with_context(cannot)?;
        let (Some(parent), Some(name)) = (path.parent(), path.file_name()) else {
            bail!("{} is not a file; give a model file", file.display());
        };
        let name = name.to_str().with_context(|| format!("the name of {} is not UTF-8; rename it", file.display()))?;
        let directory = Directory::open(parent).with_context(cannot)?;
        let command = WorkerCommand::new(name, budget)?;
        let project = Project {
            disk: String::new(),
            stamp: None,
            found: String::new(),
            failure: None,
            failures: 0,
            draft: None,
            draft_stamp: None,
            whole: Ok(String::new()),
            errors: None,
            text: String::new(),
            fingerprint: String::new(),
            model: Value::Null,
            revision: 0,
        };
        let news = watch::Sender::new(0);
        let session = Self {
            name: name.to_owned(),
            directory,
            project: Mutex::new(project),
            queue: Queue::start(command.clone()),
            optimization: Optimization::new(news.clone(), budget, command.clone()),
            rival: Optimization::new(news.clone(), budget, command),
            news,
            path,
        };
        let text = session.read()?;
        reject_study(file, &text)?;
        session.project().take_disk(text);
        session.take_draft(&mut session.project())?;
        session.update(&mut session.project());
        Ok(session)
    }

    fn project(&self) -> MutexGuard<'_, Project> {
        self.project.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn read(&self) -> anyhow::Result<String> {
        let cannot = || format!("cannot read the model {}", self.path.display());
        let bytes = self.directory.read(&self.name, LIMIT).with_context(cannot)?.with_context(cannot)?;
        String::from_utf8(bytes).with_context(|| format!("the model {} is not UTF-8", self.path.display()))
    }

    /// Reads the file again if it has changed, and the files that it names.
    pub fn look_at_the_file(&self) {
        let stamp = stamp(&self.path);
        let mut project = self.project();
        let (before, failure) = (project.disk.clone(), project.failure.clone());
        if stamp.is_none() || stamp != project.stamp || project.failures > 0 {
            match self.read() {
                Ok(text) => {
                    project.stamp = stamp;
                    project.take_disk(text);
                }
                Err(error) => project.fail(&error),
            }
        }
        // Another server of the same file may have written it; an unreadable one is told at the next edit.
        let has_taken = self.take_draft(&mut project).unwrap_or(false);
        if project.draft.as_ref().is_some_and(|draft| draft.text == project.disk) {
            // Saved by another server, or written by another editor. A copy that cannot be removed now is ignored at the next start.
            drop(self.discard_of(&mut project));
        } else if has_taken
            || project.disk != before
            || project.failure != failure
            || self.whole(&project) != project.whole
        {
            self.update(&mut project);
        }
    }

    /// The edited text, or that on disk, with the files that it names: those of the folder of the model or below.
    fn whole(&self, project: &Project) -> Whole {
        let text = project.draft.as_ref().map_or(&project.disk, |draft| &draft.text);
        with_files(&self.path.display().to_string(), text, self.directory.path())
    }

    /// Writes an edited text, and the hash of the text on disk that was edited, to `FILE.unsaved` in the folder of the model.
    fn write_draft(&self, Draft { text, base }: &Draft) -> anyhow::Result<()> {
        let written = self.directory.replace(&self.unsaved(), format!("{text}{BASE}{base}\n").as_bytes(), true);
        written.with_context(|| format!("cannot write {}", self.unsaved()))
    }

    /// Name of the file with the unsaved text.
    fn unsaved(&self) -> String {
        format!("{}.unsaved", self.name)
    }

    /// Takes up the edited text of an earlier session or of another server, unless it is that of the file. Returns whether there is a new one.
    fn take_draft(&self, project: &mut Project) -> anyhow::Result<bool> {
        let unsaved = self.directory.path().join(self.unsaved());
        let cannot = || format!("cannot read {}", unsaved.display());
        let stamp = stamp(&unsaved);
        if stamp.is_some() && stamp == project.draft_stamp {
            return Ok(false);
        }
        let Some(bytes) = self.directory.read(&self.unsaved(), LIMIT).with_context(cannot)? else { return Ok(false) };
        project.draft_stamp = stamp;
        let text = String::from_utf8(bytes).with_context(cannot)?;
        // Without its last line it is not known which text was edited: saving asks before it replaces the file.
        let (text, base) = text.rsplit_once(BASE).unwrap_or((text.as_str(), ""));
        let is_new = text != project.disk && project.draft.as_ref().is_none_or(|draft| draft.text != text);
        if is_new {
            project.draft = Some(Draft { text: text.to_owned(), base: base.trim_end().to_owned() });
        }
        Ok(is_new)
    }

    /// Makes the edited text, or that on disk, the model in force, unless it has errors.
    fn update(&self, project: &mut Project) {
        let file = self.path.display().to_string();
        project.whole = self.whole(project);
        match project.whole.clone().and_then(|text| Ok((read(&file, &text)?, text))) {
            Ok((_, text)) if text == project.text => project.errors = None,
            Ok((model, text)) => {
                let model = with_program(model, &self.path);
                project.revision += 1;
                project.model = description(&model);
                (project.text, project.fingerprint) = (text.clone(), fingerprint(&model));
                project.errors = None;
                self.queue.set_model(Some(ModelLine { name: file.clone(), file, text }));
            }
            Err(report) => project.errors = Some(*report),
        }
        self.news.send_modify(|number| *number += 1);
    }

    /// Keeps an edited text in `FILE.unsaved` until it is saved. `edited` is the hash of the text that was edited, `base` that of the text
    /// on disk from which the edits began. Returns the hash of the text, or `None` if it would replace an edit of another page, also one of
    /// another server.
    pub fn edit(&self, text: String, edited: &str, base: String) -> anyhow::Result<Option<String>> {
        let mut project = self.project();
        if self.take_draft(&mut project)? {
            self.update(&mut project);
        }
        if project.draft.as_ref().is_some_and(|draft| draft.text != text && hash(&draft.text) != edited) {
            return Ok(None);
        }
        let kept = hash(&text);
        if text == project.disk {
            self.discard_of(&mut project)?;
        } else {
            let draft = Draft { text, base };
            self.write_draft(&draft)?;
            project.draft = Some(draft);
            self.update(&mut project);
        }
        Ok(Some(kept))
    }

    /// Drops the edited text.
    pub fn discard(&self) -> anyhow::Result<()> {
        self.discard_of(&mut self.project())
    }

    fn discard_of(&self, project: &mut Project) -> anyhow::Result<()> {
        if self.directory.entry(&self.unsaved())?.is_some() {
            self.directory.remove(&self.unsaved()).with_context(|| format!("cannot remove {}", self.unsaved()))?;
        }
        project.draft = None;
        self.update(project);
        Ok(())
    }

    /// Writes the text to the file, even with errors. A file that has changed since is replaced only if `over` is the hash of what was
    /// found on disk; one that is gone is written again.
    pub fn save(&self, over: Option<&str>) -> anyhow::Result<Saved> {
        let mut project = self.project();
        let is_gone = self.directory.entry(&self.name)?.is_none();
        match self.read() {
            Ok(text) => project.take_disk(text),
            Err(error) => project.fail(&error),
        }
        let (text, base) = match &project.draft {
            Some(draft) => (draft.text.clone(), draft.base.clone()),
            None if project.failures == 0 => return Ok(Saved::Done),
            None => (project.disk.clone(), hash(&project.disk)),
        };
        if !is_gone && base != project.found && over != Some(&project.found) {
            return Ok(Saved::Changed);
        }
        let written = self.directory.replace(&self.name, text.as_bytes(), true);
        written.with_context(|| format!("cannot write {}", self.path.display()))?;
        project.take_disk(text);
        self.discard_of(&mut project).map(|()| Saved::Done)
    }

    /// Passes an action to the optimization of the model in force. A rival ends with the run against which it began.
    pub fn optimize(&self, action: RunRequest) {
        if action.ends_run() {
            self.rival.act(RunRequest::Close, &self.path, "");
        }
        let text = self.project().text.clone();
        self.optimization.act(action, &self.path, &text);
    }

    /// Begins a rival of the optimization: a run of another method with the same model and start.
    pub fn race(&self, method: String) -> anyhow::Result<()> {
        let (text, design) = self.optimization.begin().context("begin a run first; the rival has its start")?;
        self.rival.act(RunRequest::Start { design, method: Some(method) }, &self.path, &text);
        Ok(())
    }

    /// Passes an action to the rival.
    pub fn steer_rival(&self, action: RunRequest) {
        self.rival.act(action, &self.path, "");
    }

    /// The optimization and its rival, and the settings of the model in force that state another problem than that of the run.
    pub fn run(&self) -> Value {
        let text = self.project().text.clone();
        let differing = self.optimization.begin().map(|(of_run, _)| stored::other_settings(&of_run, &text));
        json!({ "run": self.optimization.record(), "rival": self.rival.record(), "differing": differing.unwrap_or_default() })
    }

    /// The stored runs and studies of the model in force. Reads many files.
    pub fn stored(&self) -> Value {
        let (fingerprint, text) = {
            let project = self.project();
            (project.fingerprint.clone(), project.text.clone())
        };
        stored::list(&text, &fingerprint)
    }

    /// The rows of a stored study with the designs of the model in force.
    pub fn study(&self, folder: &str) -> anyhow::Result<Value> {
        let names = |model: &Value| -> Vec<String> {
            let all = model["variables"].as_array().into_iter().flatten();
            all.filter_map(|variable| variable["name"].as_str().map(str::to_owned)).collect()
        };
        let variables = names(&self.project().model);
        stored::study(folder, &variables)
    }

    /// The model in force, the text and its errors, as a page shows them.
    pub fn model(&self) -> Value {
        let project = self.project();
        let errors = project.errors.as_ref().map_or_else(Vec::new, diagnostics);
        let text = project.draft.as_ref().map_or(&project.disk, |draft| &draft.text);
        json!({
            "file": self.name,
            "revision": project.revision,
            "news": *self.news.borrow(),
            "model": project.model,
            "text": text,
            "edited": hash(text),
            "base": project.draft.as_ref().map_or_else(|| hash(&project.disk), |draft| draft.base.clone()),
            "found": project.found,
            "failure": project.failure,
            "is_unsaved": project.draft.is_some() || project.failure.is_some(),
            "has_changed": project.draft.as_ref().is_some_and(|draft| draft.base != project.found),
            "errors": errors,
        })
    }

    /// The number of changes, which pages wait for.
    pub fn news(&self) -> watch::Receiver<u64> {
        self.news.subscribe()
    }

    /// Analyses a design of a revision of the model, for a page.
    pub async fn analyze(&self, revision: u64, page: &str, request: WorkerRequest) -> Reply {
        if self.project().revision != revision {
            return Reply::Outdated;
        }
        self.queue.ask(page, request).await
    }

    /// Stops the analyses of a page.
    pub fn cancel(&self, page: &str) {
        self.queue.cancel(page);
    }
}

/// Completions of a text at a position, in UTF-16 units as browsers count.
pub fn completions(text: &str, at: usize) -> Value {
    let mut units = 0;
    let byte = text.char_indices().find(|(_, c)| {
        units += c.len_utf16();
        units > at
    });
    let found = model_file::completions(text, byte.map_or(text.len(), |(byte, _)| byte));
    let from = text.get(..found.from).map_or(0, |before| before.encode_utf16().count());
    let words = found.words.iter().take(OFFERED).map(|word| json!({ "text": word.text, "about": word.about }));
    json!({ "from": from, "words": words.collect::<Vec<_>>() })
}

/// The hash by which a page names the text that it has edited.
fn hash(text: &str) -> String {
    format!("{:016x}", fnv1a(text))
}

/// Diagnostics with their lines, from 1, and columns, from 0 in UTF-16 units as browsers count.
fn diagnostics(report: &DiagnosticReport) -> Vec<Value> {
    let place = |byte: usize| {
        let end = (0..=byte.min(report.text.len())).rev().find(|end| report.text.is_char_boundary(*end)).unwrap_or(0);
        let before = &report.text[..end];
        let line = before.rsplit('\n').next().unwrap_or_default();
        (before.matches('\n').count() + 1, line.encode_utf16().count(), before.encode_utf16().count())
    };
    let one = |d: &linkwright::model_file::Diagnostic| {
        // A page has only the text of the model itself: there, an attached file is represented by its name.
        let attached = report.attached_place(d);
        let named = attached.and_then(|(name, _)| Some((report.text.find(&format!("{name:?}"))?, name.len() + 2)));
        let span = named.map_or(d.span.clone(), |(start, length)| start..start + length);
        let message = attached.map_or(d.message.clone(), |(name, line)| format!("{name}:{line}: {}", d.message));
        let ((line, column, from), (.., to)) = (place(span.start), place(span.end));
        json!({
            "severity": if d.severity == Severity::Note { "note" } else { "error" },
            "message": message, "label": d.label, "help": d.help,
            "line": line, "column": column, "from": from, "to": to,
        })
    };
    report.diagnostics.iter().map(one).collect()
}

/// The parts of a model that a page needs to show controls and plots.
fn description(model: &Model) -> Value {
    // The start may not be possible to analyse, or take long.
    let problem = model.is_problem().then(|| model.unscaled_problem());
    let (problem, fault) = match problem {
        Some(Ok(problem)) => (Some(problem), None),
        Some(Err(error)) => (None, Some(model.locate(&error).map_or_else(|| error.to_string(), |r| r.to_string()))),
        None => (None, None),
    };
    let finite = |v: f64| v.is_finite().then_some(v);
    let variable = |v: &DesignVariable| json!({ "name": v.name, "unit": v.unit, "start": v.start, "lower": finite(v.lower), "upper": finite(v.upper) });
    let output = |((name, unit, grid), factor): ((&str, &str, Option<usize>), Option<f64>)| json!({ "name": name, "unit": unit, "changes": grid.is_some(), "factor": factor });
    let shown = |times: Vec<f64>| model.grid().map(|grid| times.iter().map(|&t| grid.shown(t)).collect::<Vec<_>>());
    let drawing_times = model.drawing_times().and_then(shown);
    let grid = |grid: &TimeGrid| {
        let factor = grid.unit_factors[0] / grid.unit_factors[1];
        json!({
            "name": grid.name, "unit": grid.unit, "points": grid.shown_points(), "variable": model.axis(), "factor": factor,
        })
    };
    json!({
        "title": model.title(),
        "variables": model.variables().iter().map(variable).collect::<Vec<_>>(),
        "outputs": model.output_names().zip(model.output_factors()).map(output).collect::<Vec<_>>(),
        "time": model.grid().map(grid),
        "drawing_times": drawing_times,
        "objective": problem.as_ref().map(objective),
        "constraints": problem.as_ref().map_or_else(Vec::new, constraints),
        "fault": fault,
    })
}

fn objective(problem: &Problem) -> Value {
    let objective = &problem.objective;
    json!({
        "name": objective.name, "unit": objective.unit, "goal": outcome::goal(problem),
        "is_peak": matches!(objective.goal, Goal::MinimizePeak(_)),
    })
}

fn constraints(problem: &Problem) -> Vec<Value> {
    let shown = |constraint: &Constraint, t| constraint.quantity.grid().map_or(t, |grid| problem.grids[grid].shown(t));
    let one = |j: usize| {
        let constraint: &Constraint = &problem.constraints[j];
        let relation = if constraint.is_equality() {
            "="
        } else if constraint.sign() < 0.0 {
            "≥"
        } else {
            "≤"
        };
        let follows = constraint.quantity.as_shifted_response(&problem.grids, &problem.start());
        // x(t) − f(t) is in the unit of x, which may be a label that the formula does not know.
        let unit = match (outcome::unit(problem, j), follows) {
            ("", Some(response)) => problem.responses[response].unit.as_str(),
            (unit, _) => unit,
        };
        json!({
            "name": outcome::name(problem, j), "unit": unit, "relation": relation,
            "output": constraint.quantity.as_response(), "changes": constraint.quantity.is_transient(), "follows": follows,
            "window": constraint.window.map(|window| window.map(|t| shown(constraint, t))),
        })
    };
    outcome::stated_constraints(problem).map(one).collect()
}
