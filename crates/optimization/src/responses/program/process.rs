//! One running program.

use super::ExternalProgram;
use super::protocol::shown;
use error::{Error, Result};
use std::collections::BTreeSet;
use std::io::{BufRead, BufReader, Read, Write};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, SyncSender, TryRecvError, channel, sync_channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Largest part of the standard error in messages, in bytes.
const KEPT: usize = 4096;
/// Longest time from the end of its input to the end of a program.
const EXIT_TIMEOUT: Duration = Duration::from_millis(500);

/// The programs that run.
static RUNNING: Mutex<ProgramProcess> = Mutex::new(ProgramProcess { groups: BTreeSet::new(), are_ended: false });

struct ProgramProcess {
    /// Process groups.
    groups: BTreeSet<u32>,
    /// True from [`end_programs`] to [`permit_programs`].
    are_ended: bool,
}

fn running() -> MutexGuard<'static, ProgramProcess> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Kills all programs of this process, with the processes that they started, and prevents the start of others until [`permit_programs`]. Used
/// before [`std::process::exit`], at which values are not dropped, and for an interrupt.
pub fn end_programs() {
    let mut running = running();
    running.are_ended = true;
    running.groups.iter().for_each(|id| kill_group(*id));
}

/// Permits the start of programs again after [`end_programs`].
pub fn permit_programs() {
    running().are_ended = false;
}

/// Kills a process group, where there are groups.
#[cfg_attr(not(unix), expect(unused_variables, reason = "there are no groups"))]
fn kill_group(id: u32) {
    #[cfg(unix)]
    if let Some(group) = i32::try_from(id).ok().and_then(rustix::process::Pid::from_raw) {
        // Fails only if there is no such group any more.
        let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
    }
}

/// Puts a command into a process group other than that of this process, so that the processes which the program starts end with it.
///
/// Returns the leader of the group: a guard that kills the group when this process ends in any way, even by a signal that cannot be caught. Its
/// input, which it only reads, then ends, and so does that of the program, which has one second to terminate. While the guard runs, no other
/// group has the number of this one.
#[cfg(unix)]
fn start_group(command: &mut Command) -> Option<Child> {
    use std::os::unix::process::CommandExt;
    let mut guard = Command::new("/bin/sh");
    guard.args(["-c", "read -r _; sleep 1; kill -KILL 0"]).current_dir("/").process_group(0);
    let guard = guard.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn().ok();
    let leader = guard.as_ref().and_then(|guard| i32::try_from(guard.id()).ok());
    command.process_group(leader.unwrap_or(0));
    guard
}

#[cfg(not(unix))]
fn start_group(_: &mut Command) -> Option<Child> {
    None
}

/// Kills a process and waits for its end.
fn end(mut process: Child) {
    drop(process.kill());
    drop(process.wait());
}

/// A running program with threads that write to and read from it, so that a time limit holds for both.
pub struct Process {
    child: Child,
    /// Leader of its process group; `None` where there are no groups, or no shell.
    guard: Option<Child>,
    requests: Option<Sender<Vec<u8>>>,
    lines: Receiver<Incoming>,
    stderr_tail: Arc<Mutex<Vec<u8>>>,
}

/// A line of the standard output, or the note that it is too long.
enum Incoming {
    Line(Vec<u8>),
    TooLong,
}

/// Reason why no program starts after [`end_programs`].
const INTERRUPTED: &str = "the program cannot be started: it was interrupted";

fn cannot_start(program: &ExternalProgram, why: &str) -> Error {
    let remedy = "check the command of the program".to_owned();
    Error::File { file: program.command.join(" "), why: why.to_owned(), remedy }
}

impl Process {
    /// Starts the program; a line of more than `longest` bytes is not an answer.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be started.
    pub fn start(program: &ExternalProgram, longest: usize) -> Result<Self> {
        let failed = |why: &str| cannot_start(program, why);
        let Some((name, arguments)) = program.command.split_first() else {
            return Err(failed("the command is empty"));
        };
        let mut command = Command::new(name);
        command.args(arguments).stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        if let Some(folder) = &program.folder {
            command.current_dir(folder);
        }
        let mut running = running();
        if running.are_ended {
            return Err(failed(INTERRUPTED));
        }
        let guard = start_group(&mut command);
        let mut child = match command.spawn() {
            Ok(child) => child,
            Err(why) => {
                guard.into_iter().for_each(end);
                return Err(failed(&format!("the program cannot be started: {why}")));
            }
        };
        running.groups.insert(guard.as_ref().unwrap_or(&child).id());
        drop(running);
        let (requests, to_write) = channel::<Vec<u8>>();
        let (read, lines) = sync_channel(2);
        let stderr_tail = Arc::new(Mutex::new(vec![]));
        if let Some(mut input) = child.stdin.take() {
            thread::spawn(move || {
                while let Ok(line) = to_write.recv() {
                    if input.write_all(&line).and_then(|()| input.flush()).is_err() {
                        break;
                    }
                }
            });
        }
        if let Some(output) = child.stdout.take() {
            thread::spawn(move || forward_lines(BufReader::new(output), longest, &read));
        }
        if let Some(errors) = child.stderr.take() {
            let stderr_tail = Arc::clone(&stderr_tail);
            thread::spawn(move || keep_end(errors, &stderr_tail));
        }
        Ok(Self { child, guard, requests: Some(requests), lines, stderr_tail })
    }

