//! Files that survive a kill, a full disk and a power cut, and the lock of a run directory.

use anyhow::Context;
use linkwright::storage::replace_file;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

/// Replaces a file atomically and flushes it to disk.
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    explained(path, replace_file(path, content.as_ref(), true))
}

/// Replaces atomically a file that can be computed again; the system flushes it to disk later.
pub fn replace_unflushed(path: &Path, text: &str) -> anyhow::Result<()> {
    explained(path, replace_file(path, text.as_bytes(), false))
}

/// Appends lines to a file and flushes it to disk.
pub fn append(path: &Path, lines: &str) -> anyhow::Result<()> {
    let write = || {
        let mut file = OpenOptions::new().create(true).append(true).open(path)?;
        file.write_all(lines.as_bytes())?;
        file.sync_all()
    };
    explained(path, write())
}

/// Removes an incomplete last line, which a kill or a full disk may leave. Returns the remaining text.
pub fn complete_lines(path: &Path) -> anyhow::Result<String> {
    let bytes = match std::fs::read(path) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == io::ErrorKind::NotFound => return Ok(String::new()),
        Err(e) => return Err(e).with_context(|| format!("cannot read {}", path.display())),
    };
    let end = bytes.iter().rposition(|b| *b == b'\n').map_or(0, |k| k + 1);
    if end < bytes.len() {
        let cut = || OpenOptions::new().write(true).open(path)?.set_len(end as u64);
        explained(path, cut())?;
    }
    Ok(String::from_utf8_lossy(&bytes[..end]).into_owned())
}

/// Adds to an error the file and what to do.
fn explained(path: &Path, done: io::Result<()>) -> anyhow::Result<()> {
    done.with_context(|| {
        let folder = path.parent().unwrap_or(path).display();
        format!(
            "cannot write {}; earlier cycles are kept: free disk space, or make the folder writable, then `linkwright resume {folder}`",
            path.display()
        )
    })
}

/// The lock of a run directory: one process at a time runs in it. Released on drop.
pub struct Lock {
    _file: Option<File>,
}

/// Locked while a process runs in the folder; empty.
const LOCK: &str = "run.lock";

impl Lock {
    /// Locks a folder in which no other process runs.
    pub fn acquire(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(LOCK);
        let opened = OpenOptions::new().create(true).append(true).open(&path);
        let file =
            opened.with_context(|| format!("cannot write {}; give a folder that can be written to", path.display()))?;
        for wait in [20, 100, 0] {
            match file.try_lock() {
                Ok(()) => return Ok(Self { _file: Some(file) }),
                // `is_held` locks the file for a moment.
                Err(TryLockError::WouldBlock) => std::thread::sleep(Duration::from_millis(wait)),
                // Not every file system has locks.
                Err(TryLockError::Error(_)) => return Ok(Self { _file: None }),
            }
        }
        anyhow::bail!("another process runs in {}; wait for its end, or stop it", folder.display())
    }

    /// Returns `true` if a process runs in the folder.
    pub fn is_held(folder: &Path) -> bool {
        File::open(folder.join(LOCK)).is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
    }
}
