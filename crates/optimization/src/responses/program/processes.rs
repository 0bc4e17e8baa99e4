//! Several running programs, of which each answers one request at a time.

use super::ExternalProgram;
use super::process::Process;
use super::protocol::{self, Answer, Declared, Refusal};
use error::{Error, Result};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Up to `jobs` processes of a program. A process is started when all others are busy, and kept for the next request.
pub struct Processes {
    program: ExternalProgram,
    longest: usize,
    state: Mutex<Busy>,
    freed: Condvar,
    next: AtomicU64,
}

#[derive(Default)]
struct Busy {
    idle: Vec<Process>,
    busy: usize,
}

impl Processes {
    pub fn new(program: ExternalProgram, declared: &Declared) -> Self {
        let longest = protocol::longest(declared);
        Self { program, longest, state: Mutex::default(), freed: Condvar::new(), next: AtomicU64::new(1) }
    }

    /// The program and its arguments.
    pub fn command(&self) -> &[String] {
        &self.program.command
    }

    /// The answer of the program at a design.
    ///
    /// # Errors
    /// [`Error::Analysis`] if the program refuses the design, or fails in all attempts; [`Error::File`] if it cannot be started.
    pub fn ask(&self, declared: &Declared, design: &[f64], derivatives: bool) -> Result<Answer> {
        let mut why = String::new();
        for attempt in 0..=self.program.retries {
            let id = self.next.fetch_add(1, Ordering::Relaxed);
            let place = self.place();
            // A repeated request uses a new process, because other old ones may be ending, too.
            let waiting = if attempt == 0 { place.process() } else { None };
            let mut process = match waiting {
                Some(process) => process,
                None => Process::start(&self.program, self.longest)?,
            };
            let line = process.ask(protocol::request(declared, id, design, derivatives), self.program.time_limit);
            match line.map_err(Refusal::Broken).and_then(|line| protocol::answer(declared, id, design, &line)) {
                Ok(answer) => {
                    place.keep(process);
                    return Ok(answer);
                }
                Err(Refusal::Failed(reason)) => {
                    place.keep(process);
                    return Err(self.failed(reason, "the program cannot analyse this design"));
                }
                Err(Refusal::Broken(reason)) => {
                    process.kill();
                    why = reason;
                }
            }
        }
        // A process that was killed by an interrupt gives no information about the design.
        Process::check_permission(&self.program)?;
        let times = self.program.retries + 1;
        let remedy = "run the program by hand with this request, or allow more time (docs/programs.md)";
        Err(self.failed(if times == 1 { why } else { format!("{why} ({times} tries)") }, remedy))
    }

    fn failed(&self, why: String, remedy: &str) -> Error {
        Error::analysis(format!("the program `{}`", self.program.command.join(" ")), why, remedy)
    }

    /// Waits until fewer than `jobs` processes are busy.
    fn place(&self) -> ProcessSlot<'_> {
        let mut state = self.lock();
        while state.busy >= self.program.jobs.max(1) {
            state = self.freed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.busy += 1;
        ProcessSlot(self)
    }

    fn lock(&self) -> MutexGuard<'_, Busy> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Permit to use one process.
struct ProcessSlot<'a>(&'a Processes);

impl ProcessSlot<'_> {
    /// A process that waits for a request, if there is one. Those that have ended meanwhile, as by an interrupt, are dropped.
    fn process(&self) -> Option<Process> {
        let mut state = self.0.lock();
        while let Some(mut process) = state.idle.pop() {
            if process.is_alive() {
                return Some(process);
            }
        }
        None
    }

    fn keep(&self, process: Process) {
        self.0.lock().idle.push(process);
    }
}

impl Drop for ProcessSlot<'_> {
    fn drop(&mut self) {
        self.0.lock().busy -= 1;
        self.0.freed.notify_one();
    }
}
