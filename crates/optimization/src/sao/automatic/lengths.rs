//! Lengths of variables and units of rows and objective, from the designs of the run.

use super::AutomaticState;
use super::candidates::AcceptedPoint;
use super::linearized::Linearized;
use crate::problem::{Evaluation, Problem};
use crate::sao::trace::Trace;
use serde::{Deserialize, Serialize};

/// Least start length of a bounded variable, as a fraction of its range.
const LEAST_OF_RANGE: f64 = 0.02;
/// Largest length from a range or from rows, relative to the variable, or to |F| / |∂F/∂b| if the variable is zero.
const WIDEST: [f64; 2] = [3e4, 1e3];
/// Length from a range, relative to the variable, above which it is a guess: bounds of 1e6 may stand for none.
const GUESSED: f64 = 10.0;
/// Range above which the range does not determine a length where the size of the variable is not known either: the variable starts at
/// zero, and so does everything that depends on it.
const LONGEST_RANGE: f64 = 1e5;
/// A length from slopes is at most this times the median of the others. Slopes near a point where they vanish are very small.
const LARGEST: f64 = 1e6;
/// Gradients below this fraction of the largest one do not determine a length.
const NEGLIGIBLE: f64 = 1e-12;
/// Share of the first-order change of each function over the start values below which a start value counts as zero.
const LEAST_SHARE: f64 = 1e-5;
/// Value of a violated row, and of the objective, relative to its first-order change over the start values, from which on all start
/// values count as zero. The objective may contain a constant.
const FAR: [f64; 2] = [1e6, 1e10];
/// Least objective per unit of violation, as a fraction of the range of the objective.
const LEAST_OF_OBJECTIVE: f64 = 1e-3;

/// Start lengths of the variables.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StartLengths {
    /// Length d of each variable.
    pub lengths: Vec<f64>,
    /// True for each length that is a guess, as the variable starts at zero and has no range.
    pub guessed: Vec<bool>,
}

/// Start lengths d: |b|, at least 2 % of the range of a bounded variable and at most its range; a range of more than 1.5·10⁶ |b| counts as
/// 1.5·10⁶ |b|, and a length from a range of more than 500 |b| is a guess. A start value counts as zero if its contributions to the
/// first-order changes of objective and rows are negligible compared with those of the others. All start values count as zero if their
/// contributions together are negligible compared with the objective or with the value of a violated row.
///
/// A variable without range that starts at zero has the median of |cᵢ| / |∂cᵢ/∂bⱼ| over the rows; failing that, |F| / |∂F/∂bⱼ|;
/// failing that, the median of the other variables; failing that, 1. It is a guess: move limits grow up to tenfold in a cycle, and
/// [`Units`] shortens guesses that steps have shown to be too long.
///
/// The sizes of the start are those of [`start_sizes`]; slopes `here` at a later design, which may be an optimum, do not determine them.
pub(super) fn start_lengths(problem: &Problem, start_sizes: &[f64], objective: f64, here: &Linearized) -> StartLengths {
    let n = start_sizes.len();
    let steepest = |row: &mut dyn Iterator<Item = f64>| row.fold(0.0f64, |a, g| a.max(g.abs()));
    let row = |i: usize| (here.c[i], here.jacobian.row(i).iter().copied().collect());
    let rows: Vec<(f64, Vec<f64>)> = (0..here.c.len()).map(row).collect();
    let seen = |j: usize| {
        let ratio = |(r, g): &(f64, Vec<f64>)| {
            let usable = g[j].abs() > NEGLIGIBLE * steepest(&mut g.iter().copied());
            (usable && *r != 0.0).then(|| r.abs() / g[j].abs())
        };
        median(rows.iter().filter_map(ratio).collect()).or_else(|| ratio(&(objective, here.gradient.clone())))
    };
    let by_objective = |j: usize| Some((objective / here.gradient[j]).abs()).filter(|d| d.is_finite() && *d > 0.0);
    // Very wide bounds and limits do not determine a length.
    let size = |j: usize| {
        let known = Some(start_sizes[j]).filter(|size| *size > 0.0);
        known.or_else(|| by_objective(j)).or_else(|| seen(j)).unwrap_or(f64::INFINITY)
    };
    let one = |j: usize| {
        let variable = &problem.variables[j];
        let range = variable.upper - variable.lower;
        let tells_a_size = range.is_finite() && range > 0.0 && (size(j).is_finite() || range <= LONGEST_RANGE);
        let known = if tells_a_size {
            start_sizes[j].max((LEAST_OF_RANGE * range).min(WIDEST[0] * size(j))).min(range)
        } else {
            start_sizes[j]
        };
        (known > 0.0).then_some(known)
    };
    let mut lengths: Vec<Option<f64>> = (0..n).map(one).collect();
    let is_guess = |(j, length): (usize, &Option<f64>)| length.is_none_or(|length| length > GUESSED * size(j));
    let guessed = lengths.iter().enumerate().map(is_guess).collect();
    let largest = median(lengths.iter().flatten().copied().collect()).map_or(f64::INFINITY, |d| LARGEST * d);
    for (j, length) in lengths.iter_mut().enumerate().filter(|(_, length)| length.is_none()) {
        *length = seen(j).filter(|d| *d <= largest).map(|d| d.min(WIDEST[1] * size(j)));
    }
    let other = median(lengths.iter().flatten().copied().collect()).unwrap_or(1.0);
    StartLengths { lengths: lengths.into_iter().map(|d| d.unwrap_or(other)).collect(), guessed }
}

