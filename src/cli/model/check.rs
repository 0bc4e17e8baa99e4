//! `linkwright check FILE`.

use super::load;
use crate::cli::output::say;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright check four-bar.toml

Reads the file and analyses the start design; nothing is written.")]
pub struct Check {
    /// The model file
    file: PathBuf,
}

impl Check {
    pub fn run(&self) -> anyhow::Result<()> {
        let (model, _) = load(&self.file)?;
        let problem = model.problem()?;
        let start = problem.start();
        let here = problem.evaluate(&start, &problem.analyze(&start)?)?;
        say(&format!(
            "{}: {} design variables, {} outputs, {} constraints, {} time points",
            model.title(),
            problem.n(),
            problem.responses.len(),
            problem.constraints.len(),
            problem.grids.first().map_or(0, |grid| grid.len()),
        ))?;
        say(&format!(
            "At the start the objective is {} {} and the largest violation {:.2} %.",
            here.objective,
            problem.objective_unit,
            here.max_violation_pct()
        ))
    }
}
