//! Functions that expressions may call.

use autodiff::Scalar;

/// A function of one or two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs)]
pub enum MathFunction {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Sinh,
    Cosh,
    Tanh,
    Sqrt,
    Exp,
    Ln,
    Abs,
    Min,
    Max,
    Pow,
    Hypot,
    Deg,
    Sign,
    SmoothStep,
}

use MathFunction::*;

/// Names, functions and meanings.
pub const FUNCTIONS: &[(&str, MathFunction, &str)] = &[
    ("sin", Sin, "sine of an angle in rad"),
    ("cos", Cos, "cosine of an angle in rad"),
    ("tan", Tan, "tangent of an angle in rad"),
    ("asin", Asin, "angle in rad from −π/2 to π/2"),
    ("acos", Acos, "angle in rad from 0 to π"),
    ("atan", Atan, "angle in rad from −π/2 to π/2"),
    ("atan2", Atan2, "angle in rad of the direction (x, y), as atan2(y, x)"),
    ("sinh", Sinh, "hyperbolic sine"),
    ("cosh", Cosh, "hyperbolic cosine"),
    ("tanh", Tanh, "hyperbolic tangent"),
    ("sqrt", Sqrt, "square root"),
    ("exp", Exp, "exponential"),
    ("ln", Ln, "natural logarithm"),
    ("abs", Abs, "absolute value, with a kink at zero"),
    ("min", Min, "the smaller of two numbers, with a kink where they are equal"),
    ("max", Max, "the larger of two numbers, with a kink where they are equal"),
    ("pow", Pow, "pow(x, y) is x^y"),
    ("hypot", Hypot, "√(x² + y²), with the derivative zero at (0, 0)"),
    ("deg", Deg, "an angle in degrees: deg(90) is π/2"),
    ("sign", Sign, "1, 0 or −1, with a jump at zero"),
    ("smooth_step", SmoothStep, "smooth_step(x, a, b) rises from 0 below a to 1 above b, twice differentiable"),
];

impl MathFunction {
    /// The function of that name.
    pub fn named(name: &str) -> Option<Self> {
        FUNCTIONS.iter().find(|(known, ..)| *known == name).map(|(_, function, _)| *function)
    }

    /// The name of the function.
    pub fn name(self) -> &'static str {
        FUNCTIONS.iter().find(|(_, f, _)| *f == self).map_or("", |(name, ..)| name)
    }

    /// The numbers for which the function is defined, in words; `None` for all.
    pub fn range(self) -> Option<&'static str> {
        match self {
            Asin | Acos => Some("−1 to 1"),
            Sqrt => Some("0 or more"),
            Ln => Some("more than 0"),
            _ => None,
        }
    }

    /// Number of arguments.
    pub fn arguments(self) -> usize {
        match self {
            Atan2 | Min | Max | Pow | Hypot => 2,
            SmoothStep => 3,
            _ => 1,
        }
    }

    /// Evaluates a function of one argument; a smooth step from 0 to 1.
    pub fn of<S: Scalar>(self, x: S) -> S {
        match self {
            Sin => x.sin(),
            Cos => x.cos(),
            Tan => x.tan(),
            Asin => x.asin(),
            Acos => x.acos(),
            Atan => x.atan(),
            Sinh => x.sinh(),
            Cosh => x.cosh(),
            Tanh => x.tanh(),
            Sqrt => x.sqrt(),
            Exp => x.exp(),
            Ln => x.ln(),
            Abs => x.abs(),
            Deg => x * (std::f64::consts::PI / 180.0),
            Sign => kinked(S::from(if x.re() == 0.0 { 0.0 } else { x.re().signum() }), x),
            SmoothStep if x.re() <= 0.0 => kinked(S::from(0.0), x),
            SmoothStep if x.re() >= 1.0 => kinked(S::from(1.0), x),
            SmoothStep => kinked(x.powi(3) * (x * (x * 6.0 - 15.0) + 10.0), x),
            Atan2 | Min | Max | Pow | Hypot => x,
        }
    }

    /// Evaluates a function of two arguments.
    pub fn of_two<S: Scalar>(self, x: S, y: S) -> S {
        match self {
            Atan2 => angle(x, y),
            Min => kinked(if y.re() < x.re() { y } else { x }, x - y),
            Max => kinked(if y.re() > x.re() { y } else { x }, x - y),
            // 0^y has the derivative zero with respect to a positive y, too; exp(y ln x) has none.
            Pow if x.re() == 0.0 && y.re() > 1.0 => kinked(power(x, y.re()), y),
            Pow => x.powd(y),
            // The gradient at the tip of the cone is its mean over all directions, which is zero, so that products with zero,
            // such as a quadratic drag at rest, have their derivative.
            Hypot if x.re() == 0.0 && y.re() == 0.0 => kinked(S::from(0.0), x + y),
            Hypot => (x * x + y * y).sqrt(),
            _ => self.of(x),
        }
    }
}

