//! Files of one folder, each by its name alone.

use super::entry::EntryKind;
use super::system;
use std::collections::hash_map::RandomState;
use std::fs::{File, TryLockError};
use std::hash::{BuildHasher, Hasher};
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Kind of an operation on a file, for a [`Watch`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operation {
    /// A new file, a new folder, or a file opened for appending.
    Create,
    /// Bytes written to a file.
    Write,
    /// A file or a folder flushed to disk.
    Flush,
    /// A file renamed.
    Rename,
    /// A file removed, or cut at its end.
    Remove,
    /// A file or a list of files read.
    Read,
    /// A file locked.
    Lock,
}

/// A function that sees every operation with the name of its file, and may return the error with which it fails.
pub type Watch = Arc<dyn Fn(Operation, &str) -> io::Result<()> + Send + Sync>;

/// A folder that was opened once; files are reached by their names in it.
///
/// No name is followed through a symbolic link. Only regular files are opened, so that no device or pipe is read or written.
/// Files are replaced by a temporary file with a random name, which must not exist before. On systems other than
/// Unix the checks of names come before the calls that use them, not with them.
#[derive(Clone)]
pub struct Directory {
    path: PathBuf,
    handle: Arc<system::Handle>,
    watch: Option<Watch>,
}

/// Bytes that are left after a temporary name.
const PART: &str = ".part";

impl Directory {
    /// Opens a folder. The path itself may contain links: its author is the user.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn open(path: &Path) -> io::Result<Self> {
        Ok(Self { path: path.to_owned(), handle: Arc::new(system::open_folder(path)?), watch: None })
    }

    /// Opens a folder; creates it and its parents if they are missing.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create(path: &Path) -> io::Result<Self> {
        std::fs::create_dir_all(path)?;
        Self::open(path)
    }

    /// Passes every operation to `watch`, which may let it fail. A write that fails stores the first half of its bytes, as a full
    /// disk does.
    #[must_use]
    pub fn watched(self, watch: Watch) -> Self {
        Self { watch: Some(watch), ..self }
    }

    /// The path with which the folder was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// A folder in this one, created if it is missing. A link is rejected.
    ///
    /// # Errors
    /// Those of the file system; `InvalidInput` for a name that is a path.
    pub fn subfolder(&self, name: &str) -> io::Result<Self> {
        self.before(Operation::Create, name)?;
        let handle = match self.entry(name)? {
            Some(EntryKind::Folder) => system::open_subfolder(&self.handle, name),
            Some(other) => Err(other.unsuitable()),
            None => match system::make_folder(&self.handle, name) {
                // Another process has made it since.
                Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
                made => made,
            }
            .and_then(|()| system::open_subfolder(&self.handle, name)),
        }?;
        Ok(Self { path: self.path.join(name), handle: Arc::new(handle), watch: self.watch.clone() })
    }

    /// Kind of an entry; `None` if there is none of that name.
    ///
    /// # Errors
    /// Those of the file system; `InvalidInput` for a name that is a path.
    pub fn entry(&self, name: &str) -> io::Result<Option<EntryKind>> {
        check_name(name)?;
        absent_is_none(system::entry(&self.handle, name))
    }

    /// Names of all entries, sorted. Names that are not UTF-8 are shown with replacement characters.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn names(&self) -> io::Result<Vec<String>> {
        self.before(Operation::Read, ".")?;
        let mut names = system::names(&self.handle)?;
        names.sort();
        Ok(names)
    }

    /// Opens a regular file for reading; `None` if it does not exist.
    ///
    /// # Errors
    /// Those of the file system; also if it is not a regular file.
    pub fn reader(&self, name: &str) -> io::Result<Option<File>> {
        self.before(Operation::Read, name)?;
        absent_is_none(system::open_file(&self.handle, name, system::Use::Read).and_then(regular))
    }

    /// The content of a regular file of at most `limit` bytes; `None` if it does not exist.
    ///
    /// # Errors
    /// Those of the file system; also if it is not a regular file, or larger.
    pub fn read(&self, name: &str, limit: u64) -> io::Result<Option<Vec<u8>>> {
        self.reader(name)?.map(|file| bounded(file, limit)).transpose()
    }

    /// Replaces a file atomically, or creates it. After an error the former file is unchanged. A link of that name is replaced
    /// itself.
    ///
    /// With `flushed`, file and folder are flushed to disk, so that the new content survives a power cut.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn replace(&self, name: &str, content: &[u8], flushed: bool) -> io::Result<()> {
        check_name(name)?;
        let part = temporary_name(name);
        let written = self.write_new(&part, content, flushed).and_then(|()| self.rename(&part, name));
        if let Err(error) = written {
            // Frees the space of the incomplete file.
            drop(self.remove(&part));
            return Err(error);
        }
        if flushed { self.flush() } else { Ok(()) }
    }

    /// Creates a file, which is complete or absent after an error or if the process is killed. An existing one, and a link of that name, are rejected with
    /// `AlreadyExists`.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn create_new(&self, name: &str, content: &[u8]) -> io::Result<()> {
        check_name(name)?;
        if self.entry(name)?.is_some() {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let part = temporary_name(name);
        let named = self.write_new(&part, content, false).and_then(|()| {
            self.before(Operation::Rename, name)?;
            match system::link(&self.handle, &part, name) {
                Err(error) if error.kind() != io::ErrorKind::AlreadyExists => {
                    // A file system without hard links.
                    self.rename(&part, name)
                }
                linked => linked,
            }
        });
        drop(self.remove(&part));
        named
    }

    fn write_new(&self, name: &str, content: &[u8], flushed: bool) -> io::Result<()> {
        self.before(Operation::Create, name)?;
        let mut file = system::open_file(&self.handle, name, system::Use::CreateNew)?;
        self.write_to(&mut file, name, content)?;
        if flushed { self.flush_file(&file, name) } else { Ok(()) }
    }

    /// Opens a regular file for appending, and creates it if it is missing.
    ///
    /// # Errors
    /// Those of the file system; also if it is not a regular file, or if the file has further names (hard links), under which it
    /// would change, too.
    pub fn appender(&self, name: &str) -> io::Result<Appender> {
        self.before(Operation::Create, name)?;
        let file = regular(system::open_file(&self.handle, name, system::Use::Append)?)?;
        if system::number_of_names(&file)? > 1 {
            return Err(io::Error::other("the file has further names (hard links); copy the folder and use the copy"));
        }
        Ok(Appender { file, name: name.to_owned(), directory: self.clone() })
    }

    /// Renames a file; a file of the new name is replaced.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn rename(&self, from: &str, to: &str) -> io::Result<()> {
        check_name(from)?;
        self.before(Operation::Rename, to)?;
        system::rename(&self.handle, from, to)
    }

    /// Removes a file or a link. A missing one is not an error.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn remove(&self, name: &str) -> io::Result<()> {
        self.before(Operation::Remove, name)?;
        absent_is_none(system::remove(&self.handle, name)).map(drop)
    }

    /// Removes the temporary files of these names that remain from killed processes.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn remove_temporary(&self, names: &[&str]) -> io::Result<()> {
        let is_left = |entry: &String| is_temporary(entry) && names.iter().any(|name| belongs(entry, name));
        self.names()?.iter().filter(|entry| is_left(entry)).try_for_each(|entry| self.remove(entry))
    }

    /// Flushes names of files to disk. Systems that cannot flush a folder do so themselves.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn flush(&self) -> io::Result<()> {
        self.before(Operation::Flush, ".")?;
        system::flush_folder(&self.handle)
    }

    /// Locks a file against other processes, without waiting; creates it if it is missing. The system releases the lock when the
    /// process ends, even by a kill.
    ///
    /// # Errors
    /// Those of the file system; also if it is not a regular file.
    pub fn lock(&self, name: &str) -> io::Result<Lock> {
        loop {
            self.before(Operation::Lock, name)?;
            let file = regular(system::open_file(&self.handle, name, system::Use::Append)?)?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Ok(Lock::OfOther),
                Err(TryLockError::Error(_)) => return Ok(Lock::NotOffered),
            }
            // The former owner may have removed the name in the meantime.
            if system::is_name_of(&self.handle, name, &file)? {
                return Ok(Lock::Own(file));
            }
        }
    }

    /// Locks the folder itself against other processes that lock it, without waiting. The lock leaves no file; on systems other than Unix it is not
    /// offered.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn lock_folder(&self) -> io::Result<Lock> {
        self.before(Operation::Lock, ".")?;
        let Some(file) = system::reopened_folder(&self.handle)? else { return Ok(Lock::NotOffered) };
        Ok(match file.try_lock() {
            Ok(()) => Lock::Own(file),
            Err(TryLockError::WouldBlock) => Lock::OfOther,
            Err(TryLockError::Error(_)) => Lock::NotOffered,
        })
    }

    /// True if another process has locked a file.
    pub fn is_locked(&self, name: &str) -> bool {
        let locked = |file: File| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock));
        self.reader(name).is_ok_and(|file| file.is_some_and(locked))
    }

    fn before(&self, operation: Operation, name: &str) -> io::Result<()> {
        if name != "." {
            check_name(name)?;
        }
        self.watch.as_ref().map_or(Ok(()), |watch| watch(operation, name))
    }

    fn write_to(&self, file: &mut File, name: &str, content: &[u8]) -> io::Result<()> {
        if let Err(error) = self.before(Operation::Write, name) {
            file.write_all(&content[..content.len() / 2])?;
            return Err(error);
        }
        file.write_all(content)
    }

    fn flush_file(&self, file: &File, name: &str) -> io::Result<()> {
        self.before(Operation::Flush, name)?;
        file.sync_all()
    }
}

