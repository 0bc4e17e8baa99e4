//! Responses on both sides of a design.

use super::ridders::Step;
use crate::problem::{Analysis, ResponseAt, Responses};
use rayon::prelude::*;

/// Steps of extrapolated differences for each variable.
const STEPS: usize = 11;

/// The first step in parts of a variable's size.
const FIRST: f64 = 1e-2;

/// Responses on both sides of a design along one variable, at falling distances.
pub struct Surroundings(Vec<(f64, [Responses; 2])>);

impl Surroundings {
    /// Around `b` along every variable; `scales` are their sizes. The analyses run in parallel; designs that cannot be analysed
    /// are left out.
    pub fn along_all(analysis: &dyn Analysis, b: &[f64], scales: &[f64]) -> Vec<Self> {
        let at = |i: usize, by: f64| {
            let mut moved = b.to_vec();
            moved[i] += by;
            analysis.analyze(&moved).ok().map(|responses| Responses::new(responses.values))
        };
        let both = |task: usize| {
            let (i, k) = (task / STEPS, task % STEPS);
            let wished = FIRST * scales[i] * 0.5f64.powi(k as i32);
            let h = (b[i] + wished) - b[i]; // what the sum can hold
            if h > 0.0 { Some((h, [at(i, h)?, at(i, -h)?])) } else { None }
        };
        let mut all: Vec<Option<_>> = (0..STEPS * b.len()).into_par_iter().map(both).collect();
        all.chunks_mut(STEPS).map(|around| Self(around.iter_mut().filter_map(Option::take).collect())).collect()
    }

    /// The values of one response.
    pub fn steps(&self, instant: ResponseAt) -> Vec<Step> {
        let step = |(h, [ahead, behind]): &(f64, [Responses; 2])| Step {
            h: *h,
            ahead: ahead.at(instant),
            behind: behind.at(instant),
        };
        self.0.iter().map(step).collect()
    }
}
