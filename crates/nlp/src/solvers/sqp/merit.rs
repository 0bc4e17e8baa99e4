//! The merit function f + ρ v, with v the largest violation of a row, and the line search.

use crate::Evaluations;
use crate::program::{Gradients, Program, Values, largest_violation};
use error::Result;

/// Fraction of the predicted decrease that a step must achieve (Armijo).
const ARMIJO: f64 = 1e-4;
/// Largest number of reductions of the step length.
const REDUCTIONS: usize = 40;

/// The merit function with its value and predicted decrease at the start of a step.
pub(super) struct MeritFunction<'a> {
    pub program: &'a dyn Program,
    pub penalty: f64,
    pub here: f64,
    /// Predicted change over a full step, negative.
    pub slope: f64,
    /// Rounding error of the merit function.
    pub noise: f64,
}

/// A point that the line search accepts.
pub(super) struct LineSearchPoint {
    pub x: Vec<f64>,
    pub gradients: Gradients,
    pub step_length: f64,
}

/// A program whose evaluations are counted, failed ones included.
pub(super) struct CountedProgram<'a> {
    pub program: &'a dyn Program,
    pub count: Evaluations,
}

impl CountedProgram<'_> {
    pub fn values(&mut self, x: &[f64]) -> Result<Values> {
        self.count.values += 1;
        self.program.values(x)
    }

    pub fn gradients(&mut self, x: &[f64]) -> Result<Gradients> {
        self.count.gradients += 1;
        self.program.gradients(x)
    }
}

impl MeritFunction<'_> {
    /// The merit of `values`; infinite if they are not finite.
    fn of(&self, values: &Values) -> f64 {
        let merit = values.objective + self.penalty * largest_violation(self.program, &values.rows, |_| 1.0);
        let finite = merit.is_finite() && values.rows.iter().all(|g| !g.is_nan());
        if finite { merit } else { f64::INFINITY }
    }

    /// Line search from `x` to `full`; `None` if no point decreases the merit enough.
    ///
    /// If the full step is rejected, the point of `second_order_correction` is tried (Maratos effect).
    pub fn search(
        &self,
        x: &[f64],
        full: &[f64],
        evaluator: &mut CountedProgram<'_>,
        second_order_correction: impl Fn(&Values) -> Option<Vec<f64>>,
    ) -> Option<LineSearchPoint> {
        let mut step_length = 1.0;
        for _ in 0..REDUCTIONS {
            let y = between(x, full, step_length);
            let trial = evaluator.values(&y).ok();
            let merit = trial.as_ref().map_or(f64::INFINITY, |v| self.of(v));
            if let Some(accepted) = self.accept(y, merit, step_length, evaluator) {
                return Some(accepted);
            }
            let corrected = if step_length == 1.0 && merit.is_finite() {
                trial.as_ref().and_then(&second_order_correction)
            } else {
                None
            };
            if let Some(y) = corrected {
                let merit = evaluator.values(&y).map_or(f64::INFINITY, |v| self.of(&v));
                if let Some(accepted) = self.accept(y, merit, 1.0, evaluator) {
                    return Some(accepted);
                }
            }
            step_length *= self.reduction(merit, step_length);
        }
        None
    }

    fn accept(
        &self,
        x: Vec<f64>,
        merit: f64,
        step_length: f64,
        evaluator: &mut CountedProgram<'_>,
    ) -> Option<LineSearchPoint> {
        if merit > self.here + ARMIJO * step_length * self.slope + self.noise {
            return None;
        }
        let gradients = evaluator.gradients(&x).ok().filter(is_finite)?;
        Some(LineSearchPoint { x, gradients, step_length })
    }

    /// Factor of the next step length, 0.1 … 0.5: the minimum of the interpolating parabola.
    fn reduction(&self, merit: f64, step_length: f64) -> f64 {
        if !merit.is_finite() {
            return 0.25;
        }
        let slope = step_length * self.slope;
        (-0.5 * slope / (merit - self.here - slope)).clamp(0.1, 0.5)
    }
}

pub(super) fn between(x: &[f64], full: &[f64], step_length: f64) -> Vec<f64> {
    if step_length == 1.0 {
        return full.to_vec();
    }
    x.iter().zip(full).map(|(x, y)| x + step_length * (y - x)).collect()
}

pub(super) fn is_finite(g: &Gradients) -> bool {
    let all = |v: &[f64]| v.iter().all(|v| v.is_finite());
    all(&[g.values.objective]) && all(&g.values.rows) && all(&g.objective) && all(g.rows.as_slice())
}
