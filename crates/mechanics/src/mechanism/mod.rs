//! A mechanism: coordinates, elements connected to them, prescribed motions and named outputs.

mod clock;
pub mod element;
pub mod frame;
pub(crate) mod frame3;
pub mod rotation;
pub mod scalars;
mod spatial;
pub(crate) mod vector;

pub use clock::SimulationClock;
pub use rotation::{EulerSequence, Rotation};
pub use spatial::{Body3, Marker3, Pose3};

use crate::events::unilateral::Unilateral;
use crate::events::when::When;
use crate::mechanism::element::{AnyElement, Element};
use crate::motion::{AnyMotion, Fixed, Motion};
use autodiff::{Dual4, Dual8, HyperDual4, Scalar};
use std::ops::Range;
use std::sync::Arc;

/// A mechanism as a pure function of the design variables.
///
/// `build` is evaluated in `f64` for analyses and in dual numbers for sensitivities. With seeded `b` (dual numbers with
/// unit derivatives), masses, lengths, initial states and drivers carry derivatives. `build` must add the same
/// elements in the same order for every design.
pub trait ParametricMechanism: Send + Sync {
    /// The mechanism for the design variables `b`.
    fn build<S: Scalar>(&self, b: &[S]) -> crate::Result<Mechanism<S>>;
}

/// One coordinate of a mechanism, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Coordinate(pub(crate) usize);

/// One element of a mechanism, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ElementIndex(pub(crate) usize);

/// A rigid body or a beam node: two translations in m and a rotation in rad.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Body {
    /// Horizontal position of the reference point.
    pub x: Coordinate,
    /// Vertical position of the reference point.
    pub y: Coordinate,
    /// Rotation, counter-clockwise.
    pub theta: Coordinate,
}

impl Body {
    /// The three coordinates.
    pub fn coordinates(self) -> [Coordinate; 3] {
        [self.x, self.y, self.theta]
    }

    /// The point of the body with the body-fixed coordinates (`x`, `y`) in m.
    pub fn at<S: Scalar>(self, x: S, y: S) -> Marker<S> {
        Marker { body: self, x, y }
    }

    /// The reference point of the body.
    pub fn origin<S: Scalar>(self) -> Marker<S> {
        self.at(S::from(0.0), S::from(0.0))
    }
}

/// A point fixed to a body.
#[derive(Clone, Copy, Debug)]
pub struct Marker<S> {
    /// The body.
    pub body: Body,
    /// Body-fixed x in m.
    pub x: S,
    /// Body-fixed y in m.
    pub y: S,
}

/// Position (m, m, rad) of a body or node.
#[derive(Clone, Copy, Debug)]
pub struct Pose<S> {
    /// Horizontal position.
    pub x: S,
    /// Vertical position.
    pub y: S,
    /// Rotation.
    pub theta: S,
}

pub(crate) struct CoordinateData<S> {
    pub name: String,
    pub position: S,
    pub velocity: S,
    pub motion: Option<(Arc<dyn AnyMotion>, Vec<S>)>,
    /// True if a second motion was prescribed: an error of every analysis.
    pub is_driven_twice: bool,
    /// True if it only follows other coordinates: it has no weight in the distance from the built positions.
    pub is_follower: bool,
}

#[derive(Clone)]
pub(crate) struct ElementInstance<S> {
    pub name: String,
    pub element: Arc<dyn AnyElement>,
    pub coordinates: Vec<usize>,
    /// The first of its own multipliers, or of those of the joint whose reactions it reads.
    pub first_multiplier: usize,
    pub num_constraints: usize,
    /// Number of multipliers of another element, a joint, on which its forces depend.
    pub num_reactions: usize,
    pub parameters: Vec<S>,
    /// Number of its entry in [`Mechanism::switches`], if events activate or deactivate it.
    pub switch: Option<usize>,
}

impl<S> ElementInstance<S> {
    /// The multipliers in the state of the element: its own, or the reactions that it reads.
    pub(crate) fn multipliers(&self) -> Range<usize> {
        self.first_multiplier..self.first_multiplier + self.num_constraints + self.num_reactions
    }

    /// Coordinates in which the element is linear at all times: none for one that events activate or deactivate.
    pub(crate) fn linear(&self) -> &'static [usize] {
        if self.switch.is_some() { &[] } else { self.element.linear() }
    }
}

