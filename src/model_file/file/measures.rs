//! Measured quantities of a mechanism, from which outputs are computed.

use super::parts::{BuildContext, CoordinateRef, FrameRef, NamedPart, Parts};
use crate::Result;
use crate::model_file::expression::{CompiledExpression, Inputs, OtherUnit};
use crate::model_file::unit::{KnownDimension, Unit};
use autodiff::Scalar;
use mechanics::elements::spatial::{Beam3, MarkerSensor3};
use mechanics::elements::{self, Added, CoordinateSensor, Element, MarkerSensor};
use mechanics::mechanism::{ElementIndex, EulerSequence, Marker3, WeightedQuantity};
use std::collections::HashMap;

/// Measures of a beam in the plane at its nodes: the mean of the adjacent elements.
const OF_NODE: &[&str] = &["moment", "normal_force", "shear_force"];

/// Orientation of a frame in space as rotations about z, the turned y and the turned x, with the measures of the sensor.
const ANGLES: [(&str, &str); 3] = [("yaw", "first"), ("pitch", "second"), ("roll", "third")];

/// Measures of a point and of its body, in world axes.
fn of_point(parts: &Parts) -> Vec<&'static str> {
    match parts.is_spatial {
        true => names(Element::measures(&MarkerSensor3)).into_iter().chain(ANGLES.map(|(angle, _)| angle)).collect(),
        false => names(Element::measures(&MarkerSensor)),
    }
}

