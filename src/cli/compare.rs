//! `linkwright compare PROBLEM`.

use super::output::{folder, say, write};
use crate::library::{Attempt, Conclusion, Entry, catalogue, compare, find};
use crate::report::methods::{distances, profile, summary, table};
use crate::sao::{Preset, preset, presets};
use clap::Args;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright compare --list
  linkwright compare impact-absorber
  linkwright compare slider-crank --methods paper,gcmma,hessian --out out
  linkwright compare --all

The end of a run: `optimum` converged to a known optimum; `other optimum` converged elsewhere, where the optimality
conditions hold; `cycle limit`, `stalled`, `infeasible` not converged, and it says so; `FALSE` converged, it says, but is not.")]
pub struct Compare {
    /// Name of a problem, see --list
    #[arg(required_unless_present_any = ["all", "list"], conflicts_with_all = ["all", "list"])]
    problem: Option<String>,
    /// All problems whose analysis is cheap, with a performance profile
    #[arg(long, conflicts_with = "list")]
    all: bool,
    /// Only these methods, separated by commas
    #[arg(long, value_name = "METHODS", value_delimiter = ',')]
    methods: Vec<String>,
    /// Folder for tables and figures [default: out/compare]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Names of problems and methods
    #[arg(long)]
    list: bool,
}

impl Compare {
    pub fn run(&self) -> anyhow::Result<()> {
        if self.list {
            return list();
        }
        let methods = self.methods()?;
        let entries: Vec<&'static Entry> = match &self.problem {
            Some(name) => vec![find(name)?],
            None => catalogue().iter().filter(|e| !e.expensive).collect(),
        };
        let out = self.out.clone().unwrap_or_else(|| Path::new("out").join("compare"));
        folder(&out)?;
        let mut all = vec![];
        for entry in entries {
            all.push(one(entry, &methods, &out)?);
        }
        if self.all {
            let summary = summary(&all)?;
            say(&summary.text())?;
            write(&out.join("summary.csv"), summary.csv().as_bytes())?;
            profile(&all)?.save(&out, "profile")?;
        }
        say(&format!("Tables and figures are in {}", out.display()))
    }

    fn methods(&self) -> anyhow::Result<Vec<&'static Preset>> {
        if self.methods.is_empty() {
            return Ok(presets().iter().collect());
        }
        Ok(self.methods.iter().map(|name| preset(name)).collect::<Result<_, _>>()?)
    }
}

/// All methods on one problem: table, file, figure.
fn one(entry: &'static Entry, methods: &[&'static Preset], out: &Path) -> anyhow::Result<Vec<Attempt>> {
    let attempts = compare(entry, methods)?;
    let table = table(entry, &attempts)?;
    say(&table.text())?;
    for a in &attempts {
        if let Conclusion::Refused(why) = &a.conclusion {
            say(&format!("Note: {} refused: {why}", a.method))?;
        }
    }
    write(&out.join(format!("{}.csv", entry.name)), table.csv().as_bytes())?;
    if attempts.iter().any(|a| !a.approach.is_empty()) {
        distances(&attempts)?.save(out, entry.name)?;
    }
    Ok(attempts)
}

fn list() -> anyhow::Result<()> {
    say("Problems")?;
    for entry in catalogue() {
        let cost = if entry.expensive { " [expensive]" } else { "" };
        say(&format!("  {:<36} {}{cost}\n{:39}{}", entry.name, entry.title, "", entry.source))?;
    }
    say("\nMethods")?;
    presets().iter().try_for_each(|p| say(&format!("  {:<22} {}", p.name, p.title)))
}
