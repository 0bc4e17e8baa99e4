//! `linkwright analyze FILE` and `linkwright sensitivities FILE`.

use super::analysis_page::analysis_page;
use super::budget::Budget;
use super::model::{At, ModelSettings, changed, design, located};
use super::output::{Digits, say, warn};
use super::output_folder::OutputFolder;
use super::progress::{Show, working};
use super::run_directory::{NamedValue, Nearest, PAGE};
use super::tables;
use clap::Args;
use linkwright::model_file::Model;
use linkwright::problem::{self, AnalyzedDesign, DesignVariable, Problem, Responses, SignedQuantity, TimeGrid};
use linkwright::report::number::{readable, unit_of_derivative, with_unit, without_rounding};
use linkwright::report::outcome;
use linkwright::report::table::{Cell, Table, one_line};
use serde::Serialize;
use std::path::PathBuf;

#[derive(Args)]
struct DesignArguments {
    /// The model file; `lift` means lift.toml
    file: PathBuf,
    #[command(flatten)]
    at: At,
    #[command(flatten)]
    settings: ModelSettings,
    /// Folder for the tables
    #[arg(short, long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one line of JSON
    #[arg(long)]
    json: bool,
    /// Print nothing on standard output
    #[arg(short, long, conflicts_with = "json")]
    quiet: bool,
    #[command(flatten)]
    digits: Digits,
    #[command(flatten)]
    budget: Budget,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright analyze absorber.toml
  linkwright analyze absorber --at k=0.36,c=0.48 --out optimum
  linkwright analyze lift --at height=\"300 mm\" --set time.points=501
  linkwright analyze absorber --json | jq .outputs

Prints the objective, minimum, maximum and last value of every output with their times, and each constraint at its smallest margin; with
--out, writes responses.csv, constraints.csv and report.html, a page with the mechanism in motion and all histories.")]
pub struct Analyze {
    #[command(flatten)]
    given: DesignArguments,
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright sensitivities absorber.toml
  linkwright sensitivities absorber.toml --at k=0.36 --out here
  linkwright sensitivities absorber --json | jq .objective.derivatives

Prints the gradients of the objective and of each constrained quantity at its smallest margin, of a peak at its time. With --out,
writes the derivatives of all responses at all time points to sensitivities.csv.")]
pub struct Sensitivities {
    #[command(flatten)]
    given: DesignArguments,
}

/// A design and the results of its analysis.
struct AnalysedDesign {
    title: String,
    problem: Problem,
    analyzed: AnalyzedDesign,
}

impl DesignArguments {
    fn analyse(&self, model: &Model, has_derivatives: bool) -> anyhow::Result<AnalysedDesign> {
        let problem = located(model, model.problem())?;
        if has_derivatives {
            self.budget.check_table(&problem, model.method())?;
        } else {
            self.budget.check_analysis(&problem, model.method())?;
        }
        let design = design(&problem, &self.at)?;
        let line = working("analysing", self.show(), model);
        let responses = located(model, problem.analyze(&design))?;
        let evaluation = located(model, problem.evaluate(&design, &responses))?;
        let warnings = problem.analysis.warnings(&design, &responses);
        drop(line);
        warn(&warnings);
        let responses = Responses { warnings, ..responses };
        let analyzed = AnalyzedDesign { design, responses, evaluation };
        Ok(AnalysedDesign { title: model.title().to_owned(), problem, analyzed })
    }

    fn show(&self) -> Show {
        Show::of(self.json, self.quiet)
    }

    fn say(&self, text: &str) -> anyhow::Result<()> {
        if self.quiet || self.json { Ok(()) } else { say(text) }
    }

    /// Choices that the analysis has made itself.
    fn say_notes(&self, notes: &[String]) -> anyhow::Result<()> {
        notes.iter().try_for_each(|note| self.say(&format!("Note: {note}")))
    }

