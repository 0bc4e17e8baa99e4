//! `[[beam]]`: rows of flexible elements.

use super::key::{Accepts, EACH, Key, TableKeys, default, optional, required};
use super::motion::{self, TimeFunction};
use super::parts::{BuildContext, FrameRef, NamedPart, Parts};
use super::section::{Read, Section};
use crate::model_file::expression::{CompiledExpression, Inputs, Names, Scope};
use crate::model_file::limits;
use autodiff::Scalar;
use mechanics::elements::{BeamSection, BeamShape, Shear};
use std::f64::consts::FRAC_PI_2;

const COMMON: &[Key] = &[
    required("name", Accepts::Name, "name, unique in the file; its nodes are NAME.first, NAME.2, …, NAME.last"),
    default("kind", Accepts::Choice(&["circular", "rectangular", "section"]), "circular", "cross-section"),
    required("from", Accepts::Pair, "first end [x, y] of the unloaded beam in m").of("m"),
    required("to", Accepts::Pair, "last end [x, y] of the unloaded beam in m").of("m"),
    default("rise", Accepts::Expression, "0", "height of the unloaded beam, an arc, above the middle between its ends, positive to the left of the direction from the first end to the last one, m").of("m"),
    default("tension", Accepts::Expression, "0", "normal force at the unloaded length, a prestress, N").of("N"),
    optional("start", Accepts::Name, "body or node whose x and y the first end shares: a pin"),
    optional("end", Accepts::Name, "body or node whose x and y the last end shares: a pin"),
    default(
        "elements",
        Accepts::Count,
        "6",
        "number of equal elements; errors, such as those of natural frequencies, fall with its square",
    ),
    optional(
        "velocity_from",
        Accepts::Pair,
        "initial velocity [vx, vy] of the first end in m/s, zero if only that of the last end is given; without both, they follow from joints",
    )
    .of("m/s"),
    optional("velocity_to", Accepts::Pair, "initial velocity [vx, vy] of the last end; linear between the ends")
        .of("m/s"),
    optional("spin", Accepts::Expression, "initial angular velocity of all nodes, rad/s; without it, it follows from joints").of("rad/s"),
    default(
        "shear",
        Accepts::Choice(&["flexible", "rigid", "plain", "cubic"]),
        "flexible",
        "shear stiffness of the elements; `cubic` for a beam under a tension above 12 EI/ℓ² with the length ℓ of an element",
    ),
    optional("load_x", Accepts::Motion, "distributed load along x of the plane per unloaded length, N/m").of("N/m"),
    optional("load_y", Accepts::Motion, "distributed load along y of the plane per unloaded length, N/m").of("N/m"),
    EACH,
];
const MATERIAL: &[Key] = &[
    required("young", Accepts::Expression, "Young's modulus in N/m²").of("N/m²"),
    default("poisson", Accepts::Expression, "0.3", "Poisson's ratio"),
    required("density", Accepts::Expression, "density, kg/m³").of("kg/m³"),
    optional("inertia", Accepts::Expression, "rotary inertia per length in kg·m, in place of density × second moment")
        .of("kg·m"),
];
const CIRCULAR: &[Key] = &[required("diameter", Accepts::Expression, "diameter in m").of("m")];
const RECTANGULAR: &[Key] = &[
    required("width", Accepts::Expression, "width perpendicular to the plane, m").of("m"),
    required("height", Accepts::Expression, "height in the plane, m").of("m"),
];
const SECTION: &[Key] = &[
    required("axial", Accepts::Expression, "axial stiffness EA, N").of("N"),
    required("transverse", Accepts::Expression, "shear stiffness G A_s, N").of("N"),
    required("bending", Accepts::Expression, "bending stiffness EI, N·m²").of("N·m²"),
    required("mass", Accepts::Expression, "mass per length, kg/m").of("kg/m"),
    required("inertia", Accepts::Expression, "rotary inertia per length, kg·m").of("kg·m"),
];

/// Declarations for documentation and schema.
pub const TABLES: &[TableKeys] = &[
    TableKeys {
        name: "beam",
        kind: None,
        about: "a flexible beam, straight or an arc without load; `theta` of a node is the angle of the axis there, in the direction from the first \
                end to the last one, so that a `fixed` joint to a body at another angle needs `angle`",
        keys: COMMON,
    },
    TableKeys { name: "beam", kind: Some("circular"), about: "a solid round bar", keys: CIRCULAR },
    TableKeys { name: "beam", kind: Some("circular"), about: "a solid round bar", keys: MATERIAL },
    TableKeys { name: "beam", kind: Some("rectangular"), about: "a solid rectangular bar", keys: RECTANGULAR },
    TableKeys { name: "beam", kind: Some("rectangular"), about: "a solid rectangular bar", keys: MATERIAL },
    TableKeys { name: "beam", kind: Some("section"), about: "any section by its stiffness and mass", keys: SECTION },
];

