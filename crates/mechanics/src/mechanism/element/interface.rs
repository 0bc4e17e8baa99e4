//! The trait of elements, and the data that it exchanges with an analysis.

use crate::mechanism::element::descriptor::{ElementDescriptor, Family, Measure};
use autodiff::Scalar;

/// State of one element: its own few coordinates, parameters and multipliers.
///
/// All slices are in the order in which the element was connected. Units are SI (m, rad, s, N, N·m, kg).
#[derive(Clone, Copy, Debug)]
pub struct ElementState<'a, T> {
    /// Time in s.
    pub t: T,
    /// Design-dependent parameters of the element, in the order of its inputs.
    pub p: &'a [T],
    /// Positions of its coordinates.
    pub q: &'a [T],
    /// Velocities of its coordinates.
    pub v: &'a [T],
    /// Accelerations of its coordinates.
    pub a: &'a [T],
    /// Its multipliers λ (reactions), one per constraint equation; those of the joint whose reactions it reads.
    pub l: &'a [T],
    /// Signs of its switching functions.
    pub sides: SwitchSides,
}

/// Signs of an element's [switching functions](Element::switching_functions), if they are held.
///
/// Along an explicit step that ends at a zero of such a function its sign is held: the law of the element is smooth, in values and in
/// derivatives, even where a stage is beyond the zero by rounding or by the error of the stage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SwitchSides {
    is_held: bool,
    /// Bit k is set if function k is positive.
    positive: u8,
}

impl SwitchSides {
    /// Held sides: for each function, true if it is positive.
    pub fn held(positive: &[bool]) -> Self {
        let bits = positive.iter().enumerate().map(|(k, &is_positive)| u8::from(is_positive) << k);
        Self { is_held: true, positive: bits.sum() }
    }

    /// Returns whether function `k` counts as positive, with its present `value`.
    pub fn is_positive(self, k: usize, value: f64) -> bool {
        if self.is_held { self.positive >> k & 1 == 1 } else { value > 0.0 }
    }
}

/// Kinetic and potential energy in J.
#[derive(Clone, Copy, Debug)]
pub struct Energy<T> {
    /// Kinetic energy.
    pub kinetic: T,
    /// Potential energy: strain energy and weight.
    pub potential: T,
}

impl<T: Scalar> Energy<T> {
    /// Zero energy.
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
    /// Derivatives of Φ_qᵀ λ: for each variable one per coordinate.
    pub dynamics: &'a mut [f64],
    /// Derivatives of Φ, Φ̇ and Φ̈ along the motion: for each variable one triple per multiplier.
    pub constraint: &'a mut [[f64; 3]],
}