/// x^p.
///
/// At zero the derivatives p x^(p−1) and p (p−1) x^(p−2) are evaluated without a quotient of zeros. The second one is infinite for
/// p < 2, and has no effect where x does not change to first order.
pub(super) fn power<S: Scalar>(x: S, p: f64) -> S {
    if x.re() != 0.0 || p <= 1.0 {
        return x.powf(p);
    }
    if p == 2.0 {
        return x * x;
    }
    let second = if p < 2.0 { x * x * f64::MAX * f64::MAX } else { x * 0.0 };
    kinked(second, x)
}

/// The angle atan2(y, x), as the angle of the real parts plus the arc tangent of the small angle from there.
fn angle<S: Scalar>(y: S, x: S) -> S {
    let (y0, x0) = (y.re(), x.re());
    if x0 == 0.0 && y0 == 0.0 {
        return y.atan2(x);
    }
    ((y * x0 - x * y0) / (x * x0 + y * y0)).atan() + y0.atan2(x0)
}

/// The chosen operand, marked as not polynomial for scalars that track the polynomial degree.
pub(super) fn kinked<S: Scalar>(chosen: S, difference: S) -> S {
    chosen + difference.abs() * 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use autodiff::{Dual8, DualNum, HyperDual, HyperDual4, Jet2};

    /// Powers above one are smooth at zero to first order, with derivatives of zero; the second derivative of x^1.5 is infinite there.
    #[test]
    fn powers_have_their_derivatives_at_zero() {
        for p in [1.5, 2.5, 3.2] {
            assert_eq!(power(0.0, p), 0.0);
            assert_eq!(power(Dual8::variable(0.0, 0), p).eps[0], 0.0);
            let moving = power(Jet2::new(0.0, 3.0, 1.0), p);
            assert_eq!((moving.re, moving.v1), (0.0, 0.0), "{p}");
            assert_eq!(moving.v2, if p < 2.0 { f64::INFINITY } else { 0.0 }, "{p}");
            let resting = power(Jet2::new(0.0, 0.0, 0.0), p);
            assert_eq!((resting.v1, resting.v2), (0.0, 0.0), "{p}");
            let exponent = Pow.of_two(Dual8::from(0.0), Dual8::variable(p, 1));
            assert_eq!((exponent.re, exponent.eps[1]), (0.0, 0.0), "{p}");
        }
        assert_eq!(power(Jet2::new(0.0, 3.0, 1.0), 2.0).v2, 18.0);
        let x = Dual8::variable(2.0, 0);
        assert_eq!(power(x, 1.5), x.powf(1.5));
        assert!(power(Dual8::variable(0.0, 0), 0.5).eps[0].is_infinite(), "a root has a vertical tangent");
    }

    /// In all quadrants and on the axes: dφ = (x dy − y dx)/r², and the second derivatives by those of a circle.
    #[test]
    fn angles_have_their_derivatives_on_the_axes() {
        for k in 0..8 {
            let phi = f64::from(k) * std::f64::consts::FRAC_PI_4 - 3.0;
            for (y, x) in [(phi.sin(), phi.cos()), (0.0, 2.0), (3.0, 0.0), (-3.0, 0.0), (0.0, -2.0)] {
                let square = x * x + y * y;
                let found = angle(Dual8::variable(y, 0), Dual8::variable(x, 1));
                assert_eq!(found.re, y.atan2(x));
                assert!((found.eps[0] - x / square).abs() < 1e-15 && (found.eps[1] + y / square).abs() < 1e-15);
                let second = angle(HyperDual4::from(y), HyperDual4::from(x));
                assert_eq!(second.re, y.atan2(x));
                let hyper = angle(HyperDual::from(y), HyperDual::from(x));
                assert_eq!(hyper.re, y.atan2(x));
                // On a circle at the angular velocity 2: φ̇ = 2, φ̈ = 0.
                let (vy, vx) = (2.0 * x, -2.0 * y);
                let moving = angle(Jet2::new(y, vy, -4.0 * y), Jet2::new(x, vx, -4.0 * x));
                assert!((moving.v1 - 2.0).abs() < 1e-14 && moving.v2.abs() < 1e-13, "{moving:?}");
            }
        }
    }
}
