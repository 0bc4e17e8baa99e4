//! `[[body]]`: what moves, and `[[point]]`: points fixed to it.

use super::element_kinds::parameter_keys;
use super::key::{Accepts, EACH, Key, Table, default, optional, required};
use super::parts::{BuildContext, Frame, POINT_KEYS, Parts, Symbol};
use super::section::{Read, Section};
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use autodiff::Scalar;
use mechanics::elements::{Element, ElementDescriptor, PointMass, RigidBody};
use mechanics::mechanism::{Body as Handle, Pose};
use std::sync::LazyLock;

const POSITION: Key = required("position", Accepts::Pair, "[x, y] at the start in m; a guess where joints decide");
const VELOCITY: Key = optional("velocity", Accepts::Pair, "[vx, vy] at the start in m/s; a guess where joints decide");
const ANGLE: Key = default("angle", Accepts::Expression, "0", "rotation at the start in rad");
const SPIN: Key = default("spin", Accepts::Expression, "0", "angular velocity at the start in rad/s");
const SLIDER: &[Key] = &[
    required("mass", Accepts::Expression, "kg, or kg·m² if the coordinate is an angle"),
    default("position", Accepts::Expression, "0", "at the start, m or rad"),
    default("velocity", Accepts::Expression, "0", "at the start, m/s or rad/s"),
];
const POINT: &[Key] = &[required("name", Accepts::Name, "name, unique in the file"), EACH];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Rigid,
    Point,
    FixedNode,
    MasslessNode,
    Slider,
}

/// Kinds of bodies with their tables. The parameters of a body are those that its element declares.
static KINDS: LazyLock<[(Kind, Table); 5]> = LazyLock::new(|| {
    let table = |kind, about, keys| Table { name: "body", kind: Some(kind), about, keys };
    let of_element = |element: &'static ElementDescriptor, state: &[Key]| {
        let keys = parameter_keys(element).into_iter().chain(state.iter().copied()).collect::<Vec<_>>();
        table(element.kind, element.about, keys.leak())
    };
    let declared = "every body is declared";
    let rigid = Element::descriptor(&RigidBody).expect(declared);
    let point = Element::descriptor(&PointMass).expect(declared);
    [
        (Kind::Rigid, of_element(rigid, &[POSITION, ANGLE, VELOCITY, SPIN])),
        (Kind::Point, of_element(point, &[POSITION, VELOCITY])),
        (Kind::FixedNode, table("fixed-node", "a point at rest that beam ends can share", &[POSITION])),
        (Kind::MasslessNode, table("massless-node", "a massless node that elements give mass to", &[POSITION, ANGLE])),
        (Kind::Slider, table("slider", "one coordinate with a mass", SLIDER)),
    ]
});

/// Keys of all kinds.
static COMMON: LazyLock<[Key; 3]> = LazyLock::new(|| {
    let words: Vec<&str> = KINDS.iter().filter_map(|(_, table)| table.kind).collect();
    let kind = default("kind", Accepts::Choice(words.leak()), "rigid", "what it is");
    [required("name", Accepts::Name, "name, unique in the file"), kind, EACH]
});

/// Declarations for documentation and schema.
pub fn tables() -> Vec<Table> {
    let body = Table { name: "body", kind: None, about: "what moves", keys: &*COMMON };
    let point = |keys| Table { name: "point", kind: None, about: "a named point of a body", keys };
    std::iter::once(body)
        .chain(KINDS.iter().map(|(_, table)| *table))
        .chain([point(POINT), point(POINT_KEYS)])
        .collect()
}

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
    let (mut frames, mut sliders, mut bodies) = (0, 0, vec![]);
    file.read_each("body", |table, span| {
        let kinds = KINDS.iter().filter_map(|(kind, table)| Some((table.kind?, (*kind, table.keys))));
        let (kind, keys) = Section::kind(&table, "body", "rigid", kinds)?;
        let section = Section::of(table, span, "body", &[&*COMMON, keys], file.source())?;
        let named = if kind == Kind::Slider { Symbol::Slider(sliders) } else { Symbol::Frame(Frame::Body(frames)) };
        parts.add(&section.need_word("name")?, named)?;
        bodies.push(body(kind, &section, names)?);
        if kind == Kind::Slider {
            sliders += 1
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
    let has_angle = matches!(kind, Kind::Rigid | Kind::MasslessNode);
    let moves = matches!(kind, Kind::Rigid | Kind::Point);
    let (position, velocity) = if kind == Kind::Slider {
        ([one("position", true)?, zero(), zero()], [one("velocity", true)?, zero(), zero()])
    } else {
        let [x, y] = section.pair("position", names, &Wants::DESIGN)?;
        let [vx, vy] = if moves { section.pair("velocity", names, &Wants::DESIGN)? } else { [zero(), zero()] };
        ([x, y, one("angle", has_angle)?], [vx, vy, one("spin", kind == Kind::Rigid)?])
    };
    let inertia = [one("mass", moves || kind == Kind::Slider)?, one("inertia", kind == Kind::Rigid)?];
    Ok(Body { name: section.text("name")?, kind, inertia, position, velocity })
}

impl Body {
    /// Adds the body to a mechanism.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S]) {
        let value = |program: &Program| program.value(&Inputs::design(b));
        let [x, y, theta] = self.position.each_ref().map(value);
        let [mass, inertia] = self.inertia.each_ref().map(value);
        let velocity = self.velocity.each_ref().map(value);
        let (name, pose, m) = (self.name.as_str(), Pose { x, y, theta }, &mut context.mechanism);
        let body = match self.kind {
            Kind::Slider => {
                let slide = m.coordinate(name, x, velocity[0]);
                m.inertia(name, slide, mass);
                return context.sliders.push(slide);
            }
            Kind::Rigid => m.body(name, mass, inertia, pose),
            Kind::Point => m.point_mass(name, mass, x, y),
            Kind::FixedNode => m.fixed_node(name, x, y),
            Kind::MasslessNode => m.massless_node(name, pose),
        };
        self.set_velocity(context, body, velocity);
        context.bodies.push(body);
    }

    /// The coordinates that the body has for itself.
    fn set_velocity<S: Scalar>(&self, context: &mut BuildContext<S>, body: Handle, velocity: [S; 3]) {
        let own = match self.kind {
            Kind::Rigid => 3,
            Kind::Point => 2,
            _ => 0,
        };
        for (coordinate, velocity) in body.coordinates().into_iter().zip(velocity).take(own) {
            context.mechanism.set_velocity(coordinate, velocity);
        }
    }
}

/// Reads `[[point]]`.
pub fn read_points(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<()> {
    let one = |table, span| {
        let section = Section::of(table, span, "point", &[POINT, POINT_KEYS], file.source())?;
        let body = section.need_word("body")?;
        let point = super::parts::PointRef {
            frame: parts.frame(&body.text, &body.span)?,
            at: section.pair("at", names, &Wants::DESIGN)?,
        };
        parts.add(&section.need_word("name")?, Symbol::Point(parts.points.len()))?;
        parts.points.push(point);
        Ok(())
    };
    file.read_each("point", one).map(drop)
}
