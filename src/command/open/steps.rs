//! The steps of a run, which a worker does, so that one that takes long can be stopped.

use super::process::{Worker, WorkerCommand, WorkerProcess, lock};
use super::worker::{ModelLine, RunAnswer, WorkerRequest};
use anyhow::{Context, bail};
use linkwright::sao::RunState;
use std::sync::{Arc, Mutex};

/// The worker of a run.
pub struct RunSteps {
    command: WorkerCommand,
    /// With its model. `None` before the first step, and after one that was stopped while it was under way.
    worker: Option<(ModelLine, Worker)>,
    stop: StopHandle,
    /// Number of stops before the action that is being done: a later one stops its steps, also before they begin.
    stops_before: u64,
}

/// Stops the action that is under way, from another thread.
#[derive(Clone, Default)]
pub struct StopHandle(Arc<Mutex<Underway>>);

#[derive(Default)]
struct Underway {
    process: Option<WorkerProcess>,
    /// Number of stops so far.
    stops: u64,
}

impl StopHandle {
    /// Stops the actions that were asked for until now.
    pub fn stop(&self) {
        let mut underway = lock(&self.0);
        underway.stops += 1;
        if let Some(process) = &underway.process {
            process.kill();
        }
    }

    /// Number of stops so far.
    pub fn stops(&self) -> u64 {
        lock(&self.0).stops
    }
}

impl RunSteps {
    /// Steps by workers that `command` starts, until `stop` stops one.
    pub fn new(command: WorkerCommand, stop: StopHandle) -> Self {
        let stops_before = stop.stops();
        Self { command, worker: None, stop, stops_before }
    }

    /// Begins an action that was asked for after this many stops.
    pub fn begin_action(&mut self, stops_before: u64) {
        self.stops_before = stops_before;
    }

    /// Steps with the same command and stop, by a new worker.
    pub fn anew(&self) -> Self {
        Self { worker: None, command: self.command.clone(), stop: self.stop.clone(), ..*self }
    }

    /// The state after a request about a run of a model; `None` if it was stopped.
    pub fn done(&mut self, model: &ModelLine, request: &WorkerRequest) -> anyhow::Result<Option<RunState>> {
        let (model, mut worker) = match self.worker.take() {
            Some((of, worker)) if of == *model => (of, worker),
            _ => (model.clone(), self.command.start(model).context("the process of the run cannot be started")?),
        };
        {
            let mut underway = lock(&self.stop.0);
            if underway.stops > self.stops_before {
                self.worker = Some((model, worker));
                return Ok(None);
            }
            underway.process = Some(worker.process());
        }
        let line = worker.answer(request);
        let is_stopped = {
            let mut underway = lock(&self.stop.0);
            underway.process = None;
            underway.stops > self.stops_before
        };
        let Some(line) = line.filter(|_| !is_stopped) else {
            if is_stopped {
                return Ok(None);
            }
            bail!(
                "the process of the run ended unexpectedly; the last stored step is kept, and another one can be tried"
            );
        };
        self.worker = Some((model, worker));
        match serde_json::from_str(&line)? {
            RunAnswer::State(state) => Ok(Some(*state)),
            RunAnswer::Error(why) => bail!(why),
        }
    }
}
