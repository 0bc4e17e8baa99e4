//! Orthonormal bases, by the modified Gram–Schmidt process with reorthogonalization.

use nalgebra::DVector;

/// Orthonormal vectors that span the given ones. A vector counts as linearly dependent on those before it if the norm of its part orthogonal to them
/// is at most the fraction `dependent` of its own.
pub fn orthonormal_basis(vectors: impl Iterator<Item = DVector<f64>>, dependent: f64) -> Vec<DVector<f64>> {
    let mut basis = vec![];
    for vector in vectors {
        let rest = orthogonal_part(&vector, &basis);
        if rest.norm() > dependent * vector.norm() {
            basis.push(rest.normalize());
        }
    }
    basis
}

/// The part of a vector that is orthogonal to all vectors of an orthonormal `basis`.
pub fn orthogonal_part(vector: &DVector<f64>, basis: &[DVector<f64>]) -> DVector<f64> {
    let mut rest = vector.clone();
    // The second pass removes the rounding errors of the first.
    for _ in 0..2 {
        basis.iter().for_each(|known| rest.axpy(-known.dot(&rest), known, 1.0));
    }
    rest
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nearly_dependent_vectors_have_an_orthonormal_basis() {
        let vectors = [[1.0, 1.0, 0.0], [1.0, 1.0 + 1e-9, 0.0], [2.0, 2.0, 0.0], [0.0, 0.0, 3.0]];
        let basis = orthonormal_basis(vectors.iter().map(|v| DVector::from_column_slice(v)), 1e-12);
        assert_eq!(basis.len(), 3);
        for (i, a) in basis.iter().enumerate() {
            for (k, b) in basis.iter().enumerate() {
                assert!((a.dot(b) - f64::from(u8::from(i == k))).abs() < 1e-14);
            }
        }
        let rest = orthogonal_part(&DVector::from_column_slice(&[1.0, 2.0, 3.0]), &basis[..1]);
        assert!(rest.dot(&basis[0]).abs() < 1e-15);
    }
}
