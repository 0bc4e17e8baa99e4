//! What is seen of a run while it goes on.

use crate::cli::output::say;
use crate::problem::Problem;
use crate::sao::{Cycle, State};
use serde::Serialize;
use std::io::IsTerminal;
use std::time::Instant;

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

/// The table of cycles while it grows.
pub struct Progress<'p> {
    problem: &'p Problem,
    show: Show,
    begun: Instant,
}

/// One line of `--json`.
#[derive(Serialize)]
struct Line<'s> {
    event: &'static str,
    #[serde(flatten)]
    cycle: &'s Cycle,
}

impl<'p> Progress<'p> {
    pub fn new(problem: &'p Problem, show: Show) -> Self {
        Self { problem, show, begun: Instant::now() }
    }

    /// The names of the columns.
    pub fn head(&self) -> anyhow::Result<()> {
        if self.show != Show::Table {
            return Ok(());
        }
        let names = self.problem.variables.iter().take(COLUMNS).map(|v| format!("{:>12}", cut(&v.name, 12)));
        let more = if self.problem.n() > COLUMNS { "  …" } else { "" };
        let fixed = "cycle         objective   E_f %   E_g %      V %  limits   rows";
        say(&format!("{fixed}{}{more}", names.collect::<String>()))
    }

    /// The last cycle of a state.
    pub fn cycle(&self, state: &State) -> anyhow::Result<()> {
        let Some(cycle) = state.history.last() else { return Ok(()) };
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&serde_json::to_string(&Line { event: "cycle", cycle })?),
            Show::Table => say(&self.row(cycle)),
        }
    }

    fn row(&self, c: &Cycle) -> String {
        let mark = if c.accepted { ' ' } else { 'R' };
        let errors = format!("{:>7.2} {:>7.2} {:>8.2}", c.objective_error_pct, c.constraint_error_pct, c.violation_pct);
        let counts = format!("{:>7} {:>6}", c.active_limits, c.kept.len());
        let design: String = c.design.iter().take(COLUMNS).map(|b| format!(" {b:>11.5e}")).collect();
        // Time is shown to people, so that what programs read is the same in every run.
        let elapsed = match std::io::stdout().is_terminal() {
            true => format!("  {:>6.1} s", self.begun.elapsed().as_secs_f64()),
            false => String::new(),
        };
        format!("{:>4}{mark} {:>17.9e} {errors} {counts}{design}{elapsed}", c.cycle, c.objective)
    }

    /// The end of a run.
    pub fn end(&self, summary: &super::optimize::Summary) -> anyhow::Result<()> {
        match self.show {
            Show::Nothing => Ok(()),
            Show::JsonLines => say(&serde_json::to_string(summary)?),
            Show::Table => say(&summary.text()),
        }
    }
}

fn cut(text: &str, most: usize) -> String {
    text.chars().take(most).collect()
}
