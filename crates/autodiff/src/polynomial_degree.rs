//! A number that carries a polynomial degree, for the recognition of linear and quadratic functions.

use crate::chain_rule::impl_scalar;
use std::fmt;

/// A value together with the polynomial degree of the expression that computed it.
///
/// Constants have degree 0 and variables degree 1. A sum has the larger degree, even if terms cancel; a product has the sum of the
/// degrees. Every other function of an expression that is not constant is [`PolynomialDegree::NONLINEAR`]. Where a function
/// branches on the value, the degree is that of the branch taken.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::PolynomialDegree;
/// let (x, y) = (PolynomialDegree::variable(2.0), PolynomialDegree::variable(3.0));
/// assert_eq!((x * 3.0 - y + 1.0).degree, 1);
/// assert_eq!((x * y).degree, 2);
/// assert_eq!((y / x).degree, PolynomialDegree::NONLINEAR);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct PolynomialDegree {
    /// Value of the expression.
    pub re: f64,
    /// Polynomial degree, or [`PolynomialDegree::NONLINEAR`].
    pub degree: u8,
}

/// Polynomial degree of `f` in all variables together, on the branch taken at `x`; see [`PolynomialDegree`] for the rules.
pub fn degree(f: impl Fn(&[PolynomialDegree]) -> PolynomialDegree, x: &[f64]) -> u8 {
    f(&x.iter().map(|&v| PolynomialDegree::variable(v)).collect::<Vec<_>>()).degree
}

impl PolynomialDegree {
    /// Degree of expressions that are not polynomials, or of a degree above 254.
    pub const NONLINEAR: u8 = u8::MAX;

    /// A variable: degree one.
    pub fn variable(value: f64) -> Self {
        Self { re: value, degree: 1 }
    }

    fn constant(value: f64) -> Self {
        Self { re: value, degree: 0 }
    }

    fn plus(self, other: Self) -> Self {
        Self { re: self.re + other.re, degree: self.degree.max(other.degree) }
    }

    fn times(self, other: Self) -> Self {
        Self { re: self.re * other.re, degree: self.degree.saturating_add(other.degree) }
    }

    fn divided_by(self, other: Self) -> Self {
        let degree = if other.degree == 0 { self.degree } else { Self::NONLINEAR };
        Self { re: self.re / other.re, degree }
    }

    fn scaled(self, factor: f64) -> Self {
        Self { re: self.re * factor, degree: self.degree }
    }

    fn power(self, n: i32) -> Self {
        let degree = match (self.degree, n) {
            (0, _) | (_, 0) => 0,
            (d, n) if n > 0 => u8::try_from(n).map_or(Self::NONLINEAR, |n| d.saturating_mul(n)),
            _ => Self::NONLINEAR,
        };
        Self { re: self.re.powi(n), degree }
    }

    fn chain(self, f: f64, _df: f64, _ddf: impl FnOnce() -> f64) -> Self {
        Self { re: f, degree: if self.degree == 0 { 0 } else { Self::NONLINEAR } }
    }

    fn angle(self, x: Self) -> Self {
        let degree = if self.degree == 0 && x.degree == 0 { 0 } else { Self::NONLINEAR };
        Self { re: self.re.atan2(x.re), degree }
    }

    /// |x|: a kink is not a polynomial.
    fn kinked(self, sign: f64) -> Self {
        self.chain(self.re * sign, sign, || 0.0)
    }
}

impl fmt::Display for PolynomialDegree {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (degree {})", self.re, self.degree)
    }
}

impl_scalar!([] PolynomialDegree, order = 0);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scalar;

    fn of<F: Fn(PolynomialDegree, PolynomialDegree) -> PolynomialDegree>(f: F) -> u8 {
        f(PolynomialDegree::variable(0.3), PolynomialDegree::variable(0.7)).degree
    }

    #[test]
    fn follows_the_rules_of_polynomials() {
        assert_eq!(of(|x, y| x * 2.0 + y / 4.0 - 1.0), 1);
        assert_eq!(of(|x, y| x * y + x.powi_of(2)), 2);
        assert_eq!(of(|x, _| x.powi_of(2) * x), 3);
        assert_eq!(of(|x, y| x / y), PolynomialDegree::NONLINEAR);
        assert_eq!(of(|x, _| num_dual::DualNum::sin(&x)), PolynomialDegree::NONLINEAR);
        assert_eq!(of(|x, _| num_traits::Signed::abs(&x)), PolynomialDegree::NONLINEAR);
        assert_eq!(of(|_, _| num_dual::DualNum::exp(&PolynomialDegree::constant(1.0))), 0);
    }

    trait Powi: Scalar {
        fn powi_of(self, n: i32) -> Self {
            self.powi(n)
        }
    }
    impl<S: Scalar> Powi for S {}
}
