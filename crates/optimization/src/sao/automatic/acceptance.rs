//! Acceptance of a proposed design by a filter, and the box of the next cycle.

use super::lengths::Units;

/// Violation in units of the rows up to which a design counts as feasible.
const FEASIBLE: f64 = 1e-6;
/// Least relative decrease of the violation.
const MARGIN: f64 = 0.999;
/// Slope of the envelope of the filter: decrease of the objective, per σ_f h, below which an entry with less violation dominates a design.
const ENVELOPE: f64 = 1e-5;
/// Largest violation of an accepted design, in units of the rows or of the violation before it. A row changes by about one unit over the
/// lengths. Without this limit, a first step could be arbitrarily long where rows are far from their limits.
pub(super) const MAX_VIOLATION: f64 = 10.0;
/// Fraction of the predicted decrease that must be reached.
const FRACTION: f64 = 0.01;
/// Largest increase of the objective, per σ_f h, that is accepted for a smaller violation at a design that is feasible already.
const MAX_TRADE_OFF: f64 = 10.0;
/// Decrease of the objective, relative to its range in the run, that is sufficient for any predicted decrease.
const SUFFICIENT: f64 = 0.1;
/// Fraction of the possible decrease of the violation that a restoration must reach.
const RESTORED: f64 = 0.05;
/// Largest increase of objective and violation together, weighted by the multipliers, in predicted decreases, for which more violation is
/// accepted.
const WORSE: f64 = 1.0;
/// Rounding error of the objective, relative to itself.
const ROUNDING: f64 = 1e-13;

/// Objective and violation of a design, in the units of the current cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DesignMerit {
    pub objective: f64,
    pub violation: f64,
}

impl DesignMerit {
    pub fn new(objective: f64, violations: &[f64], units: &Units) -> Self {
        Self { objective, violation: units.violation(violations) }
    }
}

/// Comparison of a trial step with the current design and with its prediction, in the units of the current cycle.
pub(super) struct AcceptanceTest {
    pub from: DesignMerit,
    pub predicted: DesignMerit,
    pub to: DesignMerit,
    /// The least violation of the linearized rows, if they are incompatible.
    pub restoration: Option<f64>,
    /// σ_f, see [`Units::objective_per_violation`].
    pub objective_per_violation: f64,
    /// Range of the objective over the accepted designs.
    pub objective_range: f64,
}

/// The decision on a trial step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Decision {
    Rejected,
    /// Accepted for the decrease of the objective.
    Decrease,
    /// Accepted for the violation: the design before it enters the filter.
    Violation,
}

impl AcceptanceTest {
    /// The decision; `filter` holds the designs of the filter, in the units of the current cycle.
    pub fn decide(&self, filter: impl Iterator<Item = DesignMerit>) -> Decision {
        let Self { from, to, predicted, .. } = self;
        let (h, next) = (from.violation, to.violation);
        let noise = ROUNDING * from.objective.abs();
        let trades_off_too_much =
            h <= FEASIBLE && to.objective > from.objective + MAX_TRADE_OFF * self.objective_per_violation * h + noise;
        if let Some(least) = self.restoration {
            let decreases = h - next >= RESTORED * (h - least) && next < h && !trades_off_too_much;
            return if decreases { Decision::Violation } else { Decision::Rejected };
        }
        if next > MAX_VIOLATION * h.max(1.0) || (next > h && self.ratio() < -WORSE) {
            return Decision::Rejected;
        }
        let envelope = ENVELOPE * self.objective_per_violation * next;
        let dominates = |e: DesignMerit| next > MARGIN * e.violation && to.objective > e.objective - envelope;
        let improves = (next <= MARGIN * h && !trades_off_too_much)
            || to.objective <= from.objective - envelope
            || (next <= FEASIBLE && to.objective <= from.objective + noise);
        if filter.into_iter().any(dominates) || !improves {
            return Decision::Rejected;
        }
        let decrease = from.objective - predicted.objective;
        if decrease <= (1e-4 * self.objective_per_violation * h * h).max(0.0) {
            return Decision::Violation;
        }
        let sufficient =
            (FRACTION * decrease).min(if next <= FEASIBLE { SUFFICIENT * self.objective_range } else { decrease });
        if from.objective - to.objective >= sufficient - noise {
            return Decision::Decrease;
        }
        if h > FEASIBLE && next <= 0.5 * h { Decision::Violation } else { Decision::Rejected }
    }

