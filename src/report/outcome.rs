//! Objective and constraints in the terms in which they are stated: with their own sign, side, limit and unit.
//!
//! Evaluations and histories contain what the driver works with: the negative of a maximized objective, the variable β that bounds a
//! peak, and normalized constraints ĝ. The functions here convert them back.

use super::number::{counted, without_rounding};
use crate::Result;
use crate::problem::{Evaluation, Goal, Problem, RowId, Side, TimeGrid};
use crate::sao::{Cycle, RunState};

/// Excess over the limit, relative to size or scale, up to which a constraint counts as satisfied.
const SATISFIED: f64 = 1e-5;
/// Distance from the limit, relative to the size, up to which a constraint counts as active.
const ACTIVE: f64 = 1e-3;
/// Fraction of the range of the objective, and of the scale of a constraint, by which one design must be better than another.
const BETTER: f64 = 1e-4;
/// The least unit in which objectives of different runs are compared, as a fraction of their distance from the objective at the start: the best
/// objective may be zero.
pub const OF_DECREASE: f64 = 1e-6;

/// The objective at a design: for a maximized objective with the sign of the statement, for a min–max objective the largest |f| over the time points.
///
/// `evaluation` is that of `design`.
pub fn objective(problem: &Problem, design: &[f64], evaluation: &Evaluation) -> f64 {
    problem.peak_objective(design, evaluation).unwrap_or_else(|| stated(problem, evaluation.objective))
}

/// The row of the peak of a min–max objective: the side and the time point of the largest |f|, or of the largest f where only one side is
/// bounded; `None` for other objectives.
pub fn peak_row(problem: &Problem, design: &[f64], evaluation: &Evaluation) -> Option<RowId> {
    let rows = peak_constraints(problem).flat_map(|constraint| {
        let sign = problem.constraints[constraint].sign();
        let values = values(problem, constraint, design, evaluation).into_iter().enumerate();
        values.filter_map(move |(point, value)| Some((RowId { constraint, point }, sign * value?)))
    });
    rows.reduce(|best, next| if next.1 > best.1 { next } else { best }).map(|(row, _)| row)
}

/// The objective of trial step `k` of a run's history.
///
/// For a min–max objective it is the largest |f| at the design. A history of an earlier version does not contain it: there it is the
/// largest among the rows that the history contains, and the start design is analysed again if it has none of them.
///
/// # Errors
/// Those of [`Problem::analyze_design`].
pub fn objective_of_step(problem: &Problem, state: &RunState, k: usize) -> Result<f64> {
    let cycle = &state.history[k];
    if let Some(peak) = cycle.peak {
        return Ok(peak);
    }
    match of_rows(problem, cycle) {
        Some(value) => Ok(value),
        None if k == 0 && state.history.len() == 1 => Ok(objective(problem, &state.design, &state.evaluation)),
        None if k == 0 => {
            let start = problem.analyze_design(&cycle.design)?;
            Ok(objective(problem, &start.design, &start.evaluation))
        }
        None => Ok(cycle.objective),
    }
}

/// The failed trial steps of a run that has not converged, with the reason of the last one.
pub fn failed_steps(state: &RunState) -> Option<String> {
    let failures = || state.history.iter().filter_map(|cycle| Some((cycle.cycle, cycle.failure.as_ref()?)));
    let (cycle, reason) = failures().next_back().filter(|_| !state.status.is_success())?;
    let count = counted(failures().count(), ["trial step", "trial steps"]);
    Some(format!("the analysis of {count} failed; of the last one, in cycle {cycle}: {reason}"))
}

/// The trial step with a better design than the last one, by more than 1e-4 and satisfying the constraints, with its objective; see [`RunState::better_than_last`].
pub fn better_than_last<'s>(problem: &Problem, state: &'s RunState) -> Option<(&'s Cycle, f64)> {
    let better = state.better_than_last(SATISFIED, BETTER)?;
    let k = state.history.iter().position(|cycle| std::ptr::eq(cycle, better))?;
    Some((better, objective_of_step(problem, state, k).unwrap_or(better.objective)))
}

