//! `linkwright optimize FILE` and `linkwright resume DIR`.

use super::budget::Budget;
use super::folder;
use super::model::{load, located};
use super::output::{ClosedOutput, results};
use super::progress::{Progress, Show};
use super::report::write_report;
use super::run_directory::RunDirectory;
use anyhow::{Context, anyhow};
use clap::Args;
use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::sao::{State, Status};
use linkwright::storage::Directory;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright optimize absorber.toml
  linkwright optimize four-bar.toml --out runs/four-bar --quiet
  linkwright optimize absorber.toml --json | jq .objective

Results are written to out/NAME, or to NAME in the folder LINKWRIGHT_OUT. Every cycle is stored before the next one begins;
`linkwright resume` continues an interrupted run.")]
pub struct Optimize {
    /// The model file
    file: PathBuf,
    /// Folder for the results [default: out/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder with other files, which stay as they are, or replace the run in the folder
    #[arg(long)]
    force: bool,
    /// Write the report at the end
    #[arg(long)]
    report: bool,
    #[command(flatten)]
    budget: Budget,
    #[command(flatten)]
    shown: Shown,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright resume out/four-bar

Reads model.toml and state.json of the folder. You may edit [method], title and bounds of model.toml before, for instance
max_cycles; history.jsonl and summary.json record the edit.")]
pub struct Resume {
    /// The folder of the run
    folder: PathBuf,
    /// Continue from the state before the last one, if the last one is damaged
    #[arg(long)]
    previous: bool,
    #[command(flatten)]
    budget: Budget,
    #[command(flatten)]
    shown: Shown,
}

#[derive(Args)]
pub struct Shown {
    /// Print a line of JSON for each cycle, and one for the summary
    #[arg(long)]
    json: bool,
    /// Print nothing on standard output
    #[arg(long, conflicts_with = "json")]
    quiet: bool,
}

impl Optimize {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let (model, text) = load(&self.file)?;
        let problem = located(&model, model.problem())?;
        self.budget.check(&problem, model.method())?;
        let directory = self.directory()?;
        let out = directory.path().to_owned();
        let code = Self::in_directory(directory, &model, &text, &self.file, self.force, &self.shown)?;
        let next = if self.report {
            format!("The report is {}", write_report(&out, None, true)?.display())
        } else {
            format!("Next: linkwright report {}", out.display())
        };
        self.shown.show().note(&next).map(|()| code)
    }

    /// Begins a run in an open folder.
    pub fn in_directory(
        directory: Directory,
        model: &Model,
        text: &str,
        file: &Path,
        force: bool,
        shown: &Shown,
    ) -> anyhow::Result<ExitCode> {
        let problem = located(model, model.problem())?;
        let out = directory.path().to_owned();
        let mut folder = RunDirectory::create(directory, model, text, file, force)?;
        let begun = located(model, model.method().start(&problem))?;
        shown.run(model, &problem, &mut folder, begun, &out)
    }

    /// The given folder, or that of the file's name in the folder of results.
    fn directory(&self) -> anyhow::Result<Directory> {
        if let Some(out) = &self.out {
            return folder::create(out);
        }
        let name = self.file.file_stem().and_then(|name| name.to_str()).filter(|name| !name.starts_with('.'));
        let name = name.with_context(|| {
            format!("the name of {} is not one for a folder; give a folder with --out", self.file.display())
        })?;
        folder::in_results(&results(), name)
    }
}

impl Resume {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let directory = Directory::open(&self.folder);
        let directory = directory.with_context(|| format!("{} has no run in it", self.folder.display()))?;
        Self::in_directory(directory, self.previous, Some(&self.budget), &self.shown)
    }

    /// Continues the run of an open folder.
    pub fn in_directory(
        directory: Directory,
        previous: bool,
        budget: Option<&Budget>,
        shown: &Shown,
    ) -> anyhow::Result<ExitCode> {
        let out = directory.path().to_owned();
        let (mut folder, model, text) = RunDirectory::claim(directory)?;
        let problem = located(&model, model.problem())?;
        budget.map_or(Ok(()), |budget| budget.check(&problem, model.method()))?;
        let state = match folder.resume(&model, &problem, &text, previous)? {
            Some(state) => state,
            None => located(&model, model.method().start(&problem))?,
        };
        shown.run(&model, &problem, &mut folder, state, &out)
    }
}

impl Shown {
    /// Prints nothing.
    #[allow(dead_code, reason = "for tests and fuzz targets")]
    pub const QUIET: Self = Self { json: false, quiet: true };

    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }

    /// Runs to the end. A closed standard output is an interruption.
    fn run(
        &self,
        model: &Model,
        problem: &Problem,
        folder: &mut RunDirectory,
        state: State,
        out: &Path,
    ) -> anyhow::Result<ExitCode> {
        self.cycles(model, problem, folder, state, out).map_err(|error| match error.is::<ClosedOutput>() {
            true => anyhow!("{ClosedOutput}; `linkwright resume {}` continues the run", out.display()),
            false => error,
        })
    }

    /// Writes every cycle before the next one begins.
    fn cycles(
        &self,
        model: &Model,
        problem: &Problem,
        folder: &mut RunDirectory,
        mut state: State,
        out: &Path,
    ) -> anyhow::Result<ExitCode> {
        let show = self.show();
        let progress = Progress::new(problem, show, model.method().stop);
        progress.head()?;
        (state.status, state.reason) = model.method().stop.test(problem, &state);
        let mut summary = folder.save(model, problem, &mut state)?;
        progress.cycle(&state, 0)?;
        let before = state.history.len();
        while state.status == Status::Running {
            state = model.method().step(problem, state)?;
            summary = folder.save(model, problem, &mut state)?;
            progress.cycle(&state, state.history.len() - before)?;
        }
        folder.finish(problem, &state, &summary)?;
        progress.end(&summary)?;
        show.note(&format!("Results are in {}", out.display()))?;
        Ok(if state.status.is_success() { ExitCode::SUCCESS } else { ExitCode::from(3) })
    }
}
