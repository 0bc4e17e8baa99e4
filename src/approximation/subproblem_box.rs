//! What the approximations of a cycle share: where the designs came from and how far they may go.

use crate::problem::{Problem, Responses, Sensitivities};
use serde::{Deserialize, Serialize};

/// A design accepted before, with what was differentiated there.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PreviousPoint {
    /// The design.
    pub design: Vec<f64>,
    /// Responses there.
    pub responses: Responses,
    /// Their sensitivities, where they were wanted.
    pub sensitivities: Sensitivities,
}

/// The designs accepted so far, and the box of the cycle.
#[derive(Clone, Debug)]
pub struct SubproblemBox {
    /// Accepted designs, the oldest first; the last is the start design of the cycle.
    pub trail: Vec<Vec<f64>>,
    /// Lower sides of the search subregion.
    pub lower: Vec<f64>,
    /// Upper sides of the search subregion.
    pub upper: Vec<f64>,
    /// A length for each variable that does not change during a run: its range, else |its start|, else 1.
    pub scale: Vec<f64>,
}

impl SubproblemBox {
    /// The surroundings of a cycle.
    pub fn new(problem: &Problem, trail: Vec<Vec<f64>>, (lower, upper): (Vec<f64>, Vec<f64>)) -> Self {
        Self { trail, lower, upper, scale: problem.scales() }
    }

    /// True if variable k can neither reach nor change the sign of zero in this cycle.
    pub fn keeps_sign(&self, k: usize) -> bool {
        self.lower[k] > 0.0 || self.upper[k] < 0.0
    }
}
