//! Responses at designs on both sides of a design, as samples for finite differences.

use crate::problem::{ResponseAt, Responses};
use autodiff::differences::StepValues;
use error::Result;
use std::ops::Range;

/// Indices of the steps of extrapolated differences: each step is half of the one before it.
const STEPS: Range<usize> = 0..11;

/// Indices of narrower steps, down to a ten-millionth of a variable's size.
const NARROW_STEPS: Range<usize> = 8..18;

/// Step number 0 as a fraction of a variable's size.
const FIRST: f64 = 1e-2;

/// The first and longest step along a variable; each further one is half of the one before it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstStep {
    /// Distance in the unit of the variable; negative for the lower side.
    pub h: f64,
    /// True if the designs at h and 2h are analysed instead of those at ±h.
    pub is_one_sided: bool,
}

impl FirstStep {
    /// The first step along a variable of this size, on both sides.
    pub fn of_size(size: f64) -> Self {
        Self { h: FIRST * size, is_one_sided: false }
    }
}

/// Responses near a design along one variable, at decreasing distances, on both sides or on one.
pub struct DifferenceSamples {
    is_one_sided: bool,
    /// Distances h, and the responses at ±h or at h and 2h.
    samples: Vec<(f64, [Responses; 2])>,
}

impl DifferenceSamples {
    /// Analyses designs around `b` along every variable by `analyze`, from the first step of each.
    ///
    /// Designs that cannot be analysed are omitted.
    pub fn along_all(
        analyze: impl FnOnce(&[Vec<f64>]) -> Vec<Result<Responses>>,
        b: &[f64],
        first: &[FirstStep],
    ) -> Vec<Self> {
        Self::along(analyze, b, first, |_| STEPS)
    }

    /// Analyses designs closer to `b` along the variables for which `includes` is true, and has no samples along others.
    pub fn close_to(
        analyze: impl FnOnce(&[Vec<f64>]) -> Vec<Result<Responses>>,
        b: &[f64],
        first: &[FirstStep],
        includes: impl Fn(usize) -> bool,
    ) -> Vec<Self> {
        Self::along(analyze, b, first, |i| if includes(i) { NARROW_STEPS } else { 0..0 })
    }

    /// Analyses designs around `b` at the `steps` of each variable.
    fn along(
        analyze: impl FnOnce(&[Vec<f64>]) -> Vec<Result<Responses>>,
        b: &[f64],
        first: &[FirstStep],
        steps: impl Fn(usize) -> Range<usize>,
    ) -> Vec<Self> {
        let distance = |i: usize, k: usize| {
            let wanted = first[i].h * 0.5f64.powi(k as i32);
            (b[i] + wanted) - b[i] // the distance that the sum represents
        };
        let tasks = (0..b.len()).flat_map(|i| steps(i).map(move |k| (i, k)));
        let steps: Vec<(usize, f64)> = tasks.map(|(i, k)| (i, distance(i, k))).filter(|(_, h)| *h != 0.0).collect();
        let moved = |i: usize, by: f64| {
            let mut design = b.to_vec();
            design[i] += by;
            design
        };
        let second = |i: usize, h: f64| if first[i].is_one_sided { 2.0 * h } else { -h };
        let designs: Vec<Vec<f64>> = steps.iter().flat_map(|&(i, h)| [moved(i, h), moved(i, second(i, h))]).collect();
        let empty = |step: &FirstStep| Self { is_one_sided: step.is_one_sided, samples: vec![] };
        let mut all: Vec<Self> = first.iter().map(empty).collect();
        let mut analysed = analyze(&designs).into_iter();
        for (i, h) in steps {
            if let (Some(Ok(at)), Some(Ok(second))) = (analysed.next(), analysed.next()) {
                all[i].samples.push((h, [at, second]));
            }
        }
        all
    }

    /// The smallest distance, if there are samples.
    pub fn smallest(&self) -> Option<f64> {
        self.samples.iter().map(|(h, _)| h.abs()).reduce(f64::min)
    }

    /// The values of one response at one time point, of which `here` is the value at the design.
    ///
    /// On one side, the value at −h is that of the parabola through the other three: the central difference is then that of the
    /// parabola at the design, and its error has the order h², too.
    pub fn steps(&self, at: ResponseAt, here: f64) -> Vec<StepValues> {
        let step = |(h, [first, second]): &(f64, [Responses; 2])| {
            let (first, second) = (first.at(at), second.at(at));
            let opposite = if self.is_one_sided { 3.0 * (here - first) + second } else { second };
            let (ahead, behind) = if *h > 0.0 { (first, opposite) } else { (opposite, first) };
            StepValues { h: h.abs(), ahead, behind }
        };
        self.samples.iter().map(step).collect()
    }
}
