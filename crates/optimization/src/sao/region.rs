//! The search subregion of an approximate problem.

use crate::problem::Problem;

/// The box sˡ ≤ b ≤ sᵘ (12) in which an approximate problem is solved.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Region {
    /// sˡ.
    pub lower: Vec<f64>,
    /// sᵘ.
    pub upper: Vec<f64>,
    /// For the lower and the upper side of each variable: true if it is a move limit, false if it is a bound.
    pub is_limit: Vec<[bool; 2]>,
}

impl Region {
    /// The part of the design space within `half_width` of `b`, variable by variable.
    pub fn around(problem: &Problem, b: &[f64], half_width: &[f64]) -> Self {
        let (mut lower, mut upper, mut is_limit) = (vec![], vec![], vec![]);
        for ((variable, &b), &h) in problem.variables.iter().zip(b).zip(half_width) {
            lower.push((b - h).max(variable.lower));
            upper.push((b + h).min(variable.upper));
            is_limit.push([b - h > variable.lower, b + h < variable.upper]);
        }
        Self { lower, upper, is_limit }
    }

    /// Marks the variables of `b` that are at a move limit, within a millionth of the width of the region.
    pub fn at_limit(&self, b: &[f64]) -> Vec<bool> {
        let one = |k: usize| {
            let near = 1e-6 * (self.upper[k] - self.lower[k]);
            (self.is_limit[k][0] && b[k] - self.lower[k] <= near)
                || (self.is_limit[k][1] && self.upper[k] - b[k] <= near)
        };
        (0..b.len()).map(one).collect()
    }
}
