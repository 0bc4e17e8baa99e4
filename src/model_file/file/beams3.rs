//! `[[beam]]` in space: rows of flexible elements.

use super::beams::poissons_ratio;
use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::parts::{BuildContext, FrameRef, NamedPart, Parts, PointSpec, Vector};
use super::section::{Read, Section};
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use crate::model_file::limits;
use autodiff::Scalar;
use mechanics::elements::Shear;
use mechanics::elements::spatial::BeamSection3;
use mechanics::mechanism::{Body3, Pose3};

const COMMON: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file; its nodes are NAME.first, NAME.2, …, NAME.last"),
    default("kind", Accepts::Choice(&["circular", "rectangular"]), "circular", "cross-section"),
    required("from", Accepts::Place, "first end [x, y, z] of the unloaded beam in m, or a point").of("m"),
    required("to", Accepts::Place, "last end [x, y, z] of the unloaded beam in m, or a point").of("m"),
    optional(
        "up",
        Accepts::Triple,
        "direction in world axes near which the axis z of the sections is; by default [0, 0, 1], or [1, 0, 0] for a vertical beam",
    ),
    optional("start", Accepts::Name, "body or node to which the first end is fixed"),
    optional("end", Accepts::Name, "body or node to which the last end is fixed"),
    default(
        "elements",
        Accepts::Count,
        "6",
        "number of equal elements; errors, such as those of natural frequencies, fall with its square",
    ),
    default(
        "shear",
        Accepts::Choice(&["flexible", "rigid", "plain", "cubic"]),
        "flexible",
        "shear stiffness of the elements; `cubic` for a beam under a tension above 12 EI/ℓ² with the length ℓ of an element",
    ),
    required("young", Accepts::Expression, "Young's modulus in N/m²").of("N/m²"),
    default("poisson", Accepts::Expression, "0.3", "Poisson's ratio"),
    required("density", Accepts::Expression, "density, kg/m³").of("kg/m³"),
    EACH,
];
const CIRCULAR: &[Key] = &[required("diameter", Accepts::Expression, "diameter in m").of("m")];
const RECTANGULAR: &[Key] = &[
    required("width", Accepts::Expression, "length of the section along y, m").of("m"),
    required("height", Accepts::Expression, "length of the section along z, m").of("m"),
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys {
        name: "beam3",
        kind: None,
        about: "a flexible beam, straight without load, with its axis along x of its nodes",
        keys: COMMON,
    },
    TableKeys {
        name: "beam3",
        kind: Some("circular"),
        about: "a solid round bar: shear area 0.9 A, torsion constant π d⁴/32",
        keys: CIRCULAR,
    },
    TableKeys {
        name: "beam3",
        kind: Some("rectangular"),
        about: "a solid rectangular bar: shear area 5/6 A, torsion constant a b³ (1/3 − 0.21 (b/a) (1 − b⁴/(12 a⁴))) of its longer side a and its shorter one b",
        keys: RECTANGULAR,
    },
];

/// A beam in space whose numbers are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct BeamSpec3 {
    name: String,
    ends: [PointSpec; 2],
    up: Option<Vector>,
    fixed_to: [Option<FrameRef>; 2],
    pub elements: usize,
    shear: Shear,
    /// Diameter; or width and height.
    shape: Vec<CompiledExpression>,
    /// Young's modulus, Poisson's ratio and density.
    material: [CompiledExpression; 3],
}

/// Reads the beams and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<BeamSpec3>> {
    let (mut beams, mut all) = (vec![], 0);
    file.read_each("beam", |table, span| {
        let kinds = [("circular", CIRCULAR), ("rectangular", RECTANGULAR)];
        let shape = Section::kind(&table, "beam", "circular", kinds.into_iter())?;
        let section = Section::of(table, span, "beam", &[COMMON, shape], file.source())?;
        let beam = beam(shape, &section, names, parts)?;
        all += beam.elements;
        if all > limits::ALL_ELEMENTS {
            let message = format!("all beams together have more than {} elements", limits::ALL_ELEMENTS);
            return Err(section.error_at("elements", message));
        }
        parts.add(&section.need_word("name")?, NamedPart::Beam(beams.len(), beam.elements))?;
        beams.push(beam);
        Ok(())
    })?;
    Ok(beams)
}

