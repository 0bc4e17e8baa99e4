//! `[[body]]` and `[[point]]` in space.

use super::bodies::{self, BodyKind, BodySpec};
use super::element_kinds::grouped_keys;
use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::markers::MARKER_KEYS;
use super::parts::{Axes, BuildContext, FrameRef, NamedPart, Parts, PointSpec, Vector};
use super::section::{Read, Section};
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use crate::{Error, Result};
use autodiff::Scalar;
use mechanics::elements::spatial::{MassProperties3, PointMass3, RigidBody3};
use mechanics::elements::{Element, ElementDescriptor, Role};
use mechanics::mechanism::Pose3;
use std::sync::LazyLock;

const POSITION: Key = optional(
    "position",
    Accepts::Place,
    "initial position [x, y, z] of the reference point in m, or a named point of the ground; by default the origin; an estimate \
     if joints determine it",
)
.of("m");
const ORIENTATION: Key = optional(
    "orientation",
    Accepts::Table,
    "initial orientation relative to the world, such as { order = \"zyx\", angles = [0.1, 0, 0] }; by default the axes of the world",
);
const VELOCITY: Key = optional(
    "velocity",
    Accepts::Triple,
    "initial velocity of the reference point in world axes in m/s; without it, it follows from joints",
)
.of("m/s");
const OMEGA: Key = optional(
    "angular_velocity",
    Accepts::Triple,
    "initial angular velocity in world axes in rad/s; without it, it follows from joints",
)
.of("rad/s");

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BodyKind3 {
    Rigid,
    Point,
    FixedNode,
    MasslessNode,
    Slider,
}

/// Kinds of bodies in space with their tables.
static KINDS: LazyLock<[(BodyKind3, TableKeys); 5]> = LazyLock::new(|| {
    let table = |kind, about, keys| TableKeys { name: "body3", kind: Some(kind), about, keys };
    let of_element = |element: &'static ElementDescriptor, state: &[Key]| {
        let keys = parameters(element).into_iter().chain(state.iter().copied()).collect::<Vec<_>>();
        table(element.kind, element.about, keys.leak())
    };
    let declared = "every body is declared";
    let rigid = Element::descriptor(&RigidBody3).expect(declared);
    let point = Element::descriptor(&PointMass3).expect(declared);
    let slider = *bodies::tables().iter().find(|table| table.kind == Some("slider")).expect(declared);
    [
        (BodyKind3::Rigid, of_element(rigid, &[POSITION, ORIENTATION, VELOCITY, OMEGA])),
        (BodyKind3::Point, of_element(point, &[POSITION, VELOCITY])),
        (BodyKind3::FixedNode, table("fixed-node", "a frame at rest", &[POSITION, ORIENTATION])),
        (
            BodyKind3::MasslessNode,
            table("massless-node", "a frame without mass of its own", &[POSITION, ORIENTATION, VELOCITY, OMEGA]),
        ),
        (BodyKind3::Slider, TableKeys { name: "body3", ..slider }),
    ]
});

/// Keys of the parameters of a body.
fn parameters(element: &'static ElementDescriptor) -> Vec<Key> {
    let is_own = |role: Role| role == Role::Parameter;
    grouped_keys(element).into_iter().filter(|(inputs, _)| is_own(inputs[0].role)).map(|(_, key)| key).collect()
}

static COMMON: LazyLock<[Key; 3]> = LazyLock::new(|| {
    let words: Vec<&str> = KINDS.iter().filter_map(|(_, table)| table.kind).collect();
    let kind = default("kind", Accepts::Choice(words.leak()), "rigid", "kind of body");
    [required("name", Accepts::Name, "name, unique in the file"), kind, EACH]
});

const POINT: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file"),
    default("body", Accepts::Name, "ground", "the body that has the point"),
    EACH,
];

/// Declarations for documentation and schema.
pub fn tables() -> Vec<TableKeys> {
    let body = TableKeys { name: "body3", kind: None, about: "bodies and frames", keys: &*COMMON };
    let point = |keys| TableKeys { name: "point3", kind: None, about: "a named point, such as a hardpoint", keys };
    std::iter::once(body)
        .chain(KINDS.iter().map(|(_, table)| *table))
        .chain([point(POINT), point(&MARKER_KEYS[1..])])
        .collect()
}

/// A body in space whose numbers are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct BodySpec3 {
    name: String,
    pub kind: BodyKind3,
    mass: CompiledExpression,
    centre: Vector,
    moments: Vector,
    products: Vector,
    position: PointSpec,
    axes: Axes,
    /// Velocity of the reference point and angular velocity; `None` if they follow from the joints.
    velocities: [Option<Vector>; 2],
}