    /// Title, design and objective.
    fn head(&self, analysed: &AnalysedDesign) -> anyhow::Result<()> {
        let (digits, objective) = (self.digits.count(), analysed.objective());
        let design = analysed.design_values();
        let words: Vec<String> =
            design.iter().map(|v| format!("{} = {}", v.name, with_unit(v.value, &v.unit, digits))).collect();
        self.say(&one_line(&format!("{} at {}", analysed.title, words.join(", "))))?;
        let value = with_unit(objective.value, &objective.unit, digits);
        self.say(&one_line(&format!("  {:<24} {value}, {}", objective.name, outcome::goal(&analysed.problem))))
    }

    fn write(&self, name: &str, csv: &str) -> anyhow::Result<()> {
        let Some(out) = &self.out else { return Ok(()) };
        let place = OutputFolder::create(out)?.write(name, csv.as_bytes())?;
        self.say(&format!("Wrote {}", place.display()))
    }
}

impl AnalysedDesign {
    fn objective(&self) -> NamedValue {
        let objective = &self.problem.objective;
        let value = outcome::objective(&self.problem, &self.analyzed.design, &self.analyzed.evaluation);
        NamedValue { name: objective.name.clone(), unit: objective.unit.clone(), value }
    }

    /// The design without the variable that bounds a peak, which an analysis does not use.
    fn design_values(&self) -> Vec<NamedValue> {
        let bound = self.problem.objective.peak().map(|peak| peak.variable);
        let own =
            self.problem.variables.iter().zip(&self.analyzed.design).enumerate().filter(|(k, _)| Some(*k) != bound);
        own.map(|(_, (v, &value))| NamedValue { name: v.name.clone(), unit: v.unit.clone(), value }).collect()
    }

    fn outputs(&self) -> Vec<OutputRange> {
        let all = self.problem.responses.iter().zip(&self.analyzed.responses.values);
        all.map(|(response, values)| {
            let grid = response.grid.map(|grid| &self.problem.grids[grid]);
            OutputRange::new(&response.name, &response.unit, grid, values)
        })
        .collect()
    }