/// |b|, or zero for a start value that counts as zero by the slopes at the start.
pub(super) fn start_sizes(b: &[f64], objective: f64, here: &Linearized) -> Vec<f64> {
    let n = b.len();
    let changes =
        |slope: &mut dyn Iterator<Item = f64>| -> Vec<f64> { slope.zip(b).map(|(g, b)| (g * b).abs()).collect() };
    let by_objective = changes(&mut here.gradient.iter().copied());
    let by_rows: Vec<Vec<f64>> =
        (0..here.c.len()).map(|i| changes(&mut here.jacobian.row(i).iter().copied())).collect();
    let sum = |changes: &[f64]| changes.iter().sum::<f64>();
    let is_violated = |i: &usize| here.equality[*i] || here.c[*i] > 0.0;
    let is_far = (0..by_rows.len()).filter(is_violated).any(|i| here.c[i].abs() > FAR[0] * sum(&by_rows[i]))
        || objective.abs() > FAR[1] * sum(&by_objective);
    let has_share = |j: usize| {
        let mut all = by_rows.iter().chain([&by_objective]).filter(|changes| sum(changes) > 0.0);
        let counts = |changes: &Vec<f64>| changes[j] >= LEAST_SHARE * changes.iter().copied().fold(0.0, f64::max);
        all.any(counts)
    };
    (0..n).map(|j| if is_far || !has_share(j) { 0.0 } else { b[j].abs() }).collect()
}

fn median(mut values: Vec<f64>) -> Option<f64> {
    values.retain(|v| v.is_finite() && *v > 0.0);
    values.sort_unstable_by(f64::total_cmp);
    let half = values.len() / 2;
    match values.len() {
        0 => None,
        n if n % 2 == 1 => Some(values[half]),
        _ => Some(0.5 * (values[half - 1] + values[half])),
    }
}

/// Largest half width of the box at the start, as a fraction of a guessed length, that shows the guess to be far too long.
const FAR_TOO_LONG: f64 = 1e-3;

/// Change and value of a row, relative to its scale, up to which they are rounding errors: limits hold to a millionth of the scale.
const IDENTITY: f64 = 1e-12;

/// Lengths and units of a cycle.
#[derive(Clone, Debug)]
pub(super) struct Units {
    /// ℓ: start lengths, or the extent of all accepted designs where that is larger.
    pub lengths: Vec<f64>,
    /// σ of each constraint: the largest Σ |∂ĝ/∂bⱼ| ℓⱼ over the stored designs; the largest one of the violated constraints for all of
    /// them where they have a common unit.
    pub rows: Vec<f64>,
    /// For each constraint, true if it holds and nothing has changed it by more than rounding, such as an identity: it is no constraint.
    pub is_identity: Vec<bool>,
    /// Largest minus smallest objective of all accepted designs without excursions.
    pub objective_range: f64,
}

