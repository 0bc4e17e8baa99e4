//! `linkwright compare PROBLEM`, `linkwright compare FILE` and `linkwright compare --suite SUITE`.

mod suite;

use self::suite::{Comparison, SuiteName};
use super::budget::Budget;
use super::model::{ModelSettings, is_file, located};
use super::output::{Digits, results, say};
use super::output_folder::OutputFolder;
use super::progress::{Show, Task, working};
use clap::Args;
use linkwright::cases::suite::Suite;
use linkwright::cases::{Attempt, CatalogueEntry, Conclusion, attempt, catalogue, find, kkt_residual};
use linkwright::model_file::Model;
use linkwright::problem::Problem;
use linkwright::report::benchmark::{distances, profile, summary, table};
use linkwright::report::number::with_unit;
use linkwright::report::outcome;
use linkwright::report::table::{Cell, Table};
use linkwright::sao::{Cycle, Method, Preset, RunState, Stop, preset, presets};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright compare --list
  linkwright compare impact-absorber
  linkwright compare slider-crank --methods slp,gcmma,hessian --out out
  linkwright compare --all
  linkwright compare lift.toml --methods slp,mma,gcmma
  linkwright compare --suite hs --methods sqp-filter,bfgs
  linkwright compare --suite all --transform objective=1e6 --transform variables=1e-3

For a model file, its own method is run, too, and all methods use its accuracy and cycle limit. Its columns:
  end             of the run; `not optimal` for one whose own stop test holds, but not the optimality conditions at its end,
                  and whose objective is worse than the best one
  above best      relative to the best feasible end of a run, or to a design in any cycle that is better by more than 1e-4; negative only for
                  an end that violates constraints. A best objective near zero counts as a millionth of its distance from that of the start
  kkt residual    of the optimality conditions at the end, computed in the same way for all methods
The column `end` for a problem with known optima:
  optimum         converged to a known optimum
  other optimum   converged to another point that satisfies the optimality conditions
  cycle limit, stalled, infeasible
                  not converged, and reported as such
  FALSE           reported as converged, but the optimality conditions do not hold
The column `verdict` of a suite:
  optimum         converged to the best known optimum: objective within 1e-5, violation within 1e-5 of the terms of the row
  local optimum   converged to another point, which a local search does not improve
  correct end     the problem has no solution: infeasible and reported so, or unbounded and not reported as converged
  honest end      nothing claimed, or infeasible at a local minimum of the violation
  FALSE           another claim; the command then ends with an error
A transformation is KEY=NUMBER,...: factors `objective`, `variables`, `constraints`; `offset` of the objective; `start` of all
variables; `random` half width of the start and its `seed`; `points` of a problem of the suite time; `noise` of all responses,
which are then differentiated by noise-aware differences and judged to ten times the noise; `explicit` alone for functions that are
given directly (suites hs and adversarial). `scalings`, `starts` and `all` are
sets of them.")]
pub struct Compare {
    /// Name of a problem, see --list, or a model file
    #[arg(value_name = "PROBLEM|FILE", required_unless_present_any = ["all", "list", "suite"], conflicts_with_all = ["all", "list", "suite"])]
    problem: Option<String>,
    /// Run all problems with a cheap analysis, and draw a performance profile
    #[arg(long, conflicts_with_all = ["list", "suite"])]
    all: bool,
    /// Run all problems of a suite and judge every run
    #[arg(long, value_name = "SUITE", conflicts_with = "list")]
    suite: Option<SuiteName>,
    /// Transformation of the problems of a suite; can be given several times [default: standard]
    #[arg(long, value_name = "TRANSFORMATION", requires = "suite")]
    transform: Vec<String>,
    /// Runs of other optimizers for the summary and the profiles, as `benches/peers/optimizers.py` writes them
    #[arg(long, value_name = "FILE", requires = "suite")]
    peers: Option<PathBuf>,
    /// Names of methods, separated by commas [default: all]
    #[arg(long, visible_alias = "method", value_name = "METHODS", value_delimiter = ',')]
    methods: Vec<String>,
    /// Folder for tables and figures [default: out/compare]
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print a line of JSON for each row instead of the table
    #[arg(long, conflicts_with = "list")]
    json: bool,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with_all = ["json", "list"])]
    quiet: bool,
    /// Print the names of problems and methods
    #[arg(long)]
    list: bool,
    #[command(flatten)]
    settings: ModelSettings,
    #[command(flatten)]
    digits: Digits,
    #[command(flatten)]
    budget: Budget,
}

