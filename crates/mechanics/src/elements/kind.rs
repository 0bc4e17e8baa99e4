//! Elements by their declarations: adding any of them to a mechanism from values of its inputs.

use crate::elements::state_function::StateFunction;
use crate::mechanism::element::{AnyElement, ElementDescriptor, Input, Role};
use crate::mechanism::{Coordinate, ElementIndex, Marker, Marker3, Mechanism};
use crate::motion::Motion;
use autodiff::Scalar;
use std::sync::Arc;

/// A kind of element that is made from values of its declared inputs.
///
/// `F` is the type of its function of time and `L` of its function of state, if it has one.
pub struct ElementKind<F, L> {
    /// Declaration.
    pub descriptor: &'static ElementDescriptor,
    constructor: Constructor<F, L>,
}

enum Constructor<F, L> {
    Element(Arc<dyn AnyElement>),
    OfTime(fn(F) -> Arc<dyn AnyElement>),
    OfState(fn(L) -> Arc<dyn AnyElement>),
    RigidContact(Arc<dyn AnyElement>),
    DryFriction,
    Prescribed,
}

impl<F, L> std::fmt::Debug for ElementKind<F, L> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_tuple("ElementKind").field(&self.descriptor.kind).finish()
    }
}

/// Value of an input of an element.
#[derive(Clone, Debug)]
pub enum InputValue<S, F, L> {
    /// A point; of inputs that are bodies, any point of the body.
    Marker(Marker<S>),
    /// A point with axes in space; of inputs that are bodies, any point of the body.
    Marker3(Marker3<S>),
    /// A coordinate.
    Coordinate(Coordinate),
    /// A joint.
    Joint(ElementIndex),
    /// Points of a closed curve.
    Profile(Vec<[S; 2]>),
    /// A parameter.
    Parameter(S),
    /// A function of time with its parameters.
    TimeFunction(F, Vec<S>),
    /// A function of state with the coordinates that it observes and its parameters.
    StateFunction(L, Vec<Coordinate>, Vec<S>),
}

/// Item that [`ElementKind::add_to`] has added to a mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Added {
    /// An element.
    Element(ElementIndex),
    /// A prescribed motion of this coordinate.
    Motion(Coordinate),
}

/// Values of the inputs of an element, by their use.
struct ElementInputs<S, F, L> {
    coordinates: Vec<Coordinate>,
    parameters: Vec<S>,
    of_time: Option<F>,
    of_state: Option<L>,
    /// The joint on which the element acts, and the kinds of joints on which it can act.
    on_joint: Option<(ElementIndex, &'static [&'static str])>,
}

impl<S, F, L> Default for ElementInputs<S, F, L> {
    fn default() -> Self {
        Self { coordinates: Vec::new(), parameters: Vec::new(), of_time: None, of_state: None, on_joint: None }
    }
}

impl<S: Scalar, F, L> ElementInputs<S, F, L> {
    /// Adds the value of one input.
    ///
    /// # Panics
    /// If the value does not match the input.
    fn add(&mut self, input: &Input, value: InputValue<S, F, L>) {
        match (input.role, value) {
            (Role::Marker, InputValue::Marker(marker)) => {
                self.coordinates.extend(marker.body.coordinates());
                self.parameters.extend([marker.x, marker.y]);
            }
            (Role::Body, InputValue::Marker(marker)) => self.coordinates.extend(marker.body.coordinates()),
            (Role::Translations, InputValue::Marker(marker)) => {
                self.coordinates.extend([marker.body.x, marker.body.y]);
            }
            (Role::Marker3, InputValue::Marker3(marker)) => {
                self.coordinates.extend(marker.body.coordinates());
                self.parameters.extend(marker.parameters());
            }
            (Role::Body3, InputValue::Marker3(marker)) => self.coordinates.extend(marker.body.coordinates()),
            (Role::Translations3, InputValue::Marker3(marker)) => {
                self.coordinates.extend([marker.body.x, marker.body.y, marker.body.z]);
            }
            (Role::Coordinate, InputValue::Coordinate(coordinate)) => self.coordinates.push(coordinate),
            (Role::Parameter | Role::Gravity, InputValue::Parameter(value)) => self.parameters.push(value),
            (Role::Profile, InputValue::Profile(points)) => self.parameters.extend(points.into_iter().flatten()),
            (Role::Joint(kinds), InputValue::Joint(joint)) => self.on_joint = Some((joint, kinds)),
            (Role::TimeFunction, InputValue::TimeFunction(function, own)) => {
                self.of_time = Some(function);
                self.parameters.extend(own);
            }
            (Role::StateFunction, InputValue::StateFunction(function, observed, own)) => {
                self.of_state = Some(function);
                self.coordinates.extend(observed);
                self.parameters.extend(own);
            }
            _ => panic!("the value of `{}` does not suit {:?}", input.name, input.role),
        }
    }
}

