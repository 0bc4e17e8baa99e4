//! Vectors of hyper-dual numbers: a value with first and second derivatives along pairs of directions.

use crate::chain_rule::impl_scalar;
use std::fmt;

/// `N` hyper-dual numbers that share one value, in plain arrays.
///
/// Number k has two directions a_k and b_k in the space of the variables. It carries the derivatives along a_k and b_k and
/// the mixed second derivative. The seeds choose the directions: two unit vectors give an entry of the Hessian, and a vector
/// v with the unit vectors gives the product of the Hessian with v.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::{DualNum, HyperDualVec};
/// let (x, y) = (HyperDualVec::<1>::variable(2.0, [1.0], [0.0]), HyperDualVec::<1>::variable(5.0, [0.0], [1.0]));
/// let f = x * x * y;
/// assert_eq!((f.re, f.a, f.b, f.ab), (20.0, [20.0], [4.0], [4.0]));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct HyperDualVec<const N: usize> {
    /// Value.
    pub re: f64,
    /// Derivatives along the first directions.
    pub a: [f64; N],
    /// Derivatives along the second directions.
    pub b: [f64; N],
    /// Mixed second derivatives.
    pub ab: [f64; N],
}

impl<const N: usize> HyperDualVec<N> {
    /// A number without derivatives.
    #[inline]
    pub fn constant(re: f64) -> Self {
        Self { re, a: [0.0; N], b: [0.0; N], ab: [0.0; N] }
    }

    /// A variable with its components in the first and in the second directions.
    #[inline]
    pub fn variable(re: f64, a: [f64; N], b: [f64; N]) -> Self {
        Self { re, a, b, ab: [0.0; N] }
    }

    #[inline]
    fn map(self, re: f64, f: impl Fn(f64) -> f64) -> Self {
        Self { re, a: self.a.map(&f), b: self.b.map(&f), ab: self.ab.map(&f) }
    }

    /// Combines the value `re` with the derivatives \[a, b, ab\] of every hyper-dual number.
    #[inline]
    fn from_parts(re: f64, f: impl Fn(usize) -> [f64; 3]) -> Self {
        let mut out = Self::constant(re);
        for k in 0..N {
            [out.a[k], out.b[k], out.ab[k]] = f(k);
        }
        out
    }

    #[inline]
    fn plus(self, o: Self) -> Self {
        Self::from_parts(self.re + o.re, |k| [self.a[k] + o.a[k], self.b[k] + o.b[k], self.ab[k] + o.ab[k]])
    }

    #[inline]
    fn times(self, o: Self) -> Self {
        Self::from_parts(self.re * o.re, |k| {
            let mixed = self.ab[k] * o.re + self.a[k] * o.b[k] + self.b[k] * o.a[k] + self.re * o.ab[k];
            [self.a[k] * o.re + self.re * o.a[k], self.b[k] * o.re + self.re * o.b[k], mixed]
        })
    }

    /// q = x/y, from the derivatives of x = q y.
    #[inline]
    fn divided_by(self, o: Self) -> Self {
        let (q, inverse) = (self.re / o.re, 1.0 / o.re);
        Self::from_parts(q, |k| {
            let (a, b) = ((self.a[k] - q * o.a[k]) * inverse, (self.b[k] - q * o.b[k]) * inverse);
            [a, b, (self.ab[k] - a * o.b[k] - b * o.a[k] - q * o.ab[k]) * inverse]
        })
    }

    #[inline]
    fn scaled(self, factor: f64) -> Self {
        self.map(self.re * factor, |x| x * factor)
    }

    #[inline]
    fn chain(self, f: f64, df: f64, ddf: impl FnOnce() -> f64) -> Self {
        let ddf = ddf();
        Self::from_parts(f, |k| [self.a[k] * df, self.b[k] * df, self.ab[k] * df + self.a[k] * self.b[k] * ddf])
    }

    /// θ = atan2(y, x): dθ = (x dy − y dx)/(x² + y²), differentiated once more.
    #[inline]
    fn angle(self, x: Self) -> Self {
        let (y, square) = (self, self.re * self.re + x.re * x.re);
        Self::from_parts(y.re.atan2(x.re), |k| {
            let (a, b) = ((x.re * y.a[k] - y.re * x.a[k]) / square, (x.re * y.b[k] - y.re * x.b[k]) / square);
            let spread = 2.0 * (x.re * x.b[k] + y.re * y.b[k]);
            let turn = x.b[k] * y.a[k] - y.b[k] * x.a[k] + x.re * y.ab[k] - y.re * x.ab[k];
            [a, b, (turn - a * spread) / square]
        })
    }

    #[inline]
    fn power(self, n: i32) -> Self {
        let (x, m) = (self.re, f64::from(n));
        match n {
            0 => Self::constant(1.0),
            1 => self,
            2 => self.chain(x * x, 2.0 * x, || 2.0),
            _ => self.chain(x.powi(n), m * x.powi(n - 1), || m * (m - 1.0) * x.powi(n - 2)),
        }
    }

    #[inline]
    fn kinked(self, sign: f64) -> Self {
        self.scaled(sign)
    }
}

impl<const N: usize> fmt::Display for HyperDualVec<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} + {:?}α + {:?}β + {:?}αβ", self.re, self.a, self.b, self.ab)
    }
}

impl_scalar!([const N: usize] HyperDualVec<N>, order = 2);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual_vec::tests::all_functions;
    use num_dual::HyperDual64;

    #[test]
    fn agrees_with_num_dual_in_every_function() {
        let [re, a, b, ab] = [0.37, 1.2, -0.7, 0.4];
        let ours = all_functions(HyperDualVec::<1> { re, a: [a], b: [b], ab: [ab] });
        let theirs = all_functions(HyperDual64::new(re, a, b, ab));
        for (k, (x, y)) in ours.iter().zip(&theirs).enumerate() {
            let pairs = [(x.re, y.re), (x.a[0], y.eps1), (x.b[0], y.eps2), (x.ab[0], y.eps1eps2)];
            assert!(pairs.iter().all(|(x, y)| (x - y).abs() <= 1e-12 * y.abs().max(1.0)), "{k}: {x} {y}");
        }
    }
}
