//! Approximations of responses, and the approximate problem of a cycle made from them.
//!
//! An [`Approximation`] is fitted to values and derivatives of one number at the cycle's start design, its [`Expansion`]. The
//! result is a [`FittedModel`]: inexpensive, smooth, exact in value and gradient at that design. Responses are approximated;
//! objective and constraints keep their explicit dependence on responses, design variables and time (10), (11).

mod approximate_functions;
mod approximate_problem;
mod asymptotes;
#[cfg(test)]
pub(crate) mod checks;
mod conlin;
mod design_history;
mod diagonal_quadratic;
mod expansion;
mod fitted_models;
mod lagrangian;
mod linear;
mod linearization;
mod mma;
mod moving_peak;
mod per_response;
mod quadratic;
mod reciprocal;
mod regression;
mod separable_sum;
mod separated;
mod subproblem_box;
mod tana;
mod two_point;

pub use approximate_problem::ApproximateProblem;
pub use asymptotes::Asymptotes;
pub use conlin::Conlin;
pub use design_history::DesignHistory;
pub use diagonal_quadratic::{CurvatureRule, DiagonalQuadratic};
pub use expansion::{Expansion, Sample};
pub use lagrangian::LagrangianCurvature;
pub use linear::Linear;
pub use linearization::{CycleData, LinearizationPoint, PreviousPoint};
pub use mma::Mma;
pub use per_response::PerResponse;
pub use quadratic::{FullQuadratic, Hessian};
pub use reciprocal::Reciprocal;
pub use regression::Regression;
pub use subproblem_box::{ApproximationOptions, SubproblemBox};
pub use tana::Tana;
pub use two_point::TwoPointExponential;

use crate::problem::{Problem, ProblemScalar};
use autodiff::{Dual, HyperDual, PolynomialDegree, Scalar};
use error::Result;
use nlp::separable::Term;
use std::sync::Arc;

/// An approximation of one number around a design. Values hold settings only.
pub trait Approximation: Send + Sync + std::fmt::Debug {
    /// Checks the settings, and that they fit the problem.
    ///
    /// # Errors
    ///
    /// [`Error::Option`](crate::Error::Option) for a setting out of range, [`Error::Definition`](crate::Error::Definition) for one
    /// that does not suit the problem.
    fn check(&self, _problem: &Problem) -> Result<()> {
        Ok(())
    }
    /// Number of earlier accepted designs that it uses.
    fn memory(&self) -> usize {
        0
    }
    /// Rules for moving asymptotes that it uses: the driver tracks their distances from the first design on.
    fn asymptotes(&self) -> Vec<Asymptotes> {
        vec![]
    }
    /// True if the model of −r is the negative of the model of r. Others, such as convex approximations, are fitted to a response
    /// with the sign with which it enters an objective or a constraint: a problem and its mirror image have the same solution.
    fn is_odd(&self) -> bool {
        false
    }
    /// True if it uses second derivatives of the analysis.
    fn wants_curvature(&self) -> bool {
        false
    }
    /// Fits a model.
    ///
    /// # Errors
    ///
    /// [`Error::Definition`](crate::Error::Definition) if the model is not defined at the design, for example with singular
    /// intermediate variables.
    fn fit(&self, expansion: &Expansion) -> Result<Arc<dyn AnyModel>>;
}

/// An approximation of one number as a function of the design, written once over the scalar.
pub trait FittedModel: Send + Sync + 'static {
    /// The approximate value at design `b` (length n).
    fn at<S: ProblemScalar>(&self, b: &[S]) -> S;
    /// Lower and upper sides of the box in which the model is valid; `None` if it is valid everywhere.
    fn domain(&self) -> Option<&[Vec<f64>; 2]> {
        None
    }
    /// The constant of a separable model: a constant and a sum of functions of one variable each. `None` for any other.
    fn constant(&self) -> Option<f64> {
        None
    }
    /// The function of variable k in the sum of a separable model, at `x`.
    fn term(&self, _k: usize, _x: f64) -> Term {
        Term::default()
    }
}

/// Object-safe form of [`FittedModel`]; implemented for every model.
#[doc(hidden)]
pub trait AnyModel: Send + Sync {
    fn real(&self, b: &[f64]) -> f64;
    fn dual(&self, b: &[Dual]) -> Dual;
    fn hyper_dual(&self, b: &[HyperDual]) -> HyperDual;
    fn degree(&self, b: &[PolynomialDegree]) -> PolynomialDegree;
    fn domain(&self) -> Option<&[Vec<f64>; 2]>;
    fn constant(&self) -> Option<f64>;
    fn term(&self, k: usize, x: f64) -> Term;
}

#[rustfmt::skip]
impl<M: FittedModel> AnyModel for M {
    fn real(&self, b: &[f64]) -> f64 { self.at(b) }
    fn dual(&self, b: &[Dual]) -> Dual { self.at(b) }
    fn hyper_dual(&self, b: &[HyperDual]) -> HyperDual { self.at(b) }
    fn degree(&self, b: &[PolynomialDegree]) -> PolynomialDegree { self.at(b) }
    fn domain(&self) -> Option<&[Vec<f64>; 2]> { FittedModel::domain(self) }
    fn constant(&self) -> Option<f64> { FittedModel::constant(self) }
    fn term(&self, k: usize, x: f64) -> Term { FittedModel::term(self, k, x) }
}

/// The negative of a model.
pub(crate) struct Negated(pub Arc<dyn AnyModel>);

#[rustfmt::skip]
impl AnyModel for Negated {
    fn real(&self, b: &[f64]) -> f64 { -self.0.real(b) }
    fn dual(&self, b: &[Dual]) -> Dual { -self.0.dual(b) }
    fn hyper_dual(&self, b: &[HyperDual]) -> HyperDual { -self.0.hyper_dual(b) }
    fn degree(&self, b: &[PolynomialDegree]) -> PolynomialDegree { -self.0.degree(b) }
    fn domain(&self) -> Option<&[Vec<f64>; 2]> { self.0.domain() }
    fn constant(&self) -> Option<f64> { self.0.constant().map(|c| -c) }
    fn term(&self, k: usize, x: f64) -> Term {
        let Term { value, slope, curvature } = self.0.term(k, x);
        Term { value: -value, slope: -slope, curvature: -curvature }
    }
}

/// Number types with which a stored model can be evaluated.
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
evaluates!(f64 => real, Dual => dual, HyperDual => hyper_dual, PolynomialDegree => degree);
