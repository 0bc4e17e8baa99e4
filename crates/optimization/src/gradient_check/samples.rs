//! Responses at designs on both sides of a design, as samples for finite differences.

use crate::problem::{Analysis, ResponseAt, Responses};
use autodiff::differences::StepValues;
use rayon::prelude::*;

/// Steps of extrapolated differences for each variable.
const STEPS: usize = 11;

/// The first step as a fraction of a variable's size.
const FIRST: f64 = 1e-2;

/// Responses on both sides of a design along one variable, at falling distances.
pub struct DifferenceSamples(Vec<(f64, [Responses; 2])>);

impl DifferenceSamples {
    /// Analyses designs around `b` along every variable, in parallel; `scales` are the sizes of the variables.
    ///
    /// Designs that cannot be analysed are omitted.
    pub fn along_all(analysis: &dyn Analysis, b: &[f64], scales: &[f64]) -> Vec<Self> {
        let moved = |i: usize, by: f64| {
            let mut design = b.to_vec();
            design[i] += by;
            analysis.analyze(&design).ok().map(|responses| Responses::new(responses.values))
        };
        let both = |task: usize| {
            let (i, k) = (task / STEPS, task % STEPS);
            let wanted = FIRST * scales[i] * 0.5f64.powi(k as i32);
            let h = (b[i] + wanted) - b[i]; // the distance that the sum represents
            if h > 0.0 { Some((h, [moved(i, h)?, moved(i, -h)?])) } else { None }
        };
        let mut all: Vec<Option<_>> = (0..STEPS * b.len()).into_par_iter().map(both).collect();
        all.chunks_mut(STEPS).map(|around| Self(around.iter_mut().filter_map(Option::take).collect())).collect()
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
