//! Derivatives by extrapolated differences with an error estimate, and detection of kinks.

/// A derivative with an estimate of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferenceEstimate {
    /// The derivative.
    pub value: f64,
    /// Estimate of its error.
    pub error: f64,
    /// Estimated noise of the function values.
    pub noise: f64,
}

/// Estimates the derivative at 0 from values at 0 and at ±h for falling steps h.
///
/// Central differences are extrapolated to h = 0 in all ways that the steps allow. The result is the one that differs least
/// from its neighbours, unless noise dominates. Large steps suffer from curvature, small ones from the noise of the values:
/// the choice finds a step between. The noise is estimated from the scatter of the extrapolated differences of the smallest
/// steps. The error is the largest of that difference, that noise, and the deviation from the neighbouring steps.
///
/// Returns `None` with fewer than two steps.
///
/// # Sources
///
/// Ridders, *Adv. Eng. Softw.* 4 (1982) 75–76.
pub fn ridders(here: f64, steps: &[StepValues]) -> Option<DifferenceEstimate> {
    let central = |s: &StepValues| (s.ahead - s.behind) / (2.0 * s.h);
    let extrapolated =
        |a: &StepValues, b: &StepValues| central(b) + (central(b) - central(a)) / ((a.h / b.h).powi(2) - 1.0);
    let scatter = |s: &[StepValues]| (extrapolated(&s[1], &s[2]) - extrapolated(&s[0], &s[1])).abs() * s[2].h;
    let noise = steps.windows(3).rev().take(SMALLEST).map(scatter).fold(0.0, f64::max);
    let mut rows: Vec<DifferenceEstimate> = Vec::new();
    let mut above: Vec<f64> = Vec::new();
    for (row, step) in steps.iter().enumerate() {
        let size = step.ahead.abs().max(step.behind.abs()).max(here.abs());
        let least = (2.0 * f64::EPSILON * size).max(noise) / step.h;
        let mut current = vec![central(step)];
        let mut best = DifferenceEstimate { value: current[0], error: f64::INFINITY, noise };
        for column in 1..=row {
            let ratio = (steps[row - column].h / step.h).powi(2);
            let value = current[column - 1] + (current[column - 1] - above[column - 1]) / (ratio - 1.0);
            let error = (value - current[column - 1]).abs().max((value - above[column - 1]).abs()).max(least);
            if error < best.error {
                best = DifferenceEstimate { value, error, ..best };
            }
            current.push(value);
        }
        rows.push(best);
        above = current;
    }
    let row = (1..rows.len()).min_by(|&a, &b| rows[a].error.total_cmp(&rows[b].error))?;
    let DifferenceEstimate { value, error, .. } = rows[row];
    // Two numbers may agree by chance: the neighbouring rows must agree too.
    let neighbours = [row.checked_sub(1).filter(|&row| row > 0), Some(row + 1)].into_iter().flatten();
    let neighbours = neighbours.filter_map(|row| rows.get(row)).map(|other| (other.value - value).abs());
    let doubt = neighbours.fold(0.0, f64::max);
    Some(DifferenceEstimate { value, error: error.max(doubt), noise })
}

/// Number of the smallest steps from which the noise is estimated.
const SMALLEST: usize = 4;

/// Values at distance h on both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StepValues {
    /// Distance.
    pub h: f64,
    /// Value at +h.
    pub ahead: f64,
    /// Value at −h.
    pub behind: f64,
}

/// Returns the jump of the slope at 0; `None` without a kink.
///
/// (f₊ − 2 f₀ + f₋)/h tends to zero with h for a smooth function and to the jump at a kink. `noise` is that of the values.
pub fn slope_discontinuity(here: f64, steps: &[StepValues], noise: f64) -> Option<f64> {
    let jumps: Vec<f64> = steps.iter().map(|s| (s.ahead - 2.0 * here + s.behind) / s.h).collect();
    // In the middle third of the steps the effect of curvature is small and noise does not dominate.
    let (from, to) = (steps.len() / 3, 2 * steps.len() / 3);
    let stays = |k: usize| {
        let rounding = 8.0 * f64::EPSILON * here.abs().max(steps[k].ahead.abs()) / steps[k].h;
        jumps[k].abs() > 0.8 * jumps[k - 1].abs() && jumps[k].abs() > rounding + 20.0 * noise / steps[k].h
    };
    (to > from.max(1) && (from.max(1)..to).all(stays)).then(|| jumps[to - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(f: impl Fn(f64) -> f64) -> Vec<StepValues> {
        let h = |k: i32| 0.1 * 0.5f64.powi(k);
        (0..12).map(|k| StepValues { h: h(k), ahead: f(h(k)), behind: f(-h(k)) }).collect()
    }

    #[test]
    fn the_error_estimate_holds_with_and_without_noise() {
        let smooth = |x: f64| (3.0 * x + 0.4).sin() * (x).exp();
        let exact = 3.0 * 0.4f64.cos() + 0.4f64.sin();
        for noise in [0.0, 1e-10, 1e-6] {
            // A deterministic noise: the last digits of a large number.
            let noisy = |x: f64| smooth(x) + noise * ((1e9 * (x + 0.1234)).sin());
            let slope = ridders(noisy(0.0), &steps(noisy)).unwrap();
            let error = (slope.value - exact).abs();
            assert!(error <= 5.0 * slope.error, "{noise}: {error:.1e} against {:.1e}", slope.error);
            assert!(slope.error < 1e-10_f64.max(1e4 * noise), "{noise}: {:.1e}", slope.error);
        }
    }

    #[test]
    fn a_kink_is_found_and_curvature_is_not_one() {
        let kinked = |x: f64| x.sin() + if x > 0.0 { 0.3 * x } else { 0.0 };
        assert!((slope_discontinuity(0.0, &steps(kinked), 1e-9).unwrap() - 0.3).abs() < 1e-2);
        let curved = |x: f64| x.sin() + 50.0 * x * x;
        assert_eq!(slope_discontinuity(0.0, &steps(curved), 1e-9), None);
        assert_eq!(slope_discontinuity(0.0, &steps(|x| x), 1e-9), None);
    }
}
