//! `linkwright study FILE` and `linkwright study merge DIR…`.

mod study_folder;

pub use study_folder::{StudyProgress, StudyRecord};

use super::budget::Budget;
use super::interruption::{INTERRUPTED, at_interruption};
use super::model::{ModelSettings, is_model, located, model_file, program_folder};
use super::output::{ClosedOutput, Digits, argument, complain, say};
use super::output_folder::{create, name_of, numbered};
use super::progress::{RunCount, Show};
use anyhow::{Context, anyhow, bail};
use clap::{Args, Subcommand};
use linkwright::report::table::{Table, one_line};
use linkwright::storage::{Directory, read_file};
use linkwright::study::{self as studies, Column, Conclusions, ModelSource, Part, Phase, Row, Rows, StudyFile};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use study_folder::{PAGE, SUMMARY, StudyFolder, copies, read_rows};

/// Largest size of a study file in bytes.
const LIMIT: u64 = 2 << 20;

/// True after Ctrl-C.
static STOPPED: AtomicBool = AtomicBool::new(false);

#[derive(Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "Examples:
  linkwright study starts.toml
  linkwright study starts.toml --part 3/16       one of 16 parts, on any machine
  linkwright study merge out/starts-part-*       join them

The study file names the model and what is studied; docs/studies.md has its keys. Results are written to out/NAME, or to NAME in the folder
LINKWRIGHT_OUT. The same command again continues an interrupted study; no finished run is done twice. If study or model have changed, a new
study begins in NAME-2, NAME-3, …"
)]
pub struct Study {
    /// The study file; `starts` means starts.toml
    #[arg(required = true)]
    file: Option<PathBuf>,
    /// Folder for the results [default: out/NAME, or the next of out/NAME-2, out/NAME-3, …]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Replace the study in the folder
    #[arg(long)]
    force: bool,
    /// Do one part of the runs, for instance 3/16
    #[arg(long, value_name = "N/PARTS", value_parser = part)]
    part: Option<Part>,
    #[command(flatten)]
    settings: ModelSettings,
    #[command(flatten)]
    budget: Budget,
    #[command(flatten)]
    shown: StudyOutput,
    #[command(subcommand)]
    command: Option<StudyCommand>,
}

#[derive(Subcommand)]
enum StudyCommand {
    /// Join the parts of a study.
    Merge(Merge),
}

#[derive(Args)]
struct Merge {
    /// The folders of the parts
    #[arg(required = true)]
    parts: Vec<PathBuf>,
    /// Folder for the whole [default: out/NAME, or the next of out/NAME-2, out/NAME-3, …]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    shown: StudyOutput,
}

#[derive(Args)]
struct StudyOutput {
    /// Number of threads; RAYON_NUM_THREADS or one for each processor by default
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,
    /// Print a line of JSON for each run, and one for the summary
    #[arg(long)]
    json: bool,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    #[command(flatten)]
    digits: Digits,
}

/// A part as `3/16`.
fn part(text: &str) -> Result<Part, String> {
    let numbers = text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
    match numbers {
        Some((number, of)) if (1..=of).contains(&number) => Ok(Part { number, of }),
        _ => Err("give a part as 3/16: number of the part from 1, and number of parts".to_owned()),
    }
}

impl Study {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        if let Some(StudyCommand::Merge(merge)) = &self.command {
            return merge.run();
        }
        let file = model_file(self.file.as_deref().context("give a study file")?);
        let study = read_study(&file, &self.settings, &self.budget)?;
        let part = self.part.unwrap_or(Part::WHOLE);
        if part != Part::WHOLE && !study.has_parts() {
            bail!(
                "the runs of this study start from the results of others, so it has no parts; do it as a whole, with --jobs"
            );
        }
        self.budget.check_rows(&study, part)?;
        let shown_file = file.display().to_string();
        let suffix = if part == Part::WHOLE { String::new() } else { format!("-part-{}-of-{}", part.number, part.of) };
        let name = format!("{}{suffix}", name_of(&file)?);
        let (folder, rows) = opened(self.out.as_deref(), &name, &study, part, &shown_file, self.force, &self.shown)?;
        self.shown.run(&study, folder, rows, part)
    }
}

/// Reads a study file and its model.
fn read_study(file: &Path, settings: &ModelSettings, budget: &Budget) -> anyhow::Result<studies::Study> {
    let bytes = read_file(file, LIMIT).with_context(|| format!("cannot read the study {}", file.display()))?;
    let text = String::from_utf8(bytes).with_context(|| format!("the study {} is not UTF-8", file.display()))?;
    if is_model(&text) {
        bail!(
            "{} is a model file, and a study is needed: a file of its own with `model`, `kind` and tables [vary.NAME]",
            file.display()
        );
    }
    let read = StudyFile::read(&file.display().to_string(), &text)?;
    let model = file.parent().unwrap_or(Path::new("")).join(&read.model);
    let (read_model, text) = settings.load(&model)?;
    if read_model.is_problem() {
        budget.check_runs(read.kind, &located(&read_model, read_model.problem())?, read_model.method())?;
    } else {
        budget.check_simulation(&read_model)?;
    }
    let source = ModelSource { name: model.display().to_string(), text, programs: program_folder(&model) };
    Ok(studies::Study::new(read, &source)?)
}

