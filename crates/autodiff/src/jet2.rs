//! Second-order jets: a value with its first and second derivative along a motion.

use num_dual::{Dual2, DualNum, DualStruct, Mappable};
use num_traits::{FromPrimitive, Inv, Num, One, Signed, Zero};
use std::iter::{Product, Sum};
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Rem, RemAssign, Sub, SubAssign};

use crate::Scalar;

/// A value with its first and second derivative with respect to one variable, usually time.
///
/// It computes the same numbers as num-dual's `Dual2`. Sums, products, sines and cosines, the functions of joints, are always
/// inlined and need one product less. All other functions are num-dual's. The component type `T` may carry derivatives, for
/// example with respect to design variables.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::{DualNum, Jet2};
/// let t = Jet2::new(2.0, 1.0, 0.0);
/// let x = t * t * t;
/// assert_eq!((x.re, x.v1, x.v2), (8.0, 12.0, 12.0));
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Jet2<T> {
    /// Value.
    pub re: T,
    /// First derivative.
    pub v1: T,
    /// Second derivative.
    pub v2: T,
}

impl<T> Jet2<T> {
    /// From value, first and second derivative.
    #[inline]
    pub fn new(re: T, v1: T, v2: T) -> Self {
        Self { re, v1, v2 }
    }
}

impl<T: Scalar> Jet2<T> {
    #[inline(always)]
    fn constant(re: T) -> Self {
        let zero = T::from(0.0);
        Self { re, v1: zero, v2: zero }
    }

    #[inline(always)]
    fn map(self, f: impl Fn(T) -> T) -> Self {
        Self { re: f(self.re), v1: f(self.v1), v2: f(self.v2) }
    }

    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(T, T) -> T) -> Self {
        Self { re: f(self.re, other.re), v1: f(self.v1, other.v1), v2: f(self.v2, other.v2) }
    }

    /// A smooth function with the value `f` and the derivatives `df` and `ddf` at `self.re`.
    #[inline(always)]
    fn chain(self, f: T, df: T, ddf: T) -> Self {
        Self { re: f, v1: self.v1 * df, v2: self.v2 * df + self.v1 * self.v1 * ddf }
    }

    #[inline(always)]
    fn to_num_dual(self) -> Dual2<T> {
        Dual2::new(self.re, self.v1, self.v2)
    }
}

impl<T> From<Dual2<T>> for Jet2<T> {
    #[inline(always)]
    fn from(x: Dual2<T>) -> Self {
        Self { re: x.re, v1: x.v1, v2: x.v2 }
    }
}

impl<T: Scalar> From<f64> for Jet2<T> {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self::constant(T::from(value))
    }
}

/// Implements an operator for two jets, for a reference, and for a jet and a constant, with assignment.
macro_rules! operator {
    ($op:ident, $f:ident, $assign:ident, $g:ident, |$a:ident, $b:ident| $jets:expr, |$p:ident, $c:ident| $constant:expr) => {
        impl<T: Scalar> $op for Jet2<T> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $jets
            }
        }
        impl<'r, T: Scalar> $op<&'r Jet2<T>> for Jet2<T> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: &'r Self) -> Self {
                $op::$f(self, *other)
            }
        }
        impl<T: Scalar> $op<f64> for Jet2<T> {
            type Output = Self;
            #[inline(always)]
            fn $f(self, other: f64) -> Self {
                let ($p, $c) = (self, other);
                $constant
            }
        }
        impl<T: Scalar> $assign for Jet2<T> {
            #[inline(always)]
            fn $g(&mut self, other: Self) {
                *self = $op::$f(*self, other);
            }
        }
        impl<T: Scalar> $assign<f64> for Jet2<T> {
            #[inline(always)]
            fn $g(&mut self, other: f64) {
                *self = $op::$f(*self, other);
            }
        }
    };
}
operator!(Add, add, AddAssign, add_assign, |a, b| a.zip(b, |a, b| a + b), |a, c| Self { re: a.re + c, ..a });
operator!(Sub, sub, SubAssign, sub_assign, |a, b| a.zip(b, |a, b| a - b), |a, c| Self { re: a.re - c, ..a });
operator!(
    Mul,
    mul,
    MulAssign,
    mul_assign,
    |a, b| Self { re: a.re * b.re, v1: a.v1 * b.re + a.re * b.v1, v2: a.v2 * b.re + a.v1 * b.v1 * 2.0 + a.re * b.v2 },
    |a, c| a.map(|a| a * c)
);
operator!(Div, div, DivAssign, div_assign, |a, b| (a.to_num_dual() / b.to_num_dual()).into(), |a, c| a.map(|a| a / c));
// The quotient is constant, as for `DualVec`.
operator!(Rem, rem, RemAssign, rem_assign, |a, b| a - b * (a.re.re() / b.re.re()).trunc(), |a, c| a - c
    * (a.re.re() / c).trunc());