/// Result of [`Directory::lock`].
#[derive(Debug)]
pub enum Lock {
    /// This process has the lock until the file is closed.
    Own(File),
    /// Another process has it.
    OfOther,
    /// The file system has no locks.
    NotOffered,
}

/// A file that is open for appending.
pub struct Appender {
    file: File,
    name: String,
    directory: Directory,
}

impl Appender {
    /// Length of the file in bytes.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn length(&self) -> io::Result<u64> {
        Ok(self.file.metadata()?.len())
    }

    /// Appends bytes. After an error the file may have a part of them.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn append(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.directory.write_to(&mut self.file, &self.name, bytes)
    }

    /// Flushes the bytes to disk.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn flush(&self) -> io::Result<()> {
        self.directory.flush_file(&self.file, &self.name)
    }

    /// Cuts the file after `length` bytes.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn cut(&self, length: u64) -> io::Result<()> {
        self.directory.before(Operation::Remove, &self.name)?;
        self.file.set_len(length)
    }
}

/// The content of a regular file of at most `limit` bytes. Links are followed: the path is the user's.
///
/// # Errors
/// Those of the file system; also if it is not a regular file, or larger.
pub fn read_file(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    bounded(regular(system::open_path(path)?)?, limit)
}

fn bounded(file: File, limit: u64) -> io::Result<Vec<u8>> {
    let too_large = || io::Error::new(io::ErrorKind::FileTooLarge, format!("it has more than {limit} bytes"));
    let length = file.metadata()?.len();
    if length > limit {
        return Err(too_large());
    }
    let mut content = vec![];
    content.try_reserve(length as usize)?;
    file.take(limit + 1).read_to_end(&mut content)?;
    if content.len() as u64 > limit { Err(too_large()) } else { Ok(content) }
}

