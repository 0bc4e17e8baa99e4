//! Matrix of a Newton step over the variables: a diagonal, or a diagonal and a few outer products.

use crate::low_rank::dot;
use nalgebra::{DMatrix, DVector, Dyn, LU};

/// The matrix K = diag(d) + Σ cᵢ uᵢ uᵢᵀ with d > 0, factorized.
///
/// $$ K^{-1} = D^{-1} - D^{-1} U (C^{-1} + U^T D^{-1} U)^{-1} U^T D^{-1} $$
///
/// # Sources
/// Golub & Van Loan, *Matrix Computations*, 4th ed. (2013), section 2.1.4 (Sherman, Morrison, Woodbury).
pub(super) struct CondensedKkt<'a> {
    pub diagonal: Vec<f64>,
    pub coupling: Option<Coupling<'a>>,
}

/// The outer products and the small matrix C⁻¹ + Uᵀ D⁻¹ U.
pub(super) struct Coupling<'a> {
    columns: &'a [Vec<f64>],
    weights: &'a [f64],
    small: LU<f64, Dyn, Dyn>,
}

impl<'a> CondensedKkt<'a> {
    /// Factorizes K; there may be no outer products.
    pub fn new(diagonal: Vec<f64>, columns: &'a [Vec<f64>], weights: &'a [f64]) -> Self {
        if columns.is_empty() {
            return Self { diagonal, coupling: None };
        }
        let k = columns.len();
        let mut small = DMatrix::zeros(k, k);
        for p in 0..k {
            let weighted: Vec<f64> = columns[p].iter().zip(&diagonal).map(|(u, d)| u / d).collect();
            for q in 0..=p {
                let entry = dot(&weighted, &columns[q]);
                (small[(p, q)], small[(q, p)]) = (entry, entry);
            }
            small[(p, p)] += 1.0 / weights[p];
        }
        Self { diagonal, coupling: Some(Coupling { columns, weights, small: small.lu() }) }
    }

    /// K⁻¹ r; `None` if K is singular.
    pub fn solve(&self, right: &DVector<f64>) -> Option<DVector<f64>> {
        let divided = |r: &DVector<f64>| DVector::from_fn(r.len(), |j, _| r[j] / self.diagonal[j]);
        let by_diagonal = divided(right);
        let Some(coupling) = &self.coupling else { return Some(by_diagonal) };
        let products =
            DVector::from_fn(coupling.columns.len(), |i, _| dot(&coupling.columns[i], by_diagonal.as_slice()));
        let factors = coupling.small.solve(&products)?;
        let mut correction = DVector::zeros(right.len());
        for (u, factor) in coupling.columns.iter().zip(&factors) {
            correction.iter_mut().zip(u).for_each(|(r, u)| *r += factor * u);
        }
        let solution = divided(&(right - correction));
        solution.iter().all(|v: &f64| v.is_finite()).then_some(solution)
    }

    /// Adds K to an n × n matrix.
    pub fn add_to(&self, matrix: &mut DMatrix<f64>) {
        for (j, d) in self.diagonal.iter().enumerate() {
            matrix[(j, j)] += d;
        }
        if let Some(coupling) = &self.coupling {
            for (u, &c) in coupling.columns.iter().zip(coupling.weights) {
                let u = DVector::from_column_slice(u);
                matrix.ger(c, &u, &u, 1.0);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solve_agrees_with_the_dense_matrix() {
        let columns = [vec![1.0, 0.0, -2.0, 0.5], vec![0.2, 1.0, 1.0, 0.0]];
        let weights = [3.0, -0.5];
        let k = CondensedKkt::new(vec![2.0, 3.0, 1.0, 1e9], &columns, &weights);
        let mut whole = DMatrix::zeros(4, 4);
        k.add_to(&mut whole);
        let right = DVector::from_vec(vec![1.0, -2.0, 0.3, 0.0]);
        let (solution, exact) = (k.solve(&right).unwrap(), whole.lu().solve(&right).unwrap());
        assert!((solution - exact).amax() < 1e-14);
    }
}
