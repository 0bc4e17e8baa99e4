//! `linkwright optimize FILE` and `linkwright resume DIR`.

use super::budget::Budget;
#[cfg(feature = "database")]
use super::database::WarmStart;
use super::interruption::at_interruption;
use super::model::{Edits, StartValues, located, model_file, parsed, with_program};
use super::output::{ClosedOutput, Digits, argument, complain, results};
use super::output_folder;
use super::progress::{Progress, RunningTime, Show, working};
use super::report::write_report;
use super::run_directory::{MODEL, Reserved, RunDirectory, RunRecord, fingerprint};
use anyhow::anyhow;
use clap::Args;
use linkwright::model_file::{Model, read};
use linkwright::problem::Problem;
use linkwright::report::between_points::warn_of_peaks_between_points;
use linkwright::report::outcome::failed_steps;
use linkwright::sao::{RunState, Status};
use linkwright::storage::Directory;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright optimize absorber.toml
  linkwright optimize absorber --set constraint.travel.at_most=0.8 --max-cycles 20
  linkwright optimize absorber --method mma --start k=0.5,c=0.4
  linkwright optimize four-bar.toml --out runs/four-bar --quiet
  linkwright optimize absorber.toml --json | jq .objective
  linkwright optimize absorber.toml --method mma --warm runs.db

Results are written to out/NAME, or to NAME in the folder LINKWRIGHT_OUT; to NAME-2, NAME-3, … if there is a run already. Every cycle is
stored before the next one begins; `linkwright resume` continues an interrupted run.")]
pub struct Optimize {
    /// The model file; `lift` means lift.toml
    file: PathBuf,
    /// Folder for the results [default: out/NAME, or the next of out/NAME-2, out/NAME-3, …]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder with other files, which stay as they are, or replace the run in the folder
    #[arg(long)]
    force: bool,
    /// Write the report at the end
    #[arg(long)]
    report: bool,
    /// A database of runs: takes analyses of this model that are in it, and adds new ones
    #[cfg(feature = "database")]
    #[arg(long, value_name = "FILE")]
    warm: Option<PathBuf>,
    #[command(flatten)]
    edits: Edits,
    #[command(flatten)]
    start: StartValues,
    #[command(flatten)]
    budget: Budget,
    #[command(flatten)]
    shown: ProgressForm,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright resume lift                the run in out/lift
  linkwright resume lift --max-cycles 80
  linkwright resume lift lift.toml      the same after an edit of lift.toml

Reads model.toml and state.json of the folder. You may edit [method], title and bounds of model.toml before, for instance
max_cycles, or give the edited model file; history.jsonl and summary.json record the edit. If the edited file has another problem, a new run
begins in the next numbered folder.")]
pub struct Resume {
    /// The folder of the run, or its name in the folder of results
    folder: PathBuf,
    /// The edited model file
    file: Option<PathBuf>,
    #[command(flatten)]
    edits: Edits,
    /// Continue from the state before the last one, if the last one is damaged
    #[arg(long)]
    previous: bool,
    #[command(flatten)]
    budget: Budget,
    #[command(flatten)]
    shown: ProgressForm,
}

#[derive(Args)]
pub struct ProgressForm {
    /// Print a line of JSON for each cycle, and one for the summary
    #[arg(long)]
    json: bool,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    #[command(flatten)]
    digits: Digits,
}

impl Optimize {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let (model, text) = self.edits.load(&self.file, &self.start)?;
        let problem = located(&model, model.problem())?;
        self.budget.check(&problem, model.method())?;
        let (warm, problem) = self.warm_start(&model, problem)?;
        let folder = match &self.out {
            Some(out) => RunDirectory::reserve(output_folder::create(out)?, self.force)?,
            None => numbered(&output_folder::name_of(&model_file(&self.file))?, self.force, &self.shown)?,
        };
        let (code, out) = begin(folder, (&model, &text, &self.file), &problem, &warm, &self.shown)?;
        let next = if self.report {
            format!("The report is {}", write_report(&out, None, true, None, Show::Nothing, &self.budget)?.display())
        } else {
            format!("Next: linkwright report {}", argument(&out.display().to_string()))
        };
        self.shown.show().note(&next).map(|()| code)
    }

    /// The database with which the run starts, and the problem that uses it.
    fn warm_start(&self, model: &Model, problem: Problem) -> anyhow::Result<(Warm, Problem)> {
        #[cfg(feature = "database")]
        if let Some(path) = &self.warm {
            let (warm, problem) = WarmStart::new(path, model, &model_file(&self.file), problem)?;
            return Ok((Some(warm), problem));
        }
        #[cfg(not(feature = "database"))]
        let _ = model;
        Ok((None, problem))
    }

