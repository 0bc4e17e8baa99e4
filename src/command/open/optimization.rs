//! An optimization that is watched and steered: a thread that owns the folder of the run and does one trial step after another.
//!
//! The run is stored as `linkwright optimize` stores it, after each trial step, so that `resume`, `report` and `runs` can use it. A
//! trial step that is taken back, and a decision by hand, are recorded like edits of the model. The folder is claimed while the run goes
//! on; while it is paused, other processes can continue it, and the run is then read again before the next action. A step that is stopped
//! leaves the run as it was before.

use super::super::budget::Budget;
use super::super::model::located;
use super::super::optimize;
use super::super::run_directory::{RunDirectory, SettingChange};
use super::guard::message;
use super::process::{WorkerCommand, lock};
use super::steps::{RunSteps, StopHandle};
use super::stored::{self, cycles, is_of_limit, own};
use super::worker::{ModelLine, WorkerRequest};
use anyhow::{Context, anyhow, bail, ensure};
use linkwright::model_file::{Diagnostic, DiagnosticReport, Model, read, with_setting};
use linkwright::problem::Problem;
use linkwright::sao::{RunState, Status, presets};
use linkwright::storage::Directory;
use serde::Deserialize;
use serde_json::{Value, json};
use std::path::Path;
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::sync::{Arc, Mutex};
use tokio::sync::watch;

/// Largest number of trial steps that can be taken back.
const MEMORY: usize = 200;
/// The fault of an action other than a trial step that was stopped.
const STOPPED: &str = "it was stopped; the run is in its folder as it was before";

/// A request of a page about a run.
#[derive(Debug, Deserialize)]
#[serde(tag = "action", rename_all = "kebab-case", deny_unknown_fields)]
pub enum RunRequest {
    /// Analyses the design, and stores it as the start of a new run.
    Start {
        design: Vec<f64>,
        /// Preset in place of that of the model.
        #[serde(default)]
        method: Option<String>,
    },
    /// Continues a run of this model file from its folder.
    Resume {
        folder: String,
    },
    Run,
    Pause,
    /// Stops the trial step that is under way, or another action; the run rests as it was before.
    Stop,
    /// One trial step.
    Step,
    /// Takes the last trial step back.
    Back,
    /// Accepts the proposal that the method has rejected.
    Accept,
    /// Refuses the proposal that the method has accepted, and halves the move limits.
    Refuse,
    /// Gives a setting of the model another value: a bound, a key of the method, or a limit, with which a new run continues.
    Set {
        key: String,
        value: String,
    },
    /// Ends the run; its folder stays.
    Close,
}

impl RunRequest {
    /// True for an action after which there is no run, or another one.
    pub fn ends_run(&self) -> bool {
        match self {
            Self::Start { .. } | Self::Resume { .. } | Self::Close => true,
            // A change of a limit begins a new run.
            Self::Set { key, .. } => is_of_limit(key),
            _ => false,
        }
    }
}

/// A run of a session: none, or a thread with the run.
pub struct Optimization {
    published: Arc<Mutex<Published>>,
    thread: Mutex<Option<RunThread>>,
    news: watch::Sender<u64>,
    budget: Budget,
    command: WorkerCommand,
}

/// The thread of a run: what it is asked, and how its present step is stopped. It ends when this is dropped.
struct RunThread {
    /// Actions, with the number of stops before each.
    requests: Sender<(RunRequest, u64)>,
    stop: StopHandle,
}

impl Drop for RunThread {
    fn drop(&mut self) {
        self.stop.stop();
    }
}

/// Data of a run that are visible outside its thread.
#[derive(Default)]
struct Published {
    /// Number of the run in the session. A thread whose run has been closed or replaced publishes nothing any more.
    run: u64,
    /// The record for pages; `Null` without a run.
    record: Value,
    /// Text of its model.
    text: String,
}

impl Optimization {
    /// No run; `news` counts what pages have to read.
    pub fn new(news: watch::Sender<u64>, budget: Budget, command: WorkerCommand) -> Self {
        Self { published: Arc::default(), thread: Mutex::default(), news, budget, command }
    }

    /// The run as pages show it.
    pub fn record(&self) -> Value {
        lock(&self.published).record.clone()
    }

    /// Text of the model, with its edits, and start design of the run.
    pub fn begin(&self) -> Option<(String, Vec<f64>)> {
        let published = lock(&self.published);
        let design =
            published.record["cycles"][0]["design"].as_array()?.iter().map(Value::as_f64).collect::<Option<_>>();
        Some((published.text.clone(), design?))
    }

