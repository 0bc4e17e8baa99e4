//! Responses between time points, and the local maxima of constraints in continuous time.

use super::{AnalyzedDesign, PeakTime, Problem, Quantity, ResponseAt, Responses, RowId, Sensitivities, SignedQuantity};
use autodiff::{BLOCK, Dual, HyperDual, WIDTH, partials, seed};
use error::Result;
use nalgebra::{Const, DMatrix, SMatrix, SVector, U1};
use num_dual::Derivative;
use serde::{Deserialize, Serialize};

/// A local maximum with its derivatives: of ĝ over design and time, and of the responses over the design.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Peak {
    /// The constraint, and the time point that is the maximum among its neighbours.
    pub row: RowId,
    /// t*.
    pub time: f64,
    /// Responses of the constraint at t*.
    pub responses: Vec<f64>,
    /// Their gradients at t*: one row for each, n columns.
    #[serde(deserialize_with = "crate::storage::matrix::one")]
    pub gradients: DMatrix<f64>,
    /// Their second derivatives at t* (n × n each); empty if not requested, or not offered by the analysis.
    #[serde(default, deserialize_with = "crate::storage::matrix::several")]
    pub curvatures: Vec<DMatrix<f64>>,
    /// ∂ĝ/∂t at t*: zero inside the interval, of either sign at its ends.
    pub slope: f64,
    /// ∂²ĝ/∂t² at t*.
    #[serde(rename = "bend")]
    pub curvature_in_time: f64,
    /// ∂²ĝ/∂b∂t at t* (length n).
    pub cross: Vec<f64>,
    /// Largest shifts of the maximum to earlier and to later times: to the next minimum or the end of the interval.
    pub reach: [f64; 2],
}

/// The design, with first derivatives by the block of variables from `start`.
pub(crate) fn seed_block(b: &[f64], start: usize) -> Vec<HyperDual> {
    let seeded = |(k, &v): (usize, &f64)| match k.checked_sub(start) {
        Some(a) if a < BLOCK => HyperDual::from_re(v).derivative1(a),
        _ => HyperDual::from_re(v),
    };
    b.iter().enumerate().map(seeded).collect()
}

/// Weights of value, first and second derivative at `t` of the polynomial through `nodes`.
fn lagrange(nodes: &[f64], t: f64) -> Vec<[f64; 3]> {
    let weight = |i: usize| {
        // Π (t + ε − tⱼ)/(tᵢ − tⱼ) with its first two derivatives.
        nodes.iter().enumerate().filter(|(j, _)| *j != i).fold([1.0, 0.0, 0.0], |[v, d, c], (_, &other)| {
            let (f, s) = ((t - other) / (nodes[i] - other), 1.0 / (nodes[i] - other));
            [v * f, d * f + v * s, c * f + 2.0 * d * s]
        })
    };
    (0..nodes.len()).map(weight).collect()
}

impl Problem {
    /// Applies the inequality constraints at all times of their grids' intervals, not only at the time points.
    ///
    /// See [`Constraint::in_continuous_time`](super::Constraint::in_continuous_time).
    #[must_use]
    pub fn in_continuous_time(mut self) -> Self {
        self.name += ", continuous time";
        for c in &mut self.constraints {
            c.is_continuous |=
                c.quantity.is_transient() && !c.is_equality() && c.window.is_none() && c.quantity.direct.is_none();
        }
        self
    }

    /// Up to five time points around `t`: indices and weights.
    fn stencil(&self, h: usize, t: f64) -> Option<(usize, Vec<[f64; 3]>)> {
        let points = &self.grids[self.responses[h].grid?].points;
        let count = points.len().min(5);
        let next = points.partition_point(|&p| p < t);
        let first = next.saturating_sub(count.div_ceil(2)).min(points.len() - count);
        Some((first, lagrange(&points[first..first + count], t)))
    }