impl<S: Scalar> ElementInstance<S> {
    pub(crate) fn new(
        name: String,
        element: Arc<dyn AnyElement>,
        coordinates: &[Coordinate],
        parameters: &[S],
        first_multiplier: usize,
    ) -> Self {
        let (num_constraints, parameters) = (element.num_constraints(), parameters.to_vec());
        let coordinates = coordinates.iter().map(|c| c.0).collect();
        let num_reactions = 0;
        Self { name, element, coordinates, first_multiplier, num_constraints, num_reactions, parameters, switch: None }
    }
}

/// An element with events: a rigid contact, open as long as its gap is positive, a switch, or an event by a condition.
pub(crate) struct EventElement<S> {
    /// The constraint with one equation, the gap; its multiplier is the impulse.
    pub gap: ElementInstance<S>,
    /// Coefficient of restitution; `None` for a switch.
    pub restitution: Option<S>,
    /// Condition and effects of an event that happens once; the gap then has only its name.
    pub when: Option<When<S>>,
    /// Modes of a rigid contact or of dry friction.
    pub unilateral: Option<Unilateral>,
}

impl<S> EventElement<S> {
    /// Returns whether it is a switch, at which an element itself jumps.
    pub(crate) fn is_switch(&self) -> bool {
        self.restitution.is_none() && self.when.is_none() && self.unilateral.is_none()
    }
}

/// A named scalar response: a weighted sum of quantities, or a formula of them.
pub(crate) struct OutputData<S> {
    pub name: String,
    pub terms: Vec<Term<S>>,
    pub formula: Option<Arc<dyn AnyFormula>>,
    /// Event from which on the output keeps its value.
    pub held_from: Option<usize>,
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
pub struct Term<S> {
    pub(crate) source: MeasuredQuantity,
    pub(crate) weight: S,
}

/// Coordinates, elements connected to them, prescribed motions and named outputs.
///
/// `S` is the number type of all quantities that depend on the design. Each element has a method that adds it, such as
/// [`Mechanism::revolute`], defined in the element's own file. [`Mechanism::add`] takes any [`Element`], also from outside
/// the crate.
pub struct Mechanism<S> {
    pub(crate) coordinates: Vec<CoordinateData<S>>,
    pub(crate) elements: Vec<ElementInstance<S>>,
    pub(crate) multipliers: usize,
    pub(crate) outputs: Vec<OutputData<S>>,
    pub(crate) events: Vec<EventElement<S>>,
    /// For each element that events activate or deactivate, true if it is active at the start.
    pub(crate) switches: Vec<bool>,
    pub(crate) gravity: [S; 3],
    ground: Body,
    ground3: Option<Body3>,
    /// Coordinates whose initial values follow from those of bodies.
    dependents: Vec<spatial::DependentCoordinate<S>>,
    /// Receives the time of running simulations.
    clock: Option<SimulationClock>,
}

impl<S: Scalar> Default for Mechanism<S> {
    fn default() -> Self {
        Self::new()
    }
}

impl<S: Scalar> Mechanism<S> {
    /// A mechanism with the ground only, without gravity.
    pub fn new() -> Self {
        let zero = S::from(0.0);
        let placeholder = Coordinate(0);
        let ground = Body { x: placeholder, y: placeholder, theta: placeholder };
        let mut mechanism = Self {
            coordinates: Vec::new(),
            elements: Vec::new(),
            multipliers: 0,
            outputs: Vec::new(),
            events: Vec::new(),
            switches: Vec::new(),
            gravity: [zero; 3],
            ground,
            ground3: None,
            dependents: Vec::new(),
            clock: None,
        };
        mechanism.ground = mechanism.massless_node("ground", Pose { x: zero, y: zero, theta: zero });
        mechanism.ground.coordinates().into_iter().for_each(|c| mechanism.fix(c));
        mechanism
    }

    /// A mechanism with the ground only, and the gravitational acceleration (`gx`, `gy`) in m/s² for its bodies.
    pub fn with_gravity(gx: S, gy: S) -> Self {
        Self { gravity: [gx, gy, S::from(0.0)], ..Self::new() }
    }

    /// Sets the clock that shows the time of running simulations.
    pub fn set_clock(&mut self, clock: SimulationClock) {
        self.clock = Some(clock);
    }

    /// Shows the time that a simulation has reached.
    pub(crate) fn tick(&self, time: f64) {
        if let Some(clock) = &self.clock {
            clock.set(time);
        }
    }

    /// The ground: the body at rest at the origin.
    pub fn ground(&self) -> Body {
        self.ground
    }

    /// Adds a coordinate with its initial position and velocity; if joints determine them, these are initial guesses.
    pub fn coordinate(&mut self, name: impl Into<String>, position: S, velocity: S) -> Coordinate {
        self.coordinates.push(CoordinateData {
            name: name.into(),
            position,
            velocity,
            motion: None,
            is_driven_twice: false,
            is_follower: false,
        });
        Coordinate(self.coordinates.len() - 1)
    }

