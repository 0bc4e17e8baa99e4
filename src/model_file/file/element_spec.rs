//! A joint, drive or force of a model file.

use super::element_kinds::FileElementKind;
use super::feedback::Feedback;
use super::motion::TimeFunction;
#[cfg(feature = "report")]
use super::parts::FrameRef;
use super::parts::{BuildContext, CoordinateRef, JointCoordinate, MarkerSpec, PointRef};
use crate::model_file::expression::{CompiledExpression, Inputs};
use autodiff::Scalar;
#[cfg(feature = "report")]
use mechanics::elements::Symbol;
use mechanics::elements::{Added, InputValue};

/// A joint, drive or force whose numbers are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct ElementSpec {
    pub name: String,
    pub kind: &'static FileElementKind,
    pub inputs: Vec<InputSpec>,
}

/// An input of an element.
#[derive(Clone, Debug)]
pub enum InputSpec {
    Point(PointRef),
    /// A point with axes in space.
    Marker(Box<MarkerSpec>),
    Coordinate(CoordinateRef),
    /// Points of a closed curve.
    Profile(Vec<[CompiledExpression; 2]>),
    /// A joint, by its number.
    Joint(usize),
    Number(CompiledExpression),
    Time(TimeFunction),
    State(Feedback),
}

impl ElementSpec {
    /// Adds the element to a mechanism.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S]) {
        let value = |expression: &CompiledExpression| expression.value(&Inputs::design(b));
        let mut input = |input: &InputSpec| match input {
            InputSpec::Point(point) => InputValue::Marker(context.marker(point, b)),
            InputSpec::Marker(marker) => InputValue::Marker3(context.marker3(marker, b)),
            InputSpec::Coordinate(place) => InputValue::Coordinate(context.coordinate(*place)),
            InputSpec::Profile(points) => {
                InputValue::Profile(points.iter().map(|[x, y]| [value(x), value(y)]).collect())
            }
            InputSpec::Joint(k) => {
                let Added::Element(joint) = context.elements[*k] else { unreachable!("such a part was refused") };
                InputValue::Joint(joint)
            }
            InputSpec::Number(expression) => InputValue::Parameter(value(expression)),
            InputSpec::Time(function) => {
                InputValue::TimeFunction(function.law.clone(), function.parameters.iter().map(value).collect())
            }
            InputSpec::State(feedback) => {
                let (law, parameters, observed) = feedback.build(context, b);
                InputValue::StateFunction(law, observed, parameters)
            }
        };
        let values: Vec<_> = self.inputs.iter().map(&mut input).collect();
        if let [InputValue::Marker3(first), InputValue::Marker3(second), ..] = values[..] {
            context.joints.insert(context.elements.len(), (self.name.clone(), [first, second]));
        }
        let added = match JointCoordinate::of_element(self.kind.descriptor) {
            Some(own) => Added::Element(context.joint_coordinate(context.elements.len(), own).1),
            None => self.kind.add_to(&mut context.mechanism, &self.name, values),
        };
        context.elements.push(added);
    }
}

/// Geometry of the element for drawings.
#[cfg(feature = "report")]
impl ElementSpec {
    /// Symbol in drawings.
    pub fn symbol(&self) -> Symbol {
        self.kind.descriptor.symbol
    }

    /// Frames that the element is attached to by points.
    pub fn frames(&self) -> impl Iterator<Item = FrameRef> {
        self.points().map(|point| point.frame).chain(self.markers().map(|marker| marker.frame))
    }

    /// Points in space that the element is attached to.
    pub fn markers(&self) -> impl Iterator<Item = &MarkerSpec> {
        self.inputs.iter().filter_map(|input| match input {
            InputSpec::Marker(marker) => Some(&**marker),
            _ => None,
        })
    }

    /// Points that the element is attached to.
    pub fn points(&self) -> impl Iterator<Item = &PointRef> {
        self.inputs.iter().filter_map(|input| match input {
            InputSpec::Point(point) => Some(point),
            _ => None,
        })
    }

    /// Coordinates that the element is attached to.
    pub fn coordinates(&self) -> impl Iterator<Item = CoordinateRef> {
        self.inputs.iter().filter_map(|input| match input {
            InputSpec::Coordinate(coordinate) => Some(*coordinate),
            _ => None,
        })
    }

    /// Points of its closed curve; none if it has no profile.
    pub fn profile(&self) -> &[[CompiledExpression; 2]] {
        let own = self.inputs.iter().find_map(|input| match input {
            InputSpec::Profile(points) => Some(&points[..]),
            _ => None,
        });
        own.unwrap_or_default()
    }

    /// Number of the joint to which it belongs.
    pub fn joint(&self) -> Option<usize> {
        self.inputs.iter().find_map(|input| match input {
            InputSpec::Joint(k) => Some(*k),
            _ => None,
        })
    }

    /// Values of the parameters.
    pub fn numbers(&self) -> impl Iterator<Item = &CompiledExpression> {
        self.inputs.iter().filter_map(|input| match input {
            InputSpec::Number(expression) => Some(expression),
            _ => None,
        })
    }
}
