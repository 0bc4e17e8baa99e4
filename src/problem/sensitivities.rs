//! Derivatives of responses, and of quantities made from them.

use super::{Problem, Quantity, ResponseAt, Responses};
use autodiff::{Dual, PolynomialDegree, WIDTH, gradient, partials, seed};
use error::{Error, Result};
use nalgebra::{DMatrix, SVector};
use num_dual::Derivative;
use serde::{Deserialize, Serialize};

/// Variables from which on it pays to seed responses in their place.
const MANY: usize = 60;

/// ∂r/∂b at some instants.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensitivities {
    /// The instants, sorted.
    pub instants: Vec<ResponseAt>,
    /// One row for each instant, n columns; in the unit of the response over that of the variable.
    pub rows: DMatrix<f64>,
}

impl Sensitivities {
    /// The row of an instant, if it was differentiated.
    pub fn row_of(&self, instant: ResponseAt) -> Option<usize> {
        self.instants.binary_search(&instant).ok()
    }

    /// The gradient at an instant (length n), if it was differentiated.
    pub fn gradient(&self, instant: ResponseAt) -> Option<Vec<f64>> {
        self.row_of(instant).map(|row| self.rows.row(row).iter().copied().collect())
    }
}

impl Problem {
    /// ∂r/∂b at the wanted instants (one row for each, n columns), checked for shape and finiteness.
    pub fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let rows = self.analysis.sensitivities(b, responses, wanted)?;
        Error::check_length("rows of the sensitivities", wanted.len(), rows.nrows())?;
        Error::check_length("columns of the sensitivities", self.n(), rows.ncols())?;
        for (i, instant) in wanted.iter().enumerate() {
            if let Some(k) = (0..self.n()).find(|&k| !rows[(i, k)].is_finite()) {
                let response = &self.responses[instant.response];
                let what = format!("derivative of response `{}` to `{}`", response.name, self.variables[k].name);
                return Err(self.not_finite(what, rows[(i, k)], response.grid, instant.point, b));
            }
        }
        Ok(rows)
    }

    /// The instant of response `h` that a quantity sees at time point `p`.
    pub(crate) fn instant(&self, h: usize, p: usize) -> ResponseAt {
        ResponseAt { response: h, point: if self.responses[h].grid.is_some() { p } else { 0 } }
    }

    /// The instants that a quantity depends on at time point `p`, or over its whole grid where it is a functional.
    pub(crate) fn instants_of(&self, quantity: &Quantity, p: usize) -> Vec<ResponseAt> {
        let points = match (quantity.is_transient(), quantity.grid()) {
            (false, Some(grid)) => 0..self.grids[grid].len(),
            _ => p..p + 1,
        };
        let at = |p| quantity.uses.iter().map(move |&h| self.instant(h, p));
        let mut instants: Vec<ResponseAt> = points.flat_map(at).collect();
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
        if b.len() > MANY
            && let Some(slope) = self.derivative_through_responses(quantity, p, b, responses, sensitivities)
        {
            return slope;
        }
        let chunk = |first: usize| {
            let value = quantity.value(p, &self.grids, &seed(b, first), |h, p| {
                let instant = self.instant(h, p);
                let row = sensitivities.row_of(instant).expect("every instant of a kept quantity is differentiated");
                let slope = |k: usize, _| if first + k < b.len() { sensitivities.rows[(row, first + k)] } else { 0.0 };
                let slopes = SVector::<f64, WIDTH>::from_fn(slope);
                Dual::new(responses.at(instant), Derivative::some(slopes))
            });
            partials(&value, b.len() - first)
        };
        (0..b.len()).step_by(WIDTH).flat_map(chunk).collect()
    }

    /// The same where the quantity depends on the design through fewer responses than there are variables: each response is
    /// seeded, not each variable. None where it depends on the design by itself too.
    fn derivative_through_responses(
        &self,
        quantity: &Quantity,
        p: usize,
        b: &[f64],
        responses: &Responses,
        sensitivities: &Sensitivities,
    ) -> Option<Vec<f64>> {
        let instants = self.instants_of(quantity, p);
        let design: Vec<PolynomialDegree> = b.iter().map(|&v| PolynomialDegree::variable(v)).collect();
        let seen = |h, p| PolynomialDegree::from(responses.at(self.instant(h, p)));
        if instants.len() >= b.len() || quantity.value(p, &self.grids, &design, seen).degree > 0 {
            return None;
        }
        let (fixed, values): (Vec<Dual>, Vec<f64>) =
            (b.iter().map(|&v| Dual::from(v)).collect(), instants.iter().map(|i| responses.at(*i)).collect());
        let place =
            |h, p| instants.binary_search(&self.instant(h, p)).expect("it is among the instants of the quantity");
        let weights = gradient(|z| quantity.value(p, &self.grids, &fixed, |h, p| z[place(h, p)]), &values).1;
        let mut slope = vec![0.0; b.len()];
        for (instant, weight) in instants.iter().zip(weights) {
            let row = sensitivities.row_of(*instant).expect("every instant of a kept quantity is differentiated");
            slope.iter_mut().zip(sensitivities.rows.row(row).iter()).for_each(|(s, r)| *s += weight * r);
        }
        Some(slope)
    }
}
