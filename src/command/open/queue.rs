//! Requests for analyses. The newest request of a page replaces its older ones, and stops a running one that takes long.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::{Duration, Instant};
use tokio::sync::oneshot;
use tokio::time::timeout;

/// Time after which a running analysis is stopped for a newer request of the same page. A shorter one is awaited: its result is
/// newer than what the page shows.
const SUPERSEDE_AFTER: Duration = Duration::from_millis(100);
/// Largest number of waiting pages.
const PAGES: usize = 16;

/// The answer to a request.
pub enum Reply {
    /// The record of the analysis as a line of JSON.
    Line(String),
    /// A newer request, or a new model, has replaced it.
    Outdated,
    /// Too many pages wait.
    Busy,
    /// The worker could not be started, or it ended.
    Failed(String),
}

/// The queue with the thread that sends its requests to the worker.
pub struct Queue {
    shared: Arc<(Mutex<Waiting>, Condvar)>,
}

#[derive(Default)]
struct Waiting {
    /// The first line for a worker: the model. `None` while there is none.
    model: Option<String>,
    /// Number of the model.
    number: u64,
    jobs: Vec<Job>,
    running: Option<RunningJob>,
    is_closed: bool,
}

struct Job {
    page: String,
    request: String,
    reply: oneshot::Sender<Reply>,
}

struct RunningJob {
    page: String,
    since: Instant,
    worker: Arc<Mutex<Child>>,
    is_stopped: bool,
}

impl RunningJob {
    fn cancel(&mut self) {
        self.is_stopped = true;
        drop(lock(&self.worker).kill());
    }
}

/// The content of a lock. No panic leaves it inconsistent.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}

impl Queue {
    /// An empty queue. `program` with `arguments` starts a worker.
    pub fn start(program: PathBuf, arguments: Vec<String>) -> Self {
        let shared = Arc::new((Mutex::new(Waiting::default()), Condvar::new()));
        let of_thread = shared.clone();
        std::thread::spawn(move || serve(&of_thread, &program, &arguments));
        Self { shared }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        lock(&self.shared.0)
    }

    /// Replaces the model; requests for the former one are outdated.
    pub fn set_model(&self, model: Option<String>) {
        let mut waiting = self.waiting();
        waiting.model = model;
        waiting.number += 1;
        waiting.jobs.clear();
        if let Some(running) = &mut waiting.running {
            running.cancel();
        }
    }

    /// Answers a request of a page, unless a newer one of that page comes before.
    pub async fn ask(&self, page: &str, request: String) -> Reply {
        let (reply, mut answer) = oneshot::channel();
        {
            let mut waiting = self.waiting();
            // The dropped sender tells the older request that it is outdated.
            waiting.jobs.retain(|job| job.page != page);
            if waiting.jobs.len() >= PAGES {
                return Reply::Busy;
            }
            waiting.jobs.push(Job { page: page.to_owned(), request, reply });
            self.shared.1.notify_one();
        }
        loop {
            match timeout(SUPERSEDE_AFTER, &mut answer).await {
                Ok(answer) => return answer.unwrap_or(Reply::Outdated),
                Err(_) => self.stop_for_newer(page),
            }
        }
    }

    /// Stops the running analysis of a page if it takes long and a newer request of the page waits.
    fn stop_for_newer(&self, page: &str) {
        let mut waiting = self.waiting();
        let is_waiting = waiting.jobs.iter().any(|job| job.page == page);
        if let Some(running) =
            waiting.running.as_mut().filter(|r| is_waiting && r.page == page && r.since.elapsed() >= SUPERSEDE_AFTER)
        {
            running.cancel();
        }
    }

    /// Stops all requests of a page.
    pub fn cancel(&self, page: &str) {
        let mut waiting = self.waiting();
        waiting.jobs.retain(|job| job.page != page);
        if let Some(running) = waiting.running.as_mut().filter(|running| running.page == page) {
            running.cancel();
        }
    }
}

impl Drop for Queue {
    fn drop(&mut self) {
        let mut waiting = self.waiting();
        waiting.is_closed = true;
        if let Some(running) = &mut waiting.running {
            running.cancel();
        }
        self.shared.1.notify_one();
    }
}

/// A worker with its model.
struct Worker {
    process: Arc<Mutex<Child>>,
    input: ChildStdin,
    output: BufReader<ChildStdout>,
    model: u64,
}

impl Worker {
    fn start(program: &Path, arguments: &[String], model: &str, number: u64) -> std::io::Result<Self> {
        let mut command = Command::new(program);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::null());
        let mut process = command.spawn()?;
        let closed = || std::io::Error::other("its standard input or output is closed");
        let mut input = process.stdin.take().ok_or_else(closed)?;
        let output = BufReader::new(process.stdout.take().ok_or_else(closed)?);
        writeln!(input, "{model}")?;
        Ok(Self { process: Arc::new(Mutex::new(process)), input, output, model: number })
    }

    /// The answer to a request; `None` if the worker has ended.
    fn answer(&mut self, request: &str) -> Option<String> {
        writeln!(self.input, "{request}").and_then(|()| self.input.flush()).ok()?;
        let mut line = String::new();
        self.output.read_line(&mut line).ok()?;
        line.ends_with('\n').then_some(line)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let mut process = lock(&self.process);
        drop(process.kill());
        drop(process.wait());
    }
}

/// Sends requests to the worker, one at a time in their order, until the queue is dropped.
fn serve((waiting, news): &(Mutex<Waiting>, Condvar), program: &Path, arguments: &[String]) {
    let mut worker: Option<Worker> = None;
    loop {
        let (job, model, number) = {
            let guard = lock(waiting);
            let mut guard =
                news.wait_while(guard, |w| w.jobs.is_empty() && !w.is_closed).unwrap_or_else(|e| e.into_inner());
            if guard.is_closed {
                return;
            }
            (guard.jobs.remove(0), guard.model.clone(), guard.number)
        };
        let Some(model) = model else {
            drop(job.reply.send(Reply::Failed("the model file has errors".to_owned())));
            continue;
        };
        let mut ready = match worker.take().filter(|worker| worker.model == number) {
            Some(worker) => worker,
            None => match Worker::start(program, arguments, &model, number) {
                Ok(worker) => worker,
                Err(error) => {
                    drop(job.reply.send(Reply::Failed(format!("the analysis cannot be started: {error}"))));
                    continue;
                }
            },
        };
        lock(waiting).running = Some(RunningJob {
            page: job.page,
            since: Instant::now(),
            worker: ready.process.clone(),
            is_stopped: false,
        });
        let answer = ready.answer(&job.request);
        let is_stopped = lock(waiting).running.take().is_some_and(|running| running.is_stopped);
        drop(job.reply.send(match answer {
            Some(line) => {
                worker = (!is_stopped).then_some(ready);
                Reply::Line(line)
            }
            None if is_stopped => Reply::Outdated,
            None => Reply::Failed("the analysis ended unexpectedly; try another design".to_owned()),
        }));
    }
}