/// Rejects a file that is not a regular one.
fn regular(file: File) -> io::Result<File> {
    let kind = file.metadata()?.file_type();
    if kind.is_file() {
        return Ok(file);
    }
    Err(if kind.is_dir() { EntryKind::Folder } else { EntryKind::Special }.unsuitable())
}

fn absent_is_none<T>(result: io::Result<T>) -> io::Result<Option<T>> {
    match result {
        Ok(value) => Ok(Some(value)),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(if system::is_link_error(&error) { EntryKind::Link.unsuitable() } else { error }),
    }
}

/// Rejects a name that is empty or a path.
fn check_name(name: &str) -> io::Result<()> {
    if name.is_empty() || name == "." || name == ".." || name.contains(['/', '\\', '\0']) {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, format!("`{name}` is not the name of a file")));
    }
    Ok(())
}

/// A hidden, random name.
fn temporary_name(name: &str) -> String {
    // Every `RandomState` has keys of its own, from the random numbers of the system.
    format!(".{name}.{:016x}{PART}", RandomState::new().build_hasher().finish())
}

/// True for a name that [`Directory::replace`] uses while it writes.
pub(super) fn is_temporary(name: &str) -> bool {
    let middle = name.strip_prefix('.').and_then(|name| name.strip_suffix(PART));
    middle
        .and_then(|name| name.rsplit_once('.'))
        .is_some_and(|(_, digits)| digits.len() == 16 && digits.bytes().all(|digit| digit.is_ascii_hexdigit()))
}

