//! `[[body]]`: bodies and nodes, and `[[point]]`: named points fixed to them.

use super::element_kinds::parameter_keys;
use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::parts::{BuildContext, FrameRef, NamedPart, POINT_KEYS, Parts};
use super::section::{Read, Section};
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use autodiff::Scalar;
use mechanics::elements::{Element, ElementDescriptor, PointMass, RigidBody};
use mechanics::mechanism::{Body, Pose};
use std::sync::LazyLock;

const POSITION: Key =
    required("position", Accepts::Pair, "initial position [x, y] in m; an estimate if joints determine it").of("m");
const VELOCITY: Key =
    optional("velocity", Accepts::Pair, "initial velocity [vx, vy] in m/s; without it, it follows from joints")
        .of("m/s");
const ANGLE: Key = default("angle", Accepts::Expression, "0", "initial angle, rad").of("rad");
const SPIN: Key =
    optional("spin", Accepts::Expression, "initial angular velocity, rad/s; without it, it follows from joints")
        .of("rad/s");
const SLIDER: &[Key] = &[
    required("mass", Accepts::Expression, "mass in kg, or moment of inertia in kg·m² if the coordinate is an angle")
        .of("kg or kg·m²"),
    default("position", Accepts::Expression, "0", "initial position, m or rad").of("m or rad"),
    optional("velocity", Accepts::Expression, "initial velocity, m/s or rad/s; without it, it follows from joints")
        .of("m/s or rad/s"),
];
const POINT: &[Key] = &[required("name", Accepts::Name, "name, unique in the file"), EACH];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyKind {
    Rigid,
    Point,
    FixedNode,
    MasslessNode,
    Slider,
}

/// Kinds of bodies with their tables. The parameters of a body are those that its element declares.
static KINDS: LazyLock<[(BodyKind, TableKeys); 5]> = LazyLock::new(|| {
    let table = |kind, about, keys| TableKeys { name: "body", kind: Some(kind), about, keys };
    let of_element = |element: &'static ElementDescriptor, state: &[Key]| {
        let keys = parameter_keys(element).into_iter().chain(state.iter().copied()).collect::<Vec<_>>();
        table(element.kind, element.about, keys.leak())
    };
    let declared = "every body is declared";
    let rigid = Element::descriptor(&RigidBody).expect(declared);
    let point = Element::descriptor(&PointMass).expect(declared);
    [
        (BodyKind::Rigid, of_element(rigid, &[POSITION, ANGLE, VELOCITY, SPIN])),
        (BodyKind::Point, of_element(point, &[POSITION, VELOCITY])),
        (BodyKind::FixedNode, table("fixed-node", "a point at rest that beam ends can share", &[POSITION])),
        (BodyKind::MasslessNode, table("massless-node", "a node without mass of its own", &[POSITION, ANGLE])),
        (BodyKind::Slider, table("slider", "one coordinate with a mass", SLIDER)),
    ]
});

/// Keys of all kinds.
static COMMON: LazyLock<[Key; 3]> = LazyLock::new(|| {
    let words: Vec<&str> = KINDS.iter().filter_map(|(_, table)| table.kind).collect();
    let kind = default("kind", Accepts::Choice(words.leak()), "rigid", "kind of body");
    [required("name", Accepts::Name, "name, unique in the file"), kind, EACH]
});

/// Declarations for documentation and schema.
pub fn tables() -> Vec<TableKeys> {
    let body = TableKeys { name: "body", kind: None, about: "bodies and nodes", keys: &*COMMON };
    let point = |keys| TableKeys { name: "point", kind: None, about: "a named point of a body", keys };
    std::iter::once(body)
        .chain(KINDS.iter().map(|(_, table)| *table))
        .chain([point(POINT), point(POINT_KEYS)])
        .collect()
}

/// A body whose numbers are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct BodySpec {
    name: String,
    pub kind: BodyKind,
    /// Mass and moment of inertia; zero if the kind has none.
    inertia: [CompiledExpression; 2],
    /// x, y, angle.
    position: [CompiledExpression; 3],
    /// vx, vy, spin; `None` if they follow from the joints.
    velocity: [Option<CompiledExpression>; 3],
}