impl Compare {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.list {
            return list();
        }
        if self.suite.is_none() {
            for (option, is_given) in [("--transform", !self.transform.is_empty()), ("--peers", self.peers.is_some())] {
                anyhow::ensure!(!is_given, "`{option}` is for the problems of a suite: give --suite, or leave it out");
            }
        }
        let methods = self.methods()?;
        let out = self.out.clone().unwrap_or_else(|| results().join("compare"));
        if let Some(suite) = self.suite {
            let (transformations, peers) = (&self.transform[..], self.peers.as_deref());
            return Comparison { suite, transformations, methods: &methods, peers, show: self.shown() }.run(&out);
        }
        if let Some(path) = self.problem.as_deref().filter(|name| is_file(name)) {
            return self.file(Path::new(path), &methods, &out);
        }
        let entries: Vec<&'static CatalogueEntry> = match &self.problem {
            Some(name) => {
                self.settings.check_none(name)?;
                vec![find(name)?]
            }
            None => catalogue().iter().filter(|e| !e.expensive).collect(),
        };
        let mut folder = OutputFolder::create(&out)?;
        let mut all = vec![];
        for entry in entries {
            all.push(self.one(entry, &methods, &mut folder)?);
        }
        if self.all {
            let summary = summary(&all)?;
            self.show(&summary)?;
            folder.write("summary.csv", summary.csv().as_bytes())?;
            folder.write_figure("profile", &profile(&all)?)?;
        }
        self.end("Tables and figures are", &out)
    }

    /// Runs the methods on the problem of a model file; prints and writes the table.
    fn file(&self, path: &Path, methods: &[&'static Preset], out: &Path) -> anyhow::Result<()> {
        let (model, _) = self.settings.load(path)?;
        let problem = located(&model, model.problem())?;
        self.budget.check(&problem, model.method())?;
        methods.iter().try_for_each(|preset| self.budget.check(&problem, &(preset.method)()))?;
        let work = working(&format!("optimizing {}", path.display()), self.progress(), None);
        let (rows, best) = file_runs(&model, &problem, methods, &work);
        drop(work);
        let table = file_table(&model, &problem, &rows, best.as_ref())?;
        self.show(&table)?;
        self.shown().text(&remarks(&problem, &rows, best.as_ref(), self.digits.count()).join("\n"))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        OutputFolder::create(out)?.write(&format!("{name}.csv"), table.csv().as_bytes())?;
        self.notes(rows.iter().filter_map(|row| Some((row.method, row.rejected()?))))?;
        self.end("The table is", out)
    }

    fn progress(&self) -> Show {
        Show::of(self.json, self.quiet)
    }

    fn shown(&self) -> OutputForm {
        match (self.json, self.quiet) {
            (true, _) => OutputForm::Json,
            (_, true) => OutputForm::Nothing,
            _ => OutputForm::Text(self.digits.count()),
        }
    }

    fn show(&self, table: &Table) -> anyhow::Result<()> {
        self.shown().table(table)
    }

    /// Prints the reasons why methods did not run.
    fn notes<'a>(&self, rejected: impl Iterator<Item = (&'a str, &'a str)>) -> anyhow::Result<()> {
        let mut rejected = rejected.filter(|_| matches!(self.shown(), OutputForm::Text(_)));
        rejected.try_for_each(|(method, why)| say(&format!("Note: {method} refused: {why}")))
    }

    fn end(&self, what: &str, out: &Path) -> anyhow::Result<()> {
        self.shown().text(&format!("{what} in {}", out.display()))
    }

    /// Runs the methods on one problem; prints and writes the table and the figure.
    fn one(
        &self,
        entry: &'static CatalogueEntry,
        methods: &[&'static Preset],
        folder: &mut OutputFolder,
    ) -> anyhow::Result<Vec<Attempt>> {
        let work = working(&format!("optimizing {}", entry.name), self.progress(), None);
        let counted = |preset: &&'static Preset| attempt(entry, preset).inspect(|_| work.count(methods.len()));
        let attempts = methods.par_iter().map(counted).collect::<Result<Vec<_>, _>>()?;
        drop(work);
        let table = table(entry, &attempts)?;
        self.show(&table)?;
        self.notes(attempts.iter().filter_map(|a| match &a.conclusion {
            Conclusion::Refused(why) => Some((a.method, why.as_str())),
            _ => None,
        }))?;
        folder.write(&format!("{}.csv", entry.name), table.csv().as_bytes())?;
        if attempts.iter().any(|a| !a.approach.is_empty()) {
            folder.write_figure(entry.name, &distances(&attempts)?)?;
        }
        Ok(attempts)
    }

    fn methods(&self) -> anyhow::Result<Vec<&'static Preset>> {
        if self.methods.is_empty() {
            return Ok(presets().iter().collect());
        }
        Ok(self.methods.iter().map(|name| preset(name)).collect::<Result<_, _>>()?)
    }
}