    /// Checks that programs may start.
    ///
    /// # Errors
    /// [`Error::File`] from [`end_programs`] to [`permit_programs`].
    pub fn check_permission(program: &ExternalProgram) -> Result<()> {
        if running().are_ended { Err(cannot_start(program, INTERRUPTED)) } else { Ok(()) }
    }

    /// True unless the program has ended.
    pub fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Sends a request and waits for its answer.
    ///
    /// # Errors
    /// The reason why there is no line: the program ended, was late, or wrote too much.
    pub fn ask(&mut self, request: Vec<u8>, limit: Duration) -> Result<Vec<u8>, String> {
        match self.lines.try_recv() {
            Ok(Incoming::Line(line)) => return Err(format!("it wrote `{}` without a request", shown(&line))),
            Ok(Incoming::TooLong) => return Err("it wrote too much".to_owned()),
            Err(TryRecvError::Disconnected) => return Err(self.end()),
            Err(TryRecvError::Empty) => {}
        }
        if self.requests.as_ref().is_none_or(|requests| requests.send(request).is_err()) {
            return Err(self.end());
        }
        match self.lines.recv_timeout(limit) {
            Ok(Incoming::Line(line)) => Ok(line),
            Ok(Incoming::TooLong) => Err("its answer is longer than any answer can be".to_owned()),
            Err(RecvTimeoutError::Timeout) => Err(format!("no answer came within {} s", limit.as_secs_f64())),
            Err(RecvTimeoutError::Disconnected) => Err(self.end()),
        }
    }

    /// The exit status of the program in words, with the end of its standard error.
    fn end(&mut self) -> String {
        let how = match self.wait(EXIT_TIMEOUT) {
            Some(status) => format!("it ended with {status}"),
            None => "it closed its standard output".to_owned(),
        };
        // The rest of the standard error is read as soon as the program has ended.
        thread::sleep(Duration::from_millis(20));
        let stderr_tail = self.stderr_tail.lock().unwrap_or_else(PoisonError::into_inner);
        let text = String::from_utf8_lossy(&stderr_tail);
        let last: Vec<&str> = text.lines().filter(|line| !line.trim().is_empty()).collect();
        match last.last() {
            None => how,
            Some(line) => format!("{how}; its last message is `{}`", shown(line.as_bytes())),
        }
    }

    fn wait(&mut self, limit: Duration) -> Option<std::process::ExitStatus> {
        let until = Instant::now() + limit;
        loop {
            match self.child.try_wait() {
                Ok(Some(status)) => return Some(status),
                Ok(None) if Instant::now() < until => thread::sleep(Duration::from_millis(2)),
                _ => return None,
            }
        }
    }

    /// Kills the program and the processes that it started, without waiting for it to end by itself.
    pub fn kill(mut self) {
        self.kill_group();
    }

    fn kill_group(&mut self) {
        let group = self.guard.as_ref().unwrap_or(&self.child).id();
        running().groups.remove(&group);
        kill_group(group);
        drop(self.child.kill());
        drop(self.child.wait());
        self.guard.take().into_iter().for_each(end);
    }
}

impl Drop for Process {
    /// Ends the input of the program, waits up to [`EXIT_TIMEOUT`] for it to end by itself, and kills the processes that are left.
    fn drop(&mut self) {
        self.requests = None;
        self.wait(EXIT_TIMEOUT);
        self.kill_group();
    }
}

fn forward_lines(mut output: impl BufRead, longest: usize, lines: &SyncSender<Incoming>) {
    loop {
        let mut line = vec![];
        let read = output.by_ref().take(longest as u64 + 1).read_until(b'\n', &mut line);
        let incoming = match read {
            // An incomplete line at the end is not an answer: the program has ended.
            Ok(_) if line.last() == Some(&b'\n') => Incoming::Line(line),
            Ok(_) if line.len() > longest => Incoming::TooLong,
            _ => return,
        };
        let is_last = matches!(incoming, Incoming::TooLong);
        if lines.send(incoming).is_err() || is_last {
            return;
        }
    }
}

fn keep_end(mut errors: impl Read, kept: &Mutex<Vec<u8>>) {
    let mut buffer = [0; KEPT];
    while let Ok(count @ 1..) = errors.read(&mut buffer) {
        let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
        kept.extend_from_slice(&buffer[..count]);
        let surplus = kept.len().saturating_sub(KEPT);
        kept.drain(..surplus);
    }
}
