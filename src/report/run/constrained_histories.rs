//! Constrained quantities over time in their own units, from normalized constraints ĝ ≤ 1.
//!
//! The two sides of a quantity are combined in one history.

use super::OptimizationReport;
use crate::problem::{self, Evaluation, RowId};
use crate::report::outcome;
use crate::report::plots::{FeasibleSide, TimeBound};

/// A constrained quantity over time.
pub(super) struct ConstrainedHistory {
    pub name: String,
    pub unit: String,
    pub grid: usize,
    /// Indices of the time points at which it is constrained.
    pub points: std::ops::Range<usize>,
    /// Values at these time points, for the first and the last design.
    pub first: Vec<f64>,
    pub last: Vec<f64>,
    /// Values of the cycles that a reader can choose.
    pub cycles: Vec<Vec<f64>>,
    pub bounds: Vec<TimeBound>,
    /// Retained and active time points of the last cycle, as indices into `first` and `last`.
    pub retained: Vec<usize>,
    pub active: Vec<usize>,
    /// Largest normalized value ĝ at the last design.
    pub largest: f64,
    /// Index of the response, if the quantity is one.
    pub response: Option<usize>,
    pub remark: &'static str,
}

impl OptimizationReport<'_> {
    /// Constrained histories in the order of the constraints; both sides of one quantity are one history.
    pub(super) fn constrained_histories(&self) -> Vec<ConstrainedHistory> {
        let transient =
            (0..self.problem.constraints.len()).filter(|&j| self.problem.constraints[j].quantity.is_transient());
        let pairs = transient.map(|j| (j, self.problem.partner(j))).filter(|(j, other)| other.is_none_or(|k| *j < k));
        pairs.map(|(j, other)| self.constrained_history(j, other)).collect()
    }

    fn constrained_history(&self, j: usize, other: Option<usize>) -> ConstrainedHistory {
        let constraint = &self.problem.constraints[j];
        let points = self.window(j);
        let values = |evaluation: &Evaluation, design: &[f64]| -> Vec<f64> {
            let all = outcome::values(self.problem, j, design, evaluation);
            all[points.clone()].iter().map(|value| value.unwrap_or(f64::NAN)).collect()
        };
        let (retained, active) = self.marked(|k| k == j || Some(k) == other, &points);
        let sides = || std::iter::once(j).chain(other);
        let largest = |j: usize| {
            let g = self.state.evaluation.normalized(j);
            let held = (0..g.len()).filter(|&p| self.problem.holds(j, p));
            held.map(|p| g[p]).fold(f64::NEG_INFINITY, f64::max)
        };
        let peak = outcome::peak_constraints(self.problem).find(|k| *k == j);
        let response = constraint.quantity.as_response().map(|h| &self.problem.responses[h]);
        let unit = outcome::unit(self.problem, j).to_owned();
        let name = match (response, peak) {
            (Some(response), Some(_)) => &response.name,
            _ => constraint.pair.as_ref().filter(|_| other.is_some()).unwrap_or(&constraint.name),
        };
        ConstrainedHistory {
            name: name.clone(),
            unit,
            grid: constraint.quantity.grid().unwrap_or(0),
            first: values(&self.first.1, self.start()),
            last: values(&self.state.evaluation, &self.state.design),
            cycles: self.cycles.iter().map(|shown| values(&shown.evaluation, &shown.step.design)).collect(),
            bounds: sides().flat_map(|j| self.bounds(j)).collect(),
            retained,
            active,
            largest: sides().map(largest).fold(f64::NEG_INFINITY, f64::max),
            response: constraint.quantity.as_response(),
            remark: if peak.is_some() { ", bounded by the objective" } else { "" },
            points,
        }
    }

    /// Time points at which a constraint holds.
    fn window(&self, j: usize) -> std::ops::Range<usize> {
        let n = self.state.evaluation.residuals[j].len();
        let mut inside = (0..n).filter(|&p| self.problem.holds(j, p));
        let first = inside.next().unwrap_or(0);
        first..inside.next_back().unwrap_or(first) + 1
    }

    fn marked(&self, is_side: impl Fn(usize) -> bool, points: &std::ops::Range<usize>) -> (Vec<usize>, Vec<usize>) {
        let Some(cycle) = self.last() else { return (vec![], vec![]) };
        let inside = |row: &RowId| is_side(row.constraint) && points.contains(&row.point);
        let index = |row: &RowId| row.point - points.start;
        let retained = cycle.retained.iter().filter(|row| inside(row)).map(index).collect();
        (retained, cycle.active.iter().map(|a| &a.row).filter(|row| inside(row)).map(index).collect())
    }

    /// The limits of a constraint at the last design.
    fn bounds(&self, j: usize) -> Vec<TimeBound> {
        let constraint = &self.problem.constraints[j];
        let beta = constraint.bound.map_or(0.0, |k| self.state.design[k]);
        let below = TimeBound { value: constraint.limit + beta, side: FeasibleSide::Below };
        let above = TimeBound { value: constraint.limit - beta, side: FeasibleSide::Above };
        match constraint.side {
            problem::Side::AtMost => vec![below],
            problem::Side::AtLeast => vec![above],
            problem::Side::Equal => vec![below, above],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::impact_absorber;
    use crate::sao::Method;

    /// The absorber's acceleration is bounded by the objective from both sides, its displacement by one metre.
    #[test]
    fn normalized_constraints_become_the_constrained_quantities() {
        let problem = impact_absorber::peak_acceleration().unwrap();
        let state = Method::slp().solve(&problem, |_| ()).unwrap();
        let run = OptimizationReport::new("absorber", &problem, &state).unwrap();
        let histories = run.constrained_histories();
        let of = |name: &str| histories.iter().find(|w| w.name == name).unwrap_or_else(|| panic!("no {name}"));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        for (name, limit) in [("acceleration", state.evaluation.objective), ("displacement", 1.0)] {
            let (w, h) = (of(name), problem.responses.iter().position(|r| r.name == name).unwrap());
            assert_eq!((w.response, &w.unit), (Some(h), &problem.responses[h].unit));
            assert!(w.last.iter().zip(&state.responses.values[h]).all(|(a, b)| close(*a, *b)), "{name}");
            assert!(w.first.iter().zip(&run.first.0.values[h]).all(|(a, b)| close(*a, *b)), "{name}");
            assert!(close(w.bounds[0].value, limit) && w.bounds[0].side == FeasibleSide::Below, "{:?}", w.bounds);
            assert!(close(w.bounds[1].value, -limit) && w.bounds[1].side == FeasibleSide::Above, "{:?}", w.bounds);
            assert!(!w.active.is_empty() && w.active.iter().all(|p| close(w.last[*p].abs(), limit)), "{name}");
        }
    }
}
