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
    close: LazyCell<Option<Vec<CloseSlopes>>, F>,
}

/// Slopes of a component by close designs.
pub struct CloseSlopes {
    estimate: DifferenceEstimate,
    /// The least and the greatest of the slopes on the two sides, extrapolated from the two shortest steps.
    sides: [f64; 2],
}

/// Derivatives at 0 of all components of `f` by steps from `h` on; `None` if they cannot be computed.
pub fn differences(
    h: f64,
    f: impl Fn(f64) -> Option<Vec<f64>>,
) -> Option<Differences<impl FnOnce() -> Option<Vec<CloseSlopes>>>> {
    let here = f(0.0)?;
    let wide = extrapolated(&here, h, &f, ridders)?;
    Some(Differences { wide, close: LazyCell::new(move || extrapolated(&here, CLOSE * h, f, close_slopes)) })
}

impl<F: FnOnce() -> Option<Vec<CloseSlopes>>> Differences<F> {
    /// Returns whether a derivative of component `i` is wrong: it deviates from the differences by more than their error and `tolerance`, from
    /// those of closer designs as well, and is not between the slopes on the two sides of these. Where differences have an error above
    /// `accuracy`, the values are noisy, and the derivative within that error is not known.
    pub fn contradict(&self, i: usize, derivative: f64, tolerance: f64, accuracy: f64) -> bool {
        let is_off = |slope: &DifferenceEstimate| {
            let margin = if slope.error < accuracy { MARGIN } else { 1.0 };
            !((derivative - slope.value).abs() <= margin * slope.error + tolerance)
        };
        let is_off_close = |close: &CloseSlopes| {
            let [least, greatest] = close.sides;
            is_off(&close.estimate) && !(least - tolerance <= derivative && derivative <= greatest + tolerance)
        };
        is_off(&self.wide[i]) && self.close.as_ref().is_none_or(|close| is_off_close(&close[i]))
    }
}

/// Estimates, by `estimate`, for all components of `f` with the value `here` at 0, from values at ±h, ±h/2, …; `None` if fewer than
/// five steps can be computed.
fn extrapolated<T>(
    here: &[f64],
    h: f64,
    f: impl Fn(f64) -> Option<Vec<f64>>,
    estimate: impl Fn(f64, &[StepValues]) -> Option<T>,
) -> Option<Vec<T>> {
    let steps = (0..STEPS).map(|k| h * 0.5f64.powi(k));
    let pairs: Vec<(f64, Vec<f64>, Vec<f64>)> = steps.filter_map(|h| Some((h, f(h)?, f(-h)?))).collect();
    let component = |i: usize| {
        let values =
            |(h, ahead, behind): &(f64, Vec<f64>, Vec<f64>)| StepValues { h: *h, ahead: ahead[i], behind: behind[i] };
        estimate(here[i], &pairs.iter().map(values).collect::<Vec<_>>())
    };
    if pairs.len() < FEWEST { None } else { (0..here.len()).map(component).collect() }
}

/// The most accurate of the estimates without some of the largest steps, since a jump between two steps makes larger ones useless, and the
/// slopes on both sides.
fn close_slopes(here: f64, steps: &[StepValues]) -> Option<CloseSlopes> {
    let estimates = (0..=steps.len() - FEWEST).filter_map(|from| ridders(here, &steps[from..]));
    let estimate = estimates.min_by(|a, b| a.error.total_cmp(&b.error))?;
    let slopes = |step: &StepValues| [(step.ahead - here) / step.h, (here - step.behind) / step.h];
    let [longer, shorter] = steps.last_chunk()?;
    let [ahead, behind] = [0, 1].map(|side| 2.0 * slopes(shorter)[side] - slopes(longer)[side]);
    Some(CloseSlopes { estimate, sides: [ahead.min(behind), ahead.max(behind)] })
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
    // At a kink, both slopes are right, and means of them, which semi-analytical derivatives have.
    let kink = |x: f64| Some(vec![if x > 0.0 { 2.0 * x } else { 2.01 * x } + x * x]);
    let found = differences(2e-2, kink).unwrap();
    for (slope, is_wrong) in [(2.0, false), (2.005, false), (2.01, false), (1.999, true), (2.011, true)] {
        assert_eq!(found.contradict(0, slope, 1e-6, 1e-4), is_wrong, "{slope}");
    }
}
