//! `linkwright runs`: list of past runs, comparison of two runs.
//!
//! There is no index file: every folder describes its own run. So folders may be moved, copied and deleted, any number of runs may
//! write at the same time, and a damaged folder does not hide the others.

mod comparison;
mod entry;

use super::folder::OutputFolder;
use super::optimize::Digits;
use super::output::{results, say};
use super::run_directory::Summary;
use anyhow::bail;
use clap::Args;
use comparison::RunComparison;
use entry::RunEntry;
pub use entry::below;
use linkwright::report::table::{Cell, Table};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright runs                     list the runs below the folder `out`, the oldest first
  linkwright runs studies             list the runs below another folder
  linkwright runs lift lift-filter    compare two runs
  linkwright runs --json | jq .status

The default folder is `out`, or the folder LINKWRIGHT_OUT. Folders of runs may be moved, copied and deleted.
The column `end` is the status of a run: how it ended, `Running`, or `Interrupted`; `linkwright resume` continues the latter.")]
pub struct Runs {
    /// A folder to search, or two runs to compare
    #[arg(value_name = "FOLDER", num_args = 0..=2)]
    folders: Vec<PathBuf>,
    /// Print a line of JSON for each run, or for the comparison
    #[arg(long)]
    json: bool,
    /// Folder for the list as runs.csv
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    #[command(flatten)]
    digits: Digits,
}

impl Runs {
    pub fn run(&self) -> anyhow::Result<()> {
        match self.folders.as_slice() {
            [_, _] if self.out.is_some() => bail!("`--out` writes a list of runs, not a comparison of two"),
            [a, b] => self.compare(&named(a), &named(b)),
            [folder] => self.list(folder),
            _ => self.list(&results()),
        }
    }

    fn list(&self, folder: &Path) -> anyhow::Result<()> {
        anyhow::ensure!(
            folder.is_dir(),
            "there is no folder {}; give the folder that contains the runs",
            folder.display()
        );
        let runs = below(folder);
        if let Some(out) = &self.out {
            OutputFolder::create(out)?.write("runs.csv", listing(folder, &runs)?.csv().as_bytes())?;
        }
        if self.quiet {
            return Ok(());
        }
        if self.json {
            return runs.iter().try_for_each(|run| say(&serde_json::to_string(run)?));
        }
        if runs.is_empty() {
            return say(&format!("No runs below {}", folder.display()));
        }
        say(listing(folder, &runs)?.text_with(self.digits.count()).trim_end())?;
        let damaged = runs.iter().filter_map(|run| Some((&run.folder, run.fault.as_ref()?)));
        damaged.into_iter().try_for_each(|(folder, fault)| say(&format!("Note: {folder}: {fault}")))
    }

    fn compare(&self, a: &Path, b: &Path) -> anyhow::Result<()> {
        let comparison = RunComparison::new(a, b)?;
        match (self.json, self.quiet) {
            (true, _) => say(&serde_json::to_string(&comparison)?),
            (_, true) => Ok(()),
            _ => say(&comparison.text(self.digits.count())?),
        }
    }
}

/// The path of a run, given as path or as name in the folder of results.
pub fn named(folder: &Path) -> PathBuf {
    let among = results().join(folder);
    if !folder.exists() && among.exists() { among } else { folder.to_owned() }
}

fn listing(folder: &Path, runs: &[RunEntry]) -> linkwright::Result<Table> {
    let columns = [
        "folder",
        "begun",
        "model",
        "method",
        "end",
        "cycles",
        "analyses",
        "sensitivity_analyses",
        "objective",
        "violation_pct",
    ];
    let mut table = Table::new(format!("Runs below {}", folder.display()), columns);
    let text = |text: &str| Cell::from(text);
    for run in runs {
        let result = run.result.as_ref();
        let number = |of: fn(&Summary) -> Cell| result.map_or(Cell::Empty, of);
        table.push([
            text(&run.folder),
            text(&run.begun.replace('T', " ").replace('Z', "")),
            text(&run.model),
            text(&run.method),
            text(&run.status),
            number(|r| r.cycles.into()),
            number(|r| r.analyses.into()),
            number(|r| r.sensitivity_analyses.into()),
            number(|r| r.objective.value.into()),
            number(|r| r.violation_pct.into()),
        ])?;
    }
    Ok(table)
}
