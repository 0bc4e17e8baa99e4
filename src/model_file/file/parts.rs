//! Names of the parts of a mechanism, references to them, and points on them.

use super::key::{Accepts, Key, required};
use super::section::{FileSource, Read, Section, Value, Word, vector, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::elements::{Added, ElementDescriptor, Family, Role};
use mechanics::events::EventIndex;
use mechanics::mechanism::{Body, Body3, Coordinate, ElementIndex, EulerSequence, Marker, Marker3, Mechanism};
use std::collections::HashMap;
use std::ops::Range;
use toml::de::DeValue;

/// A reference to a frame: the ground, a body or a beam node.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameRef {
    Ground,
    Body(usize),
    /// Node of a beam, from zero.
    Node(usize, usize),
}

/// A named part of a mechanism.
#[derive(Clone, Debug)]
pub enum NamedPart {
    Frame(FrameRef),
    /// A body with one coordinate.
    Slider(usize),
    /// A beam with its number of elements.
    Beam(usize, usize),
    Point(usize),
    /// A joint, drive or force with its descriptor.
    Element(usize, &'static ElementDescriptor),
    Event(usize),
}

/// A reference to a point: a frame and coordinates in it.
#[derive(Clone, Debug)]
pub struct PointRef {
    pub frame: FrameRef,
    pub at: [CompiledExpression; 2],
}

/// Three numbers as expressions.
pub type Vector = [CompiledExpression; 3];

/// A point as it is given.
#[derive(Clone, Debug)]
pub enum PointSpec {
    /// Coordinates in the axes of a frame.
    Coordinates(Vector),
    /// The place where a named point is at the start.
    Point(usize),
}

/// A direction of any length.
#[derive(Clone, Debug)]
pub enum Direction {
    /// Components in the axes of a frame.
    Components(Vector),
    /// From one named point to another, where they are at the start.
    Through([usize; 2]),
}

/// An orientation as it is given, relative to a frame.
#[derive(Clone, Debug)]
pub enum Axes {
    /// The axes of the frame.
    Same,
    /// Angles about the axes of a sequence.
    Angles(EulerSequence, Vector),
    /// An angle about an axis.
    About(Direction, CompiledExpression),
    /// The axis z, and the direction near which the axis x is.
    Z(Direction, Option<Direction>),
    /// The axis x.
    X(Direction),
    /// Other axes, rotated by the smallest angle that gives z this direction.
    Bent(Box<Axes>, Direction),
    /// Euler parameters, scalar first.
    EulerParameters([CompiledExpression; 4]),
    /// A rotation matrix of numbers, as the rotation.
    Fixed([f64; 4]),
}

/// A point with axes on a frame.
#[derive(Clone, Debug)]
pub struct MarkerSpec {
    pub frame: FrameRef,
    pub place: PointSpec,
    /// True if the place is given in world axes, where it is at the start.
    pub is_world_place: bool,
    pub axes: Axes,
    pub is_world_axes: bool,
}

impl MarkerSpec {
    /// The reference point of a frame, with its axes.
    pub fn of(frame: FrameRef) -> Self {
        let place = PointSpec::Coordinates([0.0; 3].map(CompiledExpression::constant));
        Self { frame, place, is_world_place: false, axes: Axes::Same, is_world_axes: false }
    }

    /// True if it has axes of its own.
    pub fn has_axes(&self) -> bool {
        !matches!(self.axes, Axes::Same)
    }
}

/// A reference to a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CoordinateRef {
    Of(FrameRef, FrameCoordinate),
    Slider(usize),
    /// A coordinate of the joint with this number, in space.
    Joint(usize, JointCoordinate),
}

/// The motion of a joint in space as a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum JointCoordinate {
    Angle,
    Displacement,
    Distance,
}

