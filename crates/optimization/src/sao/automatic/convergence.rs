//! The stop test of the automatic method, made with the problem at the current design before a proposal is analysed.

use super::lengths::spread;
use super::linearized::Linearized;
use crate::problem::Problem;
use crate::sao::trace::OBJECTIVES;

/// Largest violation of a converged design, in units of the rows.
const FEASIBLE: f64 = 1e-6;
/// Largest violation of a converged design in the terms of its row, and the violation in units of the rows below which this
/// does not matter: the terms of a row vanish where its slope does.
const IN_TERMS: [f64; 2] = [1e-5, 1e-9];
/// Largest predicted decrease, relative to the unit U of the objective ([`StopTest::objective_unit`]): in general, and while a move
/// limit is active. Limits may be small because a length was underestimated, and grow by a factor of up to ten in a cycle.
const PREDICTED: [f64; 2] = [1e-6, 1e-13];
/// Largest first-order decrease R, relative to U: in general, and where the step is zero.
const RESIDUAL: [f64; 2] = [1e-4, 3e-4];
/// Largest residual where no other step can be made: relative to the smaller one of the objective and its settled range, and relative to
/// the smaller one of its ranges over the last designs and since it settled.
const WITHOUT_STEP: [f64; 2] = [1e-6, 1e-12];
/// Largest residual where the step is zero and the subproblem predicts no better design, relative to the larger one of the ranges of the
/// objective over the last designs. Random curve fits end at up to 2e-11 of it by rounding. Forward differences have errors far above that.
const AT_ZERO_STEP: f64 = 1e-10;
/// Decrease of the objective, relative to itself, that a residual R may allow there: about R² / (4 Δ) with the range Δ of the objective. The slopes of
/// fits by adaptive steps are not those of their values in all digits.
const HIDDEN_DECREASE: f64 = 1e-8;
/// Largest predicted decrease, residual and complementarity where no other step can be made, relative to the smaller one of the objective and its
/// change by its slopes, in general and if noise prevents other steps: a run that starts at an optimum has seen no range of the objective.
const BY_SLOPES: [f64; 2] = [1e-7, 1e-6];
/// Rounding error of the objective, relative to itself, to which its values can be compared.
const COMPARABLE: f64 = 1e-13;
/// Number of accepted designs over which the objective has changed by rounding only, for a run that has settled: in general, and at a
/// move limit, which may be small because a length was underestimated. Larger number for a run without progress.
const SETTLED: [usize; 2] = [4, 8];
const NO_PROGRESS: usize = OBJECTIVES;
/// Largest Σ |λᵢ cᵢ|, relative to U.
const COMPLEMENTARITY: f64 = 1e-5;
/// Number of accepted designs over which the recent range of the objective is taken.
const RECENT: usize = 4;
/// Least U, relative to the geometric mean of the ranges of the objective in the run and over the last [`LONGER`] accepted
/// designs, or to the objective.
const LEAST: f64 = 1e-4;
/// Violation of a row relative to its scale, relative to its terms Σ |∂ĝ/∂bⱼ| |bⱼ|, and relative to its change Σ |∂ĝ/∂bⱼ| ℓⱼ (rounding).
/// A converged design meets one of these limits with its own slopes.
const BY_OWN_SLOPES: [f64; 3] = [1e-6, 1e-9, 1e-12];
/// Largest violation of a converged design relative to the scale of its row, and the one relative to its terms that is a rounding error
/// for any scale: the scale of a peak may be a rounding error itself, where the peak at the start should be zero.
const MOST: [f64; 2] = [1e-3, 1e-13];
/// Largest change of the objective by a row, with its slopes at the last designs, relative to U and to the change by the slopes of the
/// objective. Rows whose slopes vanish or oppose each other have no bounded multipliers.
const LARGEST_MULTIPLIER: f64 = 1e5;
/// Number of accepted designs of the longer range, without the start. A start with a huge objective must not affect the whole run.
const LONGER: usize = OBJECTIVES - 1;
/// Objective, relative to its range, that is a rounding error: in general, and where the step is zero.
const VANISHED: [f64; 2] = [1e-18, 1e-15];
/// Objective, relative to its first-order change over the lengths, that counts as zero.
const STEEP: f64 = 1e-11;
/// Predicted decrease, relative to the objective, above which another step is made for any history of the objective.
const FAR: f64 = 10.0;
/// Rounding errors, relative to the objective: of a predicted decrease, and of the other sums.
const ROUNDING: [f64; 2] = [1e-14, 1e-12];
/// Fraction of the negligible change of the objective below which each of the sums is negligible.
const OF_TOLERANCE: f64 = 0.1;
/// First-order change over a length, relative to U, below which a direction need not be explored.
const NEGLIGIBLE: f64 = 1e-10;
/// Largest residual at the start: relative to the largest change of the objective by its slopes, and relative to the smaller one of the
/// objective and its change by rejected steps, if the curvature that these have shown predicts no better design.
const AT_START: f64 = 1e-9;
const AFTER_TRIALS: f64 = 1e-6;
/// Largest step over the lengths, and largest box, of a stalled run.
const STALLED: [f64; 2] = [1e-12, 1e-13];

