//! The closed set of numbers in which mechanisms are evaluated.

use super::element::{AnyElement, Energy, Local, Room};
use super::formula::AnyFormula;
use super::motion::AnyMotion;
use crate::scalar::{Scalar, Tangent, WIDTH};

/// A value with its derivatives with respect to one chunk of [`WIDTH`] design variables.
pub type Sensitive = Tangent<WIDTH>;

/// The same for few design variables: half the work.
pub type Narrow = Tangent<4>;

pub use crate::scalar::Jet;

/// Most parameters of one prescribed motion (tables keep their points in the motion itself).
pub const MOST_MOTION_PARAMETERS: usize = 8;

/// A number in which elements and motions can be asked although they are objects.
pub trait Number: Scalar {
    /// Evaluates an element's residual on what is in `room`.
    fn residual(element: &dyn AnyElement, t: Self, room: &mut Room<Self>);
    /// Evaluates an element's residual on what is in `room`, but with the parameters `p`.
    fn residual_of(element: &dyn AnyElement, p: &[Self], t: Self, room: &mut Room<Self>);
    /// Evaluates an element's outputs.
    fn measure(element: &dyn AnyElement, x: &Local<'_, Self>, out: &mut [Self]);
    /// Evaluates an element's energy.
    fn energy(element: &dyn AnyElement, x: &Local<'_, Self>) -> Energy<Self>;
    /// Evaluates a prescribed position.
    fn position(motion: &dyn AnyMotion, p: &[Self], t: Self) -> Self;
}

macro_rules! impl_number {
    ($($t:ty),*) => {$(
        impl Number for $t {
            fn residual(element: &dyn AnyElement, t: Self, room: &mut Room<Self>) {
                room.residual(element as &dyn AnyElement, t);
            }
            fn residual_of(element: &dyn AnyElement, p: &[Self], t: Self, room: &mut Room<Self>) {
                room.residual_of(element as &dyn AnyElement, p, t);
            }
            fn measure(element: &dyn AnyElement, x: &Local<'_, Self>, out: &mut [Self]) {
                super::element::Evaluate::<$t>::measure(element, x, out);
            }
            fn energy(element: &dyn AnyElement, x: &Local<'_, Self>) -> Energy<Self> {
                super::element::Evaluate::<$t>::energy(element, x)
            }
            fn position(motion: &dyn AnyMotion, p: &[Self], t: Self) -> Self {
                super::motion::Position::<$t>::position(motion, p, t)
            }
        }
    )*};
}
impl_number!(f64, Narrow, Sensitive, Jet<f64>, Jet<Sensitive>, Jet<Narrow>);

/// Numbers in which whole states are kept: the value itself, or the value with design derivatives.
pub trait Real: Number {
    /// The value without derivatives.
    fn value(&self) -> f64 {
        self.re()
    }
    /// Evaluates an output's formula.
    fn formula(formula: &dyn AnyFormula, t: Self, x: &[Self]) -> Self;
    /// A prescribed position with its velocity and acceleration.
    fn motion(motion: &dyn AnyMotion, p: &[Self], t: f64) -> [Self; 3];
}

macro_rules! impl_real {
    ($($t:ty),*) => {$(
        impl Real for $t {
            fn formula(formula: &dyn AnyFormula, t: Self, x: &[Self]) -> Self {
                super::formula::FormulaIn::<$t>::value(formula, t, x)
            }
            fn motion(motion: &dyn AnyMotion, p: &[Self], t: f64) -> [Self; 3] {
                let (zero, one) = (<$t>::from(0.0), <$t>::from(1.0));
                let mut lifted = [Jet::new(zero, zero, zero); MOST_MOTION_PARAMETERS];
                lifted.iter_mut().zip(p).for_each(|(jet, &p)| jet.re = p);
                let position = Jet::<$t>::position(motion, &lifted[..p.len()], Jet::new(<$t>::from(t), one, zero));
                [position.re, position.v1, position.v2]
            }
        }
    )*};
}
impl_real!(f64, Narrow, Sensitive);