    /// ρ, the ratio of actual to predicted improvement.
    pub fn ratio(&self) -> f64 {
        let Self { from, to, predicted, .. } = self;
        match self.restoration {
            Some(least) => (from.violation - to.violation) / (from.violation - least),
            None => {
                let total = |m: &DesignMerit| m.objective + self.objective_per_violation * m.violation;
                (total(from) - total(to)) / (total(from) - total(predicted))
            }
        }
    }
}

/// The half widths w after an accepted step s with the ratio ρ.
pub(super) fn widths_after_acceptance(widths: &mut [f64], step: &[f64], at_limit: &[bool], ratio: f64) {
    let largest = largest_fraction(widths, step);
    if ratio > 0.75 {
        let growth = match (1.0 - ratio).abs() {
            off if off < 0.01 => 10.0,
            off if off < 0.1 => 4.0,
            _ => 2.0,
        };
        widths.iter_mut().zip(at_limit).filter(|(_, at)| **at).for_each(|(w, _)| *w *= growth);
    } else if !(ratio >= 0.25) {
        widths.iter_mut().for_each(|w| *w *= (0.5 * largest).max(0.1));
    }
    let share = if ratio <= 0.5 || ratio.is_nan() { 0.25 } else { 1.0 };
    widths.iter_mut().zip(step).for_each(|(w, s)| *w = w.max(share * s.abs()));
}

/// The half widths after a rejected step: half the step at the first rejection in a row, a quarter at later ones or if the analysis failed.
pub(super) fn widths_after_rejection(widths: &mut [f64], step: &[f64], is_first: bool) {
    let factor = largest_fraction(widths, step) * if is_first { 0.5 } else { 0.25 };
    widths.iter_mut().for_each(|w| *w *= factor);
}

/// max |sⱼ| / wⱼ, at most 1.
fn largest_fraction(widths: &[f64], step: &[f64]) -> f64 {
    widths.iter().zip(step).map(|(w, s)| s.abs() / w).fold(0.0, f64::max).min(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn merit(objective: f64, violation: f64) -> DesignMerit {
        DesignMerit { objective, violation }
    }

    fn step(from: DesignMerit, predicted: DesignMerit, to: DesignMerit) -> AcceptanceTest {
        AcceptanceTest { from, predicted, to, restoration: None, objective_per_violation: 1.0, objective_range: 1.0 }
    }

    #[test]
    fn a_step_for_the_violation_enters_the_filter_and_is_not_repeated() {
        let away = step(merit(1.0, 0.2), merit(3.0, 0.0), merit(3.0, 0.0));
        assert_eq!(away.decide(std::iter::empty()), Decision::Violation);
        let back = step(merit(3.0, 0.0), merit(1.0, 0.0), merit(1.0, 0.2));
        assert_eq!(back.decide([merit(1.0, 0.2)].into_iter()), Decision::Rejected);
    }

    #[test]
    fn a_restoration_must_reach_a_part_of_the_possible_decrease() {
        let of = |next: f64| {
            let step = step(merit(1.0, 1.0), merit(1.0, 0.5), merit(1.0, next));
            AcceptanceTest { restoration: Some(0.5), ..step }.decide(std::iter::empty())
        };
        assert_eq!((of(0.9), of(0.99)), (Decision::Violation, Decision::Rejected));
    }

    /// A violation of the size of rounding errors is no reason for a much larger objective.
    #[test]
    fn a_restoration_of_a_feasible_design_does_not_increase_the_objective() {
        let of = |objective: f64| {
            let step = step(merit(1.0, 1e-11), merit(1.0, 0.0), merit(objective, 1e-12));
            AcceptanceTest { restoration: Some(0.0), ..step }.decide(std::iter::empty())
        };
        assert_eq!((of(1.0), of(1600.0)), (Decision::Violation, Decision::Rejected));
    }

    #[test]
    fn limits_grow_with_the_quality_of_the_prediction() {
        let mut widths = vec![1.0, 1.0];
        widths_after_acceptance(&mut widths, &[1.0, 0.2], &[true, false], 1.0);
        assert_eq!(widths, [10.0, 1.0]);
        widths_after_rejection(&mut widths, &[5.0, 0.1], true);
        assert_eq!(widths, [2.5, 0.25]);
    }
}
