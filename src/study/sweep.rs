//! The optimum for each value of a parameter, and Pareto fronts by ε-constraints.
//!
//! An optimization starts from the optimum of the nearest finished value, on a Pareto front moved by the derivative of that optimum with
//! respect to the limit. The values are computed in the order of a repeated bisection, so that several optimizations can run in parallel.

use super::error::StudyError;
use super::figures;
use super::file::{RUNS, StudyFile, StudyKind, Vary};
use super::model::{ModelSource, VariedNumber, constraint_name, names};
use super::optimum::{OptimizationEnd, WORK, optimize, with_start};
use super::plan::{Column, Conclusions, Phase, RunResult, StudyPlan, bisection};
use super::rows::{Row, Rows};
use super::sample::Points;
use crate::model_file::{Diagnostic, Model, settings};
use crate::problem::Problem;
use crate::report::figure::{Colour, Figure, Legend, Mark, MarkerShape, Panel, Stroke};
use crate::report::number::unit_of_derivative;
use crate::report::outcome;
use crate::report::table::{Cell, Table};
use crate::sao::{Parameter, PostOptimal, Status};
use crate::{Error, Result};

/// Largest violation in percent of a design that counts as feasible.
const FEASIBLE: f64 = 0.1;
/// Relative difference by which one design must be better than another.
const BETTER: f64 = 1e-6;

/// A setting that is swept.
#[derive(Clone, Debug)]
struct SweptSetting {
    name: String,
    /// Unit of its values; may be empty.
    unit: String,
    values: Vec<f64>,
    /// Keys of the model that are set to a value.
    keys: Vec<String>,
    form: SettingForm,
}

#[derive(Clone, Copy, Debug)]
enum SettingForm {
    /// A design variable, which is fixed.
    Variable(usize),
    /// Any other setting.
    Key,
    /// The limit of a constraint: number of the constraint, and 1 for ≤, −1 for ≥.
    Limit { constraint: usize, sign: f64 },
}

impl SweptSetting {
    fn is_variable(&self) -> bool {
        matches!(self.form, SettingForm::Variable(_))
    }

    /// True for a setting without unit whose values are integers, such as a number of time points.
    fn has_whole_values(&self) -> bool {
        let is_whole = |value: &f64| value.fract() == 0.0 && value.abs() < 1e15;
        matches!(self.form, SettingForm::Key) && self.unit.is_empty() && self.values.iter().all(is_whole)
    }

    fn edits(&self, value: f64) -> impl Iterator<Item = (String, f64)> {
        self.keys.iter().map(move |key| (key.clone(), value))
    }
}

/// Optimizations over the values of parameters.
pub struct Sweep {
    source: ModelSource,
    settings: Vec<SweptSetting>,
    points: Points,
    /// Number of values of each parameter.
    sizes: Vec<usize>,
    variables: usize,
    /// Numbers of the stated constraints, whose values are columns.
    stated: Vec<usize>,
    is_maximum: bool,
    /// The design variable that is swept, if it is one.
    swept: Option<VariedNumber>,
    phases: Vec<Phase>,
}

