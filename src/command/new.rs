//! `linkwright new NAME`, `linkwright schema` and `linkwright completion SHELL`: files for a new model, an editor and a shell.

use super::output::{say, write};
use anyhow::bail;
use clap::{Args, Command};
use clap_complete::{Shell, generate};
use std::path::Path;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright new lift
  linkwright optimize lift.toml

Writes NAME.toml: a small mechanism and its optimization, with a comment on every part. Change it into your own model.")]
pub struct New {
    /// Name of the model, without the extension
    name: String,
}

impl New {
    pub fn run(&self) -> anyhow::Result<()> {
        let file = format!("{}.toml", self.name.trim_end_matches(".toml"));
        if Path::new(&file).exists() {
            bail!("{file} exists; give another name");
        }
        let title = Path::new(&file).file_stem().unwrap_or_default().to_string_lossy().replace(['"', '\\'], "");
        write(Path::new(&file), include_str!("template.toml").replace("TITLE", &title).as_bytes())?;
        say(&format!("Wrote {file}. Next: linkwright optimize {file}"))
    }
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright schema > linkwright.schema.json

An editor that reads the schema completes keys and marks mistakes while you write a model file.")]
pub struct Schema {}

impl Schema {
    pub fn run(&self) -> anyhow::Result<()> {
        say(&serde_json::to_string_pretty(&linkwright::model_file::schema())?)
    }
}

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright completion bash > ~/.local/share/bash-completion/completions/linkwright
  linkwright completion zsh > ~/.zfunc/_linkwright        with fpath+=~/.zfunc before compinit in ~/.zshrc
  linkwright completion fish > ~/.config/fish/completions/linkwright.fish
  linkwright completion powershell >> $PROFILE

Prints a script with which a shell completes commands, options and file names on the tab key.")]
pub struct Completion {
    /// The shell
    shell: Shell,
}

impl Completion {
    pub fn run(&self, command: &mut Command) -> anyhow::Result<()> {
        let mut script = vec![];
        generate(self.shell, command, "linkwright", &mut script);
        say(String::from_utf8_lossy(&script).trim_end())
    }
}
