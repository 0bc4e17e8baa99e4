//! Extrapolated differences with error estimates, of all components of a function.

use autodiff::differences::{DifferenceEstimate, StepValues, ridders};

/// Number of steps, each half as long as the one before.
const STEPS: usize = 9;

/// Derivatives at 0 of all components of `f`, from values at ±h, ±h/2, …; `None` if fewer than five steps can be computed.
pub fn differences(h: f64, f: impl Fn(f64) -> Option<Vec<f64>>) -> Option<Vec<DifferenceEstimate>> {
    let here = f(0.0)?;
    let pairs: Vec<(f64, Vec<f64>, Vec<f64>)> = (0..STEPS)
        .filter_map(|k| {
            let h = h * 0.5f64.powi(k as i32);
            Some((h, f(h)?, f(-h)?))
        })
        .collect();
    if pairs.len() < 5 {
        return None;
    }
    let component = |i: usize| {
        let values =
            |(h, ahead, behind): &(f64, Vec<f64>, Vec<f64>)| StepValues { h: *h, ahead: ahead[i], behind: behind[i] };
        ridders(here[i], &pairs.iter().map(values).collect::<Vec<_>>())
    };
    (0..here.len()).map(component).collect()
}