    /// Forgets the run, and returns the number of the next one.
    fn next_run(&self) -> u64 {
        let mut published = lock(&self.published);
        *published = Published { run: published.run + 1, ..Published::default() };
        published.run
    }

    /// Passes an action to the run; `file` and `text` are those of the model in force.
    pub fn act(&self, action: RunRequest, file: &Path, text: &str) {
        let mut thread = lock(&self.thread);
        let is_new = matches!(action, RunRequest::Start { .. } | RunRequest::Resume { .. });
        if is_new {
            let own = self.next_run();
            let (requests, receiver) = channel();
            let stop = StopHandle::default();
            let steps = RunSteps::new(self.command.clone(), stop.clone());
            let (published, news, budget) = (self.published.clone(), self.news.clone(), self.budget);
            let (file, text) = (file.to_owned(), text.to_owned());
            *thread = Some(RunThread { requests, stop });
            std::thread::spawn(move || {
                let publish = |record: Value, text: &str| {
                    let mut published = lock(&published);
                    if published.run != own {
                        return;
                    }
                    *published = Published { run: own, record, text: text.to_owned() };
                    drop(published);
                    news.send_modify(|number| *number += 1);
                };
                publish(json!({ "status": "Starting" }), "");
                match SteeredRun::begin(action, &file, &text, budget, steps) {
                    Ok(Some(run)) => run.serve(&receiver, &publish),
                    Ok(None) => publish(Value::Null, ""),
                    Err(error) => publish(json!({ "status": "Failed", "fault": message(&error) }), ""),
                }
            });
        } else if matches!(action, RunRequest::Close) {
            *thread = None;
            self.next_run();
            self.news.send_modify(|number| *number += 1);
        } else if let Some(thread) = &*thread {
            if matches!(action, RunRequest::Stop) {
                thread.stop.stop();
            }
            drop(thread.requests.send((action, thread.stop.stops())));
        }
    }
}

/// The model of a run with this text. Its program is in the folder of the model file with which the run began.
fn line_of(folder: &RunDirectory, text: &str) -> ModelLine {
    ModelLine { name: "model.toml".to_owned(), file: folder.record().file.clone(), text: text.to_owned() }
}

/// The error of a setting that was typed in a field of a page: it names the field, and no lines of the stored model.
fn of_field(key: &str, value: &str, error: &anyhow::Error) -> anyhow::Error {
    let report = error.chain().find_map(|cause| {
        let boxed = cause.downcast_ref::<Box<DiagnosticReport>>().map(|report| &**report);
        boxed.or_else(|| cause.downcast_ref::<DiagnosticReport>())
    });
    let in_words = |report: &DiagnosticReport| {
        let one = |d: &Diagnostic| {
            let label = if d.label.is_empty() { String::new() } else { format!(": {}", d.label) };
            let help = d.help.as_ref().map_or_else(String::new, |help| format!(" ({help})"));
            format!("{}{label}{help}", d.message)
        };
        report.diagnostics.iter().map(one).collect::<Vec<_>>().join("; ")
    };
    let why = report.map_or_else(|| format!("{error:#}"), in_words);
    let field = if key == "method.preset" { "Method" } else { "Setting" };
    anyhow!("field {field}, `{key}` = {value}: {why}")
}

/// A run with its folder.
struct SteeredRun {
    folder: RunDirectory,
    steps: RunSteps,
    /// The model as the worker reads it.
    line: ModelLine,
    model: Model,
    problem: Problem,
    state: RunState,
    /// True if this is the newest state of the worker.
    is_newest: bool,
    /// States before the last trial steps, the newest last.
    earlier: Vec<RunState>,
    is_running: bool,
    /// Error of the last action.
    fault: Option<String>,
    budget: Budget,
}

impl SteeredRun {
    /// A new run from a design, or a stored one; `None` if it was stopped.
    fn begin(
        action: RunRequest,
        file: &Path,
        text: &str,
        budget: Budget,
        steps: RunSteps,
    ) -> anyhow::Result<Option<Self>> {
        match action {
            RunRequest::Start { design, method } => Self::start(design, method.as_deref(), file, text, budget, steps),
            RunRequest::Resume { folder } => {
                Self::reopened(Directory::open(&stored::known(&folder)?.path)?, None, budget, steps)
            }
            _ => bail!("there is no run"),
        }
    }

