//! Noise of the analysis, as rejected steps show it.

use super::numbers::find;
use super::situation::Situation;

/// Number of rejected steps, the last ones, that show noise.
const STEPS: usize = 6;
/// Ratio of the longest to the shortest of these steps.
const SHORTER: f64 = 64.0;
/// Least ratio of the errors at the shorter half of the steps to those at the longer half. Errors of a smooth response fall with the
/// square of the step, those at a kink with the step.
const REMAINS: f64 = 0.25;
/// Largest error from rounding, relative to the number and to its change along the step; and relative to its largest known value.
const ROUNDING: [f64; 2] = [1e-11, 1e-14];

impl Situation<'_> {
    /// The noise of the analysis, relative to the largest known value of the number that shows it most; `None` without signs of noise.
    ///
    /// Along rejected steps that become shorter the error of a linear prediction, |r(b) − r(b₀) − sᵀ(b − b₀)|, falls with the square of
    /// the step. An error that does not fall is noise, or a response that jumps: shorter steps cannot be judged.
    pub(super) fn noise(&self) -> Option<f64> {
        let rejected = &self.memory.rejected;
        let last = rejected.get(rejected.len().checked_sub(STEPS)?..)?;
        let steps: Vec<Vec<f64>> = last
            .iter()
            .map(|point| point.design.iter().zip(&self.state.design).map(|(to, from)| to - from).collect())
            .collect();
        let size =
            |step: &Vec<f64>| step.iter().zip(&self.units.lengths).fold(0.0f64, |a, (s, l)| a.max((s / l).abs()));
        let sizes: Vec<f64> = steps.iter().map(size).collect();
        if !(sizes[0] > SHORTER * sizes[STEPS - 1] && sizes[STEPS - 1] > 0.0) {
            return None;
        }
        let of = |k: usize| {
            let number = &self.current().numbers[k];
            let known = self.memory.points.iter().filter_map(|point| find(self.problem, &point.numbers, number.id));
            let known = known.fold(0.0, |a: f64, other| a.max(other.value.abs()));
            let errors: Vec<f64> = last
                .iter()
                .zip(&steps)
                .map(|(point, step)| {
                    let change: f64 = number.gradient.iter().zip(step).map(|(g, s)| g * s).sum();
                    let terms: f64 = number.gradient.iter().zip(step).map(|(g, s)| (g * s).abs()).sum();
                    let rounding = (ROUNDING[0] * (number.value.abs() + terms)).max(ROUNDING[1] * known);
                    let error = (point.values[k] - number.value - change).abs();
                    if error > rounding { error } else { 0.0 }
                })
                .collect();
            let [longer, shorter] = [&errors[..STEPS / 2], &errors[STEPS / 2..]];
            let remaining = shorter.iter().fold(f64::INFINITY, |a, e| a.min(*e));
            let is_noise = remaining > 0.0 && longer.iter().all(|e| remaining >= REMAINS * e);
            is_noise.then(|| remaining / known.max(remaining))
        };
        (0..self.current().numbers.len()).filter_map(of).reduce(f64::max)
    }
}

/// The reason for an end where noise hides what steps do.
pub(super) fn in_words(noise: f64) -> String {
    format!(
        "shorter steps do not make the errors of predictions smaller: the analysis has noise of about {noise:.0e} of the largest \
         value of a response, or a response jumps; finer tolerances of the analysis allow a better design"
    )
}
