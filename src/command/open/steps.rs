//! The steps of a run, which a worker does, so that one that takes long can be stopped.

use super::process::{Worker, WorkerCommand, WorkerProcess, lock};
use super::worker::{ModelLine, RunAnswer, WorkerRequest};
use anyhow::{Context, bail};
use linkwright::sao::RunState;
use std::sync::{Arc, Mutex};

/// The worker of a run.
pub struct RunSteps {
    command: WorkerCommand,
    /// With its model. `None` before the first step, and after a stopped one.
    worker: Option<(ModelLine, Worker)>,
    stop: StopHandle,
}

/// Stops the step that is under way, from another thread.
#[derive(Clone, Default)]
pub struct StopHandle(Arc<Mutex<Underway>>);

#[derive(Default)]
struct Underway {
    process: Option<WorkerProcess>,
    is_stopped: bool,
}

impl StopHandle {
    /// Stops the step that is under way, if there is one.
    pub fn stop(&self) {
        let mut underway = lock(&self.0);
        if let Some(process) = &underway.process {
            process.kill();
            underway.is_stopped = true;
        }
    }
}

impl RunSteps {
    /// Steps by workers that `command` starts, until `stop` stops one.
    pub fn new(command: WorkerCommand, stop: StopHandle) -> Self {
        Self { command, worker: None, stop }
    }

    /// Steps with the same command and stop, by a new worker.
    pub fn anew(&self) -> Self {
        Self::new(self.command.clone(), self.stop.clone())
    }

    /// The state after a request about a run of a model; `None` if it was stopped.
    pub fn done(&mut self, model: &ModelLine, request: &WorkerRequest) -> anyhow::Result<Option<RunState>> {
        let (model, mut worker) = match self.worker.take() {
            Some((of, worker)) if of == *model => (of, worker),
            _ => (model.clone(), self.command.start(model).context("the process of the run cannot be started")?),
        };
        *lock(&self.stop.0) = Underway { process: Some(worker.process()), is_stopped: false };
        let line = worker.answer(request);
        let Underway { is_stopped, .. } = std::mem::take(&mut *lock(&self.stop.0));
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