/// Reads Poisson's ratio, if the kind of beam has it.
///
/// # Errors
/// If it is a number for which a shear modulus or a bulk modulus would be negative.
pub fn poissons_ratio(section: &Section<'_>, names: &Names) -> Read<CompiledExpression> {
    let ratio = section.expression("poisson", names, &Scope::DESIGN)?;
    match ratio.as_constant() {
        Some(number) if !(number > -1.0 && number <= 0.5) => {
            let message = format!("Poisson's ratio is {number}; it must be above -1 and at most 0.5");
            Err(section.error_at("poisson", message).help("steel and aluminium have about 0.3, rubber almost 0.5"))
        }
        _ => Ok(ratio),
    }
}

#[derive(Clone, Copy, Debug)]
enum CrossSection {
    Circular,
    Rectangular,
    Section,
}

/// Name of a cross-section, keys of its shape and of its material.
type KindKeys = (&'static str, (CrossSection, &'static [Key], &'static [Key]));

const KINDS: [KindKeys; 3] = [
    ("circular", (CrossSection::Circular, CIRCULAR, MATERIAL)),
    ("rectangular", (CrossSection::Rectangular, RECTANGULAR, MATERIAL)),
    ("section", (CrossSection::Section, SECTION, &[])),
];

/// A beam whose numbers are expressions of the design variables.
#[derive(Clone, Debug)]
pub struct BeamSpec {
    name: String,
    kind: CrossSection,
    from: [CompiledExpression; 2],
    to: [CompiledExpression; 2],
    /// Rise of the unloaded arc, and initial normal force.
    own: [CompiledExpression; 2],
    pub ends: [Option<FrameRef>; 2],
    pub elements: usize,
    shear: Shear,
    /// Diameter; width and height; or stiffnesses and masses per length.
    shape: Vec<CompiledExpression>,
    /// Young's modulus, Poisson's ratio and density.
    material: Vec<CompiledExpression>,
    inertia: Option<CompiledExpression>,
    /// Initial velocities of both ends; `None` if they follow from the joints.
    velocity: Option<[[CompiledExpression; 2]; 2]>,
    /// Initial angular velocity of all nodes; `None` if it follows from the joints.
    spin: Option<CompiledExpression>,
    /// Distributed loads with their directions in rad.
    loads: Vec<(f64, TimeFunction)>,
}

/// Reads the beams and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<BeamSpec>> {
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
        parts.add(&section.need_word("name")?, NamedPart::Beam(beams.len(), beam.elements))?;
        beams.push(beam);
        Ok(())
    })?;
    Ok(beams)
}

fn beam(
    kind: CrossSection,
    (shape, material): (&[Key], &[Key]),
    section: &Section<'_>,
    names: &Names,
    parts: &Parts,
) -> Read<BeamSpec> {
    let expression = |key: &Key| match key.name {
        "poisson" => poissons_ratio(section, names),
        name => section.expression(name, names, &Scope::DESIGN),
    };
    let end = |key: &str| -> Read<Option<FrameRef>> {
        section.word(key)?.map(|word| parts.frame(&word.text, &word.span)).transpose()
    };
    let elements = section.count("elements", limits::ELEMENTS)?.unwrap_or(6);
    if elements == 0 {
        return Err(section.error_at("elements", "a beam needs at least one element"));
    }
    let shears =
        [("flexible", Shear::Flexible), ("rigid", Shear::Rigid), ("plain", Shear::Plain), ("cubic", Shear::Cubic)];
    let own_inertia = !material.is_empty() && section.has("inertia");
    let moves = ["velocity_from", "velocity_to"].iter().any(|key| section.has(key));
    let velocity = |key: &str| section.vector(key, names, &Scope::DESIGN);
    let loads = [("load_x", 0.0), ("load_y", FRAC_PI_2)].into_iter().filter(|(key, _)| section.has(key));
    let load = |(key, direction): (&str, f64)| Ok((direction, motion::read(section, key, names)?));
    Ok(BeamSpec {
        name: section.text("name")?,
        kind,
        from: section.vector("from", names, &Scope::DESIGN)?,
        to: section.vector("to", names, &Scope::DESIGN)?,
        own: [
            section.expression("rise", names, &Scope::DESIGN)?,
            section.expression("tension", names, &Scope::DESIGN)?,
        ],
        ends: [end("start")?, end("end")?],
        elements,
        shear: section.choice("shear", &shears)?,
        shape: shape.iter().map(expression).collect::<Read<_>>()?,
        material: material.iter().take(3).map(expression).collect::<Read<_>>()?,
        velocity: match moves {
            true => Some([velocity("velocity_from")?, velocity("velocity_to")?]),
            false => None,
        },
        spin: section.has("spin").then(|| section.expression("spin", names, &Scope::DESIGN)).transpose()?,
        loads: loads.map(load).collect::<Read<_>>()?,
        inertia: own_inertia.then(|| section.expression("inertia", names, &Scope::DESIGN)).transpose()?,
    })
}

