//! Stored runs: a hash that does not depend on the machine, and the one place where files are read and written.
//!
//! | file | content |
//! |---|---|
//! | `directory` | [`Directory`]: files of a folder, without following links; temporary names; bounded reads |
//! | `entry` | [`EntryKind`]: kinds of entries of a folder |
//! | `system` | the calls of the operating system |
//! | `matrix` | matrices from a file, with checked sizes |

mod directory;
mod entry;
pub(crate) mod matrix;
#[cfg_attr(not(unix), path = "system_any.rs")]
mod system;

pub use directory::{Appender, Directory, Lock, Operation, Watch, read_file};
pub use entry::EntryKind;

use std::io;
use std::path::Path;

/// FNV-1a hash of a text, the same on every machine and in every version. It is not cryptographic.
///
/// # Sources
/// G. Fowler, L. C. Noll, K.-P. Vo and D. Eastlake, *The FNV non-cryptographic hash algorithm*, RFC 9923.
pub fn fnv1a(text: &str) -> u64 {
    let mut hash = Fnv1a::default();
    hash.add(text.as_bytes());
    hash.value()
}

/// The hash [`fnv1a`] of bytes that come one after the other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fnv1a(u64);

impl Default for Fnv1a {
    fn default() -> Self {
        Self(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv1a {
    /// Appends bytes to the hashed ones.
    pub fn add(&mut self, bytes: &[u8]) {
        self.0 = bytes.iter().fold(self.0, |hash, byte| (hash ^ u64::from(*byte)).wrapping_mul(0x0100_0000_01b3));
    }

    /// The hash of all bytes so far.
    pub fn value(self) -> u64 {
        self.0
    }
}

/// Replaces a file atomically, as [`Directory::replace`] in the folder of `path`.
///
/// With `flushed`, file and folder are flushed to disk, so that the new content survives a power cut.
///
/// # Errors
/// Those of the file system. After an error the former file is unchanged.
pub fn replace_file(path: &Path, content: &[u8], flushed: bool) -> io::Result<()> {
    let (folder, name) = split(path)?;
    Directory::open(folder)?.replace(name, content, flushed)
}

/// Folder and file name of a path.
fn split(path: &Path) -> io::Result<(&Path, &str)> {
    let name = path.file_name().and_then(|name| name.to_str());
    let name = name.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidInput, "the path has no file name in UTF-8"))?;
    Ok((path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new(".")), name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_reference() {
        assert_eq!([fnv1a(""), fnv1a("foobar")], [0xcbf2_9ce4_8422_2325, 0x8594_4171_f739_67e8]);
        let mut parts = Fnv1a::default();
        ["foo", "", "bar"].iter().for_each(|part| parts.add(part.as_bytes()));
        assert_eq!(parts.value(), fnv1a("foobar"));
    }
}
