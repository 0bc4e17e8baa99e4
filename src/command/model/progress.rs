//! What is seen of a run while it goes on.

use super::forecast::Forecast;
use super::summary::Summary;
use crate::command::clock::brief;
use crate::command::output::say;
use linkwright::problem::Problem;
use linkwright::sao::{Cycle, State, Status, Stop};
use serde::Serialize;
use std::io::{IsTerminal, Write};
use std::time::{Duration, Instant};

/// How a run is shown.
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

    /// A line for people.
    pub fn note(self, text: &str) -> anyhow::Result<()> {
        if self == Self::Table { say(text) } else { Ok(()) }
    }
}

/// Most design variables that the table shows.
const COLUMNS: usize = 6;

/// What a terminal is told: forget the line, cut long lines rather than break them, break them again.
const CLEAR: &str = "\r\x1b[K";
const CUT: &str = "\x1b[?7l";
const BREAK: &str = "\x1b[?7h";

/// The table of cycles while it grows, on a terminal with a last line on the time.
pub struct Progress<'p> {
    problem: &'p Problem,
    show: Show,
    stop: Stop,
    begun: Instant,
    is_terminal: bool,
}

/// One line of `--json`, and of the history.
#[derive(Serialize)]
pub struct Line<'s> {
    pub event: &'static str,
    #[serde(flatten)]
    pub cycle: &'s Cycle,
}

impl<'p> Progress<'p> {
    pub fn new(problem: &'p Problem, show: Show, stop: Stop) -> Self {
        let is_terminal = show == Show::Table && std::io::stdout().is_terminal();
        Self { problem, show, stop, begun: Instant::now(), is_terminal }
    }

    /// The names of the columns.
    pub fn head(&self) -> anyhow::Result<()> {
        if self.show != Show::Table {
            return Ok(());
        }
        let names = self.problem.variables.iter().take(COLUMNS).map(|v| format!("{:>12}", cut(&v.name, 12)));
        let more = if self.problem.n() > COLUMNS { "  …" } else { "" };
        let fixed = "cycle         objective   E_f %   E_g %      V %  limits   rows";
        self.line(&format!("{fixed}{}{more}", names.collect::<String>()))
    }

    /// The last cycle of a state, of which this process has computed `own`.
    pub fn cycle(&self, state: &State, own: usize) -> anyhow::Result<()> {
        let Some(cycle) = state.history.last() else { return Ok(()) };
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&serde_json::to_string(&Line { event: "cycle", cycle })?),
            Show::Table => {
                self.line(&row(cycle))?;
                self.time(state, own)
            }
        }
    }

    /// A line of the table. Time is shown on a terminal alone, so that what programs read is the same in every run.
    fn line(&self, text: &str) -> anyhow::Result<()> {
        if self.is_terminal { say(&format!("{CLEAR}{CUT}{text}{BREAK}")) } else { say(text) }
    }

    /// The line on the time below the table, which the next row replaces.
    fn time(&self, state: &State, own: usize) -> anyhow::Result<()> {
        if !self.is_terminal || state.status != Status::Running {
            return Ok(());
        }
        let elapsed = self.begun.elapsed();
        let left = left(Forecast::of(state, &self.stop), elapsed, own);
        let mut out = std::io::stdout();
        // What cannot be drawn is no reason to end a run.
        drop(write!(out, "{CLEAR}{CUT}cycle {} …  {} elapsed{left}{BREAK}", cycles_begun(state), brief(elapsed)));
        drop(out.flush());
        Ok(())
    }

    /// The end of a run.
    pub fn end(&self, summary: &Summary) -> anyhow::Result<()> {
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&serde_json::to_string(summary)?),
            Show::Table => say(&summary.text()),
        }
    }
}

impl Drop for Progress<'_> {
    /// An error is not written behind the line on the time.
    fn drop(&mut self) {
        if self.is_terminal {
            drop(write!(std::io::stdout(), "{CLEAR}"));
        }
    }
}

/// The number of the cycle that is being computed.
fn cycles_begun(state: &State) -> usize {
    state.history.last().map_or(0, |c| c.cycle + usize::from(c.accepted))
}

/// The time that is left: a cycle takes as long as those before, in the mean.
fn left(forecast: Forecast, elapsed: Duration, own: usize) -> String {
    if own == 0 {
        return String::new();
    }
    let time = |cycles: usize| brief((elapsed / u32::try_from(own).unwrap_or(u32::MAX)).saturating_mul(count(cycles)));
    match forecast.likely {
        Some(likely) => format!(", about {} left, at most {}", time(likely), time(forecast.most)),
        None => format!(", at most {} left", time(forecast.most)),
    }
}

fn count(cycles: usize) -> u32 {
    u32::try_from(cycles).unwrap_or(u32::MAX)
}

fn row(c: &Cycle) -> String {
    let mark = if c.accepted { ' ' } else { 'R' };
    let errors = format!("{:>7.2} {:>7.2} {:>8.2}", c.objective_error_pct, c.constraint_error_pct, c.violation_pct);
    let counts = format!("{:>7} {:>6}", c.active_limits, c.retained.len());
    let design: String = c.design.iter().take(COLUMNS).map(|b| format!(" {b:>11.5e}")).collect();
    format!("{:>4}{mark} {:>17.9e} {errors} {counts}{design}", c.cycle, c.objective)
}

fn cut(text: &str, most: usize) -> String {
    text.chars().take(most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_time_that_is_left_is_a_guess_and_a_limit() {
        let forecast = Forecast { likely: Some(3), most: 40 };
        assert_eq!(left(forecast, Duration::from_secs(10), 5), ", about 6.0 s left, at most 1 min 20 s");
        assert_eq!(
            left(Forecast { likely: None, ..forecast }, Duration::from_secs(10), 5),
            ", at most 1 min 20 s left"
        );
        assert_eq!(left(forecast, Duration::from_secs(10), 0), "");
    }
}
