//! `linkwright check FILE` and `linkwright check PROBLEM`.

use super::model::{design, is_file, load, located};
use super::output::{folder, say, write};
use crate::library::find;
use crate::model::Model;
use crate::problem::check::{Finding, Proof};
use crate::problem::{Evaluation, Problem};
use crate::report::proof::table;
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright check four-bar.toml
  linkwright check four-bar.toml --at d1=0.04,d2=0.03
  linkwright check impact-absorber --points 10 --out out

The model is read, one design is analysed, and every derivative is compared with differences of whole analyses that are
extrapolated and know their own error:
  right           it agrees
  constant        the response does not depend on the variable, and the derivative says so
  WRONG           it contradicts the differences
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
        let here = problem.analyze(&b).and_then(|responses| problem.evaluate(&b, &responses));
        describe(&problem, &located(model.as_ref(), here)?)?;
        let proof = located(model.as_ref(), problem.check_sensitivities(&b, self.points))?;
        let table = table(&problem, &proof)?;
        say(&table.text())?;
        say(&summary(&proof))?;
        if let Some(out) = &self.out {
            folder(out)?;
            let file = out.join("derivatives.csv");
            write(&file, table.csv().as_bytes())?;
            say(&format!("The table is in {}", file.display()))?;
        }
        let wrong = proof.count(Finding::Wrong);
        anyhow::ensure!(wrong == 0, "{wrong} of the derivatives are wrong");
        Ok(())
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
    let (unit, violation) = (&problem.objective_unit, here.max_violation_pct());
    say(&format!(
        "At this design the objective is {} {unit} and the largest violation {violation:.2} %.",
        here.objective
    ))
}

fn summary(proof: &Proof) -> String {
    use Finding::{Constant, Kink, NotRepeatable, Right, Unclear, Wrong};
    let counts = [Right, Constant, Wrong, Kink, NotRepeatable, Unclear].map(|f| (proof.count(f), f.text()));
    let words = counts.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}"));
    words.collect::<Vec<_>>().join(", ")
}