impl Sweep {
    /// The study of a file.
    ///
    /// # Errors
    /// If the file does not fit the model.
    pub fn new(file: &StudyFile, source: &ModelSource) -> std::result::Result<Self, StudyError> {
        let model = source.model()?;
        let problem = model.problem()?;
        let is_front = file.kind == StudyKind::Pareto;
        let setting = |vary: &Vary| {
            if is_front { limit(file, source, &model, &problem, vary) } else { setting(file, source, &model, vary) }
        };
        let settings = file.vary.iter().map(setting).collect::<std::result::Result<Vec<_>, _>>()?;
        let values: Vec<Vec<f64>> = settings.iter().map(|s| s.values.clone()).collect();
        let sizes: Vec<usize> = values.iter().map(Vec::len).collect();
        let runs = sizes.iter().fold(1usize, |runs, n| runs.saturating_mul(*n));
        Error::check_option("number of optimizations", "at most 10 million", runs as f64, runs <= RUNS)?;
        let suffix = if is_front { "limit of " } else { "" };
        let of_setting = |(s, vary): (&SweptSetting, &Vary)| {
            let is_count = !is_front && s.has_whole_values();
            let column = Column::new(format!("{suffix}{}", s.name), &s.unit).on_scale(vary.is_logarithmic);
            Column { is_count, ..column }
        };
        let mut columns: Vec<Column> = settings.iter().zip(&file.vary).map(of_setting).collect();
        let swept: Vec<&str> = settings.iter().filter(|s| s.is_variable()).map(|s| s.name.as_str()).collect();
        columns.extend(OptimizationEnd::columns(&model)?);
        let design = settings.len() + WORK..columns.len();
        columns[design].iter_mut().for_each(|column| column.is_repeated = swept.contains(&column.name.as_str()));
        let stated: Vec<usize> = outcome::stated_constraints(&problem).collect();
        columns.extend(stated.iter().map(|&j| Column::new(constraint_name(&problem, j), outcome::unit(&problem, j))));
        if is_front {
            for s in &settings {
                let derivative = |name: &str, unit: &str| {
                    Column::new(format!("d {name}/d {}", s.name), unit_of_derivative(unit, &s.unit))
                };
                columns.push(derivative(&problem.objective.name, &problem.objective.unit));
                columns.extend(model.variables().iter().map(|v| derivative(&v.name, &v.unit)));
            }
        }
        let phase = Phase { name: "runs", columns, runs, waves: Some(bisection(runs)) };
        Ok(Self {
            source: source.clone(),
            settings,
            points: Points::Grid(values),
            sizes,
            variables: model.variables().len(),
            stated,
            is_maximum: outcome::goal(&problem) == "maximized",
            swept: file
                .vary
                .first()
                .filter(|_| !is_front)
                .and_then(|vary| VariedNumber::of(&model, &vary.name.text).ok()),
            phases: vec![phase],
        })
    }

    fn is_front(&self) -> bool {
        self.settings.iter().any(|s| matches!(s.form, SettingForm::Limit { .. }))
    }

    /// Column of the objective.
    fn objective(&self) -> usize {
        self.settings.len()
    }

    /// First column of the design.
    fn design(&self) -> usize {
        self.objective() + WORK
    }

    /// Column of the value of a constraint.
    fn constraint(&self, j: usize) -> Option<usize> {
        Some(self.design() + self.variables + self.stated.iter().position(|&i| i == j)?)
    }

    /// First column of the derivatives with respect to a limit.
    fn derivatives(&self, setting: usize) -> usize {
        self.design() + self.variables + self.stated.len() + setting * (1 + self.variables)
    }

    fn is_optimum(&self, row: &Row) -> bool {
        !row.has_failed()
            && row.status == format!("{:?}", Status::Converged)
            && row.value(self.objective() + 1) <= FEASIBLE
    }

    /// Indices of the values of a run, one for each parameter.
    fn places(&self, run: usize) -> Vec<usize> {
        let mut rest = run;
        let place = |n: &usize| {
            let place = rest % n;
            rest /= n;
            place
        };
        let mut places: Vec<usize> = self.sizes.iter().rev().map(place).collect();
        places.reverse();
        places
    }

    /// The start of a run: the nearest optimum of the waves before its own, moved along its derivatives; `None` for that of the model.
    fn start(&self, run: usize, point: &[f64], done: &Rows) -> Option<Vec<f64>> {
        let waves = self.phases[0].waves.as_ref()?;
        let wave = waves.iter().position(|wave| wave.binary_search(&run).is_ok())?;
        let own = self.places(run);
        let distance = |other: usize| own.iter().zip(self.places(other)).map(|(a, b)| a.abs_diff(b)).sum::<usize>();
        let earlier = waves[..wave].iter().flatten().filter_map(|&other| done.get(0, other));
        let near = earlier.filter(|row| self.is_optimum(row)).min_by_key(|row| (distance(row.run), row.run))?;
        let from = self.points.point(near.run);
        let value = |k: usize| {
            let slope = |s: usize| {
                let slope = if self.is_front() { near.value(self.derivatives(s) + 1 + k) } else { 0.0 };
                if slope.is_finite() { slope * (point[s] - from[s]) } else { 0.0 }
            };
            near.value(self.design() + k) + (0..self.settings.len()).map(slope).sum::<f64>()
        };
        Some((0..self.variables).map(value).collect())
    }

