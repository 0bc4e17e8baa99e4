//! Values of objective and constraints at one design.

use super::Responses;
use serde::{Deserialize, Serialize};

/// Objective and constraints at one design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "StoredEvaluation")]
pub struct Evaluation {
    /// Minimized value of the objective, in its unit: F, or −F where F is maximized.
    pub objective: f64,
    /// `residuals[j][p]`: c = ĝ_j − 1 at time point p, so that feasible means ≤ 0; −1 outside the window of an inequality, 0 outside that of an equality. It has
    /// digits that ĝ has not if the scale of the constraint is large.
    ///
    /// Where a constraint holds in continuous time, the value of a time point that is a local maximum is that of the peak
    /// itself.
    pub residuals: Vec<Vec<f64>>,
    /// Indices j of equality constraints, for which only c_j = 0 is feasible.
    pub equalities: Vec<usize>,
    /// Local maxima of the constraints that hold in continuous time, in order.
    pub peaks: Vec<PeakTime>,
}

/// An evaluation in a file. Earlier ones have ĝ as `constraints` in place of the residuals.
#[derive(Deserialize)]
struct StoredEvaluation {
    objective: f64,
    #[serde(default)]
    residuals: Vec<Vec<f64>>,
    #[serde(default)]
    constraints: Vec<Vec<f64>>,
    #[serde(default)]
    equalities: Vec<usize>,
    #[serde(default)]
    peaks: Vec<PeakTime>,
}

impl From<StoredEvaluation> for Evaluation {
    fn from(stored: StoredEvaluation) -> Self {
        let StoredEvaluation { objective, residuals, constraints, equalities, peaks } = stored;
        let earlier = constraints.into_iter().map(|g| g.into_iter().map(|g| g - 1.0).collect());
        Self {
            objective,
            residuals: if residuals.is_empty() { earlier.collect() } else { residuals },
            equalities,
            peaks,
        }
    }
}

/// A design with its responses and its evaluation: the result of an analysis.
#[derive(Clone, Debug)]
pub struct AnalyzedDesign {
    /// Design b.
    pub design: Vec<f64>,
    /// Responses there.
    pub responses: Responses,
    /// Objective and constraints there.
    pub evaluation: Evaluation,
}

/// A constraint at one of its time points.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RowId {
    /// Index j of the constraint.
    pub constraint: usize,
    /// Index p of the time point, 0 for a time-independent constraint.
    pub point: usize,
}

/// A local maximum of a constraint in continuous time, in units of the normalized ĝ.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PeakTime {
    /// The constraint, and the time point that is the maximum among its neighbours.
    pub row: RowId,
    /// The time of the maximum itself.
    pub time: f64,
}

impl Evaluation {
    /// ĝ of constraint `j` at its time points.
    pub fn normalized(&self, j: usize) -> Vec<f64> {
        self.residuals[j].iter().map(|c| c + 1.0).collect()
    }

    /// V: the largest violation (17), (18) over all constraints and time points, in percent; −100 without constraints.
    pub fn max_violation_pct(&self) -> f64 {
        self.worst().map_or(-100.0, |(row, c)| self.violation(row.constraint, c) * 100.0)
    }

    /// The violation of a row with the residual c: c for an inequality, |c| for an equality.
    pub fn violation(&self, constraint: usize, residual: f64) -> f64 {
        violation(self.equalities.contains(&constraint), residual)
    }

    /// The largest violation of each constraint.
    pub fn violations(&self) -> Vec<f64> {
        let largest = |j| self.worst_of(j).map_or(f64::NEG_INFINITY, |(_, c)| self.violation(j, c));
        (0..self.residuals.len()).map(largest).collect()
    }

    /// The constraint and time point with the largest violation, and the residual there.
    pub fn worst(&self) -> Option<(RowId, f64)> {
        self.largest((0..self.residuals.len()).filter_map(|j| self.worst_of(j)))
    }

    /// The time point of constraint `j` with the largest violation, the first of several, and the residual there.
    pub fn worst_of(&self, j: usize) -> Option<(RowId, f64)> {
        let row = |(point, &c): (usize, &f64)| (RowId { constraint: j, point }, c);
        self.largest(self.residuals.get(j)?.iter().enumerate().map(row))
    }

    fn largest(&self, rows: impl Iterator<Item = (RowId, f64)>) -> Option<(RowId, f64)> {
        let by = |(row, c): (RowId, f64)| self.violation(row.constraint, c);
        rows.fold(None, |worst, row| if worst.is_none_or(|w| by(row) > by(w)) { Some(row) } else { worst })
    }

    /// c of a row; for a constraint in continuous time that of the nearest local maximum, if there is one.
    pub fn residual_of(&self, row: RowId) -> f64 {
        let point = self.nearest_peak(row).map_or(row.point, |peak| peak.row.point);
        self.residuals[row.constraint][point]
    }

    /// ĝ of a row, as [`residual_of`](Self::residual_of).
    pub fn value_of(&self, row: RowId) -> f64 {
        self.residual_of(row) + 1.0
    }

    /// The local maximum whose value the row has; `None` for the value of a time point.
    pub fn peak_of(&self, row: RowId) -> Option<&PeakTime> {
        self.peaks.iter().find(|peak| peak.row == row)
    }

    /// The local maximum of the row's constraint that is nearest to its time point; `None` unless the constraint is in
    /// continuous time.
    pub fn nearest_peak(&self, row: RowId) -> Option<&PeakTime> {
        let peaks = self.peaks.iter().filter(|p| p.row.constraint == row.constraint);
        peaks.min_by_key(|p| p.row.point.abs_diff(row.point))
    }
}

/// The violation of a row ĝ − 1 ≤ 0, or ĝ − 1 = 0.
pub(crate) fn violation(is_equality: bool, row: f64) -> f64 {
    if is_equality { row.abs() } else { row }
}

/// Local maxima of a history, always with its first and last point. A plateau counts once.
pub(crate) fn maxima(g: &[f64]) -> Vec<usize> {
    let last = g.len() - 1;
    let is_maximum = |p: usize| p == 0 || p == last || (g[p] > g[p - 1] && g[p] >= g[p + 1]);
    (0..=last).filter(|&p| is_maximum(p)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn evaluations_of_earlier_runs_are_read() {
        let read = |text: &str| serde_json::from_str::<Evaluation>(text).unwrap();
        let earlier = read(r#"{"objective": 2.0, "constraints": [[0.75, 1.5], [1.0]], "equalities": [1]}"#);
        assert_eq!((&earlier.residuals, &earlier.equalities), (&vec![vec![-0.25, 0.5], vec![0.0]], &vec![1]));
        assert_eq!(earlier.max_violation_pct(), 50.0);
        assert_eq!(read(&serde_json::to_string(&earlier).unwrap()), earlier);
    }

    #[test]
    fn ends_count_and_plateaus_count_once() {
        assert_eq!(maxima(&[0.8, 0.9, 0.2, 0.8, 0.75]), [0, 1, 3, 4]);
        assert_eq!(maxima(&[0.0, 0.9, 0.9, 0.0]), [0, 1, 3]);
    }
}