    /// Adds a node without mass: three coordinates, to which elements may add inertia.
    pub fn massless_node(&mut self, name: &str, pose: Pose<S>) -> Body {
        let zero = S::from(0.0);
        Body {
            x: self.coordinate(format!("{name}.x"), pose.x, zero),
            y: self.coordinate(format!("{name}.y"), pose.y, zero),
            theta: self.coordinate(format!("{name}.theta"), pose.theta, zero),
        }
    }

    /// Adds a point at rest that beam ends can share; its rotation is that of the ground.
    pub fn fixed_node(&mut self, name: &str, x: S, y: S) -> Body {
        let zero = S::from(0.0);
        let node = Body {
            x: self.coordinate(format!("{name}.x"), x, zero),
            y: self.coordinate(format!("{name}.y"), y, zero),
            theta: self.ground.theta,
        };
        self.fix(node.x);
        self.fix(node.y);
        node
    }

    /// Sets the initial velocity of a coordinate.
    pub fn set_velocity(&mut self, coordinate: Coordinate, velocity: S) {
        self.coordinates[coordinate.0].velocity = velocity;
        self.update_dependents();
    }

    /// Names and positions of all coordinates, in the order in which they were added.
    pub fn coordinates(&self) -> impl ExactSizeIterator<Item = (&str, S)> {
        self.coordinates.iter().map(|coordinate| (coordinate.name.as_str(), coordinate.position))
    }

    /// Initial position of a coordinate.
    pub fn position(&self, coordinate: Coordinate) -> S {
        self.coordinates[coordinate.0].position
    }

    /// Prescribes a coordinate as a function of time. The driving force or torque is then an output
    /// ([`driving_force`](Self::driving_force)). A coordinate has at most one motion; a fixed one has one.
    pub fn drive(&mut self, coordinate: Coordinate, motion: impl Motion, parameters: &[S]) {
        let data = &mut self.coordinates[coordinate.0];
        data.is_driven_twice |= data.motion.is_some();
        data.motion = Some((Arc::new(motion), parameters.to_vec()));
    }

    /// Holds a coordinate at its initial position.
    pub fn fix(&mut self, coordinate: Coordinate) {
        let position = self.position(coordinate);
        self.drive(coordinate, Fixed, &[position]);
    }

    /// Adds an element that acts on `coordinates` with the design-dependent `parameters`, both in the order of its inputs.
    pub fn add(
        &mut self,
        name: impl Into<String>,
        element: impl Element,
        coordinates: &[Coordinate],
        parameters: &[S],
    ) -> ElementIndex {
        self.add_object(name.into(), Arc::new(element), coordinates, parameters)
    }

    pub(crate) fn add_object(
        &mut self,
        name: String,
        element: Arc<dyn AnyElement>,
        coordinates: &[Coordinate],
        parameters: &[S],
    ) -> ElementIndex {
        let element = ElementInstance::new(name, element, coordinates, parameters, self.multipliers);
        self.multipliers += element.num_constraints;
        self.elements.push(element);
        ElementIndex(self.elements.len() - 1)
    }

    /// Adds an element without constraints whose forces depend on the reactions of a `joint`, such as friction.
    ///
    /// Its coordinates and multipliers are those of the joint. Its parameters are its own `parameters`, followed by those of the
    /// joint.
    ///
    /// # Errors
    /// [`crate::Error::Definition`] if `joint` is not of one of the `kinds`.
    pub(crate) fn add_on_joint(
        &mut self,
        name: String,
        element: Arc<dyn AnyElement>,
        joint: ElementIndex,
        kinds: &[&str],
        parameters: &[S],
    ) -> crate::Result<ElementIndex> {
        let on = &self.elements[joint.0];
        let kind = on.element.descriptor().map_or("", |descriptor| descriptor.kind);
        if on.num_constraints == 0 || !kinds.contains(&kind) {
            let why = format!("`{}` is not a joint of kind {}", on.name, kinds.join(" or "));
            return Err(crate::Error::definition(
                name,
                why,
                "name the joint whose reaction presses the surfaces together",
            ));
        }
        let (first, num_reactions, coordinates) = (on.first_multiplier, on.num_constraints, on.coordinates.clone());
        let parameters = [parameters, &on.parameters].concat();
        let instance = ElementInstance::new(name, element, &[], &parameters, first);
        self.elements.push(ElementInstance { coordinates, num_reactions, ..instance });
        Ok(ElementIndex(self.elements.len() - 1))
    }

