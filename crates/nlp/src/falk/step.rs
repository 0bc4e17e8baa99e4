//! The damped Newton step of the dual: a quadratic program in the multipliers with λ ≥ 0.

use nalgebra::{DMatrix, DVector};

/// The largest g·d − ½ dᵀ(B + μD) d with λ + d ≥ 0 (for inequality rows), by active sets; `None` if it has no solution.
pub(super) fn newton(
    λ: &DVector<f64>,
    rows: &DVector<f64>,
    bend: &DMatrix<f64>,
    damping: &DVector<f64>,
    signed: &[bool],
) -> Option<DVector<f64>> {
    let m = λ.len();
    let k = bend + DMatrix::from_diagonal(damping);
    // Held at zero to begin with: rows that are satisfied and without price.
    let mut held: Vec<bool> = (0..m).map(|i| !signed[i] && λ[i] == 0.0 && rows[i] <= 0.0).collect();
    for _ in 0..3 * m + 3 {
        let d = solve(&k, λ, rows, &held)?;
        let beyond = (0..m).filter(|&i| !held[i] && !signed[i] && λ[i] + d[i] < 0.0).collect::<Vec<_>>();
        if !beyond.is_empty() {
            beyond.into_iter().for_each(|i| held[i] = true);
            continue;
        }
        let pull = rows - &k * &d;
        let released = (0..m).filter(|&i| held[i] && pull[i] > 1e-14 * rows[i].abs());
        match released.max_by(|&a, &b| pull[a].total_cmp(&pull[b])) {
            Some(i) => held[i] = false,
            None => return Some(d),
        }
    }
    // Cycling: the last resort is the diagonal, which decouples the rows.
    Some(DVector::from_fn(m, |i, _| {
        let d = rows[i] / (k.row(i).iter().map(|v| v.abs()).sum::<f64>());
        if signed[i] { d } else { d.max(-λ[i]) }
    }))
}

/// d with dᵢ = −λᵢ where held.
fn solve(k: &DMatrix<f64>, λ: &DVector<f64>, rows: &DVector<f64>, held: &[bool]) -> Option<DVector<f64>> {
    let free: Vec<usize> = (0..λ.len()).filter(|&i| !held[i]).collect();
    let mut d = DVector::from_fn(λ.len(), |i, _| if held[i] { -λ[i] } else { 0.0 });
    if free.is_empty() {
        return Some(d);
    }
    let right = rows - k * &d;
    let right = DVector::from_iterator(free.len(), free.iter().map(|&i| right[i]));
    let system = k.select_rows(&free).select_columns(&free);
    let solution = system.cholesky()?.solve(&right);
    free.iter().zip(solution.iter()).for_each(|(&i, v)| d[i] = *v);
    solution.iter().all(|v| v.is_finite()).then_some(d)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stops_at_zero_and_releases() {
        let k = DMatrix::from_row_slice(2, 2, &[2.0, 1.0, 1.0, 2.0]);
        let (λ, g) = (DVector::from_vec(vec![1.0, 0.0]), DVector::from_vec(vec![-4.0, 1.0]));
        let d = newton(&λ, &g, &k, &DVector::zeros(2), &[false, false]).unwrap();
        // Unconstrained: (−3, 2), which makes λ₁ negative; with λ₁ held at 0 the other is 1.
        assert!((d[0] + 1.0).abs() < 1e-15 && (d[1] - 1.0).abs() < 1e-15);
    }
}
