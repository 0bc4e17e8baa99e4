//! Derivatives of responses, and of quantities made from them.

use super::{Problem, Quantity, ResponseAt, Responses, RowId, SignedQuantity};
use autodiff::{Dual, PolynomialDegree, WIDTH, gradient, partials, seed};
use error::{Error, Result};
use nalgebra::{DMatrix, SVector};
use num_dual::Derivative;
use serde::{Deserialize, Serialize};

/// Number of variables above which seeding the responses instead of the variables is faster.
const MANY: usize = 60;

/// ∂r/∂b of some responses at some time points.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sensitivities {
    /// Differentiated responses and time points, sorted.
    #[serde(rename = "instants")]
    pub at: Vec<ResponseAt>,
    /// One row for each of them, n columns; in the unit of the response per unit of the variable.
    #[serde(deserialize_with = "crate::storage::matrix::one")]
    pub rows: DMatrix<f64>,
}

impl Sensitivities {
    /// The row of a response at a time point, if it was differentiated.
    pub fn row_of(&self, at: ResponseAt) -> Option<usize> {
        self.at.binary_search(&at).ok()
    }

    /// The gradient of a response at a time point (length n), if it was differentiated.
    pub fn gradient(&self, at: ResponseAt) -> Option<Vec<f64>> {
        self.row_of(at).map(|row| self.rows.row(row).iter().copied().collect())
    }
}

/// The responses among the `wanted` ones, sorted by response, that `differentiate` does not offer, each by itself, and the reasons.
pub(crate) fn responses_without_derivatives(
    wanted: &[ResponseAt],
    differentiate: impl Fn(&[ResponseAt]) -> Result<DMatrix<f64>>,
) -> Vec<(usize, Error)> {
    let reason = |points: &[ResponseAt]| match differentiate(points) {
        Err(error @ Error::Unsupported { .. }) => Some((points[0].response, error)),
        _ => None,
    };
    wanted.chunk_by(|a, b| a.response == b.response).filter_map(reason).collect()
}

impl Problem {
    /// ∂r/∂b of the wanted responses (one row for each, n columns), checked for shape and finiteness.
    ///
    /// # Errors
    ///
    /// [`Error::Length`] or [`Error::NotFinite`], or the error of the analysis.
    pub fn sensitivities(&self, b: &[f64], responses: &Responses, wanted: &[ResponseAt]) -> Result<DMatrix<f64>> {
        let rows = self.analysis.sensitivities(&self.analysis_design(b), responses, wanted)?;
        Error::check_length("rows of the sensitivities", wanted.len(), rows.nrows())?;
        Error::check_length("columns of the sensitivities", self.n(), rows.ncols())?;
        for (i, at) in wanted.iter().enumerate() {
            if let Some(k) = (0..self.n()).find(|&k| !rows[(i, k)].is_finite()) {
                let response = &self.responses[at.response];
                let what = format!("derivative of response `{}` to `{}`", response.name, self.variables[k].name);
                return Err(self.not_finite(what, rows[(i, k)], response.grid, at.point, b));
            }
        }
        Ok(rows)
    }

    /// ∂r/∂b of all responses at all their time points. Responses without derivatives, such as reactions that redundant constraints leave
    /// indeterminate, are left out and returned with the reasons.
    ///
    /// # Errors
    ///
    /// As [`Problem::sensitivities`]; the reason of a response on which the objective or a constraint depends.
    pub fn all_sensitivities(&self, b: &[f64], responses: &Responses) -> Result<(Sensitivities, Vec<(usize, Error)>)> {
        let points = |h: usize| (0..responses.values[h].len()).map(move |point| ResponseAt { response: h, point });
        let all: Vec<ResponseAt> = (0..self.responses.len()).flat_map(points).collect();
        let error = match self.sensitivities(b, responses, &all) {
            Ok(rows) => return Ok((Sensitivities { at: all, rows }, vec![])),
            Err(error @ Error::Unsupported { .. }) => error,
            Err(error) => return Err(error),
        };
        let without = responses_without_derivatives(&all, |points| self.sensitivities(b, responses, points));
        let quantities = self.constraints.iter().map(|constraint| &constraint.quantity);
        let is_used =
            |h: &usize| quantities.clone().chain([&self.objective.quantity]).any(|q| q.responses().contains(h));
        if let Some((_, reason)) = without.iter().find(|(h, _)| is_used(h)) {
            return Err(reason.clone());
        }
        let has_derivatives = |at: &ResponseAt| without.iter().all(|(h, _)| *h != at.response);
        let at: Vec<ResponseAt> = all.into_iter().filter(has_derivatives).collect();
        if without.is_empty() || at.is_empty() {
            return Err(error);
        }
        let rows = self.sensitivities(b, responses, &at)?;
        Ok((Sensitivities { at, rows }, without))
    }

