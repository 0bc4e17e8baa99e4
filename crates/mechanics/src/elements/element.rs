//! What a mechanism is made of: elements that write one residual over the scalar type.

use crate::mechanism::scalars::{Dual4, Dual8, HyperDual4, Jet2};
use autodiff::{DualVec, Scalar};

/// What an element sees of the mechanism: its own few coordinates, parameters and multipliers.
///
/// All slices are in the order in which the element was connected; units are SI (m, rad, s, N, N·m, kg).
#[derive(Clone, Copy, Debug)]
pub struct ElementState<'a, T> {
    /// Time in s.
    pub t: T,
    /// Design-dependent parameters of this element, in its own documented order.
    pub p: &'a [T],
    /// Positions of its coordinates.
    pub q: &'a [T],
    /// Velocities of its coordinates.
    pub v: &'a [T],
    /// Accelerations of its coordinates.
    pub a: &'a [T],
    /// Its multipliers λ (reactions), one per closure equation.
    pub l: &'a [T],
}

/// Kinetic and potential energy in J.
#[derive(Clone, Copy, Debug)]
pub struct Energy<T> {
    /// Kinetic energy.
    pub kinetic: T,
    /// Potential energy: strain and weight.
    pub potential: T,
}

impl<T: Scalar> Energy<T> {
    /// No energy.
    pub fn none() -> Self {
        Self { kinetic: T::zero(), potential: T::zero() }
    }
}

/// A local variable that a constraint is differentiated with respect to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Variable {
    /// The position of a coordinate.
    Coordinate(usize),
    /// A parameter.
    Parameter(usize),
}

/// Derivatives of a constraint's rows with respect to some of its variables, variable by variable.
#[derive(Debug)]
pub struct ConstraintDerivatives<'a> {
    /// Of Φ_qᵀ λ: for each variable one per coordinate.
    pub dynamics: &'a mut [f64],
    /// Of Φ, Φ̇ and Φ̈ along the motion: for each variable one triple per multiplier.
    pub constraint: &'a mut [[f64; 3]],
}

/// One kind of element: body, joint, force, beam or sensor.
///
/// The whole mechanics of an element is [`Element::residual`], written once over the scalar type. What else an
/// analysis needs (mass, stiffness and damping matrices, constraint Jacobians, accelerations of constraints, design
/// derivatives) is had by evaluating it with other numbers; nobody has to type a Jacobian.
///
/// An element is either *balancing* (no closure: it adds inertia minus force to the rows of its coordinates) or a
/// *constraint* ([`Element::num_constraints`] > 0: it adds Φ_qᵀ λ to the rows of its coordinates and writes Φ(q, t), nothing
/// else). A joint with friction is a constraint and a force element side by side.
pub trait Element: Send + Sync + 'static {
    /// Adds the element's share to the equations.
    ///
    /// * `dynamics`: one row per coordinate, inertia forces − applied forces + Φ_qᵀ λ, in N or N·m;
    /// * `constraint`: one row per multiplier, Φ(q, t) in m or rad.
    ///
    /// Both come zeroed.
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]);

    /// Number of constraint equations.
    fn num_constraints(&self) -> usize {
        0
    }

    /// Coordinates (local numbers) that the rows are linear in, with coefficients that are the same in every state and at
    /// all times; for a constraint the rows Φ. Derivatives with respect to them are taken once and for all.
    ///
    /// A body is linear in all its coordinates, a pin in the translations of its bodies. To leave one out costs time only.
    fn linear(&self) -> &'static [usize] {
        &[]
    }

    /// Derivatives of a constraint along a motion in closed form, where somebody has worked them out; returns whether.
    ///
    /// The motion is `x.q`, `x.v`, `x.a` at the time `x.t`. What is written must be what the residual has: this saves time
    /// where derivatives along explicit steps are wanted and nothing else. `out` comes zeroed.
    fn constraint_derivatives(
        &self,
        _x: &ElementState<'_, f64>,
        _variables: &[Variable],
        _out: &mut ConstraintDerivatives<'_>,
    ) -> bool {
        false
    }

    /// Names of the quantities that [`Element::measure`] writes.
    fn measures(&self) -> &'static [&'static str] {
        &[]
    }

    /// Writes the element's outputs, in the order of [`Element::measures`]; `out` comes zeroed.
    fn measure<T: Scalar>(&self, _x: &ElementState<'_, T>, _out: &mut [T]) {}

    /// Energy stored in the element.
    fn energy<T: Scalar>(&self, _x: &ElementState<'_, T>) -> Energy<T> {
        Energy::none()
    }

    /// What is wrong with these parameters, if anything: negative mass, zero length.
    fn validate_parameters(&self, _p: &[f64]) -> Option<String> {
        None
    }

    /// What is wrong in this state, if anything: points that coincide. Asked only when an analysis has failed.
    fn diagnose_state(&self, _x: &ElementState<'_, f64>) -> Option<String> {
        None
    }

    /// Whether the element only measures and adds nothing to the equations.
    fn is_sensor(&self) -> bool {
        false
    }
}