    fn rates(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[f64; 3]> {
        let Some((first, weights)) = self.stencil(h, t) else { return Ok([responses.values[h][0], 0.0, 0.0]) };
        if let Some(continuous) = self.analysis.continuous() {
            return continuous.rates(&self.analysis_design(b), responses, h, t);
        }
        let values = &responses.values[h][first..];
        Ok([0, 1, 2].map(|d| weights.iter().zip(values).map(|(w, v)| w[d] * v).sum()))
    }

    fn rate_sensitivities(&self, b: &[f64], responses: &Responses, h: usize, t: f64) -> Result<[Vec<f64>; 2]> {
        let Some((first, weights)) = self.stencil(h, t) else {
            let row = self.sensitivities(b, responses, &[ResponseAt { response: h, point: 0 }])?;
            return Ok([row.iter().copied().collect(), vec![0.0; b.len()]]);
        };
        if let Some(continuous) = self.analysis.continuous() {
            return continuous.rate_sensitivities(&self.analysis_design(b), responses, h, t);
        }
        let wanted: Vec<ResponseAt> =
            (first..first + weights.len()).map(|point| ResponseAt { response: h, point }).collect();
        let rows = self.sensitivities(b, responses, &wanted)?;
        let one = |d: usize, k: usize| weights.iter().enumerate().map(|(i, w)| w[d] * rows[(i, k)]).sum();
        Ok([0, 1].map(|d| (0..b.len()).map(|k| one(d, k)).collect()))
    }

    /// c = ĝ − 1, ∂c/∂t and ∂²c/∂t² of constraint number `j` at any time.
    pub fn constraint_over_time(&self, j: usize, b: &[f64], responses: &Responses, t: f64) -> Result<[f64; 3]> {
        let constraint = &self.constraints[j];
        let one = |v: [f64; 3]| {
            let first = SVector::<f64, BLOCK>::from_fn(|a, _| if a == 0 { v[1] } else { 0.0 });
            let second = SMatrix::from_fn(|a, c| if a + c == 0 { v[2] } else { 0.0 });
            let (across, along) = (Derivative::some(first), Derivative::some(first.transpose()));
            HyperDual::new(v[0], across, along, Derivative::some(second))
        };
        let values_at_t = constraint.quantity.uses.iter().map(|&h| self.rates(b, responses, h, t).map(one));
        let values_at_t: Vec<HyperDual> = values_at_t.collect::<Result<_>>()?;
        let design: Vec<HyperDual> = b.iter().map(|&v| HyperDual::from_re(v)).collect();
        let c = constraint.residual(constraint.signed().value_at(&values_at_t, &design, one([t, 1.0, 0.0])));
        let first = c.eps1.unwrap_generic(Const::<BLOCK>, U1)[0];
        let second = c.eps1eps2.unwrap_generic(Const::<BLOCK>, Const::<BLOCK>)[(0, 0)];
        Ok([c.re, first, second])
    }

    /// The local maximum of constraint `j` near time point `p`, which is a maximum among its neighbours or an end: its
    /// time and value. `None` at an end from which the constraint increases.
    pub(super) fn peak_near(&self, j: usize, b: &[f64], responses: &Responses, p: usize) -> Result<Option<(f64, f64)>> {
        let grid = self.constraints[j].quantity.grid().expect("a constraint in continuous time has a grid");
        let points = &self.grids[grid].points;
        let at = |t: f64| self.constraint_over_time(j, b, responses, t);
        let here = at(points[p])?;
        let rising = here[1] > 0.0;
        let neighbour = if rising { p + 1 } else { p.wrapping_sub(1) };
        let Some(&other) = points.get(neighbour) else { return Ok(Some((points[p], here[0]))) };
        // A maximum lies between the point and this neighbour if the slope changes its sign between them.
        let (mut low, mut high) = if rising { (points[p], other) } else { (other, points[p]) };
        let far = at(other)?;
        if (far[1] > 0.0) == rising {
            let is_end = p == 0 || p + 1 == points.len();
            return Ok((!is_end || far[0] <= here[0]).then_some((points[p], here[0])));
        }
        let mut t = points[p];
        for _ in 0..60 {
            let [value, slope, curvature] = at(t)?;
            if slope > 0.0 {
                low = t
            } else {
                high = t
            }
            let newton = t - slope / curvature;
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            if slope == 0.0
                || (next - t).abs() <= 4.0 * f64::EPSILON * t.abs()
                || high - low <= 4.0 * f64::EPSILON * high.abs()
            {
                return Ok(Some((t, value)));
            }
            t = next;
        }
        Ok(Some((t, at(t)?[0])))
    }

    /// The derivatives of a local maximum; `history` is c over the time points.
    pub fn peak(&self, at: PeakTime, b: &[f64], responses: &Responses, history: &[f64]) -> Result<Peak> {
        let PeakTime { row, time } = at;
        let quantity = &self.constraints[row.constraint].quantity;
        let [_, slope, curvature_in_time] = self.constraint_over_time(row.constraint, b, responses, time)?;
        let n = b.len();
        let (mut values, mut rates, mut gradients) = (vec![], vec![], vec![]);
        for &h in &quantity.uses {
            let [value, rate, _] = self.rates(b, responses, h, time)?;
            values.push(value);
            rates.push(rate);
            gradients.push(self.rate_sensitivities(b, responses, h, time)?);
        }
        let cross = self.cross(row, b, time, &values, &rates, &gradients);
        let flat = DMatrix::from_row_iterator(values.len(), n, gradients.iter().flat_map(|g| g[0].iter().copied()));
        let reach = self.distances_to_minima(quantity, row.point, time, history);
        Ok(Peak {
            row,
            time,
            responses: values,
            gradients: flat,
            curvatures: vec![],
            slope,
            curvature_in_time,
            cross,
            reach,
        })
    }

    /// Adds second derivatives of the responses to a local maximum, if the analysis offers them in continuous time.
    pub fn curved(&self, peak: Peak, b: &[f64], responses: &Responses) -> Result<Peak> {
        let Some(continuous) = self.analysis.continuous() else { return Ok(peak) };
        let uses = &self.constraints[peak.row.constraint].quantity.uses;
        let one = |&h: &usize| match self.responses[h].grid {
            Some(_) => continuous.curvature(&self.analysis_design(b), responses, h, peak.time),
            None => {
                Ok(self.curvatures(b, responses, &[ResponseAt { response: h, point: 0 }])?.map(|mut c| c.remove(0)))
            }
        };
        let all: Option<Vec<_>> = uses.iter().map(one).collect::<Result<_>>()?;
        Ok(Peak { curvatures: all.unwrap_or_default(), ..peak })
    }

    /// dĝ/db of a local maximum: ∂ĝ/∂b at its time, because the shift of the time has no first-order effect.
    pub fn peak_gradient(&self, peak: &Peak, b: &[f64]) -> Vec<f64> {
        let constraint = &self.constraints[peak.row.constraint];
        self.derivative_at_peak(constraint.signed(), peak, b, |value| constraint.residual(value))
    }

    /// The total derivative of `sign` times the constrained quantity of a row of an analysed design: at the time point, or at the time of
    /// the local maximum whose value the row has.
    ///
    /// `sensitivities` are those of [`Self::responses_of`] at the time point.
    ///
    /// # Errors
    ///
    /// Those of the analysis, for a local maximum.
    pub fn row_derivative(
        &self,
        row: RowId,
        sign: f64,
        analyzed: &AnalyzedDesign,
        sensitivities: &Sensitivities,
    ) -> Result<Vec<f64>> {
        let AnalyzedDesign { design, responses, evaluation } = analyzed;
        let signed = SignedQuantity { quantity: &self.constraints[row.constraint].quantity, sign, bound: None };
        let Some(&at) = evaluation.peak_of(row) else {
            return Ok(self.total_derivative(signed, row.point, design, responses, sensitivities));
        };
        let peak = self.peak(at, design, responses, &evaluation.residuals[row.constraint])?;
        Ok(self.derivative_at_peak(signed, &peak, design, |value| value))
    }

    /// dĝ/db of a row of an analysed design: at the local maximum `at`, or at the time point if there is none.
    ///
    /// `sensitivities` are those of [`Self::responses_of`] at the time point.
    ///
    /// # Errors
    ///
    /// Those of the analysis, for a local maximum.
    pub fn residual_gradient(
        &self,
        row: RowId,
        at: Option<&PeakTime>,
        analyzed: &AnalyzedDesign,
        sensitivities: &Sensitivities,
    ) -> Result<Vec<f64>> {
        let AnalyzedDesign { design, responses, evaluation } = analyzed;
        let constraint = &self.constraints[row.constraint];
        if let Some(&at) = at {
            let peak = self.peak(at, design, responses, &evaluation.residuals[row.constraint])?;
            return Ok(self.peak_gradient(&peak, design));
        }
        let slope = self.total_derivative(constraint.signed(), row.point, design, responses, sensitivities);
        Ok(slope.into_iter().map(|v| v / constraint.scale).collect())
    }

    fn derivative_at_peak(
        &self,
        signed: SignedQuantity<'_>,
        peak: &Peak,
        b: &[f64],
        of: impl Fn(Dual) -> Dual,
    ) -> Vec<f64> {
        let chunk = |first: usize| {
            let values_at_t = (0..peak.responses.len()).map(|i| {
                let slope = |k: usize, _| if first + k < b.len() { peak.gradients[(i, first + k)] } else { 0.0 };
                Dual::new(peak.responses[i], Derivative::some(SVector::<f64, WIDTH>::from_fn(slope)))
            });
            let values_at_t: Vec<Dual> = values_at_t.collect();
            let value = signed.value_at(&values_at_t, &seed(b, first), Dual::from_re(peak.time));
            partials(&of(value), b.len() - first)
        };
        (0..b.len()).step_by(WIDTH).flat_map(chunk).collect()
    }

    /// ∂²ĝ/∂b∂t by the chain rule over the rates of the responses.
    fn cross(
        &self,
        row: RowId,
        b: &[f64],
        t: f64,
        values: &[f64],
        rates: &[f64],
        gradients: &[[Vec<f64>; 2]],
    ) -> Vec<f64> {
        let constraint = &self.constraints[row.constraint];
        let only_first =
            |v: f64| Derivative::some(SVector::<f64, BLOCK>::from_fn(|c, _| if c == 0 { v } else { 0.0 }).transpose());
        let chunk = |start: usize| {
            let block = |v: &[f64]| SVector::<f64, BLOCK>::from_fn(|a, _| v.get(start + a).copied().unwrap_or(0.0));
            let values_at_t: Vec<HyperDual> = (0..values.len())
                .map(|i| {
                    let mixed = block(&gradients[i][1]);
                    let second = SMatrix::from_fn(|a, c| if c == 0 { mixed[a] } else { 0.0 });
                    HyperDual::new(
                        values[i],
                        Derivative::some(block(&gradients[i][0])),
                        only_first(rates[i]),
                        Derivative::some(second),
                    )
                })
                .collect();
            let design = seed_block(b, start);
            let g = constraint.residual(constraint.signed().value_at(
                &values_at_t,
                &design,
                HyperDual::from_re(t).derivative2(0),
            ));
            let mixed = g.eps1eps2.unwrap_generic(Const::<BLOCK>, Const::<BLOCK>);
            (0..BLOCK.min(b.len() - start)).map(move |a| mixed[(a, 0)]).collect::<Vec<_>>()
        };
        (0..b.len()).step_by(BLOCK).flat_map(chunk).collect()
    }

    /// Distances in time to the next minima of the history on both sides.
    fn distances_to_minima(&self, quantity: &Quantity, p: usize, time: f64, g: &[f64]) -> [f64; 2] {
        let grid = quantity.grid().expect("a constraint in continuous time has a grid");
        let points = &self.grids[grid].points;
        let before = (0..p).rev().take_while(|&q| g[q] <= g[q + 1]).last().unwrap_or(p);
        let after = (p + 1..points.len()).take_while(|&q| g[q] <= g[q - 1]).last().unwrap_or(p);
        [(time - points[before]).max(0.0), (points[after] - time).max(0.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn polynomials_of_fourth_degree_are_exact() {
        let nodes = [0.0, 0.5, 0.9, 1.6, 2.0];
        let f = |t: f64| t.powi(4) - 2.0 * t;
        let sum = |d: usize| lagrange(&nodes, 0.7).iter().zip(nodes).map(|(w, t)| w[d] * f(t)).sum::<f64>();
        assert!((sum(0) - f(0.7)).abs() < 1e-14);
        assert!((sum(1) - (4.0 * 0.7f64.powi(3) - 2.0)).abs() < 1e-13);
        assert!((sum(2) - 12.0 * 0.49).abs() < 1e-12);
    }
}
