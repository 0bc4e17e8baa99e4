//! `[[beam]]`: rows of flexible elements.

use super::key::{Accepts, EACH, Key, Table, default, optional, required};
use super::parts::{BuildContext, Frame, Parts, Symbol};
use super::section::{Read, Section};
use crate::model_file::expression::{Inputs, Names, Program, Wants};
use crate::model_file::limits;
use autodiff::Scalar;
use mechanics::elements::{BeamSection, Shear};

const COMMON: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file; its nodes are NAME.first, NAME.2, …, NAME.last"),
    default("kind", Accepts::Choice(&["circular", "rectangular", "section"]), "circular", "its cross-section"),
    required("from", Accepts::Pair, "first end [x, y] of the unloaded beam in m"),
    required("to", Accepts::Pair, "last end [x, y] of the unloaded beam in m"),
    optional("start", Accepts::Name, "body or node whose x and y the first end shares: a pin"),
    optional("end", Accepts::Name, "body or node whose x and y the last end shares: a pin"),
    default("elements", Accepts::Count, "6", "number of equal elements"),
    optional(
        "velocity_from",
        Accepts::Pair,
        "[vx, vy] of the first end at the start in m/s; a guess where joints decide",
    ),
    optional("velocity_to", Accepts::Pair, "[vx, vy] of the last end; linear between the ends"),
    default("spin", Accepts::Expression, "0", "rotation of all nodes at the start, rad/s"),
    default("shear", Accepts::Choice(&["flexible", "rigid", "plain"]), "flexible", "shear stiffness of the elements"),
    EACH,
];
const MATERIAL: &[Key] = &[
    required("young", Accepts::Expression, "Young's modulus in N/m²"),
    default("poisson", Accepts::Expression, "0.3", "Poisson's ratio"),
    required("density", Accepts::Expression, "kg/m³"),
    optional("inertia", Accepts::Expression, "rotary inertia per length in kg·m, in place of density × second moment"),
];
const CIRCULAR: &[Key] = &[required("diameter", Accepts::Expression, "of the solid round section in m")];
const RECTANGULAR: &[Key] = &[
    required("width", Accepts::Expression, "across the plane, m"),
    required("height", Accepts::Expression, "in the plane, m"),
];
const SECTION: &[Key] = &[
    required("axial", Accepts::Expression, "EA in N"),
    required("transverse", Accepts::Expression, "G A_s in N"),
    required("bending", Accepts::Expression, "EI in N·m²"),
    required("mass", Accepts::Expression, "per length, kg/m"),
    required("inertia", Accepts::Expression, "rotary inertia per length, kg·m"),
];

/// Declarations for documentation and schema.
pub const TABLES: &[Table] = &[
    Table { name: "beam", kind: None, about: "a straight flexible beam", keys: COMMON },
    Table { name: "beam", kind: Some("circular"), about: "a solid round bar", keys: CIRCULAR },
    Table { name: "beam", kind: Some("circular"), about: "a solid round bar", keys: MATERIAL },
    Table { name: "beam", kind: Some("rectangular"), about: "a solid rectangular bar", keys: RECTANGULAR },
    Table { name: "beam", kind: Some("rectangular"), about: "a solid rectangular bar", keys: MATERIAL },
    Table { name: "beam", kind: Some("section"), about: "any section by its stiffness and mass", keys: SECTION },
];

#[derive(Clone, Copy, Debug)]
enum Kind {
    Circular,
    Rectangular,
    Section,
}

/// A kind with its name, the keys of its shape, and those of its material.
type KindKeys = (&'static str, (Kind, &'static [Key], &'static [Key]));

const KINDS: [KindKeys; 3] = [
    ("circular", (Kind::Circular, CIRCULAR, MATERIAL)),
    ("rectangular", (Kind::Rectangular, RECTANGULAR, MATERIAL)),
    ("section", (Kind::Section, SECTION, &[])),
];

/// A beam with its numbers as programs of the design.
#[derive(Clone, Debug)]
pub struct Beam {
    name: String,
    kind: Kind,
    from: [Program; 2],
    to: [Program; 2],
    pub ends: [Option<Frame>; 2],
    pub elements: usize,
    shear: Shear,
    /// Diameter; width and height; or the five numbers of a section.
    shape: Vec<Program>,
    /// E, ν and ρ.
    material: Vec<Program>,
    inertia: Option<Program>,
    /// Of the ends at the start, with the spin of all nodes, if any is given.
    velocity: Option<([[Program; 2]; 2], Program)>,
}

/// Reads the beams and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<Beam>> {
    let (mut beams, mut all) = (vec![], 0);
    file.read_each("beam", |table, span| {
        let (kind, shape, material) =
            Section::kind(&table, "beam", "circular", KINDS.iter().map(|(name, kind)| (*name, *kind)))?;
        let section = Section::of(table, span, "beam", &[COMMON, shape, material], file.source())?;
        let beam = beam(kind, (shape, material), &section, names, parts)?;
        all += beam.elements;
        if all > limits::ALL_ELEMENTS {
            let message = format!("all beams together have more than {} elements", limits::ALL_ELEMENTS);
            return Err(section.error_at("elements", message));
        }
        parts.add(&section.need_word("name")?, Symbol::Beam(beams.len(), beam.elements))?;
        beams.push(beam);
        Ok(())
    })?;
    Ok(beams)
}