    fn start(
        design: Vec<f64>,
        method: Option<&str>,
        file: &Path,
        text: &str,
        budget: Budget,
        mut steps: RunSteps,
    ) -> anyhow::Result<Option<Self>> {
        let name = file.display().to_string();
        let mut text = text.to_owned();
        if let Some(method) = method {
            text = with_setting(&name, &text, "method.preset", &json!(method).to_string())?;
        }
        let model = read(&name, &text)?;
        let variables = model.variables();
        ensure!(design.len() == variables.len(), "the design is not one of this model; load the page again");
        for (variable, value) in variables.iter().zip(&design).filter(|(variable, value)| **value != variable.start) {
            let key = format!("design.{}.start", variable.name);
            text = with_setting(&name, &text, &key, &model.written(&key, *value))?;
        }
        let line = ModelLine { name: name.clone(), file: name, text };
        let model = line.model()?;
        let problem = located(&model, model.problem())?;
        budget.check(&problem, model.method())?;
        let Some(mut state) = steps.done(&line, &WorkerRequest::Start)? else { return Ok(None) };
        let mut folder = optimize::next_folder(&model, &line.text, file)?;
        folder.save(&model, &problem, &mut state)?;
        Ok(Some(Self::paused((folder, steps), (line, model, problem), (state, true), budget)))
    }

    /// The run of a folder, with an edited model if there is one; `None` if it was stopped.
    fn reopened(
        directory: Directory,
        edited: Option<&str>,
        budget: Budget,
        mut steps: RunSteps,
    ) -> anyhow::Result<Option<Self>> {
        let (mut folder, _, text) = RunDirectory::claim(directory)?;
        if let Some(edited) = edited {
            folder.edit(edited)?;
        }
        let line = line_of(&folder, edited.unwrap_or(&text));
        let model = line.model()?;
        let problem = located(&model, model.problem())?;
        budget.check(&problem, model.method())?;
        let is_edited = folder.record().model != line.text;
        let state = match folder.resume(&model, &problem, &line.text, false)? {
            Some(state) => Some(state),
            None => steps.done(&line, &WorkerRequest::Start)?,
        };
        // A run that has ended stays so, unless its settings have changed.
        let state = match state {
            Some(state) if is_edited || state.status == Status::Running => {
                steps.done(&line, &WorkerRequest::Restart { state: Some(Box::new(state)) })?
            }
            state => state,
        };
        let Some(mut state) = state else { return Ok(None) };
        folder.save(&model, &problem, &mut state)?;
        Ok(Some(Self::paused((folder, steps), (line, model, problem), (state, false), budget)))
    }

    /// A run that is paused; its state is the newest one of the worker, or not.
    fn paused(
        (folder, steps): (RunDirectory, RunSteps),
        (line, model, problem): (ModelLine, Model, Problem),
        (state, is_newest): (RunState, bool),
        budget: Budget,
    ) -> Self {
        let (earlier, is_running, fault) = (vec![], false, None);
        Self { folder, steps, line, model, problem, state, is_newest, earlier, is_running, fault, budget }
    }

    /// Executes requests until the page closes the run or begins another one.
    fn serve(mut self, actions: &Receiver<(RunRequest, u64)>, publish: &dyn Fn(Value, &str)) {
        loop {
            if !self.is_running {
                self.folder.release();
            }
            publish(self.record(), &self.line.text);
            let asked = match actions.try_recv() {
                Ok(asked) => Some(asked),
                Err(TryRecvError::Disconnected) => return,
                Err(TryRecvError::Empty) if self.is_running => None,
                Err(TryRecvError::Empty) => match actions.recv() {
                    Ok(asked) => Some(asked),
                    Err(_) => return,
                },
            };
            let action = match asked {
                Some((action, stops_before)) => {
                    self.steps.begin_action(stops_before);
                    action
                }
                None => RunRequest::Step,
            };
            self.fault = None;
            // A step may take minutes: pages show that it is under way, and send no further request for a step.
            if !self.is_running && !matches!(action, RunRequest::Run | RunRequest::Pause | RunRequest::Stop) {
                let mut record = self.record();
                record["status"] = "Working".into();
                publish(record, &self.line.text);
            }
            let done = match (self.claimed(), action) {
                (Err(error), _) => Err(error),
                (Ok(()), RunRequest::Set { key, value }) => match self.changed(&key, &value) {
                    Ok(Ok(changed)) => {
                        self = changed;
                        Ok(())
                    }
                    Ok(Err(error)) => Err(error),
                    Err(error) => {
                        publish(json!({ "status": "Failed", "fault": message(&error) }), "");
                        return;
                    }
                },
                (Ok(()), other) => self.act(other),
            };
            self.is_running &= done.is_ok() && self.state.status == Status::Running;
            self.fault = done.err().map(|error| message(&error));
        }
    }