    fn constraints(&self) -> Vec<Nearest> {
        let all = outcome::constraints(&self.problem, &self.analyzed.design, &self.analyzed.evaluation);
        all.into_iter().map(|c| Nearest::new(&self.problem, c)).collect()
    }
}

/// Minimum, maximum and last value of an output.
#[derive(Serialize)]
struct OutputRange {
    name: String,
    unit: String,
    /// Unit of the times; absent for an output that does not change with time.
    #[serde(skip_serializing_if = "String::is_empty")]
    time_unit: String,
    minimum: TimedValue,
    maximum: TimedValue,
    end: TimedValue,
}

/// A value and its time; `None` for an output that does not change with time.
#[derive(Clone, Copy, Serialize)]
struct TimedValue {
    value: f64,
    time: Option<f64>,
}

impl OutputRange {
    fn new(name: &str, unit: &str, grid: Option<&TimeGrid>, values: &[f64]) -> Self {
        let times = grid.map(TimeGrid::shown_points);
        let times = times.as_deref();
        let at = |p: usize| TimedValue { value: values[p], time: times.map(|times| times[p]) };
        // The first of equal values.
        let best = |is_better: fn(f64, f64) -> bool| {
            (1..values.len()).fold(0, |best, p| if is_better(values[p], values[best]) { p } else { best })
        };
        Self {
            name: name.to_owned(),
            unit: unit.to_owned(),
            time_unit: grid.map(|grid| grid.unit.clone()).unwrap_or_default(),
            minimum: at(best(|a, b| a < b)),
            maximum: at(best(|a, b| a > b)),
            end: at(values.len() - 1),
        }
    }
}

/// The outputs as a table: times only where values change with time.
fn ranges(title: &str, outputs: &[OutputRange], grid: Option<&TimeGrid>, digits: usize) -> linkwright::Result<Table> {
    let at = at_time(grid);
    let columns = ["output", "unit", "minimum", at.as_str(), "maximum", at.as_str(), "at the end"];
    let mut table = Table::new(title, columns);
    let size = |output: &OutputRange| output.minimum.value.abs().max(output.maximum.value.abs());
    for output in outputs {
        // Values of one unit are compared; those without a unit may be of any kind.
        let is_like = |other: &&OutputRange| other.unit == output.unit && !output.unit.is_empty();
        let largest = outputs.iter().filter(is_like).map(size).fold(size(output), f64::max);
        let text = |value: f64| Cell::Text(readable(without_rounding(value, largest), digits));
        let when = |timed: TimedValue| timed.time.map_or(Cell::Empty, |time| Cell::Text(readable(time, digits)));
        let OutputRange { name, unit, minimum, maximum, end, .. } = output;
        table.push([
            name.as_str().into(),
            unit.as_str().into(),
            text(minimum.value),
            when(*minimum),
            text(maximum.value),
            when(*maximum),
            text(end.value),
        ])?;
    }
    Ok(table)
}

/// The heading of a column of times.
fn at_time(grid: Option<&TimeGrid>) -> String {
    let (name, unit) = grid.map_or(("time", ""), |grid| (&grid.name, &grid.unit));
    if unit.is_empty() { format!("at {name}") } else { format!("at {name} [{unit}]") }
}

/// The objective as a table.
fn goal(problem: &Problem, objective: &NamedValue, digits: usize) -> linkwright::Result<Table> {
    let mut table = Table::new("Objective", ["objective", "unit", "value", "goal"]);
    let NamedValue { name, unit, value } = objective;
    let value = Cell::Text(readable(*value, digits));
    table.push([name.as_str().into(), unit.as_str().into(), value, outcome::goal(problem).into()])?;
    Ok(table)
}

/// Constraints as a table, in their own terms.
fn limits(
    constraints: &[outcome::ConstraintValue],
    grid: Option<&TimeGrid>,
    digits: usize,
) -> linkwright::Result<Table> {
    let at = at_time(grid);
    let columns = ["constraint", "unit", "value", "", "limit", "margin", at.as_str(), "status"];
    let mut table = Table::new("Constraints at their smallest margins", columns);
    for c in constraints {
        table.push([
            c.name.as_str().into(),
            c.unit.as_str().into(),
            Cell::Text(readable(c.shown(), digits)),
            c.relation().into(),
            Cell::Text(readable(c.limit, digits)),
            Cell::Text(readable(without_rounding(c.margin, c.size), digits)),
            c.time.map_or(Cell::Empty, |time| Cell::Text(readable(time, digits))),
            c.status().into(),
        ])?;
    }
    Ok(table)
}

impl Analyze {
    /// Analyses a file without an objective.
    fn simulate(&self, model: &Model) -> anyhow::Result<()> {
        self.given.budget.check_simulation(model)?;
        let design = changed(model.variables(), &self.given.at, None)?;
        let line = working("simulating", self.given.show(), model);
        let responses = located(model, model.simulate(&design))?;
        drop(line);
        warn(&responses.warnings);
        let times = model.grid().map(TimeGrid::shown_points);
        let all = model.output_names().zip(&responses.values);
        let outputs: Vec<OutputRange> =
            all.map(|((name, unit, grid), v)| OutputRange::new(name, unit, grid.and(model.grid()), v)).collect();
        let time = model.grid().map_or("time", |grid| grid.name.as_str());
        let listed = ranges("Outputs", &outputs, model.grid(), self.given.digits.count())?;
        if self.given.json {
            let values = model.variables().iter().zip(&design);
            let named =
                |(v, &value): (&DesignVariable, &f64)| NamedValue { name: v.name.clone(), unit: v.unit.clone(), value };
            let (title, design) = (model.title().to_owned(), values.map(named).collect());
            let (objective, constraints, warnings) = (None, vec![], responses.warnings.clone());
            let record = AnalysisRecord {
                event: "analysis",
                version: 1,
                title,
                design,
                objective,
                outputs,
                constraints,
                warnings,
                notes: responses.notes.clone(),
            };
            say(&serde_json::to_string(&record)?)?;
        } else {
            self.given.say(&one_line(model.title()))?;
            self.given.say_notes(&responses.notes)?;
            let table = ranges("", &outputs, model.grid(), self.given.digits.count())?;
            self.given.say(table.text().trim_end())?;
        }
        let mut table = Table::new("Responses", std::iter::once(time).chain(model.output_names().map(|o| o.0)));
        for p in 0..times.as_ref().map_or(1, Vec::len) {
            let at = times.as_ref().map_or(Cell::Empty, |times| times[p].into());
            let value = |values: &Vec<f64>| values.get(p).map_or(Cell::Empty, |v| Cell::from(*v));
            table.push(std::iter::once(at).chain(responses.values.iter().map(value)))?;
        }
        self.given.write("responses.csv", &table.csv())?;
        if self.given.out.is_none() {
            return Ok(());
        }
        let tables = vec![listed];
        let words = in_words(model.variables().iter().zip(&design), self.given.digits.count());
        let page = analysis_page(model, &design, &responses.values, &words, tables)?;
        self.given.write(PAGE, &page)
    }
}

/// The values of design variables in words.
fn in_words<'v>(values: impl Iterator<Item = (&'v DesignVariable, &'v f64)>, digits: usize) -> String {
    let words: Vec<String> =
        values.map(|(v, value)| format!("{} = {}", v.name, with_unit(*value, &v.unit, digits))).collect();
    if words.is_empty() { "Analysis".to_owned() } else { format!("Analysis at {}", words.join(", ")) }
}

/// `analyze --json`.
#[derive(Serialize)]
struct AnalysisRecord {
    event: &'static str,
    version: u32,
    title: String,
    design: Vec<NamedValue>,
    /// `null` for a file without an objective.
    objective: Option<NamedValue>,
    outputs: Vec<OutputRange>,
    constraints: Vec<Nearest>,
    /// Reasons to doubt the numbers.
    warnings: Vec<String>,
    /// Choices that the analysis has made itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
}

impl Analyze {
    pub fn run(&self) -> anyhow::Result<()> {
        let (model, _) = self.given.settings.load(&self.given.file)?;
        if !model.is_problem() {
            return self.simulate(&model);
        }
        let analysed = self.given.analyse(&model, false)?;
        let (outputs, constraints) = (analysed.outputs(), analysed.constraints());
        let AnalysedDesign { problem, analyzed: AnalyzedDesign { design, responses, evaluation }, .. } = &analysed;
        if self.given.json {
            let (objective, values) = (Some(analysed.objective()), analysed.design_values());
            let title = analysed.title.clone();
            let record = AnalysisRecord {
                event: "analysis",
                version: 1,
                title,
                design: values,
                objective,
                outputs,
                constraints,
                warnings: responses.warnings.clone(),
                notes: responses.notes.clone(),
            };
            say(&serde_json::to_string(&record)?)?;
        } else {
            self.given.head(&analysed)?;
            for constraint in constraints {
                self.given.say(&constraint.text(self.given.digits.count()))?;
            }
            let table = ranges("", &outputs, problem.grids.first(), self.given.digits.count())?;
            self.given.say(table.text().trim_end())?;
            self.given.say_notes(&responses.notes)?;
        }
        self.given.write("responses.csv", &tables::responses(problem, responses)?.csv())?;
        let constraints = tables::constraints(problem, design, evaluation)?;
        self.given.write("constraints.csv", &constraints.csv())?;
        if self.given.out.is_none() {
            return Ok(());
        }
        let digits = self.given.digits.count();
        let grid = problem.grids.first();
        let mut tables = vec![goal(problem, &analysed.objective(), digits)?];
        if outcome::stated_constraints(problem).next().is_some() {
            tables.push(limits(&outcome::constraints(problem, design, evaluation), grid, digits)?);
        }
        tables.push(ranges("Outputs", &analysed.outputs(), grid, digits)?);
        let own = model.variables().iter().zip(design);
        let page = analysis_page(&model, design, &responses.values, &in_words(own, digits), tables)?;
        self.given.write(PAGE, &page)
    }
}

/// `sensitivities --json`.
#[derive(Serialize)]
struct SensitivityRecord {
    event: &'static str,
    version: u32,
    title: String,
    design: Vec<NamedValue>,
    objective: GradientRecord,
    constraints: Vec<GradientRecord>,
    /// Reasons to doubt the numbers.
    warnings: Vec<String>,
    /// Choices that the analysis has made itself.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    notes: Vec<String>,
}

/// The derivatives of a quantity with respect to the design variables.
#[derive(Default, Serialize)]
struct GradientRecord {
    name: String,
    unit: String,
    value: f64,
    /// `≤`, `≥` or `=`, and the limit; absent for an objective.
    #[serde(skip_serializing_if = "Option::is_none")]
    relation: Option<&'static str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    limit: Option<f64>,
    /// The time of the value; `null` for one that does not change with time.
    time: Option<f64>,
    #[serde(skip_serializing_if = "String::is_empty")]
    time_unit: String,
    /// In the unit of the quantity per unit of the design variable.
    derivatives: Vec<Derivative>,
    /// The quantity with its time, in words.
    #[serde(skip)]
    words: String,
}

/// A derivative with respect to a design variable.
#[derive(Serialize)]
struct Derivative {
    variable: String,
    value: f64,
}

impl Sensitivities {
    pub fn run(&self) -> anyhow::Result<()> {
        let (model, _) = self.given.settings.load(&self.given.file)?;
        let analysed = self.given.analyse(&model, true)?;
        if !self.given.json {
            self.given.head(&analysed)?;
        }
        let AnalysedDesign { problem, analyzed: AnalyzedDesign { design, responses, .. }, .. } = &analysed;
        let line = working("differentiating", self.given.show(), &model);
        let (known, without) = problem.all_sensitivities(design, responses)?;
        drop(line);
        let left_out = |(h, why): &(usize, linkwright::Error)| {
            format!("the output {} is left out of the derivatives: {why}", problem.responses[*h].name)
        };
        let left_out: Vec<String> = without.iter().map(left_out).collect();
        let table = tables::sensitivities(problem, responses, &known)?;
        let (objective, constraints) = self.gradients(&analysed, &known)?;
        if self.given.json {
            let record = SensitivityRecord {
                event: "sensitivities",
                version: 1,
                title: analysed.title.clone(),
                design: analysed.design_values(),
                objective,
                constraints,
                warnings: responses.warnings.iter().cloned().chain(left_out).collect(),
                notes: responses.notes.clone(),
            };
            say(&serde_json::to_string(&record)?)?;
        } else {
            self.list(&std::iter::once(&objective).chain(&constraints).collect::<Vec<_>>(), problem)?;
            warn(&left_out);
        }
        self.given.write("sensitivities.csv", &table.csv())
    }

