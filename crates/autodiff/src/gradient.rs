//! Gradients, Jacobians and Hessians in chunks of fixed width.
//!
//! Each chunk is one evaluation. Chunks run in parallel and are combined in their order: the result has the same bits
//! for any number of threads. Functions are called through a reference, so that the parallel loops are compiled once.

use crate::{BLOCK, Dual, HyperDual, WIDTH};
use nalgebra::{Const, DMatrix, U1};
use rayon::prelude::*;

/// Dual numbers with the values `x`; derivative k is that with respect to variable `first + k`, for k below [`WIDTH`].
pub fn seed(x: &[f64], first: usize) -> Vec<Dual> {
    let dual = |(i, &v): (usize, &f64)| match i.checked_sub(first) {
        Some(k) if k < WIDTH => Dual::from_re(v).derivative(k),
        _ => Dual::from_re(v),
    };
    x.iter().enumerate().map(dual).collect()
}

/// First derivatives of `value` with respect to the first `count` variables of [`seed`], at most [`WIDTH`].
pub fn partials(value: &Dual, count: usize) -> Vec<f64> {
    value.eps.unwrap_generic(Const::<WIDTH>, U1).as_slice()[..count.min(WIDTH)].to_vec()
}

/// Value and gradient of `f` at `x`.
///
/// Takes ⌈n / [`WIDTH`]⌉ evaluations. Without variables the gradient is empty and the value is still computed.
pub fn gradient(f: impl Fn(&[Dual]) -> Dual + Sync, x: &[f64]) -> (f64, Vec<f64>) {
    let (values, rows) = jacobian_of(&|x| vec![f(x)], x);
    (values[0], rows.row(0).iter().copied().collect())
}

/// Values (length m) and Jacobian (m × n) of `f` at `x` (length n).
pub fn jacobian(f: impl Fn(&[Dual]) -> Vec<Dual> + Sync, x: &[f64]) -> (Vec<f64>, DMatrix<f64>) {
    jacobian_of(&f, x)
}

fn jacobian_of(f: &(dyn Fn(&[Dual]) -> Vec<Dual> + Sync), x: &[f64]) -> (Vec<f64>, DMatrix<f64>) {
    let chunks: Vec<Vec<Dual>> =
        (0..x.len().div_ceil(WIDTH).max(1)).into_par_iter().map(|c| f(&seed(x, c * WIDTH))).collect();
    let values: Vec<f64> = chunks[0].iter().map(|v| v.re).collect();
    let mut rows = DMatrix::zeros(values.len(), x.len());
    for (c, chunk) in chunks.iter().enumerate() {
        for (i, value) in chunk.iter().enumerate() {
            for (k, partial) in partials(value, x.len() - c * WIDTH).into_iter().enumerate() {
                rows[(i, c * WIDTH + k)] = partial;
            }
        }
    }
    (values, rows)
}

/// Value, gradient and Hessian (n × n, symmetric) of `f` at `x`.
///
/// Hyper-dual numbers give one block of [`BLOCK`] × [`BLOCK`] second derivatives per evaluation; only blocks of the upper
/// triangle are evaluated.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::hessian;
/// let (value, gradient, hessian) = hessian(|x| x[0] * x[0] * x[1], &[2.0, 5.0]);
/// assert_eq!((value, gradient), (20.0, vec![20.0, 4.0]));
/// assert_eq!(hessian.as_slice(), [10.0, 4.0, 4.0, 0.0]);
/// ```
pub fn hessian(f: impl Fn(&[HyperDual]) -> HyperDual + Sync, x: &[f64]) -> (f64, Vec<f64>, DMatrix<f64>) {
    hessian_of(&f, x)
}

fn hessian_of(f: &(dyn Fn(&[HyperDual]) -> HyperDual + Sync), x: &[f64]) -> (f64, Vec<f64>, DMatrix<f64>) {
    let n = x.len();
    let blocks = n.div_ceil(BLOCK).max(1);
    let pairs: Vec<(usize, usize)> = (0..blocks).flat_map(|a| (a..blocks).map(move |b| (a, b))).collect();
    let results: Vec<HyperDual> = pairs.par_iter().map(|&(a, b)| f(&seed_pairs(x, a * BLOCK, b * BLOCK))).collect();
    let (mut gradient, mut hessian) = (vec![0.0; n], DMatrix::zeros(n, n));
    for (&(a, b), value) in pairs.iter().zip(&results) {
        let first = value.eps1.unwrap_generic(Const::<BLOCK>, U1);
        let second = value.eps1eps2.unwrap_generic(Const::<BLOCK>, Const::<BLOCK>);
        for i in 0..BLOCK.min(n.saturating_sub(a * BLOCK)) {
            gradient[a * BLOCK + i] = first[i];
            for j in 0..BLOCK.min(n - b * BLOCK) {
                hessian[(a * BLOCK + i, b * BLOCK + j)] = second[(i, j)];
                hessian[(b * BLOCK + j, a * BLOCK + i)] = second[(i, j)];
            }
        }
    }
    (results[0].re, gradient, hessian)
}

/// Hyper-dual numbers seeded in the variables from `first` on, and from `second` on.
fn seed_pairs(x: &[f64], first: usize, second: usize) -> Vec<HyperDual> {
    let mut variable: Vec<HyperDual> = x.iter().map(|&v| HyperDual::from_re(v)).collect();
    for k in 0..BLOCK {
        if let Some(v) = variable.get_mut(first + k) {
            *v = v.derivative1(k);
        }
        if let Some(v) = variable.get_mut(second + k) {
            *v = v.derivative2(k);
        }
    }
    variable
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scalar;

    /// Σ i·xᵢ² xᵢ₊₁ + sin x₀: gradient and Hessian known in closed form.
    fn chain<S: Scalar>(x: &[S]) -> S {
        let links = (0..x.len() - 1).map(|i| x[i].powi(2) * x[i + 1] * i as f64);
        links.fold(x[0].sin(), |a, b| a + b)
    }

    fn point(n: usize) -> Vec<f64> {
        (0..n).map(|i| 0.3 + 0.1 * i as f64).collect()
    }

    #[test]
    fn gradient_spans_several_chunks() {
        let x = point(19);
        let (_, g) = gradient(chain, &x);
        assert_eq!(g[0], 0.3f64.cos());
        for i in 1..18 {
            let exact = 2.0 * i as f64 * x[i] * x[i + 1] + (i - 1) as f64 * x[i - 1].powi(2);
            assert!((g[i] - exact).abs() < 1e-12, "{i}");
        }
    }

    #[test]
    fn hessian_is_symmetric_and_exact() {
        let x = point(11);
        let (_, g, h) = hessian(chain, &x);
        assert_eq!(g, gradient(chain, &x).1);
        for i in 1..10 {
            assert!((h[(i, i)] - 2.0 * i as f64 * x[i + 1]).abs() < 1e-12);
            assert!((h[(i, i + 1)] - 2.0 * i as f64 * x[i]).abs() < 1e-12);
            assert_eq!(h[(i, i + 1)], h[(i + 1, i)]);
        }
        assert_eq!(h[(0, 10)], 0.0);
    }

    #[test]
    fn same_bits_for_any_number_of_threads() {
        let x = point(40);
        let evaluate = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| (gradient(chain, &x), hessian(chain, &x)))
        };
        assert_eq!(evaluate(1), evaluate(4));
    }

    #[test]
    fn no_variables_is_no_error() {
        assert_eq!(gradient(|_| Dual::from_re(2.0), &[]), (2.0, vec![]));
    }
}
