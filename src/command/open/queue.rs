//! Requests for analyses. The newest request of a page replaces its older ones, and stops a running one that takes long.

use super::process::{WorkerCommand, WorkerProcess, lock};
use super::worker::{ModelLine, WorkerRequest};
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
    /// `None` while there is none.
    model: Option<ModelLine>,
    /// Number of the model.
    number: u64,
    jobs: Vec<Job>,
    running: Option<RunningJob>,
    is_closed: bool,
}

struct Job {
    page: String,
    request: WorkerRequest,
    reply: oneshot::Sender<Reply>,
}

struct RunningJob {
    page: String,
    since: Instant,
    process: WorkerProcess,
    is_stopped: bool,
}

impl RunningJob {
    fn cancel(&mut self) {
        self.is_stopped = true;
        self.process.kill();
    }
}

impl Queue {
    /// An empty queue. `command` starts a worker.
    pub fn start(command: WorkerCommand) -> Self {
        let shared = Arc::new((Mutex::new(Waiting::default()), Condvar::new()));
        let of_thread = shared.clone();
        std::thread::spawn(move || serve(&of_thread, &command));
        Self { shared }
    }

    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        lock(&self.shared.0)
    }

    /// Replaces the model; requests for the former one are outdated.
    pub fn set_model(&self, model: Option<ModelLine>) {
        let mut waiting = self.waiting();
        waiting.model = model;
        waiting.number += 1;
        waiting.jobs.clear();
        if let Some(running) = &mut waiting.running {
            running.cancel();
        }
    }

    /// Answers a request of a page, unless a newer one of that page comes before.
    pub async fn ask(&self, page: &str, request: WorkerRequest) -> Reply {
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

/// Sends requests to the worker, one at a time in their order, until the queue is dropped.
fn serve((waiting, news): &(Mutex<Waiting>, Condvar), command: &WorkerCommand) {
    // With the number of its model.
    let mut worker = None;
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
        let mut ready = match worker.take().filter(|(_, of)| *of == number) {
            Some((worker, _)) => worker,
            None => match command.start(&model) {
                Ok(worker) => worker,
                Err(error) => {
                    drop(job.reply.send(Reply::Failed(format!("the analysis cannot be started: {error}"))));
                    continue;
                }
            },
        };
        lock(waiting).running =
            Some(RunningJob { page: job.page, since: Instant::now(), process: ready.process(), is_stopped: false });
        let answer = ready.answer(&job.request);
        let is_stopped = lock(waiting).running.take().is_some_and(|running| running.is_stopped);
        drop(job.reply.send(match answer {
            Some(line) => {
                worker = (!is_stopped).then_some((ready, number));
                Reply::Line(line)
            }
            None if is_stopped => Reply::Outdated,
            None => Reply::Failed("the analysis ended unexpectedly; try another design".to_owned()),
        }));
    }
}