/// The study of a folder, from the copies of its files. Its programs do not run.
fn of_folder(folder: &Directory) -> anyhow::Result<(StudyRecord, studies::Study)> {
    let shown = folder.path().display();
    let record = StudyRecord::read(folder)?.with_context(|| format!("{shown} has no study in it"))?;
    let [text, model] = copies(folder)?;
    // The copy of the model has the settings of the study already; they are applied again, to the same effect.
    let file = StudyFile::read(&record.file, &text)?;
    let name = folder.path().join("model.toml").display().to_string();
    let study = studies::Study::new(file, &ModelSource { name, text: model, programs: None })?;
    // The title may be the name of the model file, which the copy does not have.
    let study = study.titled(&record.title);
    Ok((record, study))
}

/// The study of a folder with its rows.
#[cfg(any(feature = "database", feature = "app"))]
pub fn stored_study(folder: &Directory) -> anyhow::Result<(studies::Study, Rows)> {
    let (_, study) = of_folder(folder)?;
    let rows = read_rows(folder, &study)?;
    Ok((study, rows))
}

/// The given folder, or the first of NAME, NAME-2, … that is empty or has this study.
fn opened(
    out: Option<&Path>,
    name: &str,
    study: &studies::Study,
    part: Part,
    file: &str,
    force: bool,
    shown: &StudyOutput,
) -> anyhow::Result<(StudyFolder, Rows)> {
    if let Some(out) = out {
        return StudyFolder::open(create(out)?, study, part, file, force);
    }
    let (opened, place) = numbered(name, force, |directory| StudyFolder::open(directory, study, part, file, force))?;
    if place.is_some() {
        shown.show().note(&format!("This study goes to {}; --force replaces the one in {name}", opened.0.shown()))?;
    }
    Ok(opened)
}

impl Merge {
    fn run(&self) -> anyhow::Result<ExitCode> {
        let open = |path: &PathBuf| super::output_folder::opened(&super::output_folder::stored(path));
        let parts = self.parts.iter().map(open).collect::<anyhow::Result<Vec<_>>>()?;
        let first = parts.first().context("give the folders of the parts")?;
        let (record, study) = of_folder(first)?;
        let mut rows = study.no_rows();
        for part in &parts {
            rows.join(read_rows(part, &study)?)
                .with_context(|| format!("{} does not fit the parts before it", part.path().display()))?;
        }
        let name = name_of(Path::new(&record.file))?;
        let (mut folder, known) =
            opened(self.out.as_deref(), &name, &study, Part::WHOLE, &record.file, false, &self.shown)?;
        if !known.is_empty() {
            rows.join(known)?;
        }
        folder.sort(&rows)?;
        self.shown.finish(&study, folder, &rows, Part::WHOLE)
    }
}

