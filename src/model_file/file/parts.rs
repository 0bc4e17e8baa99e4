//! Names of the parts of a mechanism, and what refers to them.

use super::key::{Accepts, Key, required};
use super::section::{FileSource, Read, Section, Value, Word, pair, wrong_type};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use autodiff::Scalar;
use mechanics::elements::{Added, ElementDescriptor};
use mechanics::mechanism::{Body, Coordinate, ElementIndex, Marker, Mechanism};
use std::collections::HashMap;
use std::ops::Range;
use toml::de::DeValue;

/// A frame that points are fixed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Frame {
    Ground,
    Body(usize),
    /// Node of a beam, from zero.
    Node(usize, usize),
}

/// What a name of a mechanism stands for.
#[derive(Clone, Debug)]
pub enum Symbol {
    Frame(Frame),
    /// A single coordinate with a mass.
    Slide(usize),
    /// A beam with its number of elements.
    Beam(usize, usize),
    Point(usize),
    /// A joint, drive or force with its declaration.
    Element(usize, &'static ElementDescriptor),
}

/// A point of a frame.
#[derive(Clone, Debug)]
pub struct PointRef {
    pub frame: Frame,
    pub at: [Program; 2],
}

/// A coordinate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CoordinateRef {
    Of(Frame, Axis),
    Slide(usize),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    X,
    Y,
    Theta,
}

pub const SPOT: &[Key] = &[
    required("body", Accepts::Name, "name of a body or beam node, or \"ground\""),
    required("at", Accepts::Pair, "place [x, y] on it in m, in its own axes"),
];

/// The names that have been read.
#[derive(Clone, Debug, Default)]
pub struct Parts {
    named: HashMap<String, Symbol>,
    pub order: Vec<String>,
    pub points: Vec<PointRef>,
}

impl Parts {
    /// Adds a name.
    pub fn add(&mut self, word: &Word, named: Symbol) -> Read<()> {
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

    pub fn get(&self, name: &str) -> Option<&Symbol> {
        self.named.get(name)
    }

    /// The frame of that name: `ground`, a body, a beam node such as `rod.first`, `rod.last`, `rod.3`.
    pub fn frame(&self, text: &str, span: &Range<usize>) -> Read<Frame> {
        self.find_frame(text).ok_or_else(|| {
            let bodies = self.order.iter().filter(|n| matches!(self.named[*n], Symbol::Frame(_) | Symbol::Point(_)));
            let beams = self.order.iter().filter(|n| matches!(self.named[*n], Symbol::Beam(..)));
            let nodes = beams.flat_map(|n| [format!("{n}.first"), format!("{n}.last")]);
            let known: Vec<String> = bodies.cloned().chain(nodes).chain(["ground".to_owned()]).collect();
            Diagnostic::unknown(span.clone(), "body", text, known.iter().map(String::as_str))
        })
    }

    pub fn find_frame(&self, text: &str) -> Option<Frame> {
        if text == "ground" {
            return Some(Frame::Ground);
        }
        match self.named.get(text) {
            Some(Symbol::Frame(frame)) => return Some(*frame),
            Some(_) => return None,
            None => {}
        }
        let (name, node) = text.rsplit_once('.')?;
        let Some(Symbol::Beam(beam, elements)) = self.named.get(name) else { return None };
        let node = match node {
            "first" => 0,
            "last" => *elements,
            number => number.parse::<usize>().ok()?.checked_sub(1).filter(|k| k <= elements)?,
        };
        Some(Frame::Node(*beam, node))
    }

    /// The point at `key` of a part.
    pub fn spot(&self, section: &Section<'_>, key: &str, names: &Names) -> Read<PointRef> {
        let value = section.get(key).expect("the key is required");
        self.spot_of(value, key, names, section.source())
    }

    fn spot_of(&self, value: &Value<'_>, key: &str, names: &Names, source: FileSource<'_>) -> Read<PointRef> {
        match value.get_ref() {
            DeValue::String(name) => {
                if let Some(Symbol::Point(k)) = self.named.get(&**name) {
                    return Ok(self.points[*k].clone());
                }
                let origin = [Program::constant(0.0), Program::constant(0.0)];
                Ok(PointRef { frame: self.frame(name, &value.span())?, at: origin })
            }
            DeValue::Table(_) => {
                let inner = Section::open(value, &format!("`{key}`"), &[SPOT], source)?;
                let body = inner.need_word("body")?;
                let at = inner.get("at").expect("the key is required");
                Ok(PointRef {
                    frame: self.frame(&body.text, &body.span)?,
                    at: pair(at, "at", names, &Wants::DESIGN, source)?,
                })
            }
            _ => Err(wrong_type(value, &format!("`{key}`"), "a name, or a table { body = …, at = [x, y] }")),
        }
    }

    /// The coordinate at `key` of a part: `crank.theta`, `ground.x`, or the name of a body that is one coordinate.
    pub fn place(&self, section: &Section<'_>, key: &str) -> Read<CoordinateRef> {
        let word = section.need_word(key)?;
        self.find_place(&word.text).ok_or_else(|| {
            let frames = self.order.iter().filter(|n| matches!(self.named[*n], Symbol::Frame(_)));
            let axes = frames.flat_map(|n| ["x", "y", "theta"].map(|axis| format!("{n}.{axis}")));
            let slides = self.order.iter().filter(|n| matches!(self.named[*n], Symbol::Slide(_))).cloned();
            let known: Vec<String> = slides.chain(axes).chain(["ground.x".to_owned()]).collect();
            Diagnostic::unknown(word.span.clone(), "coordinate", &word.text, known.iter().map(String::as_str))
        })
    }

    /// The coordinate of that name.
    pub fn find_place(&self, text: &str) -> Option<CoordinateRef> {
        if let Some(Symbol::Slide(k)) = self.named.get(text) {
            return Some(CoordinateRef::Slide(*k));
        }
        let (name, axis) = text.rsplit_once('.')?;
        let axis = match axis {
            "x" => Axis::X,
            "y" => Axis::Y,
            "theta" => Axis::Theta,
            _ => return None,
        };
        Some(CoordinateRef::Of(self.find_frame(name)?, axis))
    }
}

/// The parts of a mechanism that is being built.
pub struct BuildContext<S> {
    pub mechanism: Mechanism<S>,
    pub bodies: Vec<Body>,
    pub slides: Vec<Coordinate>,
    pub beams: Vec<(Vec<Body>, Vec<ElementIndex>)>,
    pub elements: Vec<Added>,
}

impl<S: Scalar> BuildContext<S> {
    pub fn frame(&self, frame: Frame) -> Body {
        match frame {
            Frame::Ground => self.mechanism.ground(),
            Frame::Body(k) => self.bodies[k],
            Frame::Node(beam, node) => self.beams[beam].0[node],
        }
    }

    pub fn marker(&self, spot: &PointRef, b: &[S]) -> Marker<S> {
        let [x, y] = [0, 1].map(|k| spot.at[k].value(&Inputs::design(b)));
        self.frame(spot.frame).at(x, y)
    }

    pub fn coordinate(&self, place: CoordinateRef) -> Coordinate {
        match place {
            CoordinateRef::Slide(k) => self.slides[k],
            CoordinateRef::Of(frame, axis) => {
                let [x, y, theta] = self.frame(frame).coordinates();
                match axis {
                    Axis::X => x,
                    Axis::Y => y,
                    Axis::Theta => theta,
                }
            }
        }
    }
}