    /// Begins a run in an open folder.
    #[allow(dead_code, reason = "for tests and fuzz targets")]
    pub fn in_directory(
        directory: Directory,
        model: &Model,
        text: &str,
        file: &Path,
        force: bool,
        shown: &ProgressForm,
    ) -> anyhow::Result<ExitCode> {
        let problem = located(model, model.problem())?;
        let folder = RunDirectory::reserve(directory, force)?;
        begin(folder, (model, text, file), &problem, &None, shown).map(|(code, _)| code)
    }
}

/// The database with which a run starts, if there is one.
#[cfg(feature = "database")]
type Warm = Option<WarmStart>;
#[cfg(not(feature = "database"))]
type Warm = Option<std::convert::Infallible>;

/// Stores new analyses in the database.
#[cfg_attr(not(feature = "database"), expect(unused_variables, reason = "there is no database"))]
fn save(warm: &Warm) {
    #[cfg(feature = "database")]
    if let Some(warm) = warm {
        warm.save();
    }
}

/// Begins a run of a model, with its text and file, in a reserved folder; also returns its path. An earlier run in the folder is replaced after the
/// analysis of the start design, so that it is not lost if that fails.
fn begin(
    reserved: Reserved,
    (model, text, file): (&Model, &str, &Path),
    problem: &Problem,
    warm: &Warm,
    shown: &ProgressForm,
) -> anyhow::Result<(ExitCode, PathBuf)> {
    let start = match first_state(&reserved, model, problem, shown) {
        Ok(start) => start,
        Err(error) => {
            reserved.withdraw();
            return Err(error);
        }
    };
    let mut folder = reserved.begin(model, text, file)?;
    let directory = folder.folder().directory().clone();
    let out = directory.path().to_owned();
    #[cfg(feature = "database")]
    if let Some(warm) = warm.as_ref().filter(|warm| warm.has_answers()) {
        folder.own_answers()?;
        if let Some(note) = warm.begin(&directory)? {
            shown.show().note(&note)?;
        }
    }
    let code = shown.run(model, problem, &mut folder, start, warm, &out)?;
    #[cfg(feature = "database")]
    if let Some(warm) = warm {
        shown.show().note(&warm.end(&directory))?;
    }
    Ok((code, out))
}

/// The state at the start design if the run replaces an earlier one.
fn first_state(
    reserved: &Reserved,
    model: &Model,
    problem: &Problem,
    shown: &ProgressForm,
) -> anyhow::Result<Option<RunState>> {
    if !reserved.has_run()? {
        return Ok(None);
    }
    let line = working("analysing the start", shown.show(), model);
    let state = located(model, model.method().start(problem));
    drop(line);
    state.map(Some).map_err(|error| anyhow!("{error:#}; the earlier run in {} is kept", reserved.path().display()))
}

/// The folder NAME in the folder of results, or the first of NAME-2, NAME-3, … without a run. With `force` it is NAME.
fn numbered(name: &str, force: bool, shown: &ProgressForm) -> anyhow::Result<Reserved> {
    let (folder, place) = output_folder::numbered(name, force, |directory| RunDirectory::reserve(directory, force))?;
    if let Some(place) = place {
        shown.show().note(&format!(
            "This run goes to {}; `optimize FILE --force` replaces the one in {}",
            place.display(),
            results().join(name).display()
        ))?;
    }
    Ok(folder)
}

/// The folder of a new run of a model file: the first of NAME, NAME-2, … in the default folder of results without a run.
#[cfg(feature = "app")]
pub fn next_folder(model: &Model, text: &str, file: &Path) -> anyhow::Result<RunDirectory> {
    numbered(&output_folder::name_of(file)?, false, &ProgressForm::QUIET)?.begin(model, text, file)
}

impl Resume {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let path = output_folder::stored(&self.folder);
        let directory = output_folder::opened(&path)?;
        if self.file.is_none() && self.edits.is_empty() {
            return Self::in_directory(directory, self.previous, Some(&self.budget), &self.shown);
        }
        let record = RunRecord::read(&directory)?;
        let (model, text) = match &self.file {
            Some(file) => self.edits.load_again(file)?,
            None => {
                let (model, text) = self.edits.change(&path.join(MODEL), parsed(&directory, MODEL)?.1)?;
                // The program is in the folder of the model file with which the run began.
                (with_program(model, Path::new(&record.file)), text)
            }
        };
        if record.fingerprint == fingerprint(&model) {
            let model = model.copied_from(&record.file);
            let (folder, ..) = RunDirectory::claim(directory)?;
            // An edit with which the run cannot continue is not kept.
            folder.continued(&model, &located(&model, model.problem())?, self.previous)?;
            folder.edit(&text)?;
            return self.shown.resume(folder, model, &text, self.previous, Some(&self.budget));
        }
        let show = self.shown.show();
        show.note("The problem has changed, a new run begins:")?;
        for change in super::run_directory::changes(&record.model, &text)? {
            show.note(&format!("  {change}"))?;
        }
        // It begins at the start, which its bounds must contain.
        let source = self.file.as_ref().map_or_else(|| path.join(MODEL), |file| model_file(file));
        read(&source.display().to_string(), &text)?;
        let problem = located(&model, model.problem())?;
        self.budget.check(&problem, model.method())?;
        let file = self.file.as_ref().map_or_else(|| path.clone(), |file| model_file(file));
        let folder = numbered(&output_folder::name_of(&file)?, false, &self.shown)?;
        begin(folder, (&model, &text, &file), &problem, &None, &self.shown).map(|(code, _)| code)
    }

    /// Continues the run of an open folder.
    pub fn in_directory(
        directory: Directory,
        previous: bool,
        budget: Option<&Budget>,
        shown: &ProgressForm,
    ) -> anyhow::Result<ExitCode> {
        let (folder, model, text) = RunDirectory::claim(directory)?;
        shown.resume(folder, model, &text, previous, budget)
    }
}