    fn optimized(&self, run: usize, point: &[f64], done: &Rows) -> std::result::Result<(Vec<f64>, String), StudyError> {
        let edits = self.settings.iter().zip(point).flat_map(|(s, value)| s.edits(*value));
        let mut source = self.source.with_numbers(&self.source.model()?, edits)?;
        if let Some(start) = self.start(run, point, done) {
            source = with_start(&source, &start)?;
        }
        let end = optimize(&source)?;
        let (problem, state) = (&end.problem, &end.state);
        let mut values = end.values();
        let constraints = outcome::constraints(problem, &state.design, &state.evaluation);
        values.extend(constraints.iter().map(|c| c.value));
        if self.is_front() {
            let post = PostOptimal::new(problem, state).ok().filter(|_| state.status.is_success());
            for s in &self.settings {
                let SettingForm::Limit { constraint, .. } = s.form else { continue };
                let parameter = Parameter::Limit(constraint);
                let sign = if self.is_maximum { -1.0 } else { 1.0 };
                let slope = post.as_ref().and_then(|post| post.objective(problem, parameter).ok());
                values.push(slope.map_or(f64::NAN, |slope| sign * slope));
                let moved = post.as_ref().and_then(|post| post.design(problem, parameter).ok());
                let moved = moved.unwrap_or_else(|| vec![f64::NAN; self.variables]);
                let bound = problem.objective.peak().map(|peak| peak.variable);
                values.extend(moved.iter().enumerate().filter(|(k, _)| Some(*k) != bound).map(|(_, v)| *v));
            }
        }
        Ok((values, end.status()))
    }
}

/// The setting of a sweep: a design variable, a constant, or a key of the model.
fn setting(
    file: &StudyFile,
    source: &ModelSource,
    model: &Model,
    vary: &Vary,
) -> std::result::Result<SweptSetting, StudyError> {
    let name = vary.name.text.clone();
    if let Some(k) = model.variables().iter().position(|v| v.name == name) {
        let unit = model.variables()[k].unit.clone();
        let keys = ["start", "lower", "upper"].map(|key| format!("design.{name}.{key}")).into();
        let values = file.here(vary.values(&unit))?;
        return Ok(SweptSetting { name, unit, values, keys, form: SettingForm::Variable(k) });
    }
    let is_constant = model.constants().iter().any(|constant| constant.name == name);
    let key = if is_constant { format!("constants.{name}") } else { name.clone() };
    let unit = model.unit_of(&key).map_or_else(String::new, |unit| unit.text);
    let values = file.here(vary.values(&unit))?;
    let new = SweptSetting { name, unit, values, keys: vec![key], form: SettingForm::Key };
    match source.with_numbers(model, new.edits(new.values[0])).and_then(|source| source.model()) {
        Ok(_) => Ok(new),
        Err(error) if new.keys[0].contains('.') => Err(file.at(&vary.name.span, &error)),
        Err(_) => Err(file.unknown(&vary.name, "design variable, constant or setting", names(model))),
    }
}