/// One kind of element: body, joint, drive, force, contact, beam or sensor.
///
/// The mechanics of an element is [`Element::residual`], written once over the scalar type. Mass, stiffness and damping
/// matrices, constraint Jacobians, accelerations of constraints and design derivatives follow by evaluating it with other
/// number types; no Jacobian is written by hand.
///
/// Without constraint equations an element adds inertia forces minus applied forces to the rows of its coordinates. With
/// them ([`Element::num_constraints`] > 0) it adds Φ_qᵀ λ to these rows and writes Φ(q, t), nothing else. A joint with
/// friction is two elements: a constraint, and a force that reads the constraint's multipliers.
pub trait Element: Send + Sync + 'static {
    /// Adds the element's contribution to the equations.
    ///
    /// * `dynamics`: one row per coordinate, inertia forces − applied forces + Φ_qᵀ λ, in N or N·m;
    /// * `constraint`: one row per multiplier, Φ(q, t) in m or rad.
    ///
    /// Both are zero on entry.
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], constraint: &mut [T]);

    /// Declaration of the element. An element without one can be used from Rust, but not in model files.
    fn descriptor(&self) -> Option<&'static ElementDescriptor> {
        None
    }

    /// Number of constraint equations.
    fn num_constraints(&self) -> usize {
        0
    }

    /// Coordinates (local numbers) in which the rows are linear, with coefficients that depend neither on the state nor on
    /// time; for a constraint the rows Φ.
    ///
    /// Derivatives with respect to them are computed once. A body is linear in all its coordinates, a revolute joint in the
    /// translations of its bodies. A missing entry costs time only.
    fn linear(&self) -> &'static [usize] {
        &[]
    }

    /// Writes the derivatives of a constraint along a motion in closed form; returns whether the element has one.
    ///
    /// The motion is `x.q`, `x.v`, `x.a` at the time `x.t`. The closed form must equal the derivatives of the residual. It
    /// only saves time in sensitivities of explicit steps. `out` is zero on entry.
    fn constraint_derivatives(
        &self,
        _x: &ElementState<'_, f64>,
        _variables: &[Variable],
        _out: &mut ConstraintDerivatives<'_>,
    ) -> bool {
        false
    }

    /// Quantities that [`Element::measure`] writes; by default those of the descriptor.
    fn measures(&self) -> &'static [Measure] {
        self.descriptor().map_or(&[], |descriptor| descriptor.measures)
    }

    /// Writes the measured quantities, in the order of [`Element::measures`]; `out` is zero on entry.
    fn measure<T: Scalar>(&self, _x: &ElementState<'_, T>, _out: &mut [T]) {}

    /// Energy stored in the element.
    fn energy<T: Scalar>(&self, _x: &ElementState<'_, T>) -> Energy<T> {
        Energy::none()
    }

    /// Describes an inadmissible parameter, if there is one: a negative mass, a length of zero.
    fn validate_parameters(&self, _p: &[f64]) -> Option<String> {
        None
    }

    /// Times in s at which a function of time changes its form, see [`Motion::breaks`](crate::motion::Motion::breaks).
    fn breaks(&self, _p: &[f64]) -> Vec<f64> {
        Vec::new()
    }

    /// Describes an inadmissible state, if it is one: points that coincide. Called only after an analysis has failed.
    fn diagnose_state(&self, _x: &ElementState<'_, f64>) -> Option<String> {
        None
    }

    /// Describes why results in this state are doubtful, and the remedy: a law that does not hold for such large rotations.
    ///
    /// Called at the output times of a simulation that has succeeded.
    fn warn_of_state(&self, _x: &ElementState<'_, f64>) -> Option<String> {
        None
    }

    /// Describes a wrong solution of the element's constraints, and the remedy: axes that should coincide and are opposite.
    ///
    /// Called after the assembly of a mechanism.
    fn diagnose_assembly(&self, _x: &ElementState<'_, f64>) -> Option<String> {
        None
    }

    /// Appends the values of functions whose zeros are the states in which the residual is not smooth: the depth of a contact.
    ///
    /// Adaptive explicit steps end there, so that values and derivatives keep their accuracy. Along a step the residual must be that of
    /// the sides on which the step lies, [`ElementState::sides`], whatever the signs of the functions are.
    fn switching_functions<T: Scalar>(&self, _x: &ElementState<'_, T>, _out: &mut Vec<T>) {}

    /// Number of functions that [`Element::switching_functions`] appends, at most 8.
    fn num_switching_functions(&self) -> usize {
        0
    }

    /// Number of the first of these functions that enter the residual, where they are positive, with a power that is not an integer: the
    /// depth δ of a contact with a force proportional to δ^{3/2}.
    ///
    /// Adaptive explicit steps that begin or end at their zeros are [graded](crate::integrators::explicit::Grading).
    fn num_fractional_powers(&self) -> usize {
        0
    }

    /// Returns whether the element only measures and adds nothing to the equations.
    fn is_sensor(&self) -> bool {
        self.descriptor().is_some_and(|descriptor| descriptor.family == Family::Sensor)
    }
}

/// Weights with which an element's variables move along one unknown of a linear system.
///
/// In a time step position, velocity and acceleration change together. A matrix entry is the change of a residual row
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
