//! `linkwright reproduce PAPER`.

use super::output::{folder, results, say, write};
use crate::papers::etman_1998::{self, Regenerated, ReproducedRun, Summary, TABLES};
use crate::sao::State;
use anyhow::bail;
use clap::Args;
use std::io::IsTerminal;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright reproduce etman-1998
  linkwright reproduce etman-1998 --only table1,table4 --out tables")]
pub struct Reproduce {
    /// The paper: etman-1998
    paper: String,
    /// Folder for tables, summary and figures [default: out/PAPER]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only these tables, separated by commas
    #[arg(long, value_name = "TABLES", value_delimiter = ',')]
    only: Vec<String>,
}

impl Reproduce {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.paper != "etman-1998" {
            bail!("no paper `{}` is known; choose etman-1998", self.paper);
        }
        if let Some(unknown) = self.only.iter().find(|t| !TABLES.contains(&t.as_str())) {
            bail!("no table `{unknown}`; choose from {}", TABLES.join(", "));
        }
        let out = self.out.clone().unwrap_or_else(|| results().join(&self.paper));
        folder(&out)?;
        let mut tables = vec![];
        for name in TABLES.iter().filter(|t| self.only.is_empty() || self.only.iter().any(|o| o == *t)) {
            for table in etman_1998::regenerate(name, &mut progress)? {
                print(&table)?;
                write(&out.join(format!("{}.csv", table.name)), table.table.csv().as_bytes())?;
                tables.push(table);
            }
        }
        write(&out.join("summary.json"), Summary::of(&tables)?.to_json().as_bytes())?;
        for table in &tables {
            for (name, figure) in etman_1998::figures(table)? {
                figure.save(&out, &name)?;
            }
            for (name, bytes) in etman_1998::animations(table)? {
                write(&out.join(name), &bytes)?;
            }
        }
        say(&format!("Tables, summary and figures are in {}", out.display()))
    }
}

/// The table beside the printed one, with its notes and a line on how the run went.
fn print(table: &Regenerated) -> anyhow::Result<()> {
    say(&table.comparison()?.to_string())?;
    table.notes.iter().try_for_each(|note| say(&format!("Note: {note}")))?;
    let Some(ReproducedRun { state, .. }) = &table.run else { return Ok(()) };
    let counters = state.counters;
    say(&format!(
        "Run: {} cycles, {} analyses, {} sensitivity analyses, {} subproblem iterations. {:?}: {}.\n",
        state.cycles(),
        counters.analyses,
        counters.sensitivity_analyses,
        counters.subproblem_iterations,
        state.status,
        state.reason
    ))
}

/// A line for each cycle on a terminal, nothing when piped.
fn progress(table: &str, state: &State) {
    let (Some(cycle), true) = (state.history.last(), std::io::stderr().is_terminal()) else { return };
    let mark = if cycle.accepted { "accepted" } else { "rejected" };
    eprintln!(
        "{table}: cycle {:>2} {mark}  F = {:<12.6} V = {:>10.2e} %  {} time points kept",
        cycle.cycle,
        cycle.objective,
        cycle.violation_pct,
        cycle.retained.len()
    );
}
