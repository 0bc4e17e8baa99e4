//! The number type that everything is written over: `f64` or any dual number.
//!
//! Responses, constraints, approximations and multibody residuals are written **once**, generically over
//! [`Scalar`]. The number that is put in decides what comes out:
//!
//! | number | what an evaluation yields |
//! |---|---|
//! | `f64` | the value |
//! | [`Dual`] | the value and [`WIDTH`] first derivatives |
//! | [`HyperDual`] | value, first and a [`BLOCK`] × [`BLOCK`] block of second derivatives |
//! | [`DualVec<N>`](DualVec) | as a dual number, laid out flat for inner loops |
//! | [`HyperDualVec<N>`](HyperDualVec) | value, first and mixed second derivatives along `N` pairs of directions, laid out flat |
//! | [`Jet2<T>`](Jet2) | value, first and second derivative along a motion |
//! | [`PolynomialDegree`] | the value and the polynomial degree in the seeded variables |
//!
//! ```
//! use linkwright_autodiff::{gradient, Scalar};
//! fn rosenbrock<S: Scalar>(x: &[S]) -> S {
//!     (x[1] - x[0].powi(2)).powi(2) * 100.0 + (-x[0] + 1.0).powi(2)
//! }
//! let (value, slope) = gradient(|x| rosenbrock(x), &[0.0, 1.0]);
//! assert_eq!((value, slope), (101.0, vec![-2.0, 200.0]));
//! ```
//!
//! Branch on real parts only; comparisons do so by themselves. With a dual number write `x.powi(2)` and
//! `x * 2.0`, not `x.powf(2.0)` of an integer power or `2.0 * x`.

mod chain_rule;
mod degree;
mod derivative;
mod hyper;
mod jet;
mod tangent;

pub use degree::{PolynomialDegree, degree};
pub use derivative::{gradient, hessian, jacobian, seed, slopes};

pub use hyper::HyperDualVec;
pub use jet::Jet2;
pub use num_dual::DualNum;
pub use tangent::DualVec;

/// First derivatives that one [`Dual`] carries: the width of a chunk of design variables.
pub const WIDTH: usize = 8;

/// Rows and columns of the Hessian block that one [`HyperDual`] carries.
pub const BLOCK: usize = 4;

/// A dual number with [`WIDTH`] first derivatives.
pub type Dual = num_dual::DualSVec64<WIDTH>;

/// A hyper-dual number with a [`BLOCK`] × [`BLOCK`] block of second derivatives.
pub type HyperDual = num_dual::HyperDualSVec64<BLOCK, BLOCK>;

/// A real or dual number.
///
/// Every `Copy` implementor of num-dual's [`DualNum`] over `f64` is a scalar. nalgebra's `RealField` is left out on
/// purpose: it has the same method names, so that `x.sin()` would be ambiguous, and dual matrices are never factorized.
pub trait Scalar: DualNum<Primitive = f64> + Copy + Send + Sync {}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {}
