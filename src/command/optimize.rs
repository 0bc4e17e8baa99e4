//! `linkwright optimize FILE` and `linkwright resume DIR`.

use super::model::{load, located};
use super::output::results;
use super::progress::{Progress, Show};
use super::report::write_report;
use super::run_directory::RunDirectory;
use clap::Args;
use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::sao::{State, Status};
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
    /// Write the report at the end
    #[arg(long)]
    report: bool,
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
    #[command(flatten)]
    shown: Shown,
}

#[derive(Args)]
struct Shown {
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
        let name = self.file.file_stem().unwrap_or_default();
        let out = self.out.clone().unwrap_or_else(|| results().join(name));
        let problem = located(&model, model.problem())?;
        let mut folder = RunDirectory::create(&out, &model, &text, &self.file)?;
        let begun = located(&model, model.method().start(&problem))?;
        let code = self.shown.run(&model, &problem, &mut folder, begun, &out)?;
        let next = if self.report {
            format!("The report is {}", write_report(&out, None, true)?.display())
        } else {
            format!("Next: linkwright report {}", out.display())
        };
        self.shown.show().note(&next).map(|()| code)
    }
}

impl Resume {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let (mut folder, model, text) = RunDirectory::open(&self.folder)?;
        let problem = located(&model, model.problem())?;
        folder.claim()?;
        let state = match folder.resume(&problem, &text)? {
            Some(state) => state,
            None => located(&model, model.method().start(&problem))?,
        };
        self.shown.run(&model, &problem, &mut folder, state, &self.folder)
    }
}

impl Shown {
    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }

    /// Runs to the end; writes every cycle before the next one begins.
    fn run(
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
        let mut summary = folder.save(model, problem, &state)?;
        progress.cycle(&state, 0)?;
        let before = state.history.len();
        while state.status == Status::Running {
            state = model.method().step(problem, state)?;
            summary = folder.save(model, problem, &state)?;
            progress.cycle(&state, state.history.len() - before)?;
        }
        folder.finish(problem, &state, &summary)?;
        progress.end(&summary)?;
        show.note(&format!("Results are in {}", out.display()))?;
        Ok(if state.status.is_success() { ExitCode::SUCCESS } else { ExitCode::from(3) })
    }
}
