//! Derivatives by extrapolated differences with error estimates, and detection of kinks.
//!
//! For functions that cannot be written over [`Scalar`](crate::Scalar), and to check those that are.

/// A derivative with an estimate of its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DifferenceEstimate {
    /// The derivative.
    pub value: f64,
    /// Estimate of its error. The true error is rarely larger than this, and not larger than ten times this.
    pub error: f64,
    /// Estimated noise of the function values.
    pub noise: f64,
}

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

/// An entry of the tableau of extrapolations: a linear combination Σ w_j D(h_j) of central differences.
#[derive(Clone, Copy)]
struct TableauEntry {
    value: f64,
    /// Bound of its noise for values with noise 1: Σ |w_j| / h_j.
    noise: f64,
}

impl TableauEntry {
    /// Eliminates the next power of the expansion from two entries; `ratio` is that power of the ratio of their largest steps.
    fn extrapolated(self, above: Self, ratio: f64) -> Self {
        let value = self.value + (self.value - above.value) / (ratio - 1.0);
        Self { value, noise: (ratio * self.noise + above.noise) / (ratio - 1.0) }
    }
}

/// Number of the smallest steps from which the noise is estimated.
const SMALLEST: usize = 4;

/// Growth of the scatter from a step to the next larger one that indicates a jump: smooth functions have less.
const JUMP: f64 = 1024.0;

/// Growth of the scatter of smooth functions from a step to the next larger one, of the order h⁵; that of noise is smaller.
const SMOOTH: f64 = 32.0;

/// Estimates the derivative at 0 from the value at 0, `here`, and values at ±h for decreasing steps h.
///
/// Central differences are extrapolated to h = 0 in all ways that the steps allow. Large steps suffer from curvature, small
/// ones from the noise of the values. For each step, the entry that differs least from its neighbours is selected, and among all
/// steps the one with the least error. The error is the largest of
///
/// * the differences from the two entries from which it is computed,
/// * the differences from the best entries of the neighbouring steps, since two numbers may agree by chance,
/// * the distance from the best entry of each smaller step to within its error: the values may jump between the steps,
/// * the noise of the values, times the weights of the combination.
///
/// The noise is estimated from combinations of odd and even parts of the values at the smallest steps, of which smooth
/// functions contribute only the order h⁵. Rounding errors may be the same at all small steps and jump at a larger one: a
/// scatter that grows from one step to the next by more than any smooth function, and then no more, counts as noise, too.
///
/// Returns `None` with fewer than two steps.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::differences::{StepValues, ridders};
/// let steps: Vec<StepValues> = (0..10)
///     .map(|k| 0.1 * 0.5f64.powi(k))
///     .map(|h| StepValues { h, ahead: (1.0 + h).ln(), behind: (1.0 - h).ln() })
///     .collect();
/// let slope = ridders(0.0, &steps).unwrap();
/// assert!((slope.value - 1.0).abs() <= 10.0 * slope.error && slope.error < 1e-10);
/// ```
///
/// # Sources
///
/// Ridders, *Adv. Eng. Softw.* 4 (1982) 75–76, for the tableau.
pub fn ridders(here: f64, steps: &[StepValues]) -> Option<DifferenceEstimate> {
    let [odd, even] = noise(here, steps);
    let central =
        steps.iter().map(|s| (s.h, TableauEntry { value: (s.ahead - s.behind) / (2.0 * s.h), noise: 1.0 / s.h }));
    extrapolated(&central.collect::<Vec<_>>(), 2, odd.max(even))
}

