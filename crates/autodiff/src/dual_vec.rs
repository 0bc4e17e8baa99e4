//! Dual numbers with a fixed number of first derivatives in an array.

use crate::chain_rule::impl_scalar;
use std::fmt;

/// A dual number with `N` first derivatives in a plain array.
///
/// It computes the same numbers as num-dual's `DualSVec64<N>`. That type stores its derivatives in an `Option`, whose
/// branches slow inner loops down; `benches/numbers.rs` measures by how much. Use this type where the number of
/// variables is small and known, and [`Dual`](crate::Dual) with [`gradient`](crate::gradient) otherwise.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::{DualNum, DualVec};
/// let x = DualVec::<2>::variable(2.0, 0);
/// let y = DualVec::<2>::variable(5.0, 1);
/// let f = x * y + x.powi(3);
/// assert_eq!((f.re, f.eps), (18.0, [17.0, 2.0]));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct DualVec<const N: usize> {
    /// Value.
    pub re: f64,
    /// First derivatives.
    pub eps: [f64; N],
}

impl<const N: usize> DualVec<N> {
    /// A number without derivatives.
    #[inline]
    pub fn constant(re: f64) -> Self {
        Self { re, eps: [0.0; N] }
    }

    /// A variable: its derivative in `direction` (below `N`) is one, the others are zero.
    #[inline]
    pub fn variable(re: f64, direction: usize) -> Self {
        let mut eps = [0.0; N];
        eps[direction] = 1.0;
        Self { re, eps }
    }

    #[inline]
    fn map(self, re: f64, f: impl Fn(f64) -> f64) -> Self {
        Self { re, eps: self.eps.map(f) }
    }

    #[inline]
    fn zip(self, other: Self, re: f64, f: impl Fn(f64, f64) -> f64) -> Self {
        let mut eps = self.eps;
        for (a, b) in eps.iter_mut().zip(other.eps) {
            *a = f(*a, b);
        }
        Self { re, eps }
    }

    #[inline]
    fn plus(self, other: Self) -> Self {
        self.zip(other, self.re + other.re, |a, b| a + b)
    }

    #[inline]
    fn times(self, other: Self) -> Self {
        self.zip(other, self.re * other.re, |a, b| a * other.re + self.re * b)
    }

    #[inline]
    fn divided_by(self, other: Self) -> Self {
        let (quotient, inverse) = (self.re / other.re, 1.0 / other.re);
        self.zip(other, quotient, |a, b| (a - quotient * b) * inverse)
    }

    #[inline]
    fn scaled(self, factor: f64) -> Self {
        self.map(self.re * factor, |a| a * factor)
    }

    #[inline]
    fn chain(self, f: f64, df: f64, _ddf: impl FnOnce() -> f64) -> Self {
        self.map(f, |a| a * df)
    }

    #[inline]
    fn angle(self, x: Self) -> Self {
        let square = self.re * self.re + x.re * x.re;
        self.zip(x, self.re.atan2(x.re), |dy, dx| dy * (x.re / square) - dx * (self.re / square))
    }

    #[inline]
    fn power(self, n: i32) -> Self {
        match n {
            0 => Self::constant(1.0),
            1 => self,
            _ => self.map(self.re.powi(n), |a| a * (f64::from(n) * self.re.powi(n - 1))),
        }
    }

    #[inline]
    fn kinked(self, sign: f64) -> Self {
        self.scaled(sign)
    }
}

impl<const N: usize> fmt::Display for DualVec<N> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} + {:?}ε", self.re, self.eps)
    }
}

impl_scalar!([const N: usize] DualVec<N>, order = 1);

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::Scalar;
    use num_dual::Dual64;

    /// Every function of the trait, at a point where all of them are defined.
    pub(crate) fn all_functions<S: Scalar>(x: S) -> Vec<S> {
        let y = x * 0.5 + 0.2;
        vec![
            x.recip(),
            x.powi(3),
            x.powi(-2),
            x.powf(1.7),
            x.sqrt(),
            x.cbrt(),
            x.exp(),
            x.exp2(),
            x.exp_m1(),
            x.ln(),
            x.log(3.0),
            x.log2(),
            x.log10(),
            x.ln_1p(),
            x.sin(),
            x.cos(),
            x.tan(),
            x.sin_cos().0,
            x.sin_cos().1,
            x.asin(),
            x.acos(),
            x.atan(),
            x.atan2(y),
            x.sinh(),
            x.cosh(),
            x.tanh(),
            x.asinh(),
            (x + 1.0).acosh(),
            x.atanh(),
            x.sph_j0(),
            x.sph_j1(),
            x.sph_j2(),
            x / y,
            x * y,
            x - y,
            x + y,
            -x,
            (-x).abs(),
            x.powd(y),
            x.mul_add(y, x),
        ]
    }

    #[test]
    fn agrees_with_num_dual_in_every_function() {
        let ours = all_functions(DualVec::<1>::variable(0.37, 0));
        let theirs = all_functions(Dual64::new(0.37, 1.0));
        for (k, (a, b)) in ours.iter().zip(&theirs).enumerate() {
            assert!((a.re - b.re).abs() <= 1e-15 * b.re.abs().max(1.0), "value {k}: {} {}", a.re, b.re);
            assert!((a.eps[0] - b.eps).abs() <= 1e-13 * b.eps.abs().max(1.0), "derivative {k}: {} {}", a.eps[0], b.eps);
        }
    }
}
