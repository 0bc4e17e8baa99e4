//! Calls of Unix systems, relative to an open folder.

use super::entry::EntryKind;
use rustix::fs::{AtFlags, CWD, Dir, FileType, Mode, OFlags};
use std::fs::File;
use std::io;
use std::os::fd::OwnedFd;
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// An open folder.
pub type Handle = OwnedFd;

/// Purpose for which a file is opened.
#[derive(Clone, Copy, Debug)]
pub enum Use {
    Read,
    CreateNew,
    Append,
}

const FOLDER: OFlags = OFlags::RDONLY.union(OFlags::DIRECTORY).union(OFlags::CLOEXEC);
/// A pipe or a device does not make the call wait.
const PLAIN: OFlags = OFlags::NONBLOCK.union(OFlags::NOCTTY).union(OFlags::CLOEXEC);

pub fn open_folder(path: &Path) -> io::Result<Handle> {
    Ok(rustix::fs::openat(CWD, path, FOLDER, Mode::empty())?)
}

/// The folder, opened once more: a lock belongs to one opening.
pub fn reopened_folder(folder: &Handle) -> io::Result<Option<File>> {
    Ok(Some(rustix::fs::openat(folder, ".", FOLDER, Mode::empty())?.into()))
}

pub fn open_subfolder(folder: &Handle, name: &str) -> io::Result<Handle> {
    Ok(rustix::fs::openat(folder, name, FOLDER | OFlags::NOFOLLOW, Mode::empty())?)
}

pub fn make_folder(folder: &Handle, name: &str) -> io::Result<()> {
    Ok(rustix::fs::mkdirat(folder, name, Mode::from_raw_mode(0o777))?)
}

/// Opens the file of a path of the user's.
pub fn open_path(path: &Path) -> io::Result<File> {
    Ok(rustix::fs::openat(CWD, path, OFlags::RDONLY | PLAIN, Mode::empty())?.into())
}

pub fn open_file(folder: &Handle, name: &str, purpose: Use) -> io::Result<File> {
    let flags = match purpose {
        Use::Read => OFlags::RDONLY,
        Use::CreateNew => OFlags::WRONLY | OFlags::CREATE | OFlags::EXCL,
        Use::Append => OFlags::RDWR | OFlags::APPEND | OFlags::CREATE,
    };
    let opened = rustix::fs::openat(folder, name, flags | PLAIN | OFlags::NOFOLLOW, Mode::from_raw_mode(0o666));
    let explained = |error: io::Error| match is_link_error(&error) {
        true => EntryKind::Link.unsuitable(),
        false => error,
    };
    opened.map(File::from).map_err(|error| explained(error.into()))
}

/// True for the error of opening a link that is not to be followed.
pub fn is_link_error(error: &io::Error) -> bool {
    error.raw_os_error() == Some(rustix::io::Errno::LOOP.raw_os_error())
}

pub fn entry(folder: &Handle, name: &str) -> io::Result<EntryKind> {
    let found = rustix::fs::statat(folder, name, AtFlags::SYMLINK_NOFOLLOW)?;
    Ok(match FileType::from_raw_mode(found.st_mode) {
        FileType::RegularFile => EntryKind::File,
        FileType::Directory => EntryKind::Folder,
        FileType::Symlink => EntryKind::Link,
        _ => EntryKind::Special,
    })
}

pub fn names(folder: &Handle) -> io::Result<Vec<String>> {
    let mut names = vec![];
    for entry in Dir::read_from(folder)? {
        let name = entry?.file_name().to_string_lossy().into_owned();
        if name != "." && name != ".." {
            names.push(name);
        }
    }
    Ok(names)
}

pub fn rename(folder: &Handle, from: &str, to: &str) -> io::Result<()> {
    Ok(rustix::fs::renameat(folder, from, folder, to)?)
}

/// Gives a file a second name, which must not exist.
pub fn link(folder: &Handle, from: &str, to: &str) -> io::Result<()> {
    Ok(rustix::fs::linkat(folder, from, folder, to, AtFlags::empty())?)
}

pub fn remove(folder: &Handle, name: &str) -> io::Result<()> {
    Ok(rustix::fs::unlinkat(folder, name, AtFlags::empty())?)
}

pub fn flush_folder(folder: &Handle) -> io::Result<()> {
    match rustix::fs::fsync(folder) {
        // Some network file systems cannot flush a folder.
        Err(rustix::io::Errno::INVAL | rustix::io::Errno::NOTSUP | rustix::io::Errno::ROFS) | Ok(()) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// Number of names (hard links) of a file.
pub fn number_of_names(file: &File) -> io::Result<u64> {
    Ok(file.metadata()?.nlink())
}

/// True if `name` is still a name of the open file.
pub fn is_name_of(folder: &Handle, name: &str, file: &File) -> io::Result<bool> {
    let open = rustix::fs::fstat(file)?;
    match rustix::fs::statat(folder, name, AtFlags::SYMLINK_NOFOLLOW) {
        Ok(found) => Ok((found.st_dev, found.st_ino) == (open.st_dev, open.st_ino)),
        Err(rustix::io::Errno::NOENT) => Ok(false),
        Err(error) => Err(error.into()),
    }
}