impl<T: Scalar> Neg for Jet2<T> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.map(|x| -x)
    }
}

impl<T: Scalar> Inv for Jet2<T> {
    type Output = Self;
    fn inv(self) -> Self {
        self.recip()
    }
}

impl<T: Scalar> PartialEq for Jet2<T> {
    fn eq(&self, other: &Self) -> bool {
        self.re == other.re
    }
}

impl<T: Scalar> PartialOrd for Jet2<T> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        self.re.partial_cmp(&other.re)
    }
}

impl<T: Scalar> PartialEq<f64> for Jet2<T> {
    fn eq(&self, other: &f64) -> bool {
        self.re.re() == *other
    }
}

impl<T: Scalar> PartialOrd<f64> for Jet2<T> {
    fn partial_cmp(&self, other: &f64) -> Option<std::cmp::Ordering> {
        self.re.re().partial_cmp(other)
    }
}

impl<T: Scalar> Zero for Jet2<T> {
    fn zero() -> Self {
        Self::from(0.0)
    }
    fn is_zero(&self) -> bool {
        self.re.is_zero()
    }
}

impl<T: Scalar> One for Jet2<T> {
    fn one() -> Self {
        Self::from(1.0)
    }
}

impl<T: Scalar> Num for Jet2<T> {
    type FromStrRadixErr = <f64 as Num>::FromStrRadixErr;
    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        f64::from_str_radix(text, radix).map(Self::from)
    }
}

impl<T: Scalar> Signed for Jet2<T> {
    fn abs(&self) -> Self {
        if self.re.re() < 0.0 { -*self } else { *self }
    }
    fn abs_sub(&self, other: &Self) -> Self {
        if self <= other { Self::zero() } else { *self - *other }
    }
    fn signum(&self) -> Self {
        Self::from(self.re.re().signum())
    }
    fn is_positive(&self) -> bool {
        self.re.re().is_sign_positive()
    }
    fn is_negative(&self) -> bool {
        self.re.re().is_sign_negative()
    }
}

impl<T: Scalar> FromPrimitive for Jet2<T> {
    fn from_i64(n: i64) -> Option<Self> {
        f64::from_i64(n).map(Self::from)
    }
    fn from_u64(n: u64) -> Option<Self> {
        f64::from_u64(n).map(Self::from)
    }
    fn from_f64(n: f64) -> Option<Self> {
        Some(Self::from(n))
    }
}

impl<T: Scalar> Sum for Jet2<T> {
    fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::zero(), |a, b| a + b)
    }
}

impl<T: Scalar> Product for Jet2<T> {
    fn product<I: Iterator<Item = Self>>(iter: I) -> Self {
        iter.fold(Self::one(), |a, b| a * b)
    }
}

impl<T: Scalar> std::fmt::Display for Jet2<T> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.to_num_dual().fmt(f)
    }
}

impl<T: Scalar> DualStruct for Jet2<T> {
    type Real = f64;
    type Inner = T;
    #[inline(always)]
    fn re(&self) -> f64 {
        self.re.re()
    }
    fn from_inner(inner: &T) -> Self {
        Self::constant(*inner)
    }
}