impl ProgressForm {
    /// Prints nothing.
    #[allow(dead_code, reason = "for tests and fuzz targets")]
    pub const QUIET: Self = Self { json: false, quiet: true, digits: Digits { digits: 5 } };

    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }

    /// Continues the run of a claimed folder; prints which settings have changed.
    fn resume(
        &self,
        mut folder: RunDirectory,
        model: Model,
        text: &str,
        previous: bool,
        budget: Option<&Budget>,
    ) -> anyhow::Result<ExitCode> {
        let problem = located(&model, model.problem())?;
        budget.map_or(Ok(()), |budget| budget.check(&problem, model.method()))?;
        for change in folder.changes(text)? {
            self.show().note(&format!("Changed {change}"))?;
        }
        let state = folder.resume(&model, &problem, text, previous)?;
        let out = folder.folder().directory().path().to_owned();
        self.run(&model, &problem, &mut folder, state, &None, &out)
    }

    /// Runs to the end, from a state or from the start design. A closed standard output interrupts the run.
    fn run(
        &self,
        model: &Model,
        problem: &Problem,
        folder: &mut RunDirectory,
        state: Option<RunState>,
        warm: &Warm,
        out: &Path,
    ) -> anyhow::Result<ExitCode> {
        announce_interruptions(out);
        folder.keep_answers(model)?;
        self.cycles(model, problem, folder, state, warm, out).map_err(|error| match error.is::<ClosedOutput>() {
            true => anyhow!(
                "{ClosedOutput}; `linkwright resume {}` continues the run",
                argument(&out.display().to_string())
            ),
            false => error,
        })
    }

    /// Writes every cycle before the next one begins.
    fn cycles(
        &self,
        model: &Model,
        problem: &Problem,
        folder: &mut RunDirectory,
        state: Option<RunState>,
        warm: &Warm,
        out: &Path,
    ) -> anyhow::Result<ExitCode> {
        let show = self.show();
        let progress = Progress::new(problem, show, model.method().stop, self.digits.count(), RunningTime::of(model));
        progress.head()?;
        let state = match state {
            Some(state) => state,
            None => {
                progress.analysing_the_start();
                located(model, model.method().start(problem))?
            }
        };
        let mut state = restarted(model, problem, state)?;
        let mut summary = folder.save(model, problem, &mut state)?;
        save(warm);
        let before = state.history.len();
        progress.cycles(&state, before.saturating_sub(1), 0)?;
        while state.status == Status::Running {
            let shown = state.history.len();
            state = located(model, model.method().step(problem, state))?;
            summary = folder.save(model, problem, &mut state)?;
            save(warm);
            progress.cycles(&state, shown, state.history.len() - before)?;
        }
        summary.warnings = problem.analysis.warnings(&state.design, &state.responses);
        summary.warnings.extend(warn_of_peaks_between_points(problem, &state));
        summary.warnings.extend(failed_steps(&state));
        folder.finish(problem, &state, &summary)?;
        progress.end(&summary)?;
        show.note(&format!("Results are in {}", out.display()))?;
        Ok(if state.status.is_success() { ExitCode::SUCCESS } else { ExitCode::from(3) })
    }
}

/// The state from which a run continues with the settings of a model. A run that has ended remains so if they allow no further
/// cycle.
fn restarted(model: &Model, problem: &Problem, state: RunState) -> linkwright::Result<RunState> {
    let again = model.method().restart(problem, state.clone())?;
    let stays = state.status != Status::Running && again.status == Status::CycleLimit;
    Ok(if stays { state } else { again })
}

/// Ends the process at Ctrl-C with a line that says how to continue. Every cycle is stored, so it may end at any moment.
fn announce_interruptions(out: &Path) {
    let text = format!("\ninterrupted; `linkwright resume {}` continues the run", argument(&out.display().to_string()));
    at_interruption(move || {
        complain(&text);
        true
    });
}