    /// Returns whether forces depend on reactions of joints.
    pub(crate) fn has_reaction_loads(&self) -> bool {
        self.elements.iter().any(|instance| instance.num_reactions > 0)
    }

    /// Adds a rigid contact with the coefficient of `restitution`, or a switch without one; `gap` has one constraint. Returns
    /// the joint that holds the contact closed.
    pub(crate) fn add_event(
        &mut self,
        name: String,
        gap: Arc<dyn AnyElement>,
        coordinates: &[Coordinate],
        parameters: &[S],
        restitution: Option<S>,
    ) -> Option<ElementIndex> {
        let joint = restitution.map(|_| self.add_object(name.clone(), gap.clone(), coordinates, parameters));
        let unilateral = joint.map(|joint| self.closed_contact(joint));
        let gap = ElementInstance::new(name, gap, coordinates, parameters, 0);
        self.events.push(EventElement { gap, restitution, when: None, unilateral });
        joint
    }

    /// The measure `name` of an element, with weight one.
    ///
    /// # Errors
    /// [`crate::Error::Definition`] if the element has no measure of that name.
    pub fn measure(&self, element: ElementIndex, name: &str) -> crate::Result<Term<S>> {
        let data = &self.elements[element.0];
        let known = data.element.measures();
        let measure = known.iter().position(|measure| measure.name == name).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|measure| measure.name).collect();
            let remedy = format!("its measures are {}", names.join(", "));
            crate::Error::definition(&data.name, format!("has no measure \"{name}\""), remedy)
        })?;
        Ok(Term { source: MeasuredQuantity::Measure { element: element.0, measure }, weight: S::from(1.0) })
    }

    /// The driving force (N) or torque (N·m) of a prescribed coordinate, such as the torque of a driven crank.
    pub fn driving_force(&self, coordinate: Coordinate) -> Term<S> {
        Term { source: MeasuredQuantity::DrivingForce { coordinate: coordinate.0 }, weight: S::from(1.0) }
    }

    /// The kinetic energy of the mechanism in J.
    pub fn kinetic_energy(&self) -> Term<S> {
        Term { source: MeasuredQuantity::KineticEnergy, weight: S::from(1.0) }
    }

    /// The potential energy of the mechanism in J: strain energy and weight.
    pub fn potential_energy(&self) -> Term<S> {
        Term { source: MeasuredQuantity::PotentialEnergy, weight: S::from(1.0) }
    }

    /// Adds a named output: a weighted sum of quantities.
    pub fn output(&mut self, name: impl Into<String>, terms: &[Term<S>]) {
        self.outputs.push(OutputData { name: name.into(), terms: terms.to_vec(), formula: None, held_from: None });
    }

    /// Adds a named output: a formula of time and of weighted quantities.
    pub fn output_formula(&mut self, name: impl Into<String>, formula: impl Formula, terms: &[Term<S>]) {
        let formula: Arc<dyn AnyFormula> = Arc::new(formula);
        self.outputs.push(OutputData {
            name: name.into(),
            terms: terms.to_vec(),
            formula: Some(formula),
            held_from: None,
        });
    }

    /// Returns whether `other` has the same coordinates, elements and outputs, connected in the same way.
    pub fn same_topology<T>(&self, other: &Mechanism<T>) -> bool {
        let same_connection = |(a, b): (&ElementInstance<S>, &ElementInstance<T>)| {
            a.coordinates == b.coordinates
                && a.multipliers() == b.multipliers()
                && a.parameters.len() == b.parameters.len()
        };
        self.coordinates.len() == other.coordinates.len()
            && self.elements.len() == other.elements.len()
            && self.outputs.len() == other.outputs.len()
            && self.events.len() == other.events.len()
            && self.switches == other.switches
            && self.elements.iter().zip(&other.elements).all(same_connection)
            && self.coordinates.iter().zip(&other.coordinates).all(|(a, b)| a.motion.is_some() == b.motion.is_some())
    }

    /// Returns whether the mechanism has rigid contacts, switches or events by a condition.
    pub fn has_events(&self) -> bool {
        !self.events.is_empty()
    }

    /// Names of the outputs, in the order in which they were added.
    pub fn output_names(&self) -> Vec<String> {
        self.outputs.iter().map(|o| o.name.clone()).collect()
    }
}

impl<S: Scalar> Term<S> {
    /// The quantity with its weight multiplied by `weight`.
    pub fn times(self, weight: S) -> Self {
        Self { weight: self.weight * weight, ..self }
    }
}
