//! Names of the parts of a mechanism, and references to them.

use super::key::{Accepts, Key, required};
use super::section::{FileSource, Read, Section, Value, Word, pair, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::elements::{Added, ElementDescriptor};
use mechanics::events::EventIndex;
use mechanics::mechanism::{Body, Coordinate, ElementIndex, Marker, Mechanism};
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

/// A reference to a coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateRef {
    Of(FrameRef, FrameCoordinate),
    Slider(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrameCoordinate {
    X,
    Y,
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
}

impl Parts {
    /// Adds a name.
    pub fn add(&mut self, word: &Word, named: NamedPart) -> Read<()> {
        crate::model_file::expression::check_name(&word.text, word.span.clone())?;
        if self.named.contains_key(&word.text) {
            let message = format!("the name `{}` is taken twice", word.text);
            return Err(Diagnostic::new(word.span.clone(), message)
                .label("second use")
                .help("give every part its own name"));
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
                    at: pair(at, "at", names, &Scope { units: "m", ..Scope::DESIGN }, source)?,
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
            let axes = frames.flat_map(|n| ["x", "y", "theta"].map(|axis| format!("{n}.{axis}")));
            let sliders = self.order.iter().filter(|n| matches!(self.named[*n], NamedPart::Slider(_))).cloned();
            let known: Vec<String> = sliders.chain(axes).chain(["ground.x".to_owned()]).collect();
            Diagnostic::unknown(word.span.clone(), "coordinate", &word.text, known.iter().map(String::as_str))
        })
    }

    /// The coordinate of that name.
    pub fn find_coordinate(&self, text: &str) -> Option<CoordinateRef> {
        if let Some(NamedPart::Slider(k)) = self.named.get(text) {
            return Some(CoordinateRef::Slider(*k));
        }
        let (name, axis) = text.rsplit_once('.')?;
        let axis = match axis {
            "x" => FrameCoordinate::X,
            "y" => FrameCoordinate::Y,
            "theta" => FrameCoordinate::Theta,
            _ => return None,
        };
        Some(CoordinateRef::Of(self.find_frame(name)?, axis))
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
}

impl<S: Scalar> BuildContext<S> {
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

    pub fn coordinate(&self, place: CoordinateRef) -> Coordinate {
        match place {
            CoordinateRef::Slider(k) => self.sliders[k],
            CoordinateRef::Of(frame, axis) => {
                let [x, y, theta] = self.frame(frame).coordinates();
                match axis {
                    FrameCoordinate::X => x,
                    FrameCoordinate::Y => y,
                    FrameCoordinate::Theta => theta,
                }
            }
        }
    }
}
