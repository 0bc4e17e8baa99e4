//! Worker processes of the server: how they are started, asked and stopped.

use super::super::budget::Budget;
use super::super::model::programs_are_allowed;
use super::worker::{ModelLine, WorkerRequest};
use anyhow::Context;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Mutex, MutexGuard};

/// The content of a lock. No panic leaves it inconsistent.
pub fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// The command that starts a worker: this program.
#[derive(Clone)]
pub struct WorkerCommand {
    program: PathBuf,
    arguments: Vec<String>,
}

impl WorkerCommand {
    /// The command for the model file with this name.
    pub fn new(name: &str, budget: Budget) -> anyhow::Result<Self> {
        let program = std::env::current_exe().context("cannot find the program linkwright itself")?;
        let bytes = budget.bytes().to_string();
        let mut arguments = ["open", "--worker", name, "--memory", &bytes].map(str::to_owned).to_vec();
        if programs_are_allowed() {
            arguments.push("--allow-programs".to_owned());
        }
        Ok(Self { program, arguments })
    }

    /// A worker for a model.
    pub fn start(&self, model: &ModelLine) -> std::io::Result<Worker> {
        let mut command = Command::new(&self.program);
        command.args(&self.arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut process = command.spawn()?;
        let closed = || std::io::Error::other("its standard input or output is closed");
        let mut input = process.stdin.take().ok_or_else(closed)?;
        let output = BufReader::new(process.stdout.take().ok_or_else(closed)?);
        writeln!(input, "{}", serde_json::to_string(model)?)?;
        Ok(Worker { process: WorkerProcess(Arc::new(Mutex::new(process))), input, output })
    }
}

/// The process of a worker, by which another thread stops it.
#[derive(Clone)]
pub struct WorkerProcess(Arc<Mutex<Child>>);

impl WorkerProcess {
    /// Ends the process. Programs that it has started end with it.
    pub fn kill(&self) {
        drop(lock(&self.0).kill());
    }
}

/// A worker with its model.
pub struct Worker {
    process: WorkerProcess,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
}

impl Worker {
    /// Its process.
    pub fn process(&self) -> WorkerProcess {
        self.process.clone()
    }

    /// The answer to a request; `None` if the worker has ended.
    pub fn answer(&mut self, request: &WorkerRequest) -> Option<String> {
        let request = serde_json::to_string(request).ok()?;
        writeln!(self.input, "{request}").and_then(|()| self.input.flush()).ok()?;
        let mut line = String::new();
        self.output.read_line(&mut line).ok()?;
        line.ends_with('\n').then_some(line)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.process.kill();
        drop(lock(&self.process.0).wait());
    }
}
