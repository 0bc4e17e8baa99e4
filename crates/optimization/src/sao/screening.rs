//! Constraint screening: selects the critical and potentially critical constraints for the approximate problem.

use crate::problem::{Evaluation, Problem, RowId, Selection, maxima};
use error::{Error, Result};
use std::collections::BTreeSet;

/// Selection of the constraints and time points that are retained (Section 4 of the paper).
///
/// A row is a candidate if ĝ exceeds the cut-off; candidates of a history are retained if they are near local maxima.
/// Equalities are always retained, and so are constraints on the design variables alone, which need no analysis. A
/// constraint in continuous time has one retained row for each peak above the cut-off. Time points outside the window
/// of a constraint are never retained.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Screening {
    /// Rows with ĝ up to this value are removed; ĝ = 1 is the limit. The paper's examples use 0.7 and 0.5. `None` retains all.
    pub cutoff: Option<f64>,
    /// Selection of time points of a history, unless its constraint has its own.
    pub selection: Selection,
    /// Repeats a cycle whose proposal violates a constraint without retained rows, with these rows.
    pub repeats: bool,
}

impl Default for Screening {
    /// The paper's screening, which retains rows above 70 % of the limit, at two time points before and after each local maximum;
    /// and cycles are repeated with violated rows that it has removed.
    fn default() -> Self {
        Self { cutoff: Some(0.7), selection: Selection::NearMaxima(2), repeats: true }
    }
}

impl Screening {
    /// The default without repetitions: violated rows that the screening has removed are retained in the next cycle.
    pub fn as_published() -> Self {
        Self { repeats: false, ..Self::default() }
    }

    /// All rows at all time points.
    pub fn all() -> Self {
        Self { cutoff: None, selection: Selection::All, repeats: true }
    }

    /// Retains rows above this cut-off, at the time points near local maxima that the paper retains.
    pub fn above(cutoff: f64) -> Self {
        Self { cutoff: Some(cutoff), ..Self::default() }
    }

    /// Checks the cut-off.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] unless it is below 1.
    pub fn check(&self) -> Result<()> {
        let cutoff = self.cutoff.unwrap_or(0.0);
        Error::check_option("screening cut-off", "a number below 1, such as 0.7", cutoff, cutoff < 1.0)
    }

    /// True if a normalized value is above the cut-off.
    pub fn is_critical(&self, g: f64) -> bool {
        self.cutoff.is_none_or(|cutoff| g > cutoff)
    }

    /// The retained rows, in order of constraint and time.
    pub fn retain(&self, problem: &Problem, evaluation: &Evaluation) -> Vec<RowId> {
        let mut retained = vec![];
        for (constraint, declared) in problem.constraints.iter().enumerate() {
            let history = evaluation.normalized(constraint);
            let quantity = &declared.quantity;
            let points: Vec<usize> = if declared.is_equality() {
                (0..history.len()).collect()
            } else if declared.is_continuous {
                let peaks = evaluation.peaks.iter().filter(|p| p.row.constraint == constraint);
                peaks.map(|p| p.row.point).filter(|&p| self.is_critical(history[p])).collect()
            } else if !quantity.is_transient() {
                Vec::from_iter((quantity.is_explicit() || self.is_critical(history[0])).then_some(0))
            } else {
                self.points(&history, declared.selection.unwrap_or(self.selection))
            };
            let points = points.into_iter().filter(|&p| problem.holds(constraint, p));
            retained.extend(points.map(|point| RowId { constraint, point }));
        }
        retained
    }

    /// Rows that were not retained, but are violated at a proposed design.
    ///
    /// Unless `all` is true, only rows of constraints without retained rows: other time points of the other constraints are left to the
    /// next cycle. Constraints in continuous time have a row for each peak at the start of the cycle and no others.
    pub(super) fn missed(&self, problem: &Problem, retained: &[RowId], proposed: &Evaluation, all: bool) -> Vec<RowId> {
        const VIOLATED: f64 = 1e-7;
        // Without a cut-off each constraint has retained rows.
        if !self.repeats || (self.cutoff.is_none() && !all) {
            return vec![];
        }
        let is_missed = |row: &RowId| {
            let constraint = &problem.constraints[row.constraint];
            let is_known = |other: &RowId| if all { other == row } else { other.constraint == row.constraint };
            !constraint.is_continuous && proposed.residual_of(*row) > VIOLATED && !retained.iter().any(is_known)
        };
        self.retain(problem, proposed).into_iter().filter(is_missed).collect()
    }

    /// The retained points of one history.
    fn points(&self, g: &[f64], selection: Selection) -> Vec<usize> {
        let critical = |p: &usize| self.is_critical(g[*p]);
        match selection {
            Selection::All => (0..g.len()).filter(critical).collect(),
            Selection::NearMaxima(neighbours) => {
                let around = |p: usize| p.saturating_sub(neighbours)..=(p + neighbours).min(g.len() - 1);
                let near = maxima(g).into_iter().filter(critical).flat_map(around);
                near.filter(critical).collect::<BTreeSet<_>>().into_iter().collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(g: &[f64], cutoff: f64, neighbours: usize) -> Vec<usize> {
        Screening { cutoff: Some(cutoff), ..Default::default() }.points(g, Selection::NearMaxima(neighbours))
    }

    #[test]
    fn retains_neighbours_of_maxima_above_the_cutoff() {
        let g = [0.0, 0.2, 0.75, 0.9, 0.8, 0.6, 0.65, 0.6, 0.1];
        assert_eq!(points(&g, 0.7, 2), [2, 3, 4]);
        assert_eq!(points(&g, 0.7, 0), [3]);
        assert_eq!(points(&g, 0.5, 1), [2, 3, 4, 5, 6, 7]);
    }

    #[test]
    fn ends_count_whenever_they_are_above_the_cutoff() {
        assert_eq!(points(&[0.8, 0.9, 0.2, 0.8, 0.75], 0.7, 0), [0, 1, 3, 4]);
        assert_eq!(points(&[0.9], 0.7, 2), [0]);
    }

    #[test]
    fn a_plateau_counts_once_and_without_cutoff_all_maxima_stay() {
        assert_eq!(points(&[0.0, 0.9, 0.9, 0.0], 0.7, 0), [1]);
        let all = Screening::all();
        assert_eq!(all.points(&[-5.0, 0.2], Selection::All), [0, 1]);
    }
}
