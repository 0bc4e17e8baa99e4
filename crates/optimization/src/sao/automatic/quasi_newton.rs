//! Quasi-Newton matrices from the changes of a gradient along accepted steps.

use nalgebra::{DMatrix, DVector};
use nlp::powell_damping;

/// A step and the change of the gradient along it, in variables divided by their lengths.
pub(super) type SecantPair = [DVector<f64>; 2];

/// Least |vᵀs| / ‖v‖‖s‖ of a symmetric rank-one update.
const SKIP: f64 = 1e-6;

/// sᵀy / sᵀs of the newest pair that `is_usable`.
fn initial(pairs: &[SecantPair], is_usable: impl Fn(f64) -> bool) -> Option<DMatrix<f64>> {
    let θ = pairs.iter().rev().map(|[s, y]| s.dot(y) / s.norm_squared()).find(|&θ| θ.is_finite() && is_usable(θ))?;
    let n = pairs[0][0].len();
    Some(DMatrix::identity(n, n) * θ)
}

fn rank_one(b: &mut DMatrix<f64>, weight: f64, v: &DVector<f64>) {
    if weight.is_finite() {
        b.ger(weight, v, v, 1.0);
    }
}

/// B by BFGS updates, the oldest pair first; pairs with sᵀy ≤ 0 are skipped. `None` without such a pair.
pub(super) fn bfgs(pairs: &[SecantPair]) -> Option<DMatrix<f64>> {
    let mut b = initial(pairs, |θ| θ > 0.0)?;
    for [s, y] in pairs {
        let bs = &b * s;
        let (expected, seen) = (s.dot(&bs), s.dot(y));
        if seen > 0.0 && expected > 0.0 {
            rank_one(&mut b, -1.0 / expected, &bs);
            rank_one(&mut b, 1.0 / seen, y);
        }
    }
    finite(b)
}

/// B by BFGS updates with Powell's damping; always positive definite. `None` without a pair with sᵀy > 0.
///
/// # Sources
///
/// Powell (1978); Nocedal & Wright, *Numerical Optimization*, procedure 18.2.
pub(super) fn damped_bfgs(pairs: &[SecantPair]) -> Option<DMatrix<f64>> {
    let mut b = initial(pairs, |θ| θ > 0.0)?;
    for [s, y] in pairs {
        let bs = &b * s;
        let (expected, seen) = (s.dot(&bs), s.dot(y));
        if !(expected > 0.0) {
            continue;
        }
        let θ = powell_damping(expected, seen);
        let r = y * θ + &bs * (1.0 - θ);
        rank_one(&mut b, -1.0 / expected, &bs);
        rank_one(&mut b, 1.0 / s.dot(&r), &r);
    }
    finite(b)
}

/// B by symmetric rank-one updates, the oldest pair first. `None` without a pair.
///
/// # Sources
///
/// Conn, Gould & Toint, *Math. Program.* 50 (1991) 177–195.
pub(super) fn sr1(pairs: &[SecantPair]) -> Option<DMatrix<f64>> {
    let mut b = initial(pairs, |_| true)?;
    for [s, y] in pairs {
        let v = y - &b * s;
        let product = v.dot(s);
        if product.abs() > SKIP * v.norm() * s.norm() {
            rank_one(&mut b, 1.0 / product, &v);
        }
    }
    finite(b)
}

fn finite(b: DMatrix<f64>) -> Option<DMatrix<f64>> {
    b.iter().all(|v| v.is_finite()).then_some(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pairs of a quadratic with an indefinite Hessian, along three independent steps.
    fn pairs(h: &DMatrix<f64>) -> Vec<SecantPair> {
        let steps = [[1.0, 0.2, -0.3], [0.1, 1.0, 0.5], [-0.4, 0.3, 1.0]];
        steps.iter().map(|s| DVector::from_column_slice(s)).map(|s| [s.clone(), h * s]).collect()
    }

    #[test]
    fn symmetric_rank_one_updates_recover_an_indefinite_hessian() {
        let h = DMatrix::from_row_slice(3, 3, &[2.0, 0.5, 0.0, 0.5, -1.0, 0.3, 0.0, 0.3, 4.0]);
        assert!((sr1(&pairs(&h)).unwrap() - h).amax() < 1e-12);
    }

    #[test]
    fn damped_updates_stay_positive_definite_where_plain_ones_skip() {
        let h = DMatrix::from_diagonal(&DVector::from_vec(vec![2.0, -1.0, 4.0]));
        let pairs = pairs(&h);
        assert!(damped_bfgs(&pairs).unwrap().cholesky().is_some());
        let [s, y] = &pairs[2];
        assert!((bfgs(&pairs).unwrap() * s - y).norm() < 1e-12, "the secant condition of the newest pair");
        assert!(bfgs(&[[s.clone(), -s]]).is_none());
    }

    #[test]
    fn a_linear_function_stays_linear() {
        let s = DVector::from_vec(vec![1.0, 2.0]);
        assert_eq!(sr1(&[[s, DVector::zeros(2)]]).unwrap().amax(), 0.0);
    }
}
