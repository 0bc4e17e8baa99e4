//! Forward-mode automatic differentiation: scalars that carry derivatives, and gradients and Hessians made with them.
//!
//! A function is written **once**, generically over [`Scalar`]. The number type of its arguments decides what an
//! evaluation returns:
//!
//! | number | carries | use it for |
//! |---|---|---|
//! | `f64` | the value | analyses |
//! | [`Dual`] | value and [`WIDTH`] first derivatives | gradients of functions of many variables, see [`gradient`] |
//! | [`HyperDual`] | value, first and a [`BLOCK`] × [`BLOCK`] block of second derivatives | Hessians, see [`hessian`] |
//! | [`DualVec<N>`](DualVec) | value and `N` first derivatives, in plain arrays | inner loops with few variables |
//! | [`HyperDualVec<N>`](HyperDualVec) | value, first and mixed second derivatives along `N` pairs of directions | rows of a Hessian in inner loops, products of a Hessian with a vector |
//! | [`Jet2<T>`](Jet2) | value, first and second derivative along a motion; `T` may carry derivatives itself | velocities and accelerations of a function of time |
//! | [`PolynomialDegree`] | value and polynomial degree in the seeded variables | recognizing linear and quadratic functions |
//!
//! # Examples
//!
//! ```
//! use linkwright_autodiff::{Scalar, gradient};
//! fn rosenbrock<S: Scalar>(x: &[S]) -> S {
//!     (x[1] - x[0].powi(2)).powi(2) * 100.0 + (-x[0] + 1.0).powi(2)
//! }
//! let (value, gradient) = gradient(|x| rosenbrock(x), &[0.0, 1.0]);
//! assert_eq!((value, gradient), (101.0, vec![-2.0, 200.0]));
//! ```
//!
//! # Writing a function of [`Scalar`]
//!
//! * Branch on values only; comparisons of scalars compare values.
//! * Write `x * 2.0`, not `2.0 * x`: a scalar is the left operand.
//! * Write `x.powi(2)`, not `x.powf(2.0)`: whole powers are exact at zero.

mod chain_rule;
pub mod differences;
mod dual_vec;
mod gradient;
mod hyper_dual_vec;
mod jet2;
mod polynomial_degree;

pub use dual_vec::DualVec;
pub use gradient::{gradient, hessian, jacobian, partials, seed};
pub use hyper_dual_vec::HyperDualVec;
pub use jet2::Jet2;
pub use num_dual::DualNum;
pub use polynomial_degree::{PolynomialDegree, degree};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

/// First derivatives that one [`Dual`] carries: the width of a chunk of design variables.
pub const WIDTH: usize = 8;

/// Rows and columns of the Hessian block that one [`HyperDual`] carries.
pub const BLOCK: usize = 4;

/// A dual number with [`WIDTH`] first derivatives.
pub type Dual = num_dual::DualSVec64<WIDTH>;

/// A hyper-dual number with a [`BLOCK`] × [`BLOCK`] block of second derivatives.
pub type HyperDual = num_dual::HyperDualSVec64<BLOCK, BLOCK>;

/// A dual number for inner loops, with derivatives with respect to one chunk of [`WIDTH`] design variables.
pub type Dual8 = DualVec<WIDTH>;

/// A dual number for inner loops with four derivatives, for designs of at most four variables.
pub type Dual4 = DualVec<4>;

/// A hyper-dual number for inner loops, with first and second derivatives along four pairs of directions in the design space.
pub type HyperDual4 = HyperDualVec<4>;

/// A real number or a number that carries derivatives.
///
/// Every `Copy` type that implements num-dual's [`DualNum`] over `f64` is a scalar. nalgebra's `RealField` is not
/// required: it has the same method names, so that `x.sin()` would be ambiguous, and no dual matrix is factorized.
///
/// # Examples
///
/// ```
/// use linkwright_autodiff::{DualNum, DualVec, Jet2, Scalar};
/// fn height<S: Scalar>(angle: S) -> S {
///     angle.cos() * -2.0
/// }
/// assert_eq!(height(0.0), -2.0);
/// assert_eq!(height(DualVec::<1>::variable(0.0, 0)).eps, [0.0]);
/// // At the angle 0 with the angular velocity 3: the acceleration is 2 · 3².
/// assert_eq!(height(Jet2::new(0.0, 3.0, 0.0)).v2, 18.0);
/// ```
pub trait Scalar: DualNum<Primitive = f64> + Copy + Send + Sync {}

impl<T: DualNum<Primitive = f64> + Copy + Send + Sync> Scalar for T {}
