//! Scatter of the results for independent random variables.
//!
//! | phase | runs |
//! |---|---|
//! | `derivatives` | values and derivatives at the means, and on both sides of each mean, for second derivatives |
//! | `worst-case` | for each quantity, the corners of the tolerance box to which its derivatives point |
//! | `limits` | for each constraint, the reliability index |
//! | `samples` | analyses at points of a sample, to confirm |

use super::distribution::{Distribution, normal_probability, normal_quantile};
use super::error::StudyError;
use super::figures::{bars, histogram, stacked};
use super::file::StudyFile;
use super::model::{Evaluator, ModelSource, StudyQuantity, VIOLATION, VariedNumber};
use super::plan::{Column, Conclusions, Phase, RunResult, StudyPlan, in_words};
use super::reliability::first_order_reliability;
use super::rows::{Row, Rows};
use super::sample::{analysed, columns, mean_and_deviation};
use super::sequence::PointSequence;
use crate::model_file::Diagnostic;
use crate::report::figure::{Figure, Panel};
use crate::report::number::{counted, readable, unit_of_derivative, with_unit};
use crate::report::table::{Cell, Table};
use crate::{Error, Result};
use nalgebra::DMatrix;

/// Step of the central differences of derivatives for second derivatives, in standard deviations.
const ASIDE: f64 = 0.1;
/// Step of central differences of a quantity without derivatives, in standard deviations.
const STEP: f64 = 1e-3;

/// Error of the trapezoidal rule from the derivatives at both ends of a step, relative to the change of the derivative, above which the
/// derivative counts as not linear; zero for a parabola.
const UNEVEN: f64 = 0.1;
/// Change over a step, relative to the value, up to which it may be rounding.
const ROUNDING: f64 = 1e-9;
/// Difference of two probabilities, in standard errors of the sample, from which it counts as significant.
const DIFFERENT: f64 = 4.0;
/// Relative error of the search for a reliability index.
const CLOSE: f64 = 1e-6;
/// Difference of two standard deviations, relative to one of them, from which both are told.
const OTHER: f64 = 0.1;
/// Significant digits of standard deviations in sentences.
const SCATTER_DIGITS: usize = 4;
/// Share of the standard deviation below which second derivatives are negligible.
const NEGLIGIBLE: f64 = 1e-3;

const DERIVATIVES: usize = 0;
const WORST: usize = 1;
const LIMITS: usize = 2;
const SAMPLES: usize = 3;

/// A study of tolerances.
pub struct Tolerances {
    distributions: Vec<Distribution>,
    evaluator: Evaluator,
    wanted: Vec<StudyQuantity>,
    margins: Vec<StudyQuantity>,
    /// Those of inequalities.
    limits: Vec<StudyQuantity>,
    sampled: Vec<StudyQuantity>,
    points: PointSequence,
    phases: Vec<Phase>,
}

impl Tolerances {
    /// The study of a file.
    ///
    /// # Errors
    /// If the file does not fit the model.
    pub fn new(file: &StudyFile, source: &ModelSource) -> std::result::Result<Self, StudyError> {
        let evaluator = file.evaluator(source)?;
        let mut wanted = file.wanted(&evaluator)?;
        if let Some(word) = file.quantities.iter().find(|word| word.text == VIOLATION) {
            let message = format!("`{VIOLATION}` has no derivatives, from which tolerances are computed");
            let help = "name constraints, or their margins";
            return file.here(Err(Diagnostic::new(word.span.clone(), message).help(help)));
        }
        wanted.retain(StudyQuantity::is_differentiable);
        let margins = evaluator.margins();
        let inequalities: Vec<StudyQuantity> = margins.iter().filter(|q| !q.is_of_equation()).cloned().collect();
        let distributions = file.distributions(&evaluator)?;
        let d = distributions.len();
        let sampled: Vec<StudyQuantity> =
            wanted.iter().chain(margins.iter().filter(|m| !wanted.contains(m))).cloned().collect();
        let mut first = columns(&evaluator, &wanted);
        let slope = |q: &StudyQuantity, number: &VariedNumber| {
            Column::new(format!("d {}/d {}", q.name, number.name), unit_of_derivative(&q.unit, &number.unit))
        };
        let slopes = wanted.iter().flat_map(|q| evaluator.varied().iter().map(move |number| slope(q, number)));
        first.extend(slopes);
        let words =
            |all: &[StudyQuantity], name: &str| Column::of_words(name, all.iter().map(|q| q.name.clone()).collect());
        let inputs = || columns(&evaluator, &[]);
        let worst = [
            vec![words(&wanted, "quantity"), Column::of_words("end", vec!["low".into(), "high".into()])],
            inputs(),
            vec![Column::new("value", "")],
        ];
        let limits = [
            vec![
                words(&inequalities, "constraint"),
                Column::new("beta", ""),
                Column::new("probability", ""),
                Column::of_counts("evaluations"),
            ],
            inputs(),
        ];
        let phases = vec![
            Phase::independent("derivatives", first, 1 + 2 * d),
            Phase::independent("worst-case", worst.concat(), 2 * wanted.len()),
            Phase::independent("limits", limits.concat(), inequalities.len()),
            Phase::independent("samples", columns(&evaluator, &sampled), file.count),
        ];
        let points = PointSequence::new(file.sequence, d, file.count, file.seed)?;
        Ok(Self { distributions, evaluator, wanted, margins, limits: inequalities, sampled, points, phases })
    }