fn list() -> anyhow::Result<()> {
    say("Problems")?;
    for entry in catalogue() {
        let cost = if entry.expensive { " [expensive]" } else { "" };
        say(&format!("  {:<36} {}{cost}\n{:39}{}", entry.name, entry.title, "", entry.source))?;
    }
    for (suite, name) in [(Suite::HockSchittkowski, "hs"), (Suite::Adversarial, "adversarial"), (Suite::Time, "time")] {
        say(&format!("\nProblems of the suite {name}"))?;
        suite.problems().iter().try_for_each(|entry| say(&format!("  {:<36} {}", entry.name, entry.title)))?;
    }
    say("\nMethods")?;
    presets().iter().try_for_each(|p| say(&format!("  {:<22} {}", p.name, p.title)))
}

/// A method with the final state of its run, or the reason why it did not run.
struct FileRun {
    method: &'static str,
    end: Result<FinalState, String>,
}

struct FinalState {
    state: RunState,
    /// Largest residual of the optimality conditions, computed independently of the method.
    kkt: f64,
    /// True if the own stop test of the run holds, but not the optimality conditions at its end.
    is_doubtful: bool,
    /// False if a doubtful end is worse than the best design of all runs.
    is_optimal: bool,
}

/// Relative difference of objectives by which a design before the ends must be better than all of them: the tolerance of the violation may
/// allow less.
const BETTER: f64 = 1e-4;

/// The best feasible design in any cycle of any run.
#[derive(Clone, Copy)]
struct BestSeen {
    method: &'static str,
    objective: f64,
    /// Unit of differences from this objective: its magnitude or, if that is nearly zero, a part of its distance from that of the start.
    unit: f64,
    /// To first order, the part of the objective that is gained by violated constraints.
    gain: f64,
    cycle: usize,
    /// True if it is the end of the run.
    is_end: bool,
}

impl BestSeen {
    /// `None` if no run has seen a design whose violations are at most `tolerance`, a fraction.
    fn new(problem: &Problem, rows: &[FileRun], tolerance: f64) -> Option<Self> {
        let sign = problem.objective.signed().sign;
        let of_run = |row: &FileRun| -> Vec<Self> {
            let Ok(FinalState { state, .. }) = &row.end else { return vec![] };
            let objectives = outcome::objectives(problem, state).unwrap_or_default();
            let start = objectives.first().copied().unwrap_or(0.0);
            let end = state.history.iter().rposition(|cycle| cycle.accepted);
            let seen = |(k, (cycle, objective)): (usize, (&Cycle, f64))| {
                let is_feasible =
                    cycle.failure.is_none() && cycle.violation_pct <= 100.0 * tolerance && objective.is_finite();
                let gain = state.gain_of_violation() * cycle.violation_pct.max(0.0) / 100.0;
                let (method, cycle, is_end) = (row.method, cycle.cycle, Some(k) == end);
                let unit = objective.abs().max(outcome::OF_DECREASE * (start - objective).abs());
                is_feasible.then_some(Self { method, objective, unit, gain, cycle, is_end })
            };
            state.history.iter().zip(objectives).enumerate().filter_map(seen).collect()
        };
        let all: Vec<Self> = rows.iter().flat_map(of_run).collect();
        let merit = |seen: &Self| sign * seen.objective + seen.gain;
        let order = |a: &&Self, b: &&Self| merit(a).total_cmp(&merit(b));
        let best = all.iter().min_by(order).copied()?;
        let end = all.iter().filter(|seen| seen.is_end).min_by(order).copied();
        let is_equal = |end: &Self| merit(end) - merit(&best) <= BETTER * best.unit;
        Some(end.filter(is_equal).unwrap_or(best))
    }
}

