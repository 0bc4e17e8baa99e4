//! Measured quantities of a mechanism, from which outputs are computed.

use super::parts::{BuildContext, FrameRef, NamedPart, Parts, PointRef};
use crate::Result;
use crate::model_file::expression::{CompiledExpression, Inputs, Known, OtherUnit};
use crate::model_file::unit::Unit;
use autodiff::Scalar;
use mechanics::elements::{self, Added, CoordinateSensor, Element, MarkerSensor};
use mechanics::mechanism::{ElementIndex, Term};
use std::collections::HashMap;

/// Measures of a beam at its nodes: the mean of the adjacent elements.
const OF_NODE: &[&str] = &["moment", "normal_force", "shear_force"];

/// Measures of a point and of its body, in the axes of the plane.
fn of_point() -> Vec<&'static str> {
    names(Element::measures(&MarkerSensor))
}

/// Measures of a body with one coordinate.
fn of_slider() -> Vec<&'static str> {
    names(Element::measures(&CoordinateSensor))
}

fn names(measures: &[elements::Measure]) -> Vec<&'static str> {
    measures.iter().map(|measure| measure.name).collect()
}

/// A measured quantity of a mechanism.
#[derive(Clone, Debug, PartialEq)]
pub enum MeasureRef {
    /// A measure of a joint, drive or force.
    Element(usize, &'static str),
    /// A measure of the reference point of a body, or of a beam node.
    Frame(FrameRef, &'static str),
    /// A measure of a named point.
    Point(usize, &'static str),
    /// A measure of a body with one coordinate.
    Slider(usize, &'static str),
    /// An internal force or moment of a beam at a node.
    Node(usize, usize, &'static str),
    KineticEnergy,
    PotentialEnergy,
}

/// The quantity of that name, such as `crank.theta` or `rod.first.moment`.
pub fn find(text: &str, parts: &Parts) -> Option<MeasureRef> {
    match text {
        "kinetic_energy" => return Some(MeasureRef::KineticEnergy),
        "potential_energy" => return Some(MeasureRef::PotentialEnergy),
        _ => {}
    }
    let (owner, what) = text.rsplit_once('.')?;
    let among = |known: &[&'static str]| known.iter().find(|k| **k == what).copied();
    match parts.get(owner) {
        Some(NamedPart::Element(k, of)) => return among(&names(of.measures)).map(|what| MeasureRef::Element(*k, what)),
        Some(NamedPart::Slider(k)) => return among(&of_slider()).map(|what| MeasureRef::Slider(*k, what)),
        Some(NamedPart::Point(k)) => return among(&of_point()).map(|what| MeasureRef::Point(*k, what)),
        _ => {}
    }
    let frame = parts.find_frame(owner)?;
    match (frame, among(OF_NODE)) {
        (FrameRef::Node(beam, node), Some(what)) => Some(MeasureRef::Node(beam, node, what)),
        _ => among(&of_point()).map(|what| MeasureRef::Frame(frame, what)),
    }
}

/// Names of all quantities, for suggestions in messages.
pub fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(NamedPart::Element(_, of)) => all(&names(of.measures)),
            Some(NamedPart::Slider(_)) => all(&of_slider()),
            Some(NamedPart::Point(_) | NamedPart::Frame(_)) => all(&of_point()),
            Some(NamedPart::Beam(..)) => {
                let node = |end: &str| {
                    let known = OF_NODE.iter().copied().chain(of_point());
                    known.map(|what| format!("{name}.{end}.{what}")).collect::<Vec<_>>()
                };
                [node("first"), node("last")].concat()
            }
            Some(NamedPart::Event(_)) | None => vec![],
        }
    };
    parts.order.iter().flat_map(of).chain(["kinetic_energy".into(), "potential_energy".into()]).collect()
}

/// The unit of a quantity, if it has only one.
pub fn unit(measure: &MeasureRef, parts: &Parts) -> Option<OtherUnit> {
    let of = |all: &[elements::Measure], what: &str| all.iter().find(|m| m.name == what).map(|m| m.unit);
    let unit = match measure {
        MeasureRef::Element(k, what) => {
            parts.elements().find(|(index, _)| index == k).and_then(|(_, e)| of(e.measures, what))?
        }
        MeasureRef::Frame(_, what) | MeasureRef::Point(_, what) => of(Element::measures(&MarkerSensor), what)?,
        MeasureRef::Slider(_, what) => of(Element::measures(&CoordinateSensor), what)?,
        MeasureRef::Node(_, _, "moment") => "N·m",
        MeasureRef::Node(..) => "N",
        MeasureRef::KineticEnergy | MeasureRef::PotentialEnergy => "J",
    };
    let known = Known::loose(Unit::parse(unit)?.dimension)?;
    Some(OtherUnit { known, shown: None })
}

/// Owner of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Owner {
    Frame(FrameRef),
    Point(usize),
    Slider(usize),
    Design(usize),
}

/// Sensors of a mechanism under construction, each added at its first use.
pub struct Sensors<'p> {
    points: &'p [PointRef],
    made: HashMap<Owner, ElementIndex>,
}

impl<'p> Sensors<'p> {
    pub fn new(points: &'p [PointRef]) -> Self {
        Self { points, made: HashMap::new() }
    }