    /// Response `h` at time point `p`, or its only value if it is time-independent.
    pub(crate) fn response_at(&self, h: usize, p: usize) -> ResponseAt {
        ResponseAt { response: h, point: if self.responses[h].grid.is_some() { p } else { 0 } }
    }

    /// The responses and time points that a quantity depends on at time point `p`, or over the whole grid if it is a functional.
    pub fn responses_of(&self, quantity: &Quantity, p: usize) -> Vec<ResponseAt> {
        let points = match (quantity.is_transient(), quantity.grid()) {
            (false, Some(grid)) => 0..self.grids[grid].len(),
            _ => p..p + 1,
        };
        let at = |p| quantity.uses.iter().map(move |&h| self.response_at(h, p));
        let mut all: Vec<ResponseAt> = points.flat_map(at).collect();
        all.sort_unstable();
        all.dedup();
        all
    }

    /// The total derivative dg/db of a quantity at time point `p` by the chain rule over the response sensitivities.
    pub fn total_derivative(
        &self,
        signed: SignedQuantity<'_>,
        p: usize,
        b: &[f64],
        responses: &Responses,
        sensitivities: &Sensitivities,
    ) -> Vec<f64> {
        if b.len() > MANY
            && let Some(slope) = self.derivative_through_responses(signed, p, b, responses, sensitivities)
        {
            return slope;
        }
        let chunk = |first: usize| {
            let value = signed.value(p, &self.grids, &seed(b, first), |h, p| {
                let at = self.response_at(h, p);
                let row = sensitivities.row_of(at).expect("every response of a retained quantity is differentiated");
                let slope = |k: usize, _| if first + k < b.len() { sensitivities.rows[(row, first + k)] } else { 0.0 };
                let slopes = SVector::<f64, WIDTH>::from_fn(slope);
                Dual::new(responses.at(at), Derivative::some(slopes))
            });
            partials(&value, b.len() - first)
        };
        (0..b.len()).step_by(WIDTH).flat_map(chunk).collect()
    }

    /// Checks that the objective and the constraints in `rows` have finite derivatives: a root has none where its argument is zero.
    ///
    /// # Errors
    ///
    /// [`Error::NotFinite`] with the quantity, the design variable and the design.
    pub fn check_derivatives(
        &self,
        b: &[f64],
        responses: &Responses,
        sensitivities: &Sensitivities,
        rows: &[RowId],
    ) -> Result<()> {
        let objective = std::iter::once((self.objective.signed(), None));
        let constraints = rows.iter().map(|row| (self.constraints[row.constraint].signed(), Some(row)));
        for (signed, row) in objective.chain(constraints) {
            let p = row.map_or(0, |row| row.point);
            let slope = self.total_derivative(signed, p, b, responses, sensitivities);
            if let Some(k) = slope.iter().position(|slope| !slope.is_finite()) {
                let name = match row {
                    Some(row) => format!("constraint `{}`", self.constraints[row.constraint].name),
                    None => format!("objective `{}`", self.objective.name),
                };
                let what = format!("derivative of {name} to `{}`", self.variables[k].name);
                return Err(self.not_finite(what, slope[k], signed.quantity.grid().filter(|_| row.is_some()), p, b));
            }
        }
        Ok(())
    }

    /// The total derivative with one seed for each response instead of each variable.
    ///
    /// `None` unless there are fewer responses than variables and the quantity depends on the design through responses only.
    fn derivative_through_responses(
        &self,
        signed: SignedQuantity<'_>,
        p: usize,
        b: &[f64],
        responses: &Responses,
        sensitivities: &Sensitivities,
    ) -> Option<Vec<f64>> {
        let used = self.responses_of(signed.quantity, p);
        let design: Vec<PolynomialDegree> = b.iter().map(|&v| PolynomialDegree::variable(v)).collect();
        let value = |h, p| PolynomialDegree::from(responses.at(self.response_at(h, p)));
        if used.len() >= b.len() || signed.value(p, &self.grids, &design, value).degree > 0 {
            return None;
        }
        let (fixed, values): (Vec<Dual>, Vec<f64>) =
            (b.iter().map(|&v| Dual::from(v)).collect(), used.iter().map(|i| responses.at(*i)).collect());
        let place =
            |h, p| used.binary_search(&self.response_at(h, p)).expect("it is among the responses of the quantity");
        let weights = gradient(|z| signed.value(p, &self.grids, &fixed, |h, p| z[place(h, p)]), &values).1;
        let mut slope = vec![0.0; b.len()];
        for (at, weight) in used.iter().zip(weights) {
            let row = sensitivities.row_of(*at).expect("every response of a retained quantity is differentiated");
            slope.iter_mut().zip(sensitivities.rows.row(row).iter()).for_each(|(s, r)| *s += weight * r);
        }
        Some(slope)
    }
}
