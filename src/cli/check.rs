//! `linkwright check PROBLEM`.

use super::output::{folder, say, write};
use crate::library::find;
use crate::problem::check::{Finding, Proof};
use crate::report::proof::table;
use clap::Args;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright check slider-crank
  linkwright check impact-absorber --points 10 --out out

Every derivative is compared with differences of whole analyses that are extrapolated and know their own error:
`right`; `constant`, the response does not depend on the variable; `WRONG`, it contradicts the differences; `kink`, there is
no derivative here; `not repeatable`, two analyses of one design differ; `unclear`, the differences are too noisy to tell.
The exit code is 1 if a derivative is wrong.")]
pub struct Check {
    /// Name of a problem, see `linkwright compare --list`
    problem: String,
    /// Time points of every response
    #[arg(long, default_value_t = 5)]
    points: usize,
    /// Design to check at, separated by commas [default: the start]
    #[arg(long, value_delimiter = ',', value_name = "VALUES")]
    at: Option<Vec<f64>>,
    /// Folder for the table as a file
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

impl Check {
    pub fn run(&self) -> anyhow::Result<()> {
        let entry = find(&self.problem)?;
        let problem = (entry.build)()?;
        let proof = problem.check_sensitivities(&self.at.clone().unwrap_or_else(|| problem.start()), self.points)?;
        let table = table(&problem, &proof)?;
        say(&table.text())?;
        say(&summary(&proof))?;
        if let Some(out) = &self.out {
            folder(out)?;
            let file = out.join(format!("{}_derivatives.csv", entry.name));
            write(&file, table.csv().as_bytes())?;
            say(&format!("The table is in {}", file.display()))?;
        }
        let wrong = proof.count(Finding::Wrong);
        anyhow::ensure!(wrong == 0, "{wrong} derivatives are wrong");
        Ok(())
    }
}

fn summary(proof: &Proof) -> String {
    use Finding::{Constant, Kink, NotRepeatable, Right, Unclear, Wrong};
    let counts = [Right, Constant, Wrong, Kink, NotRepeatable, Unclear].map(|f| (proof.count(f), f.text()));
    let words = counts.iter().filter(|(count, _)| *count > 0).map(|(count, text)| format!("{count} {text}"));
    words.collect::<Vec<_>>().join(", ")
}