    fn means(&self) -> Vec<f64> {
        self.distributions.iter().map(Distribution::mean).collect()
    }

    fn steps(&self) -> Vec<f64> {
        self.distributions.iter().map(|d| STEP * d.deviation()).collect()
    }

    /// Values and derivatives at the means (run 0), below (odd runs) and above the mean of a variable.
    fn derivatives(&self, run: usize) -> Result<RunResult> {
        let mut x = self.means();
        if let Some(side) = run.checked_sub(1) {
            let sign = if side % 2 == 0 { -1.0 } else { 1.0 };
            x[side / 2] += sign * ASIDE * self.distributions[side / 2].deviation();
        }
        match self.evaluator.gradients(&x, &self.steps(), &self.wanted) {
            Ok(found) => {
                let slopes = found.rows.row_iter().flat_map(|row| row.iter().copied().collect::<Vec<_>>());
                Ok(RunResult::done(x.into_iter().chain(found.values).chain(slopes).collect()))
            }
            Err(error) => RunResult::failed(x, error),
        }
    }

    /// The value of a quantity at the corner of the tolerance box to which its derivatives at the means point.
    fn worst(&self, run: usize) -> Result<RunResult> {
        let (q, is_high) = (run / 2, run % 2 == 1);
        let head = vec![q as f64, f64::from(u8::from(is_high))];
        let wanted = std::slice::from_ref(&self.wanted[q]);
        let sign = if is_high { 1.0 } else { -1.0 };
        let corner = || -> std::result::Result<Vec<f64>, StudyError> {
            let slopes = self.evaluator.gradients(&self.means(), &self.steps(), wanted)?.rows;
            let towards = |slope: f64| if slope == 0.0 { 0.0 } else { sign * slope.signum() };
            let all = self.distributions.iter().enumerate();
            let x: Vec<f64> = all.map(|(k, d)| d.mean() + towards(slopes[(0, k)]) * d.tolerance()).collect();
            let value = self.evaluator.values(&x, wanted)?;
            Ok([x, value].concat())
        };
        match corner() {
            Ok(values) => Ok(RunResult::done([head, values].concat())),
            Err(error) => RunResult::failed(head, error),
        }
    }

    /// The reliability index of a constraint.
    fn limit(&self, run: usize) -> Result<RunResult> {
        let margin = std::slice::from_ref(&self.limits[run]);
        let x = |u: &[f64]| -> Vec<f64> {
            self.distributions.iter().zip(u).map(|(d, u)| d.of_standard_normal(*u)).collect()
        };
        let limit_state = |u: &[f64]| -> Result<(f64, Vec<f64>)> {
            let found = self.evaluator.gradients(&x(u), &self.steps(), margin).map_err(StudyError::into_error)?;
            let slope = |(k, d): (usize, &Distribution)| found.rows[(0, k)] * d.slope(u[k]);
            Ok((found.values[0], self.distributions.iter().enumerate().map(slope).collect()))
        };
        let value =
            |u: &[f64]| -> Result<f64> { Ok(self.evaluator.values(&x(u), margin).map_err(StudyError::into_error)?[0]) };
        let head = vec![run as f64];
        match first_order_reliability(self.distributions.len(), value, limit_state) {
            Ok(point) => {
                // An infinite index has no point, and no number.
                let results = [point.beta, normal_probability(-point.beta), point.evaluations as f64];
                Ok(RunResult::done(head.into_iter().chain(results).chain(x(&point.u)).collect()))
            }
            Err(error) => RunResult::failed(head, error),
        }
    }