/// The limit of a constraint.
fn limit(
    file: &StudyFile,
    source: &ModelSource,
    model: &Model,
    problem: &Problem,
    vary: &Vary,
) -> std::result::Result<SweptSetting, StudyError> {
    let name = vary.name.text.clone();
    let error =
        |message: String, help: &str| file.here(Err(Diagnostic::new(vary.name.span.clone(), message).help(help)));
    let sides: Vec<usize> =
        outcome::stated_constraints(problem).filter(|&j| outcome::name(problem, j) == name).collect();
    let constraint = match sides[..] {
        [constraint] => constraint,
        [] => {
            let known = outcome::stated_constraints(problem).map(|j| outcome::name(problem, j));
            return Err(file.unknown(&vary.name, "constraint", known));
        }
        _ => {
            let help = "write two constraints, `at_most` and `at_least`, with different names";
            return error(format!("`{name}` has limits on both sides"), help);
        }
    };
    let all = settings(&source.name, &source.text).unwrap_or_default();
    let keys = ["at_most", "at_least"].map(|side| format!("constraint.{name}.{side}"));
    let unit = outcome::unit(problem, constraint).to_owned();
    let values = file.here(vary.values(&unit))?;
    let is_settable =
        |key: &String| all.contains_key(key) && source.with_numbers(model, [(key.clone(), values[0])]).is_ok();
    let Some(key) = keys.into_iter().find(is_settable) else {
        let help = "give the constraint one limit, and a name of letters and digits without `each`";
        return error(format!("the limit of `{name}` cannot be set"), help);
    };
    let sign = problem.constraints[constraint].sign();
    Ok(SweptSetting { name, unit, values, keys: vec![key], form: SettingForm::Limit { constraint, sign } })
}

impl StudyPlan for Sweep {
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn run(&self, _: usize, run: usize, done: &Rows) -> Result<RunResult> {
        let point = self.points.point(run);
        match self.optimized(run, &point, done) {
            Ok((values, status)) => Ok(RunResult { values: [point, values].concat(), status, failure: String::new() }),
            Err(error) => RunResult::failed(point, error),
        }
    }

    fn conclude(&self, rows: &Rows) -> Result<Conclusions> {
        let phase = &self.phases[0];
        let optima: Vec<&Row> = rows.of(0).filter(|row| self.is_optimum(row)).collect();
        let mut sentences =
            vec![format!("{} of {} optimizations converged to a feasible design.", optima.len(), phase.runs)];
        sentences.extend(self.swept.iter().filter_map(|number| number.outside(rows.of(0).map(|row| row.value(0)))));
        if optima.is_empty() {
            return Ok(Conclusions { sentences, ..Conclusions::default() });
        }
        if self.is_front() {
            return self.front(&optima, sentences);
        }
        let columns = [self.objective()].into_iter().chain(self.design()..self.design() + self.variables.min(3));
        let shown: Vec<Panel> = columns
            .filter(|&k| !matches!(self.settings[0].form, SettingForm::Variable(v) if k == self.design() + v))
            .map(|k| figures::curve(phase, &optima, 0, k))
            .collect();
        let figure = Figure::new("The optimum over the parameter", 85.0, 50.0 * shown.len() as f64);
        let figure = shown.into_iter().fold(figure, Figure::with);
        sentences.push(format!("The optimum is given for {} values of {}.", optima.len(), self.settings[0].name));
        let table = phase.table("Optima", optima.into_iter())?;
        Ok(Conclusions {
            sentences,
            tables: vec![("optima".to_owned(), table)],
            figures: vec![("sweep".to_owned(), "Objective and design at the optimum.".to_owned(), figure)],
        })
    }
}

impl Sweep {
    /// Values to be minimized: the objective and the limited quantities.
    fn objectives(&self, row: &Row) -> Vec<f64> {
        let of_limit = |s: &SweptSetting| match s.form {
            SettingForm::Limit { constraint, sign, .. } => self.constraint(constraint).map(|k| sign * row.value(k)),
            _ => None,
        };
        let sign = if self.is_maximum { -1.0 } else { 1.0 };
        std::iter::once(sign * row.value(self.objective())).chain(self.settings.iter().filter_map(of_limit)).collect()
    }

