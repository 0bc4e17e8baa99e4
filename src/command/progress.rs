//! Terminal output during a run.

use super::eta::RemainingCycles;
use super::output::{brief, say, say_raw, visible};
use super::run_directory::{Summary, cycle_line};
use linkwright::problem::Problem;
use linkwright::sao::{Cycle, State, Status, Stop};
use std::io::{IsTerminal, Write};
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
    begun: Instant,
    is_terminal: bool,
}

impl<'p> Progress<'p> {
    pub fn new(problem: &'p Problem, show: Show, stop: Stop) -> Self {
        let is_terminal = show == Show::Table && std::io::stdout().is_terminal();
        Self { problem, show, stop, begun: Instant::now(), is_terminal }
    }

    /// Prints the names of the columns.
    pub fn head(&self) -> anyhow::Result<()> {
        if self.show != Show::Table {
            return Ok(());
        }
        let name = |name: &str| name.chars().take(12).collect::<String>();
        let names = self.problem.variables.iter().take(COLUMNS).map(|v| format!("{:>12}", name(&v.name)));
        let more = if self.problem.n() > COLUMNS { "  …" } else { "" };
        let fixed = "cycle         objective   E_f %   E_g %      V %  limits   rows";
        self.line(&format!("{fixed}{}{more}", names.collect::<String>()))
    }

    /// Prints the last cycle of a state, with times estimated from the `own` cycles of this process.
    pub fn cycle(&self, state: &State, own: usize) -> anyhow::Result<()> {
        let Some(cycle) = state.history.last() else { return Ok(()) };
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&cycle_line(cycle)?),
            Show::Table => {
                self.line(&row(cycle))?;
                self.time(state, own);
                Ok(())
            }
        }
    }

    /// Prints a line of the table. Only a terminal gets times, so that other programs read the same text in every run.
    fn line(&self, text: &str) -> anyhow::Result<()> {
        if !self.is_terminal {
            return say(text);
        }
        say_raw(&format!("{CLEAR}{WRAP_OFF}{}{WRAP_ON}", visible(text)))
    }

    /// Prints the line with the times below the table; the next row overwrites it.
    fn time(&self, state: &State, own: usize) {
        if !self.is_terminal || state.status != Status::Running {
            return;
        }
        let elapsed = self.begun.elapsed();
        let left = remaining(RemainingCycles::new(state, &self.stop), elapsed, own);
        let cycle = state.history.last().map_or(0, |c| c.cycle + usize::from(c.accepted));
        let mut out = std::io::stdout();
        // A failure to print this line must not end the run.
        drop(write!(out, "{CLEAR}{WRAP_OFF}cycle {cycle} …  {} elapsed{left}{WRAP_ON}", brief(elapsed)));
        drop(out.flush());
    }

    /// Prints the summary.
    pub fn end(&self, summary: &Summary) -> anyhow::Result<()> {
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&serde_json::to_string(summary)?),
            Show::Table => say(&summary.text()),
        }
    }
}

impl Drop for Progress<'_> {
    /// Clears the line with the times, so that an error message starts on an empty line.
    fn drop(&mut self) {
        if self.is_terminal {
            drop(write!(std::io::stdout(), "{CLEAR}"));
        }
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

fn row(c: &Cycle) -> String {
    let mark = if c.accepted { ' ' } else { 'R' };
    let errors = format!("{:>7.2} {:>7.2} {:>8.2}", c.objective_error_pct, c.constraint_error_pct, c.violation_pct);
    let counts = format!("{:>7} {:>6}", c.active_limits, c.retained.len());
    let design: String = c.design.iter().take(COLUMNS).map(|b| format!(" {b:>11.5e}")).collect();
    format!("{:>4}{mark} {:>17.9e} {errors} {counts}{design}", c.cycle, c.objective)
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
