//! The arithmetic that a number type owes num-dual's `DualNum`, from five rules.

/// Implements `DualNum` and the operators it asks for, from inherent functions of the type:
///
/// * `constant(f64) -> Self` and the field `re: f64`;
/// * `plus(self, Self)`, `times(self, Self)` and `divided_by(self, Self)`;
/// * `chain(self, f: f64, df: f64)`: the value `f` and slope `df` of a smooth function at `self.re`;
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
        // The remainder keeps the derivative of the dividend: x − b·trunc(x/b) with the quotient held.
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
                self.chain(self.re.powf(p), p * self.re.powf(p - 1.0))
            }
            #[inline] fn sqrt(&self) -> Self { let f = self.re.sqrt(); self.chain(f, 0.5 / f) }
            #[inline] fn cbrt(&self) -> Self { let f = self.re.cbrt(); self.chain(f, 1.0 / (3.0 * f * f)) }
            #[inline] fn exp(&self) -> Self { let f = self.re.exp(); self.chain(f, f) }
            #[inline] fn exp2(&self) -> Self { let f = self.re.exp2(); self.chain(f, f * std::f64::consts::LN_2) }
            #[inline] fn exp_m1(&self) -> Self { self.chain(self.re.exp_m1(), self.re.exp()) }
            #[inline] fn ln(&self) -> Self { self.chain(self.re.ln(), 1.0 / self.re) }
            #[inline] fn log(&self, base: f64) -> Self { self.chain(self.re.log(base), 1.0 / (self.re * base.ln())) }
            #[inline] fn log2(&self) -> Self { self.log(2.0) }
            #[inline] fn log10(&self) -> Self { self.log(10.0) }
            #[inline] fn ln_1p(&self) -> Self { self.chain(self.re.ln_1p(), 1.0 / (1.0 + self.re)) }
            #[inline] fn sin(&self) -> Self { let (s, c) = self.re.sin_cos(); self.chain(s, c) }
            #[inline] fn cos(&self) -> Self { let (s, c) = self.re.sin_cos(); self.chain(c, -s) }
            #[inline] fn tan(&self) -> Self { let f = self.re.tan(); self.chain(f, 1.0 + f * f) }
            #[inline] fn sin_cos(&self) -> (Self, Self) {
                let (s, c) = self.re.sin_cos();
                (self.chain(s, c), self.chain(c, -s))
            }
            #[inline] fn asin(&self) -> Self { self.chain(self.re.asin(), 1.0 / (1.0 - self.re * self.re).sqrt()) }
            #[inline] fn acos(&self) -> Self { self.chain(self.re.acos(), -1.0 / (1.0 - self.re * self.re).sqrt()) }
            #[inline] fn atan(&self) -> Self { self.chain(self.re.atan(), 1.0 / (1.0 + self.re * self.re)) }
            #[inline] fn atan2(&self, x: Self) -> Self {
                let square = self.re * self.re + x.re * x.re;
                let turn = self.scaled(x.re / square) - x.scaled(self.re / square);
                turn.chain(self.re.atan2(x.re), 1.0)
            }
            #[inline] fn sinh(&self) -> Self { self.chain(self.re.sinh(), self.re.cosh()) }
            #[inline] fn cosh(&self) -> Self { self.chain(self.re.cosh(), self.re.sinh()) }
            #[inline] fn tanh(&self) -> Self { let f = self.re.tanh(); self.chain(f, 1.0 - f * f) }
            #[inline] fn asinh(&self) -> Self { self.chain(self.re.asinh(), 1.0 / (1.0 + self.re * self.re).sqrt()) }
            #[inline] fn acosh(&self) -> Self { self.chain(self.re.acosh(), 1.0 / (self.re * self.re - 1.0).sqrt()) }
            #[inline] fn atanh(&self) -> Self { self.chain(self.re.atanh(), 1.0 / (1.0 - self.re * self.re)) }
            fn sph_j0(&self) -> Self { let d = num_dual::Dual64::new(self.re, 1.0).sph_j0(); self.chain(d.re, d.eps) }
            fn sph_j1(&self) -> Self { let d = num_dual::Dual64::new(self.re, 1.0).sph_j1(); self.chain(d.re, d.eps) }
            fn sph_j2(&self) -> Self { let d = num_dual::Dual64::new(self.re, 1.0).sph_j2(); self.chain(d.re, d.eps) }
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
