//! `linkwright completion SHELL`.

use clap::{Args, Command};
use clap_complete::{Shell, generate};

#[derive(Args)]
#[command(after_help = "Examples:
  linkwright completion bash > ~/.local/share/bash-completion/completions/linkwright
  linkwright completion zsh > ~/.zfunc/_linkwright        with fpath+=~/.zfunc before compinit in ~/.zshrc
  linkwright completion fish > ~/.config/fish/completions/linkwright.fish
  linkwright completion powershell >> $PROFILE

Prints a script that makes a shell complete commands, options and file names after the tab key.")]
pub struct Completion {
    /// The shell
    shell: Shell,
}

impl Completion {
    pub fn run(&self, command: &mut Command) -> anyhow::Result<()> {
        let mut script = vec![];
        generate(self.shell, command, "linkwright", &mut script);
        super::output::say(String::from_utf8_lossy(&script).trim_end())
    }
}
