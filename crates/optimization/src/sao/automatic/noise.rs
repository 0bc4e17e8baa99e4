//! Noise and kinks of the responses, as trial steps show them.

use super::candidates::AcceptedPoint;
use super::cycle_context::CycleContext;
use super::numbers::{ApproximatedValue, find_number};
use super::state::RejectedPoint;

/// Number of the last trial steps from which noise is estimated.
const STEPS: usize = 6;
/// Ratio of the longest to the shortest of these steps.
const SHORTER: f64 = 64.0;
/// Least ratio of the errors at the shorter half of the steps to those at the longer half. Errors of a smooth response fall with the
/// square of the step, those at a kink only in proportion to the step.
const REMAINS: f64 = 0.25;
/// Least exponent of the step with which errors at a kink fall along the shorter half of the steps, where those of noise do not fall.
const FALLS: f64 = 0.5;
/// Largest error from rounding, relative to the number and to its change along the step; and relative to its largest known value.
const ROUNDING: [f64; 2] = [1e-11, 1e-14];

/// A trial step with the errors of linear predictions for the numbers of the current design, zero within rounding; `None` for those that
/// were not known there.
struct TrialErrors {
    /// Longest step of a variable in its length.
    size: f64,
    errors: Vec<Option<f64>>,
}

impl CycleContext<'_> {
    /// The noise of the analysis, relative to the largest known value of the number that shows it most; `None` without signs of noise.
    ///
    /// Along trial steps that become shorter the error of a linear prediction, |r(b) − r(b₀) − sᵀ(b − b₀)|, falls with the square of
    /// the step. An error that does not fall is noise, or a response that jumps: shorter steps cannot be evaluated. The steps are those
    /// that were rejected here; where the run `is_at_end`, also the accepted ones before.
    pub(super) fn noise(&self, is_at_end: bool) -> Option<f64> {
        self.remaining_error(is_at_end, 0)
    }

    /// True if the errors along the steps that were rejected here fall with the step: not with its square, as those of a smooth response, and not
    /// to a constant, as those of noise.
    pub(super) fn has_kink(&self) -> bool {
        self.remaining_error(false, 1).is_some()
    }

    /// The error that remains along trial steps that become shorter, divided by the step to the power of `order`, relative to the largest
    /// known value of the number; `None` if it falls, or of the first order if it rises.
    fn remaining_error(&self, is_at_end: bool, order: i32) -> Option<f64> {
        let known: Vec<f64> = (0..self.current().numbers.len()).map(|k| self.largest_known(k)).collect();
        let mut trials = if is_at_end { self.accepted_trials(&known) } else { vec![] };
        trials.extend(self.rejected_trials(&known));
        trials.drain(..trials.len().checked_sub(STEPS)?);
        trials.sort_by(|a, b| b.size.total_cmp(&a.size));
        let [longest, shortest] = [trials[0].size, trials[STEPS - 1].size];
        if !(longest > SHORTER * shortest && shortest > 0.0) {
            return None;
        }
        let sizes: Vec<f64> = trials.iter().map(|trial| trial.size).collect();
        let of = |k: usize| {
            let error = |trial: &TrialErrors| Some(trial.errors[k]? / trial.size.powi(order));
            let errors = trials.iter().map(error).collect::<Option<Vec<f64>>>()?;
            let (longer, shorter) = errors.split_at(STEPS / 2);
            let remaining = shorter.iter().fold(f64::INFINITY, |a, e| a.min(*e));
            let does_remain = remaining > 0.0 && longer.iter().all(|e| remaining >= REMAINS * e);
            (does_remain && (order == 0 || !rises(&errors, &sizes))).then(|| remaining / known[k].max(remaining))
        };
        (0..known.len()).filter_map(of).reduce(f64::max)
    }

    /// The largest known absolute value of a number of the current design.
    fn largest_known(&self, k: usize) -> f64 {
        let id = self.current().numbers[k].id;
        let known = self.memory.points.iter().filter_map(|point| find_number(self.problem, &point.numbers, id));
        known.fold(0.0, |a: f64, other| a.max(other.value.abs()))
    }

    fn accepted_trials(&self, known: &[f64]) -> Vec<TrialErrors> {
        let numbers = &self.current().numbers;
        let trial = |ends: &[AcceptedPoint]| {
            let [from, to] = [&ends[0], &ends[1]];
            let values = |k: usize| {
                let [from, to] = [from, to].map(|point| find_number(self.problem, &point.numbers, numbers[k].id));
                Some((from?, to?.value))
            };
            self.trial([&from.design, &to.design], values, known)
        };
        self.memory.points.windows(2).map(trial).collect()
    }

    fn rejected_trials(&self, known: &[f64]) -> Vec<TrialErrors> {
        let numbers = &self.current().numbers;
        let trial = |to: &RejectedPoint| {
            self.trial([&self.state.design, &to.design], |k| Some((&numbers[k], to.values[k])), known)
        };
        self.memory.rejected.iter().map(trial).collect()
    }

    /// The step between two designs; `values` gives a number at the first one and its value at the second one.
    fn trial<'b>(
        &self,
        [from, to]: [&[f64]; 2],
        values: impl Fn(usize) -> Option<(&'b ApproximatedValue, f64)>,
        known: &[f64],
    ) -> TrialErrors {
        let step: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        let size = step.iter().zip(&self.units.lengths).fold(0.0f64, |a, (s, l)| a.max((s / l).abs()));
        let error = |k: usize| {
            let (number, value) = values(k)?;
            let terms = || number.gradient.iter().zip(&step).map(|(g, s)| g * s);
            let [change, sum]: [f64; 2] = [terms().sum(), terms().map(f64::abs).sum()];
            let rounding = (ROUNDING[0] * (number.value.abs() + sum)).max(ROUNDING[1] * known[k]);
            let error = (value - number.value - change).abs();
            Some(if error > rounding { error } else { 0.0 })
        };
        TrialErrors { size, errors: (0..known.len()).map(error).collect() }
    }
}