/// The optimality conditions of the problem at a design, in the unit of the objective.
#[derive(Clone, Debug)]
pub(super) struct Optimality {
    /// λ.
    pub multipliers: Vec<f64>,
    /// R = Σ |∂ⱼL| min(max(ℓⱼ, |bⱼ|), distance to the bound that it points to). The length of a variable that never moved may be a guess.
    pub residual: f64,
    /// Σ |λᵢ cᵢ|.
    pub complementarity: f64,
    /// Σ |∂ⱼF| ℓⱼ.
    pub largest_change: f64,
}

impl Optimality {
    /// The conditions at design `b` with the multipliers of the subproblem, or with those of least squares if these hold better.
    ///
    /// The conditions hold if any multipliers satisfy them. Those of a subproblem may belong to another active set, or
    /// be inaccurate if its last step is a rounding error.
    pub fn new(problem: &Problem, b: &[f64], here: &Linearized, multipliers: &[f64], lengths: &[f64]) -> Self {
        let given = Self::with(problem, b, here, multipliers, lengths);
        let least_squares = here.least_squares_multipliers(problem, b, lengths);
        let found = Self::with(problem, b, here, &least_squares, lengths);
        let size = |o: &Self| o.residual + o.complementarity;
        if size(&found) < size(&given) { found } else { given }
    }

    /// The sums in words.
    pub fn in_words(&self) -> String {
        let [residual, complementarity] = [self.residual, self.complementarity].map(in_words);
        format!("the optimality conditions hold to {residual} and the complementarity to {complementarity}")
    }

    fn with(problem: &Problem, b: &[f64], here: &Linearized, multipliers: &[f64], lengths: &[f64]) -> Self {
        let slope = here.lagrangian_gradient(multipliers);
        let one = |j: usize| {
            let variable = &problem.variables[j];
            let distance = if slope[j] > 0.0 { b[j] - variable.lower } else { variable.upper - b[j] };
            slope[j].abs() * distance.max(0.0).min(lengths[j].max(b[j].abs()))
        };
        Self {
            residual: (0..b.len()).map(one).sum(),
            complementarity: multipliers.iter().zip(&here.c).fold(0.0, |sum, (λ, c)| sum + (λ * c).abs()),
            largest_change: largest_change(&here.gradient, lengths),
            multipliers: multipliers.to_vec(),
        }
    }
}

/// Quantities that the stop test compares.
pub(super) struct StopTest<'a> {
    /// True if no row is violated by more than a converged design may violate it.
    pub is_feasible: bool,
    /// True if the linearized rows have a common point in the box.
    pub is_compatible: bool,
    /// F − F̃.
    pub predicted: f64,
    /// True if the proposal is at a move limit.
    pub at_limit: bool,
    pub optimality: Optimality,
    /// True if no other step can be made, or the last ones have changed nothing.
    pub is_last: bool,
    /// True if noise is the reason that no other step can be made.
    pub is_noisy: bool,
    /// True if the last steps have changed the objective by rounding only.
    pub has_settled: bool,
    /// Largest change of the objective by a row, |λᵢ| Σ |∂cᵢ/∂bⱼ| ℓⱼ, with its slopes at the last designs.
    pub largest_multiplier: f64,
    /// Objectives of the last [`LONGER`] + 1 accepted designs without excursions, and of the current one, which is the last.
    pub objectives: &'a [f64],
    /// Range of the objective over all accepted designs without excursions.
    pub objective_range: f64,
    /// Settled range: that since the last step that reduced the objective by many orders of magnitude.
    pub settled_range: f64,
    /// Largest change of the objective by a rejected step from the current design.
    pub rejected_change: f64,
    /// Change of the objective that is negligible.
    pub tolerance: f64,
    /// True if the derivatives are forward differences: their errors are of the first order in their steps.
    pub has_forward_differences: bool,
}