    /// Gradient of a quantity in a row of the first phase.
    fn gradient(&self, row: &Row, q: usize) -> Vec<f64> {
        let d = self.distributions.len();
        let first = d + self.wanted.len() + q * d;
        (first..first + d).map(|k| row.value(k)).collect()
    }

    /// Second derivatives of a quantity by central differences of its gradients; symmetric.
    fn hessian(&self, rows: &Rows, q: usize) -> Option<DMatrix<f64>> {
        let d = self.distributions.len();
        let mut hessian = DMatrix::zeros(d, d);
        for k in 0..d {
            let side = |s: usize| {
                rows.get(DERIVATIVES, 1 + 2 * k + s).filter(|row| !row.has_failed()).map(|row| self.gradient(row, q))
            };
            let (low, high) = (side(0)?, side(1)?);
            let step = 2.0 * ASIDE * self.distributions[k].deviation();
            (0..d).for_each(|i| hessian[(i, k)] = (high[i] - low[i]) / step);
        }
        Some((&hessian + hessian.transpose()) * 0.5)
    }

    /// Means and standard deviations of a quantity by its first, and by its first and second derivatives.
    fn propagated(&self, rows: &Rows, q: usize) -> Option<[[f64; 2]; 2]> {
        let row = rows.get(DERIVATIVES, 0).filter(|row| !row.has_failed())?;
        let (value, g) = (row.value(self.distributions.len() + q), self.gradient(row, q));
        let linear = [value, first_order_variance(&g, &self.distributions).sqrt()];
        let hessian = self.hessian(rows, q).filter(|_| self.uneven(rows, q).is_none());
        let second = hessian.map(|h| second_order_moments(value, &g, &h, &self.distributions));
        Some([linear, second.unwrap_or([f64::NAN; 2])])
    }

    /// The variable along which the derivative of a quantity is not linear near the mean, as where an extreme moves to another time point: on
    /// one side, the change of the value is not the step times the mean derivative. Differences of derivatives are then not second derivatives.
    fn uneven(&self, rows: &Rows, q: usize) -> Option<usize> {
        let d = self.distributions.len();
        let row = |run: usize| rows.get(DERIVATIVES, run).filter(|row| !row.has_failed());
        let at = |row: &Row, k: usize| [row.value(d + q), self.gradient(row, q)[k]];
        let mean = row(0)?;
        let linear = first_order_variance(&self.gradient(mean, q), &self.distributions).sqrt();
        (0..d).find(|&k| {
            let (Some(low), Some(high)) = (row(1 + 2 * k), row(2 + 2 * k)) else { return false };
            let deviation = self.distributions[k].deviation();
            let step = ASIDE * deviation;
            let [here, low, high] = [mean, low, high].map(|row| at(row, k));
            let is_uneven = |[from, to]: [[f64; 2]; 2]| {
                let bent = step * (to[1] - from[1]).abs();
                let error = (to[0] - from[0] - 0.5 * step * (from[1] + to[1])).abs();
                error > UNEVEN * bent && bent > ROUNDING * here[0].abs()
            };
            let second = (high[1] - low[1]).abs() / (2.0 * step) * deviation * deviation;
            second > NEGLIGIBLE * linear && (is_uneven([low, here]) || is_uneven([here, high]))
        })
    }
}

/// The share of negative margins, and its standard error √(p(1 − p)/N).
fn share_of_violations(margins: &[f64]) -> [f64; 2] {
    let n = margins.len() as f64;
    let share = margins.iter().filter(|margin| **margin < 0.0).count() as f64 / n;
    [share, (share * (1.0 - share) / n).sqrt()]
}

