//! `linkwright analyze FILE` and `linkwright sensitivities FILE`.

use super::budget::Budget;
use super::folder::OutputFolder;
use super::model::{design, load, located};
use super::output::{complain, say};
use super::tables;
use clap::Args;
use linkwright::problem::{self, Evaluation, Problem, ResponseAt, Responses};
use std::path::PathBuf;

#[derive(Args)]
struct DesignArguments {
    /// The model file
    file: PathBuf,
    /// Values of design variables, for instance k=0.4,c=0.5; the others have their start values
    #[arg(long, value_name = "NAME=VALUE", value_delimiter = ',')]
    at: Vec<String>,
    /// Folder for the tables
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright analyze absorber.toml
  linkwright analyze absorber.toml --at k=0.36,c=0.48 --out optimum

Prints the objective and the largest value of each constraint; with --out, writes responses.csv and constraints.csv.")]
pub struct Analyze {
    #[command(flatten)]
    given: DesignArguments,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright sensitivities absorber.toml
  linkwright sensitivities absorber.toml --at k=0.36 --out here

Prints the gradients of the objective and of each constraint at its largest value. The sign is that of the form g <= c: a lower
limit is negated, and the bound of a peak is subtracted. With --out, writes the derivatives of all responses at all time points
to sensitivities.csv.")]
pub struct Sensitivities {
    #[command(flatten)]
    given: DesignArguments,
    #[command(flatten)]
    budget: Budget,
}

/// A design and the results of its analysis.
struct AnalysedDesign {
    problem: Problem,
    design: Vec<f64>,
    responses: Responses,
    evaluation: Evaluation,
}

impl DesignArguments {
    fn analyse(&self, budget: Option<&Budget>) -> anyhow::Result<AnalysedDesign> {
        let (model, _) = load(&self.file)?;
        let problem = located(&model, model.problem())?;
        budget.map_or(Ok(()), |budget| budget.check_table(&problem, model.method()))?;
        let design = design(&problem, &self.at)?;
        let responses = located(&model, problem.analyze(&design))?;
        let evaluation = located(&model, problem.evaluate(&design, &responses))?;
        for warning in problem.analysis.warnings(&design, &responses) {
            complain(&format!("Warning: {warning}"));
        }
        say(&format!("{} at {}", model.title(), problem.design_in_words(&design)))?;
        say(&format!("  {:<32} {:>16.9e} {}", problem.objective.name, evaluation.objective, problem.objective.unit))?;
        Ok(AnalysedDesign { problem, design, responses, evaluation })
    }

    fn write(&self, name: &str, csv: &str) -> anyhow::Result<()> {
        let Some(out) = &self.out else { return Ok(()) };
        say(&format!("Wrote {}", OutputFolder::create(out)?.write(name, csv.as_bytes())?.display()))
    }
}

impl Analyze {
    pub fn run(&self) -> anyhow::Result<()> {
        let AnalysedDesign { problem, responses, evaluation, .. } = self.given.analyse(None)?;
        for row in tables::worst(&problem, &evaluation) {
            let value = evaluation.constraints[row.constraint][row.point];
            let violation = 100.0 * evaluation.violation(row.constraint, value);
            say(&format!("  {:<48} violation {violation:>10.3} %", problem.row_in_words(row)))?;
        }
        self.given.write("responses.csv", &tables::responses(&problem, &responses)?.csv())?;
        self.given.write("constraints.csv", &tables::constraints(&problem, &evaluation)?.csv())
    }
}

impl Sensitivities {
    pub fn run(&self) -> anyhow::Result<()> {
        let AnalysedDesign { problem, design, responses, evaluation } = self.given.analyse(Some(&self.budget))?;
        let points_of =
            |(h, values): (usize, &Vec<f64>)| (0..values.len()).map(move |p| ResponseAt { response: h, point: p });
        let instants: Vec<ResponseAt> = responses.values.iter().enumerate().flat_map(points_of).collect();
        let rows = problem.sensitivities(&design, &responses, &instants)?;
        let table = tables::sensitivities(&problem, &responses, &instants, &rows)?;
        let known = problem::Sensitivities { at: instants, rows };
        let line = |name: &str, gradient: &[f64]| {
            let numbers: String = gradient.iter().map(|s| format!(" {s:>13.6e}")).collect();
            say(&format!("  {name:<40}{numbers}"))
        };
        let names: String = problem.variables.iter().map(|v| format!(" {:>13}", format!("d/d {}", v.name))).collect();
        say(&format!("  {:<40}{names}", ""))?;
        let gradient = |quantity, p| problem.total_derivative(quantity, p, &design, &responses, &known);
        line(&problem.objective.name, &gradient(problem.objective.signed(), 0))?;
        for row in tables::worst(&problem, &evaluation) {
            line(&problem.row_in_words(row), &gradient(problem.constraints[row.constraint].signed(), row.point))?;
        }
        self.given.write("sensitivities.csv", &table.csv())
    }
}
