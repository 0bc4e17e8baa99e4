//! `linkwright compare --suite SUITE`.

use super::OutputForm;
use crate::command::output_folder::OutputFolder;
use crate::command::progress::{Show, working};
use anyhow::{Context, anyhow, bail};
use linkwright::cases::suite::{Claim, Suite, SuiteRun, Transformation, Verdict, problems, run};
use linkwright::cases::{AnalysisCounts, CatalogueEntry, find};
use linkwright::report::suite::{profiles, runs, summary};
use linkwright::report::table::{Cell, Table};
use linkwright::sao::Preset;
use linkwright::storage::read_file;
use rayon::prelude::*;
use std::path::Path;

/// Name of a suite on the command line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum SuiteName {
    /// Problems of Hock & Schittkowski
    Hs,
    /// Problems that mislead optimizers
    Adversarial,
    /// Semi-infinite problems and Chebyshev fits
    Time,
    /// Mechanisms and structures with a cheap analysis
    Catalogue,
    /// All of them
    All,
}

impl SuiteName {
    fn entries(self) -> Vec<&'static CatalogueEntry> {
        match self {
            Self::Hs => Suite::HockSchittkowski.problems(),
            Self::Adversarial => Suite::Adversarial.problems(),
            Self::Time => Suite::Time.problems(),
            Self::Catalogue => Suite::Catalogue.problems(),
            Self::All => problems().filter(|entry| !entry.expensive).collect(),
        }
    }
}

/// Settings of a comparison on a suite.
pub struct Comparison<'a> {
    pub suite: SuiteName,
    pub transformations: &'a [String],
    pub methods: &'a [&'static Preset],
    pub peers: Option<&'a Path>,
    pub show: OutputForm,
}

impl Comparison<'_> {
    /// Runs the methods, prints the summary, writes all runs and the profiles.
    ///
    /// Fails after that if a verdict is false.
    pub fn run(&self, out: &Path) -> anyhow::Result<()> {
        let entries = self.suite.entries();
        let transformations = self.transformations()?;
        let theirs = self.peers.map_or(Ok(vec![]), peers)?;
        let show = if matches!(self.show, OutputForm::Text(_)) { Show::Table } else { Show::Nothing };
        let count = entries.len() * transformations.len() * self.methods.len();
        let work = working(&format!("doing {count} runs"), show, None);
        let mut all = run(&entries, &transformations, self.methods)?;
        drop(work);
        let ours = all.len();
        let chosen = |r: &SuiteRun| {
            entries.iter().any(|entry| entry.name == r.problem) && transformations.contains(&r.transformation)
        };
        all.extend(theirs.into_iter().filter(chosen));
        let title = format!("{} problems, {} transformations", entries.len(), transformations.len());
        let (table, totals) = (runs(&title, &all)?, summary(&title, &all)?);
        let mut folder = OutputFolder::create(out)?;
        folder.write("runs.csv", table.csv().as_bytes())?;
        folder.write("summary.csv", totals.csv().as_bytes())?;
        let [performance, data] = profiles(&all)?;
        folder.write_figure("performance-profile", &performance)?;
        folder.write_figure("data-profile", &data)?;
        self.show_runs(&all[..ours], &table, &totals)?;
        if transformations.len() > 1 {
            let table = by_transformation(&title, &all)?;
            folder.write("transformations.csv", table.csv().as_bytes())?;
            if matches!(self.show, OutputForm::Text(_)) {
                self.show.table(&table)?;
            }
        }
        self.show.text(&format!("Runs, summary and profiles are in {}", out.display()))?;
        let wrong = all[..ours].iter().filter(|r| r.verification.is_some_and(|j| j.verdict == Verdict::False)).count();
        if wrong > 0 {
            bail!("{wrong} of {ours} runs end with a false statement; `runs.csv` lists them with the verdict FALSE");
        }
        Ok(())
    }

    /// Prints all runs as JSON, or the runs that are not solved (all runs of a single method) and the summary as text.
    fn show_runs(&self, ours: &[SuiteRun], table: &Table, totals: &Table) -> anyhow::Result<()> {
        if !matches!(self.show, OutputForm::Text(_)) {
            return self.show.table(table);
        }
        let is_shown = |r: &&SuiteRun| {
            let verdict = r.verification.map(|j| j.verdict);
            self.methods.len() == 1 || verdict == Some(Verdict::False)
        };
        let shown: Vec<&SuiteRun> = ours.iter().filter(is_shown).collect();
        if !shown.is_empty() {
            let title = if self.methods.len() == 1 { "Runs" } else { "Runs with a false statement" };
            self.show.table(&runs(title, shown)?)?;
        }
        self.show.table(totals)
    }

    fn transformations(&self) -> anyhow::Result<Vec<Transformation>> {
        if self.transformations.is_empty() {
            return Ok(vec![Transformation::default()]);
        }
        let sets = self.transformations.iter().map(|text| Transformation::parse_set(text));
        Ok(sets.collect::<Result<Vec<_>, _>>()?.concat())
    }
}

