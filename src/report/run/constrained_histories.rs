//! Constrained quantities over time in their own units, from normalized constraints ĝ ≤ 1.
//!
//! The two sides of a quantity are combined, the sign is restored if the quantity is a response, and the bound of a peak is
//! added again.

use super::OptimizationReport;
use crate::problem::{Constraint, RowId};
use crate::report::plots::{Side, TimeBound};

/// A constrained quantity over time.
pub(super) struct ConstrainedHistory {
    pub name: String,
    pub unit: String,
    pub grid: usize,
    /// Time points at which it is constrained.
    pub points: std::ops::Range<usize>,
    /// Values at these time points, for the first and the last design.
    pub first: Vec<f64>,
    pub last: Vec<f64>,
    pub bounds: Vec<TimeBound>,
    /// Retained and active time points of the last cycle.
    pub retained: Vec<usize>,
    pub active: Vec<usize>,
    /// Largest ĝ at the last design.
    pub largest: f64,
    /// Index of the response, if the quantity is one.
    pub response: Option<usize>,
    pub remark: &'static str,
}

impl OptimizationReport<'_> {
    /// All constrained histories, in the order of the constraints.
    pub(super) fn constrained_histories(&self) -> Vec<ConstrainedHistory> {
        let constraints = &self.problem.constraints;
        let (mut all, mut j) = (vec![], 0);
        while j < constraints.len() {
            let pair = constraints.get(j + 1).filter(|next| is_pair(&constraints[j], next)).is_some();
            if constraints[j].quantity.is_transient() {
                all.push(self.constrained_history(j, pair));
            }
            j += if pair { 2 } else { 1 };
        }
        all
    }

    fn constrained_history(&self, j: usize, pair: bool) -> ConstrainedHistory {
        let (constraint, grid) =
            (&self.problem.constraints[j], self.problem.constraints[j].quantity.grid().unwrap_or(0));
        let stem = constraint.name.strip_suffix(" upper").filter(|_| pair).unwrap_or(&constraint.name);
        let peak =
            self.problem.variables.iter().position(|v| pair && v.name == stem && stem == self.problem.objective_name);
        let points = self.window(j);
        let beta = |design: &[f64]| peak.map_or(0.0, |k| design[k]);
        let of = |ĝ: &[f64], design: &[f64]| -> Vec<f64> {
            ĝ[points.clone()].iter().map(|g| constraint.limit + constraint.scale * (g - 1.0) + beta(design)).collect()
        };
        let mut first = of(&self.first.1.constraints[j], self.start());
        let mut last = of(&self.state.evaluation.constraints[j], &self.state.design);
        let mut bounds =
            bounds(constraint, pair.then(|| &self.problem.constraints[j + 1]), peak.map(|k| self.state.design[k]));
        let response = self.response_like(constraint.quantity.responses(), &points, &last);
        if let Some((_, true)) = response {
            [&mut first, &mut last].into_iter().flatten().for_each(|v| *v = -*v);
            bounds.iter_mut().for_each(|bound| *bound = mirrored(*bound));
        }
        let both = j..j + 1 + usize::from(pair);
        let (retained, active) = self.marked(both.clone(), &points);
        let largest = both.map(|j| self.largest(&self.state.evaluation, j).1).fold(f64::NEG_INFINITY, f64::max);
        let response = response.map(|(h, _)| h);
        let unit = match (response, peak) {
            (Some(h), _) => self.problem.responses[h].unit.clone(),
            (None, Some(k)) => self.problem.variables[k].unit.clone(),
            _ => String::new(),
        };
        let remark = if peak.is_some() { ", bounded by the objective" } else { "" };
        let name = match (response, peak) {
            (Some(h), Some(_)) => self.problem.responses[h].name.clone(),
            _ => stem.to_owned(),
        };
        ConstrainedHistory {
            name,
            unit,
            grid,
            points,
            first,
            last,
            bounds,
            retained,
            active,
            largest,
            response,
            remark,
        }
    }

    /// Time points of the interval of the constraint; outside, ĝ is zero.
    fn window(&self, j: usize) -> std::ops::Range<usize> {
        const LEAST: usize = 3;
        let (first, last) = (&self.first.1.constraints[j], &self.state.evaluation.constraints[j]);
        let outside = |p: &usize| first[*p].abs() < 1e-9 && last[*p].abs() < 1e-9;
        let n = last.len();
        let (before, after) = ((0..n).take_while(outside).count(), (0..n).rev().take_while(outside).count());
        let begin = if before >= LEAST && before < n { before } else { 0 };
        let end = if after >= LEAST && after < n { n - after } else { n };
        begin..end
    }

    /// The response that equals a history, or its negative, with whether it is the negative.
    fn response_like(&self, among: &[usize], points: &std::ops::Range<usize>, values: &[f64]) -> Option<(usize, bool)> {
        let same = |h: usize, sign: f64| {
            let response = self.state.responses.values.get(h).filter(|r| r.len() >= points.end);
            let size = values.iter().fold(0.0f64, |a, v| a.max(v.abs()));
            response
                .is_some_and(|r| r[points.clone()].iter().zip(values).all(|(r, v)| (sign * r - v).abs() <= 1e-7 * size))
        };
        among.iter().find_map(|&h| [1.0, -1.0].into_iter().find(|sign| same(h, *sign)).map(|sign| (h, sign < 0.0)))
    }

    fn marked(&self, constraints: std::ops::Range<usize>, points: &std::ops::Range<usize>) -> (Vec<usize>, Vec<usize>) {
        let Some(cycle) = self.last() else { return (vec![], vec![]) };
        let inside = |row: &RowId| constraints.contains(&row.constraint) && points.contains(&row.point);
        let index = |row: &RowId| row.point - points.start;
        let retained = cycle.kept.iter().filter(|row| inside(row)).map(index).collect();
        (retained, cycle.active.iter().map(|a| &a.row).filter(|row| inside(row)).map(index).collect())
    }
}