/// The objective of each trial step of a run, in the order of its history.
///
/// # Errors
/// As [`objective_of_step`].
pub fn objectives(problem: &Problem, state: &RunState) -> Result<Vec<f64>> {
    (0..state.history.len()).map(|k| objective_of_step(problem, state, k)).collect()
}

/// The objective that the approximate problem of a cycle predicts at its solution, of a min–max objective the largest predicted |f|;
/// `None` for the start.
pub fn predicted_objective(problem: &Problem, cycle: &Cycle) -> Option<f64> {
    let prediction = cycle.prediction.as_ref()?;
    let Some(peak) = problem.objective.peak() else { return Some(stated(problem, prediction.objective)) };
    let rows = cycle.retained.iter().copied().zip(prediction.rows.iter().copied());
    let bound = prediction.bound.unwrap_or(cycle.design[peak.variable]);
    largest(problem, bound, rows).or(Some(prediction.objective))
}

/// The largest |f| among known rows of a trial step; for other objectives the objective. `None` if no row is known.
fn of_rows(problem: &Problem, cycle: &Cycle) -> Option<f64> {
    let Some(peak) = problem.objective.peak() else { return Some(stated(problem, cycle.objective)) };
    if cycle.failure.is_some() {
        return Some(cycle.objective);
    }
    let analysed = cycle.prediction.as_ref().map_or(&[][..], |p| &p.analysed).iter().copied();
    let retained = cycle.retained.iter().copied().zip(analysed);
    let worst = cycle.worst.map(|row| (row, 1.0 + cycle.violation_pct / 100.0));
    // The worst row is that of the largest violation; the peak is known if the worst row belongs to it.
    let is_known = cycle.cycle > 0 || worst.is_some_and(|(row, _)| is_of_peak(problem, row.constraint));
    largest(problem, cycle.design[peak.variable], retained.chain(worst)).filter(|_| is_known)
}

/// The largest |f| = β + σ (ĝ − 1) among rows of the two constraints of a peak; `bound` is β.
fn largest(problem: &Problem, bound: f64, rows: impl Iterator<Item = (RowId, f64)>) -> Option<f64> {
    let of_peak = rows.filter(|(row, _)| is_of_peak(problem, row.constraint));
    let value = |(row, g): (RowId, f64)| bound + problem.constraints[row.constraint].scale * (g - 1.0);
    of_peak.map(value).reduce(f64::max)
}

/// The largest violation of a trial step in percent, negative where no constraint is active; `None` for a problem without constraints.
pub fn violation(problem: &Problem, cycle: &Cycle) -> Option<f64> {
    (!problem.constraints.is_empty()).then_some(cycle.violation_pct)
}

/// An objective of the driver with the sign of the statement.
pub fn stated(problem: &Problem, objective: f64) -> f64 {
    if problem.objective.goal == Goal::Maximize { -objective } else { objective }
}

/// The direction of the objective in words: `minimized` or `maximized`.
pub fn goal(problem: &Problem) -> &'static str {
    if problem.objective.goal == Goal::Maximize { "maximized" } else { "minimized" }
}

/// A constraint at the time point at which it is violated most, or has its smallest margin.
#[derive(Clone, Debug, PartialEq)]
pub struct ConstraintValue {
    /// Name; both sides of a two-sided constraint have the same.
    pub name: String,
    /// Unit; empty for a formula of several responses.
    pub unit: String,
    /// The side of the limit.
    pub side: Side,
    /// The limit, in the unit.
    pub limit: f64,
    /// The constrained quantity, in the unit.
    pub value: f64,
    /// Distance of the value from the limit in the unit: positive inside the feasible region, and −|value − limit| for an equality.
    pub margin: f64,
    /// The larger of |limit| and the largest |value| over the time points: what a distance is compared with.
    pub size: f64,
    /// Excess over the limit up to which it counts as satisfied: 1e-5 of the size, or of the scale of the constraint if that is larger.
    pub tolerance: f64,
    /// Constraint and time point.
    pub row: RowId,
    /// The time, if the quantity changes with time; in continuous time that of the peak.
    pub time: Option<f64>,
    /// The time in words, with its unit: `time 1.08 s`.
    pub time_in_words: Option<String>,
}

