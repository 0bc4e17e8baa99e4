//! Positive definite Hessians for the quadratic program: BFGS updates and convexified exact Hessians.

use super::state::SqpState;
use crate::{orthonormal_basis, powell_damping};
use nalgebra::{DMatrix, DVector};

/// Least curvature, relative to the balanced one of each variable.
const FLOOR: f64 = 1e-8;
/// Size of entries of the Hessian, relative to the largest one, that counts as rounding.
const ROUNDING: f64 = 1e-15;
/// Size of a row of zeros, as a fraction of the largest entry: its variable is limited by bounds and rows alone.
const ALONE: f64 = 1e-6;
/// Number of passes in which the rows are balanced.
const PASSES: usize = 10;
/// Relative norm of the part of a vector orthogonal to others, below which it counts as linearly dependent on them.
pub(super) const DEPENDENT: f64 = 1e-6;

/// The initial Hessian unit · S⁻², with the scales S of the variables on the diagonal.
pub(super) fn initial(scale: &[f64], unit: f64) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_iterator(scale.len(), scale.iter().map(|s| unit / (s * s))))
}

/// The damped BFGS update of B by the step `d` and the change `y` of the Lagrangian's gradient.
///
/// $$ B ← B - \frac{B d d^T B}{d^T B d} + \frac{r r^T}{d^T r},\qquad r = θ y + (1 - θ) B d $$
///
/// with θ such that dᵀr ≥ 0.2 dᵀBd, so that B stays positive definite.
///
/// # Sources
/// Powell (1978); Nocedal & Wright, procedure 18.2.
pub(super) fn damped_bfgs(b: &mut DMatrix<f64>, d: &DVector<f64>, y: &DVector<f64>) {
    let bd = &*b * d;
    let (previous, measured) = (d.dot(&bd), d.dot(y));
    if previous <= 0.0 || !previous.is_finite() || !measured.is_finite() {
        return;
    }
    let θ = powell_damping(previous, measured);
    let r = y * θ + &bd * (1.0 - θ);
    let curvature = d.dot(&r);
    let mut next = &*b + &r * r.transpose() / curvature - &bd * bd.transpose() / previous;
    next.fill_lower_triangle_with_upper_triangle();
    if next.iter().all(|v| v.is_finite()) {
        *b = next;
    }
}

/// A positive definite matrix with the same Newton step as the exact Hessian `h`, if H is convex on the active rows.
///
/// The first positive definite one of these, in variables scaled by `scale`: H itself; H plus a multiple of the outer
/// products of the active gradients, which does not change H on their null space; H with absolute eigenvalues.
pub(super) fn convexified(h: &DMatrix<f64>, state: &SqpState, scale: &[f64], unit: f64) -> DMatrix<f64> {
    let scaled = scaled(h, scale);
    let size = scaled.amax().max(unit);
    let floor = floor(&scaled, size, state.has_uniform_floor);
    let convex = if is_definite(&scaled + &floor) {
        at_least(scaled, &floor)
    } else {
        let augmented = &scaled + &floor + active_outer_products(state, scale) * (10.0 * size);
        if is_definite(augmented.clone()) { augmented } else { at_least(absolute_eigenvalues(scaled), &floor) }
    };
    unscaled(&convex, scale)
}

/// H with absolute eigenvalues on the tangent space of `normals`, in variables scaled by `scale`.
pub(super) fn absolute(
    h: &DMatrix<f64>,
    normals: &[DVector<f64>],
    (scale, unit): (&[f64], f64),
    is_uniform: bool,
) -> DMatrix<f64> {
    let scaled = scaled(h, scale);
    let floor = floor(&scaled, scaled.amax().max(unit), is_uniform);
    unscaled(&absolute_on_tangents(scaled, normals, &floor), scale)
}

/// The positive semidefinite H, plus `floor` if H is less than `floor` along any direction.
fn at_least(h: DMatrix<f64>, floor: &DMatrix<f64>) -> DMatrix<f64> {
    if is_definite(&h - floor) { h } else { h + floor }
}

