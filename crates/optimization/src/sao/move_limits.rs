//! Move limits: the search subregion of a cycle.

use super::{Region, StepVerdict, Trial};
use crate::problem::Problem;
use error::{Error, Result};

/// A move-limit strategy. Values hold settings only; the factors belong to the state of the run.
pub trait MoveLimits: Send + Sync + std::fmt::Debug {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Option`] for a setting out of range.
    fn check(&self) -> Result<()>;
    /// The factors of the first cycle, one for each of `n` variables.
    fn start(&self, n: usize) -> Vec<f64>;
    /// The search subregion around design `b`.
    fn region(&self, problem: &Problem, b: &[f64], factors: &[f64]) -> Region;
    /// Updates the factors for the next trial step, after the decision on a trial step.
    fn update(&self, factors: &mut [f64], trial: &Trial, verdict: StepVerdict);
}

/// The move limits of the paper: one relative factor for each design variable, controlled by the approximation errors.
///
/// The region is bᵢ ± fᵢ·|bᵢ|, intersected with the design space. With E = max(E_f, E_g) in percent, after a cycle that was
///
/// * rejected, all factors × [`on_rejection`](Self::on_rejection);
/// * accepted with E above [`reduce_above_pct`](Self::reduce_above_pct), all × [`reduction`](Self::reduction);
/// * accepted with E up to [`increase_below_pct`](Self::increase_below_pct), × [`increase`](Self::increase) for variables
///   at a move limit, unless V exceeds [`increase_violation_pct`](Self::increase_violation_pct) or no retained function is
///   approximate;
/// * accepted with E up to that threshold, × [`on_reversal`](Self::on_reversal) for variables whose step has the opposite
///   sign of their last step, if V exceeds [`reversal_violation_pct`](Self::reversal_violation_pct): the sign of an oscillation
///   between time points. With E between the two thresholds it takes a V above
///   [`increase_violation_pct`](Self::increase_violation_pct) both before and after the step.
///
/// The paper refers to the thesis for its rules; these follow from the printed rows of Tables I, II, IV and VI. The
/// violation thresholds and the reversal rule affect only the run with one time point for each maximum. The paper
/// prints only its 18 cycles, so these rules are inferred.
/// A relative limit would fix a variable at zero. The width is therefore at least
/// [`floor`](Self::floor) × fᵢ × (its range if it is bounded, else |its start|, else 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelativeLimits {
    /// First factor of every variable.
    pub initial: f64,
    /// Largest factor.
    pub cap: f64,
    /// Multiplier of all factors after a rejected cycle.
    pub on_rejection: f64,
    /// Error in percent above which all factors shrink although the cycle is accepted.
    pub reduce_above_pct: f64,
    /// Multiplier of all factors in that case.
    pub reduction: f64,
    /// Error in percent up to which the factors of variables at a move limit increase.
    pub increase_below_pct: f64,
    /// Violation in percent up to which they increase.
    pub increase_violation_pct: f64,
    /// Multiplier of these factors in that case.
    pub increase: f64,
    /// Multiplier of the factor of a variable whose step changed its sign; 1 switches the rule off.
    pub on_reversal: f64,
    /// Violation in percent above which it applies.
    pub reversal_violation_pct: f64,
    /// Least width, as a fraction of the reference of the variable.
    pub floor: f64,
}

impl Default for RelativeLimits {
    fn default() -> Self {
        Self {
            initial: 0.4,
            cap: 0.4 * 4.0 / 3.0,
            on_rejection: 0.5,
            reduce_above_pct: 20.0,
            reduction: 0.75,
            increase_below_pct: 10.0,
            increase_violation_pct: 0.45,
            increase: 4.0 / 3.0,
            on_reversal: 0.5,
            reversal_violation_pct: 1e-3,
            floor: 1e-3,
        }
    }
}

impl MoveLimits for RelativeLimits {
    fn check(&self) -> Result<()> {
        let positive = |name, v: f64| Error::check_option(name, "positive and finite", v, v > 0.0 && v.is_finite());
        let shrinking = |name, v: f64| Error::check_option(name, "above 0 and at most 1", v, v > 0.0 && v <= 1.0);
        positive("initial move-limit factor", self.initial)?;
        Error::check_option("move-limit cap", "at least the initial factor", self.cap, self.cap >= self.initial)?;
        shrinking("move-limit multiplier on rejection", self.on_rejection)?;
        shrinking("move-limit reduction", self.reduction)?;
        shrinking("move-limit multiplier on reversal", self.on_reversal)?;
        let widening = self.increase >= 1.0 && self.increase.is_finite();
        Error::check_option("move-limit increase", "at least 1 and finite", self.increase, widening)?;
        let number = |name, v: f64| Error::check_option(name, "a number", v, !v.is_nan());
        number("violation up to which move limits widen", self.increase_violation_pct)?;
        number("violation above which a reversal counts", self.reversal_violation_pct)?;
        positive("error above which move limits shrink", self.reduce_above_pct)?;
        positive("error below which move limits widen", self.increase_below_pct)?;
        positive("move-limit floor", self.floor)
    }

    fn start(&self, n: usize) -> Vec<f64> {
        vec![self.initial; n]
    }

    fn region(&self, problem: &Problem, b: &[f64], factors: &[f64]) -> Region {
        let scales = problem.scales();
        let width = |k: usize| factors[k] * b[k].abs().max(self.floor * scales[k]);
        Region::around(problem, b, &(0..b.len()).map(width).collect::<Vec<_>>())
    }

    fn update(&self, factors: &mut [f64], trial: &Trial, verdict: StepVerdict) {
        let Some(outcome) = trial.outcome.as_ref().filter(|_| verdict == StepVerdict::Accept) else {
            factors.iter_mut().for_each(|f| *f *= self.on_rejection);
            return;
        };
        let error = outcome.error_pct();
        let may_widen = error <= self.increase_below_pct
            && outcome.violation_pct <= self.increase_violation_pct
            && outcome.is_approximate;
        // With larger errors one violation is not yet an oscillation, as Table II shows; two clear ones in a row are.
        let clear = self.increase_violation_pct;
        let again =
            error <= self.reduce_above_pct && outcome.violation_pct > clear && 100.0 * trial.violation_before > clear;
        let mild = error <= self.increase_below_pct && outcome.violation_pct > self.reversal_violation_pct;
        let oscillates = mild || again;
        for (k, factor) in factors.iter_mut().enumerate() {
            if error > self.reduce_above_pct {
                *factor *= self.reduction;
            } else if may_widen && trial.at_limit[k] {
                *factor = (*factor * self.increase).min(self.cap.max(*factor));
            }
            let is_reversed = trial.last_step.is_some_and(|last| last[k] * (trial.to[k] - trial.from[k]) < 0.0);
            if is_reversed && oscillates {
                *factor *= self.on_reversal;
            }
        }
    }
}