impl Units {
    /// Units from the start lengths, the accepted designs, and the stored designs.
    ///
    /// Once a step was rejected, all guessed lengths shrink by the same factor, to the largest extent that one of their variables
    /// has, or the half width of its box if that is larger: a guess depends on a constant in the objective, on which the run must not
    /// depend. At a start that no step has left, they shrink where the box has become far smaller: near an optimum, where slopes vanish, they are
    /// too long by many orders of magnitude.
    pub fn new(memory: &AutomaticState, trace: &Trace, evaluation: &Evaluation) -> Self {
        let AutomaticState { start_lengths, guessed, points, widths, .. } = memory;
        let extents: Vec<f64> = (0..start_lengths.len()).map(|j| spread(trace.designs.extent(j).into_iter())).collect();
        let guesses = || (0..guessed.len()).filter(|&j| guessed[j]);
        let reached = || guesses().map(|j| extents[j].max(widths[j]) / start_lengths[j]).fold(0.0, f64::max);
        let is_at_start = extents.iter().all(|extent| *extent == 0.0);
        let has_moved = guesses().any(|j| extents[j] > 0.0);
        let is_too_long = trace.has_rejected && (has_moved || (is_at_start && reached() < FAR_TOO_LONG));
        let shrinkage = if is_too_long { reached().min(1.0) } else { 1.0 };
        let start = |j: usize| start_lengths[j] * if guessed.get(j) == Some(&true) { shrinkage } else { 1.0 };
        let lengths: Vec<f64> = extents.iter().enumerate().map(|(j, extent)| extent.max(start(j))).collect();
        let change_and_value = |i: usize| {
            let change = |p: &AcceptedPoint| p.slopes[i].iter().zip(&lengths).map(|(g, l)| g * l).sum::<f64>();
            let largest = points.iter().map(change).fold(0.0, f64::max);
            [largest, evaluation.worst_of(i).map_or(0.0, |(_, c)| c.abs())]
        };
        let is_identity: Vec<bool> =
            (0..evaluation.residuals.len()).map(|i| is_identity(change_and_value(i))).collect();
        let unit = |i: usize| change_and_value(i).into_iter().find(|v| *v > 0.0 && !is_identity[i]).unwrap_or(1.0);
        let mut rows: Vec<f64> = (0..evaluation.residuals.len()).map(unit).collect();
        if memory.has_common_unit {
            let violations = evaluation.violations();
            let violated = rows.iter().zip(&violations).filter(|(_, v)| **v > 0.0);
            let common = violated.map(|(unit, _)| *unit).fold(0.0, f64::max);
            rows.iter_mut().filter(|_| common > 0.0).for_each(|unit| *unit = common);
        }
        Self { rows, is_identity, objective_range: trace.objective.width(), lengths }
    }

    /// h: the largest violation in units of the rows; `violations` has one entry for each constraint.
    pub fn violation(&self, violations: &[f64]) -> f64 {
        violations.iter().zip(&self.rows).map(|(v, unit)| v / unit).fold(0.0, f64::max)
    }

    /// The largest violation relative to the terms Σ |∂ĝ/∂bⱼ| min(ℓⱼ, max(|bⱼ|, extent)) of its row at the current design, the
    /// last one stored. A length may be far larger than the variable; its units would then hide a violation.
    pub fn violation_in_terms(&self, violations: &[f64], here: &AcceptedPoint, start_lengths: &[f64]) -> f64 {
        let size = |j: usize| {
            // Lengths that exceed the start lengths are extents.
            let extent = if self.lengths[j] > start_lengths[j] { self.lengths[j] } else { 0.0 };
            let size = here.design[j].abs().max(extent);
            if size > 0.0 { size.min(self.lengths[j]) } else { self.lengths[j] }
        };
        let sizes: Vec<f64> = (0..self.lengths.len()).map(size).collect();
        let of = |((v, slopes), is_identity): ((&f64, &Vec<f64>), &bool)| {
            let terms: f64 = slopes.iter().zip(&sizes).map(|(g, l)| g * l).sum();
            if *v <= 0.0 || terms <= 0.0 || *is_identity { 0.0 } else { v / terms }
        };
        violations.iter().zip(&here.slopes).zip(&self.is_identity).map(of).fold(0.0, f64::max)
    }

    /// σ_f, the objective per unit of h, from pairs (λᵢ, constraint of row i).
    pub fn objective_per_violation(&self, multipliers: impl Iterator<Item = (f64, usize)>) -> f64 {
        let sum: f64 = multipliers.map(|(λ, constraint)| λ.abs() * self.rows[constraint]).sum();
        sum.max(LEAST_OF_OBJECTIVE * self.objective_range)
    }
}

/// True for a row whose largest change over the lengths and whose value are rounding errors, relative to its scale.
pub(super) fn is_identity(change_and_value: [f64; 2]) -> bool {
    change_and_value.iter().all(|x| *x <= IDENTITY)
}

/// Largest minus smallest of the values.
pub(in crate::sao) fn spread(values: impl Iterator<Item = f64>) -> f64 {
    let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    (most - least).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_ignores_zeros_and_what_is_not_finite() {
        assert_eq!(median(vec![0.0, 3.0, f64::INFINITY, 1.0]), Some(2.0));
        assert_eq!(median(vec![f64::NAN]), None);
    }

    #[test]
    fn a_spread_is_never_negative() {
        assert_eq!((spread([2.0, -1.0, 0.5].into_iter()), spread(std::iter::empty())), (3.0, 0.0));
    }
}