impl StopTest<'_> {
    /// U: the range of the objective over the last designs or its absolute value, whichever is smaller; at least a part of the
    /// objective or of its change, in the run or by its slopes, whichever is smaller: the change may come from a start far away, and a
    /// run that starts at an optimum has none.
    pub fn objective_unit(&self) -> f64 {
        let objective = self.objectives.last().copied().unwrap_or(0.0).abs();
        let change = self.longer_range().sqrt() * self.objective_range.sqrt();
        let rounding = if self.is_last { ROUNDING[1] * self.settled_range } else { 0.0 };
        let least = LEAST * change.max(self.optimality.largest_change).min(objective);
        self.range(RECENT).min(objective).max(least).max(rounding)
    }

    /// True for an objective that has decreased to its rounding error: compared with its settled range, or with its whole range if its
    /// slopes are far larger than itself.
    fn is_rounding(&self, objective: f64) -> bool {
        let part = VANISHED[usize::from(self.is_last)];
        let is_steep = objective <= STEEP * self.optimality.largest_change;
        objective <= part * self.settled_range || (is_steep && objective <= part * self.objective_range)
    }

    /// True for an objective that is nearly zero compared with its slopes, where no step can be made and none is predicted: a residual R then
    /// allows a decrease of about R² / (4 Δ) with the range Δ of the objective.
    fn is_zero_without_step(&self, objective: f64) -> bool {
        let Optimality { residual, complementarity, largest_change, .. } = self.optimality;
        let zero = STEEP * largest_change;
        let is_zero = [objective, complementarity, self.predicted.abs()].iter().all(|sum| *sum <= zero);
        self.is_last && !self.at_limit && zero > 0.0 && is_zero && residual <= (zero * self.objective_range).sqrt()
    }

    /// Range of the objective over the last designs.
    fn range(&self, count: usize) -> f64 {
        spread(self.objectives[self.objectives.len().saturating_sub(count)..].iter().copied())
    }

    /// Range of the objective over more designs, but without the start.
    fn longer_range(&self) -> f64 {
        self.range(LONGER.min(self.objectives.len().saturating_sub(1)))
    }

    /// The residual up to which the run has converged if no other step can be made: a decrease, of about R² / (4 Δ) with the
    /// range Δ of the objective, that rounding hides.
    fn residual_without_step(&self) -> f64 {
        let objective = self.objectives.last().copied().unwrap_or(0.0).abs();
        let range = self.settled_range.min(objective);
        let by_values = (COMPARABLE * objective * range).sqrt();
        let by_range = (WITHOUT_STEP[0] * range).max(WITHOUT_STEP[1] * self.longer_range().min(self.settled_range));
        let is_exact = !self.at_limit && self.predicted.abs() <= PREDICTED[0] * objective;
        let is_exact = is_exact && !self.has_forward_differences;
        let by_prediction = if is_exact { self.hidden_residual().max(AT_ZERO_STEP * self.seen_range()) } else { 0.0 };
        if self.is_last { by_range.max(by_values).max(by_prediction) } else { 0.0 }
    }

    /// The larger one of the ranges of the objective over the last designs, at most its settled range.
    fn seen_range(&self) -> f64 {
        self.longer_range().max(self.range(RECENT)).min(self.settled_range)
    }

    /// The residual that allows a decrease of [`HIDDEN_DECREASE`].
    fn hidden_residual(&self) -> f64 {
        let (objective, seen) = (self.objectives.last().copied().unwrap_or(0.0).abs(), self.seen_range());
        2.0 * (HIDDEN_DECREASE * objective.min(seen) * seen).sqrt()
    }

    /// The reason in words if the conditions hold to the [`hidden_residual`](Self::hidden_residual), at the end of a run that can make no other step.
    ///
    /// A box that rejected steps have made small predicts no decrease at all: fits with a small residual end in one, because the rounding errors
    /// of their values hide the last decrease.
    pub fn converged_to_rounding(&self) -> Option<String> {
        let Optimality { residual, complementarity, .. } = self.optimality;
        let is_smooth = !self.has_forward_differences && !self.is_noisy;
        let is_regular = self.is_feasible && self.is_compatible && self.unbounded_multipliers().is_none();
        // Numbers near the largest representable one overflow.
        let (sum, hidden) = (residual.max(complementarity), self.hidden_residual());
        let holds = sum <= hidden && hidden.is_finite() && self.objectives.len() > 1;
        (is_smooth && is_regular && holds).then(|| {
            format!("{}; rounding errors of the objective hide what another step changes", self.optimality.in_words())
        })
    }

    /// Change of the objective below which a direction is not explored.
    pub fn negligible(&self) -> f64 {
        let objective = self.objectives.last().copied().unwrap_or(0.0).abs();
        (NEGLIGIBLE * self.objective_unit()).max(ROUNDING[1] * objective)
    }

    /// The reason in words why the optimality conditions are inconclusive; `None` if they are conclusive.
    pub fn unbounded_multipliers(&self) -> Option<String> {
        let largest = LARGEST_MULTIPLIER * self.optimality.largest_change.max(self.objective_unit());
        (self.is_feasible && self.largest_multiplier > largest).then(|| {
            "the active constraints have no bounded multipliers here, so that the optimality conditions cannot be confirmed: their \
             slopes vanish or oppose each other; write them by functions with independent slopes at their limits"
                .to_owned()
        })
    }

    /// The reason in words if the run has converged.
    pub fn converged(&self) -> Option<String> {
        let objective = self.objectives.last().copied().unwrap_or(0.0).abs();
        let Optimality { residual, complementarity, largest_change, .. } = self.optimality;
        let numbers = [objective, self.objective_unit(), residual, complementarity, largest_change, self.predicted];
        // Numbers near the largest representable one overflow, and the test is then inconclusive.
        if !numbers.iter().all(|x| x.is_finite()) {
            return None;
        }
        if !self.is_feasible || !self.is_compatible || self.unbounded_multipliers().is_some() {
            return None;
        }
        if self.objectives.len() == 1 {
            return self
                .start_is_optimal(objective)
                .then(|| "the start satisfies the optimality conditions".to_owned());
        }
        let has_vanished = self.is_rounding(objective)
            && self.predicted.abs() <= FAR * objective
            && residual <= RESIDUAL[0] * LEAST * self.objective_range;
        let holds = self.conditions_hold(objective) || has_vanished || self.is_zero_without_step(objective);
        holds.then(|| {
            let predicted = in_words(self.predicted.abs());
            format!("{}; another step would change the objective by {predicted}", self.optimality.in_words())
        })
    }

    /// True if the optimality conditions hold at the start of a run, which has no range of the objective yet.
    fn start_is_optimal(&self, objective: f64) -> bool {
        let Optimality { residual, complementarity, largest_change, .. } = self.optimality;
        let by_slopes = (AT_START * largest_change).max(ROUNDING[1] * objective);
        let is_known = !self.at_limit && self.predicted.abs() <= PREDICTED[1].max(ROUNDING[0]) * objective;
        let by_trials = if is_known { AFTER_TRIALS * objective.min(self.rejected_change) } else { 0.0 };
        let largest = by_slopes.max(by_trials);
        residual <= largest && complementarity <= largest
    }

    /// True if the predicted decrease, the residual and the complementarity are within their tolerances.
    fn conditions_hold(&self, objective: f64) -> bool {
        let Optimality { residual, complementarity, largest_change, .. } = self.optimality;
        let unit = self.objective_unit();
        let is_exact_end = self.is_last && !self.has_forward_differences;
        let by_slopes = BY_SLOPES[usize::from(self.is_noisy)] * largest_change.min(objective);
        let by_slopes = if is_exact_end { by_slopes } else { 0.0 };
        let tolerance = (OF_TOLERANCE * self.tolerance).max(by_slopes);
        let allowed = |fraction: f64, rounding: f64| (fraction * unit).max(rounding * objective);
        let prediction = if self.has_settled {
            COMPARABLE * objective
        } else if self.at_limit {
            allowed(PREDICTED[1], ROUNDING[0]).max(by_slopes)
        } else {
            allowed(PREDICTED[0], ROUNDING[0]).max(tolerance)
        };
        let largest_residual = allowed(RESIDUAL[usize::from(self.is_last)], ROUNDING[1]).max(tolerance);
        let is_far = !self.is_last && self.predicted.abs() > FAR * objective;
        self.predicted.abs() <= prediction
            && !is_far
            && residual <= largest_residual.max(self.residual_without_step())
            && complementarity <= allowed(COMPLEMENTARITY, ROUNDING[1]).max(tolerance)
    }
}

