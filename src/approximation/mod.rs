//! Approximations of responses, and the approximate problem of a cycle made from them.
//!
//! An [`Approximation`] is fitted to what is known of one number at the cycle's start design, its [`Expansion`], and
//! gives a [`Model`] of it: cheap, smooth, exact in value and gradient at that design. Responses are approximated;
//! objective and constraints keep their explicit dependence on responses, design variables and time (10), (11).

mod expansion;
mod linear;
mod problem;

pub use expansion::{Expansion, Sample};
pub use linear::Linear;
pub use problem::{ApproximateProblem, Known};

use crate::error::Result;
use crate::problem::Number;
use crate::scalar::{Degree, Dual, HyperDual, Scalar};
use std::sync::Arc;

/// A way to approximate one number around a design. Values hold settings only.
pub trait Approximation: Send + Sync + std::fmt::Debug {
    /// Fits a model to what is known.
    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>>;
}

/// An approximation of one number as a function of the design, written once over the scalar.
pub trait Model: Send + Sync + 'static {
    /// The approximate value at design `b` (length n).
    fn at<S: Number>(&self, b: &[S]) -> S;
}

/// Object-safe face of [`Model`]; implemented for every model.
#[doc(hidden)]
pub trait AnyModel: Send + Sync {
    fn real(&self, b: &[f64]) -> f64;
    fn dual(&self, b: &[Dual]) -> Dual;
    fn hyper_dual(&self, b: &[HyperDual]) -> HyperDual;
    fn degree(&self, b: &[Degree]) -> Degree;
}

#[rustfmt::skip]
impl<M: Model> AnyModel for M {
    fn real(&self, b: &[f64]) -> f64 { self.at(b) }
    fn dual(&self, b: &[Dual]) -> Dual { self.at(b) }
    fn hyper_dual(&self, b: &[HyperDual]) -> HyperDual { self.at(b) }
    fn degree(&self, b: &[Degree]) -> Degree { self.at(b) }
}

/// Numbers that a stored model can be evaluated with.
pub(crate) trait Evaluates: Scalar {
    fn of(model: &dyn AnyModel, b: &[Self]) -> Self;
}

macro_rules! evaluates {
    ($($number:ty => $name:ident),*) => {
        $(impl Evaluates for $number {
            fn of(model: &dyn AnyModel, b: &[Self]) -> Self { model.$name(b) }
        })*
    };
}
evaluates!(f64 => real, Dual => dual, HyperDual => hyper_dual, Degree => degree);