fn is_definite(h: DMatrix<f64>) -> bool {
    h.cholesky().is_some()
}

fn scaled(h: &DMatrix<f64>, scale: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(scale.len(), scale.len(), |i, j| h[(i, j)] * scale[i] * scale[j])
}

fn unscaled(h: &DMatrix<f64>, scale: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(scale.len(), scale.len(), |i, j| h[(i, j)] / scale[i] / scale[j])
}

/// The fraction [`FLOOR`] of the curvature of each variable, as a diagonal matrix. Variables are balanced so that the largest entry of each
/// row of H is one; curvatures of very different size then have the same weight. A row of zeros counts as the fraction [`ALONE`] of `size`. If
/// `is_uniform`, each curvature counts as `size`.
///
/// # Sources
/// Ruiz, *A scaling algorithm to equilibrate both rows and columns norms in matrices* (2001).
fn floor(h: &DMatrix<f64>, size: f64, is_uniform: bool) -> DMatrix<f64> {
    let n = h.nrows();
    let entry = |i: usize, j: usize| Some(h[(i, j)].abs()).filter(|v| *v > ROUNDING * size).unwrap_or(0.0);
    let alone = if is_uniform { size } else { ALONE * size };
    let mut factors = vec![1.0 / alone.sqrt(); n];
    for _ in 0..if is_uniform { 0 } else { PASSES } {
        let largest = |i: usize| (0..n).map(|j| entry(i, j) * factors[i] * factors[j]).fold(0.0, f64::max);
        factors = (0..n).map(|i| factors[i] / Some(largest(i)).filter(|v| *v > 0.0).map_or(1.0, f64::sqrt)).collect();
    }
    DMatrix::from_diagonal(&DVector::from_iterator(n, factors.iter().map(|f| FLOOR / (f * f))))
}

/// Σ a aᵀ / aᵀa over the gradients a of the rows and bounds with nonzero multipliers.
fn active_outer_products(state: &SqpState, scale: &[f64]) -> DMatrix<f64> {
    let n = scale.len();
    let mut out = DMatrix::zeros(n, n);
    for (i, _) in state.multipliers.iter().enumerate().filter(|(_, λ)| **λ != 0.0) {
        let a = DVector::from_iterator(n, (0..n).map(|j| state.row_gradients[(i, j)] * scale[j]));
        if a.norm_squared() > 0.0 {
            out += &a * a.transpose() / a.norm_squared();
        }
    }
    for j in (0..n).filter(|&j| state.lower_multipliers[j] > 0.0 || state.upper_multipliers[j] > 0.0) {
        out[(j, j)] += 1.0;
    }
    out
}

/// A positive definite matrix that equals H in the products of a tangent with any vector, except that its eigenvalues on the tangents are
/// absolute values. Tangents are the vectors orthogonal to the orthonormal `normals`.
///
/// The eigenvalues of H itself may be large with opposite signs where its curvature along the tangents is small: their absolute values
/// would shorten all steps along the active rows. With tangents Z and normals Y the matrix is
///
/// $$ \begin{pmatrix} Z & Y \end{pmatrix} \begin{pmatrix} T & C \\ C^T & N + C^T T^{-1} C \end{pmatrix}
///    \begin{pmatrix} Z^T \\ Y^T \end{pmatrix},\quad T = |Z^T H Z|,\ N = |Y^T H Y|,\ C = Z^T H Y $$
///
/// T and N are at least `floor`.
fn absolute_on_tangents(h: DMatrix<f64>, normals: &[DVector<f64>], floor: &DMatrix<f64>) -> DMatrix<f64> {
    let n = h.nrows();
    if normals.is_empty() || normals.len() >= n || is_definite(&h + floor) {
        return at_least(absolute_eigenvalues(h), floor);
    }
    let units = (0..n).map(|j| DVector::from_fn(n, |i, _| f64::from(i == j)));
    let all = orthonormal_basis(normals.iter().cloned().chain(units), DEPENDENT);
    let (y, z) = (DMatrix::from_columns(&all[..normals.len()]), DMatrix::from_columns(&all[normals.len()..]));
    let along = |v: &DMatrix<f64>| at_least(absolute_eigenvalues(v.transpose() * &h * v), &(v.transpose() * floor * v));
    let (tangent, normal) = (along(&z), along(&y));
    let coupling = z.transpose() * &h * &y;
    let Some(factors) = tangent.clone().cholesky() else { return at_least(absolute_eigenvalues(h), floor) };
    // The Schur complement of the tangents is the block of the normals.
    let normal = normal + coupling.transpose() * factors.solve(&coupling);
    let cross = &z * coupling * y.transpose();
    &z * tangent * z.transpose() + &y * normal * y.transpose() + &cross + cross.transpose()
}

