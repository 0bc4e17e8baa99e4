//! What a mechanism is made of: elements that write one residual over the scalar type.

use crate::mechanism::scalars::{Curved, Jet, Narrow, Sensitive};
use autodiff::{Scalar, Tangent};

/// What an element sees of the mechanism: its own few coordinates, parameters and multipliers.
///
/// All slices are in the order in which the element was connected; units are SI (m, rad, s, N, N·m, kg).
#[derive(Clone, Copy, Debug)]
pub struct Local<'a, T> {
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
pub struct Slopes<'a> {
    /// Of Φ_qᵀ λ: for each variable one per coordinate.
    pub balance: &'a mut [f64],
    /// Of Φ, Φ̇ and Φ̈ along the motion: for each variable one triple per multiplier.
    pub closure: &'a mut [[f64; 3]],
}

/// One kind of element: body, joint, force, beam or sensor.
///
/// The whole mechanics of an element is [`Element::residual`], written once over the scalar type. What else an
/// analysis needs (mass, stiffness and damping matrices, constraint Jacobians, accelerations of constraints, design
/// derivatives) is had by evaluating it with other numbers; nobody has to type a Jacobian.
///
/// An element is either *balancing* (no closure: it adds inertia minus force to the rows of its coordinates) or a
/// *constraint* ([`Element::closures`] > 0: it adds Φ_qᵀ λ to the rows of its coordinates and writes Φ(q, t), nothing
/// else). A joint with friction is a constraint and a force element side by side.
pub trait Element: Send + Sync + 'static {
    /// Adds the element's share to the equations.
    ///
    /// * `balance`: one row per coordinate, inertia forces − applied forces + Φ_qᵀ λ, in N or N·m;
    /// * `closure`: one row per multiplier, Φ(q, t) in m or rad.
    ///
    /// Both come zeroed.
    fn residual<T: Scalar>(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]);

    /// Number of constraint equations.
    fn closures(&self) -> usize {
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
    fn slopes(&self, _x: &Local<'_, f64>, _variables: &[Variable], _out: &mut Slopes<'_>) -> bool {
        false
    }

    /// Names of the quantities that [`Element::measure`] writes.
    fn measures(&self) -> &'static [&'static str] {
        &[]
    }

    /// Writes the element's outputs, in the order of [`Element::measures`]; `out` comes zeroed.
    fn measure<T: Scalar>(&self, _x: &Local<'_, T>, _out: &mut [T]) {}

    /// Energy stored in the element.
    fn energy<T: Scalar>(&self, _x: &Local<'_, T>) -> Energy<T> {
        Energy::none()
    }

    /// What is wrong with these parameters, if anything: negative mass, zero length.
    fn complaint(&self, _p: &[f64]) -> Option<String> {
        None
    }

    /// What is wrong in this state, if anything: points that coincide. Asked only when an analysis has failed.
    fn trouble(&self, _x: &Local<'_, f64>) -> Option<String> {
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
pub struct Seeds {
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
    + Evaluate<Narrow>
    + Evaluate<Sensitive>
    + Evaluate<Curved>
    + Evaluate<Jet<f64>>
    + Evaluate<Jet<Narrow>>
    + Evaluate<Jet<Sensitive>>
    + Evaluate<Jet<Curved>>
{
    /// See [`Element::closures`].
    fn closures(&self) -> usize;
    /// See [`Element::linear`].
    fn linear(&self) -> &'static [usize];
    /// See [`Element::slopes`].
    fn slopes(&self, x: &Local<'_, f64>, variables: &[Variable], out: &mut Slopes<'_>) -> bool;
    /// See [`Element::measures`].
    fn measures(&self) -> &'static [&'static str];
    /// See [`Element::complaint`].
    fn complaint(&self, p: &[f64]) -> Option<String>;
    /// See [`Element::trouble`].
    fn trouble(&self, x: &Local<'_, f64>) -> Option<String>;
    /// See [`Element::is_sensor`].
    fn is_sensor(&self) -> bool;

    /// Residual and its columns for the local variables `active` (coordinates first, then multipliers).
    ///
    /// Row r of the result is `out[r * (active.len() + 1)..]`: its value, then its columns.
    fn columns(&self, x: &Local<'_, f64>, seeds: Seeds, active: &[usize], pad: &mut Scratchpad, out: &mut [f64]);
}

/// [`Element`] evaluated with one number type.
pub trait Evaluate<T: Scalar>: Send + Sync {
    /// See [`Element::residual`].
    fn residual(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]);
    /// See [`Element::measure`].
    fn measure(&self, x: &Local<'_, T>, out: &mut [T]);
    /// See [`Element::energy`].
    fn energy(&self, x: &Local<'_, T>) -> Energy<T>;
}

impl<E: Element, T: Scalar> Evaluate<T> for E {
    fn residual(&self, x: &Local<'_, T>, balance: &mut [T], closure: &mut [T]) {
        Element::residual(self, x, balance, closure);
    }
    fn measure(&self, x: &Local<'_, T>, out: &mut [T]) {
        Element::measure(self, x, out);
    }
    fn energy(&self, x: &Local<'_, T>) -> Energy<T> {
        Element::energy(self, x)
    }
}

impl<E: Element> AnyElement for E {
    fn closures(&self) -> usize {
        Element::closures(self)
    }
    fn linear(&self) -> &'static [usize] {
        Element::linear(self)
    }
    fn slopes(&self, x: &Local<'_, f64>, variables: &[Variable], out: &mut Slopes<'_>) -> bool {
        Element::slopes(self, x, variables, out)
    }
    fn measures(&self) -> &'static [&'static str] {
        Element::measures(self)
    }
    fn complaint(&self, p: &[f64]) -> Option<String> {
        Element::complaint(self, p)
    }
    fn trouble(&self, x: &Local<'_, f64>) -> Option<String> {
        Element::trouble(self, x)
    }
    fn is_sensor(&self) -> bool {
        Element::is_sensor(self)
    }

    fn columns(&self, x: &Local<'_, f64>, seeds: Seeds, active: &[usize], pad: &mut Scratchpad, out: &mut [f64]) {
        let width = active.len() + 1;
        match active.len() {
            0 => {
                out.fill(0.0);
                let (balance, closure) = out.split_at_mut(x.q.len());
                Element::residual(self, x, balance, closure);
            }
            1..=2 => pad.two.columns(self, x, seeds, active, width, 1, out),
            3 => pad.three.columns(self, x, seeds, active, width, 1, out),
            4 => pad.four.columns(self, x, seeds, active, width, 1, out),
            5..=6 => pad.six.columns(self, x, seeds, active, width, 1, out),
            _ => {
                for (c, chunk) in active.chunks(8).enumerate() {
                    pad.eight.columns(self, x, seeds, chunk, width, 1 + 8 * c, out);
                }
            }
        }
    }
}

/// Reusable room for evaluating elements in numbers of every width: nothing is allocated once it has been used.
#[derive(Clone, Debug, Default)]
pub struct Scratchpad {
    two: Room<Tangent<2>>,
    three: Room<Tangent<3>>,
    four: Room<Tangent<4>>,
    six: Room<Tangent<6>>,
    eight: Room<Tangent<8>>,
}

/// An element's variables and results in one number type.
#[derive(Clone, Debug)]
pub struct Room<T> {
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
    pub balance: Vec<T>,
    /// Rows of the multipliers.
    pub closure: Vec<T>,
}

impl<T> Default for Room<T> {
    fn default() -> Self {
        let none = Vec::new;
        Self { p: none(), q: none(), v: none(), a: none(), l: none(), balance: none(), closure: none() }
    }
}

impl<T: Scalar> Room<T> {
    /// The variables as an element sees them.
    pub fn local(&self, t: T) -> Local<'_, T> {
        Local { t, p: &self.p, q: &self.q, v: &self.v, a: &self.a, l: &self.l }
    }

    /// Evaluates the residual of `element` on what was put in.
    pub fn residual(&mut self, element: &(impl Evaluate<T> + ?Sized), t: T) {
        let p = std::mem::take(&mut self.p);
        self.residual_of(element, &p, t);
        self.p = p;
    }

    /// The same with parameters `p` that were not put in.
    pub fn residual_of(&mut self, element: &(impl Evaluate<T> + ?Sized), p: &[T], t: T) {
        let (mut balance, mut closure) = (std::mem::take(&mut self.balance), std::mem::take(&mut self.closure));
        reset(&mut balance, self.q.len());
        reset(&mut closure, self.l.len());
        element.residual(&Local { p, ..self.local(t) }, &mut balance, &mut closure);
        (self.balance, self.closure) = (balance, closure);
    }
}

/// Makes `values` hold `count` zeros.
pub(crate) fn reset<T: Scalar>(values: &mut Vec<T>, count: usize) {
    values.clear();
    values.resize(count, T::from(0.0));
}

impl<const N: usize> Room<Tangent<N>> {
    #[allow(clippy::too_many_arguments)]
    fn columns<E: Element>(
        &mut self,
        element: &E,
        x: &Local<'_, f64>,
        seeds: Seeds,
        active: &[usize],
        width: usize,
        first: usize,
        out: &mut [f64],
    ) {
        for (room, values) in
            [(&mut self.p, x.p), (&mut self.q, x.q), (&mut self.v, x.v), (&mut self.a, x.a), (&mut self.l, x.l)]
        {
            room.clear();
            room.extend(values.iter().map(|&value| Tangent::constant(value)));
        }
        let n = x.q.len();
        for (k, &i) in active.iter().enumerate() {
            if i < n {
                self.q[i].eps[k] = seeds.position;
                self.v[i].eps[k] = seeds.velocity;
                self.a[i].eps[k] = seeds.acceleration;
            } else {
                self.l[i - n].eps[k] = 1.0;
            }
        }
        self.residual(element, Tangent::constant(x.t));
        for (row, value) in out.chunks_exact_mut(width).zip(self.balance.iter().chain(&self.closure)) {
            row[0] = value.re;
            row[first..first + active.len()].copy_from_slice(&value.eps[..active.len()]);
        }
    }
}
