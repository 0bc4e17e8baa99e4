//! `linkwright check FILE` and `linkwright check PROBLEM`.

use super::budget::Budget;
use super::model::{At, ModelSettings, changed, design, is_file, located};
use super::output::{Digits, say};
use super::output_folder::OutputFolder;
use super::progress::{Show, working};
use clap::Args;
use linkwright::Error;
use linkwright::cases::find;
use linkwright::gradient_check::{GradientCheck, GradientStatus};
use linkwright::model_file::Model;
use linkwright::problem::{DesignVariable, Evaluation, Problem, ScalingAdvice};
use linkwright::report::gradient_check::{NO_DERIVATIVE, table, text};
use linkwright::report::number::{counted, readable, with_unit};
use linkwright::report::outcome;
use linkwright::report::table::one_line;
use linkwright::sao::Method;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Significant digits of sizes in advice.
const ADVISED: usize = 2;
/// Relative change up to which it is a rounding error.
const ROUNDING: f64 = 1e-12;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright check four-bar.toml                        every response at five times, at the start design
  linkwright check four-bar.toml --at d1=0.04,d2=0.03   another design
  linkwright check impact-absorber --points 10 --all    more times, all rows
  linkwright check four-bar.toml --response tip         one response
  linkwright check four-bar.toml --json > derivatives.jsonl
  linkwright check impact-absorber --out out            the whole table in out/derivatives.csv

Every derivative at one design is computed by every method that the analysis offers (direct, adjoint, semi-analytical) and by
extrapolated finite differences of whole analyses with an error estimate (column ±). The column `apart` is the largest
disagreement. Verdicts:
  right           all methods agree with the finite differences, but for those marked ~, which are too inaccurate here
                  by their own estimate
  constant        the response does not depend on the variable, and all methods give zero
  WRONG           a method contradicts the finite differences on both sides of the design, or the other methods; it is marked with a star
  kink            the response has a kink here or very close to it: a derivative is that of one side
  not repeatable  two analyses of one design differ
  unclear         the finite differences are too noisy, or contradict each other
  no derivative   the response has none, such as a reaction that redundant constraints leave indeterminate
A wrong derivative is an error, and so is a method that fails where another does not. Scales of variables and constraints that are far off are told before the table; the
default method depends on them less than the others.")]
pub struct Check {
    /// A model file, or a problem of the library (see `linkwright compare --list`)
    what: String,
    /// Time points of every response
    #[arg(long, default_value_t = 5)]
    points: usize,
    /// Only these responses, by name
    #[arg(long = "response", value_delimiter = ',', value_name = "NAME")]
    responses: Vec<String>,
    /// Show every derivative, not only the least accurate of each response and those that are not right
    #[arg(long)]
    all: bool,
    /// Print a line of JSON for each derivative, then one with the counts and the advice on scales
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    settings: ModelSettings,
    /// Folder for derivatives.csv
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    #[command(flatten)]
    digits: Digits,
    #[command(flatten)]
    budget: Budget,
}

impl Check {
    pub fn run(&self) -> anyhow::Result<()> {
        let model = self.model()?;
        let of_simulation = model.as_ref().filter(|model| !model.is_problem());
        if let Some(model) = of_simulation.filter(|model| model.variables().is_empty()) {
            return self.without_variables(model);
        }
        let problem = match &model {
            Some(model) if of_simulation.is_some() => located(model, model.simulation())?,
            Some(model) => located(model, model.problem())?,
            None => (find(&self.what)?.build)()?,
        };
        self.budget.check_table(&problem, model.as_ref().map_or(&Method::default(), Model::method))?;
        let b = design(&problem, &self.at)?;
        let work = working("analysing the design", Show::of(self.json, self.quiet), model.as_ref());
        // Without an objective there is nothing to which the scales of variables could be compared.
        let has_scales = !self.quiet && of_simulation.is_none();
        let scales = if has_scales { located(model.as_ref(), scales(&problem, &b))? } else { vec![] };
        drop(work);
        if !self.json && !self.quiet {
            let here = problem.analyze(&b).and_then(|responses| problem.evaluate(&b, &responses));
            let here = located(model.as_ref(), here)?;
            describe(&problem)?;
            if of_simulation.is_none() {
                describe_design(&problem, &b, &here, self.digits.count())?;
            }
            scales.iter().try_for_each(|line| say(line))?;
        }
        let numbers = self.numbers(&problem)?;
        let work = working("checking the derivatives", Show::of(self.json, self.quiet), model.as_ref());
        let checked = located(model.as_ref(), problem.check_responses(&b, self.points, &numbers))?;
        drop(work);
        let table = table(&problem, &checked)?;
        if self.json {
            table.json_lines().iter().try_for_each(|line| say(line))?;
            say(&counts(&checked, &scales).to_string())?;
        } else if !self.quiet {
            say(text(&problem, &checked, self.all, self.digits.count()).trim_end())?;
            say(&summary(&checked))?;
        }
        if let Some(out) = &self.out {
            let file = OutputFolder::create(out)?.write("derivatives.csv", table.csv().as_bytes())?;
            if !self.json && !self.quiet {
                say(&format!("The table is in {}", file.display()))?;
            }
        }
        let wrong = checked.count(GradientStatus::Wrong);
        anyhow::ensure!(wrong == 0, "{wrong} of the derivatives are wrong");
        let failed: Vec<&str> = checked.failed.iter().map(|(method, _)| method.as_str()).collect();
        anyhow::ensure!(failed.is_empty(), "of the methods, {} failed", failed.join(" and "));
        Ok(())
    }

