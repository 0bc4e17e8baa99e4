//! Elements as trait objects, and their evaluation in every number type of an analysis.

use crate::mechanism::element::descriptor::{ElementDescriptor, Measure};
use crate::mechanism::element::interface::{
    ConstraintDerivatives, Element, ElementState, Energy, SwitchSides, TangentWeights, Variable,
};
use autodiff::{Dual4, Dual8, DualVec, HyperDual4, Jet2, Scalar};

/// [`Element`] as a trait object, for the closed set of number types of the analyses. Implemented for every element.
pub trait AnyElement:
    Evaluate<f64>
    + Evaluate<Dual4>
    + Evaluate<Dual8>
    + Evaluate<HyperDual4>
    + Evaluate<Jet2<f64>>
    + Evaluate<Jet2<Dual4>>
    + Evaluate<Jet2<Dual8>>
    + Evaluate<Jet2<HyperDual4>>
    + Observe<f64>
    + Observe<Dual4>
    + Observe<Dual8>
    + Observe<HyperDual4>
{
    /// See [`Element::num_constraints`].
    fn num_constraints(&self) -> usize;
    /// See [`Element::linear`].
    fn linear(&self) -> &'static [usize];
    /// See [`Element::constraint_derivatives`].
    fn constraint_derivatives(
        &self,
        x: &ElementState<'_, f64>,
        variables: &[Variable],
        out: &mut ConstraintDerivatives<'_>,
    ) -> bool;
    /// See [`Element::descriptor`].
    fn descriptor(&self) -> Option<&'static ElementDescriptor>;
    /// See [`Element::measures`].
    fn measures(&self) -> &'static [Measure];
    /// See [`Element::validate_parameters`].
    fn validate_parameters(&self, p: &[f64]) -> Option<String>;
    /// See [`Element::breaks`].
    fn breaks(&self, p: &[f64]) -> Vec<f64>;
    /// See [`Element::diagnose_state`].
    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String>;
    /// See [`Element::warn_of_state`].
    fn warn_of_state(&self, x: &ElementState<'_, f64>) -> Option<String>;
    /// See [`Element::diagnose_assembly`].
    fn diagnose_assembly(&self, x: &ElementState<'_, f64>) -> Option<String>;
    /// See [`Element::num_switching_functions`].
    fn num_switching_functions(&self) -> usize;
    /// See [`Element::num_fractional_powers`].
    fn num_fractional_powers(&self) -> usize;
    /// See [`Element::is_sensor`].
    fn is_sensor(&self) -> bool;

    /// Writes the residual and its columns for the local variables `active` (coordinates first, then multipliers).
    ///
    /// Row r of the result is `out[r * (active.len() + 1)..]`: its value, then its columns.
    fn columns(
        &self,
        x: &ElementState<'_, f64>,
        tangent_weights: TangentWeights,
        active: &[usize],
        workspace: &mut JacobianWorkspace,
        out: &mut [f64],
    );
}

/// Residual of an [`Element`] in one number type.
pub trait Evaluate<T: Scalar>: Send + Sync {
    /// See [`Element::residual`].
    fn residual(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]);
}

/// Measures, energy and switching functions of an [`Element`] in one number type. Number types along a motion, [`Jet2`], need the residual only.
pub trait Observe<T: Scalar>: Send + Sync {
    /// See [`Element::measure`].
    fn measure(&self, x: &ElementState<'_, T>, out: &mut [T]);
    /// See [`Element::energy`].
    fn energy(&self, x: &ElementState<'_, T>) -> Energy<T>;
    /// See [`Element::switching_functions`].
    fn switching_functions(&self, x: &ElementState<'_, T>, out: &mut Vec<T>);
}

impl<E: Element, T: Scalar> Evaluate<T> for E {
    fn residual(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        Element::residual(self, x, dynamics, constraint);
    }
}

impl<E: Element, T: Scalar> Observe<T> for E {
    fn measure(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        Element::measure(self, x, out);
    }
    fn energy(&self, x: &ElementState<'_, T>) -> Energy<T> {
        Element::energy(self, x)
    }
    fn switching_functions(&self, x: &ElementState<'_, T>, out: &mut Vec<T>) {
        Element::switching_functions(self, x, out);
    }
}

impl<E: Element> AnyElement for E {
    fn num_constraints(&self) -> usize {
        Element::num_constraints(self)
    }
    fn linear(&self) -> &'static [usize] {
        Element::linear(self)
    }
    fn constraint_derivatives(
        &self,
        x: &ElementState<'_, f64>,
        variables: &[Variable],
        out: &mut ConstraintDerivatives<'_>,
    ) -> bool {
        Element::constraint_derivatives(self, x, variables, out)
    }
    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        Element::descriptor(self)
    }
    fn measures(&self) -> &'static [Measure] {
        Element::measures(self)
    }
    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        Element::validate_parameters(self, p)
    }
    fn breaks(&self, p: &[f64]) -> Vec<f64> {
        Element::breaks(self, p)
    }
    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        Element::diagnose_state(self, x)
    }
    fn warn_of_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        Element::warn_of_state(self, x)
    }
    fn diagnose_assembly(&self, x: &ElementState<'_, f64>) -> Option<String> {
        Element::diagnose_assembly(self, x)
    }
    fn num_switching_functions(&self) -> usize {
        Element::num_switching_functions(self)
    }

    fn num_fractional_powers(&self) -> usize {
        Element::num_fractional_powers(self)
    }
    fn is_sensor(&self) -> bool {
        Element::is_sensor(self)
    }

    fn columns(
        &self,
        x: &ElementState<'_, f64>,
        tangent_weights: TangentWeights,
        active: &[usize],
        workspace: &mut JacobianWorkspace,
        out: &mut [f64],
    ) {
        let width = active.len() + 1;
        match active.len() {
            0 => {
                out.fill(0.0);
                let (dynamics, constraint) = out.split_at_mut(x.q.len());
                Element::residual(self, x, dynamics, constraint);
            }
            1..=2 => workspace.two.columns(self, x, tangent_weights, active, width, 1, out),
            3 => workspace.three.columns(self, x, tangent_weights, active, width, 1, out),
            4 => workspace.four.columns(self, x, tangent_weights, active, width, 1, out),
            5..=6 => workspace.six.columns(self, x, tangent_weights, active, width, 1, out),
            _ => {
                for (c, chunk) in active.chunks(8).enumerate() {
                    workspace.eight.columns(self, x, tangent_weights, chunk, width, 1 + 8 * c, out);
                }
            }
        }
    }
}

