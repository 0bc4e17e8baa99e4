//! `linkwright optimize FILE` and `linkwright resume DIR`.

use super::folder::Folder;
use super::progress::{Progress, Show};
use super::{load, located};
use crate::command::output::results;
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

The folder is out/NAME, or NAME in the folder that LINKWRIGHT_OUT names. Every cycle is in it before the next one begins; a run
that was killed goes on with `linkwright resume`.")]
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

Reads model.toml and state.json of the folder. [method] and bounds of model.toml may be edited in between, for instance
max_cycles; history.jsonl and summary.json say so.")]
pub struct Resume {
    /// The folder of the run
    folder: PathBuf,
    #[command(flatten)]
    shown: Shown,
}

#[derive(Args)]
struct Shown {
    /// One line of JSON for each cycle and the summary
    #[arg(long)]
    json: bool,
    /// Nothing on standard output
    #[arg(long, conflicts_with = "json")]
    quiet: bool,
}

impl Optimize {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let (model, text) = load(&self.file)?;
        let name = self.file.file_stem().unwrap_or_default();
        let out = self.out.clone().unwrap_or_else(|| results().join(name));
        let problem = located(&model, model.problem())?;
        let mut folder = Folder::create(&out, &model, &text, &self.file)?;
        let begun = located(&model, model.method().start(&problem))?;
        let code = self.shown.run(&model, &problem, &mut folder, begun, &out)?;
        let next = if self.report {
            format!("The report is {}", super::report::write_report(&out, None, true)?.display())
        } else {
            format!("Next: linkwright report {}", out.display())
        };
        self.shown.note(&next).map(|()| code)
    }
}

impl Resume {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let (mut folder, model, text) = Folder::open(&self.folder)?;
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
    /// Says what is for people only.
    fn note(&self, text: &str) -> anyhow::Result<()> {
        Show::of(self.json, self.quiet).note(text)
    }

    /// Goes on to the end; every cycle is written before the next one begins.
    fn run(
        &self,
        model: &Model,
        problem: &Problem,
        folder: &mut Folder,
        mut state: State,
        out: &Path,
    ) -> anyhow::Result<ExitCode> {
        let show = Show::of(self.json, self.quiet);
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
        self.note(&format!("Results are in {}", out.display()))?;
        Ok(if state.status.is_success() { ExitCode::SUCCESS } else { ExitCode::from(3) })
    }
}
