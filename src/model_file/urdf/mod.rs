//! Import of robots in the Unified Robot Description Format (URDF) as model files.
//!
//! | module | content |
//! |---|---|
//! | `robot` | links and joints as the file has them |
//! | `inertia` | masses, centres and inertia matrices: checks and sums |
//! | `tree` | the tree of links, rigid parts of links with fixed joints, and their poses at the start |
//! | `text` | the model file |
//!
//! Links that fixed joints connect become one body, named after the first; the others become named points of it. Revolute,
//! continuous, prismatic and planar joints become joints of the same kinds, floating joints none. Damping and friction act on
//! the coordinates of joints, `mimic` becomes a pair of gears. All else is left out and named.
//!
//! # Sources
//! The specification of URDF: <https://wiki.ros.org/urdf/XML>.

mod inertia;
mod robot;
mod text;
mod tree;

use crate::{Error, Result};

/// Largest size of a URDF file in bytes.
pub const LIMIT: usize = 8 << 20;

/// Support of the first link of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// It is part of the ground.
    Fixed,
    /// It is a body that moves freely.
    Free,
}

/// A model file that was made from a robot, and what it lacks.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The text of the model file.
    pub text: String,
    /// Parts that were left out or changed, one sentence each.
    pub left_out: Vec<String>,
}

/// The model file of a robot; `name` is that of its file, for messages.
///
/// ```
/// use linkwright::model_file::{read, urdf};
/// let robot = r#"<robot name="pendulum"><link name="base"/>
///     <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
///       <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
///     <joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>"#;
/// let imported = urdf::import("pendulum.urdf", robot, urdf::Base::Fixed)?;
/// assert!(imported.left_out.is_empty());
/// assert!(read("pendulum.toml", &imported.text).is_ok());
/// # Ok::<(), linkwright::Error>(())
/// ```
///
/// # Errors
/// [`Error::Definition`] if it is no URDF file; if links and joints are no tree; if masses, inertia matrices or axes are not
/// possible; or if something that moves has no mass.
pub fn import(name: &str, text: &str, base: Base) -> Result<Imported> {
    if text.len() > LIMIT {
        let why = format!("it has {} bytes, more than {LIMIT}", text.len());
        return Err(Error::definition(name, why, "remove what is no link and no joint, such as meshes"));
    }
    let mut robot = robot::read(name, text)?;
    let tree = tree::Tree::of(&mut robot, base)?;
    let written = text::write(&robot, &tree, name);
    super::read(name, &written).map_err(|report| {
        let remedy = "simplify the robot, or write the model by hand";
        Error::definition(name, format!("its model file would not be valid: {report}"), remedy)
    })?;
    Ok(Imported { text: written, left_out: robot.left_out })
}