impl<F: Motion, L: StateFunction> ElementKind<F, L> {
    fn new(descriptor: &'static ElementDescriptor, constructor: Constructor<F, L>) -> Self {
        Self { descriptor, constructor }
    }

    /// An element without functions.
    ///
    /// # Panics
    /// If the element has no descriptor.
    pub fn plain(element: Arc<dyn AnyElement>) -> Self {
        let descriptor = element.descriptor().expect("every registered element is declared");
        Self::new(descriptor, Constructor::Element(element))
    }

    /// An element with a function of time.
    pub fn of_time(descriptor: &'static ElementDescriptor, of: fn(F) -> Arc<dyn AnyElement>) -> Self {
        Self::new(descriptor, Constructor::OfTime(of))
    }

    /// An element with a function of time and state.
    pub fn of_state(descriptor: &'static ElementDescriptor, of: fn(L) -> Arc<dyn AnyElement>) -> Self {
        Self::new(descriptor, Constructor::OfState(of))
    }

    /// A rigid contact with a gap of one constraint. Its last parameter is the coefficient of restitution.
    pub fn rigid_contact(descriptor: &'static ElementDescriptor, gap: Arc<dyn AnyElement>) -> Self {
        Self::new(descriptor, Constructor::RigidContact(gap))
    }

    /// Dry friction between two coordinates.
    pub fn dry_friction(descriptor: &'static ElementDescriptor) -> Self {
        Self::new(descriptor, Constructor::DryFriction)
    }

    /// A prescribed motion of one coordinate.
    pub fn prescribed(descriptor: &'static ElementDescriptor) -> Self {
        Self::new(descriptor, Constructor::Prescribed)
    }

    /// Returns whether it is a rigid contact or dry friction, whose modes change during the motion; only simulations in time support them.
    pub fn has_modes(&self) -> bool {
        matches!(self.constructor, Constructor::RigidContact(_) | Constructor::DryFriction)
    }

    /// Returns whether it is a rigid contact.
    pub fn is_rigid_contact(&self) -> bool {
        matches!(self.constructor, Constructor::RigidContact(_))
    }

    /// Returns whether it prescribes the motion of one coordinate, which is then no unknown.
    pub fn is_prescribed(&self) -> bool {
        matches!(self.constructor, Constructor::Prescribed)
    }

    /// Adds an element to a mechanism.
    ///
    /// * `values`: one value per input of the descriptor, in its order.
    ///
    /// # Panics
    /// If a value does not match its input, such as a joint of another kind.
    pub fn add_to<S: Scalar>(
        &self,
        mechanism: &mut Mechanism<S>,
        name: &str,
        values: Vec<InputValue<S, F, L>>,
    ) -> Added {
        assert_eq!(values.len(), self.descriptor.inputs.len(), "values for the inputs of {}", self.descriptor.kind);
        let mut inputs = ElementInputs::default();
        self.descriptor.inputs.iter().zip(values).for_each(|(input, value)| inputs.add(input, value));
        let ElementInputs { coordinates, mut parameters, of_time, of_state, on_joint } = inputs;
        let declared = "a declared function has a value";
        let element = match &self.constructor {
            Constructor::Element(element) => element.clone(),
            Constructor::OfTime(of) => of(of_time.expect(declared)),
            Constructor::OfState(of) => of(of_state.expect(declared)),
            Constructor::RigidContact(gap) => {
                let restitution = parameters.pop();
                let joint = mechanism.add_event(name.into(), gap.clone(), &coordinates, &parameters, restitution);
                return Added::Element(joint.expect("a contact with restitution has a joint"));
            }
            Constructor::DryFriction => {
                let parameters = parameters.try_into().expect("as many as it declares");
                return Added::Element(mechanism.dry_friction(name, coordinates[0], coordinates[1], parameters));
            }
            Constructor::Prescribed => {
                mechanism.drive(coordinates[0], of_time.expect(declared), &parameters);
                return Added::Motion(coordinates[0]);
            }
        };
        if let Some((joint, kinds)) = on_joint {
            let added = mechanism.add_on_joint(name.into(), element, joint, kinds, &parameters);
            return Added::Element(added.expect("the joint is of a declared kind"));
        }
        Added::Element(mechanism.add_object(name.into(), element, &coordinates, &parameters))
    }
}
