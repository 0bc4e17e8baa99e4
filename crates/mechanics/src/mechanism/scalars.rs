//! The closed set of numbers in which mechanisms are evaluated.

use crate::elements::element::{AnyElement, ElementState, ElementWorkspace, Energy};
use crate::mechanism::outputs::AnyFormula;
use crate::motion::AnyMotion;
use autodiff::{DualVec, HyperDualVec, Scalar, WIDTH};

/// A value with its derivatives with respect to one chunk of [`WIDTH`] design variables.
pub type Dual8 = DualVec<WIDTH>;

/// The same for few design variables: half the work.
pub type Dual4 = DualVec<4>;

/// A value with first and second derivatives along four pairs of directions in the space of the design variables.
pub type HyperDual4 = HyperDualVec<4>;

pub use autodiff::Jet2;

/// Most parameters of one prescribed motion (tables keep their points in the motion itself).
pub const MOST_MOTION_PARAMETERS: usize = 8;

/// A number in which elements and motions can be asked although they are objects.
pub trait ElementScalar: Scalar {
    /// Evaluates an element's residual on what is in `workspace`.
    fn residual(element: &dyn AnyElement, t: Self, workspace: &mut ElementWorkspace<Self>);
    /// Evaluates an element's residual on what is in `workspace`, but with the parameters `p`.
    fn residual_of(element: &dyn AnyElement, p: &[Self], t: Self, workspace: &mut ElementWorkspace<Self>);
    /// Evaluates an element's outputs.
    fn measure(element: &dyn AnyElement, x: &ElementState<'_, Self>, out: &mut [Self]);
    /// Evaluates an element's energy.
    fn energy(element: &dyn AnyElement, x: &ElementState<'_, Self>) -> Energy<Self>;
    /// Evaluates a prescribed position.
    fn position(motion: &dyn AnyMotion, p: &[Self], t: Self) -> Self;
}

macro_rules! impl_number {
    ($($t:ty),*) => {$(
        impl ElementScalar for $t {
            fn residual(element: &dyn AnyElement, t: Self, workspace: &mut ElementWorkspace<Self>) {
                workspace.residual(element as &dyn AnyElement, t);
            }
            fn residual_of(element: &dyn AnyElement, p: &[Self], t: Self, workspace: &mut ElementWorkspace<Self>) {
                workspace.residual_of(element as &dyn AnyElement, p, t);
            }
            fn measure(element: &dyn AnyElement, x: &ElementState<'_, Self>, out: &mut [Self]) {
                crate::elements::element::Evaluate::<$t>::measure(element, x, out);
            }
            fn energy(element: &dyn AnyElement, x: &ElementState<'_, Self>) -> Energy<Self> {
                crate::elements::element::Evaluate::<$t>::energy(element, x)
            }
            fn position(motion: &dyn AnyMotion, p: &[Self], t: Self) -> Self {
                crate::motion::Position::<$t>::position(motion, p, t)
            }
        }
    )*};
}
impl_number!(f64, Dual4, Dual8, HyperDual4, Jet2<f64>, Jet2<Dual4>, Jet2<Dual8>, Jet2<HyperDual4>);

/// Numbers in which whole states are kept: the value itself, or the value with design derivatives.
pub trait StateScalar: ElementScalar {
    /// The value without derivatives.
    fn value(&self) -> f64 {
        self.re()
    }
    /// Whether it carries no derivatives.
    fn is_constant(&self) -> bool;
    /// Evaluates an output's formula.
    fn formula(formula: &dyn AnyFormula, t: Self, x: &[Self]) -> Self;
    /// A prescribed position with its velocity and acceleration.
    fn motion(motion: &dyn AnyMotion, p: &[Self], t: Self) -> [Self; 3];
}

macro_rules! impl_real {
    ($($t:ty, |$x:ident| $constant:expr);*) => {$(
        impl StateScalar for $t {
            fn is_constant(&self) -> bool {
                let $x = self;
                $constant
            }
            fn formula(formula: &dyn AnyFormula, t: Self, x: &[Self]) -> Self {
                crate::mechanism::outputs::FormulaIn::<$t>::value(formula, t, x)
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
impl_real!(
    f64, |_x| true;
    Dual4, |x| x.eps == [0.0; 4];
    Dual8, |x| x.eps == [0.0; 8];
    HyperDual4, |x| [x.a, x.b, x.ab] == [[0.0; 4]; 3]
);

/// A number that carries `L` derivatives beside its value.
///
/// Where F(x) = 0 holds for the values, x − A⁻¹ F(x) with the plain matrix A = ∂F/∂x has exact first derivatives if x had
/// none, and exact derivatives of one order more than x otherwise: products of enough derivatives vanish. So
/// [`DerivativeScalar::ORDER`] corrections are enough, each of them one evaluation of F and one back-substitution.
pub trait DerivativeScalar<const L: usize>: StateScalar {
    /// Highest order of the derivatives.
    const ORDER: usize;
    /// From its parts.
    fn with(value: f64, derivatives: [f64; L]) -> Self;
    /// The derivatives.
    fn derivatives(&self) -> [f64; L];
}

macro_rules! impl_carrier {
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
impl_carrier!(Dual4, 4; Dual8, 8);

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
