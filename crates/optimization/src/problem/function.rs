//! Explicit functions of (responses, design variables, time), written once over the scalar.

use autodiff::Scalar;

/// Arguments of a function at one time point.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a, S> {
    /// The responses that the quantity declares with `of`, in that order, at this time point.
    pub response: &'a [S],
    /// All design variables b.
    pub design: &'a [S],
    /// The time, in the unit of the grid; NaN where the quantity has no grid.
    pub time: S,
}

/// An explicit function g(r, b, t).
///
/// The [`function!`](crate::function) macro makes one from an expression; implement the trait for a type with parameters.
pub trait Function: Send + Sync + 'static {
    /// The value at one time point.
    fn at<S: Scalar>(&self, point: &Point<S>) -> S;
}

/// An explicit function of a whole time history: an integral, a norm, a mean.
pub trait Functional: Send + Sync + 'static {
    /// The value over all points of the grid, in order.
    fn over<S: Scalar>(&self, history: &[Point<S>]) -> S;

    /// Required number of time points, such as the number of weights; a grid of another length is rejected.
    fn points(&self) -> Option<usize> {
        None
    }
}

/// A [`Function`] from an expression: `function!(|p| p.response[0] - p.design[2] + 1.0)`.
///
/// Numbers from outside are captured by naming them with their types:
/// `function!([scale: f64 = 2.0] |p| p.response[0] * scale)`.
///
/// ```
/// use linkwright_optimization::{function, problem::{Function, Point}};
/// let load = function!([g: f64 = 9.81] |p| p.design[0] * g + p.response[0]);
/// let at = Point { response: &[1.0], design: &[2.0], time: 0.0 };
/// assert_eq!(load.at(&at), 20.62);
/// ```
#[macro_export]
macro_rules! function {
    (|$point:ident| $body:expr) => {
        $crate::function!([] |$point| $body)
    };
    ([$($name:ident : $kind:ty = $value:expr),*] |$point:ident| $body:expr) => {{
        #[derive(Clone)]
        struct Inline { $($name: $kind),* }
        impl $crate::problem::Function for Inline {
            fn at<S: $crate::autodiff::Scalar>(&self, $point: &$crate::problem::Point<S>) -> S {
                #[allow(unused_imports)]
                use $crate::autodiff::DualNum as _;
                $(#[allow(unused_variables)] let $name = self.$name.clone();)*
                $body
            }
        }
        Inline { $($name: $value),* }
    }};
}

/// User-defined intermediate variables bᴵ(b), any smooth map of the whole design, written once over the scalar.
pub trait IntermediateMap: Send + Sync + 'static {
    /// Component k of bᴵ(b), k = 0 … n−1.
    fn component<S: Scalar>(&self, k: usize, design: &[S]) -> S;
}

/// Σₚ wₚ f(r(tₚ), b, tₚ): a quadrature or a plain sum over the grid.
#[derive(Clone, Debug)]
pub struct WeightedSum<F> {
    /// wₚ, one for each time point.
    pub weights: Vec<f64>,
    /// The function under the sum.
    pub function: F,
}

impl<F: Function> Functional for WeightedSum<F> {
    fn over<S: Scalar>(&self, history: &[Point<S>]) -> S {
        let term = |(point, &w)| self.function.at(point) * w;
        history.iter().zip(&self.weights).map(term).fold(S::from(0.0), |a, b| a + b)
    }

    fn points(&self) -> Option<usize> {
        Some(self.weights.len())
    }
}