/// Estimates the slopes on the lower and on the upper side of 0, from the value at 0, `here`, and values at ±h for decreasing steps h.
///
/// They differ at a kink. The estimates are made as those of [`ridders`], from the differences (f(±h) − f(0))/±h, whose expansion has all
/// powers of h: they are less accurate. `None` with fewer than two steps.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::differences::{StepValues, one_sided};
/// let steps: Vec<StepValues> = (0..16)
///     .map(|k| 0.1 * 0.5f64.powi(k))
///     .map(|h| StepValues { h, ahead: 3.0 * h, behind: h.exp() - 1.0 })
///     .collect();
/// let [behind, ahead] = one_sided(0.0, &steps).map(|slope| slope.unwrap());
/// assert!((behind.value + 1.0).abs() <= behind.error && behind.error < 1e-9);
/// assert!((ahead.value - 3.0).abs() <= ahead.error && ahead.error < 1e-9);
/// ```
pub fn one_sided(here: f64, steps: &[StepValues]) -> [Option<DifferenceEstimate>; 2] {
    let side = |sign: f64, of: fn(&StepValues) -> f64| {
        let difference = |s: &StepValues| (s.h, TableauEntry { value: sign * (of(s) - here) / s.h, noise: 2.0 / s.h });
        let differences: Vec<(f64, TableauEntry)> = steps.iter().map(difference).collect();
        let size = steps.iter().fold(here.abs(), |size, s| size.max(of(s).abs()));
        let smallest = differences.windows(3).rev().take(SMALLEST);
        let scatter = smallest.map(|s| scatter([0, 1, 2].map(|k| s[k].1.value), [0, 1, 2].map(|k| s[k].0), 1) * s[2].0);
        extrapolated(&differences, 1, scatter.fold(f64::EPSILON * size, f64::max))
    };
    [side(-1.0, |s| s.behind), side(1.0, |s| s.ahead)]
}

/// Extrapolates differences with decreasing steps h, whose expansion has multiples of the power `order` of h, to h = 0.
fn extrapolated(differences: &[(f64, TableauEntry)], order: i32, noise: f64) -> Option<DifferenceEstimate> {
    let mut rows: Vec<DifferenceEstimate> = Vec::new();
    let mut above: Vec<TableauEntry> = Vec::new();
    for (row, &(h, first)) in differences.iter().enumerate() {
        let mut current = vec![first];
        let mut best = DifferenceEstimate { value: first.value, error: f64::INFINITY, noise };
        for column in 1..=row {
            let (left, above) = (current[column - 1], above[column - 1]);
            let entry = left.extrapolated(above, (differences[row - column].0 / h).powi(order));
            let neighbours = (entry.value - left.value).abs().max((entry.value - above.value).abs());
            let error = neighbours.max(noise * entry.noise);
            if error < best.error {
                best = DifferenceEstimate { value: entry.value, error, noise };
            }
            current.push(entry);
        }
        rows.push(best);
        above = current;
    }
    let of_row = |row: usize| {
        let neighbours = [row - 1, row + 1].into_iter().filter(|&other| other > 0).filter_map(|other| rows.get(other));
        let apart = |other: &DifferenceEstimate| (other.value - rows[row].value).abs();
        let smaller = rows[row + 1..].iter().map(|other| apart(other) - other.error);
        let doubt = neighbours.map(apart).chain(smaller).fold(0.0, f64::max);
        DifferenceEstimate { error: rows[row].error.max(doubt), ..rows[row] }
    };
    (1..rows.len()).map(of_row).min_by(|a, b| a.error.total_cmp(&b.error))
}

/// Difference of two numbers in which the lowest power of h has been eliminated from `values` at the decreasing steps `h`; `order` is this power.
fn scatter(values: [f64; 3], h: [f64; 3], order: i32) -> f64 {
    let eliminate = |coarse: f64, fine: f64, ratio: f64| (ratio * fine - coarse) / (ratio - 1.0);
    let ratio = |k: usize| (h[k] / h[k + 1]).powi(order);
    let (a, b) = (eliminate(values[0], values[1], ratio(0)), eliminate(values[1], values[2], ratio(1)));
    (a - b).abs()
}

