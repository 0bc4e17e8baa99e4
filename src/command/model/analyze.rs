//! `linkwright analyze FILE` and `linkwright sensitivities FILE`.

use super::{design, load, located, tables};
use crate::command::output::{folder, say, write};
use clap::Args;
use linkwright::problem::{Evaluation, Problem, ResponseAt, Responses, Sensitivities as Derivatives};
use std::path::PathBuf;

#[derive(Args)]
struct Where {
    /// The model file
    file: PathBuf,
    /// Values of design variables in place of their start: k=0.4,c=0.5
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

Prints the objective and where each constraint is nearest to its limit; writes responses.csv and constraints.csv.")]
pub struct Analyze {
    #[command(flatten)]
    given: Where,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright sensitivities absorber.toml
  linkwright sensitivities absorber.toml --at k=0.36 --out here

Prints derivatives of the objective and of each constraint where it is nearest to its limit; writes the derivatives of all
responses at all time points to sensitivities.csv.")]
pub struct Sensitivities {
    #[command(flatten)]
    given: Where,
}

/// A design that has been analysed.
struct Analysed {
    problem: Problem,
    design: Vec<f64>,
    responses: Responses,
    evaluation: Evaluation,
}

impl Where {
    fn analyse(&self) -> anyhow::Result<Analysed> {
        let (model, _) = load(&self.file)?;
        let problem = located(&model, model.problem())?;
        let design = design(&problem, &self.at)?;
        let responses = located(&model, problem.analyze(&design))?;
        let evaluation = located(&model, problem.evaluate(&design, &responses))?;
        say(&format!("{} at {}", model.title(), problem.design_in_words(&design)))?;
        say(&format!("  {:<32} {:>16.9e} {}", problem.objective.name, evaluation.objective, problem.objective.unit))?;
        Ok(Analysed { problem, design, responses, evaluation })
    }

    fn write(&self, name: &str, csv: &str) -> anyhow::Result<()> {
        let Some(out) = &self.out else { return Ok(()) };
        folder(out)?;
        write(&out.join(name), csv.as_bytes())?;
        say(&format!("Wrote {}", out.join(name).display()))
    }
}

impl Analyze {
    pub fn run(&self) -> anyhow::Result<()> {
        let Analysed { problem, responses, evaluation, .. } = self.given.analyse()?;
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
        let Analysed { problem, design, responses, evaluation } = self.given.analyse()?;
        let of = |(h, values): (usize, &Vec<f64>)| (0..values.len()).map(move |p| ResponseAt { response: h, point: p });
        let instants: Vec<ResponseAt> = responses.values.iter().enumerate().flat_map(of).collect();
        let rows = problem.sensitivities(&design, &responses, &instants)?;
        let table = tables::sensitivities(&problem, &responses, &instants, &rows)?;
        let known = Derivatives { at: instants, rows };
        let line = |name: &str, slopes: &[f64]| {
            let slopes: String = slopes.iter().map(|s| format!(" {s:>13.6e}")).collect();
            say(&format!("  {name:<40}{slopes}"))
        };
        let names: String = problem.variables.iter().map(|v| format!(" {:>13}", format!("d/d {}", v.name))).collect();
        say(&format!("  {:<40}{names}", ""))?;
        let slopes = |quantity, p| problem.total_derivative(quantity, p, &design, &responses, &known);
        line(&problem.objective.name, &slopes(problem.objective.signed(), 0))?;
        for row in tables::worst(&problem, &evaluation) {
            line(&problem.row_in_words(row), &slopes(problem.constraints[row.constraint].signed(), row.point))?;
        }
        self.given.write("sensitivities.csv", &table.csv())
    }
}