impl JointCoordinate {
    /// Those that a joint of this kind has, with the names of position, velocity and acceleration.
    pub const NAMES: [(Self, &'static [&'static str], [&'static str; 3]); 2] = [
        (Self::Angle, &["revolute", "cylindrical", "planar"], ["angle", "omega", "alpha"]),
        (Self::Displacement, &["prismatic", "cylindrical"], ["displacement", "velocity", "acceleration"]),
    ];

    /// The coordinate that an element in space is: an angle, a displacement or a distance of two points.
    pub fn of_element(descriptor: &ElementDescriptor) -> Option<Self> {
        let is_one =
            descriptor.inputs.iter().map(|input| input.role).eq([Role::Marker3, Role::Marker3, Role::Coordinate]);
        is_one.then_some(match descriptor.kind {
            "angle" => Self::Angle,
            "displacement" => Self::Displacement,
            _ => Self::Distance,
        })
    }

    /// Units of position, velocity and acceleration.
    pub fn units(self) -> [&'static str; 3] {
        if self == Self::Angle { ["rad", "rad/s", "rad/s²"] } else { ["m", "m/s", "m/s²"] }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum FrameCoordinate {
    X,
    Y,
    Z,
    Theta,
}

pub const POINT_KEYS: &[Key] = &[
    required("body", Accepts::Name, "name of a body or beam node, or \"ground\""),
    required("at", Accepts::Pair, "position [x, y] in m, in axes fixed to it").of("m"),
];

/// Names of the parts that have been read so far.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    named: HashMap<String, NamedPart>,
    pub order: Vec<String>,
    pub points: Vec<PointRef>,
    /// True if the mechanism is in space.
    pub is_spatial: bool,
    /// Named points in space.
    pub markers: Vec<MarkerSpec>,
    /// Numbers of the bodies in space that do not turn: point masses.
    pub without_rotation: Vec<usize>,
}

impl Parts {
    /// Adds a name.
    pub fn add(&mut self, word: &Word, named: NamedPart) -> Read<()> {
        crate::model_file::expression::check_name(&word.text, word.span.clone())?;
        if self.named.contains_key(&word.text) {
            return Err(Diagnostic::used_again(word.span.clone(), &word.text).help("give every part its own name"));
        }
        self.named.insert(word.text.clone(), named);
        self.order.push(word.text.clone());
        Ok(())
    }

    /// Joints, drives and forces with their numbers.
    pub fn elements(&self) -> impl Iterator<Item = (usize, &'static ElementDescriptor)> {
        self.named.values().filter_map(|named| match named {
            NamedPart::Element(k, descriptor) => Some((*k, *descriptor)),
            _ => None,
        })
    }

    pub fn get(&self, name: &str) -> Option<&NamedPart> {
        self.named.get(name)
    }

    /// The number of the event of that name.
    pub fn event(&self, word: &Word) -> Read<usize> {
        if let Some(NamedPart::Event(k)) = self.named.get(&word.text) {
            return Ok(*k);
        }
        let known = self.order.iter().filter(|name| matches!(self.named[*name], NamedPart::Event(_)));
        Err(Diagnostic::unknown(word.span.clone(), "event", &word.text, known.map(String::as_str)))
    }

    /// The number of the joint at `key` of a part, which is of one of the `kinds`.
    pub fn joint(&self, section: &Section<'_>, key: &str, kinds: &[&str]) -> Read<usize> {
        let word = section.need_word(key)?;
        let suits = |name: &String| match self.named[name] {
            NamedPart::Element(k, descriptor) => {
                (descriptor.family == Family::Joint && kinds.contains(&descriptor.kind)).then_some(k)
            }
            _ => None,
        };
        let named = self.named.get_key_value(&word.text);
        if let Some(k) = named.and_then(|(name, _)| suits(name)) {
            return Ok(k);
        }
        let what = format!("joint of kind `{}`", kinds.join("` or `"));
        if let Some((_, NamedPart::Element(_, descriptor))) = named {
            let message = format!("`{}` is of kind `{}`, not a {what}", word.text, descriptor.kind);
            return Err(Diagnostic::new(word.span, message).help("name the joint whose reaction causes the force"));
        }
        let known = self.order.iter().filter(|name| suits(name).is_some());
        Err(Diagnostic::unknown(word.span, &what, &word.text, known.map(String::as_str)))
    }

    /// The frame of that name: `ground`, a body, a beam node such as `rod.first`, `rod.last`, `rod.3`.
    pub fn frame(&self, text: &str, span: &Range<usize>) -> Read<FrameRef> {
        self.find_frame(text).ok_or_else(|| {
            let bodies =
                self.order.iter().filter(|n| matches!(self.named[*n], NamedPart::Frame(_) | NamedPart::Point(_)));
            let beams = self.order.iter().filter(|n| matches!(self.named[*n], NamedPart::Beam(..)));
            let nodes = beams.flat_map(|n| [format!("{n}.first"), format!("{n}.last")]);
            let known: Vec<String> = bodies.cloned().chain(nodes).chain(["ground".to_owned()]).collect();
            Diagnostic::unknown(span.clone(), "body", text, known.iter().map(String::as_str))
        })
    }

    pub fn find_frame(&self, text: &str) -> Option<FrameRef> {
        if text == "ground" {
            return Some(FrameRef::Ground);
        }
        match self.named.get(text) {
            Some(NamedPart::Frame(frame)) => return Some(*frame),
            Some(_) => return None,
            None => {}
        }
        let (name, node) = text.rsplit_once('.')?;
        let Some(NamedPart::Beam(beam, elements)) = self.named.get(name) else { return None };
        let node = match node {
            "first" => 0,
            "last" => *elements,
            number => number.parse::<usize>().ok()?.checked_sub(1).filter(|k| k <= elements)?,
        };
        Some(FrameRef::Node(*beam, node))
    }

    /// The point at `key` of a part.
    pub fn point(&self, section: &Section<'_>, key: &str, names: &Names) -> Read<PointRef> {
        let value = section.get(key).expect("the key is required");
        self.point_of(value, key, names, section.source())
    }

    fn point_of(&self, value: &Value<'_>, key: &str, names: &Names, source: FileSource<'_>) -> Read<PointRef> {
        match value.get_ref() {
            DeValue::String(name) => {
                if let Some(NamedPart::Point(k)) = self.named.get(&**name) {
                    return Ok(self.points[*k].clone());
                }
                let origin = [CompiledExpression::constant(0.0), CompiledExpression::constant(0.0)];
                Ok(PointRef { frame: self.frame(name, &value.span())?, at: origin })
            }
            DeValue::Table(_) => {
                let inner = Section::open(value, &format!("`{key}`"), &[POINT_KEYS], source)?;
                let body = inner.need_word("body")?;
                let at = inner.get("at").expect("the key is required");
                Ok(PointRef {
                    frame: self.frame(&body.text, &body.span)?,
                    at: vector(at, "at", names, &Scope { units: "m", ..Scope::DESIGN }, source)?,
                })
            }
            _ => Err(wrong_type(value, &format!("`{key}`"), "a name, or a table { body = …, at = [x, y] }")),
        }
    }

    /// The coordinate at `key` of a part: `crank.theta`, `ground.x`, or the name of a body that is one coordinate.
    pub fn coordinate(&self, section: &Section<'_>, key: &str) -> Read<CoordinateRef> {
        let word = section.need_word(key)?;
        self.find_coordinate(&word.text).ok_or_else(|| {
            let frames = self.order.iter().filter(|n| matches!(self.named[*n], NamedPart::Frame(_)));
            let last = if self.is_spatial { "z" } else { "theta" };
            let axes = frames.flat_map(|n| ["x", "y", last].map(|axis| format!("{n}.{axis}")));
            let sliders = self.order.iter().filter(|n| matches!(self.named[*n], NamedPart::Slider(_))).cloned();
            let joints = self.order.iter().flat_map(|name| self.joint_coordinates(name).map(|(_, names)| names));
            let joints = joints.map(|[position, ..]| position);
            let known: Vec<String> = sliders.chain(joints).chain(axes).chain(["ground.x".to_owned()]).collect();
            let unknown =
                Diagnostic::unknown(word.span.clone(), "coordinate", &word.text, known.iter().map(String::as_str));
            match word.text.rsplit_once('.').and_then(|(point, _)| Some((point, self.named.get(point)?))) {
                Some((point, NamedPart::Point(_))) => unknown.help(format!(
                    "`{point}` is a point, and bodies have coordinates. To drive a point, join a body of `kind = \"massless-node\"` to it{}, and \
                     drive the coordinates of that body. Forces with the keys `at`, or `a` and `b`, act at points, such as `force`, `spring`{}",
                    if self.is_spatial { "" } else { " by a hinge" },
                    if self.is_spatial { "" } else { " and `wall`" }
                )),
                _ => unknown,
            }
        })
    }

    /// The coordinate of that name.
    pub fn find_coordinate(&self, text: &str) -> Option<CoordinateRef> {
        if let Some(NamedPart::Slider(k)) = self.named.get(text) {
            return Some(CoordinateRef::Slider(*k));
        }
        if let Some(NamedPart::Element(k, descriptor)) = self.named.get(text) {
            return Some(CoordinateRef::Joint(*k, JointCoordinate::of_element(descriptor)?));
        }
        let (name, axis) = text.rsplit_once('.')?;
        if let Some(NamedPart::Element(..)) = self.named.get(name) {
            return self.joint_coordinates(name).find(|(_, names)| names[0] == text).map(|(place, _)| place);
        }
        let axis = match axis {
            "x" => FrameCoordinate::X,
            "y" => FrameCoordinate::Y,
            "z" if self.is_spatial => FrameCoordinate::Z,
            // The ground is at rest, so its rotation is a valid default in space, too.
            "theta" if !self.is_spatial || name == "ground" => FrameCoordinate::Theta,
            _ => return None,
        };
        Some(CoordinateRef::Of(self.find_frame(name)?, axis))
    }
}

impl Parts {
    /// Coordinates of the joint of this name in space, with the names of position, velocity and acceleration.
    pub fn joint_coordinates(&self, name: &str) -> impl Iterator<Item = (CoordinateRef, [String; 3])> + use<> {
        let joint = match self.named.get(name) {
            Some(NamedPart::Element(k, descriptor)) if self.is_spatial => Some((*k, *descriptor)),
            _ => None,
        };
        let name = name.to_owned();
        let of = move |(k, descriptor): (usize, &'static ElementDescriptor)| -> Vec<(CoordinateRef, [String; 3])> {
            let named = |names: [&str; 3]| names.map(|what| format!("{name}.{what}"));
            if let Some(own) = JointCoordinate::of_element(descriptor) {
                return vec![(CoordinateRef::Joint(k, own), named(["position", "velocity", "acceleration"]))];
            }
            let is_joint = descriptor.family == Family::Joint;
            let has = |(_, kinds, _): &&(_, &'static [&'static str], _)| is_joint && kinds.contains(&descriptor.kind);
            let one =
                |(which, _, names): &(JointCoordinate, _, [&str; 3])| (CoordinateRef::Joint(k, *which), named(*names));
            JointCoordinate::NAMES.iter().filter(has).map(one).collect()
        };
        joint.into_iter().flat_map(of)
    }
}

/// Index of an item in a list; appends the item if it is new.
pub fn position_or_push<T: PartialEq>(list: &mut Vec<T>, item: T) -> usize {
    list.iter().position(|known| *known == item).unwrap_or_else(|| {
        list.push(item);
        list.len() - 1
    })
}

/// A mechanism under construction, with its parts.
pub struct BuildContext<S> {
    pub mechanism: Mechanism<S>,
    pub bodies: Vec<Body>,
    pub sliders: Vec<Coordinate>,
    pub beams: Vec<(Vec<Body>, Vec<ElementIndex>)>,
    pub elements: Vec<Added>,
    pub events: Vec<EventIndex>,
    /// Time at which the motion starts.
    pub start: S,
    pub is_spatial: bool,
    /// Bodies in space.
    pub bodies3: Vec<Body3>,
    /// Nodes and elements of beams in space.
    pub beams3: Vec<(Vec<Body3>, Vec<ElementIndex>)>,
    /// Named points in space.
    pub markers: Vec<MarkerSpec>,
    /// The two points of elements in space by the numbers of the elements, and their coordinates, made at their first use.
    pub joints: HashMap<usize, (String, [Marker3<S>; 2])>,
    coordinates: HashMap<(usize, JointCoordinate), (Coordinate, ElementIndex)>,
}

impl<S: Scalar> BuildContext<S> {
    /// An empty mechanism whose motion starts at the time `start`.
    pub fn new(mechanism: Mechanism<S>, start: f64, parts: &Parts) -> Self {
        Self {
            mechanism,
            bodies: vec![],
            sliders: vec![],
            beams: vec![],
            elements: vec![],
            events: vec![],
            start: S::from(start),
            bodies3: vec![],
            beams3: vec![],
            is_spatial: parts.is_spatial,
            markers: parts.markers.clone(),
            joints: HashMap::new(),
            coordinates: HashMap::new(),
        }
    }

