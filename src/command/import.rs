//! `linkwright import FILE`: a robot in a URDF or MJCF file as a model file.

use super::new::create;
use super::output::{argument, complain, say};
use clap::Args;
use linkwright::model_file::robot::{self, Base};
use linkwright::model_file::visible;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright import robot.urdf                write robot.toml into this folder
  linkwright import robot.urdf models/arm     write models/arm.toml
  linkwright import dog.urdf --free-base      the first link moves freely
  linkwright import humanoid.xml              a model of MuJoCo
  linkwright analyze robot.toml               its motion from rest under its weight

Links that fixed joints connect become one body; the others of them are named points. Revolute, continuous, prismatic,
planar and ball joints become joints, floating joints none; springs, damping, friction, motor inertia and followed joints act
on their coordinates. What the model does not have, such as contacts, limits and motors, is named on standard error and in
comments of the file. A robot of a URDF file starts with its joints at zero, or at the nearest position of their range, that of
an MJCF file in its reference configuration.")]
pub struct Import {
    /// A URDF file (of a xacro file: what `xacro FILE` prints), or an MJCF file of MuJoCo
    file: PathBuf,
    /// Name of the model, with or without the extension [default: that of the robot's file, in this folder]
    name: Option<String>,
    /// Let the first link of a URDF file move freely, instead of as a part of the ground
    #[arg(long)]
    free_base: bool,
    /// Print nothing on standard output
    #[arg(short, long)]
    quiet: bool,
}

impl Import {
    pub fn run(&self) -> anyhow::Result<()> {
        let base = if self.free_base { Base::Free } else { Base::Fixed };
        let source = self.file.file_name().unwrap_or_default().to_string_lossy();
        let imported = robot::import_file(&self.file, base)?;
        let own = || Path::new(&*source).with_extension("").to_string_lossy().into_owned();
        let file = format!("{}.toml", self.name.clone().unwrap_or_else(own).trim_end_matches(".toml"));
        create(&file, &imported.text)?;
        imported.left_out.iter().for_each(|sentence| complain(&format!("note: {}", visible(sentence))));
        if self.quiet { Ok(()) } else { say(&format!("Wrote {file}. Next: linkwright analyze {}", argument(&file))) }
    }
}