    fn front(&self, optima: &[&Row], mut sentences: Vec<String>) -> Result<Conclusions> {
        let phase = &self.phases[0];
        let all: Vec<Vec<f64>> = optima.iter().map(|row| self.objectives(row)).collect();
        let is_front = undominated(&all);
        let limited = self.settings.iter().filter_map(|s| match s.form {
            SettingForm::Limit { constraint, .. } => self.constraint(constraint),
            _ => None,
        });
        let shown: Vec<usize> =
            limited.chain([self.objective()]).chain(self.design()..self.design() + self.variables).collect();
        let slopes: Vec<usize> = (0..self.settings.len()).map(|s| self.derivatives(s)).collect();
        let columns = || shown.iter().chain(&slopes).map(|&k| &phase.columns[k]);
        let names = columns().map(|column| column.name.clone());
        let headings = std::iter::once("run".to_owned()).chain(columns().map(Column::heading));
        let mut table = Table::new("Pareto front", std::iter::once("run".to_owned()).chain(names)).headed(headings)?;
        let front: Vec<&Row> =
            optima.iter().zip(&is_front).filter(|(_, is_front)| **is_front).map(|(row, _)| *row).collect();
        for row in &front {
            let cell = |&k: &usize| Some(row.value(k)).filter(|v| v.is_finite()).map_or(Cell::Empty, Cell::Number);
            table.push(std::iter::once(row.run.into()).chain(shown.iter().chain(&slopes).map(cell)))?;
        }
        sentences.push(format!("{} of them are on the Pareto front.", front.len()));
        let mut figure = Figure::new("Pareto front", 85.0, 65.0 * self.settings.len() as f64);
        for (limit, &x) in shown.iter().take(self.settings.len()).enumerate() {
            let mut points: Vec<[f64; 2]> =
                front.iter().map(|row| [row.value(x), row.value(self.objective())]).collect();
            points.sort_by(|a, b| a[0].total_cmp(&b[0]));
            let is_logarithmic = phase.columns[limit].is_logarithmic && points.iter().all(|point| point[0] > 0.0);
            let limited = phase.columns[x].clone().on_scale(is_logarithmic);
            let axes = [&limited, &phase.columns[self.objective()]].map(figures::axis);
            let [x_axis, y_axis] = axes;
            let mut panel = Panel::new(x_axis, y_axis).legend(Legend::Below);
            let rest = optima.iter().zip(&is_front).filter(|(_, is_front)| !**is_front);
            let rest: Vec<[f64; 2]> = rest.map(|(row, _)| [row.value(x), row.value(self.objective())]).collect();
            if !rest.is_empty() {
                panel.add(Mark::points(rest, MarkerShape::Cross, Colour::of_series(1), 3.0).named("dominated"));
            }
            if self.settings.len() == 1 {
                panel.add(Mark::curve(points.clone(), Stroke::solid(Colour::BLUE, 0.8)));
            }
            panel.add(Mark::points(points, MarkerShape::Disc, Colour::BLUE, 3.0).named("Pareto front"));
            figure = figure.with(panel);
        }
        Ok(Conclusions {
            sentences,
            tables: vec![("front".to_owned(), table)],
            figures: vec![("front".to_owned(), "The objective over the other ones.".to_owned(), figure)],
        })
    }
}

/// For each point: true if no other one is as good in every objective and better in one, and no earlier one is equal.
pub fn undominated(points: &[Vec<f64>]) -> Vec<bool> {
    let tolerance = |a: f64, b: f64| BETTER * a.abs().max(b.abs());
    let is_as_good = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| *a <= *b + tolerance(*a, *b));
    let is_better = |a: &[f64], b: &[f64]| a.iter().zip(b).any(|(a, b)| *a < *b - tolerance(*a, *b));
    let survives = |k: usize| {
        let beats =
            |(i, other): (usize, &Vec<f64>)| is_as_good(other, &points[k]) && (is_better(other, &points[k]) || i < k);
        !points.iter().enumerate().filter(|(i, _)| *i != k).any(beats)
    };
    (0..points.len()).map(survives).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dominated_and_repeated_points_are_not_on_the_front() {
        let points = [[1.0, 3.0], [2.0, 2.0], [2.0, 2.5], [3.0, 1.0], [2.0, 2.0], [3.0, 3.0]].map(Vec::from);
        assert_eq!(undominated(&points), [true, true, false, true, false, false]);
    }
}
