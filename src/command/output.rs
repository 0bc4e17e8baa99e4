//! What commands write.

use anyhow::Context;
use std::io::Write;
use std::path::{Path, PathBuf};

/// A line on standard output; a closed pipe ends the program quietly.
pub fn say(text: &str) -> anyhow::Result<()> {
    match writeln!(std::io::stdout(), "{text}") {
        Err(e) if e.kind() == std::io::ErrorKind::BrokenPipe => std::process::exit(0),
        result => result.context("cannot write to standard output"),
    }
}

/// Makes a folder, and those that it is in.
pub fn folder(path: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(path).with_context(|| format!("cannot make the folder {}", path.display()))
}

/// Writes a file.
pub fn write(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    std::fs::write(path, bytes).with_context(|| format!("cannot write {}", path.display()))
}

/// The folder that results go to where no other one is given: `out`, or what `LINKWRIGHT_OUT` says.
pub fn results() -> PathBuf {
    let wanted = std::env::var_os("LINKWRIGHT_OUT").filter(|name| !name.is_empty());
    wanted.map_or_else(|| PathBuf::from("out"), PathBuf::from)
}
