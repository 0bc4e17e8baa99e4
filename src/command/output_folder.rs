//! Folders into which commands write, with the list of the files that they wrote.
//!
//! `files.json` lists the files that linkwright wrote into a folder. Only these are replaced; other files of the same name are
//! never touched.

use super::output::results;
use anyhow::{Context, anyhow, bail};
use linkwright::report::figure::Figure;
use linkwright::storage::{Directory, EntryKind, Lock};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The list of files.
pub const MANIFEST: &str = "files.json";
/// The file that marks the folder of a run.
pub const RUN: &str = "run.json";
/// The file that marks the folder of a study.
pub const STUDY: &str = "study.json";
/// Files with the results of runs and studies, which no other command may replace. They exist without [`RUN`] or [`STUDY`] if that
/// file is lost.
const KEPT: [&str; 5] = ["history.jsonl", "state.json", "state-previous.json", "answers.jsonl", "rows.jsonl"];
/// Largest size of the list in bytes.
const LIMIT: u64 = 16 << 20;

/// A folder that has a run in it, or in which a process runs.
#[derive(Clone, Debug)]
pub struct Occupied(pub String);

impl fmt::Display for Occupied {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for Occupied {}

/// A folder, and the names of the files that linkwright wrote into it.
pub struct OutputFolder {
    directory: Directory,
    own: BTreeSet<String>,
    /// True for a folder that an earlier version wrote, which has no list.
    is_earlier: bool,
}

#[derive(Serialize, Deserialize)]
struct Manifest {
    version: u32,
    files: BTreeSet<String>,
}

impl OutputFolder {
    /// Opens the folder for the tables and figures of a command, and creates it if it is missing. Rejects the folder of a run or study.
    pub fn create(path: &Path) -> anyhow::Result<Self> {
        let folder = Self::of(create(path)?)?;
        let shown = path.display();
        for (name, what) in [(RUN, "run"), (STUDY, "study")] {
            anyhow::ensure!(folder.directory.entry(name)?.is_none(), "{shown} has a {what} in it; give another folder");
        }
        if let Some(lost) = folder.lost_results()? {
            bail!("{lost}; give another folder");
        }
        Ok(folder)
    }

    /// A message that names the missing file, if the folder has results of a run or study that linkwright wrote, but not the file that
    /// marks it.
    pub fn lost_results(&self) -> anyhow::Result<Option<String>> {
        if self.directory.entry(RUN)?.is_some() || self.directory.entry(STUDY)?.is_some() {
            return Ok(None);
        }
        for name in KEPT.iter().filter(|name| self.owns(name)) {
            if self.directory.entry(name)?.is_some() {
                let missing = if *name == "rows.jsonl" { STUDY } else { RUN };
                return Ok(Some(format!(
                    "{} has {name}, but no {missing}, without which it cannot be continued: restore that file",
                    self.directory.path().display()
                )));
            }
        }
        Ok(None)
    }

    /// An open folder with its list.
    pub fn of(directory: Directory) -> anyhow::Result<Self> {
        let own = listed(&directory)?;
        Ok(Self { directory, own, is_earlier: false })
    }

    /// The folder itself.
    pub fn directory(&self) -> &Directory {
        &self.directory
    }

    /// The path of a file.
    pub fn place(&self, name: &str) -> PathBuf {
        self.directory.path().join(name)
    }

    /// True if linkwright wrote a file.
    pub fn owns(&self, name: &str) -> bool {
        name == MANIFEST || self.own.contains(name)
    }

    /// True if the folder has a list of files.
    pub fn has_list(&self) -> bool {
        !self.own.is_empty()
    }

    /// Rejects names of files that cannot be written: that of a folder, or of a file that exists and is not in the list.
    pub fn check_free<S: AsRef<str>>(&self, names: &[S]) -> anyhow::Result<()> {
        for name in names.iter().map(S::as_ref) {
            let place = self.place(name);
            match self.directory.entry(name)? {
                None => {}
                Some(EntryKind::Folder) => bail!(
                    "{} is a folder, and a file of this name is to be written; move it, or give another folder",
                    place.display()
                ),
                Some(_) if self.is_earlier || self.owns(name) => {}
                Some(_) => {
                    bail!(
                        "{} exists, and linkwright did not write it; move it, or give another folder",
                        place.display()
                    )
                }
            }
        }
        Ok(())
    }

    /// Adds files to the list that are about to be written. Rejects names as [`check_free`](Self::check_free) does.
    pub fn own<S: AsRef<str>>(&mut self, names: &[S]) -> anyhow::Result<()> {
        if names.iter().all(|name| self.own.contains(name.as_ref())) {
            return Ok(());
        }
        let _lock = list_lock(&self.directory);
        // Another process may have written into the folder since the list was read.
        self.own.extend(listed(&self.directory)?);
        let new: Vec<&str> = names.iter().map(S::as_ref).filter(|name| !self.own.contains(*name)).collect();
        self.check_free(&new)?;
        self.own.extend(new.into_iter().map(str::to_owned));
        let text = serde_json::to_string_pretty(&Manifest { version: 1, files: self.own.clone() })?;
        let written = self.directory.replace(MANIFEST, text.as_bytes(), true);
        written.with_context(|| format!("cannot write {}", self.place(MANIFEST).display()))
    }

    /// Removes files that are in the list, and takes them out of it. The list is written with the next file.
    pub fn remove<S: AsRef<str>>(&mut self, names: &[S]) -> anyhow::Result<()> {
        for name in names.iter().map(S::as_ref) {
            if self.is_earlier || self.own.contains(name) {
                let removed = self.directory.remove(name);
                removed.with_context(|| format!("cannot remove {}", self.place(name).display()))?;
                self.own.remove(name);
            }
        }
        Ok(())
    }

