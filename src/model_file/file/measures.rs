//! Quantities of a mechanism that outputs are made of.

use super::parts::{BuildContext, Frame, Parts, PointRef, Symbol};
use crate::Result;
use crate::model_file::expression::{Inputs, Program};
use autodiff::Scalar;
use mechanics::mechanism::{ElementIndex, Term};
use std::collections::HashMap;

/// What a point with its body measures: position, velocity and acceleration, in the fixed axes.
pub const OF_POINT: &[&str] = &["x", "y", "theta", "vx", "vy", "omega", "ax", "ay", "alpha"];
/// What a body that is one coordinate measures.
pub const OF_SLIDE: &[&str] = &["position", "velocity", "acceleration"];
/// What a beam measures at its nodes: the mean of the adjoining elements.
pub const OF_NODE: &[&str] = &["moment", "normal_force", "shear_force"];

/// A quantity of a mechanism.
#[derive(Clone, Debug, PartialEq)]
pub enum Measure {
    /// Of a joint, drive or force.
    Element(usize, &'static str),
    /// The effort of a prescribed coordinate.
    Effort(usize),
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
    let among = |known: &'static [&'static str]| known.iter().find(|k| **k == what).copied();
    match parts.get(owner) {
        Some(Symbol::Element(k, known)) => return among(known).map(|what| Measure::Element(*k, what)),
        Some(Symbol::Drive(k)) => return among(&["driving_force"]).map(|_| Measure::Effort(*k)),
        Some(Symbol::Slide(k)) => return among(OF_SLIDE).map(|what| Measure::Slide(*k, what)),
        Some(Symbol::Point(k)) => return among(OF_POINT).map(|what| Measure::Point(*k, what)),
        _ => {}
    }
    let frame = parts.find_frame(owner)?;
    match (frame, among(OF_NODE)) {
        (Frame::Node(beam, node), Some(what)) => Some(Measure::Node(beam, node, what)),
        _ => among(OF_POINT).map(|what| Measure::Frame(frame, what)),
    }
}

/// Names of all quantities, for suggestions.
pub fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(Symbol::Element(_, known)) => all(known),
            Some(Symbol::Drive(_)) => all(&["driving_force"]),
            Some(Symbol::Slide(_)) => all(OF_SLIDE),
            Some(Symbol::Point(_) | Symbol::Frame(_)) => all(OF_POINT),
            Some(Symbol::Beam(..)) => {
                let node = |end: &str| {
                    OF_NODE.iter().chain(OF_POINT).map(move |w| format!("{name}.{end}.{w}")).collect::<Vec<_>>()
                };
                [node("first"), node("last")].concat()
            }
            Some(Symbol::Contact) | None => vec![],
        }
    };
    parts.order.iter().flat_map(of).chain(["kinetic_energy".into(), "potential_energy".into()]).collect()
}

/// Whose motion a sensor shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Owner {
    Frame(Frame),
    Point(usize),
    Slide(usize),
    Design(usize),
}

/// Sensors of a mechanism that is being built, each made when it is first asked for.
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
            Measure::Effort(k) => return Ok(vec![world.mechanism.driving_force(world.drives[*k])]),
            Measure::Element(k, what) => return Ok(vec![world.mechanism.measure(world.elements[*k], what)?]),
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

    /// A quantity that is a design variable: the place of a point that stands so far from the origin.
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