/// Estimates of the largest noise of the values from their odd and from their even parts, at least their rounding.
///
/// The even part of a function with a kink is not smooth.
fn noise(here: f64, steps: &[StepValues]) -> [f64; 2] {
    let size = steps.iter().map(|s| s.ahead.abs().max(s.behind.abs())).fold(here.abs(), f64::max);
    let window = |s: &[StepValues]| {
        let h = [s[0].h, s[1].h, s[2].h];
        let odd = scatter([0, 1, 2].map(|k| (s[k].ahead - s[k].behind) / (2.0 * h[k])), h, 2) * h[2];
        let second = |k: usize| (s[k].ahead - 2.0 * here + s[k].behind) / (2.0 * h[k] * h[k]);
        let even = scatter([0, 1, 2].map(second), h, 2) * h[2] * h[2];
        [odd, even]
    };
    let scattered: Vec<[f64; 2]> = steps.windows(3).rev().map(window).collect();
    [0, 1].map(|part| {
        let (mut noise, mut largest) = (f64::EPSILON * size, f64::EPSILON * size);
        for (k, scatter) in scattered.iter().map(|parts| parts[part]).enumerate() {
            let is_jump =
                || scatter > JUMP * largest && scattered.get(k + 1).is_some_and(|s| s[part] < SMOOTH * scatter);
            if k < SMALLEST || is_jump() {
                noise = noise.max(scatter);
            }
            largest = largest.max(scatter);
        }
        noise
    })
}

/// Relative error of values that have no noise: that of the time of an event, above the rounding error of a number.
const ROUNDING: f64 = 8192.0 * f64::EPSILON;

