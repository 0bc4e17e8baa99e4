//! `linkwright new NAME` and `linkwright schema`: what a new file starts from.

use crate::command::output::{say, write};
use anyhow::bail;
use clap::Args;
use std::path::Path;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright new lift
  linkwright optimize lift.toml

Writes NAME.toml: a small mechanism with an optimization, every line explained, to be changed into your own.")]
pub struct New {
    /// Name of the model, without ending
    name: String,
}

impl New {
    pub fn run(&self) -> anyhow::Result<()> {
        let file = format!("{}.toml", self.name.trim_end_matches(".toml"));
        if Path::new(&file).exists() {
            bail!("{file} exists; give another name");
        }
        let title = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().replace(['"', '\\'], "");
        write(Path::new(&file), include_str!("starter.toml").replace("TITLE", &title).as_bytes())?;
        say(&format!("Wrote {file}. Next: linkwright optimize {file}"))
    }
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright schema > linkwright.schema.json

An editor that knows the schema completes keys and marks mistakes while a model file is written.")]
pub struct Schema {}

impl Schema {
    pub fn run(&self) -> anyhow::Result<()> {
        say(&serde_json::to_string_pretty(&linkwright::model_file::schema())?)
    }
}
