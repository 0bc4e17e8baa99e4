//! Runs the command in a separate folder.
#![cfg(feature = "cli")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

pub fn linkwright(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_linkwright")).args(arguments).current_dir(folder).output().unwrap()
}

pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// Standard error without the lines about a long task, such as `analysing …  1.0 s elapsed`.
pub fn messages(bytes: &[u8]) -> String {
    let lines = text(bytes);
    let is_message = |line: &&str| !(line.contains(" …  ") && line.trim_end().ends_with(" elapsed"));
    lines.split_inclusive('\n').filter(is_message).collect()
}

/// Seals a changed state again, as its author can.
pub fn sealed(state: &str) -> String {
    let digits = state.find("fnv1a64:").unwrap() + 8;
    let zeros = format!("{}{}{}", &state[..digits], "0".repeat(16), &state[digits + 16..]);
    let hash = linkwright::storage::fnv1a(&zeros);
    format!("{}{hash:016x}{}", &state[..digits], &state[digits + 16..])
}

/// An empty folder that is removed at the end.
pub struct TempFolder(pub PathBuf);

impl TempFolder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("linkwright-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn example(&self, name: &str) {
        let from = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        std::fs::copy(from, self.0.join(format!("{name}.toml"))).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn run(&self, arguments: &[&str], code: i32) -> String {
        let output = linkwright(arguments, &self.0);
        let all = text(&output.stdout) + &messages(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{all}");
        all
    }
}

impl Drop for TempFolder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}
