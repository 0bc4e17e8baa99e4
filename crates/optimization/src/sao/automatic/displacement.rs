//! Displacements: steps in a generic direction, from points where derivatives show none.
//!
//! They are made from a stationary point of the violation, from a start at which the gradient of the objective is zero, and of variables on
//! which no function has depended so far. Their acceptance does not depend on a prediction.

use super::cycle_context::CycleContext;
use super::proposal::{Proposal, Purpose};
use super::tangent_space::NO_EFFECT;

/// Sizes of the displacements from a stationary point in lengths; the next one is used if those before led back. The second one is
/// opposite to the first.
pub(super) const DISPLACEMENTS: [f64; 3] = [0.1, 0.5, 0.5];
/// Largest number of displacements from stationary points in a run.
pub(super) const MAX_DISPLACEMENTS: usize = 6;
/// Number of sizes of a displacement that is rejected, each [`SHORTER`] times the one before.
pub(super) const SIZES: usize = 3;
const SHORTER: f64 = 0.01;
/// Factor of the displacement of variables without a known effect after each rejection.
const SHORTER_WITHOUT_EFFECT: f64 = 0.25;
/// Factor by which an increase of the objective may deviate from the square of the displacement, because the directions of displacements
/// differ; and the part of the objective that is rounding.
const QUADRATIC: f64 = 50.0;
const ROUNDING: f64 = 1e-14;
/// A stationary point of the violation is better than earlier ones if its violation is below this fraction of theirs.
const BETTER: f64 = 0.99;

/// Factor of a displacement after so many rejected ones; after the smallest one, the first one follows again.
pub(super) fn displacement_factor(rejections: usize) -> f64 {
    SHORTER.powi((rejections % SIZES) as i32)
}

impl CycleContext<'_> {
    /// A step of some variables in a generic direction, by the fraction `size` of the lengths.
    pub(super) fn displacement(&self, size: f64, is_moved: impl Fn(usize) -> bool) -> Proposal {
        let region = self.sides(&self.units.lengths);
        let rejections = self.memory.rejections;
        let is_flat_start = self.is_flat_start();
        let earlier = self.memory.displaced_from.len() + rejections;
        // Better points may be on one side only.
        let is_opposite = if is_flat_start { earlier % 2 == 1 } else { self.unsuccessful_displacements() == 1 };
        let direction = earlier - usize::from(is_opposite);
        let factor = if is_flat_start {
            displacement_factor(rejections)
        } else {
            SHORTER_WITHOUT_EFFECT.powi(rejections as i32)
        };
        let displaced = |j: usize| {
            if !is_moved(j) {
                return self.state.design[j];
            }
            let fraction = golden_fraction(j + 7 * direction);
            let sign = if (fraction < 0.5) != is_opposite { -1.0 } else { 1.0 };
            let size = size * self.units.lengths[j] * (0.5 + fraction) * factor;
            let (from, lower, upper) = (self.state.design[j], region.lower[j], region.upper[j]);
            let to = from + sign * size;
            let is_inside = (lower..=upper).contains(&to);
            if is_inside { to } else { (from - sign * size).clamp(lower, upper) }
        };
        let design: Vec<f64> = (0..self.n()).map(displaced).collect();
        self.with_linear_prediction(design, region, Purpose::Displacement)
    }

    /// True for a variable that has never moved because no function has depended on it to first order, apart from rounding.
    pub(super) fn has_no_known_effect(&self, j: usize) -> bool {
        let (variable, lengths) = (&self.problem.variables[j], &self.units.lengths);
        let [least, most] = self.state.trace().designs.extent(j);
        let has_no_effect =
            |gradient: &Vec<f64>| gradient[j].abs() * lengths[j] <= NO_EFFECT * largest_term(gradient, lengths);
        let mut points = self.memory.points.iter();
        variable.upper > variable.lower
            && [least, most].iter().all(|b| (b - self.state.design[j]).abs() <= NO_EFFECT * lengths[j])
            && has_no_effect(&self.linearized.gradient)
            && points.all(|p| p.slopes.iter().chain(p.numbers.iter().map(|r| &r.gradient)).all(has_no_effect))
    }

    /// Number of displacements since the last one that led to a better point, in the units of the current cycle.
    pub(super) fn unsuccessful_displacements(&self) -> usize {
        let earlier = self.memory.displaced_from.iter().map(|violations| self.units.violation(violations));
        let earlier: Vec<f64> = earlier.collect();
        let best = earlier.iter().copied().fold(f64::INFINITY, f64::min);
        let is_better = self.violation < BETTER * best;
        if is_better { 0 } else { earlier.iter().rev().take_while(|v| **v < best / BETTER).count() }
    }

    /// A displacement from a point where steps do not reduce the violation; `None` after several that led to no better point.
    pub(super) fn next_displacement(&self) -> Option<Proposal> {
        let unsuccessful = self.unsuccessful_displacements();
        let is_allowed = unsuccessful < DISPLACEMENTS.len() && self.memory.displaced_from.len() < MAX_DISPLACEMENTS;
        is_allowed.then(|| self.displacement(DISPLACEMENTS[unsuccessful], |_| true))
    }

    /// True if the objective has increased with the square of the displacement from a flat start, for all sizes: its gradients may then
    /// show whether it has a minimum there. They do not for an objective that is given directly, unless it is constant.
    pub(super) fn increases_quadratically(&self) -> bool {
        let Self { state, problem, .. } = self;
        let accepted = state.history.iter().rposition(|cycle| cycle.accepted).map_or(0, |last| last + 1);
        let here = state.evaluation.objective;
        let displacements = state.history[accepted..].iter().take(SIZES);
        let increases: Vec<f64> = displacements.map(|cycle| cycle.objective - here).collect();
        let is_quadratic = |pair: &[f64]| {
            let expected = SHORTER * SHORTER * pair[0];
            pair[1] <= QUADRATIC * expected && (pair[1] >= expected / QUADRATIC || expected <= ROUNDING * here.abs())
        };
        let is_constant = increases.iter().all(|increase| *increase == 0.0);
        let is_shown = is_constant || !problem.objective.quantity.is_explicit();
        increases.len() == SIZES && is_shown && increases.windows(2).all(is_quadratic)
    }
}

/// The fractional part of the k-th multiple of the golden ratio, counted from one: evenly spread.
pub(super) fn golden_fraction(k: usize) -> f64 {
    (0.618_033_988_749_894_9 * (1 + k) as f64).fract()
}

/// max |∂ⱼ| ℓⱼ.
fn largest_term(gradient: &[f64], lengths: &[f64]) -> f64 {
    gradient.iter().zip(lengths).map(|(g, l)| (g * l).abs()).fold(0.0, f64::max)
}
