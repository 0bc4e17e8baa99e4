//! Proving sensitivities: every derivative against differences that know their own error.
//!
//! | file | what |
//! |---|---|
//! | `finding` | what is found out about a derivative |
//! | `ridders` | differences with an error estimate, and kinks |

mod finding;
mod ridders;

pub use finding::{Checked, Finding, Proof};
pub use ridders::Slope;

use super::{Analysis, Instant, Problem, Responses};
use crate::error::{Error, Result};
use finding::judge;
use rayon::prelude::*;
use ridders::{Step, jump, ridders};

/// Steps of the differences for each variable.
const STEPS: i32 = 11;

/// The first step in parts of a variable's size.
const FIRST: f64 = 1e-2;

impl Problem {
    /// Checks the sensitivities of the problem's analysis at the design `b` against differences: of every response at up to
    /// `points` of its time points, spread evenly.
    ///
    /// **Errors.** As [`check`].
    pub fn check_sensitivities(&self, b: &[f64], points: usize) -> Result<Proof> {
        Error::check_length("design", self.n(), b.len())?;
        Error::check_option("time points to check", "at least 1", points as f64, points > 0)?;
        let wanted = self.responses.iter().enumerate().flat_map(|(response, declared)| {
            let count = declared.grid.map_or(1, |grid| self.grids[grid].len());
            let taken = points.min(count);
            // At the ends a response is often given; the middles of equal parts are more telling.
            (0..taken).map(move |k| Instant { response, point: (2 * k + 1) * count / (2 * taken) })
        });
        let analysis = self.analysis.as_ref();
        check(analysis, &[("analysis", analysis)], b, &self.scales(), &wanted.collect::<Vec<_>>())
    }
}

/// Checks the sensitivities that several methods give at the design `b` against differences of `analysis`.
///
/// `methods` are analyses of the same responses with a name each, for instance the direct and the adjoint method;
/// `scales` are the sizes of the design variables in their units. For each variable 22 analyses are made, in parallel.
///
/// **Errors.** Those of the analysis at `b`, and of the methods; a design beside `b` that cannot be analysed only
/// costs accuracy.
pub fn check(
    analysis: &dyn Analysis,
    methods: &[(&str, &dyn Analysis)],
    b: &[f64],
    scales: &[f64],
    wanted: &[Instant],
) -> Result<Proof> {
    Error::check_length("sizes of the design variables", b.len(), scales.len())?;
    let here = analysis.analyze(b)?;
    let again = analysis.analyze(b)?;
    let mut claims = Vec::with_capacity(methods.len());
    for (_, method) in methods {
        claims.push(method.sensitivities(b, &here, wanted)?);
    }
    let around: Vec<Vec<(f64, [Responses; 2])>> =
        (0..b.len()).into_par_iter().map(|i| surroundings(analysis, b, i, scales[i])).collect();
    let mut derivatives = Vec::with_capacity(wanted.len() * b.len());
    for (row, &instant) in wanted.iter().enumerate() {
        let first = derivatives.len();
        let drift = (here.at(instant) - again.at(instant)).abs();
        for (i, around) in around.iter().enumerate() {
            let step = |(h, [ahead, behind]): &(f64, [Responses; 2])| Step {
                h: *h,
                ahead: ahead.at(instant),
                behind: behind.at(instant),
            };
            let steps: Vec<Step> = around.iter().map(step).collect();
            let difference = ridders(here.at(instant), &steps);
            let is_constant =
                !steps.is_empty() && steps.iter().all(|s| s.ahead == s.behind && s.ahead == here.at(instant));
            let jump = jump(here.at(instant), &steps, difference.map_or(0.0, |d| d.noise));
            let claimed = claims.iter().map(|claim| claim[(row, i)]).collect();
            let finding = Finding::Right;
            let suspects = vec![];
            derivatives.push(Checked {
                instant,
                variable: i,
                claimed,
                difference,
                jump,
                drift,
                is_constant,
                finding,
                suspects,
            });
        }
        judge(&mut derivatives[first..], scales);
    }
    let methods = methods.iter().map(|(name, _)| (*name).to_owned()).collect();
    Ok(Proof { methods, derivatives })
}

/// Responses on both sides of `b` along variable `i`, at falling distances; those that could be had.
fn surroundings(analysis: &dyn Analysis, b: &[f64], i: usize, scale: f64) -> Vec<(f64, [Responses; 2])> {
    let at = |by: f64| {
        let mut moved = b.to_vec();
        moved[i] += by;
        analysis.analyze(&moved).ok().map(|responses| Responses::new(responses.values))
    };
    let both = |k: i32| {
        let wished = FIRST * scale * 0.5f64.powi(k);
        let h = (b[i] + wished) - b[i]; // what the sum can hold
        Some((h, [at(h)?, at(-h)?]))
    };
    (0..STEPS).filter_map(both).filter(|(h, _)| *h > 0.0).collect()
}
