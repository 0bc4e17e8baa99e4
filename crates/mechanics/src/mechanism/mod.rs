//! A mechanism: coordinates, elements connected to them, prescribed motions and named outputs.

mod body;
mod clock;
pub mod element;
mod element_instance;
pub mod frame;
pub(crate) mod frame3;
pub(crate) mod output;
pub mod rotation;
pub mod scalars;
mod spatial;
pub(crate) mod vector;

pub use body::{Body, Body3, Coordinate, Marker, Marker3, Pose, Pose3};
pub use clock::SimulationClock;
pub use element_instance::ElementIndex;
pub(crate) use element_instance::{ElementInstance, EventCondition, EventElement, Unilateral, refuse_switches};
pub use output::{AnyFormula, EventSide, Formula, FormulaIn, WeightedQuantity};
pub(crate) use output::{MeasuredQuantity, OutputData};
pub use rotation::{EulerSequence, Rotation};

use crate::mechanism::element::{AnyElement, Element, ElementState, SwitchSides};
use crate::motion::{AnyMotion, Fixed, Motion};
use autodiff::{Jet2, Scalar};
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

pub(crate) struct CoordinateData<S> {
    pub name: String,
    pub position: S,
    pub velocity: S,
    /// True if the initial velocity is given: it is kept if the constraints allow.
    pub is_given: bool,
    pub motion: Option<(Arc<dyn AnyMotion>, Vec<S>)>,
    /// True if a second motion was prescribed: an error of every analysis.
    pub is_driven_twice: bool,
    /// True if it is determined by other coordinates: it then has no weight in the distance from the built positions.
    pub is_follower: bool,
    /// Axis of a position of a body in m: 0, 1, 2 for x, y, z.
    pub axis: Option<usize>,
    /// The switch that is on while a follower keeps its place, as where friction sticks.
    pub holding: Option<usize>,
}

/// A coordinate whose initial value follows from those of other coordinates, such as the angle of a joint.
pub(crate) struct DependentCoordinate<S> {
    /// The coordinate.
    pub coordinate: Coordinate,
    /// Coordinates that it depends on.
    pub coordinates: Vec<Coordinate>,
    /// Parameters that it depends on.
    pub parameters: Vec<S>,
    /// Its value along a motion.
    pub value: fn(&ElementState<'_, Jet2<S>>) -> Jet2<S>,
}

/// Coordinates, elements connected to them, prescribed motions and named outputs.
///
/// `S` is the number type of all quantities that depend on the design. Each element has a method that adds it, such as
/// [`Mechanism::revolute`], defined in the element's own file. [`Mechanism::add`] takes any [`Element`], even from outside
/// the crate.
pub struct Mechanism<S> {
    pub(crate) coordinates: Vec<CoordinateData<S>>,
    pub(crate) elements: Vec<ElementInstance<S>>,
    pub(crate) multipliers: usize,
    pub(crate) outputs: Vec<OutputData<S>>,
    pub(crate) events: Vec<EventElement<S>>,
    /// For each element that events activate or deactivate, true if it is active at the start.
    pub(crate) switches: Vec<bool>,
    /// Number of elements with switching functions.
    pub(crate) sided: usize,
    pub(crate) gravity: [S; 3],
    ground: Body,
    ground3: Option<Body3>,
    /// Coordinates whose initial values follow from those of bodies.
    dependents: Vec<DependentCoordinate<S>>,
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
            sided: 0,
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

    /// Adds a coordinate with its initial position and velocity.
    ///
    /// If joints determine the position, this is an initial guess. A velocity of zero is free: it follows from given ones through
    /// the joints, or is that of the least kinetic energy. [`set_velocity`](Self::set_velocity) gives a velocity, also zero.
    pub fn coordinate(&mut self, name: impl Into<String>, position: S, velocity: S) -> Coordinate {
        self.coordinates.push(CoordinateData {
            name: name.into(),
            position,
            is_given: velocity.re() != 0.0,
            velocity,
            motion: None,
            is_driven_twice: false,
            is_follower: false,
            axis: None,
            holding: None,
        });
        Coordinate(self.coordinates.len() - 1)
    }

    /// Adds the coordinates of a `point` (m) named `name`, at rest; in the plane two, in space three.
    pub(crate) fn point<const N: usize>(&mut self, name: &str, point: [S; N]) -> [Coordinate; N] {
        std::array::from_fn(|axis| {
            let coordinate = self.coordinate(format!("{name}.{}", ["x", "y", "z"][axis]), point[axis], S::zero());
            self.coordinates[coordinate.0].axis = Some(axis);
            coordinate
        })
    }

