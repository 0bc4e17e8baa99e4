//! Peak memory of a command.
#![cfg(target_os = "linux")]

use crate::shell::text;
use std::path::Path;
use std::process::{Command, Stdio};

/// Runs the command with two threads; returns its peak memory in bytes.
pub fn peak(arguments: &[&str], folder: &Path) -> u64 {
    let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
        .args(arguments)
        .current_dir(folder)
        .env("RAYON_NUM_THREADS", "2")
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut kilobytes = 0;
    while child.try_wait().unwrap().is_none() {
        let shown = std::fs::read_to_string(&status).unwrap_or_default();
        let line = shown.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let found = line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok());
        kilobytes = kilobytes.max(found.unwrap_or(0));
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let output = child.wait_with_output().unwrap();
    assert!(matches!(output.status.code(), Some(0 | 3)), "{arguments:?}: {}", text(&output.stderr));
    1024 * kilobytes
}