/// Reads points on the ground, bodies and points of bodies, and enters their names. Returns the bodies with one coordinate and the others.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<(Vec<BodySpec>, Vec<BodySpec3>)> {
    read_points(file, names, parts, true)?;
    let (mut sliders, mut bodies): (Vec<BodySpec>, Vec<BodySpec3>) = (vec![], vec![]);
    file.read_each("body", |table, span| {
        let kinds = KINDS.iter().filter_map(|(kind, table)| Some((table.kind?, (*kind, table.keys))));
        let (kind, keys) = Section::kind(&table, "body", "rigid", kinds)?;
        let section = Section::of(table, span, "body", &[&*COMMON, keys], file.source())?;
        let word = section.need_word("name")?;
        if kind == BodyKind3::Slider {
            parts.add(&word, NamedPart::Slider(sliders.len()))?;
            sliders.push(bodies::body(BodyKind::Slider, &section, names)?);
        } else {
            let body = body(kind, &section, names, parts)?;
            parts.add(&word, NamedPart::Frame(FrameRef::Body(bodies.len())))?;
            if kind == BodyKind3::Point {
                parts.without_rotation.push(bodies.len());
            }
            bodies.push(body);
        }
        Ok(())
    })?;
    Ok((sliders, bodies))
}

fn body(kind: BodyKind3, section: &Section<'_>, names: &Names, parts: &Parts) -> Read<BodySpec3> {
    let (is_rigid, has_axes) = (kind == BodyKind3::Rigid, kind != BodyKind3::Point);
    let vector = |key: &str, has: bool, scope: &Scope| -> Read<Vector> {
        if has { section.vector(key, names, scope) } else { Ok([0.0; 3].map(CompiledExpression::constant)) }
    };
    let given = |key: &str, has: bool| -> Read<Option<Vector>> {
        (has && section.has(key)).then(|| section.vector(key, names, &Scope::MOTION)).transpose()
    };
    let moves = matches!(kind, BodyKind3::Rigid | BodyKind3::Point | BodyKind3::MasslessNode);
    let has_mass = matches!(kind, BodyKind3::Rigid | BodyKind3::Point);
    let position = parts.place(section, "position", names, &Scope::MOTION)?;
    Ok(BodySpec3 {
        name: section.text("name")?,
        kind,
        mass: if has_mass {
            section.expression("mass", names, &Scope::DESIGN)?
        } else {
            CompiledExpression::constant(0.0)
        },
        centre: vector("centre", is_rigid, &Scope::DESIGN)?,
        moments: vector("inertia", is_rigid, &Scope::DESIGN)?,
        products: vector("products", is_rigid, &Scope::DESIGN)?,
        position: position.unwrap_or_else(|| PointSpec::Coordinates([0.0; 3].map(CompiledExpression::constant))),
        axes: if has_axes {
            parts.orientation(section, "orientation", names)?.unwrap_or(Axes::Same)
        } else {
            Axes::Same
        },
        velocities: [given("velocity", moves)?, given("angular_velocity", moves && has_axes)?],
    })
}

impl BodySpec3 {
    /// Adds the body to a mechanism.
    ///
    /// # Errors
    /// If its orientation is not a rotation at this design.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S]) -> Result<()> {
        let world = Pose3::at([S::from(0.0); 3]);
        let pose = Pose3::new(context.place(&world, &self.position, b), context.rotation(&world, &self.axes, b));
        if pose.orientation.parameters().iter().any(|e| !e.re().is_finite()) {
            let why = "its orientation is no rotation: an axis has length zero, or two axes are parallel";
            return Err(Error::definition(
                &self.name,
                why,
                "give directions that have a length and differ at this design",
            ));
        }
        let mass = self.mass.value(&Inputs::design(b));
        let [centre, moments, products] = [&self.centre, &self.moments, &self.products].map(|v| context.numbers(v, b));
        let [velocity, omega] = self.velocities.each_ref().map(|v| v.as_ref().map(|v| context.numbers(v, b)));
        let (name, m) = (self.name.as_str(), &mut context.mechanism);
        let body = match self.kind {
            BodyKind3::Rigid => m.body3(name, MassProperties3 { mass, centre, moments, products }, pose),
            BodyKind3::Point => m.point_mass3(name, mass, pose.position),
            BodyKind3::FixedNode => m.fixed_frame3(name, pose),
            BodyKind3::MasslessNode => m.massless_frame3(name, pose),
            BodyKind3::Slider => unreachable!("sliders are in a list of their own"),
        };
        // Points and fixed nodes have no angular velocity of their own.
        velocity.into_iter().for_each(|velocity| m.set_point_velocity3(body, velocity));
        omega.into_iter().for_each(|omega| m.set_angular_velocity3(body, omega));
        context.bodies3.push(body);
        Ok(())
    }
}

/// Reads the points `[[point]]` of the ground, or those of bodies.
pub fn read_points(file: &Section<'_>, names: &Names, parts: &mut Parts, of_ground: bool) -> Read<()> {
    file.read_each("point", |table, span| {
        let body = table.get("body").and_then(|value| value.get_ref().as_str()).unwrap_or("ground");
        if (body == "ground") != of_ground {
            return Ok(());
        }
        let section = Section::of(table, span, "point", &[POINT, &MARKER_KEYS[1..]], file.source())?;
        let body = section.need_word("body")?;
        let marker = parts.marker_in(&section, parts.frame(&body.text, &body.span)?, names)?;
        parts.add(&section.need_word("name")?, NamedPart::Point(parts.markers.len()))?;
        parts.markers.push(marker);
        Ok(())
    })
    .map(drop)
}
