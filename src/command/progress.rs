//! Terminal output during a run.

use super::eta::RemainingCycles;
use super::interruption::{InterruptAction, replaced};
use super::output::{brief, complain, say, say_raw};
use super::run_directory::{Summary, shown_cycle};
use linkwright::mechanics::SimulationClock;
use linkwright::model_file::{Model, visible};
use linkwright::problem::Problem;
use linkwright::report::number::{readable, with_unit};
use linkwright::report::outcome;
use linkwright::sao::{RunState, Status, Stop};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

/// Format of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Show {
    Table,
    JsonLines,
    Nothing,
}

impl Show {
    /// From `--json` and `--quiet`.
    pub fn of(json: bool, quiet: bool) -> Self {
        match (json, quiet) {
            (true, _) => Self::JsonLines,
            (_, true) => Self::Nothing,
            _ => Self::Table,
        }
    }

    /// Prints a line in the table format only.
    pub fn note(self, text: &str) -> anyhow::Result<()> {
        if self == Self::Table { say(text) } else { Ok(()) }
    }
}

/// Largest number of design variables in the table.
const COLUMNS: usize = 6;

/// Control sequences of a terminal: clear the line, switch line wrapping off, and on again.
const CLEAR: &str = "\r\x1b[K";
const WRAP_OFF: &str = "\x1b[?7l";
const WRAP_ON: &str = "\x1b[?7h";

/// The table of cycles, printed row by row. On a terminal, a last line shows elapsed and estimated remaining time.
pub struct Progress<'p> {
    problem: &'p Problem,
    show: Show,
    stop: Stop,
    digits: usize,
    begun: Instant,
    is_terminal: bool,
    line: StatusLine,
}

impl<'p> Progress<'p> {
    /// The table of a run; `clock` has the time of its simulations.
    pub fn new(problem: &'p Problem, show: Show, stop: Stop, digits: usize, clock: Option<RunningTime>) -> Self {
        let is_terminal = show == Show::Table && std::io::stdout().is_terminal();
        let begun = Instant::now();
        let place = if is_terminal { LinePlace::Terminal } else { LinePlace::Nowhere };
        Self { problem, show, stop, digits, begun, is_terminal, line: StatusLine::new(begun, place, clock) }
    }

    /// Says that the start design is being analysed.
    pub fn analysing_the_start(&self) {
        self.line.set("analysing the start design".to_owned(), String::new());
    }

    /// Prints the names of the columns.
    pub fn head(&self) -> anyhow::Result<()> {
        if self.show != Show::Table {
            return Ok(());
        }
        let width = self.width();
        // A name that is cut ends with a mark.
        let cut = |name: &str| match name.chars().count() > width {
            true => name.chars().take(width - 1).chain(['…']).collect(),
            false => name.to_owned(),
        };
        let names = self.problem.variables.iter().take(COLUMNS).map(|v| format!(" {:>width$}", cut(&v.name)));
        let more = if self.problem.n() > COLUMNS { "  …" } else { "" };
        let fixed = format!("cycle {:>width$}   E_f %   E_g %      V %  limits   rows", "objective");
        self.row(&format!("{fixed}{}{more}", names.collect::<String>()))
    }

    /// Prints the trial steps of a state from number `first` on, with times estimated from the `own` cycles of this process. A step may
    /// add two: the confirmation of an end adds one of its own.
    pub fn cycles(&self, state: &RunState, first: usize, own: usize) -> anyhow::Result<()> {
        for k in first..state.history.len() {
            match self.show {
                Show::Nothing => {}
                Show::JsonLines => say(&shown_cycle(self.problem, state, k)?)?,
                Show::Table => self.row(&self.cells(state, k)?)?,
            }
        }
        if self.show == Show::Table {
            self.time(state, own);
        }
        Ok(())
    }

    /// Prints a line of the table. Only a terminal gets times, so that other programs read the same text in every run.
    fn row(&self, text: &str) -> anyhow::Result<()> {
        if !self.is_terminal {
            return say(text);
        }
        let _quiet = self.line.hold();
        say_raw(&format!("{CLEAR}{WRAP_OFF}{}{WRAP_ON}", visible(text)))
    }

    /// Prints the line with the times below the table; the next row overwrites it.
    fn time(&self, state: &RunState, own: usize) {
        if !self.is_terminal || state.status != Status::Running {
            return;
        }
        let elapsed = self.begun.elapsed();
        let left = remaining(RemainingCycles::new(state, &self.stop), elapsed, own);
        let cycle = state.history.last().map_or(0, |c| c.cycle + usize::from(c.accepted));
        self.line.set(format!("cycle {cycle}"), left);
    }

    /// Width of the columns of numbers.
    fn width(&self) -> usize {
        (self.digits + 7).max(12)
    }