fn beam(shape: &[Key], section: &Section<'_>, names: &Names, parts: &Parts) -> Read<BeamSpec3> {
    let expression = |key: &str| section.expression(key, names, &Scope::DESIGN);
    let place = |key: &str| Ok(parts.place(section, key, names, &Scope::DESIGN)?.expect("the key is required"));
    let end = |key: &str| -> Read<Option<FrameRef>> {
        section.word(key)?.map(|word| parts.frame(&word.text, &word.span)).transpose()
    };
    let elements = section.count("elements", limits::ELEMENTS)?.unwrap_or(6);
    if elements == 0 {
        return Err(section.error_at("elements", "a beam needs at least one element"));
    }
    let shears =
        [("flexible", Shear::Flexible), ("rigid", Shear::Rigid), ("plain", Shear::Plain), ("cubic", Shear::Cubic)];
    let up = section.has("up").then(|| section.vector("up", names, &Scope::DESIGN)).transpose()?;
    Ok(BeamSpec3 {
        name: section.text("name")?,
        ends: [place("from")?, place("to")?],
        up,
        fixed_to: [end("start")?, end("end")?],
        elements,
        shear: section.choice("shear", &shears)?,
        shape: shape.iter().map(|key| expression(key.name)).collect::<Read<_>>()?,
        material: [expression("young")?, poissons_ratio(section, names)?, expression("density")?],
    })
}

/// Relative distance below which a reference point is at the end of a beam; for coordinates below 1 m it is in m.
const AT_END: f64 = 1e-9;

/// Sine of the angle between a beam and z of the world below which the beam counts as vertical.
const VERTICAL: f64 = 1e-6;

/// The direction near which the axis z of the sections of a beam is by default: upwards, or along x if the beam is vertical.
fn default_up<S: Scalar>(from: [S; 3], to: [S; 3]) -> [S; 3] {
    let [x, y, z] = [0, 1, 2].map(|k| (to[k] - from[k]).re());
    let is_vertical = x.hypot(y) <= VERTICAL * z.abs();
    (if is_vertical { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] }).map(S::from)
}

impl BeamSpec3 {
    /// Adds the beam to a mechanism.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S]) {
        let world = Pose3::at([S::from(0.0); 3]);
        let [from, to] = self.ends.each_ref().map(|end| context.place(&world, end, b));
        let bodies = self.fixed_to.map(|end| end.map(|frame| context.frame3(frame)));
        // A body whose reference point is elsewhere is fixed to a separate node at the end of the beam.
        let is_at = |body: &Body3, end: [S; 3]| {
            let reference = context.mechanism.pose3(*body).position;
            (0..3).all(|c| (reference[c].re() - end[c].re()).abs() <= AT_END * (1.0 + end[c].re().abs()))
        };
        let ends: [Option<Body3>; 2] = std::array::from_fn(|k| bodies[k].filter(|body| is_at(body, [from, to][k])));
        let up = match &self.up {
            Some(up) => context.numbers(up, b),
            None => default_up(from, to),
        };
        let points: Vec<[S; 3]> = (0..=self.elements)
            .map(|k| {
                let share = k as f64 / self.elements as f64;
                [0, 1, 2].map(|c| from[c] * (1.0 - share) + to[c] * share)
            })
            .collect();
        let section = self.section(|expression: &CompiledExpression| expression.value(&Inputs::design(b)));
        let beam = context.mechanism.beam3(&self.name, &points, up, ends, &section, self.shear);
        for (k, name) in ["start", "end"].into_iter().enumerate() {
            if let (Some(body), None) = (bodies[k], ends[k]) {
                let node = if k == 0 { beam.0[0] } else { beam.0[self.elements] };
                let place = context.mechanism.marker_on(body, context.mechanism.pose3(node));
                context.mechanism.fixed_joint3(&format!("{}.{name}", self.name), place, node.origin());
            }
        }
        context.beams3.push(beam);
    }

    fn section<S: Scalar>(&self, value: impl Fn(&CompiledExpression) -> S) -> BeamSection3<S> {
        let [young, poisson, density] = self.material.each_ref().map(&value);
        // The geometry, for a material of unit modulus and density with the shear modulus ½.
        let unit = match self.shape.as_slice() {
            [diameter] => BeamSection3::circular(value(diameter), 1.0, 0.0, 1.0),
            shape => BeamSection3::rectangular([value(&shape[0]), value(&shape[1])], 1.0, 0.0, 1.0),
        };
        let shear = young / (poisson + 1.0);
        BeamSection3 {
            axial: unit.axial * young,
            shear: unit.shear.map(|x| x * shear),
            torsion: unit.torsion * shear,
            bending: unit.bending.map(|x| x * young),
            mass: unit.mass * density,
            inertia: unit.inertia.map(|x| x * density),
        }
    }
}