fn beam(
    kind: Kind,
    (shape, material): (&[Key], &[Key]),
    section: &Section<'_>,
    names: &Names,
    parts: &Parts,
) -> Read<Beam> {
    let program = |key: &Key| section.program(key.name, names, &Wants::DESIGN);
    let end = |key: &str| -> Read<Option<Frame>> {
        section.word(key)?.map(|word| parts.frame(&word.text, &word.span)).transpose()
    };
    let elements = section.count("elements", limits::ELEMENTS)?.unwrap_or(6);
    if elements == 0 {
        return Err(section.error_at("elements", "a beam needs at least one element"));
    }
    let shears = [("flexible", Shear::Flexible), ("rigid", Shear::Rigid), ("plain", Shear::Plain)];
    let own_inertia = !material.is_empty() && section.has("inertia");
    let moves = ["velocity_from", "velocity_to", "spin"].iter().any(|key| section.has(key));
    let velocity = |key: &str| section.pair(key, names, &Wants::DESIGN);
    Ok(Beam {
        name: section.text("name")?,
        kind,
        from: section.pair("from", names, &Wants::DESIGN)?,
        to: section.pair("to", names, &Wants::DESIGN)?,
        ends: [end("start")?, end("end")?],
        elements,
        shear: section.choice("shear", &shears)?,
        shape: shape.iter().map(program).collect::<Read<_>>()?,
        material: material.iter().take(3).map(program).collect::<Read<_>>()?,
        velocity: match moves {
            true => Some((
                [velocity("velocity_from")?, velocity("velocity_to")?],
                section.program("spin", names, &Wants::DESIGN)?,
            )),
            false => None,
        },
        inertia: own_inertia.then(|| section.program("inertia", names, &Wants::DESIGN)).transpose()?,
    })
}

impl Beam {
    /// Adds the beam to a mechanism.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S]) {
        let value = |program: &Program| program.value(&Inputs::design(b));
        let ends = self.ends.map(|end| end.map(|frame| context.frame(frame)));
        let span = [self.from.each_ref().map(value), self.to.each_ref().map(value)];
        let beam = context.mechanism.beam(&self.name, span, ends, self.elements, &self.section(value), self.shear);
        if let Some((ends, spin)) = &self.velocity {
            let ([from, to], spin) = (ends.each_ref().map(|end| end.each_ref().map(value)), value(spin));
            for (k, node) in beam.0.iter().enumerate() {
                let share = k as f64 / self.elements as f64;
                let between = |c: usize| from[c] * (1.0 - share) + to[c] * share;
                context.mechanism.set_velocity(node.x, between(0));
                context.mechanism.set_velocity(node.y, between(1));
                context.mechanism.set_velocity(node.theta, spin);
            }
        }
        context.beams.push(beam);
    }

    fn section<S: Scalar>(&self, value: impl Fn(&Program) -> S) -> BeamSection<S> {
        let shape: Vec<S> = self.shape.iter().map(&value).collect();
        // The geometry, for a material of unit modulus and density.
        let unit = match self.kind {
            Kind::Circular => BeamSection::circular(shape[0], 1.0, 0.0, 1.0),
            Kind::Rectangular => BeamSection::rectangular(shape[0], shape[1], 1.0, 0.0, 1.0),
            Kind::Section => {
                let [axial, shear, bending, mass, inertia] = [0, 1, 2, 3, 4].map(|k: usize| shape[k]);
                return BeamSection { axial, shear, bending, mass, inertia };
            }
        };
        let [young, poisson, density] = [0, 1, 2].map(|k: usize| value(&self.material[k]));
        BeamSection {
            axial: unit.axial * young,
            shear: unit.shear * young / (poisson + 1.0),
            bending: unit.bending * young,
            mass: unit.mass * density,
            inertia: self.inertia.as_ref().map_or(unit.inertia * density, value),
        }
    }
}