impl ConstraintValue {
    /// `violated`, `active` or `satisfied`. Whether it is active does not depend on the scale of the constraint, unless limit and value are
    /// zero: a distance up to which it counts as satisfied is none.
    pub fn status(&self) -> &'static str {
        match self.margin {
            m if m < -self.tolerance => "violated",
            m if m <= (ACTIVE * self.size).max(self.tolerance) => "active",
            _ => "satisfied",
        }
    }

    /// The value; zero in place of a rounding error.
    pub fn shown(&self) -> f64 {
        without_rounding(self.value, self.size)
    }

    /// The side as a sign: ≤, ≥ or =.
    pub fn relation(&self) -> &'static str {
        match self.side {
            Side::AtMost => "≤",
            Side::AtLeast => "≥",
            Side::Equal => "=",
        }
    }
}

/// The constraints of a problem at a design, without those that bound the peak of the objective.
///
/// Only time points at which a constraint holds count. `evaluation` is that of `design`.
pub fn constraints(problem: &Problem, design: &[f64], evaluation: &Evaluation) -> Vec<ConstraintValue> {
    stated_constraints(problem).map(|j| constraint(problem, j, design, evaluation)).collect()
}

/// Indices of the constraints without those that bound the peak of the objective.
pub fn stated_constraints(problem: &Problem) -> impl Iterator<Item = usize> {
    (0..problem.constraints.len()).filter(|&j| !is_of_peak(problem, j))
}

/// Indices of the constraints f ≤ β and f ≥ −β of a min–max objective; there may be several f.
pub fn peak_constraints(problem: &Problem) -> impl Iterator<Item = usize> {
    (0..problem.constraints.len()).filter(|&j| is_of_peak(problem, j))
}

/// True for the constraints f ≤ β and f ≥ −β of a min–max objective.
pub fn is_of_peak(problem: &Problem, j: usize) -> bool {
    problem.bounds_peak(j)
}

fn constraint(problem: &Problem, j: usize, design: &[f64], evaluation: &Evaluation) -> ConstraintValue {
    let constraint = &problem.constraints[j];
    let limit = limit(problem, j, design);
    let values = values(problem, j, design, evaluation);
    let margin = |value: f64| match constraint.side {
        Side::AtMost => limit - value,
        Side::AtLeast => value - limit,
        Side::Equal => -(value - limit).abs(),
    };
    let held = values.iter().enumerate().filter_map(|(p, value)| Some((p, (*value)?)));
    let first = |best: (usize, f64), next: (usize, f64)| if margin(next.1) < margin(best.1) { next } else { best };
    let (point, value) = held.clone().reduce(first).unwrap_or((0, f64::NAN));
    let row = RowId { constraint: j, point };
    let time = time_of(problem, evaluation, row);
    let size = held.fold(limit.abs(), |size, (_, value)| size.max(value.abs()));
    ConstraintValue {
        tolerance: SATISFIED * size.max(constraint.scale),
        name: name(problem, j).to_owned(),
        unit: unit(problem, j).to_owned(),
        side: constraint.side,
        limit,
        value,
        margin: margin(value),
        size,
        row,
        time: time.map(|(grid, time)| grid.shown(time)),
        time_in_words: time.map(|(grid, time)| grid.in_words(time)),
    }
}

/// The time of a row with its grid: that of a local maximum in continuous time, or of a time point. `None` unless the quantity changes
/// with time.
pub fn time_of<'p>(problem: &'p Problem, evaluation: &Evaluation, row: RowId) -> Option<(&'p TimeGrid, f64)> {
    let quantity = &problem.constraints[row.constraint].quantity;
    let grid = &problem.grids[quantity.grid().filter(|_| quantity.is_transient())?];
    Some((grid, evaluation.peak_of(row).map_or(grid.points[row.point], |peak| peak.time)))
}

/// The limit of a constraint at a design, in its unit, with the variable that widens it.
pub fn limit(problem: &Problem, j: usize, design: &[f64]) -> f64 {
    let constraint = &problem.constraints[j];
    constraint.limit + constraint.sign() * constraint.bound.map_or(0.0, |k| design[k])
}