/// Defines `object()` for an element without fields: the element as a trait object.
///
/// The function is not generic: the element is compiled for all number types in this crate, and not again in every crate that
/// adds it to a mechanism.
#[doc(hidden)]
#[macro_export]
macro_rules! as_object {
    ($element:ident) => {
        impl $element {
            #[inline(never)]
            pub(crate) fn object() -> std::sync::Arc<dyn $crate::mechanism::element::AnyElement> {
                std::sync::Arc::new(Self)
            }
        }
    };
}

/// Workspaces for Jacobians of elements in dual numbers of every width, without allocations after the first use.
#[derive(Clone, Debug, Default)]
pub struct JacobianWorkspace {
    two: ElementWorkspace<DualVec<2>>,
    three: ElementWorkspace<DualVec<3>>,
    four: ElementWorkspace<DualVec<4>>,
    six: ElementWorkspace<DualVec<6>>,
    eight: ElementWorkspace<DualVec<8>>,
}

/// An element's variables and results in one number type.
#[derive(Clone, Debug)]
pub struct ElementWorkspace<T> {
    /// Parameters.
    pub p: Vec<T>,
    /// Positions.
    pub q: Vec<T>,
    /// Velocities.
    pub v: Vec<T>,
    /// Accelerations.
    pub a: Vec<T>,
    /// Multipliers.
    pub l: Vec<T>,
    /// Signs of switching functions.
    pub sides: SwitchSides,
    /// Rows of the coordinates.
    pub dynamics: Vec<T>,
    /// Rows of the multipliers.
    pub constraint: Vec<T>,
}

impl<T> Default for ElementWorkspace<T> {
    fn default() -> Self {
        let (none, sides) = (Vec::new, SwitchSides::default());
        Self { p: none(), q: none(), v: none(), a: none(), l: none(), sides, dynamics: none(), constraint: none() }
    }
}

impl<T: Scalar> ElementWorkspace<T> {
    /// The state of the element.
    pub fn local(&self, t: T) -> ElementState<'_, T> {
        ElementState { t, p: &self.p, q: &self.q, v: &self.v, a: &self.a, l: &self.l, sides: self.sides }
    }

    /// Evaluates the residual of `element` in this state.
    pub fn residual(&mut self, element: &(impl Evaluate<T> + ?Sized), t: T) {
        let p = std::mem::take(&mut self.p);
        self.residual_of(element, &p, t);
        self.p = p;
    }

    /// Evaluates the residual of `element` in this state, with the parameters `p` in place of its own.
    pub fn residual_of(&mut self, element: &(impl Evaluate<T> + ?Sized), p: &[T], t: T) {
        let (mut dynamics, mut constraint) = (std::mem::take(&mut self.dynamics), std::mem::take(&mut self.constraint));
        reset(&mut dynamics, self.q.len());
        reset(&mut constraint, self.l.len());
        element.residual(&ElementState { p, ..self.local(t) }, &mut dynamics, &mut constraint);
        (self.dynamics, self.constraint) = (dynamics, constraint);
    }
}

/// Resizes `values` to `count` zeros.
fn reset<T: Scalar>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.resize(count, T::from(0.0));
}

impl<const N: usize> ElementWorkspace<DualVec<N>> {
    // The element is a trait object: copies of this function for every element take long to compile and are no faster.
    #[allow(clippy::too_many_arguments)]
    fn columns(
        &mut self,
        element: &dyn Evaluate<DualVec<N>>,
        x: &ElementState<'_, f64>,
        tangent_weights: TangentWeights,
        active: &[usize],
        width: usize,
        first: usize,
        out: &mut [f64],
    ) {
        for (workspace, values) in
            [(&mut self.p, x.p), (&mut self.q, x.q), (&mut self.v, x.v), (&mut self.a, x.a), (&mut self.l, x.l)]
        {
            workspace.clear();
            workspace.extend(values.iter().map(|&value| DualVec::constant(value)));
        }
        self.sides = x.sides;
        let n = x.q.len();
        for (k, &i) in active.iter().enumerate() {
            if i < n {
                self.q[i].eps[k] = tangent_weights.position;
                self.v[i].eps[k] = tangent_weights.velocity;
                self.a[i].eps[k] = tangent_weights.acceleration;
            } else {
                self.l[i - n].eps[k] = 1.0;
            }
        }
        self.residual(element, DualVec::constant(x.t));
        for (row, value) in out.chunks_exact_mut(width).zip(self.dynamics.iter().chain(&self.constraint)) {
            row[0] = value.re;
            row[first..first + active.len()].copy_from_slice(&value.eps[..active.len()]);
        }
    }
}