    /// Claims the folder, and reads the run again if another process has continued it.
    fn claimed(&mut self) -> anyhow::Result<()> {
        if !self.folder.reclaim()? {
            let directory = self.folder.folder().directory().clone();
            *self = Self::reopened(directory, None, self.budget, self.steps.anew())?.context(STOPPED)?;
        }
        Ok(())
    }

    fn act(&mut self, action: RunRequest) -> anyhow::Result<()> {
        match action {
            RunRequest::Run => self.is_running = self.state.status == Status::Running,
            RunRequest::Pause | RunRequest::Stop => self.is_running = false,
            RunRequest::Step => self.step()?,
            RunRequest::Back => self.back()?,
            RunRequest::Accept => self.accept()?,
            RunRequest::Refuse => self.refuse()?,
            RunRequest::Start { .. } | RunRequest::Resume { .. } | RunRequest::Set { .. } | RunRequest::Close => {}
        }
        Ok(())
    }

    /// The state after a request to the worker; `None` if it was stopped.
    fn done(&mut self, request: &WorkerRequest) -> anyhow::Result<Option<RunState>> {
        self.is_newest = false;
        self.steps.done(&self.line, request)
    }

    /// The state of the run for the worker; `None` if it has it.
    fn for_worker(&self) -> Option<Box<RunState>> {
        (!self.is_newest).then(|| Box::new(self.state.clone()))
    }

    /// One trial step, which is stored. If it is stopped, the run rests before it.
    fn step(&mut self) -> anyhow::Result<()> {
        ensure!(
            self.state.status == Status::Running,
            "the run has ended; change a setting or take a step back to continue"
        );
        let Some(after) = self.done(&WorkerRequest::Step { state: self.for_worker() })? else {
            self.is_running = false;
            return Ok(());
        };
        let before = std::mem::replace(&mut self.state, after);
        self.is_newest = true;
        // The end of a run may be found without another trial step.
        if self.state.history.len() > before.history.len() {
            self.earlier.push(before);
        }
        if self.earlier.len() > MEMORY {
            self.earlier.remove(0);
        }
        self.store()
    }

    fn store(&mut self) -> anyhow::Result<()> {
        let summary = self.folder.save(&self.model, &self.problem, &mut self.state)?;
        if self.state.status != Status::Running {
            self.folder.finish(&self.problem, &self.state, &summary)?;
        }
        Ok(())
    }

    fn back(&mut self) -> anyhow::Result<()> {
        let state = self.earlier.last().cloned().context("there is no step of this session to take back")?;
        self.replace(state.clone(), state, "trial step taken back")?;
        self.earlier.pop();
        Ok(())
    }

    /// Makes `state` that of the run. Its history continues that of `base`, a state of this run before its last trial step.
    fn replace(&mut self, mut base: RunState, mut state: RunState, decision: &str) -> anyhow::Result<()> {
        self.problem.check_design(&state.design).context("the bounds exclude the earlier design")?;
        (base.fingerprint, state.fingerprint) = (self.problem.fingerprint(), self.problem.fingerprint());
        let state = self.done(&WorkerRequest::Restart { state: Some(Box::new(state)) })?.context(STOPPED)?;
        let number = self.state.history.len() - 1;
        let change =
            SettingChange { key: decision.to_owned(), before: Some(format!("trial step {number}")), after: None };
        self.folder.rewind(&mut base, change)?;
        (self.state, self.is_newest) = (state, true);
        self.store()
    }

    fn refuse(&mut self) -> anyhow::Result<()> {
        let base = self.earlier.last().cloned().context("the proposal is not one of this session")?;
        let state = self.model.method().reject_accepted_step(&self.problem, base.clone(), &self.state)?;
        self.replace(base, state, "proposal refused by hand")
    }

    fn accept(&mut self) -> anyhow::Result<()> {
        let state = self.done(&WorkerRequest::Accept { state: self.for_worker() })?.context(STOPPED)?;
        let mut base = self.state.clone();
        base.history.pop();
        self.replace(base, state, "proposal accepted by hand")
    }