/// Variance to first order: Σ g_k² σ_k².
fn first_order_variance(g: &[f64], distributions: &[Distribution]) -> f64 {
    g.iter().zip(distributions).map(|(g, d)| (g * d.deviation()).powi(2)).sum()
}

/// Mean and standard deviation of the quadratic f + gᵀδ + ½ δᵀHδ for independent symmetric δ with variances σ² and excess kurtosis κ:
///
/// $$ \mu = f + \tfrac12 \sum_k H_{kk} \sigma_k^2, \qquad
///    s^2 = \sum_k g_k^2 \sigma_k^2 + \tfrac14 \sum_k (\kappa_k + 2) H_{kk}^2 \sigma_k^4 + \sum_{k<l} H_{kl}^2 \sigma_k^2 \sigma_l^2 $$
fn second_order_moments(value: f64, g: &[f64], h: &DMatrix<f64>, distributions: &[Distribution]) -> [f64; 2] {
    let square = |k: usize| distributions[k].deviation().powi(2);
    let n = g.len();
    let mean = value + 0.5 * (0..n).map(|k| h[(k, k)] * square(k)).sum::<f64>();
    let own = |k: usize| 0.25 * (distributions[k].excess_kurtosis() + 2.0) * (h[(k, k)] * square(k)).powi(2);
    let pair = |k: usize| (0..k).map(|l| h[(k, l)].powi(2) * square(k) * square(l)).sum::<f64>();
    let variance = first_order_variance(g, distributions) + (0..n).map(|k| own(k) + pair(k)).sum::<f64>();
    [mean, variance.sqrt()]
}

impl StudyPlan for Tolerances {
    fn phases(&self) -> &[Phase] {
        &self.phases
    }

    fn run(&self, phase: usize, run: usize, _: &Rows) -> Result<RunResult> {
        match phase {
            DERIVATIVES => self.derivatives(run),
            WORST => self.worst(run),
            LIMITS => self.limit(run),
            _ => {
                let point = self.points.point(run);
                let count = self.points.count();
                let x = point.iter().zip(&self.distributions).map(|(p, d)| d.of_coordinate(*p, count)).collect();
                analysed(&self.evaluator, x, &self.sampled)
            }
        }
    }

    fn conclude(&self, rows: &Rows) -> Result<Conclusions> {
        let nominal = rows.get(DERIVATIVES, 0).filter(|row| !row.has_failed());
        let Some(nominal) = nominal else {
            let why = rows.get(DERIVATIVES, 0).map_or("", |row| row.failure.as_str());
            return Err(Error::analysis("the mean design", why, "choose means at which the model can be analysed"));
        };
        let (mut sentences, panels) = self.variances(rows, nominal);
        for (q, quantity) in self.wanted.iter().enumerate() {
            if let Some(k) = self.uneven(rows, q) {
                sentences.push(format!(
                    "{} has no second-order values: its derivative with respect to {} does not change evenly within {ASIDE} standard deviations of the mean, as \
                     where an extreme moves to another time point.",
                    quantity.name, self.evaluator.varied()[k].name
                ));
            }
        }
        for margin in self.margins.iter().filter(|margin| margin.is_of_equation()) {
            let name = margin.name.strip_suffix(".margin").unwrap_or(&margin.name);
            sentences.push(format!("{name} is an equation, which has no reliability index: scattered values miss it."));
        }
        sentences.extend((0..self.limits.len()).filter_map(|limit| self.about_limit(rows, limit)));
        let of_sample = |k: usize| rows.of(SAMPLES).map(move |row| row.value(k));
        let varied = self.evaluator.varied().iter().enumerate();
        sentences.extend(varied.filter_map(|(k, number)| number.outside(of_sample(k))));
        let figures = self.figures(rows, panels);
        let mut tables = vec![("moments".to_owned(), self.moments(rows, nominal)?)];
        if !self.margins.is_empty() {
            tables.push(("reliability".to_owned(), self.reliability(rows)?));
        }
        Ok(Conclusions { sentences, tables, figures })
    }
}

