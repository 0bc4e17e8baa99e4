//! `linkwright reproduce PAPER`.

use super::output::{complain, results, say};
use super::output_folder::OutputFolder;
use anyhow::bail;
use clap::Args;
use linkwright::papers::{ReproducedTable, ReproductionSummary, papers};
use linkwright::sao::RunState;
use std::io::IsTerminal;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright reproduce etman-1998
  linkwright reproduce etman-1998 --only table1,table4 --out tables
  linkwright reproduce --list")]
pub struct Reproduce {
    /// Name of the paper, see --list
    #[arg(required_unless_present = "list", conflicts_with = "list")]
    paper: Option<String>,
    /// Folder for tables, summary and figures [default: out/PAPER]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Only these tables, separated by commas
    #[arg(long, value_name = "TABLES", value_delimiter = ',')]
    only: Vec<String>,
    /// Names of papers and of their tables
    #[arg(long)]
    list: bool,
    /// Print the summary as one line of JSON instead of the tables
    #[arg(long, conflicts_with = "list")]
    json: bool,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with_all = ["json", "list"])]
    quiet: bool,
}

impl Reproduce {
    pub fn run(&self) -> anyhow::Result<()> {
        let Some(name) = &self.paper else { return list() };
        let Some(paper) = papers().iter().find(|p| p.name() == name) else {
            let known: Vec<&str> = papers().iter().map(|p| p.name()).collect();
            bail!("no paper `{name}` is known; choose {}", known.join(" or "));
        };
        let known: Vec<&str> = paper.tables().iter().map(|t| t.name).collect();
        if let Some(unknown) = self.only.iter().find(|t| !known.contains(&t.as_str())) {
            bail!("no table `{unknown}`; choose from {}", known.join(", "));
        }
        let out = self.out.clone().unwrap_or_else(|| results().join(name));
        let mut folder = OutputFolder::create(&out)?;
        let mut tables = vec![];
        for name in known.iter().filter(|t| self.only.is_empty() || self.only.iter().any(|o| o == *t)) {
            for table in paper.regenerate(name, &mut progress)? {
                if !self.json && !self.quiet {
                    print(&table)?;
                }
                folder.write(&format!("{}.csv", table.name), table.table.csv().as_bytes())?;
                tables.push(table);
            }
        }
        let summary = ReproductionSummary::new(*paper, &tables)?.to_json();
        folder.write("summary.json", summary.as_bytes())?;
        for table in &tables {
            for (name, figure) in paper.figures(table)? {
                folder.write_figure(&name, &figure)?;
            }
            for (name, bytes) in paper.animations(table)? {
                folder.write(&name, &bytes)?;
            }
        }
        match (self.json, self.quiet) {
            (true, _) => say(&serde_json::from_str::<serde_json::Value>(&summary)?.to_string()),
            (_, true) => Ok(()),
            _ => say(&format!("Tables, summary and figures are in {}", out.display())),
        }
    }
}

/// Prints the papers with their references and tables.
fn list() -> anyhow::Result<()> {
    papers().iter().try_for_each(|paper| {
        let tables: Vec<&str> = paper.tables().iter().map(|t| t.name).collect();
        let [name, description, reference] = [paper.name(), paper.description(), paper.reference()];
        say(&format!("{name}: {description}\n  {reference}\n  Tables: {}", tables.join(", ")))
    })
}

/// Prints the table next to the printed one, with its notes and a line for each run.
fn print(table: &ReproducedTable) -> anyhow::Result<()> {
    say(&table.comparison()?.to_string())?;
    table.notes.iter().try_for_each(|note| say(&format!("Note: {note}")))?;
    for (k, run) in table.runs.iter().enumerate() {
        let (state, counters) = (&run.state, run.state.counters);
        let end = if k + 1 == table.runs.len() { "\n" } else { "" };
        say(&format!(
            "Run{}: {} cycles, {} analyses, {} sensitivity analyses, {} subproblem iterations. {:?}: {}.{end}",
            run.label.map(|label| format!(" {label}")).unwrap_or_default(),
            state.cycles(),
            counters.analyses,
            counters.sensitivity_analyses,
            counters.subproblem_iterations,
            state.status,
            state.reason
        ))?;
    }
    Ok(())
}

/// Prints a line for each cycle on a terminal, nothing when piped.
fn progress(table: &str, state: &RunState) {
    let (Some(cycle), true) = (state.history.last(), std::io::stderr().is_terminal()) else { return };
    let mark = if cycle.accepted { "accepted" } else { "rejected" };
    complain(&format!(
        "{table}: cycle {:>2} {mark}  F = {:<12.6} V = {:>10.2e} %  {} retained constraints",
        cycle.cycle,
        cycle.objective,
        cycle.violation_pct,
        cycle.retained.len()
    ));
}