/// Table with a row for each transformation, all methods together: numbers of runs by verdict, median and sum of the work of solved
/// runs, and the number of runs that reached a known optimum, whatever they say.
fn by_transformation(title: &str, all: &[SuiteRun]) -> linkwright::Result<Table> {
    let columns = [
        "transformation",
        "runs",
        "solved",
        "local_optimum",
        "honest_end",
        "false",
        "median_work",
        "sum_work",
        "reached",
    ];
    let mut table = Table::new(title, columns);
    let mut done: Vec<Transformation> = vec![];
    for run in all {
        let transformation = run.transformation;
        if done.contains(&transformation) {
            continue;
        }
        done.push(transformation);
        let same: Vec<&SuiteRun> = all.iter().filter(|r| r.transformation == transformation).collect();
        let count = |v: Verdict| same.iter().filter(|r| r.verification.is_some_and(|j| j.verdict == v)).count();
        let mut work: Vec<usize> = same.iter().filter(|r| r.is_solved()).map(|r| r.work.total()).collect();
        work.sort_unstable();
        table.push([
            transformation.to_string().as_str().into(),
            same.len().into(),
            work.len().into(),
            count(Verdict::LocalOptimum).into(),
            count(Verdict::Unsolved).into(),
            count(Verdict::False).into(),
            work.get(work.len() / 2).map_or(Cell::Empty, |w| (*w).into()),
            work.iter().sum::<usize>().into(),
            same.iter().filter(|r| r.verification.is_some_and(|j| j.is_reached)).count().into(),
        ])?;
    }
    Ok(table)
}

/// Largest size in bytes of a file of runs of other programs.
const PEERS_LIMIT: u64 = 64 << 20;

/// Reads and judges the runs of other programs, such as `benches/peers/optimizers.csv`.
fn peers(path: &Path) -> anyhow::Result<Vec<SuiteRun>> {
    let cannot = || format!("cannot read {}", path.display());
    let text = String::from_utf8(read_file(path, PEERS_LIMIT).with_context(cannot)?).with_context(cannot)?;
    let lines: Vec<(usize, &str)> = text.lines().enumerate().skip(1).collect();
    let read = |&(k, line): &(usize, &str)| peer(line).with_context(|| format!("{}, line {}", path.display(), k + 1));
    lines.par_iter().map(read).collect()
}

/// A line `optimizer;problem;transformation;claim;analyses;sensitivity_analyses;design`.
fn peer(line: &str) -> anyhow::Result<SuiteRun> {
    let cells: Vec<&str> = line.split(';').collect();
    let [optimizer, problem, transformation, claim, analyses, sensitivity_analyses, design] = cells[..] else {
        bail!("expected 7 cells separated by semicolons, got {}", cells.len());
    };
    let claim = match claim {
        "converged" => Claim::Converged,
        "infeasible" => Claim::Infeasible,
        "nothing" => Claim::Nothing,
        other => return Err(anyhow!("unknown claim `{other}`; write converged, infeasible or nothing")),
    };
    let work = AnalysisCounts { analyses: analyses.parse()?, sensitivity_analyses: sensitivity_analyses.parse()? };
    let design = design.split_whitespace().map(str::parse).collect::<Result<Vec<f64>, _>>()?;
    let transformation = Transformation::parse(transformation)?;
    Ok(SuiteRun::of_peer(find(problem)?, &transformation, optimizer, claim, work, &design)?)
}
