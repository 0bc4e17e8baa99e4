//! `[[body]]`: what moves, and `[[point]]`: points fixed to it.

use super::key::{Accepts, EACH, Key, Table, default, optional, required};
use super::parts::{BuildContext, Frame, Parts, SPOT, Symbol};
use super::section::{Read, Section};
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use autodiff::Scalar;
use mechanics::mechanism::{Body as Handle, Pose};

const COMMON: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    default(
        "kind",
        Accepts::Choice(&["rigid", "point", "fixed-node", "massless-node", "slider"]),
        "rigid",
        "what it is",
    ),
    EACH,
];
const POSITION: Key = required("position", Accepts::Pair, "[x, y] at the start in m; a guess where joints decide");
const VELOCITY: Key = optional("velocity", Accepts::Pair, "[vx, vy] at the start in m/s; a guess where joints decide");
const RIGID: &[Key] = &[
    required("mass", Accepts::Expression, "kg"),
    required("inertia", Accepts::Expression, "moment of inertia about the centre of mass, kg·m²"),
    POSITION,
    default("angle", Accepts::Expression, "0", "rotation at the start in rad"),
    VELOCITY,
    default("spin", Accepts::Expression, "0", "angular velocity at the start in rad/s"),
];
const POINT_MASS: &[Key] = &[required("mass", Accepts::Expression, "kg"), POSITION, VELOCITY];
const PIVOT: &[Key] = &[POSITION];
const FRAME: &[Key] = &[POSITION, default("angle", Accepts::Expression, "0", "rotation at the start in rad")];
const SLIDE: &[Key] = &[
    required("mass", Accepts::Expression, "kg, or kg·m² if the coordinate is an angle"),
    default("position", Accepts::Expression, "0", "at the start, m or rad"),
    default("velocity", Accepts::Expression, "0", "at the start, m/s or rad/s"),
];
const POINT: &[Key] = &[required("name", Accepts::Name, "name, unique in the file"), EACH];

/// Declarations for documentation and schema.
pub const TABLES: &[Table] = &[
    Table { name: "body", kind: None, about: "what moves", keys: COMMON },
    Table {
        name: "body",
        kind: Some("rigid"),
        about: "a rigid body with its reference point in the centre of mass",
        keys: RIGID,
    },
    Table { name: "body", kind: Some("point"), about: "a point mass, which does not rotate", keys: POINT_MASS },
    Table { name: "body", kind: Some("fixed-node"), about: "a point at rest that beam ends can share", keys: PIVOT },
    Table {
        name: "body",
        kind: Some("massless-node"),
        about: "a massless node that elements give mass to",
        keys: FRAME,
    },
    Table { name: "body", kind: Some("slider"), about: "one coordinate with a mass", keys: SLIDE },
    Table { name: "point", kind: None, about: "a named point of a body", keys: POINT },
    Table { name: "point", kind: None, about: "a named point of a body", keys: SPOT },
];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Rigid,
    Point,
    Pivot,
    Frame,
    Slide,
}

const KINDS: &[(&str, Kind, &[Key])] = &[
    ("rigid", Kind::Rigid, RIGID),
    ("point", Kind::Point, POINT_MASS),
    ("fixed-node", Kind::Pivot, PIVOT),
    ("massless-node", Kind::Frame, FRAME),
    ("slider", Kind::Slide, SLIDE),
];

/// A body with its numbers as programs of the design.
#[derive(Clone, Debug)]
pub struct Body {
    name: String,
    pub kind: Kind,
    /// Mass, moment of inertia, as far as the kind has them.
    inertia: [Program; 2],
    /// x, y, angle.
    position: [Program; 3],
    /// vx, vy, spin.
    velocity: [Program; 3],
}

