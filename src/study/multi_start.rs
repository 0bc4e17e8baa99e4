//! Optimizations from many starts by several methods.

use super::error::StudyError;
use super::figures;
use super::file::{RUNS, StudyFile};
use super::model::ModelSource;
use super::optimum::{OptimizationEnd, WORK, optimize, with_start};
use super::plan::{Column, Conclusions, Phase, RunResult, StudyPlan, in_words};
use super::rows::{Row, Rows};
use super::sequence::PointSequence;
use crate::model_file::{Diagnostic, toml_string};
use crate::report::figure::Figure;
use crate::report::number::readable;
use crate::report::outcome;
use crate::report::table::{Cell, Table};
use crate::sao::{Status, presets};
use crate::{Error, Result};

/// Largest violation in percent of a design that counts as feasible.
const FEASIBLE: f64 = 0.1;
/// Difference of objectives up to which two ends count as one optimum, relative to the best objective or, where that is nearly zero, to
/// [a fraction](outcome::OF_DECREASE) of its median distance from the objectives at the starts.
const SAME: f64 = 1e-3;
/// Largest number of optima in the table.
const OPTIMA: usize = 20;

/// Optimizations from many starts.
pub struct MultiStartPlan {
    source: ModelSource,
    /// Presets, of which `None` is the method of the model.
    methods: Vec<Option<String>>,
    points: PointSequence,
    start: Vec<f64>,
    /// Index and range of each variable whose start varies.
    ranges: Vec<(usize, [f64; 2])>,
    is_maximum: bool,
    phases: Vec<Phase>,
}

impl MultiStartPlan {
    /// The study of a file.
    ///
    /// # Errors
    /// If the file does not fit the model.
    pub fn new(file: &StudyFile, source: &ModelSource) -> std::result::Result<Self, StudyError> {
        let model = source.model()?;
        let problem = model.problem()?;
        let variables = model.variables();
        let mut ranges = vec![];
        for vary in &file.vary {
            let Some(k) = variables.iter().position(|v| v.name == vary.name.text) else {
                return Err(file.unknown(&vary.name, "design variable", variables.iter().map(|v| v.name.as_str())));
            };
            let v = &variables[k];
            let [from, to] = file.here(vary.ends(&v.unit))?;
            let range = [from.unwrap_or(v.lower), to.unwrap_or(v.upper)];
            if !(range.iter().all(|end| end.is_finite() && (v.lower..=v.upper).contains(end)) && range[0] < range[1]) {
                let message = format!("the starts of `{}` have no range within its bounds", v.name);
                let help = format!("give `from` and `to` between {} and {} {}", v.lower, v.upper, v.unit);
                return file.here(Err(Diagnostic::new(vary.name.span.clone(), message).help(help.trim_end())));
            }
            ranges.push((k, range));
        }
        let methods = methods(file)?;
        let runs = file.count.saturating_mul(methods.len());
        Error::check_option("number of runs", "at most 10 million", runs as f64, runs <= RUNS)?;
        let name = |method: &Option<String>| method.clone().unwrap_or_else(|| "method of the model".to_owned());
        let mut columns = vec![Column::of_words("method", methods.iter().map(name).collect())];
        columns.extend(variables.iter().map(|v| Column::new(format!("start {}", v.name), &v.unit)));
        columns.push(Column::new(format!("start {}", problem.objective.name), &problem.objective.unit));
        columns.extend(OptimizationEnd::columns(&model)?);
        Ok(Self {
            source: source.clone(),
            points: PointSequence::new(file.sequence, ranges.len(), file.count, file.seed)?,
            methods,
            start: variables.iter().map(|v| v.start).collect(),
            ranges,
            is_maximum: outcome::goal(&problem) == "maximized",
            phases: vec![Phase::independent("runs", columns, runs)],
        })
    }

    /// The start of a number: the first one is that of the model.
    fn start(&self, number: usize) -> Vec<f64> {
        let mut start = self.start.clone();
        if number > 0 {
            for (p, (k, [from, to])) in self.points.point(number).iter().zip(&self.ranges) {
                start[*k] = from + (to - from) * p;
            }
        }
        start
    }

    /// Column of the objective at the start.
    fn objective_at_start(&self) -> usize {
        1 + self.start.len()
    }

    /// Column of the objective at the end.
    fn objective(&self) -> usize {
        self.objective_at_start() + 1
    }

    /// True if a run ended with a feasible optimum.
    fn is_optimum(&self, row: &Row) -> bool {
        !row.has_failed()
            && row.status == format!("{:?}", Status::Converged)
            && row.value(self.objective() + 1) <= FEASIBLE
    }
}

