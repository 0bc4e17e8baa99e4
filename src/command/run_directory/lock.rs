//! The claim of a run directory: one process at a time runs in it.

use super::super::output_folder::Occupied;
use anyhow::Context;
use linkwright::storage::{Directory, Lock};
use std::fs::File;
use std::time::Duration;

/// Locked while a process runs in the folder; empty.
pub const LOCK: &str = "run.lock";

/// The lock of a folder. The system releases it when the process ends, even by a kill.
pub struct FolderLock {
    /// `None` if the file system has no locks.
    _file: Option<File>,
    /// True if the file of the lock did not exist before.
    is_new: bool,
}

impl FolderLock {
    /// Locks a folder in which no other process runs.
    pub fn of(directory: &Directory) -> anyhow::Result<Self> {
        let place = directory.path().join(LOCK);
        let explain = || format!("cannot write {}; give a folder that can be written to", place.display());
        let is_new = directory.entry(LOCK).with_context(explain)?.is_none();
        for wait in [20, 100, 0] {
            match directory.lock(LOCK).with_context(explain)? {
                Lock::Own(file) => return Ok(Self { _file: Some(file), is_new }),
                // `runs` locks the file for a moment.
                Lock::OfOther => std::thread::sleep(Duration::from_millis(wait)),
                Lock::NotOffered => {
                    let folder = directory.path().display();
                    crate::command::output::complain(&format!(
                        "note: the file system of {folder} has no locks; make sure that no other process runs in this folder"
                    ));
                    return Ok(Self { _file: None, is_new });
                }
            }
        }
        let why = format!("another process runs in {}; wait for its end, or stop it", directory.path().display());
        Err(Occupied(why).into())
    }

    /// Releases a folder that is not used, and removes the lock file if it is new.
    pub fn withdraw(self, directory: &Directory) {
        if self.is_new {
            drop(directory.remove(LOCK));
        }
    }
}
