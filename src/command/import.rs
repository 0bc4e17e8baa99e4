//! `linkwright import FILE`: a robot in a URDF file as a model file.

use super::new::create;
use super::output::{complain, say, visible};
use anyhow::Context;
use clap::Args;
use linkwright::model_file::urdf::{self, Base};
use linkwright::storage::read_file;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright import robot.urdf                write robot.toml into this folder
  linkwright import robot.urdf models/arm     write models/arm.toml
  linkwright import dog.urdf --free-base      the first link moves freely
  linkwright analyze robot.toml               its motion from rest under its weight

Links that fixed joints connect become one body; the others of them are named points. Revolute, continuous, prismatic and
planar joints become joints, floating joints none; damping, friction and mimic act on their coordinates. What the model does
not have, such as shapes, limits and transmissions, is named on standard error and in comments of the file. The robot starts
with its joints at zero, or at the nearest position of their range.")]
pub struct Import {
    /// A URDF file (of a xacro file: what `xacro FILE` prints)
    file: PathBuf,
    /// Name of the model, with or without the extension [default: that of the robot's file, in this folder]
    name: Option<String>,
    /// Let the first link move freely, instead of as a part of the ground
    #[arg(long)]
    free_base: bool,
    /// Print nothing on standard output
    #[arg(short, long)]
    quiet: bool,
}

impl Import {
    pub fn run(&self) -> anyhow::Result<()> {
        let shown = self.file.display();
        let bytes = read_file(&self.file, urdf::LIMIT as u64).with_context(|| format!("cannot read {shown}"))?;
        let text = String::from_utf8(bytes).with_context(|| format!("{shown} is not UTF-8"))?;
        let base = if self.free_base { Base::Free } else { Base::Fixed };
        let source = self.file.file_name().unwrap_or_default().to_string_lossy();
        let imported = urdf::import(&source, &text, base)?;
        let own = || Path::new(&*source).with_extension("").to_string_lossy().into_owned();
        let file = format!("{}.toml", self.name.clone().unwrap_or_else(own).trim_end_matches(".toml"));
        create(&file, &imported.text)?;
        imported.left_out.iter().for_each(|sentence| complain(&format!("note: {}", visible(sentence))));
        if self.quiet { Ok(()) } else { say(&format!("Wrote {file}. Next: linkwright analyze {file}")) }
    }
}