    /// The row of trial step `k`.
    fn cells(&self, state: &RunState, k: usize) -> anyhow::Result<String> {
        let width = self.width();
        let c = &state.history[k];
        let mark = match (&c.failure, c.accepted) {
            (Some(_), _) => 'F',
            (None, true) => ' ',
            (None, false) => 'R',
        };
        let (objective, errors) = match c.failure {
            Some(_) => ("failed".to_owned(), format!("{:>7} {:>7} {:>8}", "–", "–", "–")),
            None => {
                let objective = readable(outcome::objective_of_step(self.problem, state, k)?, self.digits);
                let violation = outcome::violation(self.problem, c);
                let violation = violation.map_or_else(|| format!("{:>8}", "–"), |v| format!("{v:>8.2}"));
                let errors = format!("{:>7.2} {:>7.2} {violation}", c.objective_error_pct, c.constraint_error_pct);
                (objective, errors)
            }
        };
        let counts = format!("{:>7} {:>6}", c.active_limits, c.retained.len());
        let number = |b: &f64| format!(" {:>width$}", readable(*b, self.digits));
        let design: String = c.design.iter().take(COLUMNS).map(number).collect();
        Ok(format!("{:>4}{mark} {objective:>width$} {errors} {counts}{design}", c.cycle))
    }

    /// Prints the summary.
    pub fn end(&self, summary: &Summary) -> anyhow::Result<()> {
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&serde_json::to_string(summary)?),
            Show::Table => {
                self.line.end();
                say(&summary.text(self.digits))
            }
        }
    }
}

/// The time of a simulation, with its end and unit.
pub struct RunningTime {
    clock: SimulationClock,
    end: f64,
    unit: String,
}

impl RunningTime {
    /// The time of the simulations of a model, if it has some.
    pub fn of(model: &Model) -> Option<Self> {
        let (clock, grid) = (model.clock()?, model.grid()?);
        Some(Self { clock, end: grid.shown(*grid.points.last()?), unit: grid.unit.clone() })
    }

    /// The current time and the end, as in `, t = 0.35 of 2 s`.
    fn text(&self) -> String {
        let time = |time: f64| format!(", t = {} of {}", readable(time, 3), with_unit(self.end, &self.unit, 3));
        self.clock.time().map_or_else(String::new, time)
    }
}

/// A task that is being done, until the value is dropped: a line on a terminal; elsewhere lines on standard error, from the first second on and then more
/// and more rarely; nothing with `--json` and `--quiet`. Ctrl-C ends the process and prints how to continue.
pub struct Task {
    line: StatusLine,
    what: String,
    done: AtomicUsize,
    before: Option<InterruptAction>,
}

/// Begins to show that `what` is being done; `model` has the clock of a simulation.
pub fn working<'m>(what: &str, show: Show, model: impl Into<Option<&'m Model>>) -> Task {
    let line = StatusLine::new(Instant::now(), LinePlace::of(show), model.into().and_then(RunningTime::of));
    line.set(what.to_owned(), String::new());
    let sentence = format!("\ninterrupted while {what}; the same command begins it again");
    let before = replaced(Some(Box::new(move || {
        complain(&sentence);
        true
    })));
    Task { line, what: what.to_owned(), done: AtomicUsize::new(0), before }
}

impl Task {
    /// Notes that one more part of `all` is done.
    pub fn count(&self, all: usize) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        self.line.set(format!("{}, {done} of {all} done", self.what), String::new());
    }
}

impl Drop for Task {
    fn drop(&mut self) {
        drop(replaced(self.before.take()));
    }
}

/// Where what is being done is shown.
#[derive(Clone, Copy, PartialEq, Eq)]
enum LinePlace {
    /// The last line of a terminal, drawn again and again.
    Terminal,
    /// Lines on standard error.
    Lines,
    Nowhere,
}

impl LinePlace {
    fn of(show: Show) -> Self {
        match show {
            Show::Table if std::io::stdout().is_terminal() => Self::Terminal,
            Show::Table => Self::Lines,
            _ => Self::Nowhere,
        }
    }
}

/// The number of finished runs of a study: a line on a terminal; elsewhere lines on standard error as those of a [`Task`], and one on standard
/// output at each tenth of the runs.
pub struct RunCount {
    show: Show,
    line: StatusLine,
    begun: Instant,
    done: usize,
    failed: usize,
    missing: usize,
}

impl RunCount {
    /// Begins to count the `missing` runs.
    pub fn new(show: Show, missing: usize) -> Self {
        let begun = Instant::now();
        let count =
            Self { show, line: StatusLine::new(begun, LinePlace::of(show), None), begun, done: 0, failed: 0, missing };
        count.line.set(count.text(), String::new());
        count
    }