/// Weights with which an element's variables move along one unknown of a linear system.
///
/// In a time step position, velocity and acceleration change together; a matrix entry is the change of a residual row
/// when the coordinate's position moves by `position`, its velocity by `velocity` and its acceleration by
/// `acceleration`. Multipliers move by one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TangentWeights {
    /// Change of position.
    pub position: f64,
    /// Change of velocity.
    pub velocity: f64,
    /// Change of acceleration.
    pub acceleration: f64,
}

/// [`Element`] as an object, for the closed set of numbers an analysis works with. Implemented for every element.
pub trait AnyElement:
    Evaluate<f64>
    + Evaluate<Dual4>
    + Evaluate<Dual8>
    + Evaluate<HyperDual4>
    + Evaluate<Jet2<f64>>
    + Evaluate<Jet2<Dual4>>
    + Evaluate<Jet2<Dual8>>
    + Evaluate<Jet2<HyperDual4>>
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
    /// See [`Element::measures`].
    fn measures(&self) -> &'static [&'static str];
    /// See [`Element::validate_parameters`].
    fn validate_parameters(&self, p: &[f64]) -> Option<String>;
    /// See [`Element::diagnose_state`].
    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String>;
    /// See [`Element::is_sensor`].
    fn is_sensor(&self) -> bool;

    /// Residual and its columns for the local variables `active` (coordinates first, then multipliers).
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

/// [`Element`] evaluated with one number type.
pub trait Evaluate<T: Scalar>: Send + Sync {
    /// See [`Element::residual`].
    fn residual(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]);
    /// See [`Element::measure`].
    fn measure(&self, x: &ElementState<'_, T>, out: &mut [T]);
    /// See [`Element::energy`].
    fn energy(&self, x: &ElementState<'_, T>) -> Energy<T>;
}

impl<E: Element, T: Scalar> Evaluate<T> for E {
    fn residual(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]) {
        Element::residual(self, x, dynamics, constraint);
    }
    fn measure(&self, x: &ElementState<'_, T>, out: &mut [T]) {
        Element::measure(self, x, out);
    }
    fn energy(&self, x: &ElementState<'_, T>) -> Energy<T> {
        Element::energy(self, x)
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
    fn measures(&self) -> &'static [&'static str] {
        Element::measures(self)
    }
    fn validate_parameters(&self, p: &[f64]) -> Option<String> {
        Element::validate_parameters(self, p)
    }
    fn diagnose_state(&self, x: &ElementState<'_, f64>) -> Option<String> {
        Element::diagnose_state(self, x)
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

/// Reusable room for evaluating elements in numbers of every width: nothing is allocated once it has been used.
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
    /// Rows of the coordinates.
    pub dynamics: Vec<T>,
    /// Rows of the multipliers.
    pub constraint: Vec<T>,
}

impl<T> Default for ElementWorkspace<T> {
    fn default() -> Self {
        let none = Vec::new;
        Self { p: none(), q: none(), v: none(), a: none(), l: none(), dynamics: none(), constraint: none() }
    }
}

impl<T: Scalar> ElementWorkspace<T> {
    /// The variables as an element sees them.
    pub fn local(&self, t: T) -> ElementState<'_, T> {
        ElementState { t, p: &self.p, q: &self.q, v: &self.v, a: &self.a, l: &self.l }
    }

    /// Evaluates the residual of `element` on what was put in.
    pub fn residual(&mut self, element: &(impl Evaluate<T> + ?Sized), t: T) {
        let p = std::mem::take(&mut self.p);
        self.residual_of(element, &p, t);
        self.p = p;
    }

    /// The same with parameters `p` that were not put in.
    pub fn residual_of(&mut self, element: &(impl Evaluate<T> + ?Sized), p: &[T], t: T) {
        let (mut dynamics, mut constraint) = (std::mem::take(&mut self.dynamics), std::mem::take(&mut self.constraint));
        reset(&mut dynamics, self.q.len());
        reset(&mut constraint, self.l.len());
        element.residual(&ElementState { p, ..self.local(t) }, &mut dynamics, &mut constraint);
        (self.dynamics, self.constraint) = (dynamics, constraint);
    }
}

/// Makes `values` hold `count` zeros.
pub(crate) fn reset<T: Scalar>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.resize(count, T::from(0.0));
}

impl<const N: usize> ElementWorkspace<DualVec<N>> {
    #[allow(clippy::too_many_arguments)]
    fn columns<E: Element>(
        &mut self,
        element: &E,
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