/// True if errors over their steps rise as the steps become shorter: as a whole, or along the shorter half. Noise does so, and a response whose
/// curvature makes the errors of the longer steps may hide it as a whole.
fn rises(ratios: &[f64], sizes: &[f64]) -> bool {
    let (longer, shorter) = ratios.split_at(STEPS / 2);
    let least = longer.iter().fold(f64::INFINITY, |a, e| a.min(*e));
    let largest = |a: f64, e: &f64| a.max(*e);
    let [first, last] = [STEPS / 2, STEPS - 1];
    let allowed = (sizes[first] / sizes[last]).powf(1.0 - FALLS);
    REMAINS * shorter.iter().fold(0.0, largest) > least
        || shorter.iter().skip(1).fold(0.0, largest) > allowed.max(2.0) * ratios[first]
}

/// The reason in words for an end because of noise.
pub(super) fn in_words(noise: f64) -> String {
    format!(
        "shorter steps do not make the errors of predictions smaller: the analysis has noise of about {noise:.0e} of the largest \
         value of a response, a response jumps, or its curvatures differ by many orders of magnitude between directions; finer tolerances of the \
         analysis, or variables of similar effect, allow a better design"
    )
}

/// Remedy for a run that stalls at a kink of a response.
pub(super) const KINK: &str = "shorter steps make the errors of predictions smaller only in proportion: a response has a kink here, as |x| \
                               and max have; write a largest or an absolute value as constraints with a bound, which is minimized";
/// As [`KINK`] for finite differences, whose errors from noise make predictions wrong in the same way.
pub(super) const KINK_OR_DIFFERENCES: &str = "shorter steps make the errors of predictions smaller only in proportion: the differences have errors \
     from noise of the analysis, or a response has a kink, as |x| and max have; give derivatives, noise-aware differences, or finer tolerances \
     of the analysis, and write a largest or an absolute value as constraints with a bound, which is minimized";

#[cfg(test)]
mod tests {
    use super::*;

    /// Errors c s² + k s + n over steps that become shorter by `factor`.
    #[test]
    fn errors_of_noise_rise_over_the_step_and_those_at_a_kink_do_not() {
        for factor in [2.5, 4.0, 10.0] {
            let sizes: Vec<f64> = (0..STEPS as i32).map(|k| f64::powi(factor, -k)).collect();
            let ratios = |curvature: f64, kink: f64, noise: f64| -> Vec<f64> {
                sizes.iter().map(|s| curvature * s + kink + noise / s).collect()
            };
            assert!(!rises(&ratios(0.0, 1.0, 0.0), &sizes) && !rises(&ratios(2.0, 1.0, 0.0), &sizes));
            assert!(rises(&ratios(0.0, 0.0, 0.01), &sizes));
            // The errors of the longest and of the shortest step have one ratio.
            assert!(rises(&ratios(1.0, 0.0, sizes[STEPS - 1]), &sizes), "{factor}");
        }
    }
}