impl BeamSpec {
    /// Directions of the distributed loads in rad.
    #[cfg(feature = "report")]
    pub fn load_directions(&self) -> impl Iterator<Item = f64> {
        self.loads.iter().map(|(direction, _)| *direction)
    }

    /// Adds the beam to a mechanism.
    pub fn build<S: Scalar>(&self, context: &mut BuildContext<S>, b: &[S]) {
        let value = |expression: &CompiledExpression| expression.value(&Inputs::design(b));
        let ends = self.ends.map(|end| end.map(|frame| context.frame(frame)));
        let span = [self.from.each_ref().map(value), self.to.each_ref().map(value)];
        let [rise, tension] = self.own.each_ref().map(value);
        let shape = BeamShape { span, rise, tension };
        let (section, length) = (self.section(value), shape.element_length(self.elements));
        let beam = context.mechanism.curved_beam(&self.name, shape, ends, self.elements, &section, self.shear);
        for (direction, load) in &self.loads {
            let parameters: Vec<S> = load.parameters.iter().map(value).collect();
            for (k, nodes) in beam.0.windows(2).enumerate() {
                let name = format!("{} load on element {}", self.name, k + 1);
                let (nodes, geometry) = ([nodes[0], nodes[1]], [length, S::from(*direction)]);
                context.mechanism.line_load(&name, nodes, geometry, load.law.clone(), &parameters);
            }
        }
        if let Some(ends) = &self.velocity {
            let [from, to] = ends.each_ref().map(|end| end.each_ref().map(value));
            for (k, node) in beam.0.iter().enumerate() {
                let share = k as f64 / self.elements as f64;
                let between = |c: usize| from[c] * (1.0 - share) + to[c] * share;
                context.mechanism.set_velocity(node.x, between(0));
                context.mechanism.set_velocity(node.y, between(1));
            }
        }
        for spin in self.spin.iter().map(value) {
            beam.0.iter().for_each(|node| context.mechanism.set_velocity(node.theta, spin));
        }
        context.beams.push(beam);
    }

    /// True unless the cross-section is given by stiffnesses.
    #[cfg(feature = "report")]
    pub fn has_known_section(&self) -> bool {
        !matches!(self.kind, CrossSection::Section)
    }

    /// Half the thickness in the plane, area and section modulus; `None` if the cross-section is given by stiffnesses, or has no thickness.
    #[cfg(feature = "report")]
    pub fn extremes(&self, design: &[f64]) -> Option<[f64; 3]> {
        let shape: Vec<f64> = self.shape.iter().map(|expression| expression.value(&Inputs::design(design))).collect();
        let (unit, half) = match self.kind {
            CrossSection::Circular => (BeamSection::circular(shape[0], 1.0, 0.0, 1.0), 0.5 * shape[0]),
            CrossSection::Rectangular => (BeamSection::rectangular(shape[0], shape[1], 1.0, 0.0, 1.0), 0.5 * shape[1]),
            CrossSection::Section => return None,
        };
        // With a unit modulus the stiffnesses are area and second moment of area.
        (half > 0.0).then(|| [half, unit.axial, unit.bending / half])
    }

    fn section<S: Scalar>(&self, value: impl Fn(&CompiledExpression) -> S) -> BeamSection<S> {
        let shape: Vec<S> = self.shape.iter().map(&value).collect();
        // The geometry, for a material of unit modulus and density.
        let unit = match self.kind {
            CrossSection::Circular => BeamSection::circular(shape[0], 1.0, 0.0, 1.0),
            CrossSection::Rectangular => BeamSection::rectangular(shape[0], shape[1], 1.0, 0.0, 1.0),
            CrossSection::Section => {
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
