//! Named outputs of a mechanism: quantities, and formulas of them.

use autodiff::{Dual4, Dual8, HyperDual4, Scalar};
use std::sync::Arc;

/// A named scalar response: a weighted sum of quantities, or a formula of them.
pub(crate) struct OutputData<S> {
    pub name: String,
    pub terms: Vec<WeightedQuantity<S>>,
    pub formula: Option<Arc<dyn AnyFormula>>,
    /// Event from which on the output keeps its value.
    pub held: Option<HeldFrom>,
    /// False if its derivatives are not needed, so that they may be undefined.
    pub is_differentiated: bool,
}

/// One of the two sides of an event, at which forces, velocities and accelerations may differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum EventSide {
    /// Just before the event.
    Before,
    /// Just after the event, with the forces and joints that it changes.
    After,
}

/// The event from which on an output keeps the value that it has there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct HeldFrom {
    /// Number of the event.
    pub event: usize,
    /// Side of the event.
    pub side: EventSide,
    /// True if it is an error that the event does not happen.
    pub is_required: bool,
}

/// An output as a function of time and measured quantities, written once over the scalar type.
pub trait Formula: Send + Sync + 'static {
    /// Returns the output at time `t` (s) for the quantities `x`, in the order in which they were given.
    fn value<T: Scalar>(&self, t: T, x: &[T]) -> T;

    /// Explains an output that is not finite although all quantities are, as in `asin(1.2) is not defined`.
    fn undefined(&self, _t: f64, _x: &[f64]) -> Option<String> {
        None
    }
}

/// [`Formula`] evaluated with one number type.
pub trait FormulaIn<T: Scalar>: Send + Sync {
    /// See [`Formula::value`].
    fn value(&self, t: T, x: &[T]) -> T;

    /// See [`Formula::undefined`].
    fn undefined(&self, t: f64, x: &[f64]) -> Option<String>;
}

impl<F: Formula, T: Scalar> FormulaIn<T> for F {
    fn value(&self, t: T, x: &[T]) -> T {
        Formula::value(self, t, x)
    }

    fn undefined(&self, t: f64, x: &[f64]) -> Option<String> {
        Formula::undefined(self, t, x)
    }
}

/// [`Formula`] as a trait object. Implemented for every formula.
pub trait AnyFormula: FormulaIn<f64> + FormulaIn<Dual4> + FormulaIn<Dual8> + FormulaIn<HyperDual4> {}
impl<F: Formula> AnyFormula for F {}

/// Source of a quantity.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum MeasuredQuantity {
    /// The measure of an element.
    Measure { element: usize, measure: usize },
    /// The generalized force that makes a prescribed coordinate follow its motion.
    DrivingForce { coordinate: usize },
    /// Kinetic energy of the mechanism.
    KineticEnergy,
    /// Potential energy of the mechanism.
    PotentialEnergy,
}

/// A quantity with its weight in an output.
#[derive(Clone, Copy, Debug)]
pub struct WeightedQuantity<S> {
    pub(crate) source: MeasuredQuantity,
    pub(crate) weight: S,
}

impl<S: Scalar> WeightedQuantity<S> {
    /// The quantity with its weight multiplied by `weight`.
    pub fn times(self, weight: S) -> Self {
        Self { weight: self.weight * weight, ..self }
    }
}