/// Measures of a beam at its nodes.
fn of_node(parts: &Parts) -> Vec<&'static str> {
    if parts.is_spatial { names(Element::measures(&Beam3)) } else { OF_NODE.to_vec() }
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
    /// A measure of the point of a frame in space at one metre along x (0) or y (1), for drawings.
    AxisEnd(FrameRef, usize, &'static str),
    /// A measure of a named point.
    Point(usize, &'static str),
    /// A measure of a body with one coordinate.
    Slider(usize, &'static str),
    /// Position, velocity or acceleration of a coordinate of a joint in space.
    Joint(CoordinateRef, &'static str),
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
        Some(NamedPart::Element(k, of)) => {
            let of_joint = parts.joint_coordinates(owner).find_map(|(place, names)| {
                let kind = names.iter().position(|name| name == text)?;
                Some(MeasureRef::Joint(place, ["position", "velocity", "acceleration"][kind]))
            });
            return of_joint.or_else(|| among(&names(of.measures)).map(|what| MeasureRef::Element(*k, what)));
        }
        Some(NamedPart::Slider(k)) => return among(&of_slider()).map(|what| MeasureRef::Slider(*k, what)),
        Some(NamedPart::Point(k)) => return among(&of_point(parts)).map(|what| MeasureRef::Point(*k, what)),
        _ => {}
    }
    let frame = parts.find_frame(owner)?;
    match (frame, among(&of_node(parts))) {
        (FrameRef::Node(beam, node), Some(what)) => Some(MeasureRef::Node(beam, node, what)),
        _ => among(&of_point(parts)).map(|what| MeasureRef::Frame(frame, what)),
    }
}

/// Names of all quantities, for suggestions in messages.
pub fn suggestions(parts: &Parts) -> Vec<String> {
    let of = |name: &String| -> Vec<String> {
        let all = |known: &[&str]| known.iter().map(|what| format!("{name}.{what}")).collect();
        match parts.get(name) {
            Some(NamedPart::Element(_, of)) => {
                let own = all(&names(of.measures));
                parts.joint_coordinates(name).flat_map(|(_, names)| names).chain(own).collect()
            }
            Some(NamedPart::Slider(_)) => all(&of_slider()),
            Some(NamedPart::Point(_) | NamedPart::Frame(_)) => all(&of_point(parts)),
            Some(NamedPart::Beam(..)) => {
                let node = |end: &str| {
                    let known = of_node(parts).into_iter().chain(of_point(parts));
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
        MeasureRef::Frame(_, what) | MeasureRef::Point(_, what) if parts.is_spatial => {
            of(Element::measures(&MarkerSensor3), what).unwrap_or("rad")
        }
        MeasureRef::Frame(_, what) | MeasureRef::Point(_, what) => of(Element::measures(&MarkerSensor), what)?,
        MeasureRef::Joint(CoordinateRef::Joint(_, which), what) => {
            which.units()[["position", "velocity", "acceleration"].iter().position(|known| known == what)?]
        }
        MeasureRef::Joint(..) | MeasureRef::AxisEnd(..) => return None,
        MeasureRef::Node(_, _, what) if parts.is_spatial => of(Element::measures(&Beam3), what)?,
        MeasureRef::Slider(_, what) => of(Element::measures(&CoordinateSensor), what)?,
        MeasureRef::Node(_, _, "moment") => "N·m",
        MeasureRef::Node(..) => "N",
        MeasureRef::KineticEnergy | MeasureRef::PotentialEnergy => "J",
    };
    let known = KnownDimension::loose(Unit::parse(unit)?.dimension)?;
    Some(OtherUnit { known, shown: None })
}

/// Owner of a sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Owner {
    Frame(FrameRef),
    Point(usize),
    Slider(usize),
    Joint(CoordinateRef),
    AxisEnd(FrameRef, usize),
    /// Angles of a frame, or of a point.
    Angles(FrameRef),
    PointAngles(usize),
    Design(usize),
}

/// Sensors of a mechanism under construction, each added at its first use.
pub struct Sensors<'p> {
    parts: &'p Parts,
    made: HashMap<Owner, ElementIndex>,
}

impl<'p> Sensors<'p> {
    pub fn new(parts: &'p Parts) -> Self {
        Self { parts, made: HashMap::new() }
    }

    /// Terms of the quantity, to be summed.
    pub fn terms<S: Scalar>(
        &mut self,
        measure: &MeasureRef,
        context: &mut BuildContext<S>,
        b: &[S],
    ) -> Result<Vec<WeightedQuantity<S>>> {
        let owner = match measure {
            MeasureRef::KineticEnergy => return Ok(vec![context.mechanism.kinetic_energy()]),
            MeasureRef::PotentialEnergy => return Ok(vec![context.mechanism.potential_energy()]),
            MeasureRef::Element(k, what) => {
                return Ok(vec![match context.elements[*k] {
                    Added::Element(element) => context.mechanism.measure(element, what)?,
                    Added::Motion(coordinate) => context.mechanism.driving_force(coordinate),
                }]);
            }
            MeasureRef::Node(beam, node, what) => return at_node(*beam, *node, what, context),
            MeasureRef::Frame(frame, what) if is_angle(what) => Owner::Angles(*frame),
            MeasureRef::Frame(frame, _) => Owner::Frame(*frame),
            MeasureRef::Point(k, what) if is_angle(what) => Owner::PointAngles(*k),
            MeasureRef::Point(k, _) => Owner::Point(*k),
            MeasureRef::Slider(k, _) => Owner::Slider(*k),
            MeasureRef::Joint(place, _) => Owner::Joint(*place),
            MeasureRef::AxisEnd(frame, axis, _) => Owner::AxisEnd(*frame, *axis),
        };
        let (MeasureRef::Frame(_, what)
        | MeasureRef::Point(_, what)
        | MeasureRef::AxisEnd(_, _, what)
        | MeasureRef::Slider(_, what)
        | MeasureRef::Joint(_, what)) = measure
        else {
            unreachable!("the others have returned")
        };
        let what = ANGLES.iter().find(|(angle, _)| angle == what).map_or(*what, |(_, of_sensor)| *of_sensor);
        let part = self.sensor(owner, context, b);
        Ok(vec![context.mechanism.measure(part, what)?])
    }

    /// A design variable as a quantity: the position of a ground point at this distance from the origin.
    pub fn design<S: Scalar>(
        &mut self,
        i: usize,
        context: &mut BuildContext<S>,
        b: &[S],
    ) -> Result<WeightedQuantity<S>> {
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
            Owner::Joint(place) => {
                let (ground, coordinate) = (context.mechanism.ground().x, context.coordinate(place));
                context.mechanism.coordinate_sensor("motion", ground, coordinate)
            }
            Owner::AxisEnd(frame, axis) => {
                let mut point = [S::from(0.0); 3];
                point[axis] = S::from(1.0);
                let marker = context.frame3(frame).at(point);
                context.mechanism.sensor3("motion", marker)
            }
            Owner::Frame(frame) if self.parts.is_spatial => {
                let marker = context.frame3(frame).origin();
                context.mechanism.sensor3("motion", marker)
            }
            Owner::Point(k) if self.parts.is_spatial => {
                let marker = context.marker3(&self.parts.markers[k], b);
                context.mechanism.sensor3("motion", marker)
            }
            Owner::Angles(frame) => {
                let marker = context.frame3(frame).origin();
                self.angle_sensor(|name| self.parts.find_frame(name) == Some(frame), marker, context)
            }
            Owner::PointAngles(k) => {
                let marker = context.marker3(&self.parts.markers[k], b);
                let is_owner = |name: &str| matches!(self.parts.get(name), Some(NamedPart::Point(j)) if *j == k);
                self.angle_sensor(is_owner, marker, context)
            }
            Owner::Frame(frame) => {
                let marker = context.frame(frame).origin();
                context.mechanism.sensor("motion", marker)
            }
            Owner::Point(k) => {
                let marker = context.marker(&self.parts.points[k], b);
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

    /// A sensor of the Euler angles of a marker. Its warnings name the part that `is_owner`.
    fn angle_sensor<S: Scalar>(
        &self,
        is_owner: impl Fn(&str) -> bool,
        marker: Marker3<S>,
        context: &mut BuildContext<S>,
    ) -> ElementIndex {
        let name = self.parts.order.iter().find(|name| is_owner(name)).map_or("motion", String::as_str);
        let ground = context.mechanism.ground3().origin();
        context.mechanism.euler_angle_sensor(name, ground, marker, EulerSequence::Zyx)
    }
}

fn is_angle(what: &str) -> bool {
    ANGLES.iter().any(|(angle, _)| *angle == what)
}

/// Mean of the adjacent elements at a beam node.
fn at_node<S: Scalar>(
    beam: usize,
    node: usize,
    what: &str,
    context: &BuildContext<S>,
) -> Result<Vec<WeightedQuantity<S>>> {
    let parts = if context.is_spatial { &context.beams3[beam].1 } else { &context.beams[beam].1 };
    let sides = [what.to_owned() + "_j", what.to_owned() + "_i"];
    let [before, after] =
        if what == "moment" && !context.is_spatial { sides.each_ref().map(String::as_str) } else { [what; 2] };
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