/// Returns the jump of the slope at 0; `None` without a kink.
///
/// (f₊ − 2 f₀ + f₋)/h tends to zero with h for a smooth function and to the jump at a kink.
pub fn slope_discontinuity(here: f64, steps: &[StepValues]) -> Option<f64> {
    let [noise, _] = noise(here, steps);
    let jumps: Vec<f64> = steps.iter().map(|s| (s.ahead - 2.0 * here + s.behind) / s.h).collect();
    // In the middle third of the steps the effect of curvature is small and noise does not dominate.
    let (from, to) = (steps.len() / 3, 2 * steps.len() / 3);
    let stays = |k: usize| {
        let rounding = ROUNDING * here.abs().max(steps[k].ahead.abs()) / steps[k].h;
        jumps[k].abs() > 0.8 * jumps[k - 1].abs() && jumps[k].abs() > rounding + 20.0 * noise / steps[k].h
    };
    (to > from.max(1) && (from.max(1)..to).all(stays)).then(|| jumps[to - 1])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn steps(count: i32, f: impl Fn(f64) -> f64) -> Vec<StepValues> {
        let h = |k: i32| 0.1 * 0.5f64.powi(k);
        (0..count).map(|k| StepValues { h: h(k), ahead: f(h(k)), behind: f(-h(k)) }).collect()
    }

    /// A number between −1 and 1 that depends on all digits of x.
    fn hash(x: f64, seed: u64) -> f64 {
        let mut z = x.to_bits() ^ seed.wrapping_mul(0x9e37_79b9_7f4a_7c15);
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    /// 12 000 derivatives of smooth functions with and without noise, slow and fast against the steps, near and far from a
    /// pole: the true error is never larger than ten times the estimate, and the estimate is not much too large.
    #[test]
    fn the_error_estimate_bounds_the_error() {
        type Family = (fn(f64, f64) -> f64, fn(f64) -> f64);
        let families: [Family; 4] = [
            (|x, w| (w * x + 0.4).sin() * x.exp(), |w| w * 0.4f64.cos() + 0.4f64.sin()),
            (|x, w| 1.0 / (1.0 + w * x * 0.2), |w| -0.2 * w),
            (|x, w| (1.0 + (w * x).powi(2)).sqrt() + 0.3 * x, |_| 0.3),
            (|x, w| (w * x).tanh() + 100.0, |w| w),
        ];
        let (mut worst, mut pessimistic, mut all) = (0.0f64, 0, 0);
        for (family, (f, slope)) in families.into_iter().enumerate() {
            for seed in 0..500 {
                let w = 10f64.powf(1.2 * hash(family as f64, seed));
                for (count, noise) in [8, 11].into_iter().flat_map(|n| [(n, 0.0), (n, 1e-12), (n, 1e-7)]) {
                    let noisy = |x: f64| f(x, w) + noise * hash(x, seed + 1);
                    let found = ridders(noisy(0.0), &steps(count, noisy)).unwrap();
                    let error = (found.value - slope(w)).abs();
                    worst = worst.max(error / found.error);
                    assert!(error <= 10.0 * found.error, "{family} {seed} {noise} {w}: {error:.1e}, {found:?}");
                    all += 1;
                    pessimistic += usize::from(found.error > (1e-7 + 1e3 * noise) * w.max(1.0));
                }
            }
        }
        println!("{all} derivatives: largest error {worst:.1} estimates, {pessimistic} estimates are pessimistic");
        assert!(pessimistic < all / 10, "{pessimistic} of {all}");
    }

    /// Rounded positions of a stiff truss: the values jump by 1e-7 at distances larger than the smallest steps, between which they
    /// are smooth, with another slope.
    #[test]
    fn jumps_beyond_the_smallest_steps_are_noise() {
        for place in 0..40 {
            let (jump, distance) = (1e-7, 3e-3);
            let staircase = |x: f64| x + jump * (x / distance + place as f64 / 40.0).floor();
            let found = ridders(staircase(0.0), &steps(11, staircase)).unwrap();
            let error = (found.value - (1.0 + jump / distance)).abs();
            assert!(error <= 10.0 * found.error, "{place}: {error:.1e}, {found:?}");
        }
    }

    /// A second derivative of a motion with a contact: the values jump between steps, on both sides of which they are smooth.
    #[test]
    fn the_error_covers_the_slope_on_this_side_of_a_jump() {
        let values = [
            [-0.2497128944620951, 0.2309612541077009],
            [0.21036399906548567, 0.3335423450667428],
            [0.36856499576655316, 0.48965332779617404],
            [1.8442925900966842, 0.6738843838041996],
            [1.4565883328511642, 0.8349766893127313],
            [1.2535064410922547, 0.9454767058858765],
            [1.1640793440961505, 1.0105806168535831],
            [1.122600051617367, 1.045920016441129],
            [1.102656410777114, 1.0643252059441217],
        ];
        let step = |(k, [ahead, behind]): (i32, [f64; 2])| StepValues { h: 1e-2 * 0.5f64.powi(k), ahead, behind };
        let steps: Vec<StepValues> = (0..).zip(values).map(step).collect();
        let found = ridders(1.0832342476207693, &steps).unwrap();
        assert!((found.value - 490.60165).abs() <= 10.0 * found.error, "{found:?}");
    }

    /// Smooth functions and kinks at 0, with and without noise: the error of the slope on each side is within ten estimates.
    #[test]
    fn slopes_on_both_sides_are_within_their_estimates() {
        for (jump, noise) in [0.0, 0.3, 5.0].into_iter().flat_map(|jump| [(jump, 0.0), (jump, 1e-9)]) {
            for seed in 0..100 {
                let w = 10f64.powf(hash(0.5, seed));
                let f = |x: f64| (w * x + 0.4).sin() * x.exp() + jump * x.max(0.0) + noise * hash(x, seed);
                let slope = w * 0.4f64.cos() + 0.4f64.sin();
                for (found, slope) in one_sided(f(0.0), &steps(11, f)).into_iter().zip([slope, slope + jump]) {
                    let found = found.unwrap();
                    let error = (found.value - slope).abs();
                    assert!(error <= 10.0 * found.error, "{jump} {noise} {w}: {error:.1e}, {found:?}");
                    assert!(found.error < 1e-5 * (slope + w.powi(3)) + 1e4 * noise, "{jump} {noise} {w}: {found:?}");
                }
            }
        }
    }

    #[test]
    fn a_kink_is_found_and_curvature_is_not_one() {
        let kinked = |x: f64| x.sin() + if x > 0.0 { 0.3 * x } else { 0.0 };
        assert!((slope_discontinuity(0.0, &steps(12, kinked)).unwrap() - 0.3).abs() < 1e-2);
        let curved = |x: f64| x.sin() + 50.0 * x * x;
        assert_eq!(slope_discontinuity(0.0, &steps(12, curved)), None);
        assert_eq!(slope_discontinuity(0.0, &steps(12, |x| x)), None);
    }
}
