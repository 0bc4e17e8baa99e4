//! The objective and its goal.

use super::quantity::SignedQuantity;
use super::{Intermediates, Quantity};

/// Minimization or maximization of the objective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// Minimizes the quantity.
    Minimize,
    /// Maximizes the quantity. The driver minimizes its negative, which is the value in evaluations and histories.
    Maximize,
    /// Minimizes the peak of |f|, or the maximum of f, over a grid, by a bound variable (equations 37–39).
    MinimizePeak(PeakBound),
}

/// Bound variable and constraints of a min–max objective.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PeakBound {
    /// Index of the bound variable β, which is the objective.
    pub variable: usize,
    /// Indices of the constraints f ≤ β and f ≥ −β; of a maximum, twice that of f ≤ β.
    pub constraints: [usize; 2],
}

/// The objective F of a problem.
#[derive(Clone)]
#[non_exhaustive]
pub struct Objective {
    /// Name, for tables and axes.
    pub name: String,
    /// Unit, for tables and axes.
    pub unit: String,
    /// Quantity that is minimized or maximized.
    pub quantity: Quantity,
    /// Minimization or maximization.
    pub goal: Goal,
}

impl Objective {
    /// Creates an objective.
    pub fn new(name: &str, unit: &str, quantity: Quantity, goal: Goal) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), quantity, goal }
    }

    /// Approximates the objective itself; see [`Quantity::directly`].
    #[must_use]
    pub fn directly(self, intermediates: Intermediates) -> Self {
        Self { quantity: self.quantity.directly(intermediates), ..self }
    }

    /// The quantity with the sign in which it is minimized: −1 for [`Goal::Maximize`].
    pub fn signed(&self) -> SignedQuantity<'_> {
        let sign = if self.goal == Goal::Maximize { -1.0 } else { 1.0 };
        SignedQuantity { quantity: &self.quantity, sign, bound: None }
    }

    /// The bound variable and constraints of a min–max objective.
    pub fn peak(&self) -> Option<PeakBound> {
        match self.goal {
            Goal::MinimizePeak(peak) => Some(peak),
            Goal::Minimize | Goal::Maximize => None,
        }
    }
}
