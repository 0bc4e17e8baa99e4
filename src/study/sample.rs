//! Grids and samples of analyses.

use super::distribution::Distribution;
use super::error::StudyError;
use super::figures;
use super::file::RUNS;
use super::file::{StudyFile, StudyKind};
use super::model::{Evaluator, ModelSource, StudyQuantity};
use super::plan::{Column, Conclusions, Phase, RunResult, StudyPlan};
use super::rows::Rows;
use super::sequence::PointSequence;
use crate::report::table::{Cell, Table};
use crate::{Error, Result};

/// Analyses at given points.
pub struct Analyses {
    points: Points,
    pub(super) evaluator: Evaluator,
    pub(super) wanted: Vec<StudyQuantity>,
    phases: Vec<Phase>,
}

/// The values of the variables at each run.
pub enum Points {
    /// All combinations of these values; the last variable changes fastest.
    Grid(Vec<Vec<f64>>),
    /// Points of a sequence with these distributions.
    Sequence(PointSequence, Vec<Distribution>),
}

impl Points {
    /// The point of a run.
    pub fn point(&self, run: usize) -> Vec<f64> {
        match self {
            Self::Grid(values) => {
                let mut rest = run;
                let mut point: Vec<f64> = values
                    .iter()
                    .rev()
                    .map(|values| {
                        let k = rest % values.len();
                        rest /= values.len();
                        values[k]
                    })
                    .collect();
                point.reverse();
                point
            }
            Self::Sequence(sequence, distributions) => {
                let coordinates = sequence.point(run);
                coordinates.iter().zip(distributions).map(|(p, d)| d.of_coordinate(*p, sequence.count())).collect()
            }
        }
    }
}

impl Analyses {
    /// The analyses of a study file.
    ///
    /// # Errors
    /// If the file does not fit the model.
    pub fn new(file: &StudyFile, source: &ModelSource) -> std::result::Result<Self, StudyError> {
        let evaluator = file.evaluator(source)?;
        let wanted = file.wanted(&evaluator)?;
        let (points, runs) = if file.kind == StudyKind::Grid {
            let all = file.vary.iter().zip(evaluator.varied());
            let values = all.map(|(vary, number)| file.here(vary.values(&number.unit)));
            let values = values.collect::<std::result::Result<Vec<_>, _>>()?;
            let runs = values.iter().fold(1usize, |runs, values| runs.saturating_mul(values.len()));
            Error::check_option("number of points of the grid", "at most 10 million", runs as f64, runs <= RUNS)?;
            (Points::Grid(values), runs)
        } else {
            let sequence = PointSequence::new(file.sequence, file.vary.len(), file.count, file.seed)?;
            (Points::Sequence(sequence, file.distributions(&evaluator)?), file.count)
        };
        let mut columns = columns(&evaluator, &wanted);
        columns.iter_mut().zip(&file.vary).for_each(|(column, vary)| column.is_logarithmic = vary.is_logarithmic);
        let phases = vec![Phase::independent("runs", columns, runs)];
        Ok(Self { points, evaluator, wanted, phases })
    }
}

/// Columns of variables and quantities.
pub fn columns(evaluator: &Evaluator, wanted: &[StudyQuantity]) -> Vec<Column> {
    let inputs = evaluator.varied().iter().map(|number| Column::new(&number.name, &number.unit));
    inputs.chain(wanted.iter().map(|q| Column::new(&q.name, &q.unit))).collect()
}

/// The row of an analysis: variables, then quantities.
pub fn analysed(evaluator: &Evaluator, x: Vec<f64>, wanted: &[StudyQuantity]) -> Result<RunResult> {
    match evaluator.values(&x, wanted) {
        Ok(values) => Ok(RunResult::done([x, values].concat())),
        Err(error) => RunResult::failed(x, error),
    }
}

impl StudyPlan for Analyses {
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn run(&self, _: usize, run: usize, _: &Rows) -> Result<RunResult> {
        analysed(&self.evaluator, self.points.point(run), &self.wanted)
    }

    fn conclude(&self, rows: &Rows) -> Result<Conclusions> {
        let phase = &self.phases[0];
        let inputs = phase.columns.len() - self.wanted.len();
        let summary = moments("Results over all runs", phase, rows, 0, inputs)?;
        let figure = match &self.points {
            Points::Grid(values) => figures::over_grid(phase, rows, values)?,
            Points::Sequence(..) => figures::over_sample(phase, rows, inputs)?,
        };
        let done = rows.of(0).filter(|row| !row.has_failed()).count();
        let mut sentences = vec![format!("{done} of {} analyses have results.", phase.runs)];
        let varied = self.evaluator.varied().iter().enumerate();
        sentences.extend(varied.filter_map(|(k, number)| number.outside(rows.of(0).map(|row| row.value(k)))));
        Ok(Conclusions {
            sentences,
            tables: vec![("summary".to_owned(), summary)],
            figures: figure
                .into_iter()
                .map(|f| ("response".to_owned(), "Results over the variables.".to_owned(), f))
                .collect(),
        })
    }
}

/// Mean, standard deviation and extremes of the quantities of a phase; the first `inputs` columns are left out.
pub fn moments(title: &str, phase: &Phase, rows: &Rows, number: usize, inputs: usize) -> Result<Table> {
    let mut table = Table::new(title, ["quantity", "unit", "count", "mean", "deviation", "minimum", "maximum"]);
    for (k, column) in phase.columns.iter().enumerate().skip(inputs) {
        let values: Vec<f64> =
            rows.of(number).filter(|row| !row.has_failed()).map(|row| row.value(k)).filter(|v| v.is_finite()).collect();
        let [mean, deviation] = mean_and_deviation(&values);
        let extreme = |best: fn(f64, f64) -> f64| values.iter().copied().reduce(best);
        let cell = |v: Option<f64>| v.filter(|v| v.is_finite()).map_or(Cell::Empty, Cell::Number);
        table.push([
            column.name.as_str().into(),
            column.unit.as_str().into(),
            values.len().into(),
            cell(Some(mean)),
            cell(Some(deviation)),
            cell(extreme(f64::min)),
            cell(extreme(f64::max)),
        ])?;
    }
    Ok(table)
}

/// Mean and standard deviation of a sample, of which the latter is NaN for fewer than two values.
pub fn mean_and_deviation(values: &[f64]) -> [f64; 2] {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares = values.iter().map(|v| (v - mean) * (v - mean)).sum::<f64>();
    [mean, if values.len() < 2 { f64::NAN } else { (squares / (n - 1.0)).sqrt() }]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fewer_than_two_values_have_no_deviation() {
        assert!(mean_and_deviation(&[]).iter().all(|v| v.is_nan()));
        assert!(mean_and_deviation(&[2.0])[1].is_nan());
        assert_eq!(mean_and_deviation(&[1.0, 3.0]), [2.0, f64::sqrt(2.0)]);
    }

    #[test]
    fn the_last_variable_of_a_grid_changes_fastest() {
        let grid = Points::Grid(vec![vec![1.0, 2.0], vec![5.0, 6.0, 7.0]]);
        let all: Vec<Vec<f64>> = (0..6).map(|run| grid.point(run)).collect();
        assert_eq!(all[..4], [vec![1.0, 5.0], vec![1.0, 6.0], vec![1.0, 7.0], vec![2.0, 5.0]]);
    }
}
