//! `linkwright optimize FILE` and `linkwright resume DIR`.

use super::folder::{Edit, Folder, VERSION};
use super::progress::{Progress, Show};
use super::{load, tables};
use crate::cli::output::say;
use crate::model::Model;
use crate::problem::Problem;
use crate::sao::{State, Status};
use clap::Args;
use serde::Serialize;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright optimize absorber.toml
  linkwright optimize four-bar.toml --out runs/four-bar --quiet
  linkwright optimize absorber.toml --json | jq .objective

Exit codes: 0 converged, 1 an error, 2 wrong arguments, 3 ended without a solution (cycle limit, stalled, infeasible).")]
pub struct Optimize {
    /// The model file
    file: PathBuf,
    /// Folder for the results [default: out/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    shown: Shown,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright resume out/four-bar

Reads model.toml and state.json of the folder. [method] and bounds of model.toml may be edited in between, for instance
max_cycles; summary.json says so.
Exit codes: 0 converged, 1 an error, 2 wrong arguments, 3 ended without a solution.")]
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
        let out = self.out.clone().unwrap_or_else(|| PathBuf::from("out").join(name));
        let problem = model.problem()?;
        let folder = Folder::create(&out, &model, &text)?;
        let begun = model.method().start(&problem)?;
        let show = self.shown.show();
        let progress = Progress::new(&problem, show);
        progress.head()?;
        folder.save(&problem, &begun)?;
        progress.cycle(&begun)?;
        run(&model, &problem, &folder, begun, &progress)?.exit(show, &out)
    }
}

impl Resume {
    pub fn run(&self) -> anyhow::Result<ExitCode> {
        let (mut folder, model, text) = Folder::open(&self.folder)?;
        let problem = model.problem()?;
        let state = match folder.resume(&problem, &text)? {
            Some(state) => state,
            None => model.method().start(&problem)?,
        };
        let show = self.shown.show();
        let progress = Progress::new(&problem, show);
        progress.head()?;
        progress.cycle(&state)?;
        run(&model, &problem, &folder, state, &progress)?.exit(show, &self.folder)
    }
}

impl Shown {
    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }
}

/// Goes on to the end; every cycle is written before the next one begins.
fn run(
    model: &Model,
    problem: &Problem,
    folder: &Folder,
    mut state: State,
    progress: &Progress<'_>,
) -> anyhow::Result<Summary> {
    (state.status, state.reason) = model.method().stop.test(problem, &state);
    while state.status == Status::Running {
        state = model.method().step(problem, state)?;
        folder.save(problem, &state)?;
        progress.cycle(&state)?;
    }
    let summary = Summary::of(model, problem, &state, folder.edits());
    folder.save(problem, &state)?;
    folder.finish(problem, &state, &serde_json::to_string_pretty(&summary)?)?;
    progress.end(&summary)?;
    Ok(summary)
}

/// The result of a run, as it is written.
#[derive(Serialize)]
pub struct Summary {
    event: &'static str,
    version: u32,
    program: &'static str,
    title: String,
    fingerprint: String,
    status: Status,
    reason: String,
    cycles: usize,
    analyses: usize,
    sensitivity_analyses: usize,
    /// By which method the last of them would be taken, where there is a choice.
    #[serde(skip_serializing_if = "Option::is_none")]
    differentiation: Option<&'static str>,
    subproblem_iterations: usize,
    objective: Named,
    violation_pct: f64,
    design: Vec<Named>,
    constraints: Vec<Nearest>,
    /// When the model was edited during the run.
    edits: Vec<Edit>,
}

/// A number with its name and unit.
#[derive(Serialize)]
struct Named {
    name: String,
    unit: String,
    value: f64,
}

/// A constraint where it is nearest to or farthest beyond its limit.
#[derive(Serialize)]
struct Nearest {
    name: String,
    /// Normalised value; feasible means at most one.
    value: f64,
    time: Option<f64>,
}

impl Summary {
    fn of(model: &Model, problem: &Problem, state: &State, edits: &[Edit]) -> Self {
        let named = |(v, b): (&crate::problem::DesignVariable, &f64)| Named {
            name: v.name.clone(),
            unit: v.unit.clone(),
            value: *b,
        };
        let nearest = |row: crate::problem::RowId| {
            let constraint = &problem.constraints[row.constraint];
            let grid = constraint.quantity.grid().filter(|_| constraint.quantity.is_transient());
            Nearest {
                name: constraint.name.clone(),
                value: state.evaluation.constraints[row.constraint][row.point],
                time: grid.map(|g| problem.grids[g].points[row.point]),
            }
        };
        let objective = Named {
            name: problem.objective_name.clone(),
            unit: problem.objective_unit.clone(),
            value: state.evaluation.objective,
        };
        Self {
            event: "end",
            version: VERSION,
            program: env!("CARGO_PKG_VERSION"),
            title: model.title().to_owned(),
            fingerprint: format!("{:016x}", model.fingerprint()),
            status: state.status,
            reason: state.reason.clone(),
            cycles: state.cycles(),
            analyses: state.counters.analyses,
            sensitivity_analyses: state.counters.sensitivity_analyses,
            differentiation: model.method().differentiation(problem, state),
            subproblem_iterations: state.counters.subproblem_iterations,
            objective,
            violation_pct: state.evaluation.max_violation_pct(),
            design: problem.variables.iter().zip(&state.design).map(named).collect(),
            constraints: tables::worst(problem, &state.evaluation).into_iter().map(nearest).collect(),
            edits: edits.to_vec(),
        }
    }

    /// The summary for a reader.
    pub fn text(&self) -> String {
        let mut lines = vec![format!("\n{:?}: {}.", self.status, self.reason)];
        let method = self.differentiation.map_or_else(String::new, |name| format!(" ({name})"));
        lines.push(format!(
            "{} cycles, {} analyses, {} sensitivity analyses{method}.",
            self.cycles, self.analyses, self.sensitivity_analyses
        ));
        let row = |n: &Named| format!("  {:<24} {:>16.9e} {}", n.name, n.value, n.unit).trim_end().to_owned();
        lines.push(row(&self.objective));
        // The bound of a peak is the objective itself.
        lines.extend(self.design.iter().filter(|b| b.name != self.objective.name).map(row));
        lines.push(format!("  {:<24} {:>16.3e} %", "largest violation", self.violation_pct));
        lines.join("\n")
    }

    /// The exit code, and a line on where the results are.
    fn exit(&self, show: Show, out: &std::path::Path) -> anyhow::Result<ExitCode> {
        if show == Show::Table {
            say(&format!("Results are in {}", out.display()))?;
        }
        Ok(if self.status.is_success() { ExitCode::SUCCESS } else { ExitCode::from(3) })
    }
}
