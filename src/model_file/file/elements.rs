//! `[[joint]]`, `[[driver]]` and `[[force]]`.

use super::element_kinds::{Attach, COMMON_DRIVER, COMMON_FORCE, COMMON_JOINT, DRIVERS, Element, FORCES, JOINTS, Kind};
use super::feedback::{self, Feedback};
use super::key::{Accepts, Key};
use super::motion::{self, MotionLaw, TimeFunction};
use super::parts::{BuildContext, CoordinateRef, Parts, PointRef, Symbol};
use super::section::{Read, Section};
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use autodiff::Scalar;
use mechanics::mechanism::{Coordinate, Marker};

/// A joint, drive or force with its numbers as programs of the design.
#[derive(Clone, Debug)]
pub struct ElementSpec {
    name: String,
    pub element: Element,
    pub spots: Vec<PointRef>,
    pub places: Vec<CoordinateRef>,
    pub numbers: Vec<Program>,
    function: Option<TimeFunction>,
    feedback: Option<Feedback>,
}

/// Reads joints, drives and forces in this order and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<ElementSpec>> {
    let families: [(&str, &'static [Key], &'static [Kind], &str); 3] = [
        ("joint", COMMON_JOINT, JOINTS, "revolute"),
        ("driver", COMMON_DRIVER, DRIVERS, "coordinate"),
        ("force", COMMON_FORCE, FORCES, ""),
    ];
    let (mut all, mut elements, mut drives) = (vec![], 0, 0);
    for (family, common, kinds, usual) in families {
        file.each(family, |table, span| {
            let kind = Section::kind(&table, family, usual, kinds.iter().map(|k| (k.name, k)))?;
            let section = Section::of(table, span, family, &[common, kind.attach.keys(), kind.keys], file.source())?;
            let named = match kind.element {
                Element::Prescribed => {
                    drives += 1;
                    Symbol::Drive(drives - 1)
                }
                Element::RigidStop | Element::RigidWall => Symbol::Contact,
                _ => {
                    elements += 1;
                    Symbol::Element(elements - 1, kind.measures)
                }
            };
            all.push(attached(kind, &section, names, parts)?);
            parts.add(&section.need_word("name")?, named)
        })?;
    }
    Ok(all)
}

fn attached(kind: &Kind, section: &Section<'_>, names: &Names, parts: &Parts) -> Read<ElementSpec> {
    let spot = |key: &&str| parts.spot(section, key, names);
    let place = |key: &&str| parts.place(section, key);
    let (points, coordinates): (&[&str], &[&str]) = match kind.attach {
        Attach::Points => (&["a", "b"], &[]),
        Attach::Point => (&["at"], &[]),
        Attach::Coordinates => (&[], &["a", "b"]),
        Attach::Wheels => (&[], &["a", "b", "carrier"]),
        Attach::Coordinate => (&[], &["coordinate"]),
    };
    let numbers = kind.keys.iter().filter(|key| key.accepts == Accepts::Expression);
    let function = kind.keys.iter().find(|key| key.accepts == Accepts::Motion);
    let feedback = kind.keys.iter().find(|key| key.accepts == Accepts::Feedback);
    Ok(ElementSpec {
        name: section.text("name")?,
        element: kind.element,
        spots: points.iter().map(spot).collect::<Read<_>>()?,
        places: coordinates.iter().map(place).collect::<Read<_>>()?,
        numbers: numbers.map(|key| section.program(key.name, names, &Wants::DESIGN)).collect::<Read<_>>()?,
        function: function.map(|key| motion::read(section, key.name, names)).transpose()?,
        feedback: feedback.map(|key| feedback::read(section, key.name, names, parts)).transpose()?,
    })
}

impl ElementSpec {
    /// Adds the part to a mechanism.
    pub fn build<S: Scalar>(&self, world: &mut BuildContext<S>, b: &[S]) {
        let value = |program: &Program| program.value(&Inputs::design(b));
        let markers: Vec<Marker<S>> = self.spots.iter().map(|spot| world.marker(spot, b)).collect();
        let coordinates: Vec<Coordinate> = self.places.iter().map(|place| world.coordinate(*place)).collect();
        let numbers: Vec<S> = self.numbers.iter().map(value).collect();
        let (law, parameters) = match &self.function {
            Some(function) => (function.law.clone(), function.parameters.iter().map(value).collect()),
            None => (MotionLaw::ConstantSpeed, vec![]),
        };
        if self.element == Element::Prescribed {
            world.mechanism.drive(coordinates[0], law, &parameters);
            return world.drives.push(coordinates[0]);
        }
        if let Some(feedback) = &self.feedback {
            let (law, parameters, observed) = feedback.build(world, b);
            let part = world.mechanism.feedback_force(&self.name, coordinates[0], &observed, law, &parameters);
            return world.elements.push(part);
        }
        self.add(world, &markers, &coordinates, &numbers, (law, &parameters));
    }

    /// Adds an element; points, coordinates and numbers are as many as its kind has declared.
    fn add<S: Scalar>(
        &self,
        world: &mut BuildContext<S>,
        p: &[Marker<S>],
        c: &[Coordinate],
        n: &[S],
        time: (MotionLaw, &[S]),
    ) {
        let (m, name, (law, parameters)) = (&mut world.mechanism, self.name.as_str(), time);
        let part = match self.element {
            Element::Revolute => m.revolute(name, p[0], p[1]),
            Element::FixedJoint => m.fixed_joint(name, p[0], p[1], n[0]),
            Element::Prismatic => m.prismatic(name, p[0], n[0], p[1], n[1]),
            Element::PointOnLine => m.point_on_line(name, p[0], n[0], p[1]),
            Element::DistanceConstraint => m.distance_constraint(name, p[0], p[1], n[0]),
            Element::GearPair => m.gear_pair(name, [c[0], c[1]], c[2], [n[0], n[1], n[2]]),
            Element::Rack => m.rack(name, p[0].body, p[1].body, [n[0], n[1], n[2]]),
            Element::Relative => m.driver(name, c[0], c[1], law, parameters),
            Element::Length => m.drive_length(name, p[0], p[1], law, parameters),
            Element::Spring => m.nonlinear_spring(name, p[0], p[1], [n[0], n[1], n[2], n[3]]),
            Element::CoordinateSpring => m.coordinate_spring(name, c[0], c[1], [n[0], n[1], n[2], n[3]]),
            Element::Bushing => m.bushing(name, p[0], p[1], [n[0], n[1], n[2]], [n[3], n[4], n[5]]),
            Element::Actuator => m.actuator(name, p[0], p[1], law, parameters),
            Element::Load => m.load(name, c[0], c[1], law, parameters),
            Element::Force => m.force(name, p[0], n[0], law, parameters),
            Element::Friction => m.friction(name, c[0], c[1], [n[0], n[1], n[2]]),
            Element::BumpStop => m.bump_stop(name, c[0], c[1], [n[0], n[1], n[2]]),
            Element::Wall => m.wall_contact(name, p[0], [n[0], n[1]], n[2], [n[3], n[4]]),
            Element::RigidStop => return m.rigid_stop(name, c[0], c[1], n[0], n[1]),
            Element::RigidWall => return m.rigid_wall(name, p[0], n[0], p[1], n[1]),
            Element::Inertia => m.inertia(name, c[0], n[0]),
            Element::Prescribed => unreachable!("a prescribed coordinate is no element"),
            Element::FeedbackForce => unreachable!("it is added with what it observes"),
        };
        world.elements.push(part);
    }
}
