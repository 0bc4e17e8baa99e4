//! Quadratic functions whose Hessian is a diagonal plus a few outer products.

use autodiff::Scalar;
use nalgebra::{DMatrix, DVector};

/// The quadratic ½ dᵀ B d about an origin, d = x − x₀, with
///
/// $$ B = \operatorname{diag}(δ) + \sum_{i=1}^{k} c_i u_i u_i^T , $$
///
/// which stores n (k + 2) numbers and no n × n matrix. B is symmetric; it is not checked for definiteness.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LowRank {
    /// x₀, length n.
    pub origin: Vec<f64>,
    /// δ, length n.
    pub diagonal: Vec<f64>,
    /// u₁ … u_k, each of length n.
    pub columns: Vec<Vec<f64>>,
    /// c₁ … c_k, none zero.
    pub weights: Vec<f64>,
}

/// a·b.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl LowRank {
    /// A quadratic with a diagonal Hessian.
    pub fn diagonal(origin: Vec<f64>, diagonal: Vec<f64>) -> Self {
        Self { origin, diagonal, columns: vec![], weights: vec![] }
    }

    /// Adds c u uᵀ; does nothing if c is zero.
    pub fn add(&mut self, weight: f64, column: Vec<f64>) {
        if weight != 0.0 {
            self.weights.push(weight);
            self.columns.push(column);
        }
    }

    /// B d.
    pub fn times(&self, d: &[f64]) -> Vec<f64> {
        let mut product: Vec<f64> = self.diagonal.iter().zip(d).map(|(δ, d)| δ * d).collect();
        for (u, c) in self.columns.iter().zip(&self.weights) {
            let factor = c * dot(u, d);
            product.iter_mut().zip(u).for_each(|(p, u)| *p += factor * u);
        }
        product
    }

    fn step(&self, x: &[f64]) -> Vec<f64> {
        x.iter().zip(&self.origin).map(|(x, o)| x - o).collect()
    }

    /// Value and gradient B d at `x` (length n).
    pub fn value_and_slope(&self, x: &[f64]) -> (f64, Vec<f64>) {
        let d = self.step(x);
        let slope = self.times(&d);
        (0.5 * dot(&d, &slope), slope)
    }

    /// The value at `x` for any scalar type.
    pub fn at<S: Scalar>(&self, x: &[S]) -> S {
        let d: Vec<S> = x.iter().zip(&self.origin).map(|(&x, &o)| x - o).collect();
        let squares = d.iter().zip(&self.diagonal).fold(S::from(0.0), |sum, (&d, &δ)| sum + d * d * δ);
        let product = |u: &[f64]| d.iter().zip(u).fold(S::from(0.0), |sum, (&d, &u)| sum + d * u);
        let terms = self.columns.iter().zip(&self.weights).map(|(u, &c)| (product(u), c));
        terms.fold(squares, |sum, (a, c)| sum + a * a * c) * 0.5
    }

    /// B as a matrix, n × n.
    pub fn dense(&self) -> DMatrix<f64> {
        let mut b = DMatrix::from_diagonal(&DVector::from_column_slice(&self.diagonal));
        for (u, &c) in self.columns.iter().zip(&self.weights) {
            let u = DVector::from_column_slice(u);
            b.ger(c, &u, &u, 1.0);
        }
        b
    }

    /// This quadratic as a function of z = x / `lengths`, divided by `unit`.
    #[must_use]
    pub fn scaled(&self, lengths: &[f64], unit: f64) -> Self {
        let times = |v: &[f64]| v.iter().zip(lengths).map(|(v, s)| v * s).collect::<Vec<f64>>();
        Self {
            origin: self.origin.iter().zip(lengths).map(|(o, s)| o / s).collect(),
            diagonal: self.diagonal.iter().zip(lengths).map(|(δ, s)| δ * s * s / unit).collect(),
            columns: self.columns.iter().map(|u| times(u)).collect(),
            weights: self.weights.iter().map(|c| c / unit).collect(),
        }
    }

    /// This quadratic with one more variable, on which it does not depend.
    #[must_use]
    pub fn extended(&self) -> Self {
        let with_zero = |v: &[f64]| v.iter().copied().chain([0.0]).collect::<Vec<f64>>();
        Self {
            origin: with_zero(&self.origin),
            diagonal: with_zero(&self.diagonal),
            columns: self.columns.iter().map(|u| with_zero(u)).collect(),
            weights: self.weights.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::{HyperDual, hessian};

    fn sample() -> LowRank {
        let mut b = LowRank::diagonal(vec![0.5, -1.0, 2.0], vec![2.0, 1.0, 0.5]);
        b.add(3.0, vec![1.0, 0.0, -2.0]);
        b.add(-0.5, vec![0.2, 1.0, 1.0]);
        b.add(0.0, vec![9.0; 3]);
        b
    }

    #[test]
    fn value_slope_and_matrix_agree_with_duals() {
        let (b, x) = (sample(), [1.0, 2.0, -0.3]);
        let (value, slope, curvature) = hessian(|x: &[HyperDual]| b.at(x), &x);
        let (v, s) = b.value_and_slope(&x);
        assert!((v - value).abs() < 1e-13);
        assert!(s.iter().zip(&slope).all(|(a, b)| (a - b).abs() < 1e-13));
        assert!((b.dense() - curvature).amax() < 1e-13);
        assert_eq!(b.columns.len(), 2);
    }

    #[test]
    fn other_units_do_not_change_the_value() {
        let (b, lengths) = (sample(), [10.0, 0.1, 2.0]);
        let (x, z) = ([1.0, 2.0, -0.3], [0.1, 20.0, -0.15]);
        assert!((b.scaled(&lengths, 4.0).value_and_slope(&z).0 * 4.0 - b.value_and_slope(&x).0).abs() < 1e-12);
        assert_eq!(b.extended().at(&[1.0, 2.0, -0.3, 7.0]), b.at(&x));
    }
}
