//! Files that outlive a kill, a full disk and a power cut.

use anyhow::Context;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

/// Writes a file whole or not at all: beside its place, down to the disk, and then moved there.
pub fn replace(path: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    explained(path, written(path, content.as_ref(), true))
}

/// The same for what can be computed again: not pressed down to the disk.
pub fn replace_soon(path: &Path, text: &str) -> anyhow::Result<()> {
    explained(path, written(path, text.as_bytes(), false))
}

fn written(path: &Path, content: &[u8], now: bool) -> io::Result<()> {
    let mut beside = path.as_os_str().to_owned();
    beside.push(".part");
    let beside = Path::new(&beside);
    let write = || {
        let mut file = File::create(beside)?;
        file.write_all(content)?;
        if now { file.sync_all() } else { Ok(()) }
    };
    let moved = write().and_then(|()| std::fs::rename(beside, path));
    match moved {
        Ok(()) if now => sync_folder(path),
        Ok(()) => Ok(()),
        Err(e) => {
            // A part of a file is of no use, and its place on the disk may be.
            drop(std::fs::remove_file(beside));
            Err(e)
        }
    }
}

/// Appends lines to a file, down to the disk.
pub fn append(path: &Path, lines: &str) -> anyhow::Result<()> {
    let write = || {
        let mut file = OpenOptions::new().create(true).append(true).open(path)?;
        file.write_all(lines.as_bytes())?;
        file.sync_all()
    };
    explained(path, write())
}

/// Cuts a file where its last whole line ends: a kill or a full disk may have left a piece of one more. Returns what stays.
pub fn whole_lines(path: &Path) -> anyhow::Result<String> {
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

/// The names of a folder are written, too. Where folders cannot be opened as files, the system takes care of that.
fn sync_folder(path: &Path) -> io::Result<()> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if let Ok(folder) = File::open(folder) {
        drop(folder.sync_all());
    }
    Ok(())
}

/// The reason, and what to do: a run goes on where its last whole cycle ended.
fn explained(path: &Path, done: io::Result<()>) -> anyhow::Result<()> {
    done.with_context(|| {
        let folder = path.parent().unwrap_or(path).display();
        format!(
            "cannot write {}; earlier cycles are kept: make room, or make the folder writable, then `linkwright resume {folder}`",
            path.display()
        )
    })
}

/// A folder that belongs to one running process, as long as this lives.
pub struct Claim {
    _file: Option<File>,
}

impl Claim {
    /// Claims a folder that no other process runs in.
    pub fn new(folder: &Path) -> anyhow::Result<Self> {
        let path = folder.join(LOCK);
        let opened = OpenOptions::new().create(true).append(true).open(&path);
        let file =
            opened.with_context(|| format!("cannot write {}; give a folder that can be written to", path.display()))?;
        for patience in [20, 100, 0] {
            match file.try_lock() {
                Ok(()) => return Ok(Self { _file: Some(file) }),
                // Somebody may just be looking whether the run goes on.
                Err(std::fs::TryLockError::WouldBlock) => {
                    std::thread::sleep(std::time::Duration::from_millis(patience));
                }
                // Not every file system has locks.
                Err(std::fs::TryLockError::Error(_)) => return Ok(Self { _file: None }),
            }
        }
        anyhow::bail!("another process runs in {}; wait for its end, or stop it", folder.display())
    }

    /// Whether a process runs in the folder.
    pub fn is_taken(folder: &Path) -> bool {
        File::open(folder.join(LOCK))
            .is_ok_and(|file| matches!(file.try_lock_shared(), Err(std::fs::TryLockError::WouldBlock)))
    }
}

/// Locked while a process runs in the folder; empty.
const LOCK: &str = "run.lock";
