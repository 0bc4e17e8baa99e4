//! The box of a cycle, the designs before it, and options of the approximate problem.

use crate::problem::Problem;
use nlp::LowRank;

/// The box in which the approximate problem is solved, and the designs accepted so far.
#[derive(Clone, Debug)]
pub struct SubproblemBox {
    /// Accepted designs, the oldest first; the last is the start design of the cycle.
    pub history: Vec<Vec<f64>>,
    /// Lower sides of the search subregion.
    pub lower: Vec<f64>,
    /// Upper sides of the search subregion.
    pub upper: Vec<f64>,
    /// A scale for each variable: its range; without one, the extent of all designs so far, at least |its start| or, if that is
    /// zero, 1.
    pub scale: Vec<f64>,
}

impl SubproblemBox {
    /// Creates the box of a cycle after the accepted designs `history`.
    pub fn new(problem: &Problem, history: Vec<Vec<f64>>, (lower, upper): (Vec<f64>, Vec<f64>)) -> Self {
        let extent = |k: usize| {
            let side = |from: f64, pick: fn(f64, f64) -> f64| history.iter().map(|b| b[k]).fold(from, pick);
            side(f64::NEG_INFINITY, f64::max) - side(f64::INFINITY, f64::min)
        };
        let mut scale = problem.scales();
        for (k, variable) in problem.variables.iter().enumerate() {
            if !(variable.upper - variable.lower).is_finite() {
                scale[k] = scale[k].max(extent(k));
            }
        }
        Self { history, lower, upper, scale }
    }

    /// True if variable k can neither reach zero nor change its sign in this cycle.
    pub fn keeps_sign(&self, k: usize) -> bool {
        self.lower[k] > 0.0 || self.upper[k] < 0.0
    }
}

/// Options of the approximate problem apart from the approximation.
#[derive(Clone, Debug, Default)]
pub struct ApproximationOptions {
    /// ρ of the objective and of each constraint, in the unit of each: ρ·w(b) with
    /// w = ½ Σ ((bₖ − b₀ₖ)/scaleₖ)² is added. Empty if nothing is added.
    pub conservatism: Vec<f64>,
    /// True if peaks in continuous time move with the design.
    pub moving_peaks: bool,
    /// A convex quadratic about the start design that is added to the objective.
    pub curvature: Option<LowRank>,
}