impl Tolerances {
    /// For each quantity that scatters: a sentence about it, and bars of the shares of the variables in its variance to first order.
    fn variances(&self, rows: &Rows, nominal: &Row) -> (Vec<String>, Vec<Panel>) {
        let names = self.names();
        let (mut sentences, mut panels) = (vec![], vec![]);
        for (q, quantity) in self.wanted.iter().enumerate() {
            let g = self.gradient(nominal, q);
            let variance = first_order_variance(&g, &self.distributions);
            let values = self.values(rows, q);
            let sampled = mean_and_deviation(&values)[1];
            let size = |deviation: f64| with_unit(deviation, &quantity.unit, SCATTER_DIGITS);
            if !(variance > 0.0) {
                if sampled > ROUNDING * nominal.value(self.distributions.len() + q).abs() {
                    sentences.push(format!(
                        "{} does not change to first order at the means; its standard deviation in the sample is {}.",
                        quantity.name,
                        size(sampled)
                    ));
                }
                continue;
            }
            let linear = variance.sqrt();
            // Standard error of a standard deviation: s/√(2N).
            let error = DIFFERENT * sampled / (2.0 * values.len() as f64).sqrt();
            let is_other = (sampled - linear).abs() > error.max(OTHER * linear);
            let share = |(g, d): (&f64, &Distribution)| (g * d.deviation()).powi(2) / variance;
            let shares: Vec<f64> = g.iter().zip(&self.distributions).map(share).collect();
            let largest = (0..shares.len()).max_by(|a, b| shares[*a].total_cmp(&shares[*b])).unwrap_or(0);
            let deviation = match is_other {
                true => format!(
                    "{} in the sample (standard deviation), and by {} to first order",
                    size(sampled),
                    size(linear)
                ),
                false => format!("{} (standard deviation)", size(linear)),
            };
            sentences.push(format!(
                "{} scatters by {deviation}; to first order, {} accounts for {:.0} % of the variance.",
                quantity.name,
                names[largest],
                100.0 * shares[largest]
            ));
            panels.push(bars(
                &format!("share of the variance of {}", crate::report::figure::literal(&quantity.name)),
                &names,
                &[("first order", shares)],
            ));
        }
        (sentences, panels)
    }

    /// The shares of the variances, and histograms of the first quantities.
    fn figures(&self, rows: &Rows, shares: Vec<Panel>) -> Vec<(String, String, Figure)> {
        let mut figures: Vec<(String, String, Figure)> = vec![];
        if let Some(figure) = stacked("Shares of the variances", shares, self.distributions.len()) {
            figures.push(("shares".to_owned(), "Which variable makes the results scatter.".to_owned(), figure));
        }
        let first = self.distributions.len();
        let histograms: Vec<_> = (0..self.wanted.len().min(4))
            .filter_map(|q| histogram(&self.phases[SAMPLES].columns[first + q], &self.values(rows, q)))
            .collect();
        if !histograms.is_empty() {
            let figure = Figure::new("Results of the sample", 85.0, 50.0 * histograms.len() as f64);
            let figure = histograms.into_iter().fold(figure, Figure::with);
            figures.push(("samples".to_owned(), "Results of the sample.".to_owned(), figure));
        }
        figures
    }

    /// Names of what varies.
    fn names(&self) -> Vec<String> {
        self.evaluator.varied().iter().map(|number| number.name.clone()).collect()
    }

    /// Sampled values of a quantity.
    fn values(&self, rows: &Rows, q: usize) -> Vec<f64> {
        let column = self.distributions.len() + q;
        rows.of(SAMPLES)
            .filter(|row| !row.has_failed())
            .map(|row| row.value(column))
            .filter(|v| v.is_finite())
            .collect()
    }