    /// Adds a node without mass: three coordinates, to which elements may add inertia.
    pub fn massless_node(&mut self, name: &str, pose: Pose<S>) -> Body {
        let [x, y] = self.point(name, [pose.x, pose.y]);
        Body { x, y, theta: self.coordinate(format!("{name}.theta"), pose.theta, S::zero()) }
    }

    /// Adds a point at rest that beam ends can share; its rotation is that of the ground.
    pub fn fixed_node(&mut self, name: &str, x: S, y: S) -> Body {
        let [x, y] = self.point(name, [x, y]);
        let node = Body { x, y, theta: self.ground.theta };
        self.fix(node.x);
        self.fix(node.y);
        node
    }

    /// Gives the initial velocity of a coordinate. It is kept if joints and other given velocities allow; if not, a warning of the
    /// analysis says what it becomes. Velocities that are not given follow.
    pub fn set_velocity(&mut self, coordinate: Coordinate, velocity: S) {
        let data = &mut self.coordinates[coordinate.0];
        (data.velocity, data.is_given) = (velocity, true);
        self.update_dependents();
    }

    /// Adds a coordinate with the initial position and velocity that follow from `coordinates` and `parameters` by `value`.
    ///
    /// The velocity is computed again when other initial velocities are set.
    pub(crate) fn dependent_coordinate(
        &mut self,
        name: &str,
        coordinates: &[Coordinate],
        parameters: &[S],
        value: fn(&ElementState<'_, Jet2<S>>) -> Jet2<S>,
    ) -> Coordinate {
        let coordinate = self.coordinate(name, S::zero(), S::zero());
        let (coordinates, parameters) = (coordinates.to_vec(), parameters.to_vec());
        let dependent = DependentCoordinate { coordinate, coordinates, parameters, value };
        self.coordinates[coordinate.0].position = self.at_start(&dependent).re;
        self.dependents.push(dependent);
        self.update_dependents();
        coordinate
    }

    /// Computes the initial velocities of dependent coordinates.
    pub(crate) fn update_dependents(&mut self) {
        for k in 0..self.dependents.len() {
            let dependent = &self.dependents[k];
            let velocity = self.at_start(dependent).v1;
            self.coordinates[dependent.coordinate.0].velocity = velocity;
        }
    }

    /// Initial position and velocity of a dependent coordinate.
    fn at_start(&self, dependent: &DependentCoordinate<S>) -> Jet2<S> {
        let zero = S::zero();
        let jet = |c: &Coordinate| Jet2::new(self.coordinates[c.0].position, self.coordinates[c.0].velocity, zero);
        let q: Vec<_> = dependent.coordinates.iter().map(jet).collect();
        let p: Vec<_> = dependent.parameters.iter().map(|&p| Jet2::new(p, zero, zero)).collect();
        let still = vec![Jet2::new(zero, zero, zero); q.len()];
        let x = ElementState { t: still[0], p: &p, q: &q, v: &still, a: &still, l: &[], sides: SwitchSides::default() };
        (dependent.value)(&x)
    }

    /// Names and positions of all coordinates, in the order in which they were added.
    pub fn coordinates(&self) -> impl ExactSizeIterator<Item = (&str, S)> {
        self.coordinates.iter().map(|coordinate| (coordinate.name.as_str(), coordinate.position))
    }

    /// Extent of the mechanism at the positions `q`: the largest distance of two bodies along an axis, in m. Of one body, the largest distance from
    /// the ground's origin.
    pub(crate) fn extent(&self, q: &[f64]) -> f64 {
        let ground3 = self.ground3_coordinates();
        let is_ground =
            |i: usize| self.ground.coordinates().iter().any(|c| c.0 == i) || ground3.is_some_and(|of| of.contains(&i));
        let largest = |includes: &dyn Fn(usize) -> bool| {
            let [mut least, mut most] = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
            for (i, coordinate) in self.coordinates.iter().enumerate().filter(|(i, _)| includes(*i)) {
                if let Some(axis) = coordinate.axis {
                    (least[axis], most[axis]) = (least[axis].min(q[i]), most[axis].max(q[i]));
                }
            }
            least.iter().zip(&most).map(|(least, most)| most - least).fold(0.0, f64::max)
        };
        let of_bodies = largest(&|i| !is_ground(i));
        if of_bodies > 0.0 { of_bodies } else { largest(&|_| true) }
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
        let mut element = ElementInstance::new(name, element, coordinates, parameters, self.multipliers);
        self.multipliers += element.num_constraints;
        if element.element.num_switching_functions() > 0 {
            element.sides = Some(self.sided);
            self.sided += 1;
        }
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

    /// Forces that depend on reactions of joints, in general not linearly.
    ///
    /// The row of dry friction that sticks is not among them: it is linear in its own force, and an implicit step need not wait for it.
    pub(crate) fn reaction_loads(&self) -> impl Iterator<Item = &ElementInstance<S>> {
        let is_sticking = |instance: &ElementInstance<S>| {
            let laws = || self.events.iter().filter_map(|event| event.unilateral);
            laws().any(|law| matches!(law, Unilateral::Friction { sticking, .. } if instance.switch == Some(sticking)))
        };
        self.elements.iter().filter(move |instance| instance.num_reactions > 0 && !is_sticking(instance))
    }

    /// Returns whether there are such forces.
    pub(crate) fn has_reaction_loads(&self) -> bool {
        self.reaction_loads().next().is_some()
    }

    /// Returns whether there are such forces, or dry friction that sticks: the limit of sticking is compared with iterated forces.
    pub(crate) fn has_reactions_as_loads(&self) -> bool {
        self.elements.iter().any(|instance| instance.num_reactions > 0)
    }

    /// The measure `name` of an element, with weight one.
    ///
    /// # Errors
    /// [`crate::Error::Definition`] if the element has no measure of that name.
    pub fn measure(&self, element: ElementIndex, name: &str) -> crate::Result<WeightedQuantity<S>> {
        let data = &self.elements[element.0];
        let known = data.element.measures();
        let measure = known.iter().position(|measure| measure.name == name).ok_or_else(|| {
            let names: Vec<&str> = known.iter().map(|measure| measure.name).collect();
            let remedy = format!("its measures are {}", names.join(", "));
            crate::Error::definition(&data.name, format!("has no measure \"{name}\""), remedy)
        })?;
        Ok(WeightedQuantity { source: MeasuredQuantity::Measure { element: element.0, measure }, weight: S::from(1.0) })
    }

    /// The element that was added last, such as that of a joint coordinate; `None` without elements.
    pub fn last_element(&self) -> Option<ElementIndex> {
        self.elements.len().checked_sub(1).map(ElementIndex)
    }

    /// The driving force (N) or torque (N·m) of a prescribed coordinate, such as the torque of a driven crank.
    pub fn driving_force(&self, coordinate: Coordinate) -> WeightedQuantity<S> {
        WeightedQuantity { source: MeasuredQuantity::DrivingForce { coordinate: coordinate.0 }, weight: S::from(1.0) }
    }

    /// The kinetic energy of the mechanism in J.
    pub fn kinetic_energy(&self) -> WeightedQuantity<S> {
        WeightedQuantity { source: MeasuredQuantity::KineticEnergy, weight: S::from(1.0) }
    }

    /// The potential energy of the mechanism in J: that of weight, springs, bushings, ropes, beams and compliant contacts.
    ///
    /// Loads, actuators and functions of the state have none, not even where their force is constant.
    pub fn potential_energy(&self) -> WeightedQuantity<S> {
        WeightedQuantity { source: MeasuredQuantity::PotentialEnergy, weight: S::from(1.0) }
    }

    /// Adds a named output: a weighted sum of quantities.
    pub fn output(&mut self, name: impl Into<String>, terms: &[WeightedQuantity<S>]) {
        self.add_output(name.into(), None, terms);
    }

    /// Adds a named output: a formula of time and of weighted quantities.
    pub fn output_formula(&mut self, name: impl Into<String>, formula: impl Formula, terms: &[WeightedQuantity<S>]) {
        self.add_output(name.into(), Some(Arc::new(formula)), terms);
    }

    fn add_output(&mut self, name: String, formula: Option<Arc<dyn AnyFormula>>, terms: &[WeightedQuantity<S>]) {
        let terms = terms.to_vec();
        self.outputs.push(OutputData { name, terms, formula, held: None, is_differentiated: true });
    }

    /// Excludes the outputs for whose number `is_wanted` is false from derivatives: theirs may be undefined, as those of reactions that
    /// redundant constraints leave indeterminate. Their values stay.
    pub fn differentiate_only(&mut self, is_wanted: impl Fn(usize) -> bool) {
        self.outputs.iter_mut().enumerate().for_each(|(k, output)| output.is_differentiated = is_wanted(k));
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

    /// Returns whether an event may end the motion.
    pub(crate) fn may_end(&self) -> bool {
        self.events.iter().any(EventElement::is_terminal)
    }

    /// Names of the outputs, in the order in which they were added.
    pub fn output_names(&self) -> Vec<String> {
        self.outputs.iter().map(|o| o.name.clone()).collect()
    }
}