fn belongs(temporary: &str, name: &str) -> bool {
    temporary[1..].strip_prefix(name).is_some_and(|rest| rest.len() == 17 + PART.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn folder(name: &str) -> Directory {
        let path = std::env::temp_dir().join(format!("linkwright-directory-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        Directory::create(&path).unwrap()
    }

    #[test]
    fn files_are_replaced_appended_cut_and_removed() {
        let folder = folder("basic");
        folder.replace("a", b"one", true).unwrap();
        folder.replace("a", b"two", false).unwrap();
        assert_eq!(folder.read("a", 3).unwrap().unwrap(), b"two");
        assert!(folder.read("a", 2).is_err() && folder.read("b", 2).unwrap().is_none());
        let mut log = folder.appender("log").unwrap();
        log.append(b"first\nsecond").unwrap();
        log.cut(6).unwrap();
        log.append(b"third\n").unwrap();
        assert_eq!((folder.read("log", 99).unwrap().unwrap(), log.length().unwrap()), (b"first\nthird\n".to_vec(), 12));
        assert_eq!(folder.create_new("log", b"").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(folder.subfolder("inner").unwrap().path(), folder.path().join("inner"));
        assert_eq!(folder.names().unwrap(), ["a", "inner", "log"]);
        folder.remove("a").unwrap();
        folder.remove("a").unwrap();
        for name in ["", ".", "..", "a/b", "/etc/passwd", "../a", "a\0b"] {
            assert!(folder.read(name, 9).is_err() && folder.replace(name, b"", false).is_err(), "{name:?}");
            assert!(
                folder.remove(name).is_err() && folder.subfolder(name).is_err() && folder.rename(name, "c").is_err()
            );
        }
        std::fs::remove_dir_all(folder.path()).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn a_folder_that_is_made_by_several_at_once_is_opened_by_all() {
        let folder = folder("made-at-once");
        let start = std::sync::Barrier::new(8);
        for round in 0..100 {
            let name = format!("figures-{round}");
            std::thread::scope(|scope| {
                let make = || {
                    start.wait();
                    folder.subfolder(&name).map(drop)
                };
                let all: Vec<_> = (0..8).map(|_| scope.spawn(make)).collect();
                for one in all {
                    one.join().unwrap().unwrap();
                }
            });
        }
    }

    #[test]
    fn the_lock_of_a_folder_belongs_to_one_and_leaves_no_file() {
        let folder = folder("lock-folder");
        let Lock::Own(first) = folder.lock_folder().unwrap() else { panic!() };
        let other = Directory::open(folder.path()).unwrap();
        assert!(matches!(folder.lock_folder().unwrap(), Lock::OfOther));
        assert!(matches!(other.lock_folder().unwrap(), Lock::OfOther));
        drop(first);
        assert!(matches!(other.lock_folder().unwrap(), Lock::Own(_)));
        assert!(folder.names().unwrap().is_empty());
        std::fs::remove_dir_all(folder.path()).unwrap();
    }

    #[test]
    fn a_lock_belongs_to_one_and_survives_the_removal_of_its_name() {
        let folder = folder("lock");
        let Lock::Own(first) = folder.lock("run.lock").unwrap() else { panic!() };
        assert!(matches!(folder.lock("run.lock").unwrap(), Lock::OfOther) && folder.is_locked("run.lock"));
        folder.remove("run.lock").unwrap();
        let Lock::Own(second) = folder.lock("run.lock").unwrap() else { panic!() };
        drop(first);
        assert!(matches!(folder.lock("run.lock").unwrap(), Lock::OfOther));
        drop(second);
        assert!(!folder.is_locked("run.lock"));
        std::fs::remove_dir_all(folder.path()).unwrap();
    }

    #[test]
    fn temporary_files_are_recognized_and_removed() {
        let folder = folder("temporary");
        let (name, other) = (temporary_name("state.json"), temporary_name("other"));
        assert!(name != temporary_name("state.json") && is_temporary(&name) && !is_temporary("a.part"));
        for entry in [name.as_str(), &other, "state.json", ".state.json.part"] {
            folder.create_new(entry, b"").unwrap();
        }
        folder.remove_temporary(&["state.json"]).unwrap();
        assert_eq!(folder.names().unwrap(), [&other, ".state.json.part", "state.json"]);
        std::fs::remove_dir_all(folder.path()).unwrap();
    }

    #[test]
    fn a_failed_write_leaves_the_former_file_and_no_other() {
        let watch: Watch = Arc::new(|operation, _: &str| match operation {
            Operation::Write => Err(io::ErrorKind::StorageFull.into()),
            _ => Ok(()),
        });
        let folder = folder("failure");
        folder.replace("a", b"first", false).unwrap();
        let failing = folder.clone().watched(watch);
        assert_eq!(failing.replace("a", b"second", true).unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(failing.create_new("b", b"new").unwrap_err().kind(), io::ErrorKind::StorageFull);
        assert_eq!(
            (folder.names().unwrap(), folder.read("a", 9).unwrap().unwrap()),
            (vec!["a".to_owned()], b"first".to_vec())
        );
        std::fs::remove_dir_all(folder.path()).unwrap();
    }

    #[cfg(unix)]
    #[test]
    fn links_are_not_followed() {
        let folder = folder("links");
        std::fs::write(folder.path().join("victim"), "own").unwrap();
        for name in ["a", "b"] {
            std::os::unix::fs::symlink("victim", folder.path().join(name)).unwrap();
        }
        std::os::unix::fs::symlink(".", folder.path().join("here")).unwrap();
        assert_eq!(folder.entry("a").unwrap(), Some(EntryKind::Link));
        for error in [
            folder.read("a", 9).unwrap_err(),
            folder.appender("a").map(drop).unwrap_err(),
            folder.lock("a").map(drop).unwrap_err(),
            folder.create_new("a", b"").unwrap_err(),
            folder.subfolder("here").map(drop).unwrap_err(),
        ] {
            assert!(error.to_string().contains("link") || error.kind() == io::ErrorKind::AlreadyExists, "{error}");
        }
        folder.replace("a", b"new", false).unwrap();
        folder.remove("b").unwrap();
        assert_eq!(folder.read("victim", 9).unwrap().unwrap(), b"own");
        std::fs::hard_link(folder.path().join("victim"), folder.path().join("second")).unwrap();
        assert!(folder.appender("second").map(drop).unwrap_err().to_string().contains("hard links"));
        std::fs::remove_dir_all(folder.path()).unwrap();
    }
}