impl<T: Scalar> Mappable<Jet2<T>> for Jet2<T> {
    type Output<O> = O;
    fn map_dual<M: Fn(Self) -> O, O>(self, f: M) -> O {
        f(self)
    }
}

/// Functions of one jet that num-dual evaluates.
macro_rules! by_num_dual {
    ($($f:ident),*) => {
        $(fn $f(&self) -> Self { self.to_num_dual().$f().into() })*
    };
}

impl<T: Scalar> DualNum for Jet2<T> {
    type Primitive = f64;
    type InnerDual = T;
    const NDERIV: usize = T::NDERIV + 2;

    #[inline]
    fn from_re(re: T) -> Self {
        Self::constant(re)
    }
    #[inline]
    fn scale(self, factor: &T) -> Self {
        self.map(|x| x * *factor)
    }
    #[inline]
    fn powi(&self, n: i32) -> Self {
        if n == 2 { *self * *self } else { self.to_num_dual().powi(n).into() }
    }
    fn powf(&self, n: f64) -> Self {
        self.to_num_dual().powf(n).into()
    }
    fn log(&self, base: f64) -> Self {
        self.to_num_dual().log(base).into()
    }
    #[inline]
    fn sin(&self) -> Self {
        self.sin_cos().0
    }
    #[inline]
    fn cos(&self) -> Self {
        self.sin_cos().1
    }
    #[inline(always)]
    fn sin_cos(&self) -> (Self, Self) {
        let (sin, cos) = self.re.sin_cos();
        (self.chain(sin, cos, -sin), self.chain(cos, -sin, -cos))
    }
    fn atan2(&self, other: Self) -> Self {
        self.to_num_dual().atan2(other.to_num_dual()).into()
    }
    by_num_dual!(recip, sqrt, cbrt, exp, exp2, exp_m1, ln, log2, log10, ln_1p, tan, asin, acos, atan);
    by_num_dual!(sinh, cosh, tanh, asinh, acosh, atanh, sph_j0, sph_j1, sph_j2);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::DualVec;

    /// Sums, products, quotients and functions.
    fn mixture<S: Scalar>(x: S) -> Vec<S> {
        let (sin, cos) = x.sin_cos();
        let y = x * 0.5 + 0.2;
        vec![
            sin * cos - y,
            x.sin() + x.cos() * 2.0,
            -x / y,
            x.powi(2) + x.powi(3),
            (x * x + y).sqrt(),
            x.atan2(y),
            x.powf(1.7).ln(),
            (-x).abs(),
            x.recip() - 1.0,
        ]
    }

    #[test]
    fn a_remainder_keeps_its_quotient() {
        let rest = Jet2::new(7.0, 2.0, 1.0) % Jet2::new(3.0, 0.5, 0.0);
        assert_eq!((rest.re, rest.v1, rest.v2), (1.0, 1.0, 1.0));
        assert_eq!((Jet2::new(7.0, 2.0, 1.0) % 3.0).re, 1.0);
    }

    #[test]
    fn agrees_with_num_dual() {
        let (re, v1, v2) = ([0.37, 1.0, 0.3], [1.2, -0.4, 0.1], [-0.7, 0.2, 0.9]);
        let number = |[re, a, b]: [f64; 3]| DualVec { re, eps: [a, b] };
        let ours = mixture(Jet2::new(number(re), number(v1), number(v2)));
        let theirs = mixture(Dual2::new(number(re), number(v1), number(v2)));
        for (k, (a, b)) in ours.iter().zip(&theirs).enumerate() {
            for (x, y) in [(a.re, b.re), (a.v1, b.v1), (a.v2, b.v2)] {
                let pairs = [(x.re, y.re), (x.eps[0], y.eps[0]), (x.eps[1], y.eps[1])];
                assert!(pairs.iter().all(|(x, y)| (x - y).abs() < 1e-12 * (1.0 + y.abs())), "{k}: {a} {b}");
            }
        }
    }
}
