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
            Atan2 => x.atan2(y),
            Min => kinked(if y.re() < x.re() { y } else { x }, x - y),
            Max => kinked(if y.re() > x.re() { y } else { x }, x - y),
            Pow => x.powd(y),
            // The derivative at the tip of the cone is that in the mean of all directions, so that products with zero, such as a
            // quadratic drag at rest, have theirs.
            Hypot if x.re() == 0.0 && y.re() == 0.0 => kinked(S::from(0.0), x + y),
            Hypot => (x * x + y * y).sqrt(),
            _ => self.of(x),
        }
    }
}

/// The chosen operand, marked as not polynomial for scalars that track the polynomial degree.
pub(super) fn kinked<S: Scalar>(chosen: S, difference: S) -> S {
    chosen + difference.abs() * 0.0
}
