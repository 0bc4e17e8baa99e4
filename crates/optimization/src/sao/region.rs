//! The search subregion of an approximate problem.

use crate::problem::Problem;
use serde::{Deserialize, Deserializer};

/// The box sˡ ≤ b ≤ sᵘ (12) in which an approximate problem is solved.
#[derive(Clone, Debug, PartialEq, serde::Serialize, Deserialize)]
pub struct Region {
    /// sˡ. JSON has no infinite numbers: −∞ is stored as `null`.
    #[serde(deserialize_with = "lower_sides")]
    pub lower: Vec<f64>,
    /// sᵘ, with `null` for ∞.
    #[serde(deserialize_with = "upper_sides")]
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

fn lower_sides<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    sides(deserializer, f64::NEG_INFINITY)
}

fn upper_sides<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<f64>, D::Error> {
    sides(deserializer, f64::INFINITY)
}

fn sides<'de, D: Deserializer<'de>>(deserializer: D, infinite: f64) -> Result<Vec<f64>, D::Error> {
    let sides = Vec::<Option<f64>>::deserialize(deserializer)?;
    Ok(sides.into_iter().map(|side| side.unwrap_or(infinite)).collect())
}
