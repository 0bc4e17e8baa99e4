//! Responses at designs on both sides of a design, as samples for finite differences.

use crate::problem::{ResponseAt, Responses};
use autodiff::differences::StepValues;
use error::Result;
use std::ops::Range;

/// Numbers of the steps of extrapolated differences: each step is half of the one before it.
const STEPS: Range<usize> = 0..11;

/// Numbers of narrower steps, down to a ten-millionth of a variable's size.
const NARROW_STEPS: Range<usize> = 8..18;

/// Step number 0 as a fraction of a variable's size.
const FIRST: f64 = 1e-2;

/// Responses on both sides of a design along one variable, at falling distances.
pub struct DifferenceSamples(Vec<(f64, [Responses; 2])>);

impl DifferenceSamples {
    /// Analyses designs around `b` along every variable by `analyze`; `scales` are the sizes of the variables.
    ///
    /// Designs that cannot be analysed are omitted.
    pub fn along_all(
        analyze: impl FnOnce(&[Vec<f64>]) -> Vec<Result<Responses>>,
        b: &[f64],
        scales: &[f64],
    ) -> Vec<Self> {
        Self::along(analyze, b, scales, |_| STEPS)
    }

    /// Analyses designs closer to `b` along the variables for which `includes` is true, and has no samples along others.
    pub fn close_to(
        analyze: impl FnOnce(&[Vec<f64>]) -> Vec<Result<Responses>>,
        b: &[f64],
        scales: &[f64],
        includes: impl Fn(usize) -> bool,
    ) -> Vec<Self> {
        Self::along(analyze, b, scales, |i| if includes(i) { NARROW_STEPS } else { 0..0 })
    }

    /// Analyses designs around `b` at the `steps` of each variable.
    fn along(
        analyze: impl FnOnce(&[Vec<f64>]) -> Vec<Result<Responses>>,
        b: &[f64],
        scales: &[f64],
        steps: impl Fn(usize) -> Range<usize>,
    ) -> Vec<Self> {
        let distance = |i: usize, k: usize| {
            let wanted = FIRST * scales[i] * 0.5f64.powi(k as i32);
            (b[i] + wanted) - b[i] // the distance that the sum represents
        };
        let tasks = (0..b.len()).flat_map(|i| steps(i).map(move |k| (i, k)));
        let steps: Vec<(usize, f64)> = tasks.map(|(i, k)| (i, distance(i, k))).filter(|(_, h)| *h > 0.0).collect();
        let moved = |i: usize, by: f64| {
            let mut design = b.to_vec();
            design[i] += by;
            design
        };
        let designs: Vec<Vec<f64>> = steps.iter().flat_map(|&(i, h)| [moved(i, h), moved(i, -h)]).collect();
        let mut all: Vec<Self> = b.iter().map(|_| Self(vec![])).collect();
        let mut analysed = analyze(&designs).into_iter();
        for (i, h) in steps {
            if let (Some(Ok(ahead)), Some(Ok(behind))) = (analysed.next(), analysed.next()) {
                all[i].0.push((h, [ahead, behind]));
            }
        }
        all
    }

    /// The smallest distance, if there are samples.
    pub fn smallest(&self) -> Option<f64> {
        self.0.iter().map(|(h, _)| *h).reduce(f64::min)
    }

    /// The values of one response at one time point.
    pub fn steps(&self, at: ResponseAt) -> Vec<StepValues> {
        let step = |(h, [ahead, behind]): &(f64, [Responses; 2])| StepValues {
            h: *h,
            ahead: ahead.at(at),
            behind: behind.at(at),
        };
        self.0.iter().map(step).collect()
    }
}
