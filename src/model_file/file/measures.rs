//! Quantities of a mechanism that outputs are made of.

use super::parts::{BuildContext, Frame, Parts, PointRef, Symbol};
use crate::Result;
use crate::model_file::expression::{Inputs, Program};
use autodiff::Scalar;
use mechanics::elements::{self, Added, CoordinateSensor, Element, MarkerSensor};
use mechanics::mechanism::{ElementIndex, Term};
use std::collections::HashMap;

/// Measures of a beam at its nodes: the mean of the adjoining elements.
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

/// A quantity of a mechanism.
#[derive(Clone, Debug, PartialEq)]
pub enum Measure {
    /// Of an element: a joint, drive, force or contact.
    Element(usize, &'static str),
    /// Of the reference point of a body, or of a beam node.
    Frame(Frame, &'static str),
    /// Of a named point.
    Point(usize, &'static str),
    Slider(usize, &'static str),
    /// Of the inside of a beam at a node.
    Node(usize, usize, &'static str),
    KineticEnergy,
    PotentialEnergy,
}

/// The quantity of that name, such as `crank.theta` or `rod.first.moment`.
pub fn find(text: &str, parts: &Parts) -> Option<Measure> {
    match text {
        "kinetic_energy" => return Some(Measure::KineticEnergy),
        "potential_energy" => return Some(Measure::PotentialEnergy),
        _ => {}
    }
    let (owner, what) = text.rsplit_once('.')?;
    let among = |known: &[&'static str]| known.iter().find(|k| **k == what).copied();
    match parts.get(owner) {
        Some(Symbol::Element(k, of)) => return among(&names(of.measures)).map(|what| Measure::Element(*k, what)),
        Some(Symbol::Slider(k)) => return among(&of_slider()).map(|what| Measure::Slider(*k, what)),
        Some(Symbol::Point(k)) => return among(&of_point()).map(|what| Measure::Point(*k, what)),
        _ => {}
    }
    let frame = parts.find_frame(owner)?;
    match (frame, among(OF_NODE)) {
        (Frame::Node(beam, node), Some(what)) => Some(Measure::Node(beam, node, what)),
        _ => among(&of_point()).map(|what| Measure::Frame(frame, what)),
    }
}

/// Names of all quantities, for suggestions in messages.
pub fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(Symbol::Element(_, of)) => all(&names(of.measures)),
            Some(Symbol::Slider(_)) => all(&of_slider()),
            Some(Symbol::Point(_) | Symbol::Frame(_)) => all(&of_point()),
            Some(Symbol::Beam(..)) => {
                let node = |end: &str| {
                    let known = OF_NODE.iter().copied().chain(of_point());
                    known.map(|what| format!("{name}.{end}.{what}")).collect::<Vec<_>>()
                };
                [node("first"), node("last")].concat()
            }
            None => vec![],
        }
    };
    parts.order.iter().flat_map(of).chain(["kinetic_energy".into(), "potential_energy".into()]).collect()
}

/// What a sensor measures the motion of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Owner {
    Frame(Frame),
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

    /// The terms whose sum the quantity is.
    pub fn terms<S: Scalar>(
        &mut self,
        measure: &Measure,
        context: &mut BuildContext<S>,
        b: &[S],
    ) -> Result<Vec<Term<S>>> {
        let owner = match measure {
            Measure::KineticEnergy => return Ok(vec![context.mechanism.kinetic_energy()]),
            Measure::PotentialEnergy => return Ok(vec![context.mechanism.potential_energy()]),
            Measure::Element(k, what) => {
                return Ok(vec![match context.elements[*k] {
                    Added::Element(element) => context.mechanism.measure(element, what)?,
                    Added::Motion(coordinate) => context.mechanism.driving_force(coordinate),
                    Added::Contact => unreachable!("a rigid contact measures nothing"),
                }]);
            }
            Measure::Node(beam, node, what) => return at_node(*beam, *node, what, context),
            Measure::Frame(frame, _) => Owner::Frame(*frame),
            Measure::Point(k, _) => Owner::Point(*k),
            Measure::Slider(k, _) => Owner::Slider(*k),
        };
        let (Measure::Frame(_, what) | Measure::Point(_, what) | Measure::Slider(_, what)) = measure else {
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
                let marker =
                    context.mechanism.ground().at(Program::variable(i).value(&Inputs::design(b)), S::from(0.0));
                context.mechanism.sensor("design", marker)
            }
        };
        self.made.insert(owner, part);
        part
    }
}

/// The mean over the elements that adjoin a node.
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