/// The status of an optimization that has not failed, in words: `cycle limit`.
fn status_in_words(row: &Row) -> String {
    let all = [Status::Running, Status::CycleLimit, Status::Stalled, Status::Infeasible, Status::Converged];
    let known = all.into_iter().find(|status| format!("{status:?}") == row.status);
    known.map_or_else(|| row.status.clone(), |status| status.to_string())
}

/// The presets of a file.
fn methods(file: &StudyFile) -> std::result::Result<Vec<Option<String>>, StudyError> {
    let mut all = vec![];
    for word in &file.methods {
        let known = presets().iter().map(|preset| preset.name);
        if word.text == "all" {
            all.extend(known.map(|name| Some(name.to_owned())));
        } else if known.clone().any(|name| name == word.text) {
            all.push(Some(word.text.clone()));
        } else {
            return Err(file.unknown(word, "method", known.chain(["all"])));
        }
    }
    Ok(if all.is_empty() { vec![None] } else { all })
}

impl StudyPlan for MultiStartPlan {
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn run(&self, _: usize, run: usize, _: &Rows) -> Result<RunResult> {
        let (number, m) = (run / self.methods.len(), run % self.methods.len());
        let start = self.start(number);
        let inputs = [vec![m as f64], start.clone()].concat();
        let preset = self.methods[m].as_ref().map(|name| ("method.preset", toml_string(name)));
        let end = self.source.with(preset).and_then(|source| optimize(&with_start(&source, &start)?));
        match end {
            Ok(end) => {
                let values = [inputs, vec![end.objective_at_start()?], end.values()].concat();
                Ok(RunResult { values, status: end.status(), failure: String::new() })
            }
            Err(error) => RunResult::failed(inputs, error),
        }
    }

    fn conclude(&self, rows: &Rows) -> Result<Conclusions> {
        let phase = &self.phases[0];
        let objective = self.objective();
        let sign = if self.is_maximum { -1.0 } else { 1.0 };
        let mut optima: Vec<&Row> = rows.of(0).filter(|row| self.is_optimum(row)).collect();
        optima.sort_by(|a, b| {
            (sign * a.value(objective)).total_cmp(&(sign * b.value(objective))).then(a.run.cmp(&b.run))
        });
        let Some(best) = optima.first().map(|row| row.value(objective)) else {
            return Ok(Conclusions {
                sentences: vec![format!("None of the {} runs converged to a feasible design.", phase.runs)],
                ..Conclusions::default()
            });
        };
        let equal = self.equal(rows, best);
        let groups: Vec<&[&Row]> =
            optima.chunk_by(|a, b| (a.value(objective) - b.value(objective)).abs() <= equal).collect();
        let found = groups.first().map_or(0, |group| group.len());
        let column = &phase.columns[objective];
        let mut sentences = vec![
            format!(
                "{} of {} runs converged to a feasible design, {found} of them to the best objective, {} = {} {}.",
                optima.len(),
                phase.runs,
                column.name,
                readable(best, 6),
                column.unit
            ),
            match groups.len() {
                1 => "All optima have the same objective.".to_owned(),
                n => format!("The optima have {n} different objectives."),
            },
        ];
        if let Some(better) = self.better_without_convergence(rows, best - sign * equal) {
            sentences.push(format!(
                "Run {} ended at a better feasible design, {} = {} {}, without convergence ({}).",
                better.run,
                column.name,
                readable(better.value(objective), 6),
                column.unit,
                status_in_words(better)
            ));
        }
        let (first, n) = (objective + WORK, self.start.len());
        let figure = self.figure(rows, &optima, equal, [[1, 2], [first, first + 1.min(n - 1)]]);
        Ok(Conclusions {
            sentences: sentences.into_iter().map(|text| text.replace(" .", ".")).collect(),
            tables: vec![
                ("optima".to_owned(), self.optima(&groups)?),
                ("methods".to_owned(), self.by_method(rows, [best, equal])?),
            ],
            figures: vec![(
                "starts".to_owned(),
                "From the starts to the ends; objectives at the ends in their order.".to_owned(),
                figure,
            )],
        })
    }
}

impl MultiStartPlan {
    /// Difference from the `best` objective up to which objectives are equal.
    fn equal(&self, rows: &Rows, best: f64) -> f64 {
        let decreases = rows.of(0).map(|row| (row.value(self.objective_at_start()) - best).abs());
        let mut decreases: Vec<f64> = decreases.filter(|decrease| decrease.is_finite()).collect();
        decreases.sort_by(f64::total_cmp);
        let median = decreases.get(decreases.len() / 2).copied().unwrap_or(0.0);
        SAME * best.abs().max(outcome::OF_DECREASE * median)
    }

