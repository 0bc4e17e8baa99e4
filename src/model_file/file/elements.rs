//! `[[joint]]`, `[[driver]]` and `[[force]]`.

use super::element_kinds::{FileElementKind, KindSection, sections, shared_keys};
use super::feedback::{self, Feedback};
use super::joint_checks;
use super::key::{Accepts, Key};
use super::motion::{self, TimeFunction};
use super::parts::{BuildContext, CoordinateRef, FrameRef, JointCoordinate, MarkerSpec, NamedPart, Parts, PointRef};
use super::section::{Read, Section};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
#[cfg(feature = "report")]
use mechanics::elements::Symbol;
use mechanics::elements::{Added, Family, InputValue, Role};
use toml::de::DeTable;

/// A joint, drive or force whose numbers are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct ElementSpec {
    name: String,
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

/// Reads joints, drives and forces in this order and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<ElementSpec>> {
    let (mut all, mut drives) = (vec![], DrivenCoordinates::default());
    for (section, other) in sections(parts.is_spatial).iter().zip(sections(!parts.is_spatial)) {
        file.read_each(section.name, |table, span| {
            let kinds = section.kinds.iter().map(|(kind, keys)| (kind.descriptor.kind, (kind, *keys)));
            let chosen = Section::kind(&table, section.name, section.usual, kinds);
            let (kind, keys) = chosen.map_err(|error| of_other_space(error, &table, other, parts.is_spatial))?;
            let section = Section::of(table, span, section.name, &[section.common, keys], file.source())?;
            let symbol = NamedPart::Element(all.len(), kind.descriptor);
            let element = element(kind, keys, &section, names, parts)?;
            joint_checks::check(&element, &section, parts)?;
            drives.check(&element, &section)?;
            all.push(element);
            parts.add(&section.need_word("name")?, symbol)
        })?;
    }
    Ok(all)
}

/// The error about an unknown kind, with the remedy if the kind exists in mechanisms of the other dimension.
fn of_other_space(error: Diagnostic, table: &DeTable<'_>, other: &KindSection, is_spatial: bool) -> Diagnostic {
    let kind = table.get("kind").and_then(|kind| kind.get_ref().as_str());
    if !other.kinds.iter().any(|(known, _)| Some(known.descriptor.kind) == kind) {
        return error;
    }
    error.help(if is_spatial {
        "this kind is one of planar mechanisms, and the file has `space = 3`"
    } else {
        "this kind is one of mechanisms in space: write `space = 3` at the top of the file"
    })
}

/// Coordinates, or differences of coordinates, whose motion is prescribed, with the names of their drivers.
#[derive(Default)]
struct DrivenCoordinates(Vec<(Vec<CoordinateRef>, String)>);

impl DrivenCoordinates {
    /// Adds a driver of coordinates; other elements are ignored.
    ///
    /// # Errors
    /// If another driver prescribes the same motion, or if the driver acts on the ground alone.
    fn check(&mut self, element: &ElementSpec, section: &Section<'_>) -> Read<()> {
        let is_drive = element.kind.descriptor.family == Family::Drive;
        let place = |input: &InputSpec| match input {
            InputSpec::Coordinate(place) => Some(*place),
            _ => None,
        };
        let all: Vec<CoordinateRef> = element.inputs.iter().filter_map(place).collect();
        if !is_drive || all.is_empty() {
            return Ok(());
        }
        let key = element.kind.descriptor.inputs.iter().rfind(|input| input.role == Role::Coordinate);
        let key = key.map_or("name", |input| input.name);
        // The ground is at rest: a motion against it is that of the other coordinate.
        let is_moving = |place: &CoordinateRef| !matches!(place, CoordinateRef::Of(FrameRef::Ground, _));
        let moving: Vec<CoordinateRef> = all.into_iter().filter(is_moving).collect();
        if moving.is_empty() {
            return Err(section.error_at(key, "the ground cannot be driven").help("drive a coordinate of a body"));
        }
        let is_same = |other: &Vec<CoordinateRef>| {
            other.len() == moving.len() && moving.iter().all(|place| other.contains(place))
        };
        if let Some((_, first)) = self.0.iter().find(|(other, _)| is_same(other)) {
            let message =
                format!("the motion of this coordinate is prescribed twice, by `{first}` and `{}`", element.name);
            return Err(section.error_at(key, message).help("remove one of the two drivers"));
        }
        self.0.push((moving, element.name.clone()));
        Ok(())
    }
}

fn element(
    kind: &'static FileElementKind,
    keys: &[Key],
    section: &Section<'_>,
    names: &Names,
    parts: &Parts,
) -> Read<ElementSpec> {
    let shared = shared_keys(kind.descriptor);
    let input = |(role, key): (Role, &Key)| -> Read<InputSpec> {
        Ok(match role {
            Role::Marker | Role::Body | Role::Translations => InputSpec::Point(parts.point(section, key.name, names)?),
            Role::Marker3 | Role::Body3 | Role::Translations3 => {
                InputSpec::Marker(Box::new(parts.marker(section, key.name, names, shared)?))
            }
            Role::Coordinate => InputSpec::Coordinate(parts.coordinate(section, key.name)?),
            Role::Profile => InputSpec::Profile(section.pairs(key.name, names, &Scope::DESIGN)?),
            Role::Joint(kinds) => InputSpec::Joint(parts.joint(section, key.name, kinds)?),
            Role::Parameter | Role::Gravity => {
                InputSpec::Number(section.expression(key.name, names, &Scope::DESIGN)?)
            }
            Role::TimeFunction => InputSpec::Time(motion::read(section, key.name, names)?),
            Role::StateFunction => InputSpec::State(feedback::read(section, key.name, names, parts)?),
        })
    };
    let own = kind.descriptor.inputs.len() - usize::from(JointCoordinate::of_element(kind.descriptor).is_some());
    let (mut rest, mut inputs) = (&kind.descriptor.inputs[..own], vec![]);
    for key in keys {
        let Some(first) = rest.first() else { break };
        if key.accepts == Accepts::Triple {
            inputs.extend(section.triple(key.name, names, &Scope::DESIGN)?.map(InputSpec::Number));
            rest = &rest[3..];
        } else {
            inputs.push(input((first.role, key))?);
            rest = &rest[1..];
        }
    }
    Ok(ElementSpec { name: section.text("name")?, kind, inputs })
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
