//! The curvature of the Lagrangian that a quadratic program can use: symmetric and positive definite.

use super::state::SqpState;
use nalgebra::{DMatrix, DVector};

/// Powell's share of the predicted curvature that a damped update keeps.
const DAMPING: f64 = 0.2;
/// Smallest curvature, relative to the largest number of the scaled program.
const FLOOR: f64 = 1e-8;

/// unit · S⁻²: a step of one unit in every variable costs the same.
pub(super) fn initial(scale: &[f64], unit: f64) -> DMatrix<f64> {
    DMatrix::from_diagonal(&DVector::from_iterator(scale.len(), scale.iter().map(|s| unit / (s * s))))
}

/// The damped BFGS update of B by the step `d` and the change `y` of the Lagrangian's gradient.
///
/// $$ B ← B - \frac{B d d^T B}{d^T B d} + \frac{r r^T}{d^T r},\qquad r = θ y + (1 - θ) B d $$
///
/// with θ such that dᵀr ≥ 0.2 dᵀBd, so that B stays positive definite.
///
/// **Source.** Powell (1978); Nocedal & Wright, procedure 18.2.
pub(super) fn damped_bfgs(b: &mut DMatrix<f64>, d: &DVector<f64>, y: &DVector<f64>) {
    let bd = &*b * d;
    let (curved, seen) = (d.dot(&bd), d.dot(y));
    if curved <= 0.0 || !curved.is_finite() || !seen.is_finite() {
        return;
    }
    let θ = if seen >= DAMPING * curved { 1.0 } else { (1.0 - DAMPING) * curved / (curved - seen) };
    let r = y * θ + &bd * (1.0 - θ);
    let gain = d.dot(&r);
    let mut next = &*b + &r * r.transpose() / gain - &bd * bd.transpose() / curved;
    next.fill_lower_triangle_with_upper_triangle();
    if next.iter().all(|v| v.is_finite()) {
        *b = next;
    }
}

/// A positive definite matrix that gives the step of the exact Hessian `h` wherever that is a descent on the active rows.
///
/// In variables scaled by `scale`, in this order: H itself; H with stiffness across the active rows and bounds, which
/// changes nothing along them; H with the absolute values of its eigenvalues.
pub(super) fn convexified(h: &DMatrix<f64>, state: &SqpState, scale: &[f64], unit: f64) -> DMatrix<f64> {
    let n = scale.len();
    let scaled = DMatrix::from_fn(n, n, |i, j| h[(i, j)] * scale[i] * scale[j]);
    let size = scaled.amax().max(unit);
    let floor = DMatrix::identity(n, n) * (FLOOR * size);
    let lifted = &scaled + &floor;
    let convex = if lifted.clone().cholesky().is_some() {
        lifted
    } else {
        let stiff = &lifted + across_active(state, scale) * (10.0 * size);
        if stiff.clone().cholesky().is_some() { stiff } else { absolute(scaled, FLOOR * size) }
    };
    DMatrix::from_fn(n, n, |i, j| convex[(i, j)] / scale[i] / scale[j])
}

/// Σ a aᵀ / aᵀa over the rows and bounds with multipliers.
fn across_active(state: &SqpState, scale: &[f64]) -> DMatrix<f64> {
    let n = scale.len();
    let mut out = DMatrix::zeros(n, n);
    for (i, _) in state.multipliers.iter().enumerate().filter(|(_, λ)| **λ != 0.0) {
        let a = DVector::from_iterator(n, (0..n).map(|j| state.row_slopes[(i, j)] * scale[j]));
        if a.norm_squared() > 0.0 {
            out += &a * a.transpose() / a.norm_squared();
        }
    }
    for j in (0..n).filter(|&j| state.lower_multipliers[j] > 0.0 || state.upper_multipliers[j] > 0.0) {
        out[(j, j)] += 1.0;
    }
    out
}

/// |H|, with eigenvalues of at least `floor`.
fn absolute(h: DMatrix<f64>, floor: f64) -> DMatrix<f64> {
    let mut eigen = h.symmetric_eigen();
    eigen.eigenvalues.iter_mut().for_each(|e| *e = e.abs().max(floor));
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
    fn stiffness_across_an_active_row_makes_a_saddle_usable() {
        // xy on x + y = 2 is −d² + 1 along the row's normal only if the row is not held; along it, it is concave;
        // −xy is convex along it.
        let h = DMatrix::from_row_slice(2, 2, &[0.0, -1.0, -1.0, 0.0]);
        let mut state = SqpState::default();
        (state.multipliers, state.row_slopes) = (vec![1.0], DMatrix::from_element(1, 2, 1.0));
        (state.lower_multipliers, state.upper_multipliers) = (vec![0.0; 2], vec![0.0; 2]);
        let b = convexified(&h, &state, &[1.0, 1.0], 1.0);
        let along = DVector::from_vec(vec![1.0, -1.0]);
        assert!((along.dot(&(&b * &along)) - 2.0).abs() < 1e-6);
    }
}
