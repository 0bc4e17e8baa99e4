//! Tables of positions over time.

use crate::motion::Motion;
use autodiff::Scalar;

/// A table, interpolated by the natural cubic spline and extrapolated linearly; p = \[scale\].
#[derive(Clone, Debug)]
pub struct TabulatedMotion {
    times: Vec<f64>,
    values: Vec<f64>,
    curvatures: Vec<f64>,
}

impl TabulatedMotion {
    /// A table of `values` at the increasing `times` (s).
    ///
    /// # Errors
    /// [`crate::Error::Definition`] unless there are at least two points, times increase and values are finite.
    ///
    /// # Sources
    /// de Boor, *A Practical Guide to Splines* (1978), Chapter IV.
    pub fn new(times: &[f64], values: &[f64]) -> crate::Result<Self> {
        crate::Error::check_length("table values", times.len(), values.len())?;
        if times.len() < 2 || times.windows(2).any(|w| !(w[0] < w[1])) || values.iter().any(|v| !v.is_finite()) {
            let why = "needs two or more points at increasing times with finite values";
            return Err(crate::Error::definition("motion table", why, "sort the points and remove duplicates"));
        }
        let curvatures = natural_curvatures(times, values);
        Ok(Self { times: times.to_vec(), values: values.to_vec(), curvatures })
    }
}

/// Second derivatives at the knots, zero at both ends: a tridiagonal system.
fn natural_curvatures(x: &[f64], y: &[f64]) -> Vec<f64> {
    let n = x.len();
    let (mut ratio, mut m) = (vec![0.0; n], vec![0.0; n]);
    for i in 1..n - 1 {
        let (left, right) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        let pivot = 2.0 * (left + right) - left * ratio[i - 1];
        let bend = 6.0 * ((y[i + 1] - y[i]) / right - (y[i] - y[i - 1]) / left);
        ratio[i] = right / pivot;
        m[i] = (bend - left * m[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        m[i] -= ratio[i] * m[i + 1];
    }
    m
}

impl Motion for TabulatedMotion {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let (x, y, m) = (&self.times, &self.values, &self.curvatures);
        let last = x.len() - 1;
        let i = x.partition_point(|&knot| knot <= t.re()).clamp(1, last) - 1;
        let h = x[i + 1] - x[i];
        let slope = (y[i + 1] - y[i]) / h - h * (2.0 * m[i] + m[i + 1]) / 6.0;
        let s = t - x[i];
        if t.re() < x[0] {
            return p[0] * (s * slope + y[0]);
        }
        if t.re() > x[last] {
            let end = (y[last] - y[i]) / h + h * (m[i] + 2.0 * m[last]) / 6.0;
            return p[0] * ((t - x[last]) * end + y[last]);
        }
        p[0] * (s * (s * (s * ((m[i + 1] - m[i]) / (6.0 * h)) + 0.5 * m[i]) + slope) + y[i])
    }

    fn breaks(&self, _p: &[f64]) -> Vec<f64> {
        self.times.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::with_rates;

    #[test]
    fn a_table_goes_through_its_points_smoothly() {
        // A sine from 0 to π has no curvature at its ends, as a natural spline.
        let times: Vec<f64> = (0..9).map(|k| std::f64::consts::PI / 8.0 * f64::from(k)).collect();
        let values: Vec<f64> = times.iter().map(|t| t.sin()).collect();
        let table = TabulatedMotion::new(&times, &values).unwrap();
        for k in 1..8 {
            let (before, after) = (times[k] - 1e-9, times[k] + 1e-9);
            let (a, b) = (with_rates(&table, &[1.0], before), with_rates(&table, &[1.0], after));
            assert!((a[0] - values[k]).abs() < 1e-8 && (a[1] - b[1]).abs() < 1e-7 && (a[2] - b[2]).abs() < 1e-6);
        }
        let outside = with_rates(&table, &[2.0], 4.0);
        assert!(outside[2] == 0.0 && (outside[1] + 2.0).abs() < 0.01, "{outside:?}");
        assert!(TabulatedMotion::new(&[0.0, 0.0], &[1.0, 2.0]).is_err());
    }
}