/// |H|.
fn absolute_eigenvalues(h: DMatrix<f64>) -> DMatrix<f64> {
    let mut eigen = h.symmetric_eigen();
    eigen.eigenvalues.iter_mut().for_each(|e| *e = e.abs());
    eigen.recompose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn update_satisfies_the_secant_condition_unless_damped() {
        let mut b = initial(&[1.0, 2.0], 3.0);
        let (d, y) = (DVector::from_vec(vec![1.0, -1.0]), DVector::from_vec(vec![2.0, -0.5]));
        damped_bfgs(&mut b, &d, &y);
        assert!((&b * &d - &y).norm() < 1e-14);
        damped_bfgs(&mut b, &d, &-y);
        assert!(b.cholesky().is_some());
    }

    #[test]
    fn absolute_eigenvalues_on_tangents_keep_the_curvature_along_a_row() {
        // Large curvatures of opposite sign; along the row x + y = 2 the curvature is 2·(100 − 99)/2 = 1.
        let h = DMatrix::from_row_slice(2, 2, &[100.0, 0.0, 0.0, -99.0]);
        let normal = DVector::from_vec(vec![1.0, 1.0]).normalize();
        let tangent = DVector::from_vec(vec![1.0, -1.0]);
        let b = absolute(&h, &[normal], (&[1.0, 1.0], 1.0), false);
        assert!(b.clone().cholesky().is_some());
        assert!((tangent.dot(&(&b * &tangent)) - 1.0).abs() < 1e-9, "{b}");
        assert!((tangent.dot(&(&b * DVector::from_vec(vec![1.0, 1.0]))) - 199.0).abs() < 1e-9, "{b}");
        let whole = absolute(&h, &[], (&[1.0, 1.0], 1.0), false);
        assert!((tangent.dot(&(&whole * &tangent)) - 199.0).abs() < 1e-9, "{whole}");
    }

    #[test]
    fn curvatures_of_very_different_size_are_kept() {
        let h = DMatrix::from_row_slice(3, 3, &[2e11, 3.0, 0.0, 3.0, 2e-3, 0.0, 0.0, 0.0, 0.0]);
        let convex = absolute(&h, &[], (&[1.0; 3], 1.0), false);
        assert!((convex[(1, 1)] / 2e-3 - 1.0).abs() < 1e-2, "{convex}");
        assert!((convex[(2, 2)] / 2e-3 - 1.0).abs() < 1e-2, "{convex}");
    }

    #[test]
    fn outer_products_of_an_active_row_make_a_saddle_convex() {
        // −xy is concave along the normal of x + y = 2 and convex along the row itself.
        let h = DMatrix::from_row_slice(2, 2, &[0.0, -1.0, -1.0, 0.0]);
        let mut state = SqpState::default();
        (state.multipliers, state.row_gradients) = (vec![1.0], DMatrix::from_element(1, 2, 1.0));
        (state.lower_multipliers, state.upper_multipliers) = (vec![0.0; 2], vec![0.0; 2]);
        let b = convexified(&h, &state, &[1.0, 1.0], 1.0);
        let direction = DVector::from_vec(vec![1.0, -1.0]);
        assert!((direction.dot(&(&b * &direction)) - 2.0).abs() < 1e-6);
    }
}