/// The constrained quantity in its unit, at each time point at which the constraint holds; `None` at the others.
pub fn values(problem: &Problem, j: usize, design: &[f64], evaluation: &Evaluation) -> Vec<Option<f64>> {
    let constraint = &problem.constraints[j];
    let beta = constraint.bound.map_or(0.0, |k| design[k]);
    let value = |c: f64| constraint.sign() * (constraint.signed_limit() + constraint.scale * c + beta);
    let rows = evaluation.residuals[j].iter().enumerate();
    rows.map(|(p, c)| problem.holds(j, p).then(|| value(*c))).collect()
}

/// The name of a constraint as stated: that of the pair for a side of a two-sided one.
pub fn name(problem: &Problem, j: usize) -> &str {
    let constraint = &problem.constraints[j];
    constraint.pair.as_ref().unwrap_or(&constraint.name)
}

/// The unit of a constrained quantity: of the response that it is, of the variable that bounds it, or its own.
pub fn unit(problem: &Problem, j: usize) -> &str {
    let constraint = &problem.constraints[j];
    let response = constraint.quantity.as_response().map(|h| problem.responses[h].unit.as_str());
    let of_bound = || constraint.bound.map(|k| problem.variables[k].unit.as_str());
    response.or_else(of_bound).unwrap_or(&constraint.unit)
}

