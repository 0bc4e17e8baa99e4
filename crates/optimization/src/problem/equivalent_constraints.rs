//! Equivalent constraints: one number instead of a time history (equations 6 and 7).

use super::{Function, Functional, Point};
use autodiff::Scalar;

/// The integral equivalent (6) of g(b, t) ≤ c:
///
/// $$ \frac{1}{t_f - t_0} \int_{t_0}^{t_f} \max\{g(b, t),\, c\}\, dt \le c. $$
///
/// Its gradient vanishes when it becomes active (Bestle 1989). Use it for comparison; otherwise use time points.
#[derive(Clone, Debug)]
pub struct MeanExcess<F> {
    /// Quadrature weights over the grid.
    pub weights: Vec<f64>,
    /// g.
    pub function: F,
    /// c, in the unit of g.
    pub limit: f64,
}

impl<F: Function> Functional for MeanExcess<F> {
    fn over<S: Scalar>(&self, history: &[Point<S>]) -> S {
        let span: f64 = self.weights.iter().sum();
        // max{g, c} by the absolute value: a branch would have the polynomial degree of g, which may be linear.
        let clipped = |point: &Point<S>| {
            let excess = self.function.at(point) - self.limit;
            (excess + excess.abs()) * 0.5 + self.limit
        };
        let terms = history.iter().zip(&self.weights).map(|(point, &w)| clipped(point) * w);
        terms.fold(S::from(0.0), |a, b| a + b) / span
    }

    fn points(&self) -> Option<usize> {
        Some(self.weights.len())
    }
}

/// The Kreisselmeier–Steinhauser envelope, a smooth upper bound of the maximum and an instance of (7):
///
/// $$ \mathrm{KS} = g_{max} + \frac{1}{\rho} \ln \frac{1}{n_t} \sum_p e^{\rho (g_p - g_{max})} + \frac{\ln n_t}{\rho}. $$
#[derive(Clone, Debug)]
pub struct Envelope<F> {
    /// g.
    pub function: F,
    /// ρ, in 1 over the unit of g; a larger value is closer to the maximum.
    pub sharpness: f64,
}

impl<F: Function> Functional for Envelope<F> {
    fn over<S: Scalar>(&self, history: &[Point<S>]) -> S {
        let values: Vec<S> = history.iter().map(|point| self.function.at(point)).collect();
        let peak = values.iter().map(|g| g.re()).fold(f64::NEG_INFINITY, f64::max);
        let terms = values.iter().map(|&g| ((g - peak) * self.sharpness).exp());
        terms.fold(S::from(0.0), |a, b| a + b).ln() / self.sharpness + peak
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::function;

    fn over(functional: impl Functional, g: &[f64]) -> f64 {
        let points: Vec<Point<f64>> = g.chunks(1).map(|response| Point { response, design: &[], time: 0.0 }).collect();
        functional.over(&points)
    }

    #[test]
    fn mean_excess_is_the_limit_exactly_where_nothing_exceeds_it() {
        let excess = |g: &[f64]| {
            let function = function!(|p| p.response[0]);
            over(MeanExcess { weights: vec![0.5, 1.0, 0.5], function, limit: 1.0 }, g)
        };
        assert_eq!(excess(&[0.2, 1.0, -3.0]), 1.0);
        assert_eq!(excess(&[1.0, 2.0, 0.0]), 1.5);
    }

    #[test]
    fn the_envelope_bounds_the_maximum_from_above() {
        let envelope = Envelope { function: function!(|p| p.response[0]), sharpness: 50.0 };
        let value = over(envelope, &[0.1, 0.9, 1.0]);
        assert!(value > 1.0 && value < 1.0 + 3f64.ln() / 50.0, "{value}");
    }
}