/// Reads the bodies and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<Body>> {
    let (mut frames, mut slides, mut bodies) = (0, 0, vec![]);
    file.each("body", |table, span| {
        let kinds = KINDS.iter().map(|(name, kind, keys)| (*name, (*kind, *keys)));
        let (kind, keys) = Section::kind(&table, "body", "rigid", kinds)?;
        let section = Section::of(table, span, "body", &[COMMON, keys], file.source())?;
        let named = if kind == Kind::Slide { Symbol::Slide(slides) } else { Symbol::Frame(Frame::Body(frames)) };
        parts.add(&section.need_word("name")?, named)?;
        bodies.push(body(kind, &section, names)?);
        if kind == Kind::Slide {
            slides += 1
        } else {
            frames += 1
        }
        Ok(())
    })?;
    Ok(bodies)
}

fn body(kind: Kind, section: &Section<'_>, names: &Names) -> Read<Body> {
    let zero = || Program::constant(0.0);
    let one = |key: &str, has: bool| if has { section.program(key, names, &Wants::DESIGN) } else { Ok(zero()) };
    let has_angle = matches!(kind, Kind::Rigid | Kind::Frame);
    let moves = matches!(kind, Kind::Rigid | Kind::Point);
    let (position, velocity) = if kind == Kind::Slide {
        ([one("position", true)?, zero(), zero()], [one("velocity", true)?, zero(), zero()])
    } else {
        let [x, y] = section.pair("position", names, &Wants::DESIGN)?;
        let [vx, vy] = if moves { section.pair("velocity", names, &Wants::DESIGN)? } else { [zero(), zero()] };
        ([x, y, one("angle", has_angle)?], [vx, vy, one("spin", kind == Kind::Rigid)?])
    };
    let inertia = [one("mass", moves || kind == Kind::Slide)?, one("inertia", kind == Kind::Rigid)?];
    Ok(Body { name: section.text("name")?, kind, inertia, position, velocity })
}

impl Body {
    /// Adds the body to a mechanism.
    pub fn build<S: Scalar>(&self, world: &mut BuildContext<S>, b: &[S]) {
        let value = |program: &Program| program.value(&Inputs::design(b));
        let [x, y, theta] = self.position.each_ref().map(value);
        let [mass, inertia] = self.inertia.each_ref().map(value);
        let velocity = self.velocity.each_ref().map(value);
        let (name, pose, m) = (self.name.as_str(), Pose { x, y, theta }, &mut world.mechanism);
        let body = match self.kind {
            Kind::Slide => {
                let slide = m.coordinate(name, x, velocity[0]);
                m.inertia(name, slide, mass);
                return world.slides.push(slide);
            }
            Kind::Rigid => m.body(name, mass, inertia, pose),
            Kind::Point => m.point_mass(name, mass, x, y),
            Kind::Pivot => m.fixed_node(name, x, y),
            Kind::Frame => m.massless_node(name, pose),
        };
        self.set_velocity(world, body, velocity);
        world.bodies.push(body);
    }

    /// The coordinates that the body has for itself.
    fn set_velocity<S: Scalar>(&self, world: &mut BuildContext<S>, body: Handle, velocity: [S; 3]) {
        let own = match self.kind {
            Kind::Rigid => 3,
            Kind::Point => 2,
            _ => 0,
        };
        for (coordinate, velocity) in body.coordinates().into_iter().zip(velocity).take(own) {
            world.mechanism.set_velocity(coordinate, velocity);
        }
    }
}

/// Reads `[[point]]`.
pub fn read_points(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<()> {
    let one = |table, span| {
        let section = Section::of(table, span, "point", &[POINT, SPOT], file.source())?;
        let body = section.need_word("body")?;
        let spot = super::parts::PointRef {
            frame: parts.frame(&body.text, &body.span)?,
            at: section.pair("at", names, &Wants::DESIGN)?,
        };
        parts.add(&section.need_word("name")?, Symbol::Point(parts.points.len()))?;
        parts.points.push(spot);
        Ok(())
    };
    file.each("point", one).map(drop)
}
