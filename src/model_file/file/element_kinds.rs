//! Kinds of joints, drives and forces of model files, generated from the descriptors of the elements.

use super::feedback::ObservedFormula;
use super::key::{Accepts, EACH, Key, Need, TableKeys, default, required};
use super::markers::SHARED_KEYS;
use super::motion::MotionLaw;
use super::parts::JointCoordinate;
use mechanics::elements::{self, ElementDescriptor, ElementKind, Family, Input, Role, spatial};
use std::sync::LazyLock;

/// A kind of element whose functions of time and state come from model files.
pub type FileElementKind = ElementKind<MotionLaw, ObservedFormula>;

/// A section of the file, such as `[[joint]]`, with its kinds.
pub struct KindSection {
    pub name: &'static str,
    /// Its name in documentation and schema.
    table: &'static str,
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
        KindSection::new(["joint"; 2], "joints between bodies", "revolute", elements::kinds()),
        KindSection::new(["driver"; 2], "prescribed motions", "coordinate", elements::kinds()),
        KindSection::new(["force"; 2], "forces, contacts and additional inertia", "", elements::kinds()),
    ]
});

/// Sections of elements in space.
pub static SECTIONS3: LazyLock<[KindSection; 3]> = LazyLock::new(|| {
    [
        KindSection::new(["joint", "joint3"], "joints between bodies in space", "revolute", kinds3()),
        KindSection::new(["driver", "driver3"], "prescribed motions of coordinates", "coordinate", kinds3()),
        KindSection::new(["force", "force3"], "forces in space, and forces on coordinates", "", kinds3()),
    ]
});

/// Elements in space, and those that act on coordinates and so belong to both kinds of mechanisms.
fn kinds3() -> Vec<FileElementKind> {
    let acts_on_coordinates = |kind: &FileElementKind| {
        let roles = [Role::Coordinate, Role::Parameter, Role::TimeFunction, Role::StateFunction];
        kind.descriptor.inputs.iter().all(|input| roles.contains(&input.role))
    };
    let forces = [spatial::forces::kinds(), spatial::contacts::kinds()];
    let own = [spatial::joints::kinds(), spatial::drives::kinds()].into_iter().chain(forces);
    own.flatten().chain(elements::kinds().into_iter().filter(acts_on_coordinates)).collect()
}

/// The sections of a file.
pub fn sections(is_spatial: bool) -> &'static [KindSection; 3] {
    if is_spatial { &SECTIONS3 } else { &SECTIONS }
}

/// Elements between two points for which axes and a common position have no meaning.
const DISTANCES: &[&str] = &["distance", "spring", "rope", "length", "sphere-plane", "sphere-sphere"];

/// Keys that give the position or axes of both points of an element at once.
pub fn shared_keys(descriptor: &ElementDescriptor) -> &'static [Key] {
    let points = descriptor.inputs.iter().filter(|input| input.role == Role::Marker3).count();
    if points == 2 && !DISTANCES.contains(&descriptor.kind) { SHARED_KEYS } else { &[] }
}

impl KindSection {
    /// The section with all elements that belong to it.
    ///
    /// Its keys and texts are leaked: they live as long as the program, as constants do.
    fn new(
        [name, table]: [&'static str; 2],
        about: &'static str,
        usual: &'static str,
        mut kinds: Vec<FileElementKind>,
    ) -> Self {
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
            let mut keys: Vec<Key> = grouped_keys(kind.descriptor).into_iter().map(|(_, key)| key).collect();
            if JointCoordinate::of_element(kind.descriptor).is_some() {
                keys.pop();
            }
            keys.extend(shared_keys(kind.descriptor));
            let keys: &[Key] = keys.leak();
            (kind, keys)
        };
        Self { name, table, about, usual, common, kinds: kinds.into_iter().map(with_keys).collect() }
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

/// Suffixes of three parameters that are components of one, and the suffix of the common name that replaces them.
const GROUPS: [([&str; 3], &str); 3] =
    [(["_xx", "_yy", "_zz"], ""), (["_xy", "_yz", "_zx"], "products"), (["_x", "_y", "_z"], "")];

/// Keys of an element with the inputs that each stands for: parameters in space such as `direction_x`, `direction_y` and
/// `direction_z` are one key with three values.
///
/// Their texts are leaked and live as long as the program.
pub fn grouped_keys(descriptor: &'static ElementDescriptor) -> Vec<(&'static [Input], Key)> {
    let (mut rest, mut all) = (descriptor.inputs, vec![]);
    while let Some(first) = rest.first() {
        let (inputs, key) = match group(rest) {
            Some((name, about)) => {
                let (name, about): (&str, &str) = (name.leak(), about.leak());
                (&rest[..3], Key { name, accepts: Accepts::Triple, about, ..key(first) })
            }
            None => (&rest[..1], key(first)),
        };
        rest = &rest[inputs.len()..];
        all.push((inputs, key));
    }
    all
}

/// Common name and description of the first three inputs, if they are components of one.
fn group(inputs: &[Input]) -> Option<(String, String)> {
    let three = inputs.get(..3).filter(|three| three.iter().all(|input| input.role == Role::Parameter))?;
    let (suffixes, name) = GROUPS.iter().find(|(suffixes, _)| {
        let stem = three[0].name.strip_suffix(suffixes[0]);
        stem.is_some() && (1..3).all(|k| three[k].name.strip_suffix(suffixes[k]) == stem)
    })?;
    let stem = three[0].name.strip_suffix(suffixes[0])?;
    let (one, all) = match suffixes[0] {
        "_xy" => (" xy", " xy, yz and zx"),
        _ => (" x", " x, y and z"),
    };
    let about = three[0].about.replacen(one, all, 1);
    let unit = if three[0].unit.is_empty() { String::new() } else { format!(", {}", three[0].unit) };
    Some((if name.is_empty() { stem } else { name }.to_owned(), about + &unit))
}

/// The key of an input.
fn key(input: &Input) -> Key {
    let accepts = match input.role {
        Role::Marker | Role::Body | Role::Translations | Role::Marker3 | Role::Body3 | Role::Translations3 => {
            Accepts::Marker
        }
        Role::Coordinate => Accepts::Coordinate,
        Role::Joint(_) => Accepts::Name,
        Role::Profile => Accepts::Pairs,
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

/// The declarations of a section: the keys of all kinds, and those of each kind.
fn of_section(section: &'static KindSection) -> impl Iterator<Item = TableKeys> {
    let KindSection { table: name, about, common, .. } = *section;
    let of_kind = move |(kind, keys): &(FileElementKind, &'static [Key])| {
        let descriptor = kind.descriptor;
        TableKeys { name, kind: Some(descriptor.kind), about: descriptor.about, keys }
    };
    std::iter::once(TableKeys { name, kind: None, about, keys: common }).chain(section.kinds.iter().map(of_kind))
}

/// Declarations for documentation and schema.
pub fn tables() -> Vec<TableKeys> {
    SECTIONS.iter().flat_map(of_section).collect()
}

/// Declarations of elements in space.
pub fn tables3() -> Vec<TableKeys> {
    SECTIONS3.iter().flat_map(of_section).collect()
}

/// The descriptor of the element of a table; `None` for other tables.
pub fn element_of(table: &TableKeys) -> Option<&'static ElementDescriptor> {
    let section = SECTIONS.iter().chain(&*SECTIONS3).find(|section| section.table == table.name)?;
    section.kinds.iter().map(|(kind, _)| kind.descriptor).find(|descriptor| Some(descriptor.kind) == table.kind)
}
