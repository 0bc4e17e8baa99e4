//! `linkwright runs`: past runs, and two of them beside each other.
//!
//! | file | what |
//! |---|---|
//! | `record` | what the folder of a run says about it, and where such folders are |
//! | `comparison` | two runs beside each other |
//!
//! The folders of the runs are the index: each says by itself what it holds, so it may be moved, copied and deleted, any number
//! of runs may write at once, and a folder that is damaged hides no other one.

mod comparison;
mod record;

use super::output::{results, say};
use clap::Args;
use comparison::Comparison;
use linkwright::report::table::{Cell, Table};
use record::Record;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright runs                     runs below the folder `out`, the oldest first
  linkwright runs studies             runs below another folder
  linkwright runs lift lift-filter    two runs beside each other
  linkwright runs --json | jq .status

Runs are found by their folders, which may be moved, copied and deleted; nothing is written. Without a folder, runs are
looked for where `optimize` puts them: below `out`, or below the folder that LINKWRIGHT_OUT names.
The end of a run: how it ended, `running`, or `interrupted`, which `linkwright resume` goes on with.")]
pub struct Runs {
    /// A folder to look in, or the two runs to compare
    #[arg(value_name = "FOLDER", num_args = 0..=2)]
    folders: Vec<PathBuf>,
    /// A line of JSON for each run, or for the comparison
    #[arg(long)]
    json: bool,
}

impl Runs {
    pub fn run(&self) -> anyhow::Result<()> {
        match self.folders.as_slice() {
            [a, b] => self.compare(&named(a), &named(b)),
            [folder] => self.list(folder),
            _ => self.list(&results()),
        }
    }

    fn list(&self, folder: &Path) -> anyhow::Result<()> {
        anyhow::ensure!(folder.is_dir(), "there is no folder {}; name the one that runs are in", folder.display());
        let runs = record::below(folder);
        if self.json {
            return runs.iter().try_for_each(|run| say(&serde_json::to_string(run)?));
        }
        if runs.is_empty() {
            return say(&format!("No runs below {}", folder.display()));
        }
        say(listing(folder, &runs)?.text().trim_end())?;
        let damaged = runs.iter().filter_map(|run| Some((&run.folder, run.fault.as_ref()?)));
        damaged.into_iter().try_for_each(|(folder, fault)| say(&format!("Note: {folder}: {fault}")))
    }

    fn compare(&self, a: &Path, b: &Path) -> anyhow::Result<()> {
        let comparison = Comparison::of(a, b)?;
        if self.json {
            return say(&serde_json::to_string(&comparison)?);
        }
        say(&comparison.text()?)
    }
}

/// A run by its path, or by its name among the results.
fn named(folder: &Path) -> PathBuf {
    let among = results().join(folder);
    if !folder.exists() && among.exists() { among } else { folder.to_owned() }
}

fn listing(folder: &Path, runs: &[Record]) -> linkwright::Result<Table> {
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
        let number = |of: fn(&super::model::Summary) -> Cell| result.map_or(Cell::Empty, of);
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
