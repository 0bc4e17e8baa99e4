//! `[[joint]]`, `[[driver]]` and `[[force]]`.

use super::element_kinds::{FileElementKind, KindSection, sections, shared_keys};
use super::element_spec::{ElementSpec, InputSpec};
use super::feedback;
use super::joint_checks;
use super::key::{Accepts, Key};
use super::motion;
use super::parts::{CoordinateRef, FrameRef, JointCoordinate, NamedPart, Parts};
use super::section::{Read, Section};
use crate::model_file::Diagnostic;
use crate::model_file::expression::{Names, Scope};
use mechanics::elements::{Family, Role};
use toml::de::DeTable;

/// Reads joints, drives and forces in this order and enters their names.
pub fn read(file: &Section<'_>, names: &Names, parts: &mut Parts) -> Read<Vec<ElementSpec>> {
    let (mut all, mut drives) = (vec![], DrivenCoordinates::default());
    for (section, other) in sections(parts.is_spatial).iter().zip(sections(!parts.is_spatial)) {
        file.read_each(section.name, |table, span| {
            let kinds = section.kinds.iter().map(|(kind, keys)| (kind.descriptor.kind, (kind, *keys)));
            let chosen = Section::kind(&table, section.name, section.usual, kinds);
            let (kind, keys) = chosen.map_err(|error| of_other_space(error, &table, other, parts.is_spatial))?;
            let section = Section::of(table, span, section.name, &[section.common, keys], file.source())?;
            let symbol = NamedPart::Element(all.len(), kind.descriptor);
            let element = element(kind, keys, &section, names, parts)?;
            joint_checks::check(&element, &section, parts)?;
            drives.check(&element, &section)?;
            all.push(element);
            parts.add(&section.need_word("name")?, symbol)
        })?;
    }
    Ok(all)
}

/// The error about an unknown kind, with the remedy if the kind exists in mechanisms of the other dimension.
fn of_other_space(error: Diagnostic, table: &DeTable<'_>, other: &KindSection, is_spatial: bool) -> Diagnostic {
    let kind = table.get("kind").and_then(|kind| kind.get_ref().as_str());
    if !other.kinds.iter().any(|(known, _)| Some(known.descriptor.kind) == kind) {
        return error;
    }
    error.help(if is_spatial {
        "this kind is one of planar mechanisms, and the file has `space = 3`"
    } else {
        "this kind is one of mechanisms in space: write `space = 3` at the top of the file"
    })
}

/// Coordinates, or differences of coordinates, whose motion is prescribed, with the names of their drivers.
#[derive(Default)]
struct DrivenCoordinates(Vec<(Vec<CoordinateRef>, String)>);

impl DrivenCoordinates {
    /// Adds a driver of coordinates; other elements are ignored.
    ///
    /// # Errors
    /// If another driver prescribes the same motion, or if the driver acts on the ground alone.
    fn check(&mut self, element: &ElementSpec, section: &Section<'_>) -> Read<()> {
        let is_drive = element.kind.descriptor.family == Family::Drive;
        let place = |input: &InputSpec| match input {
            InputSpec::Coordinate(place) => Some(*place),
            _ => None,
        };
        let all: Vec<CoordinateRef> = element.inputs.iter().filter_map(place).collect();
        if !is_drive || all.is_empty() {
            return Ok(());
        }
        let key = element.kind.descriptor.inputs.iter().rfind(|input| input.role == Role::Coordinate);
        let key = key.map_or("name", |input| input.name);
        // The ground is at rest: a motion against it is that of the other coordinate.
        let is_moving = |place: &CoordinateRef| !matches!(place, CoordinateRef::Of(FrameRef::Ground, _));
        let moving: Vec<CoordinateRef> = all.into_iter().filter(is_moving).collect();
        if moving.is_empty() {
            return Err(section.error_at(key, "the ground cannot be driven").help("drive a coordinate of a body"));
        }
        let is_same = |other: &Vec<CoordinateRef>| {
            other.len() == moving.len() && moving.iter().all(|place| other.contains(place))
        };
        if let Some((_, first)) = self.0.iter().find(|(other, _)| is_same(other)) {
            let message =
                format!("the motion of this coordinate is prescribed twice, by `{first}` and `{}`", element.name);
            return Err(section.error_at(key, message).help("remove one of the two drivers"));
        }
        self.0.push((moving, element.name.clone()));
        Ok(())
    }
}

fn element(
    kind: &'static FileElementKind,
    keys: &[Key],
    section: &Section<'_>,
    names: &Names,
    parts: &Parts,
) -> Read<ElementSpec> {
    let shared = shared_keys(kind.descriptor);
    let input = |(role, key): (Role, &Key)| -> Read<InputSpec> {
        Ok(match role {
            Role::Marker | Role::Body | Role::Translations => InputSpec::Point(parts.point(section, key.name, names)?),
            Role::Marker3 | Role::Body3 | Role::Translations3 => {
                InputSpec::Marker(Box::new(parts.marker(section, key.name, names, shared)?))
            }
            Role::Coordinate => InputSpec::Coordinate(parts.coordinate(section, key.name)?),
            Role::Profile => InputSpec::Profile(section.pairs(key.name, names, &Scope::DESIGN)?),
            Role::Joint(kinds) => InputSpec::Joint(parts.joint(section, key.name, kinds)?),
            Role::Parameter | Role::Gravity => {
                InputSpec::Number(section.expression(key.name, names, &Scope::DESIGN)?)
            }
            Role::TimeFunction => InputSpec::Time(motion::read(section, key.name, names)?),
            Role::StateFunction => InputSpec::State(feedback::read(section, key.name, names, parts)?),
        })
    };
    let own = kind.descriptor.inputs.len() - usize::from(JointCoordinate::of_element(kind.descriptor).is_some());
    let (mut rest, mut inputs) = (&kind.descriptor.inputs[..own], vec![]);
    for key in keys {
        let Some(first) = rest.first() else { break };
        if key.accepts == Accepts::Triple {
            inputs.extend(section.triple(key.name, names, &Scope::DESIGN)?.map(InputSpec::Number));
            rest = &rest[3..];
        } else {
            inputs.push(input((first.role, key))?);
            rest = &rest[1..];
        }
    }
    Ok(ElementSpec { name: section.text("name")?, kind, inputs })
}
