//! `linkwright new NAME`, `linkwright schema` and `linkwright completion SHELL`: files for a new model, an editor and a shell.

use super::output::{argument, say};
use anyhow::{Context, bail};
use clap::{Args, Command};
use clap_complete::{Shell, generate};
use linkwright::storage::Directory;
use std::io::ErrorKind;
use std::path::Path;

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright new lift
  linkwright optimize lift.toml

Writes NAME.toml: a small mechanism and its optimization, with a comment on every part. Change it into your own model.")]
pub struct New {
    /// Name of the model, without the extension
    name: String,
    /// Print nothing on standard output
    #[arg(short, long)]
    quiet: bool,
}

impl New {
    pub fn run(&self) -> anyhow::Result<()> {
        let (file, title) = named(&self.name)?;
        create(&file, &include_str!("template.toml").replace("TITLE", &title))?;
        if self.quiet { Ok(()) } else { say(&format!("Wrote {file}. Next: linkwright optimize {}", argument(&file))) }
    }
}

/// The model file of a name, with or without its extension, and its title.
fn named(name: &str) -> anyhow::Result<(String, String)> {
    let file = format!("{}.toml", name.trim_end_matches(".toml"));
    let (Some(_), Some(title)) = (Path::new(&file).file_name(), Path::new(&file).file_stem()) else {
        bail!("{file} is not the name of a file; give another name");
    };
    let title = title.to_string_lossy().replace(['"', '\\'], "");
    Ok((file, title))
}

/// Writes a new model file; one that exists stays as it is.
pub fn create(file: &str, text: &str) -> anyhow::Result<()> {
    let (path, cannot) = (Path::new(file), || format!("cannot write {file}"));
    let Some(name) = path.file_name().and_then(|name| name.to_str()) else {
        bail!("{file} is not the name of a file; give another name");
    };
    // A name of dots alone is that of a folder.
    if name.trim_end_matches(".toml").chars().all(|c| c == '.') {
        bail!("a model needs a name; give one such as lift");
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    match Directory::open(folder).with_context(cannot)?.create_new(name, text.as_bytes()) {
        Err(error) if error.kind() == ErrorKind::AlreadyExists => bail!("{file} exists; give another name"),
        written => written.with_context(cannot),
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
