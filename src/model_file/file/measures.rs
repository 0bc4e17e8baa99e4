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
fn of_slide() -> Vec<&'static str> {
    names(Element::measures(&CoordinateSensor))
}

fn names(measures: &[elements::Measure]) -> Vec<&'static str> {
    measures.iter().map(|measure| measure.name).collect()
}

/// A quantity of a mechanism.
#[derive(Clone, Debug, PartialEq)]
pub enum Measure {
    /// Of a joint, drive or force.
    Element(usize, &'static str),
    /// Of the reference point of a body, or of a beam node.
    Frame(Frame, &'static str),
    /// Of a named point.
    Point(usize, &'static str),
    Slide(usize, &'static str),
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
        Some(Symbol::Slide(k)) => return among(&of_slide()).map(|what| Measure::Slide(*k, what)),
        Some(Symbol::Point(k)) => return among(&of_point()).map(|what| Measure::Point(*k, what)),
        _ => {}
    }
    let frame = parts.find_frame(owner)?;
    match (frame, among(OF_NODE)) {
        (Frame::Node(beam, node), Some(what)) => Some(Measure::Node(beam, node, what)),
        _ => among(&of_point()).map(|what| Measure::Frame(frame, what)),
    }
}

/// Names of all quantities, for suggestions.
pub fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(Symbol::Element(_, of)) => all(&names(of.measures)),
            Some(Symbol::Slide(_)) => all(&of_slide()),
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
    Slide(usize),
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
        world: &mut BuildContext<S>,
        b: &[S],
    ) -> Result<Vec<Term<S>>> {
        let owner = match measure {
            Measure::KineticEnergy => return Ok(vec![world.mechanism.kinetic_energy()]),
            Measure::PotentialEnergy => return Ok(vec![world.mechanism.potential_energy()]),
            Measure::Element(k, what) => {
                return Ok(vec![match world.elements[*k] {
                    Added::Element(element) => world.mechanism.measure(element, what)?,
                    Added::Motion(coordinate) => world.mechanism.driving_force(coordinate),
                    Added::Contact => unreachable!("a rigid contact measures nothing"),
                }]);
            }
            Measure::Node(beam, node, what) => return at_node(*beam, *node, what, world),
            Measure::Frame(frame, _) => Owner::Frame(*frame),
            Measure::Point(k, _) => Owner::Point(*k),
            Measure::Slide(k, _) => Owner::Slide(*k),
        };
        let (Measure::Frame(_, what) | Measure::Point(_, what) | Measure::Slide(_, what)) = measure else {
            unreachable!("the others have returned")
        };
        let part = self.sensor(owner, world, b);
        Ok(vec![world.mechanism.measure(part, what)?])
    }

    /// A design variable as a quantity: the position of a ground point at this distance from the origin.
    pub fn design<S: Scalar>(&mut self, i: usize, world: &mut BuildContext<S>, b: &[S]) -> Result<Term<S>> {
        let part = self.sensor(Owner::Design(i), world, b);
        world.mechanism.measure(part, "x")
    }

    fn sensor<S: Scalar>(&mut self, owner: Owner, world: &mut BuildContext<S>, b: &[S]) -> ElementIndex {
        if let Some(part) = self.made.get(&owner) {
            return *part;
        }
        let part = match owner {
            Owner::Slide(k) => {
                let ground = world.mechanism.ground().x;
                world.mechanism.coordinate_sensor("motion", ground, world.slides[k])
            }
            Owner::Frame(frame) => {
                let marker = world.frame(frame).origin();
                world.mechanism.sensor("motion", marker)
            }
            Owner::Point(k) => {
                let marker = world.marker(&self.points[k], b);
                world.mechanism.sensor("motion", marker)
            }
            Owner::Design(i) => {
                let marker = world.mechanism.ground().at(Program::variable(i).value(&Inputs::design(b)), S::from(0.0));
                world.mechanism.sensor("design", marker)
            }
        };
        self.made.insert(owner, part);
        part
    }
}

/// The mean over the elements that adjoin a node.
fn at_node<S: Scalar>(beam: usize, node: usize, what: &str, world: &BuildContext<S>) -> Result<Vec<Term<S>>> {
    let parts = &world.beams[beam].1;
    let sides = [what.to_owned() + "_j", what.to_owned() + "_i"];
    let [before, after] = if what == "moment" { sides.each_ref().map(String::as_str) } else { [what; 2] };
    let mut terms = vec![];
    if node > 0 {
        terms.push(world.mechanism.measure(parts[node - 1], before)?);
    }
    if node < parts.len() {
        terms.push(world.mechanism.measure(parts[node], after)?);
    }
    let weight = S::from(1.0 / terms.len() as f64);
    Ok(terms.into_iter().map(|term| term.times(weight)).collect())
}
