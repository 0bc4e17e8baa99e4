//! Outputs as formulas of measured quantities.

use crate::dual_numbers::{Dual4, Dual8, HyperDual4};
use autodiff::Scalar;

/// An output as a function of time and measured quantities, written once over the scalar type.
pub trait Formula: Send + Sync + 'static {
    /// The output at time `t` (s) for the quantities `x`, in the order in which they were given.
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T;
}

/// [`Formula`] evaluated with one number type.
pub trait FormulaIn<T: Scalar>: Send + Sync {
    /// See [`Formula::value`].
    fn value(&self, t: T, x: &[T]) -> T;
}

impl<F: Formula, T: Scalar> FormulaIn<T> for F {
    fn value(&self, t: T, x: &[T]) -> T {
        Formula::value(self, t, x)
    }
}

/// [`Formula`] as an object. Implemented for every formula.
pub trait AnyFormula: FormulaIn<f64> + FormulaIn<Dual4> + FormulaIn<Dual8> + FormulaIn<HyperDual4> {}
impl<F: Formula> AnyFormula for F {}