/// Whether two constraints are the upper and lower side of one quantity.
fn is_pair(upper: &Constraint, lower: &Constraint) -> bool {
    let stems = (upper.name.strip_suffix(" upper"), lower.name.strip_suffix(" lower"));
    matches!(stems, (Some(a), Some(b)) if a == b) && upper.quantity.responses() == lower.quantity.responses()
}

fn bounds(constraint: &Constraint, lower: Option<&Constraint>, peak: Option<f64>) -> Vec<TimeBound> {
    let below = |value: f64| TimeBound { value, side: Side::Below };
    let above = |value: f64| TimeBound { value, side: Side::Above };
    match (peak, lower) {
        (Some(peak), _) => vec![below(peak), above(-peak)],
        (None, Some(lower)) => vec![below(constraint.limit), above(-lower.limit)],
        (None, None) if constraint.is_equality => vec![below(constraint.limit), above(constraint.limit)],
        (None, None) => vec![below(constraint.limit)],
    }
}

fn mirrored(bound: TimeBound) -> TimeBound {
    let side = match bound.side {
        Side::Below => Side::Above,
        Side::Above => Side::Below,
    };
    TimeBound { value: -bound.value, side }
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
        let state = Method::default().solve(&problem, |_| ()).unwrap();
        let run = OptimizationReport::new("absorber", &problem, &state).unwrap();
        let histories = run.constrained_histories();
        let of = |name: &str| histories.iter().find(|w| w.name == name).unwrap_or_else(|| panic!("no {name}"));
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        for (name, limit) in [("acceleration", state.evaluation.objective), ("displacement", 1.0)] {
            let (w, h) = (of(name), problem.responses.iter().position(|r| r.name == name).unwrap());
            assert_eq!((w.response, &w.unit), (Some(h), &problem.responses[h].unit));
            assert!(w.last.iter().zip(&state.responses.values[h]).all(|(a, b)| close(*a, *b)), "{name}");
            assert!(w.first.iter().zip(&run.first.0.values[h]).all(|(a, b)| close(*a, *b)), "{name}");
            assert!(close(w.bounds[0].value, limit) && w.bounds[0].side == Side::Below, "{:?}", w.bounds);
            assert!(close(w.bounds[1].value, -limit) && w.bounds[1].side == Side::Above, "{:?}", w.bounds);
            assert!(!w.active.is_empty() && w.active.iter().all(|p| close(w.last[*p].abs(), limit)), "{name}");
        }
    }
}