    /// The run with the best feasible design among those that have not converged, if its objective is better than `limit`.
    fn better_without_convergence<'r>(&self, rows: &'r Rows, limit: f64) -> Option<&'r Row> {
        let (objective, sign) = (self.objective(), if self.is_maximum { -1.0 } else { 1.0 });
        let value = |row: &Row| sign * row.value(objective);
        let is_feasible = |row: &&Row| !row.has_failed() && row.value(objective + 1) <= FEASIBLE;
        let others = rows.of(0).filter(|row| !self.is_optimum(row)).filter(is_feasible);
        let found = others.min_by(|a, b| value(a).total_cmp(&value(b)).then(a.run.cmp(&b.run)))?;
        (value(found) < sign * limit).then_some(found)
    }

    /// Starts and ends in the columns of two variables, and the objectives of the `optima`, which are `equal` up to this difference.
    fn figure(&self, rows: &Rows, optima: &[&Row], equal: f64, [starts, ends]: [[usize; 2]; 2]) -> Figure {
        let phase = &self.phases[0];
        let all: Vec<&Row> = rows.of(0).filter(|row| !row.has_failed()).collect();
        let of_method = |(m, name): (usize, &String)| {
            let own = optima.iter().filter(|row| row.value(0) as usize == m).map(|row| row.value(self.objective()));
            (name.clone(), own.collect())
        };
        let series: Vec<(String, Vec<f64>)> = phase.columns[0].words.iter().enumerate().map(of_method).collect();
        let ranked = figures::ranked(&figures::label(&phase.columns[self.objective()]), &series, equal);
        let height = 70.0 + 4.0 * self.methods.len() as f64;
        if self.start.len() < 2 {
            return Figure::new("Objectives at the ends", 85.0, height).with(ranked);
        }
        let plane = figures::starts_and_ends(phase, &all, starts, ends);
        Figure::new("Starts and ends", 170.0, height).in_columns(2).with(plane).with(ranked)
    }

    /// Different optima, the best first, with the number of runs, and number and design of the run with the best objective among them.
    fn optima(&self, groups: &[&[&Row]]) -> Result<Table> {
        let phase = &self.phases[0];
        let (objective, design) = (self.objective(), self.objective() + WORK);
        let columns = || std::iter::once(&phase.columns[objective]).chain(&phase.columns[design..]);
        let head = || ["runs", "best_run"].into_iter();
        let mut table = Table::new("Optima", head().map(str::to_owned).chain(columns().map(|c| c.name.clone())))
            .headed(head().map(in_words).chain(columns().map(Column::heading)))?;
        for group in groups.iter().take(OPTIMA) {
            let row = group[0];
            let values = (design..phase.columns.len()).map(|k| Cell::Number(row.value(k)));
            let head = [group.len().into(), row.run.into(), Cell::Number(row.value(objective))];
            table.push(head.into_iter().chain(values))?;
        }
        Ok(table)
    }

    /// For each method: numbers of runs, feasible optima, those with the best objective up to the difference `equal`, and failures, and the mean
    /// work of all runs that have not failed.
    fn by_method(&self, rows: &Rows, [best, equal]: [f64; 2]) -> Result<Table> {
        let columns = ["method", "runs", "optima", "best", "failed", "mean_analyses", "mean_sensitivity_analyses"];
        let mut table = Table::new("Methods", columns).headed(columns.map(in_words))?;
        let objective = self.objective();
        for (m, name) in self.phases[0].columns[0].words.iter().enumerate() {
            let own: Vec<&Row> = rows.of(0).filter(|row| row.value(0) as usize == m).collect();
            let optima: Vec<&&Row> = own.iter().filter(|row| self.is_optimum(row)).collect();
            let is_best = |row: &&&&Row| (row.value(objective) - best).abs() <= equal;
            let done: Vec<&&Row> = own.iter().filter(|row| !row.has_failed()).collect();
            let mean = |column: usize| match done.len() {
                0 => Cell::Empty,
                n => Cell::Number(done.iter().map(|row| row.value(column)).sum::<f64>() / n as f64),
            };
            table.push([
                name.as_str().into(),
                own.len().into(),
                optima.len().into(),
                optima.iter().filter(is_best).count().into(),
                own.iter().filter(|row| row.has_failed()).count().into(),
                mean(objective + 3),
                mean(objective + 4),
            ])?;
        }
        Ok(table)
    }
}