    /// The run with another value of a setting, or itself with the reason why the setting is refused. An error of the files
    /// ends the run.
    fn changed(&mut self, key: &str, value: &str) -> anyhow::Result<anyhow::Result<Self>> {
        if is_of_limit(key) {
            return Ok(self.continued(key, value).map_err(|error| of_field(key, value, &error)));
        }
        let checked = || {
            let is_own = key.starts_with("method.")
                || (key.starts_with("design.") && (key.ends_with(".lower") || key.ends_with(".upper")));
            ensure!(
                is_own,
                "during a run, only bounds, limits and the method can be changed; edit `{key}` in the file and begin a run at this design"
            );
            let text = with_setting("model.toml", &self.line.text, key, value)?;
            let model = line_of(&self.folder, &text).model()?;
            let problem = located(&model, model.problem())?;
            problem.check_design(&self.state.design).context("the bounds exclude the present design")?;
            model.method().check(&problem)?;
            self.budget.check(&problem, model.method())?;
            anyhow::Ok(text)
        };
        let text = match checked() {
            Ok(text) => text,
            Err(error) => return Ok(Err(of_field(key, value, &error))),
        };
        let directory = self.folder.folder().directory().clone();
        self.folder.release();
        let mut again = Self::reopened(directory, Some(&text), self.budget, self.steps.anew())?.context(STOPPED)?;
        again.earlier = std::mem::take(&mut self.earlier);
        again.is_running = self.is_running && again.state.status == Status::Running;
        Ok(Ok(again))
    }

    /// A run of the problem with another limit, from the present design in a folder of its own: the values of the steps before belong to the
    /// former problem. Its note says which run it continues, and with what.
    fn continued(&mut self, key: &str, value: &str) -> anyhow::Result<Self> {
        let text = with_setting("model.toml", &self.line.text, key, value)?;
        let changes: Vec<String> = self.folder.changes(&text)?.iter().map(ToString::to_string).collect();
        ensure!(!changes.is_empty(), "`{key}` has this value already");
        let file = Path::new(&self.folder.record().file);
        let design = own(&self.problem, &self.state.design);
        let run = Self::start(design, None, file, &text, self.budget, self.steps.anew())?;
        let mut run = run.context(STOPPED)?;
        run.is_running = self.is_running && run.state.status == Status::Running;
        let (before, tries) = (self.folder.folder().directory().path(), self.state.history.len() - 1);
        let note = format!("continues {} after {tries} trial steps, with {}", before.display(), changes.join("; "));
        RunDirectory::write_note(run.folder.folder().directory(), &note)?;
        Ok(run)
    }

    /// The run as pages show it.
    fn record(&mut self) -> Value {
        let folder = self.folder.folder().directory().path().display().to_string();
        let Self { problem, state, line, .. } = &*self;
        let own = |values: &[f64]| own(problem, values);
        let name = |row: linkwright::problem::RowId| problem.row_in_words(row);
        let last = state.history.last();
        let rows = last.and_then(|cycle| Some((cycle, cycle.prediction.as_ref()?))).map(|(cycle, prediction)| {
            let multiplier = |row| cycle.active.iter().find(|a| a.row == row).map(|a| a.multiplier);
            let rows = cycle.retained.iter().enumerate().map(|(i, row)| {
                json!({ "row": name(*row), "predicted": prediction.rows.get(i), "computed": prediction.analysed.get(i), "multiplier": multiplier(*row) })
            });
            rows.collect::<Vec<_>>()
        });
        let region = last.and_then(|cycle| cycle.region.as_ref());
        json!({
            "folder": folder,
            "status": if self.is_running { "Running".to_owned() } else if state.status == Status::Running { "Paused".to_owned() } else { format!("{:?}", state.status) },
            "reason": state.reason,
            "fault": self.fault,
            "design": own(&state.design),
            "cycles": cycles(problem, state),
            "rows": rows,
            "region": region.map(|region| json!({ "lower": own(&region.lower), "upper": own(&region.upper) })),
            "bounds": {
                "names": self.model.variables().iter().map(|v| &v.name).collect::<Vec<_>>(),
                "lower": own(&problem.variables.iter().map(|v| v.lower).collect::<Vec<_>>()),
                "upper": own(&problem.variables.iter().map(|v| v.upper).collect::<Vec<_>>()),
            },
            "factors": own(&state.factors),
            "method": linkwright::model_file::settings("", &line.text).ok().and_then(|all| all.get("method.preset").map(|name| name.trim_matches('"').to_owned())),
            "methods": presets().iter().map(|preset| preset.name).collect::<Vec<_>>(),
            "analyses": state.counters.analyses, "sensitivity_analyses": state.counters.sensitivity_analyses,
            "edits": self.folder.record().edits,
            "can_go_back": !self.earlier.is_empty(),
        })
    }
}