/// Name of the method of the model file.
const OWN: &str = "(the file's)";

/// Name of an end whose own stop test holds, but not the optimality conditions.
const NOT_OPTIMAL: &str = "not optimal";

/// Largest residual of the optimality conditions at which a run counts as converged; a stop test of the file may be stricter, but not weaker.
fn residual_limit(stop: &Stop) -> f64 {
    stop.residual.min(Stop::default().residual)
}

/// Runs the method of the file and the given ones on its problem, in parallel. All use the stop test of the file. Returns the runs, solutions
/// with the least work first, and the best design that they have seen.
fn file_runs(
    model: &Model,
    problem: &Problem,
    presets: &[&'static Preset],
    work: &Task,
) -> (Vec<FileRun>, Option<BestSeen>) {
    let stop = model.method().stop;
    let counted = |name, method: &Method| {
        let run = file_run(name, method, problem);
        work.count(presets.len() + 1);
        run
    };
    let own = [counted(OWN, model.method())];
    let others: Vec<FileRun> =
        presets.par_iter().map(|preset| counted(preset.name, &Method { stop, ..(preset.method)() })).collect();
    let mut all: Vec<FileRun> = own.into_iter().chain(others).collect();
    let tolerance = Stop::default().accuracy;
    let best = BestSeen::new(problem, &all, tolerance);
    // A doubtful end that is as good as the best design is one: its residual may be that of other active rows.
    for end in all.iter_mut().filter_map(|row| row.end.as_mut().ok()) {
        let is_feasible = end.state.evaluation.max_violation_pct() <= 100.0 * tolerance;
        let is_best = is_feasible && best.as_ref().is_some_and(|best| above(problem, end, best) <= tolerance);
        end.is_optimal = is_best || !end.is_doubtful;
    }
    all.sort_by_key(FileRun::rank);
    (all, best)
}

/// (F − F*) / max(|F*|, 1e-6 |F⁰ − F*|) with the objectives F* of the best design and F⁰ of the start; negative if the end is better.
fn above(problem: &Problem, end: &FinalState, best: &BestSeen) -> f64 {
    let objective = outcome::objective(problem, &end.state.design, &end.state.evaluation);
    let excess = problem.objective.signed().sign * (objective - best.objective);
    if excess == 0.0 { 0.0 } else { excess / best.unit }
}

fn file_run(method: &'static str, settings: &Method, problem: &Problem) -> FileRun {
    let end = settings.solve(problem, |_| ()).map(|state| {
        let kkt = kkt_residual(problem, &state).unwrap_or(f64::NAN);
        let is_doubtful = state.status.is_success() && kkt > residual_limit(&settings.stop);
        FinalState { state, kkt, is_doubtful, is_optimal: true }
    });
    FileRun { method, end: end.map_err(|error| error.to_string()) }
}

impl FileRun {
    /// The reason why the method did not run.
    fn rejected(&self) -> Option<&str> {
        self.end.as_ref().err().map(String::as_str)
    }

    /// Compares two runs: solutions first, then the least work.
    fn rank(&self) -> (u8, usize) {
        match &self.end {
            Ok(FinalState { state, is_optimal, .. }) => {
                let counters = state.counters;
                let is_solution = state.status.is_success() && *is_optimal;
                (u8::from(!is_solution), counters.analyses + counters.sensitivity_analyses)
            }
            Err(_) => (2, 0),
        }
    }
}

/// One row for each method, successful runs with the least work first. `above_best` is the distance of the objective from that of the best
/// feasible design, see [`above`].
fn file_table(
    model: &Model,
    problem: &Problem,
    rows: &[FileRun],
    best: Option<&BestSeen>,
) -> linkwright::Result<Table> {
    let columns = [
        "method",
        "end",
        "cycles",
        "analyses",
        "sensitivity_analyses",
        "objective",
        "above_best",
        "violation_pct",
        "kkt_residual",
    ];
    let stated = |state: &RunState| outcome::objective(problem, &state.design, &state.evaluation);
    let unit = &problem.objective.unit;
    let heading = |name: &str| match name {
        "objective" if !unit.is_empty() => format!("objective [{unit}]"),
        "violation_pct" => "violation [%]".to_owned(),
        name => name.replace('_', " "),
    };
    let mut table = Table::new(model.title(), columns).headed(columns.map(heading))?;
    for row in rows {
        let name = Cell::from(row.method);
        let Ok(end @ FinalState { state, kkt, is_optimal, .. }) = &row.end else {
            let nothing = std::iter::repeat_n(Cell::Empty, columns.len() - 2);
            table.push([name, "refused".into()].into_iter().chain(nothing))?;
            continue;
        };
        let objective = stated(state);
        let number = |v: f64| if v.is_finite() { Cell::Number(v) } else { Cell::Empty };
        table.push([
            name,
            if *is_optimal { state.status.to_string().as_str().into() } else { NOT_OPTIMAL.into() },
            state.cycles().into(),
            state.counters.analyses.into(),
            state.counters.sensitivity_analyses.into(),
            number(objective),
            best.map_or(Cell::Empty, |best| number(above(problem, end, best))),
            if problem.constraints.is_empty() { Cell::Empty } else { number(state.evaluation.max_violation_pct()) },
            number(*kkt),
        ])?;
    }
    Ok(table)
}

/// Sentences below the table: the design to which `above_best` refers, and the meaning of the residuals.
fn remarks(problem: &Problem, rows: &[FileRun], best: Option<&BestSeen>, digits: usize) -> Vec<String> {
    let mut all = vec![match best {
        Some(BestSeen { method, objective, cycle, is_end, .. }) => {
            let value = with_unit(*objective, &problem.objective.unit, digits);
            let place = if *is_end {
                format!("the end of {method}")
            } else {
                format!("cycle {cycle} of {method}, before its end")
            };
            format!("The best feasible design of all cycles has the objective {value}: {place}.")
        }
        None => "No run has seen a feasible design.".to_owned(),
    }];
    let ends = || rows.iter().filter_map(|row| Some((row.method, row.end.as_ref().ok()?)));
    let doubtful: Vec<&str> = ends().filter(|(_, end)| end.is_doubtful).map(|(method, _)| method).collect();
    if !doubtful.is_empty() {
        all.push(format!(
            "The optimality conditions do not hold at the end of {}, although its own stop test is met: that of the presets uses the residual at the \
             start of the last cycle, and `kkt residual` is that of the last design, the largest first-order change of the objective over the scale of a \
             variable, relative to the objective. A smaller `accuracy` in [method] continues such a run.",
            doubtful.join(", ")
        ));
    }
    all
}

/// Form of the output of a comparison.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum OutputForm {
    /// Text with this number of significant digits.
    Text(usize),
    Json,
    Nothing,
}

impl OutputForm {
    /// Prints a table, as text or as a line of JSON for each row.
    pub fn table(self, table: &Table) -> anyhow::Result<()> {
        match self {
            Self::Text(digits) => say(&table.text_with(digits)),
            Self::Json => table.json_lines().iter().try_for_each(|line| say(line)),
            Self::Nothing => Ok(()),
        }
    }

    /// Prints a line that is not part of the JSON.
    pub fn text(self, line: &str) -> anyhow::Result<()> {
        if matches!(self, Self::Text(_)) { say(line) } else { Ok(()) }
    }
}
