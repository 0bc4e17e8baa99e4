//! num-dual's `DualNum` and the operators that it requires, implemented from a few functions of a number type.

/// Implements `DualNum` and the operators that it requires. The type must have these inherent functions:
///
/// * `constant(f64) -> Self` and the field `re: f64`;
/// * `plus(self, Self)`, `times(self, Self)` and `divided_by(self, Self)`;
/// * `chain(self, f: f64, df: f64, ddf: impl FnOnce() -> f64)`: the value `f` and derivatives `df` and `ddf` of a smooth
///   function at `self.re`;
/// * `angle(self, x: Self)`: atan2(self, x);
/// * `power(self, n: i32)`: the integer power selfⁿ;
/// * `kinked(self, sign: f64)`: |self| = sign · self, with the sign of the value;
/// * `scaled(self, f64)`: multiplication by a constant.
macro_rules! impl_scalar {
    ([$($gen:tt)*] $t:ty, order = $order:expr) => {
        impl_scalar!(@binary [$($gen)*] $t, Add, add, AddAssign, add_assign,
            |a, b| a.plus(b), |a, c| a.plus(<$t>::constant(c)));
        impl_scalar!(@binary [$($gen)*] $t, Sub, sub, SubAssign, sub_assign,
            |a, b| a.plus(b.scaled(-1.0)), |a, c| a.plus(<$t>::constant(-c)));
        impl_scalar!(@binary [$($gen)*] $t, Mul, mul, MulAssign, mul_assign,
            |a, b| a.times(b), |a, c| a.scaled(c));
        impl_scalar!(@binary [$($gen)*] $t, Div, div, DivAssign, div_assign,
            |a, b| a.divided_by(b), |a, c| a.divided_by(<$t>::constant(c)));
        // The remainder keeps the derivative of the dividend: x − b·trunc(x/b) with a constant quotient.
        impl_scalar!(@binary [$($gen)*] $t, Rem, rem, RemAssign, rem_assign,
            |a, b| a.plus(b.scaled(-(a.re / b.re).trunc())), |a, c| a.plus(<$t>::constant(-c * (a.re / c).trunc())));

        impl<$($gen)*> std::ops::Neg for $t {
            type Output = Self;
            #[inline]
            fn neg(self) -> Self {
                self.scaled(-1.0)
            }
        }
        impl<$($gen)*> num_traits::Inv for $t {
            type Output = Self;
            #[inline]
            fn inv(self) -> Self {
                <$t>::constant(1.0).divided_by(self)
            }
        }
        impl<$($gen)*> PartialEq for $t {
            fn eq(&self, other: &Self) -> bool {
                self.re == other.re
            }
        }
        impl<$($gen)*> PartialOrd for $t {
            fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
                self.re.partial_cmp(&other.re)
            }
        }
        impl<$($gen)*> PartialEq<f64> for $t {
            fn eq(&self, other: &f64) -> bool {
                self.re == *other
            }
        }
        impl<$($gen)*> PartialOrd<f64> for $t {
            fn partial_cmp(&self, other: &f64) -> Option<std::cmp::Ordering> {
                self.re.partial_cmp(other)
            }
        }
        impl<$($gen)*> From<f64> for $t {
            #[inline]
            fn from(value: f64) -> Self {
                <$t>::constant(value)
            }
        }
        impl<$($gen)*> num_traits::Zero for $t {
            fn zero() -> Self {
                <$t>::constant(0.0)
            }
            fn is_zero(&self) -> bool {
                self.re == 0.0
            }
        }
        impl<$($gen)*> num_traits::One for $t {
            fn one() -> Self {
                <$t>::constant(1.0)
            }
        }
        impl<$($gen)*> num_traits::Num for $t {
            type FromStrRadixErr = <f64 as num_traits::Num>::FromStrRadixErr;
            fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
                f64::from_str_radix(text, radix).map(<$t>::constant)
            }
        }
        impl<$($gen)*> num_traits::Signed for $t {
            fn abs(&self) -> Self {
                if self.re < 0.0 { self.kinked(-1.0) } else { self.kinked(1.0) }
            }
            fn abs_sub(&self, other: &Self) -> Self {
                if self.re <= other.re { <$t>::constant(0.0) } else { *self - *other }
            }
            fn signum(&self) -> Self {
                <$t>::constant(self.re.signum())
            }
            fn is_positive(&self) -> bool {
                self.re.is_sign_positive()
            }
            fn is_negative(&self) -> bool {
                self.re.is_sign_negative()
            }
        }
        impl<$($gen)*> num_traits::FromPrimitive for $t {
            fn from_i64(n: i64) -> Option<Self> {
                f64::from_i64(n).map(<$t>::constant)
            }
            fn from_u64(n: u64) -> Option<Self> {
                f64::from_u64(n).map(<$t>::constant)
            }
            fn from_f64(n: f64) -> Option<Self> {
                Some(<$t>::constant(n))
            }
        }
        impl<$($gen)*> std::iter::Sum for $t {
            fn sum<I: Iterator<Item = Self>>(iter: I) -> Self {
                iter.fold(<$t>::constant(0.0), |a, b| a + b)
            }
        }
        impl<$($gen)*> std::iter::Product for $t {
            fn product<I: Iterator<Item = Self>>(iter: I) -> Self {
                iter.fold(<$t>::constant(1.0), |a, b| a * b)
            }
        }
        impl<$($gen)*> num_dual::DualStruct for $t {
            type Real = f64;
            type Inner = f64;
            #[inline]
            fn re(&self) -> f64 {
                self.re
            }
            fn from_inner(inner: &f64) -> Self {
                <$t>::constant(*inner)
            }
        }
        impl<$($gen)*> num_dual::Mappable<$t> for $t {
            type Output<O> = O;
            fn map_dual<M: Fn($t) -> O, O>(self, f: M) -> O {
                f(self)
            }
        }

        #[rustfmt::skip]
        impl<$($gen)*> num_dual::DualNum for $t {
            type Primitive = f64;
            type InnerDual = f64;
            const NDERIV: usize = $order;
            #[inline] fn from_re(re: f64) -> Self { <$t>::constant(re) }
            #[inline] fn scale(self, factor: &f64) -> Self { self.scaled(*factor) }
            #[inline] fn recip(&self) -> Self { <$t>::constant(1.0).divided_by(*self) }
            #[inline] fn powi(&self, n: i32) -> Self { self.power(n) }
            #[inline] fn powf(&self, p: f64) -> Self {
                if p == p.trunc() && p.abs() < 64.0 { return self.power(p as i32); }
                let x = self.re;
                self.chain(x.powf(p), p * x.powf(p - 1.0), || p * (p - 1.0) * x.powf(p - 2.0))
            }
            #[inline] fn sqrt(&self) -> Self { let f = self.re.sqrt(); self.chain(f, 0.5 / f, || -0.25 / (f * self.re)) }
            #[inline] fn cbrt(&self) -> Self {
                let f = self.re.cbrt();
                self.chain(f, 1.0 / (3.0 * f * f), || -2.0 / (9.0 * f * f * self.re))
            }
            #[inline] fn exp(&self) -> Self { let f = self.re.exp(); self.chain(f, f, || f) }
            #[inline] fn exp2(&self) -> Self {
                let (f, ln) = (self.re.exp2(), std::f64::consts::LN_2);
                self.chain(f, f * ln, || f * ln * ln)
            }
            #[inline] fn exp_m1(&self) -> Self { let f = self.re.exp(); self.chain(self.re.exp_m1(), f, || f) }
            #[inline] fn ln(&self) -> Self { let x = self.re; self.chain(x.ln(), 1.0 / x, || -1.0 / (x * x)) }
            #[inline] fn log(&self, base: f64) -> Self {
                let (x, ln) = (self.re, base.ln());
                self.chain(x.log(base), 1.0 / (x * ln), || -1.0 / (x * x * ln))
            }
            #[inline] fn log2(&self) -> Self { self.log(2.0) }
            #[inline] fn log10(&self) -> Self { self.log(10.0) }
            #[inline] fn ln_1p(&self) -> Self {
                let df = 1.0 / (1.0 + self.re);
                self.chain(self.re.ln_1p(), df, || -df * df)
            }
            #[inline] fn sin(&self) -> Self { let (s, c) = self.re.sin_cos(); self.chain(s, c, || -s) }
            #[inline] fn cos(&self) -> Self { let (s, c) = self.re.sin_cos(); self.chain(c, -s, || -c) }
            #[inline] fn tan(&self) -> Self {
                let f = self.re.tan();
                self.chain(f, 1.0 + f * f, || 2.0 * f * (1.0 + f * f))
            }
            #[inline] fn sin_cos(&self) -> (Self, Self) {
                let (s, c) = self.re.sin_cos();
                (self.chain(s, c, || -s), self.chain(c, -s, || -c))
            }
            #[inline] fn asin(&self) -> Self {
                let (x, df) = (self.re, 1.0 / (1.0 - self.re * self.re).sqrt());
                self.chain(x.asin(), df, || x * df * df * df)
            }
            #[inline] fn acos(&self) -> Self {
                let (x, df) = (self.re, 1.0 / (1.0 - self.re * self.re).sqrt());
                self.chain(x.acos(), -df, || -x * df * df * df)
            }
            #[inline] fn atan(&self) -> Self {
                let (x, df) = (self.re, 1.0 / (1.0 + self.re * self.re));
                self.chain(x.atan(), df, || -2.0 * x * df * df)
            }
            #[inline] fn atan2(&self, x: Self) -> Self { self.angle(x) }
            #[inline] fn sinh(&self) -> Self { let f = self.re.sinh(); self.chain(f, self.re.cosh(), || f) }
            #[inline] fn cosh(&self) -> Self { let f = self.re.cosh(); self.chain(f, self.re.sinh(), || f) }
            #[inline] fn tanh(&self) -> Self {
                let f = self.re.tanh();
                self.chain(f, 1.0 - f * f, || -2.0 * f * (1.0 - f * f))
            }
            #[inline] fn asinh(&self) -> Self {
                let (x, df) = (self.re, 1.0 / (1.0 + self.re * self.re).sqrt());
                self.chain(x.asinh(), df, || -x * df * df * df)
            }
            #[inline] fn acosh(&self) -> Self {
                let (x, df) = (self.re, 1.0 / (self.re * self.re - 1.0).sqrt());
                self.chain(x.acosh(), df, || -x * df * df * df)
            }
            #[inline] fn atanh(&self) -> Self {
                let (x, df) = (self.re, 1.0 / (1.0 - self.re * self.re));
                self.chain(x.atanh(), df, || 2.0 * x * df * df)
            }
            fn sph_j0(&self) -> Self { self.by_num_dual(|d| d.sph_j0()) }
            fn sph_j1(&self) -> Self { self.by_num_dual(|d| d.sph_j1()) }
            fn sph_j2(&self) -> Self { self.by_num_dual(|d| d.sph_j2()) }
        }

        impl<$($gen)*> $t {
            /// A function evaluated with num-dual's second-order dual number.
            fn by_num_dual(self, f: impl Fn(num_dual::Dual2_64) -> num_dual::Dual2_64) -> Self {
                let d = f(num_dual::Dual2_64::new(self.re, 1.0, 0.0));
                self.chain(d.re, d.v1, || d.v2)
            }
        }
    };
    (@binary [$($gen:tt)*] $t:ty, $op:ident, $f:ident, $assign:ident, $g:ident,
        |$a:ident, $b:ident| $body:expr, |$p:ident, $c:ident| $constant:expr) => {
        impl<$($gen)*> std::ops::$op for $t {
            type Output = Self;
            #[inline]
            fn $f(self, other: Self) -> Self {
                let ($a, $b) = (self, other);
                $body
            }
        }
        impl<'r, $($gen)*> std::ops::$op<&'r $t> for $t {
            type Output = Self;
            #[inline]
            fn $f(self, other: &'r Self) -> Self {
                std::ops::$op::$f(self, *other)
            }
        }
        impl<$($gen)*> std::ops::$op<f64> for $t {
            type Output = Self;
            #[inline]
            fn $f(self, other: f64) -> Self {
                let ($p, $c) = (self, other);
                $constant
            }
        }
        impl<$($gen)*> std::ops::$assign for $t {
            #[inline]
            fn $g(&mut self, other: Self) {
                *self = std::ops::$op::$f(*self, other);
            }
        }
        impl<$($gen)*> std::ops::$assign<f64> for $t {
            #[inline]
            fn $g(&mut self, other: f64) {
                *self = std::ops::$op::$f(*self, other);
            }
        }
    };
}
pub(crate) use impl_scalar;
