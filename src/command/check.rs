//! `linkwright check FILE` and `linkwright check PROBLEM`.

use super::model::{design, is_file, load, located};
use super::output::{folder, say, write};
use clap::Args;
use linkwright::Error;
use linkwright::cases::find;
use linkwright::gradient_check::{GradientCheck, GradientStatus};
use linkwright::model_file::Model;
use linkwright::problem::{Evaluation, Problem};
use linkwright::report::proof::{table, text};
use linkwright::report::table::{Cell, Table};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright check four-bar.toml                        every response at five times, at the start design
  linkwright check four-bar.toml --at d1=0.04,d2=0.03   at another design
  linkwright check impact-absorber --points 10 --all    more times, all rows
  linkwright check four-bar.toml --response tip         one response
  linkwright check four-bar.toml --json > derivatives.jsonl
  linkwright check impact-absorber --out out            all figures in out/derivatives.csv

One design is analysed, and every derivative is made by every method that the analysis has (direct, adjoint,
semi-analytical, and its own differences if it takes any), and by differences of whole analyses that are extrapolated and
know their own error (the column ±). The column `apart` says by how much all of them disagree. Verdicts:
  right           all methods agree with the differences
  constant        the response does not depend on the variable, and the methods say so
  WRONG           a method contradicts the differences or the other methods: the suspect has a star
  kink            the response has a kink here: there is no derivative
  not repeatable  two analyses of one design differ
  unclear         the differences are too noisy to tell
A wrong derivative is an error.")]
pub struct Check {
    /// A model file, or a problem of the library (see `linkwright compare --list`)
    what: String,
    /// Time points of every response
    #[arg(long, default_value_t = 5)]
    points: usize,
    /// Only these responses, by name
    #[arg(long = "response", value_delimiter = ',', value_name = "NAME")]
    responses: Vec<String>,
    /// Every derivative, not only the least certain of each response and those that are not right
    #[arg(long)]
    all: bool,
    /// One JSON object in each line, for machines: a derivative each, then the counts
    #[arg(long)]
    json: bool,
    /// Design to check at: variables that differ from the start, by name
    #[arg(long, value_delimiter = ',', value_name = "NAME=VALUE")]
    at: Vec<String>,
    /// Folder for the table as a file
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Check {
    pub fn run(&self) -> anyhow::Result<()> {
        let (problem, model) = self.problem()?;
        let b = design(&problem, &self.at)?;
        if !self.json {
            let here = problem.analyze(&b).and_then(|responses| problem.evaluate(&b, &responses));
            describe(&problem, &located(model.as_ref(), here)?)?;
        }
        let numbers = self.numbers(&problem)?;
        let proof = located(model.as_ref(), problem.check_responses(&b, self.points, &numbers))?;
        let table = table(&problem, &proof)?;
        if self.json {
            lines(&table)?.iter().try_for_each(|line| say(line))?;
            say(&counts(&proof).to_string())?;
        } else {
            say(text(&problem, &proof, self.all).trim_end())?;
            say(&summary(&proof))?;
        }
        if let Some(out) = &self.out {
            folder(out)?;
            let file = out.join("derivatives.csv");
            write(&file, table.csv().as_bytes())?;
            if !self.json {
                say(&format!("The table is in {}", file.display()))?;
            }
        }
        let wrong = proof.count(GradientStatus::Wrong);
        anyhow::ensure!(wrong == 0, "{wrong} of the derivatives are wrong");
        Ok(())
    }

    /// Numbers of the responses that are wanted.
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

    fn problem(&self) -> anyhow::Result<(Problem, Option<Model>)> {
        if is_file(&self.what) {
            let model = load(Path::new(&self.what))?.0;
            return Ok((located(Some(&model), model.problem())?, Some(model)));
        }
        Ok(((find(&self.what)?.build)()?, None))
    }
}

fn describe(problem: &Problem, here: &Evaluation) -> anyhow::Result<()> {
    say(&format!(
        "{}: {} design variables, {} responses, {} constraints, {} time points",
        problem.name,
        problem.n(),
        problem.responses.len(),
        problem.constraints.len(),
        problem.grids.first().map_or(0, |grid| grid.len()),
    ))?;
    let (unit, violation) = (&problem.objective.unit, here.max_violation_pct());
    say(&format!(
        "At this design the objective is {:.5e} {unit} and the largest violation {violation:.2} %.",
        here.objective
    ))
}

const FINDINGS: [GradientStatus; 6] = [
    GradientStatus::Right,
    GradientStatus::Constant,
    GradientStatus::Wrong,
    GradientStatus::Kink,
    GradientStatus::NotRepeatable,
    GradientStatus::Unclear,
];

fn summary(proof: &GradientCheck) -> String {
    let counts = FINDINGS.map(|f| (proof.count(f), f.text()));
    let words = counts.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}"));
    format!("{}, by {}", words.collect::<Vec<_>>().join(", "), proof.methods.join(", "))
}

/// How often each verdict was given.
fn counts(proof: &GradientCheck) -> serde_json::Value {
    FINDINGS.iter().map(|f| (f.text().to_lowercase(), serde_json::Value::from(proof.count(*f)))).collect()
}

/// A JSON object for each row of the table.
fn lines(table: &Table) -> anyhow::Result<Vec<String>> {
    let value = |cell: &Cell| match cell {
        Cell::Number(x) => serde_json::Value::from(*x),
        Cell::Whole(x) => (*x).into(),
        Cell::Text(text) => text.as_str().into(),
        Cell::Empty => serde_json::Value::Null,
    };
    let object = |row: &Vec<Cell>| {
        let pairs = table.columns().iter().cloned().zip(row.iter().map(value));
        Ok(serde_json::to_string(&pairs.collect::<serde_json::Map<_, _>>())?)
    };
    table.rows().iter().map(object).collect()
}