    /// Indices of the responses to check.
    fn numbers(&self, problem: &Problem) -> anyhow::Result<Vec<usize>> {
        let known = || problem.responses.iter().map(|r| r.name.as_str());
        if self.responses.is_empty() {
            return Ok((0..problem.responses.len()).collect());
        }
        let number = |name: &String| {
            known().position(|k| k == name).ok_or_else(|| Error::unknown("response", name, known()).into())
        };
        self.responses.iter().map(number).collect()
    }

    /// The model file; `None` for a problem of the library.
    fn model(&self) -> anyhow::Result<Option<Model>> {
        if is_file(&self.what) {
            return Ok(Some(self.settings.load(Path::new(&self.what))?.0));
        }
        self.settings.check_none(&self.what)?;
        Ok(None)
    }

    /// A simulation that depends on nothing: it is done, and there is no derivative to check.
    fn without_variables(&self, model: &Model) -> anyhow::Result<()> {
        let design = changed(model.variables(), &self.at, None)?;
        self.budget.check_simulation(model)?;
        located(model, model.simulate(&design))?;
        match (self.json, self.quiet) {
            (true, _) => say(&counts(&GradientCheck::default(), &[]).to_string()),
            (_, true) => Ok(()),
            _ => say(&format!("{}: there is no design variable, so there are no derivatives", one_line(model.title()))),
        }
    }
}

fn describe(problem: &Problem) -> anyhow::Result<()> {
    // The two sides of a limit count as one constraint, and those that bound the peak of the objective do not count.
    let constraints: BTreeSet<&str> = outcome::stated_constraints(problem).map(|j| outcome::name(problem, j)).collect();
    say(&one_line(&format!(
        "{}: {}, {}, {}, {}",
        problem.name,
        counted(problem.n(), ["design variable", "design variables"]),
        counted(problem.responses.len(), ["response", "responses"]),
        counted(constraints.len(), ["constraint", "constraints"]),
        counted(problem.grids.first().map_or(0, |grid| grid.len()), ["time point", "time points"]),
    )))
}

fn describe_design(problem: &Problem, design: &[f64], here: &Evaluation, digits: usize) -> anyhow::Result<()> {
    let value = one_line(&with_unit(outcome::objective(problem, design, here), &problem.objective.unit, digits));
    if problem.constraints.is_empty() {
        return say(&format!("At this design the objective is {value}."));
    }
    let violation = readable(here.max_violation_pct(), digits);
    say(&format!("At this design the objective is {value} and the largest violation {violation} %."))
}

/// The scales that are far off, with what to write instead. None if the chosen method has no derivatives: another one may.
fn scales(problem: &Problem, design: &[f64]) -> linkwright::Result<Vec<String>> {
    match problem.scaling_advice(design) {
        Err(Error::Unsupported { .. }) => Ok(vec![]),
        advice => Ok(advice?.iter().map(|advice| one_line(&in_words(problem, advice))).collect()),
    }
}

/// A scale that is far off, and what to write instead.
fn in_words(problem: &Problem, advice: &ScalingAdvice) -> String {
    match *advice {
        ScalingAdvice::ShortVariable { variable, length, share, suggested } => {
            let DesignVariable { name, unit, .. } = &problem.variables[variable];
            if share < ROUNDING {
                return format!("Scale of `{name}`: nothing depends on it here to first order.");
            }
            format!(
                "Scale of `{name}`: over {} it changes nothing by more than {share:.0e} of what all variables do. It may be a constant, or \
                 its start and bounds are far too small: {} would matter as much as the others do.",
                with_unit(length, unit, ADVISED),
                with_unit(suggested, unit, ADVISED)
            )
        }
        ScalingAdvice::Constraint { constraint, scale, suggested } => {
            let (name, unit) = (outcome::name(problem, constraint), outcome::unit(problem, constraint));
            let size = with_unit(suggested, unit, ADVISED);
            let what = if problem.objective.peak().is_some_and(|peak| peak.constraints.contains(&constraint)) {
                "the objective".to_owned()
            } else {
                format!("`{name}`")
            };
            format!(
                "Scale of {what}: it is {}, but the values and their changes have the size {size}. Write `scale = {suggested:.1e}`.",
                with_unit(scale, unit, ADVISED)
            )
        }
    }
}

const STATUSES: [GradientStatus; 6] = [
    GradientStatus::Right,
    GradientStatus::Constant,
    GradientStatus::Wrong,
    GradientStatus::Kink,
    GradientStatus::NotRepeatable,
    GradientStatus::Unclear,
];

fn summary(checked: &GradientCheck) -> String {
    let counts = STATUSES.map(|f| (checked.count(f), f.text()));
    let without = (checked.without_derivatives.len(), "without derivatives");
    let words: Vec<String> = counts
        .iter()
        .chain([&without])
        .filter(|(count, _)| *count > 0)
        .map(|(count, text)| format!("{count} {text}"))
        .collect();
    match words.is_empty() {
        true => "There is nothing to check: without outputs, objective and constraints are differentiated exactly"
            .to_owned(),
        false => format!("{}, by {}", words.join(", "), checked.methods.join(", ")),
    }
}

/// The number of derivatives with each verdict, the methods that failed with the reasons, and the advice on scales.
fn counts(checked: &GradientCheck, scales: &[String]) -> serde_json::Value {
    let counts = STATUSES.iter().map(|f| (f.text().to_lowercase(), serde_json::Value::from(checked.count(*f))));
    let failed: serde_json::Value =
        checked.failed.iter().map(|(method, why)| (method.clone(), serde_json::Value::from(why.as_str()))).collect();
    let without = (NO_DERIVATIVE.to_owned(), checked.without_derivatives.len().into());
    counts.chain([without, ("failed".to_owned(), failed), ("scales".to_owned(), scales.into())]).collect()
}