    /// Least and largest value of a quantity that was found in the tolerance box: at the mean, at the corner to which its derivatives point,
    /// and at the points of the sample inside; NaN if that corner has no value.
    fn worst_of(&self, rows: &Rows, nominal: &Row, q: usize) -> [f64; 2] {
        let d = self.distributions.len();
        let is_inside = |row: &&Row| {
            let inside =
                |(k, of): (usize, &Distribution)| (row.value(k) - of.mean()).abs() <= of.tolerance() * (1.0 + ROUNDING);
            self.distributions.iter().enumerate().all(inside)
        };
        let sampled = || rows.of(SAMPLES).filter(|row| !row.has_failed()).filter(is_inside).map(|row| row.value(d + q));
        let worst = |end: usize, worse: fn(f64, f64) -> f64| {
            let corner = rows.get(WORST, 2 * q + end).filter(|row| !row.has_failed())?;
            Some(sampled().chain([nominal.value(d + q)]).fold(corner.value(2 + d), worse))
        };
        [worst(0, f64::min), worst(1, f64::max)].map(|found| found.unwrap_or(f64::NAN))
    }

    fn moments(&self, rows: &Rows, nominal: &Row) -> Result<Table> {
        let columns = [
            "quantity",
            "unit",
            "nominal",
            "linear_deviation",
            "second_order_mean",
            "second_order_deviation",
            "sample_mean",
            "sample_deviation",
            "worst_low",
            "worst_high",
        ];
        let mut table = Table::new("Scatter of the results", columns).headed(columns.map(in_words))?;
        let d = self.distributions.len();
        for (q, quantity) in self.wanted.iter().enumerate() {
            let [[_, linear], [mean, deviation]] = self.propagated(rows, q).unwrap_or([[f64::NAN; 2]; 2]);
            let [sample_mean, sample_deviation] = mean_and_deviation(&self.values(rows, q));
            let [low, high] = self.worst_of(rows, nominal, q);
            let numbers = [nominal.value(d + q), linear, mean, deviation, sample_mean, sample_deviation, low, high];
            let cells = numbers.map(|v| if v.is_finite() { Cell::Number(v) } else { Cell::Empty });
            table.push([quantity.name.as_str().into(), quantity.unit.as_str().into()].into_iter().chain(cells))?;
        }
        Ok(table)
    }

    /// The reliability index of a limit with its probability, NaN if infinite; `None` if the search failed.
    fn form(&self, rows: &Rows, limit: usize) -> Option<[f64; 2]> {
        let row = rows.get(LIMITS, limit).filter(|row| !row.has_failed())?;
        Some([row.value(1), row.value(2)])
    }

    /// Margins of a constraint in the sample.
    fn sampled(&self, rows: &Rows, margin: &StudyQuantity) -> Vec<f64> {
        self.sampled.iter().position(|q| q == margin).map_or_else(Vec::new, |q| self.values(rows, q))
    }

    /// Distance from the means, in standard deviations, of the nearest point of the sample on the other side of a limit than they are, if it is nearer
    /// than its reliability index: the index is wrong then.
    fn contradiction(&self, rows: &Rows, limit: usize) -> Option<f64> {
        let [beta, probability] = self.form(rows, limit)?;
        let column = self.distributions.len() + self.sampled.iter().position(|q| *q == self.limits[limit])?;
        let is_beyond = |margin: f64| if probability > 0.5 { margin > 0.0 } else { margin < 0.0 };
        let beyond = rows.of(SAMPLES).filter(|row| !row.has_failed() && is_beyond(row.value(column)));
        let standard = Distribution::Normal { mean: 0.0, deviation: 1.0 };
        let coordinate = |(p, of): (f64, &Distribution)| match of {
            Distribution::Normal { .. } => standard.of_coordinate(p, self.points.count()),
            Distribution::Uniform { .. } => normal_quantile(p),
        };
        let size = |row: &Row| {
            let all = self.points.point(row.run).into_iter().zip(&self.distributions);
            all.map(|one| coordinate(one).powi(2)).sum::<f64>().sqrt()
        };
        let reach = if beta.is_finite() { beta.abs() * (1.0 - CLOSE) } else { f64::INFINITY };
        beyond.map(size).min_by(f64::total_cmp).filter(|distance| *distance < reach)
    }

