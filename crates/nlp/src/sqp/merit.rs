//! The merit function f + ρ v, v the largest violation of a row, and the search along a step.

use crate::{Gradients, Program, Values};
use error::Result;

/// Share of the predicted decrease that a step must bring (Armijo).
const SHARE: f64 = 1e-4;
/// Shortenings of a step at most.
const CUTS: usize = 40;

/// The largest violation of a row.
pub(super) fn violation(program: &dyn Program, rows: &[f64]) -> f64 {
    rows.iter().enumerate().fold(0.0, |v, (i, &g)| v.max(if program.is_equality(i) { g.abs() } else { g }))
}

/// The merit function with its value and predicted decrease at the start of a step.
pub(super) struct Merit<'a> {
    pub program: &'a dyn Program,
    pub penalty: f64,
    pub here: f64,
    /// Predicted change over a full step, negative.
    pub slope: f64,
    /// Rounding of the merit function.
    pub noise: f64,
}

/// A point that was accepted.
pub(super) struct Accepted {
    pub x: Vec<f64>,
    pub gradients: Gradients,
    pub fraction: f64,
}

/// Evaluation that may fail; counted by the caller.
pub(super) struct Calls<'a> {
    pub values: &'a mut dyn FnMut(&[f64]) -> Result<Values>,
    pub gradients: &'a mut dyn FnMut(&[f64]) -> Result<Gradients>,
}

impl Merit<'_> {
    /// The merit of `values`, infinite where anything is not finite.
    fn of(&self, values: &Values) -> f64 {
        let merit = values.objective + self.penalty * violation(self.program, &values.rows);
        let finite = merit.is_finite() && values.rows.iter().all(|g| !g.is_nan());
        if finite { merit } else { f64::INFINITY }
    }

    /// A point on the way from `x` to `full` that lowers the merit enough, or the corrected point of `second_order`
    /// where the full step fails because the rows curve away (Maratos). `None` if there is none.
    pub fn search(
        &self,
        x: &[f64],
        full: &[f64],
        calls: &mut Calls<'_>,
        second_order: impl Fn(&Values) -> Option<Vec<f64>>,
    ) -> Option<Accepted> {
        let mut fraction = 1.0;
        for _ in 0..CUTS {
            let y = between(x, full, fraction);
            let trial = (calls.values)(&y).ok();
            let merit = trial.as_ref().map_or(f64::INFINITY, |v| self.of(v));
            if let Some(accepted) = self.accept(y, merit, fraction, calls) {
                return Some(accepted);
            }
            let corrected =
                if fraction == 1.0 && merit.is_finite() { trial.as_ref().and_then(&second_order) } else { None };
            if let Some(y) = corrected {
                let merit = (calls.values)(&y).map_or(f64::INFINITY, |v| self.of(&v));
                if let Some(accepted) = self.accept(y, merit, 1.0, calls) {
                    return Some(accepted);
                }
            }
            fraction *= self.shortening(merit, fraction);
        }
        None
    }

    fn accept(&self, x: Vec<f64>, merit: f64, fraction: f64, calls: &mut Calls<'_>) -> Option<Accepted> {
        if merit > self.here + SHARE * fraction * self.slope + self.noise {
            return None;
        }
        let gradients = (calls.gradients)(&x).ok().filter(finite)?;
        Some(Accepted { x, gradients, fraction })
    }

    /// The minimum of the parabola through what is known, within a tenth and a half.
    fn shortening(&self, merit: f64, fraction: f64) -> f64 {
        if !merit.is_finite() {
            return 0.25;
        }
        let slope = fraction * self.slope;
        (-0.5 * slope / (merit - self.here - slope)).clamp(0.1, 0.5)
    }
}

fn between(x: &[f64], full: &[f64], fraction: f64) -> Vec<f64> {
    if fraction == 1.0 {
        return full.to_vec();
    }
    x.iter().zip(full).map(|(x, y)| x + fraction * (y - x)).collect()
}

fn finite(g: &Gradients) -> bool {
    let all = |v: &[f64]| v.iter().all(|v| v.is_finite());
    all(&[g.values.objective]) && all(&g.values.rows) && all(&g.objective) && all(g.rows.as_slice())
}