    /// Counts a finished run.
    pub fn add(&mut self, has_failed: bool) -> anyhow::Result<()> {
        let tenth = |done: usize| 10 * done / self.missing.max(1);
        let is_tenth = tenth(self.done + 1) > tenth(self.done);
        self.done += 1;
        self.failed += usize::from(has_failed);
        let left = self.begun.elapsed().div_f64(self.done as f64).mul_f64((self.missing - self.done) as f64);
        *self.line.hold() = Some((self.text(), format!(", about {} left", brief(left))));
        let is_on_terminal = self.line.shared.place == LinePlace::Terminal;
        if is_tenth && !is_on_terminal { self.show.note(&self.text()) } else { Ok(()) }
    }

    fn text(&self) -> String {
        format!("{} of {} runs, {} failed", self.done, self.missing, self.failed)
    }
}

/// The current task, the time of the simulation, and the elapsed time: on a terminal twice a second.
struct StatusLine {
    shared: Arc<SharedLine>,
}

struct SharedLine {
    begun: Instant,
    place: LinePlace,
    /// The current task, and the estimated time to the end.
    text: Mutex<Option<(String, String)>>,
    clock: Option<RunningTime>,
    has_ended: AtomicBool,
}

/// Time between two drawings of the line.
const TICK: Duration = Duration::from_millis(500);
/// Elapsed times of the first two lines on standard error; the time to the next one doubles up to a limit.
const FIRST_LINES: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(10)];
const RAREST_LINES: Duration = Duration::from_secs(60);

impl StatusLine {
    /// Starts the clock.
    fn new(begun: Instant, place: LinePlace, clock: Option<RunningTime>) -> Self {
        let has_ended = AtomicBool::new(place == LinePlace::Nowhere);
        let shared = Arc::new(SharedLine { begun, place, text: Mutex::new(None), clock, has_ended });
        if place != LinePlace::Nowhere {
            let clock = shared.clone();
            std::thread::spawn(move || clock.tick());
        }
        Self { shared }
    }

    /// Changes the line.
    fn set(&self, what: String, left: String) {
        *self.hold() = Some((what, left));
        if self.shared.place == LinePlace::Terminal {
            self.shared.draw();
        }
    }

    /// Prevents the line from being drawn while the guard is held.
    fn hold(&self) -> std::sync::MutexGuard<'_, Option<(String, String)>> {
        self.shared.text.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
    }

    /// Clears the line finally, so that what follows starts on an empty line.
    fn end(&self) {
        let mut text = self.hold();
        if !self.shared.has_ended.swap(true, Ordering::AcqRel) {
            *text = None;
            if self.shared.place == LinePlace::Terminal {
                drop(write!(std::io::stdout(), "{CLEAR}"));
                drop(std::io::stdout().flush());
            }
        }
    }
}

impl SharedLine {
    /// Draws the line until it has ended.
    fn tick(&self) {
        let [mut next, mut between] = FIRST_LINES;
        while !self.has_ended.load(Ordering::Acquire) {
            let elapsed = self.begun.elapsed();
            if self.place == LinePlace::Terminal {
                self.draw();
            } else if elapsed >= next {
                self.draw();
                (next, between) = (between.max(elapsed), (2 * between).min(between + RAREST_LINES));
            }
            std::thread::sleep(TICK);
        }
    }

    fn draw(&self) {
        let text = self.text.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        let Some((what, left)) = text.as_ref().filter(|_| !self.has_ended.load(Ordering::Acquire)) else { return };
        let elapsed = brief(self.begun.elapsed());
        let time = self.clock.as_ref().map_or_else(String::new, RunningTime::text);
        if self.place == LinePlace::Lines {
            return complain(&format!("{what}{time} …  {elapsed} elapsed{left}"));
        }
        let mut out = std::io::stdout();
        // A failure to print this line must not end the run.
        drop(write!(out, "{CLEAR}{WRAP_OFF}{what}{time} …  {elapsed} elapsed{left}{WRAP_ON}"));
        drop(out.flush());
    }
}

impl Drop for StatusLine {
    fn drop(&mut self) {
        self.end();
    }
}

/// The remaining time as text, from the mean time of a cycle so far.
fn remaining(cycles: RemainingCycles, elapsed: Duration, own: usize) -> String {
    let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
    let time = |n: usize| brief((elapsed / count(own)).saturating_mul(count(n)));
    match cycles.estimate {
        _ if own == 0 => String::new(),
        Some(estimate) => format!(", about {} left, at most {}", time(estimate), time(cycles.limit)),
        None => format!(", at most {} left", time(cycles.limit)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_remaining_time_is_an_estimate_and_a_limit() {
        let cycles = RemainingCycles { estimate: Some(3), limit: 40 };
        let text = |cycles, own| remaining(cycles, Duration::from_secs(10), own);
        assert_eq!(text(cycles, 5), ", about 6.0 s left, at most 1 min 20 s");
        assert_eq!(text(RemainingCycles { estimate: None, ..cycles }, 5), ", at most 1 min 20 s left");
        assert_eq!(text(cycles, 0), "");
    }
}