    /// A coordinate of a joint in space, and the element that defines it.
    pub fn joint_coordinate(&mut self, k: usize, which: JointCoordinate) -> (Coordinate, ElementIndex) {
        if let Some(known) = self.coordinates.get(&(k, which)) {
            return *known;
        }
        let (name, [a, b]) = &self.joints[&k];
        let coordinate = match which {
            JointCoordinate::Angle => self.mechanism.joint_angle(name, *a, *b),
            JointCoordinate::Displacement => self.mechanism.joint_displacement(name, *a, *b),
            JointCoordinate::Distance => self.mechanism.point_distance(name, *a, *b),
        };
        let added = (coordinate, self.mechanism.last_element().expect("a joint coordinate has an element"));
        self.coordinates.insert((k, which), added);
        added
    }

    pub fn frame(&self, frame: FrameRef) -> Body {
        match frame {
            FrameRef::Ground => self.mechanism.ground(),
            FrameRef::Body(k) => self.bodies[k],
            FrameRef::Node(beam, node) => self.beams[beam].0[node],
        }
    }

    pub fn marker(&self, point: &PointRef, b: &[S]) -> Marker<S> {
        let [x, y] = [0, 1].map(|k| point.at[k].value(&Inputs::design(b)));
        self.frame(point.frame).at(x, y)
    }

    pub fn coordinate(&mut self, place: CoordinateRef) -> Coordinate {
        match place {
            CoordinateRef::Slider(k) => self.sliders[k],
            CoordinateRef::Joint(k, which) => self.joint_coordinate(k, which).0,
            CoordinateRef::Of(frame, axis) if self.is_spatial => {
                let Body3 { x, y, z, .. } = self.frame3(frame);
                match axis {
                    FrameCoordinate::X => x,
                    FrameCoordinate::Y => y,
                    FrameCoordinate::Z | FrameCoordinate::Theta => z,
                }
            }
            CoordinateRef::Of(frame, axis) => {
                let [x, y, theta] = self.frame(frame).coordinates();
                match axis {
                    FrameCoordinate::X => x,
                    FrameCoordinate::Y => y,
                    FrameCoordinate::Z | FrameCoordinate::Theta => theta,
                }
            }
        }
    }
}
