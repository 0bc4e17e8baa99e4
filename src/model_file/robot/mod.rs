//! Import of robots as model files, from the Unified Robot Description Format (URDF) and from the XML format of MuJoCo (MJCF).
//!
//! | module | content |
//! |---|---|
//! | `xml` | elements of an XML file with their places |
//! | `parts` | a robot as links and joints |
//! | `urdf`, `mjcf` | links and joints of a file in these formats |
//! | `inertia` | masses, centres and inertia matrices: checks and sums |
//! | `tree` | the tree of links, rigid parts of links with fixed joints, and their poses at the start |
//! | `text` | the model file |
//!
//! Links that fixed joints connect become one body, named after the first; the others become named points of it. Joints become
//! joints of the same kinds; a floating joint needs none. Springs, damping, friction and motor inertia act on the coordinates of joints;
//! a joint that follows another one becomes a pair of gears. Everything else is left out, and a sentence says so.

mod inertia;
mod mjcf;
mod parts;
mod text;
mod tree;
mod urdf;
mod xml;

pub use tree::Base;
pub use xml::LIMIT;

use super::attached::read_within;
use crate::storage::read_file;
use crate::{Error, Result};
use std::path::Path;

/// A model file that was made from a robot, and what was left out of it.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The text of the model file.
    pub text: String,
    /// Parts that were left out or changed, one sentence each.
    pub left_out: Vec<String>,
}

/// The model file of a robot in URDF or MJCF that includes no other file; `name` is that of its file, for messages.
///
/// ```
/// use linkwright::model_file::{read, robot};
/// let arm = r#"<robot name="pendulum"><link name="base"/>
///     <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
///       <inertia ixx="0.1" iyy="0.1" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>
///     <joint name="hinge" type="continuous"><parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint></robot>"#;
/// let imported = robot::import("pendulum.urdf", arm, robot::Base::Fixed)?;
/// assert!(imported.left_out.is_empty());
/// assert!(read("pendulum.toml", &imported.text).is_ok());
/// # Ok::<(), linkwright::Error>(())
/// ```
///
/// # Errors
/// [`Error::Definition`] if it is not a file of these formats; if links and joints do not form a tree; if masses, inertia matrices or axes
/// are not possible; or if something that moves has no mass.
pub fn import(name: &str, text: &str, base: Base) -> Result<Imported> {
    import_with(name, text, base, &|file| {
        let remedy = "import it from its folder, or save it as one file";
        Err(Error::definition(name, format!("it includes `{}`", xml::shortened(file, 100)), remedy))
    })
}

/// As [`import`], for the file at `path`. Files that it includes are read from its folder and those below.
///
/// # Errors
/// As [`import`], and if a file cannot be read.
pub fn import_file(path: &Path, base: Base) -> Result<Imported> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let unreadable =
        |what: &str, why: String| Error::definition(what, format!("cannot read it: {why}"), "give a text file");
    let bytes = read_file(path, LIMIT as u64).map_err(|error| unreadable(&name, error.to_string()))?;
    let text = String::from_utf8(bytes).map_err(|_| unreadable(&name, "it is not UTF-8".into()))?;
    let folder = path.parent().unwrap_or(Path::new(""));
    import_with(&name, &text, base, &|file| {
        read_within(file.trim_start_matches("./"), folder, LIMIT)
            .map_err(|error| unreadable(&xml::shortened(file, 100), error.why))
    })
}

fn import_with(name: &str, text: &str, base: Base, include: &xml::Include<'_>) -> Result<Imported> {
    if text.len() > LIMIT {
        let why = format!("it has {} bytes, more than {LIMIT}", text.len());
        return Err(Error::definition(name, why, "remove what is no link and no joint, such as meshes"));
    }
    let root = xml::parse(name, text, include)?;
    let mut robot = match (&*root.name, base) {
        ("robot", _) => urdf::read(name, &root)?,
        ("mujoco", Base::Fixed) => mjcf::read(name, &root)?,
        ("mujoco", Base::Free) => {
            let remedy = "leave out --free-base; give the body a <freejoint> in the file";
            return Err(Error::definition(name, "an MJCF file says itself which bodies are free", remedy));
        }
        (other, _) => {
            let why =
                format!("its outermost element is <{}>, and neither <robot> nor <mujoco>", xml::shortened(other, 40));
            return Err(Error::definition(name, why, "give a file in URDF or MJCF"));
        }
    };
    let tree = tree::RobotTree::of(&mut robot, base)?;
    let written = text::write(&robot, &tree, name);
    super::read(name, &written).map_err(|report| {
        let remedy = "simplify the robot, or write the model by hand";
        Error::definition(name, format!("its model file would not be valid: {report}"), remedy)
    })?;
    Ok(Imported { text: written, left_out: robot.left_out })
}
