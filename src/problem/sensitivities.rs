//! Derivatives of responses, and of quantities made from them.

use super::{Instant, Problem, Quantity, Responses};
use crate::scalar::{Dual, WIDTH, seed, slopes};
use nalgebra::{DMatrix, SVector};
use num_dual::Derivative;
use serde::{Deserialize, Serialize};

/// ∂r/∂b at some instants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensitivities {
    /// The instants, sorted.
    pub instants: Vec<Instant>,
    /// One row for each instant, n columns; in the unit of the response over that of the variable.
    pub rows: DMatrix<f64>,
}

impl Sensitivities {
    /// The row of an instant, if it was differentiated.
    pub fn row_of(&self, instant: Instant) -> Option<usize> {
        self.instants.binary_search(&instant).ok()
    }

    /// The gradient at an instant (length n), if it was differentiated.
    pub fn gradient(&self, instant: Instant) -> Option<Vec<f64>> {
        self.row_of(instant).map(|row| self.rows.row(row).iter().copied().collect())
    }
}

impl Problem {
    /// The instant of response `h` that a quantity sees at time point `p`.
    pub(crate) fn instant(&self, h: usize, p: usize) -> Instant {
        Instant { response: h, point: if self.responses[h].grid.is_some() { p } else { 0 } }
    }

    /// The instants that a quantity depends on at time point `p`, or over its whole grid where it is a functional.
    pub(crate) fn instants_of(&self, quantity: &Quantity, p: usize) -> Vec<Instant> {
        let points = match (quantity.is_transient(), quantity.grid()) {
            (false, Some(grid)) => 0..self.grids[grid].len(),
            _ => p..p + 1,
        };
        let at = |p| quantity.uses.iter().map(move |&h| self.instant(h, p));
        let mut instants: Vec<Instant> = points.flat_map(at).collect();
        instants.sort_unstable();
        instants.dedup();
        instants
    }

    /// The total derivative dg/db of a quantity at time point `p` by the chain rule over the response sensitivities.
    pub fn total_derivative(
        &self,
        quantity: &Quantity,
        p: usize,
        b: &[f64],
        responses: &Responses,
        sensitivities: &Sensitivities,
    ) -> Vec<f64> {
        let chunk = |first: usize| {
            let value = quantity.value(p, &self.grids, &seed(b, first), |h, p| {
                let instant = self.instant(h, p);
                let row = sensitivities.row_of(instant).expect("every instant of a kept quantity is differentiated");
                let slope = |k: usize, _| if first + k < b.len() { sensitivities.rows[(row, first + k)] } else { 0.0 };
                let slopes = SVector::<f64, WIDTH>::from_fn(slope);
                Dual::new(responses.at(instant), Derivative::some(slopes))
            });
            slopes(&value, b.len() - first)
        };
        (0..b.len()).step_by(WIDTH).flat_map(chunk).collect()
    }
}