    /// Prints gradients, a line for each: words, and the derivatives with their units in columns that are aligned on the right.
    fn list(&self, gradients: &[&GradientRecord], problem: &Problem) -> anyhow::Result<()> {
        let unit_of = |name: &str| problem.variables.iter().find(|v| v.name == name).map_or("", |v| v.unit.as_str());
        let head = gradients[0].derivatives.iter().map(|d| format!("d/d {}", d.variable));
        let mut lines = vec![std::iter::once(String::new()).chain(head).collect::<Vec<String>>()];
        for gradient in gradients {
            let cell = |d: &Derivative| {
                let unit = unit_of_derivative(&gradient.unit, unit_of(&d.variable));
                one_line(&with_unit(d.value, &unit, self.given.digits.count()))
            };
            lines.push(
                std::iter::once(one_line(&gradient.words)).chain(gradient.derivatives.iter().map(cell)).collect(),
            );
        }
        let width = |text: &str| text.chars().count();
        let widths: Vec<usize> =
            (0..lines[0].len()).map(|k| lines.iter().map(|line| width(&line[k])).max().unwrap_or(0)).collect();
        lines.iter().try_for_each(|line| {
            let padded = |k: usize| " ".repeat(widths[k] - width(&line[k]));
            let numbers = (1..line.len()).map(|k| format!("  {}{}", padded(k), line[k]));
            self.given.say(format!("  {}{}{}", line[0], padded(0), numbers.collect::<String>()).trim_end())
        })
    }

