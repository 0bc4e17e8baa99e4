//! Extrapolated differences with error estimates, of all components of a function.

use autodiff::differences::{DifferenceEstimate, StepValues, ridders};
use std::cell::LazyCell;

/// Number of steps, each half as long as the one before.
const STEPS: i32 = 9;

/// Smallest number of steps.
const FEWEST: usize = 5;

/// Largest error of differences, in estimates of it.
const MARGIN: f64 = 20.0;

/// Distance of close designs, as a fraction of that of the others.
const CLOSE: f64 = 1e-3;

/// Derivatives of all components by differences, and by those of closer designs where these are asked for.
///
/// Numerical motions jump by their error where an event passes a time of the grid. Differences across many such jumps have the slope
/// of the exact motion, and an error estimate that is too small for that of the discrete motion, which closer designs have.
pub struct Differences<F> {
    pub wide: Vec<DifferenceEstimate>,
    close: LazyCell<Option<Vec<DifferenceEstimate>>, F>,
}

/// Derivatives at 0 of all components of `f` by steps from `h` on; `None` if they cannot be computed.
pub fn differences(
    h: f64,
    f: impl Fn(f64) -> Option<Vec<f64>>,
) -> Option<Differences<impl FnOnce() -> Option<Vec<DifferenceEstimate>>>> {
    let here = f(0.0)?;
    let wide = extrapolated(&here, h, &f, ridders)?;
    Some(Differences { wide, close: LazyCell::new(move || extrapolated(&here, CLOSE * h, f, after_jumps)) })
}

impl<F: FnOnce() -> Option<Vec<DifferenceEstimate>>> Differences<F> {
    /// Returns whether a derivative of component `i` is wrong: it deviates from the differences by more than their error and `tolerance`, and
    /// from those of closer designs as well. Where these have an error above `accuracy`, the values are noisy, and the derivative
    /// within that error is not known.
    pub fn contradict(&self, i: usize, derivative: f64, tolerance: f64, accuracy: f64) -> bool {
        let is_off = |slope: &DifferenceEstimate| {
            let margin = if slope.error < accuracy { MARGIN } else { 1.0 };
            !((derivative - slope.value).abs() <= margin * slope.error + tolerance)
        };
        is_off(&self.wide[i]) && self.close.as_ref().is_none_or(|close| is_off(&close[i]))
    }
}

/// Estimates, by `estimate`, for all components of `f` with the value `here` at 0, from values at ±h, ±h/2, …; `None` if fewer than
/// five steps can be computed.
fn extrapolated(
    here: &[f64],
    h: f64,
    f: impl Fn(f64) -> Option<Vec<f64>>,
    estimate: impl Fn(f64, &[StepValues]) -> Option<DifferenceEstimate>,
) -> Option<Vec<DifferenceEstimate>> {
    let steps = (0..STEPS).map(|k| h * 0.5f64.powi(k));
    let pairs: Vec<(f64, Vec<f64>, Vec<f64>)> = steps.filter_map(|h| Some((h, f(h)?, f(-h)?))).collect();
    let component = |i: usize| {
        let values =
            |(h, ahead, behind): &(f64, Vec<f64>, Vec<f64>)| StepValues { h: *h, ahead: ahead[i], behind: behind[i] };
        estimate(here[i], &pairs.iter().map(values).collect::<Vec<_>>())
    };
    if pairs.len() < FEWEST { None } else { (0..here.len()).map(component).collect() }
}

/// The most accurate of the estimates without some of the largest steps: a jump between two steps makes larger ones useless.
fn after_jumps(here: f64, steps: &[StepValues]) -> Option<DifferenceEstimate> {
    let estimates = (0..=steps.len() - FEWEST).filter_map(|from| ridders(here, &steps[from..]));
    estimates.min_by(|a, b| a.error.total_cmp(&b.error))
}

/// A smooth function, and one that jumps by its discretization error between close designs: the slope of one piece is right, and no other.
#[test]
fn a_slope_is_wrong_if_close_designs_contradict_it() {
    let smooth = |x: f64| Some(vec![(2.0 * x).sin() + 3.0 * x * x]);
    let found = differences(2e-2, smooth).unwrap();
    for (slope, is_wrong) in [(2.0, false), (2.0 + 1e-4, true), (0.0, true), (f64::NAN, true)] {
        assert_eq!(found.contradict(0, slope, 1e-6, 1e-4), is_wrong, "{slope}");
    }
    // The slope 2 has the part 2e-3 from jumps, the nearest of which is 4e-5 away.
    let pieces = |x: f64| Some(vec![2.0 * x - 2e-3 * x + 2e-7 * ((x + 6e-5) / 1e-4).floor()]);
    let found = differences(2e-2, pieces).unwrap();
    assert!(!found.contradict(0, 2.0 - 2e-3, 1e-6, 1e-4));
    assert!(found.contradict(0, 2.0 - 4e-3, 1e-6, 1e-4) && found.contradict(0, 1.9, 1e-6, 1e-4));
}
