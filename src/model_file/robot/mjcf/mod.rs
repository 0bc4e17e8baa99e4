//! Robots in the XML format of MuJoCo (MJCF).
//!
//! | module | content |
//! |---|---|
//! | `settings` | units of angles, orders of Euler angles, sources of masses |
//! | `defaults` | default classes |
//! | `shapes` | masses of shapes |
//! | `bodies` | bodies with their joints, shapes and sites |
//! | `equality` | connected and welded bodies, joints that follow each other |
//!
//! # Sources
//! The reference of MJCF: <https://mujoco.readthedocs.io/en/stable/XMLreference.html>, and its chapter "Modeling".

mod bodies;
mod defaults;
mod equality;
mod settings;
mod shapes;

use super::parts::{JointType, Robot, changed};
use super::xml::XmlElement;
use crate::{Error, Result};
use bodies::Bodies;
use defaults::Defaults;
use settings::MjcfSettings;

/// Sections of which each element is left out and counted.
const LISTS: [&str; 6] = ["actuator", "sensor", "tendon", "contact", "keyframe", "deformable"];
/// Sections that are read.
const READ: [&str; 5] = ["compiler", "option", "default", "worldbody", "equality"];

/// Reads the outermost element of a file.
pub fn read(file: &str, root: &XmlElement) -> Result<Robot> {
    let mut left_out = vec![];
    let settings = MjcfSettings::of(root, &mut left_out)?;
    let defaults = Defaults::of(root)?;
    let mut bodies = Bodies::new(&settings, &defaults);
    for world in root.all("worldbody") {
        bodies.world(world)?;
    }
    if !bodies.joints.iter().any(|joint| joint.kind != JointType::Fixed) {
        return Err(Error::definition(
            file,
            "nothing moves: no body has a joint",
            "give a body a <joint> or a <freejoint>",
        ));
    }
    if let Some(total) = settings.total_mass {
        let sum: f64 = bodies.links.iter().filter_map(|link| link.mass).map(|mass| mass.mass).sum();
        bodies.links.iter_mut().filter_map(|link| link.mass.as_mut()).for_each(|mass| mass.scale(total / sum));
    }
    let mut closures = vec![];
    for section in root.all("equality") {
        closures.extend(equality::read(section, &mut bodies, &mut left_out)?);
    }
    for section in &root.children {
        match &*section.name {
            name if LISTS.contains(&name) => bodies.counts.add_all(&section.children),
            name if READ.contains(&name) => {}
            _ => bodies.counts.add_all([section]),
        }
    }
    left_out.extend(bodies.sentences());
    left_out.extend(changed(&bodies.joints));
    let name = root.attribute("model").unwrap_or("robot").to_owned();
    Ok(Robot { name, gravity: settings.gravity, links: bodies.links, joints: bodies.joints, closures, left_out })
}
