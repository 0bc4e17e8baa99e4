//! `linkwright compare PROBLEM` and `linkwright compare FILE`.

use super::model::{compare as compare_file, is_file, load};
use super::output::{folder, results, say, write};
use clap::Args;
use linkwright::cases::{Attempt, Conclusion, Entry, catalogue, compare, find};
use linkwright::report::methods::{distances, profile, summary, table};
use linkwright::report::table::Table;
use linkwright::sao::{Preset, preset, presets};
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright compare --list
  linkwright compare impact-absorber
  linkwright compare slider-crank --methods slp,gcmma,hessian --out out
  linkwright compare --all
  linkwright compare lift.toml --methods slp,mma,gcmma

Of a model file, the method that it has itself is run, too, and its stop test holds for all.
The end of a run of a problem whose optima are known: `optimum` converged to a known optimum; `other optimum` converged elsewhere, where the optimality
conditions hold; `cycle limit`, `stalled`, `infeasible` not converged, and it says so; `FALSE` converged, it says, but is not.")]
pub struct Compare {
    /// Name of a problem, see --list, or a model file
    #[arg(value_name = "PROBLEM|FILE", required_unless_present_any = ["all", "list"], conflicts_with_all = ["all", "list"])]
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
    /// A line of JSON for each row in place of the table
    #[arg(long, conflicts_with = "list")]
    json: bool,
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
        let out = self.out.clone().unwrap_or_else(|| results().join("compare"));
        if let Some(path) = self.problem.as_deref().filter(|name| is_file(name)) {
            return self.file(Path::new(path), &methods, &out);
        }
        let entries: Vec<&'static Entry> = match &self.problem {
            Some(name) => vec![find(name)?],
            None => catalogue().iter().filter(|e| !e.expensive).collect(),
        };
        folder(&out)?;
        let mut all = vec![];
        for entry in entries {
            all.push(self.one(entry, &methods, &out)?);
        }
        if self.all {
            let summary = summary(&all)?;
            self.show(&summary)?;
            write(&out.join("summary.csv"), summary.csv().as_bytes())?;
            profile(&all)?.save(&out, "profile")?;
        }
        self.end("Tables and figures are", &out)
    }

    /// The methods on the problem of a model file.
    fn file(&self, path: &Path, methods: &[&'static Preset], out: &Path) -> anyhow::Result<()> {
        let (model, _) = load(path)?;
        let rows = compare_file::rows(&model, methods)?;
        let table = compare_file::table(&model, &rows)?;
        self.show(&table)?;
        folder(out)?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        write(&out.join(format!("{name}.csv")), table.csv().as_bytes())?;
        self.notes(rows.iter().filter_map(|row| Some((row.method, row.refused()?))))?;
        self.end("The table is", out)
    }

    fn show(&self, table: &Table) -> anyhow::Result<()> {
        if self.json { table.json_lines().iter().try_for_each(|line| say(line)) } else { say(&table.text()) }
    }

    /// Why methods did not run.
    fn notes<'a>(&self, refused: impl Iterator<Item = (&'a str, &'a str)>) -> anyhow::Result<()> {
        let mut refused = refused.filter(|_| !self.json);
        refused.try_for_each(|(method, why)| say(&format!("Note: {method} refused: {why}")))
    }

    fn end(&self, what: &str, out: &Path) -> anyhow::Result<()> {
        if self.json { Ok(()) } else { say(&format!("{what} in {}", out.display())) }
    }

    /// All methods on one problem: table, file, figure.
    fn one(&self, entry: &'static Entry, methods: &[&'static Preset], out: &Path) -> anyhow::Result<Vec<Attempt>> {
        let attempts = compare(entry, methods)?;
        let table = table(entry, &attempts)?;
        self.show(&table)?;
        self.notes(attempts.iter().filter_map(|a| match &a.conclusion {
            Conclusion::Refused(why) => Some((a.method, why.as_str())),
            _ => None,
        }))?;
        write(&out.join(format!("{}.csv", entry.name)), table.csv().as_bytes())?;
        if attempts.iter().any(|a| !a.approach.is_empty()) {
            distances(&attempts)?.save(out, entry.name)?;
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
    say("\nMethods")?;
    presets().iter().try_for_each(|p| say(&format!("  {:<22} {}", p.name, p.title)))
}
