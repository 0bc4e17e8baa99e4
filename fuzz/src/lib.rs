//! The command with a door for fuzz targets.

#[path = "../../src/command/mod.rs"]
pub mod command;

pub mod any_folder;