    /// Accepts the folder of a run of an earlier version, which has no list: its files are those of every run.
    pub fn accept_earlier(&mut self, files: &[&str]) {
        self.own = files.iter().map(|name| (*name).to_owned()).collect();
        self.is_earlier = true;
    }

    /// A folder in this one, with a list of its own.
    pub fn subfolder(&self, name: &str) -> anyhow::Result<Self> {
        let inner = self.directory.subfolder(name);
        let inner = Self::of(inner.with_context(|| format!("cannot make the folder {}", self.place(name).display()))?)?;
        Ok(Self { is_earlier: self.is_earlier && !inner.has_list(), ..inner })
    }

    /// Writes a file as a whole; returns its path.
    pub fn write(&mut self, name: &str, bytes: &[u8]) -> anyhow::Result<PathBuf> {
        self.own(&[name])?;
        let place = self.place(name);
        self.directory.replace(name, bytes, false).with_context(|| format!("cannot write {}", place.display()))?;
        Ok(place)
    }

    /// Writes a figure as `name.svg` and, for print, as `name.png`.
    pub fn write_figure(&mut self, name: &str, figure: &Figure) -> anyhow::Result<()> {
        self.write(&format!("{name}.svg"), figure.svg()?.as_bytes())?;
        self.write(&format!("{name}.png"), &figure.png(300.0)?).map(drop)
    }
}

/// The names in the list of a folder; none if there is no list.
fn listed(directory: &Directory) -> anyhow::Result<BTreeSet<String>> {
    let place = directory.path().join(MANIFEST);
    let text = directory.read(MANIFEST, LIMIT).with_context(|| format!("cannot read {}", place.display()))?;
    let manifest = text.map(|text| serde_json::from_slice::<Manifest>(&text)).transpose();
    let manifest =
        manifest.with_context(|| format!("{} is not a list of files; give another folder", place.display()))?;
    Ok(manifest.map(|manifest| manifest.files).unwrap_or_default())
}

/// Time to wait for another process that changes the list, in steps of 10 ms. A change takes a few milliseconds.
const LIST_WAITS: usize = 200;

/// The lock of a folder while the list is changed. `None` on a file system without locks, where the list is changed all the same.
fn list_lock(directory: &Directory) -> Option<File> {
    for _ in 0..LIST_WAITS {
        match directory.lock_folder() {
            Ok(Lock::Own(folder)) => return Some(folder),
            Ok(Lock::OfOther) => std::thread::sleep(Duration::from_millis(10)),
            Ok(Lock::NotOffered) | Err(_) => break,
        }
    }
    None
}

/// Opens a folder; creates it and its parents if they are missing.
pub fn create(path: &Path) -> anyhow::Result<Directory> {
    Directory::create(path).with_context(|| format!("cannot make the folder {}", path.display()))
}

/// The path of a run, given as path or as name in the folder of results.
pub fn stored(folder: &Path) -> PathBuf {
    let among = results().join(folder);
    if !folder.exists() && among.exists() { among } else { folder.to_owned() }
}

/// The folder of a run or study that exists.
///
/// # Errors
///
/// If there is no such folder, with what to give in its place.
pub fn opened(path: &Path) -> anyhow::Result<Directory> {
    let shown = path.display();
    Directory::open(path).map_err(|error| match path.metadata() {
        Ok(file) if file.is_file() => anyhow!(
            "{shown} is a file; give the folder of a run, which `linkwright optimize` names at its end, or run `linkwright runs`"
        ),
        Err(missing) if missing.kind() == std::io::ErrorKind::NotFound => {
            anyhow!("there is no folder {shown}; `linkwright runs` lists the stored runs")
        }
        _ => anyhow::Error::new(error).context(format!("cannot open the folder {shown}")),
    })
}

/// The folder of a name in the default folder of results. A link of that name is not followed.
pub fn in_results(results: &Path, name: &str) -> anyhow::Result<Directory> {
    let place = results.join(name);
    create(results)?.subfolder(name).with_context(|| format!("cannot make the folder {}", place.display()))
}

/// The name of the folder of the results of a model or study file.
pub fn name_of(file: &Path) -> anyhow::Result<String> {
    let name = file.file_stem().and_then(|name| name.to_str()).filter(|name| !name.starts_with('.'));
    let name = name.with_context(|| {
        format!("the name of {} cannot be that of a folder; give a folder with --out", file.display())
    })?;
    Ok(name.to_owned())
}

/// Largest number at the end of the name of a folder.
const NUMBERED: usize = 9999;

/// Opens NAME in the folder of results, or the first of NAME-2, NAME-3, … that is not [`Occupied`]; with `force`, only NAME. A path is
/// returned for a folder with a number.
pub fn numbered<T>(
    name: &str,
    force: bool,
    open: impl Fn(Directory) -> anyhow::Result<T>,
) -> anyhow::Result<(T, Option<PathBuf>)> {
    let mut number = 1;
    loop {
        let numbered = if number == 1 { name.to_owned() } else { format!("{name}-{number}") };
        let directory = in_results(&results(), &numbered)?;
        let path = directory.path().to_owned();
        match open(directory) {
            Err(error) if error.is::<Occupied>() && !force && number < NUMBERED => number += 1,
            opened => return Ok((opened?, (number > 1).then_some(path))),
        }
    }
}

/// True if an entry of a folder is a regular file or a folder.
pub fn has(directory: &Directory, name: &str) -> bool {
    matches!(directory.entry(name), Ok(Some(EntryKind::File | EntryKind::Folder)))
}