/// Reads the bodies and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<BodySpec>> {
    let (mut frames, mut sliders, mut bodies) = (0, 0, vec![]);
    file.read_each("body", |table, span| {
        let kinds = KINDS.iter().filter_map(|(kind, table)| Some((table.kind?, (*kind, table.keys))));
        let (kind, keys) = Section::kind(&table, "body", "rigid", kinds)?;
        let section = Section::of(table, span, "body", &[&*COMMON, keys], file.source())?;
        let named = if kind == BodyKind::Slider {
            NamedPart::Slider(sliders)
        } else {
            NamedPart::Frame(FrameRef::Body(frames))
        };
        // A body with mistakes has no name, since the next one has its number.
        let body = body(kind, &section, names)?;
        parts.add(&section.need_word("name")?, named)?;
        bodies.push(body);
        if kind == BodyKind::Slider {
            sliders += 1
        } else {
            frames += 1
        }
        Ok(())
    })?;
    Ok(bodies)
}

pub fn body(kind: BodyKind, section: &Section<'_>, names: &Names) -> Read<BodySpec> {
    let zero = || CompiledExpression::constant(0.0);
    let one = |key: &str, has: bool| if has { section.expression(key, names, &Scope::DESIGN) } else { Ok(zero()) };
    // The time stands for the start of the motion, so that a body can begin where its driver does.
    let state = |key: &str, has: bool| if has { section.expression(key, names, &Scope::MOTION) } else { Ok(zero()) };
    let has_angle = matches!(kind, BodyKind::Rigid | BodyKind::MasslessNode);
    let moves = matches!(kind, BodyKind::Rigid | BodyKind::Point);
    let (position, velocity) = if kind == BodyKind::Slider {
        let velocity = section.has("velocity").then(|| state("velocity", true)).transpose()?;
        ([state("position", true)?, zero(), zero()], [velocity, None, None])
    } else {
        let [x, y] = section.vector("position", names, &Scope::MOTION)?;
        let [vx, vy] = match moves && section.has("velocity") {
            true => section.vector("velocity", names, &Scope::MOTION)?.map(Some),
            false => [None, None],
        };
        let has_spin = kind == BodyKind::Rigid && section.has("spin");
        let spin = has_spin.then(|| state("spin", true)).transpose()?;
        ([x, y, state("angle", has_angle)?], [vx, vy, spin])
    };
    let inertia = [one("mass", moves || kind == BodyKind::Slider)?, one("inertia", kind == BodyKind::Rigid)?];
    Ok(BodySpec { name: section.text("name")?, kind, inertia, position, velocity })
}

impl BodySpec {
    /// Adds the body to a mechanism whose motion starts at the time `start`.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S], start: f64) {
        let value = |expression: &CompiledExpression| expression.value(&Inputs::at(b, S::from(start)));
        let [x, y, theta] = self.position.each_ref().map(value);
        let [mass, inertia] = self.inertia.each_ref().map(value);
        let velocity = self.velocity.each_ref().map(|velocity| velocity.as_ref().map(value));
        let (name, pose, m) = (self.name.as_str(), Pose { x, y, theta }, &mut context.mechanism);
        let body = match self.kind {
            BodyKind::Slider => {
                let slide = m.coordinate(name, x, S::from(0.0));
                m.inertia(name, slide, mass);
                velocity[0].into_iter().for_each(|velocity| m.set_velocity(slide, velocity));
                return context.sliders.push(slide);
            }
            BodyKind::Rigid => m.body(name, mass, inertia, pose),
            BodyKind::Point => m.point_mass(name, mass, x, y),
            BodyKind::FixedNode => m.fixed_node(name, x, y),
            BodyKind::MasslessNode => m.massless_node(name, pose),
        };
        self.set_velocity(context, body, velocity);
        context.bodies.push(body);
    }

    /// Sets the initial velocities of the body's own coordinates.
    fn set_velocity<S: Scalar>(&self, context: &mut BuildContext<S>, body: Body, velocity: [Option<S>; 3]) {
        let own = match self.kind {
            BodyKind::Rigid => 3,
            BodyKind::Point => 2,
            _ => 0,
        };
        for (coordinate, velocity) in body.coordinates().into_iter().zip(velocity).take(own) {
            velocity.into_iter().for_each(|velocity| context.mechanism.set_velocity(coordinate, velocity));
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
            at: section.vector("at", names, &Scope::DESIGN)?,
        };
        parts.add(&section.need_word("name")?, NamedPart::Point(parts.points.len()))?;
        parts.points.push(point);
        Ok(())
    };
    file.read_each("point", one).map(drop)
}