/// A sum in words.
fn in_words(sum: f64) -> String {
    if sum == 0.0 { "0".to_owned() } else { format!("{sum:.1e}") }
}

/// True if the last accepted designs have the same objective up to rounding, and no change of it is predicted for the next step. A run
/// that `is_without_progress` needs more such designs.
pub(super) fn has_settled(objectives: &[f64], predicted: f64, at_limit: bool, is_without_progress: bool) -> bool {
    let count = if is_without_progress { NO_PROGRESS } else { SETTLED[usize::from(at_limit)] };
    let Some(first) = objectives.len().checked_sub(count) else { return false };
    let rounding = COMPARABLE * objectives.last().copied().unwrap_or(0.0).abs();
    predicted.abs() <= rounding && spread(objectives[first..].iter().copied()) <= rounding
}

/// True if a converged design may have this violation, in units of the rows and in the terms of its row. The limits are those of
/// the automatic method times `factor`.
pub(super) fn is_feasible(violation: f64, in_terms: f64, factor: f64) -> bool {
    let (violation, in_terms) = (violation / factor, in_terms / factor);
    violation <= FEASIBLE && (in_terms <= IN_TERMS[0] || violation <= IN_TERMS[1])
}

/// True if a violation of a row is small compared with its scale or its terms at the design, or a rounding error of its change over the
/// lengths.
///
/// Units from other designs are meaningless for a row whose slopes have changed by many orders of magnitude.
pub(super) fn is_feasible_by_itself(
    violation: f64,
    slopes: &[f64],
    (design, lengths): (&[f64], &[f64]),
    factor: f64,
) -> bool {
    let sum = |sizes: &[f64]| slopes.iter().zip(sizes).map(|(g, size)| (g * size).abs()).sum::<f64>();
    let [of_scale, of_terms, rounding] = BY_OWN_SLOPES;
    if violation > (factor * MOST[0]).max(MOST[1] * sum(design)) {
        return false;
    }
    violation <= factor * of_scale.max(of_terms * sum(design)) || violation <= rounding * sum(lengths)
}

/// The factor by which the limits of [`is_feasible`] are larger for a run with this accuracy.
pub(super) fn feasibility_factor(accuracy: f64) -> f64 {
    (accuracy / FEASIBLE).max(1.0)
}

/// Σ |∂ⱼF| ℓⱼ.
pub(super) fn largest_change(slope: &[f64], lengths: &[f64]) -> f64 {
    slope.iter().zip(lengths).map(|(g, l)| (g * l).abs()).sum()
}

/// max |vⱼ| / ℓⱼ.
pub(super) fn largest_share(v: &[f64], lengths: &[f64]) -> f64 {
    v.iter().zip(lengths).map(|(v, l)| v.abs() / l).fold(0.0, f64::max)
}

/// The reason in words if the steps have become too small.
pub(super) fn stalled(step: &[f64], widths: &[f64], lengths: &[f64]) -> Option<String> {
    if largest_share(widths, lengths) < STALLED[1] {
        return Some("no acceptable design was found in the smallest box".to_owned());
    }
    (largest_share(step, lengths) < STALLED[0])
        .then(|| "the next step is zero, but this does not confirm the design as a solution".to_owned())
}
