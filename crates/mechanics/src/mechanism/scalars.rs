//! Evaluation of elements, motions and formulas as trait objects, in a closed set of number types.

use crate::mechanism::element::{AnyElement, ElementState, ElementWorkspace, Energy, Observe};
use crate::mechanism::output::{AnyFormula, FormulaIn};
use crate::motion::{AnyMotion, MotionIn};
use autodiff::Scalar;

pub use autodiff::{Dual4, Dual8, HyperDual4, Jet2};

/// Largest number of parameters of one prescribed motion. Tables keep their points in the motion itself.
pub const MOST_MOTION_PARAMETERS: usize = 8;

/// A number type in which elements and motions can be evaluated as trait objects.
pub trait ElementScalar: Scalar {
    /// Evaluates an element's residual in the state of `workspace`.
    fn residual(element: &dyn AnyElement, t: Self, workspace: &mut ElementWorkspace<Self>);
    /// Evaluates an element's residual in the state of `workspace`, with the parameters `p`.
    fn residual_of(element: &dyn AnyElement, p: &[Self], t: Self, workspace: &mut ElementWorkspace<Self>);
    /// Evaluates a prescribed position.
    fn position(motion: &dyn AnyMotion, p: &[Self], t: Self) -> Self;
}

macro_rules! impl_element_scalar {
    ($($t:ty),*) => {$(
        impl ElementScalar for $t {
            fn residual(element: &dyn AnyElement, t: Self, workspace: &mut ElementWorkspace<Self>) {
                workspace.residual(element as &dyn AnyElement, t);
            }
            fn residual_of(element: &dyn AnyElement, p: &[Self], t: Self, workspace: &mut ElementWorkspace<Self>) {
                workspace.residual_of(element as &dyn AnyElement, p, t);
            }
            fn position(motion: &dyn AnyMotion, p: &[Self], t: Self) -> Self {
                MotionIn::<$t>::position(motion, p, t)
            }
        }
    )*};
}
impl_element_scalar!(f64, Dual4, Dual8, HyperDual4, Jet2<f64>, Jet2<Dual4>, Jet2<Dual8>, Jet2<HyperDual4>);

/// A number type of whole states: values, or values with design derivatives.
pub trait StateScalar: ElementScalar {
    /// The value without derivatives.
    fn value(&self) -> f64 {
        self.re()
    }
    /// Returns whether all derivatives are zero.
    fn is_constant(&self) -> bool;
    /// Evaluates an element's measures.
    fn measure(element: &dyn AnyElement, x: &ElementState<'_, Self>, out: &mut [Self]);
    /// Evaluates an element's energy.
    fn energy(element: &dyn AnyElement, x: &ElementState<'_, Self>) -> Energy<Self>;
    /// Appends an element's switching functions.
    fn switching_functions(element: &dyn AnyElement, x: &ElementState<'_, Self>, out: &mut Vec<Self>);
    /// Evaluates an output's formula.
    fn formula(formula: &dyn AnyFormula, t: Self, x: &[Self]) -> Self;
    /// A prescribed position with its velocity and acceleration.
    fn motion(motion: &dyn AnyMotion, p: &[Self], t: Self) -> [Self; 3];
}

macro_rules! impl_state_scalar {
    ($($t:ty, |$x:ident| $constant:expr);*) => {$(
        impl StateScalar for $t {
            fn is_constant(&self) -> bool {
                let $x = self;
                $constant
            }
            fn measure(element: &dyn AnyElement, x: &ElementState<'_, Self>, out: &mut [Self]) {
                Observe::<$t>::measure(element, x, out);
            }
            fn energy(element: &dyn AnyElement, x: &ElementState<'_, Self>) -> Energy<Self> {
                Observe::<$t>::energy(element, x)
            }
            fn switching_functions(element: &dyn AnyElement, x: &ElementState<'_, Self>, out: &mut Vec<Self>) {
                Observe::<$t>::switching_functions(element, x, out);
            }
            fn formula(formula: &dyn AnyFormula, t: Self, x: &[Self]) -> Self {
                FormulaIn::<$t>::value(formula, t, x)
            }
            fn motion(motion: &dyn AnyMotion, p: &[Self], t: Self) -> [Self; 3] {
                let (zero, one) = (<$t>::from(0.0), <$t>::from(1.0));
                let mut lifted = [Jet2::new(zero, zero, zero); MOST_MOTION_PARAMETERS];
                lifted.iter_mut().zip(p).for_each(|(jet, &p)| jet.re = p);
                let position = Jet2::<$t>::position(motion, &lifted[..p.len()], Jet2::new(t, one, zero));
                [position.re, position.v1, position.v2]
            }
        }
    )*};
}
impl_state_scalar!(
    f64, |_x| true;
    Dual4, |x| x.eps == [0.0; 4];
    Dual8, |x| x.eps == [0.0; 8];
    HyperDual4, |x| [x.a, x.b, x.ab] == [[0.0; 4]; 3]
);

/// A number type with a value and `L` derivatives.
///
/// Derivatives of an implicit solution follow by Newton corrections. If F(x) = 0 holds for the values, x − A⁻¹ F(x) with
/// the real matrix A = ∂F/∂x has exact derivatives of one order more than x. [`DerivativeScalar::ORDER`] corrections
/// suffice, each with one evaluation of F and one back-substitution.
pub trait DerivativeScalar<const L: usize>: StateScalar {
    /// Highest order of the derivatives.
    const ORDER: usize;
    /// The number with this value and these derivatives.
    fn with(value: f64, derivatives: [f64; L]) -> Self;
    /// The derivatives.
    fn derivatives(&self) -> [f64; L];
}

macro_rules! impl_derivative_scalar {
    ($($t:ty, $l:literal);*) => {$(
        impl DerivativeScalar<$l> for $t {
            const ORDER: usize = 1;
            #[inline]
            fn with(re: f64, eps: [f64; $l]) -> Self {
                Self { re, eps }
            }
            #[inline]
            fn derivatives(&self) -> [f64; $l] {
                self.eps
            }
        }
    )*};
}
impl_derivative_scalar!(Dual4, 4; Dual8, 8);

impl DerivativeScalar<12> for HyperDual4 {
    const ORDER: usize = 2;
    fn with(re: f64, [a0, a1, a2, a3, b0, b1, b2, b3, c0, c1, c2, c3]: [f64; 12]) -> Self {
        Self { re, a: [a0, a1, a2, a3], b: [b0, b1, b2, b3], ab: [c0, c1, c2, c3] }
    }
    fn derivatives(&self) -> [f64; 12] {
        let mut all = [0.0; 12];
        all.chunks_exact_mut(4).zip([self.a, self.b, self.ab]).for_each(|(to, from)| to.copy_from_slice(&from));
        all
    }
}