impl StudyOutput {
    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }

    /// Does the missing runs, then writes the results.
    fn run(&self, study: &studies::Study, folder: StudyFolder, stored: Rows, part: Part) -> anyhow::Result<ExitCode> {
        let rows = if stored.is_empty() { study.no_rows() } else { stored };
        let missing = study.missing(&rows, part);
        if !rows.is_empty() {
            self.show().note(&format!("{} runs are done already, {missing} are missing.", rows.len()))?;
        }
        stop_at_interruption();
        let progress = Mutex::new((folder, RunCount::new(self.show(), missing), None));
        let observe = |row: &Row| {
            let mut guard = progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
            let (folder, progress, failure) = &mut *guard;
            // After a row that was written in part, no other one is appended.
            if failure.is_some() {
                return false;
            }
            if let Err(error) =
                folder.append(row).and_then(|()| self.say_row(study, row)).and_then(|()| progress.add(row.has_failed()))
            {
                *failure = Some(error);
                return false;
            }
            !STOPPED.load(Ordering::Relaxed)
        };
        let work = || study.run(rows, part, &observe);
        let rows = match self.jobs {
            Some(jobs) => rayon::ThreadPoolBuilder::new().num_threads(usize::from(jobs)).build()?.install(work),
            None => work(),
        };
        let (mut folder, progress, failure) = progress.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
        drop(progress);
        folder.flush()?;
        if let Some(error) = failure {
            return Err(if error.is::<ClosedOutput>() {
                anyhow!("{ClosedOutput}; give the same command again to continue the study")
            } else {
                error
            });
        }
        let rows = rows.map_err(|error| {
            anyhow!("{error}; finished runs are kept in {}: the same command again continues the study", folder.shown())
        })?;
        if STOPPED.load(Ordering::Relaxed) && study.missing(&rows, part) > 0 {
            complain(&format!(
                "interrupted; {} runs are missing; the same command again continues the study in {}",
                study.missing(&rows, part),
                folder.shown()
            ));
            return Ok(ExitCode::from(INTERRUPTED));
        }
        folder.sort(&rows)?;
        self.finish(study, folder, &rows, part)
    }

    /// Prints a line of JSON for a finished run, if that is asked for.
    fn say_row(&self, study: &studies::Study, row: &Row) -> anyhow::Result<()> {
        if !self.json {
            return Ok(());
        }
        let mut line = serde_json::to_value(row)?;
        line["event"] = "row".into();
        let phase = &study.phases()[row.phase];
        line["phase"] = phase.name.into();
        line["columns"] = phase.columns.iter().map(|column| column.name.as_str()).collect();
        say(&line.to_string())
    }

    /// Writes tables, and the conclusions if no run is missing.
    fn finish(
        &self,
        study: &studies::Study,
        mut folder: StudyFolder,
        rows: &Rows,
        part: Part,
    ) -> anyhow::Result<ExitCode> {
        for (number, phase) in study.phases().iter().enumerate() {
            folder.write_table(phase.name, &study.table(rows, number)?)?;
        }
        let failed = rows.all().filter(|row| row.has_failed()).count();
        let missing = study.missing(rows, Part::WHOLE);
        let shown = folder.shown();
        if failed > 0 && failed == rows.len() {
            let reason = rows.all().find(|row| row.has_failed()).map(|row| row.failure.clone()).unwrap_or_default();
            bail!("all {failed} runs failed: {reason}; the rows are in {shown}");
        }
        if missing > 0 {
            self.show().note(&format!("{} runs are done, {failed} of them failed.", rows.len()))?;
            self.show().note(&match part == Part::WHOLE {
                true => {
                    format!("{missing} runs are missing; `linkwright study FILE --out {}` does them", argument(&shown))
                }
                false => format!(
                    "Part {}/{} is complete; `linkwright study merge DIR…` joins the parts",
                    part.number, part.of
                ),
            })?;
            return Ok(ExitCode::SUCCESS);
        }
        let conclusion = study.conclude(rows)?;
        for (name, table) in &conclusion.tables {
            folder.write_table(name, table)?;
        }
        let summary = summary(study, [rows.len(), failed], &conclusion);
        folder.write(SUMMARY, serde_json::to_string_pretty(&summary)?.as_bytes())?;
        folder.write_page(study, rows, &conclusion)?;
        match self.show() {
            Show::Nothing => {}
            Show::JsonLines => say(&summary.to_string())?,
            Show::Table => {
                if failed > 0 {
                    say(&format!("{failed} of {} runs failed; the column `failure` has the reasons.", rows.len()))?;
                }
                self.say_conclusion(&conclusion)?;
                say(&format!("Results are in {shown}; open {}", argument(&format!("{shown}/{PAGE}"))))?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Prints the tables and sentences of the conclusions.
    fn say_conclusion(&self, conclusion: &Conclusions) -> anyhow::Result<()> {
        for (_, table) in &conclusion.tables {
            say(table.text_with(self.digits.count()).trim_end())?;
        }
        conclusion.sentences.iter().try_for_each(|sentence| say(&one_line(sentence)))
    }
}

/// Sets [`STOPPED`] at Ctrl-C; a second one ends the process.
fn stop_at_interruption() {
    at_interruption(|| {
        let is_second = STOPPED.swap(true, Ordering::Relaxed);
        if !is_second {
            complain("\nstopping after the runs that have begun; Ctrl-C again stops at once");
        }
        is_second
    });
}

/// The conclusions of a study as JSON, with the numbers of runs and of failed runs.
fn summary(study: &studies::Study, [runs, failed]: [usize; 2], conclusion: &Conclusions) -> serde_json::Value {
    let rows_of = |table: &Table| -> Vec<serde_json::Value> {
        table.json_lines().iter().filter_map(|line| serde_json::from_str(line).ok()).collect()
    };
    let tables = conclusion.tables.iter().map(|(name, table)| (name.clone(), serde_json::Value::from(rows_of(table))));
    json!({
        "event": "end",
        "version": studies::VERSION,
        "title": study.title(),
        "runs": runs,
        "failed": failed,
        "conclusions": conclusion.sentences,
        "columns": study.phases().iter().map(columns).collect::<serde_json::Map<_, _>>(),
        "tables": tables.collect::<serde_json::Map<_, _>>(),
    })
}

/// The columns of the rows of a phase, with their units, by the name of the phase.
fn columns(phase: &Phase) -> (String, serde_json::Value) {
    let column = |column: &Column| match column.words.is_empty() {
        true => json!({ "name": column.name, "unit": column.unit }),
        // The values are numbers of words.
        false => json!({ "name": column.name, "unit": column.unit, "words": column.words }),
    };
    (phase.name.to_owned(), phase.columns.iter().map(column).collect())
}