    /// The gradients of the objective and of the constrained quantities at their smallest margins, without the variable that bounds a peak.
    fn gradients(
        &self,
        analysed: &AnalysedDesign,
        known: &problem::Sensitivities,
    ) -> anyhow::Result<(GradientRecord, Vec<GradientRecord>)> {
        let AnalysedDesign { problem, analyzed, .. } = analysed;
        let AnalyzedDesign { design, responses, evaluation } = analyzed;
        let bound = problem.objective.peak().map(|peak| peak.variable);
        let named = |all: Vec<f64>| -> Vec<Derivative> {
            let named = problem.variables.iter().zip(all).enumerate().filter(|(k, _)| Some(*k) != bound);
            named.map(|(_, (v, value))| Derivative { variable: v.name.clone(), value }).collect()
        };
        let of_row = |row, sign| problem.row_derivative(row, sign, analyzed, known).map(named);
        let unit_of = |grid: Option<usize>| grid.map(|grid| problem.grids[grid].unit.clone()).unwrap_or_default();
        let NamedValue { name, unit, value } = analysed.objective();
        let objective = match outcome::peak_row(problem, design, evaluation) {
            Some(row) => {
                let constraint = &problem.constraints[row.constraint];
                let grid = constraint.quantity.grid();
                let time = outcome::time_of(problem, evaluation, row);
                GradientRecord {
                    words: time
                        .map_or_else(|| name.clone(), |(grid, time)| format!("{name} at {}", grid.in_words(time))),
                    time: time.map(|(grid, time)| grid.shown(time)),
                    time_unit: unit_of(grid),
                    derivatives: of_row(row, constraint.sign())?,
                    ..GradientRecord { name, unit, value, ..GradientRecord::default() }
                }
            }
            None => GradientRecord {
                words: name.clone(),
                derivatives: named(problem.total_derivative(
                    SignedQuantity { quantity: &problem.objective.quantity, sign: 1.0, bound: None },
                    0,
                    design,
                    responses,
                    known,
                )),
                ..GradientRecord { name, unit, value, ..GradientRecord::default() }
            },
        };
        let constraint = |c: outcome::ConstraintValue| -> linkwright::Result<GradientRecord> {
            let quantity = &problem.constraints[c.row.constraint].quantity;
            let at = c.time_in_words.as_ref().map(|time| format!(" at {time}"));
            let limit = with_unit(c.limit, &c.unit, self.given.digits.count());
            Ok(GradientRecord {
                words: format!("{} {} {limit}{}", c.name, c.relation(), at.unwrap_or_default()),
                time_unit: unit_of(quantity.grid().filter(|_| c.time.is_some())),
                derivatives: of_row(c.row, 1.0)?,
                relation: Some(c.relation()),
                limit: Some(c.limit),
                value: c.value,
                time: c.time,
                name: c.name,
                unit: c.unit,
            })
        };
        let constraints = outcome::constraints(problem, design, evaluation).into_iter().map(constraint);
        Ok((objective, constraints.collect::<linkwright::Result<_>>()?))
    }
}