    /// A remark about the reliability index of a limit, if one is needed.
    fn about_limit(&self, rows: &Rows, limit: usize) -> Option<String> {
        let margin = &self.limits[limit];
        let name = margin.name.strip_suffix(".margin").unwrap_or(&margin.name);
        if let Some(row) = rows.get(LIMITS, limit).filter(|row| row.has_failed()) {
            return Some(format!(
                "{name} has no reliability index ({}). Use the probability of the sample.",
                row.failure
            ));
        }
        let [beta, probability] = self.form(rows, limit)?;
        if let Some(distance) = self.contradiction(rows, limit) {
            return Some(format!(
                "{name} has no reliability index: the search missed the nearest point of its limit, because a point of the sample at {} standard \
                 deviations from the means is beyond it. Use the probability of the sample.",
                readable(distance, 3)
            ));
        }
        if !beta.is_finite() {
            let how = if probability > 0.5 { "is violated" } else { "is met" };
            return Some(format!(
                "{name} {how} for all values within 8 standard deviations of the means, as far as the search and the sample found."
            ));
        }
        let [share, error] = share_of_violations(&self.sampled(rows, margin));
        let largest = error.max((probability * (1.0 - probability) / self.phases[SAMPLES].runs as f64).sqrt());
        ((share - probability).abs() > DIFFERENT * largest).then(|| {
            format!(
                "{name} is violated with the probability {} ± {} by the sample, and {} by its reliability index: {}",
                readable(share, 3),
                readable(error, 2),
                readable(probability, 3),
                match rows.of(SAMPLES).filter(|row| row.has_failed()).count() {
                    0 => "its limit is curved, or has several points near the means. Use the probability of the sample.".to_owned(),
                    failed => format!(
                        "its limit is curved, or has several points near the means, or the {} that failed would change that of the sample.",
                        counted(failed, ["analysis", "analyses"])
                    ),
                }
            )
        })
    }

    fn reliability(&self, rows: &Rows) -> Result<Table> {
        let columns = ["constraint", "beta", "probability", "sample_probability", "standard_error"];
        let mut table =
            Table::new("Probability that a constraint is violated", columns).headed(columns.map(in_words))?;
        for margin in &self.margins {
            let number = self.limits.iter().position(|limit| limit == margin);
            let number = number.filter(|limit| self.contradiction(rows, *limit).is_none());
            let [beta, probability] = number.and_then(|limit| self.form(rows, limit)).unwrap_or([f64::NAN; 2]);
            let [share, error] = share_of_violations(&self.sampled(rows, margin));
            let numbers = [beta, probability, share, error];
            let cells = numbers.map(|v| if v.is_finite() { Cell::Number(v) } else { Cell::Empty });
            let name = margin.name.strip_suffix(".margin").unwrap_or(&margin.name);
            table.push(std::iter::once(name.into()).chain(cells))?;
        }
        Ok(table)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// f = x²: of a normal x with mean 0, f is a χ² variable times σ², with mean σ² and variance 2σ⁴. Of a uniform x in ±a: a²/3 and
    /// a⁴(1/5 − 1/9).
    #[test]
    fn moments_of_a_square_are_exact() {
        let h = DMatrix::from_element(1, 1, 2.0);
        let [mean, deviation] =
            second_order_moments(0.0, &[0.0], &h, &[Distribution::Normal { mean: 0.0, deviation: 0.3 }]);
        assert!((mean - 0.09).abs() < 1e-15 && (deviation - 2f64.sqrt() * 0.09).abs() < 1e-15);
        let [mean, deviation] = second_order_moments(0.0, &[0.0], &h, &[Distribution::Uniform { from: -3.0, to: 3.0 }]);
        assert!((mean - 3.0).abs() < 1e-14 && (deviation * deviation - 81.0 * (0.2 - 1.0 / 9.0)).abs() < 1e-12);
    }

    /// f = xy: variance μx²σy² + μy²σx² + σx²σy².
    #[test]
    fn the_variance_of_a_product_is_exact() {
        let h = DMatrix::from_row_slice(2, 2, &[0.0, 1.0, 1.0, 0.0]);
        let normal = |mean, deviation| Distribution::Normal { mean, deviation };
        let [mean, deviation] = second_order_moments(6.0, &[3.0, 2.0], &h, &[normal(2.0, 0.5), normal(3.0, 0.2)]);
        assert!(mean == 6.0 && (deviation * deviation - (4.0 * 0.04 + 9.0 * 0.25 + 0.01)).abs() < 1e-14);
    }
}