    /// Terms of the quantity, to be summed.
    pub fn terms<S: Scalar>(
        &mut self,
        measure: &MeasureRef,
        context: &mut BuildContext<S>,
        b: &[S],
    ) -> Result<Vec<Term<S>>> {
        let owner = match measure {
            MeasureRef::KineticEnergy => return Ok(vec![context.mechanism.kinetic_energy()]),
            MeasureRef::PotentialEnergy => return Ok(vec![context.mechanism.potential_energy()]),
            MeasureRef::Element(k, what) => {
                return Ok(vec![match context.elements[*k] {
                    Added::Element(element) => context.mechanism.measure(element, what)?,
                    Added::Motion(coordinate) => context.mechanism.driving_force(coordinate),
                    Added::Contact => unreachable!("a rigid contact measures nothing"),
                }]);
            }
            MeasureRef::Node(beam, node, what) => return at_node(*beam, *node, what, context),
            MeasureRef::Frame(frame, _) => Owner::Frame(*frame),
            MeasureRef::Point(k, _) => Owner::Point(*k),
            MeasureRef::Slider(k, _) => Owner::Slider(*k),
        };
        let (MeasureRef::Frame(_, what) | MeasureRef::Point(_, what) | MeasureRef::Slider(_, what)) = measure else {
            unreachable!("the others have returned")
        };
        let part = self.sensor(owner, context, b);
        Ok(vec![context.mechanism.measure(part, what)?])
    }

    /// A design variable as a quantity: the position of a ground point at this distance from the origin.
    pub fn design<S: Scalar>(&mut self, i: usize, context: &mut BuildContext<S>, b: &[S]) -> Result<Term<S>> {
        let part = self.sensor(Owner::Design(i), context, b);
        context.mechanism.measure(part, "x")
    }

    fn sensor<S: Scalar>(&mut self, owner: Owner, context: &mut BuildContext<S>, b: &[S]) -> ElementIndex {
        if let Some(part) = self.made.get(&owner) {
            return *part;
        }
        let part = match owner {
            Owner::Slider(k) => {
                let ground = context.mechanism.ground().x;
                context.mechanism.coordinate_sensor("motion", ground, context.sliders[k])
            }
            Owner::Frame(frame) => {
                let marker = context.frame(frame).origin();
                context.mechanism.sensor("motion", marker)
            }
            Owner::Point(k) => {
                let marker = context.marker(&self.points[k], b);
                context.mechanism.sensor("motion", marker)
            }
            Owner::Design(i) => {
                let marker = context
                    .mechanism
                    .ground()
                    .at(CompiledExpression::variable(i).value(&Inputs::design(b)), S::from(0.0));
                context.mechanism.sensor("design", marker)
            }
        };
        self.made.insert(owner, part);
        part
    }
}

/// Mean of the adjacent elements at a beam node.
fn at_node<S: Scalar>(beam: usize, node: usize, what: &str, context: &BuildContext<S>) -> Result<Vec<Term<S>>> {
    let parts = &context.beams[beam].1;
    let sides = [what.to_owned() + "_j", what.to_owned() + "_i"];
    let [before, after] = if what == "moment" { sides.each_ref().map(String::as_str) } else { [what; 2] };
    let mut terms = vec![];
    if node > 0 {
        terms.push(context.mechanism.measure(parts[node - 1], before)?);
    }
    if node < parts.len() {
        terms.push(context.mechanism.measure(parts[node], after)?);
    }
    let weight = S::from(1.0 / terms.len() as f64);
    Ok(terms.into_iter().map(|term| term.times(weight)).collect())
}
