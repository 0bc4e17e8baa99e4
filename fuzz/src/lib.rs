//! The modules of the command, public for the fuzz targets.

#[path = "../../src/command/mod.rs"]
pub mod command;

pub mod any_folder;
