//! Calls of the standard library, for systems without open folders. A name is checked before the call that uses it.

use super::entry::EntryKind;
use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};

/// Path of a folder.
pub type Handle = PathBuf;

/// Purpose for which a file is opened.
#[derive(Clone, Copy, Debug)]
pub enum Use {
    Read,
    CreateNew,
    Append,
}

pub fn open_folder(path: &Path) -> io::Result<Handle> {
    std::fs::read_dir(path).map(|_| path.to_owned())
}

/// A folder cannot be locked here.
pub fn reopened_folder(_: &Handle) -> io::Result<Option<File>> {
    Ok(None)
}

pub fn open_subfolder(folder: &Handle, name: &str) -> io::Result<Handle> {
    open_folder(&folder.join(name))
}

pub fn make_folder(folder: &Handle, name: &str) -> io::Result<()> {
    std::fs::create_dir(folder.join(name))
}

/// Opens the file of a path of the user's.
pub fn open_path(path: &Path) -> io::Result<File> {
    File::open(path)
}

pub fn open_file(folder: &Handle, name: &str, purpose: Use) -> io::Result<File> {
    if let Ok(EntryKind::Link) = entry(folder, name) {
        return Err(EntryKind::Link.unsuitable());
    }
    let mut options = OpenOptions::new();
    match purpose {
        Use::Read => options.read(true),
        Use::CreateNew => options.write(true).create_new(true),
        Use::Append => options.read(true).append(true).create(true),
    };
    options.open(folder.join(name))
}

/// True for the error of opening a link that is not to be followed: links are found before.
pub fn is_link_error(_: &io::Error) -> bool {
    false
}

pub fn entry(folder: &Handle, name: &str) -> io::Result<EntryKind> {
    let kind = std::fs::symlink_metadata(folder.join(name))?.file_type();
    Ok(match kind {
        kind if kind.is_symlink() => EntryKind::Link,
        kind if kind.is_file() => EntryKind::File,
        kind if kind.is_dir() => EntryKind::Folder,
        _ => EntryKind::Special,
    })
}

pub fn names(folder: &Handle) -> io::Result<Vec<String>> {
    std::fs::read_dir(folder)?.map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned())).collect()
}

pub fn rename(folder: &Handle, from: &str, to: &str) -> io::Result<()> {
    std::fs::rename(folder.join(from), folder.join(to))
}

/// Gives a file a second name, which must not exist.
pub fn link(folder: &Handle, from: &str, to: &str) -> io::Result<()> {
    std::fs::hard_link(folder.join(from), folder.join(to))
}

pub fn remove(folder: &Handle, name: &str) -> io::Result<()> {
    std::fs::remove_file(folder.join(name))
}

/// These systems flush folders themselves.
pub fn flush_folder(_: &Handle) -> io::Result<()> {
    Ok(())
}

/// Number of names (hard links) of a file: not offered by the standard library.
pub fn number_of_names(_: &File) -> io::Result<u64> {
    Ok(1)
}

/// True if `name` is still a name of the open file: these systems do not remove a file that is open.
pub fn is_name_of(folder: &Handle, name: &str, _: &File) -> io::Result<bool> {
    Ok(folder.join(name).exists())
}
