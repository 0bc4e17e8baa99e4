//! Kinds of joints, drives and forces of model files, generated from the descriptors of the elements.

use super::feedback::ObservedFormula;
use super::key::{Accepts, EACH, Key, Need, TableKeys, default, required};
use super::motion::MotionLaw;
use mechanics::elements::{self, ElementDescriptor, ElementKind, Family, Input, Role};
use std::sync::LazyLock;

/// A kind of element whose functions of time and state come from model files.
pub type FileElementKind = ElementKind<MotionLaw, ObservedFormula>;

/// A section of the file, such as `[[joint]]`, with its kinds.
pub struct KindSection {
    pub name: &'static str,
    about: &'static str,
    /// The kind of a table without the key `kind`; empty if the key is required.
    pub usual: &'static str,
    /// Keys of all kinds.
    pub common: &'static [Key],
    pub kinds: Vec<(FileElementKind, &'static [Key])>,
}

/// Sections of elements, in the order in which they are read.
pub static SECTIONS: LazyLock<[KindSection; 3]> = LazyLock::new(|| {
    [
        KindSection::new("joint", "joints between bodies", "revolute"),
        KindSection::new("driver", "prescribed motions", "coordinate"),
        KindSection::new("force", "forces, contacts and additional inertia", ""),
    ]
});

impl KindSection {
    /// The section with all elements that belong to it.
    ///
    /// Its keys and texts are leaked: they live as long as the program, as constants do.
    fn new(name: &'static str, about: &'static str, usual: &'static str) -> Self {
        let mut kinds = elements::kinds();
        kinds.retain(|kind: &FileElementKind| section_of(kind.descriptor) == name);
        let words: Vec<&str> = kinds.iter().map(|kind| kind.descriptor.kind).collect();
        let accepts = Accepts::Choice(words.leak());
        let about_kind = format!("kind of {name}").leak();
        let kind = match usual {
            "" => required("kind", accepts, about_kind),
            _ => default("kind", accepts, usual, about_kind),
        };
        let common = vec![required("name", Accepts::Name, "name, unique in the file"), kind, EACH].leak();
        let with_keys = |kind: FileElementKind| {
            let keys: &[Key] = kind.descriptor.inputs.iter().map(key).collect::<Vec<_>>().leak();
            (kind, keys)
        };
        Self { name, about, usual, common, kinds: kinds.into_iter().map(with_keys).collect() }
    }
}

/// The section of a file in which an element is declared.
fn section_of(descriptor: &ElementDescriptor) -> &'static str {
    match descriptor.family {
        Family::Joint => "joint",
        Family::Drive => "driver",
        Family::Force | Family::Contact | Family::Body => "force",
        Family::Beam => "beam",
        Family::Sensor => "output",
    }
}

/// Keys of the parameters of an element.
///
/// Their texts are leaked and live as long as the program.
pub fn parameter_keys(descriptor: &ElementDescriptor) -> Vec<Key> {
    descriptor.inputs.iter().filter(|input| input.role == Role::Parameter).map(key).collect()
}

/// The key of an input.
fn key(input: &Input) -> Key {
    let accepts = match input.role {
        Role::Marker | Role::Body | Role::Translations | Role::Marker3 | Role::Body3 | Role::Translations3 => {
            Accepts::Marker
        }
        Role::Coordinate => Accepts::Coordinate,
        Role::Parameter | Role::Gravity => Accepts::Expression,
        Role::TimeFunction => Accepts::Motion,
        Role::StateFunction => Accepts::Feedback,
    };
    let about = match input.unit {
        "" => input.about,
        unit => format!("{}, {unit}", input.about).leak(),
    };
    let unit = if input.unit.is_empty() { "1" } else { input.unit };
    Key { name: input.name, accepts, need: input.default.map_or(Need::Required, Need::Default), about, unit }
}

/// Declarations for documentation and schema.
pub fn tables() -> Vec<TableKeys> {
    let of_section = |section: &'static KindSection| {
        let KindSection { name, about, common, .. } = *section;
        let of_kind = move |(kind, keys): &(FileElementKind, &'static [Key])| {
            let descriptor = kind.descriptor;
            TableKeys { name, kind: Some(descriptor.kind), about: descriptor.about, keys }
        };
        std::iter::once(TableKeys { name, kind: None, about, keys: common }).chain(section.kinds.iter().map(of_kind))
    };
    SECTIONS.iter().flat_map(of_section).collect()
}

/// The descriptor of the element of a table; `None` for other tables.
pub fn element_of(table: &TableKeys) -> Option<&'static ElementDescriptor> {
    let section = SECTIONS.iter().find(|section| section.name == table.name)?;
    section.kinds.iter().map(|(kind, _)| kind.descriptor).find(|descriptor| Some(descriptor.kind) == table.kind)
}
