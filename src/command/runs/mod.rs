//! `linkwright runs`: list of past runs and studies, comparison of two runs.
//!
//! The folders need no index file: every folder describes its own run. So folders may be moved, copied and deleted, any number of runs may
//! write at the same time, and a damaged folder does not hide the others.

mod comparison;
#[cfg(feature = "database")]
mod filter;

use super::output::{Digits, results, say};
use super::output_folder::{OutputFolder, stored};
use super::run_directory::Summary;
use super::run_entry::{RunEntry, below};
use anyhow::bail;
use clap::Args;
pub(super) use comparison::RunComparison;
use linkwright::report::table::{Cell, Table};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright runs                     list the runs below the folder `out`, the oldest first
  linkwright runs studies             list the runs below another folder
  linkwright runs lift lift-filter    compare two runs
  linkwright runs out/lift*           list the runs below several folders, if they are more than two
  linkwright runs --json | jq .status
  linkwright runs --where \"objective < 2.5 and status = 'Converged'\"
  linkwright runs --db runs.db        take runs and studies into a database, and list all that are in it

The default folder is `out`, or the folder LINKWRIGHT_OUT. Folders of runs may be moved, copied and deleted.
`--where` is an expression of SQL over the columns folder, begun, kind ('run' or 'study'), model, method, status, fingerprint, cycles,
analyses, sensitivity_analyses, objective, violation_pct, those of studies runs, done, failed, and the names of design variables.
The column `end` is the status of a run: how it ended, `Running`, or `Interrupted`; `linkwright resume` continues the latter.")]
pub struct Runs {
    /// Two runs to compare; or one folder, or more than two, whose runs are listed
    #[arg(value_name = "FOLDER")]
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
    /// List only runs for which an expression is true, for instance "objective < 2.5"
    #[cfg(feature = "database")]
    #[arg(long, value_name = "EXPRESSION")]
    r#where: Option<String>,
    /// A database: takes the runs and studies of the folder into it, and lists all that are in it
    #[cfg(feature = "database")]
    #[arg(long, value_name = "FILE")]
    db: Option<PathBuf>,
    #[command(flatten)]
    digits: Digits,
}

impl Runs {
    pub fn run(&self) -> anyhow::Result<()> {
        #[cfg(feature = "database")]
        anyhow::ensure!(
            self.folders.len() != 2 || (self.r#where.is_none() && self.db.is_none()),
            "`--where` and `--db` list runs; two folders are compared"
        );
        match self.folders.as_slice() {
            [_, _] if self.out.is_some() => bail!("`--out` writes a list of runs, not a comparison of two"),
            [a, b] => self.compare(&stored(a), &stored(b)),
            [] => self.list(&[results()], false),
            folders => self.list(folders, true),
        }
    }

    fn list(&self, folders: &[PathBuf], is_named: bool) -> anyhow::Result<()> {
        let (runs, place) = self.wanted(folders, is_named)?;
        if let Some(out) = &self.out {
            OutputFolder::create(out)?.write("runs.csv", listing(&place, &runs)?.csv().as_bytes())?;
        }
        if self.quiet {
            return Ok(());
        }
        if self.json {
            return runs.iter().try_for_each(|run| say(&serde_json::to_string(run)?));
        }
        if runs.is_empty() {
            return say(&format!("No {}", lower(&place)));
        }
        say(listing(&place, &runs)?.text_with(self.digits.count()).trim_end())?;
        let damaged = runs.iter().filter_map(|run| Some((&run.folder, run.fault.as_ref()?)));
        damaged.into_iter().try_for_each(|(folder, fault)| say(&format!("Note: {folder}: {fault}")))
    }

    /// The wanted runs, and their title.
    #[cfg(feature = "database")]
    fn wanted(&self, folders: &[PathBuf], is_named: bool) -> anyhow::Result<(Vec<RunEntry>, String)> {
        let (mut runs, mut place) = match &self.db {
            None => runs_below(folders)?,
            Some(file) => (self.in_database(file, folders, is_named)?, format!("Runs in {}", file.display())),
        };
        if let Some(expression) = &self.r#where {
            runs = filter::filtered(runs, expression)?;
            place += &format!(" with {expression}");
        }
        Ok((runs, place))
    }

    /// Takes the runs of folders into a database, and lists those that are in it. The default folder may be missing.
    #[cfg(feature = "database")]
    fn in_database(&self, file: &Path, folders: &[PathBuf], is_named: bool) -> anyhow::Result<Vec<RunEntry>> {
        use super::database::{Database, ImportCounts, entries, take};
        let is_missing = !is_named && folders.iter().all(|folder| !folder.is_dir());
        let found = if is_missing { vec![] } else { runs_below(folders)?.0 };
        let mut database = Database::open(file)?;
        let mut taken = ImportCounts::default();
        found.iter().try_for_each(|entry| take(&mut database, entry, &mut taken))?;
        let ImportCounts { entries: new, rows, analyses } = taken;
        if new > 0 && !self.quiet && !self.json {
            let shown = file.display();
            say(&format!(
                "{new} new or changed runs and studies, {rows} rows and {analyses} analyses were added to {shown}"
            ))?;
        }
        let damaged = found.into_iter().filter(|entry| entry.status == "Damaged");
        Ok(entries(&database)?.into_iter().chain(damaged).collect())
    }

    #[cfg(not(feature = "database"))]
    fn wanted(&self, folders: &[PathBuf], _: bool) -> anyhow::Result<(Vec<RunEntry>, String)> {
        runs_below(folders)
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

/// The runs and studies below folders that must exist, the oldest first, and their title.
fn runs_below(folders: &[PathBuf]) -> anyhow::Result<(Vec<RunEntry>, String)> {
    for folder in folders {
        let shown = folder.display();
        anyhow::ensure!(folder.is_dir(), "there is no folder {shown}; give the folder that contains the runs");
    }
    let place = match folders {
        [folder] => format!("Runs below {}", folder.display()),
        _ => format!("Runs below {} folders", folders.len()),
    };
    Ok((below(folders), place))
}

/// A title in the middle of a sentence.
fn lower(title: &str) -> String {
    title.replacen("Runs", "runs", 1)
}

fn listing(title: &str, runs: &[RunEntry]) -> linkwright::Result<Table> {
    let mut columns = vec![
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
    let has_notes = runs.iter().any(|run| run.note.is_some());
    columns.extend(has_notes.then_some("note"));
    let mut table = Table::new(title, columns);
    let text = |text: &str| Cell::from(text);
    for run in runs {
        let result = run.result.as_ref();
        let number = |of: fn(&Summary) -> Cell| result.map_or(Cell::Empty, of);
        let mut row = vec![
            text(&run.folder),
            text(&run.begun.replace('T', " ").replace('Z', "")),
            text(&run.model),
            text(&if run.kind == "study" { format!("study: {}", run.method) } else { run.method.clone() }),
            text(&run.status),
            number(|r| r.cycles.into()),
            number(|r| r.analyses.into()),
            number(|r| r.sensitivity_analyses.into()),
            number(|r| r.objective.value.into()),
            number(|r| r.violation_pct().map_or(Cell::Empty, Cell::from)),
        ];
        row.extend(has_notes.then(|| text(&run.note.as_deref().unwrap_or_default().replace('\n', " "))));
        table.push(row)?;
    }
    Ok(table)
}