/// The bound of a design variable that a value has reached, in words.
pub fn at_bound(problem: &Problem, k: usize, value: f64) -> Option<&'static str> {
    let variable = &problem.variables[k];
    // At a bound of zero, the value is compared with the range or the start of the variable.
    let sizes = [variable.upper - variable.lower, variable.start.abs()].into_iter();
    let size = sizes.filter(|size| size.is_finite() && *size > 0.0).fold(f64::INFINITY, f64::min);
    let rounding = if size.is_finite() { 1e-12 * size } else { f64::MIN_POSITIVE };
    let is_at =
        |bound: f64| bound.is_finite() && (value - bound).abs() <= (1e-6 * value.abs().max(bound.abs())).max(rounding);
    match () {
        () if is_at(variable.lower) => Some("at its lower bound"),
        () if is_at(variable.upper) => Some("at its upper bound"),
        () => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cases::impact_absorber;
    use crate::problem::{ClosedForm, Constraint, DesignVariable, ProblemBuilder, Quantity};
    use crate::sao::Method;
    use autodiff::Scalar;

    /// f = b t.
    struct Line;

    impl ClosedForm for Line {
        fn response<S: Scalar>(&self, _: usize, b: &[S], t: S) -> S {
            b[0] * t
        }
    }

    fn builder() -> (ProblemBuilder, Quantity) {
        let mut parts = ProblemBuilder::new("line");
        parts.variable(DesignVariable::new("b", "", 2.0).within(1.0, 3.0));
        let grid = parts.grid(TimeGrid::uniform(0.0, 1.0, 11).unwrap());
        let f = parts.transient("f", "m", grid);
        (parts, Quantity::response(grid, f))
    }

    /// The peak of |f| is 2 whatever the guess, the scale and the violation of other constraints are.
    #[test]
    fn the_objective_is_the_peak_and_not_its_bound() {
        for (guess, scale, limit) in [(50.0, 1.0, 10.0), (0.1, 1.0, 10.0), (50.0, 100.0, -1000.0)] {
            let (mut parts, f) = builder();
            parts.minimize_peak(DesignVariable::new("peak", "m", guess).within(0.0, 1e3), f.clone(), scale);
            parts.subject_to(Constraint::at_most("other", limit, f));
            let problem = parts.build_analytic(Line).unwrap();
            let state = Method::slp().start(&problem).unwrap();
            assert!((objective(&problem, &state.design, &state.evaluation) - 2.0).abs() < 1e-12);
            assert!((objectives(&problem, &state).unwrap()[0] - 2.0).abs() < 1e-12);
            let named: Vec<_> = constraints(&problem, &state.design, &state.evaluation);
            assert_eq!(named.len(), 1);
        }
    }

    #[test]
    fn the_peaks_of_all_accepted_designs_are_those_of_their_responses() {
        let problem = impact_absorber::peak_acceleration().unwrap();
        let mut seen = vec![];
        let state = Method::slp().solve(&problem, |state| seen.push(state.clone())).unwrap();
        let found = objectives(&problem, &state).unwrap();
        for state in seen {
            let k = state.history.len() - 1;
            if state.history[k].accepted {
                let peak = state.responses.values[1].iter().fold(0.0f64, |largest, a| largest.max(a.abs()));
                assert!((found[k] - peak).abs() < 1e-9 * peak, "{k}: {} and {peak}", found[k]);
            }
        }
    }

    #[test]
    fn a_maximum_keeps_its_sign() {
        let (mut parts, _) = builder();
        parts.maximize("b", "m", Quantity::variable(0));
        let problem = parts.build_analytic(Line).unwrap();
        let state = Method::slp().solve(&problem, |_| ()).unwrap();
        assert_eq!(objective(&problem, &state.design, &state.evaluation), 3.0);
        assert_eq!(objectives(&problem, &state).unwrap().last(), Some(&3.0));
        assert_eq!((goal(&problem), at_bound(&problem, 0, 3.0)), ("maximized", Some("at its upper bound")));
    }

    /// Rounding errors of steps of the size of the range or of the start.
    #[test]
    fn a_bound_of_zero_is_reached_up_to_rounding() {
        for (start, upper) in [(2.0, 3.0), (2.0, f64::INFINITY), (0.0, 1e6)] {
            let mut parts = ProblemBuilder::new("zero");
            parts.variable(DesignVariable::new("b", "", start).within(0.0, upper));
            parts.minimize("b", "", Quantity::variable(0));
            let problem = parts.build_analytic(Line).unwrap();
            assert_eq!(at_bound(&problem, 0, 1.4e-17), Some("at its lower bound"));
            assert_eq!(at_bound(&problem, 0, 0.0), Some("at its lower bound"));
            assert_eq!(at_bound(&problem, 0, 1e-2), None);
        }
    }

    /// 0.2 ≤ t: outside, the stored zeros are larger than all normalized values inside, and do not count.
    #[test]
    fn time_points_outside_the_window_do_not_count() {
        let (mut parts, f) = builder();
        parts.minimize("b", "m", Quantity::variable(0));
        parts.subject_to(Constraint::at_most("low", 1.0, f.clone()).scaled_by(0.01).during(0.0, 0.2));
        parts.subject_to(Constraint::at_least("high", -3.0, f).scaled_by(1e4).during(0.7, 0.8));
        let problem = parts.build_analytic(Line).unwrap();
        let here = problem.analyze_design(&[2.0]).unwrap();
        let found = constraints(&problem, &here.design, &here.evaluation);
        let close = |a: f64, b: f64| (a - b).abs() < 1e-9;
        assert!(close(found[0].value, 0.4) && close(found[0].margin, 0.6) && found[0].time == Some(0.2), "{found:?}");
        assert!(close(found[1].value, 1.4) && close(found[1].margin, 4.4), "{found:?}");
        assert_eq!((found[1].unit.as_str(), found[1].relation(), found[1].status()), ("m", "≥", "satisfied"));
        assert_eq!(values(&problem, 1, &[2.0], &here.evaluation).iter().flatten().count(), 2);
    }

    #[test]
    fn active_does_not_depend_on_the_scale() {
        for scale in [1e-4, 1.0, 1e4] {
            let (mut parts, f) = builder();
            parts.minimize("b", "m", Quantity::variable(0));
            parts.subject_to(Constraint::at_most("limit", 2.0, f.clone()).scaled_by(scale));
            parts.subject_to(Constraint::at_most("far", 3.0, f).scaled_by(scale));
            let problem = parts.build_analytic(Line).unwrap();
            let here = problem.analyze_design(&[2.0]).unwrap();
            let found = constraints(&problem, &here.design, &here.evaluation);
            assert_eq!([found[0].status(), found[1].status()], ["active", "satisfied"]);
        }
    }
}
