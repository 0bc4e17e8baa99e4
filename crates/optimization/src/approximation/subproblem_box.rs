//! The box of a cycle, the designs before it, and options of the approximate problem.

use super::DesignHistory;
use crate::problem::Problem;
use nlp::LowRank;

/// The box in which the approximate problem is solved, and the designs accepted so far.
#[derive(Clone, Debug)]
pub struct SubproblemBox {
    /// Accepted designs; the last is the start design of the cycle.
    pub history: DesignHistory,
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
    pub fn new(problem: &Problem, history: DesignHistory, (lower, upper): (Vec<f64>, Vec<f64>)) -> Self {
        let mut scale = problem.scales();
        for (k, variable) in problem.variables.iter().enumerate() {
            if !(variable.upper - variable.lower).is_finite() {
                let [least, most] = history.extent(k);
                scale[k] = scale[k].max(most - least);
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
