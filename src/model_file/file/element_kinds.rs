//! Kinds of joints, drives and forces of model files, made from the declarations of the elements.

use super::feedback::ObservedFormula;
use super::key::{Accepts, EACH, Key, Need, Table, default, required};
use super::motion::MotionLaw;
use mechanics::elements::{self, ElementDescriptor, ElementKind, Family, Input, Role};
use std::sync::LazyLock;

/// A kind of element with the types of functions that model files give it.
pub type Kind = ElementKind<MotionLaw, ObservedFormula>;

/// A section of the file, such as `[[joint]]`, with its kinds.
pub struct KindSection {
    pub name: &'static str,
    about: &'static str,
    /// The kind of a table without the key `kind`; empty if the key is required.
    pub usual: &'static str,
    /// Keys of all kinds.
    pub common: &'static [Key],
    pub kinds: Vec<(Kind, &'static [Key])>,
}

/// Sections of elements, in the order in which they are read.
pub static SECTIONS: LazyLock<[KindSection; 3]> = LazyLock::new(|| {
    [
        KindSection::new("joint", "what joins bodies", "revolute", "what it is"),
        KindSection::new("driver", "what moves as prescribed", "coordinate", "what it prescribes"),
        KindSection::new("force", "what pushes and pulls", "", "what it is"),
    ]
});

impl KindSection {
    /// The section with all elements that belong to it.
    ///
    /// Its keys and their texts live as long as the program, as those of other sections do.
    fn new(name: &'static str, about: &'static str, usual: &'static str, about_kind: &'static str) -> Self {
        let mut kinds = elements::kinds();
        kinds.retain(|kind: &Kind| section_of(kind.descriptor) == name);
        let words: Vec<&str> = kinds.iter().map(|kind| kind.descriptor.kind).collect();
        let accepts = Accepts::Choice(words.leak());
        let kind = match usual {
            "" => required("kind", accepts, about_kind),
            _ => default("kind", accepts, usual, about_kind),
        };
        let common = vec![required("name", Accepts::Name, "name, unique in the file"), kind, EACH].leak();
        let with_keys = |kind: Kind| {
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

/// The key of an input.
pub fn key(input: &Input) -> Key {
    let accepts = match input.role {
        Role::Marker | Role::Body | Role::Translations => Accepts::Marker,
        Role::Coordinate => Accepts::Coordinate,
        Role::Parameter | Role::Gravity => Accepts::Expression,
        Role::TimeFunction => Accepts::Motion,
        Role::StateFunction => Accepts::Feedback,
    };
    let about = match input.unit {
        "" => input.about,
        unit => format!("{}, {unit}", input.about).leak(),
    };
    Key { name: input.name, accepts, need: input.default.map_or(Need::Required, Need::Default), about }
}

/// Declarations for documentation and schema.
pub fn tables() -> Vec<Table> {
    let of_section = |section: &'static KindSection| {
        let KindSection { name, about, common, .. } = *section;
        let of_kind = move |(kind, keys): &(Kind, &'static [Key])| {
            let descriptor = kind.descriptor;
            Table { name, kind: Some(descriptor.kind), about: descriptor.about, keys }
        };
        std::iter::once(Table { name, kind: None, about, keys: common }).chain(section.kinds.iter().map(of_kind))
    };
    SECTIONS.iter().flat_map(of_section).collect()
}

/// The declaration of the element that a table describes, if it describes one.
pub fn element_of(table: &Table) -> Option<&'static ElementDescriptor> {
    let section = SECTIONS.iter().find(|section| section.name == table.name)?;
    section.kinds.iter().map(|(kind, _)| kind.descriptor).find(|descriptor| Some(descriptor.kind) == table.kind)
}
