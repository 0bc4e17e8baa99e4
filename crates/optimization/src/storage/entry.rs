//! Kinds of entries of a folder, and the errors about them.

use std::io;

/// Kind of an entry of a folder. Links are not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EntryKind {
    /// A regular file.
    File,
    /// A folder.
    Folder,
    /// A symbolic link.
    Link,
    /// A device, a pipe, a socket.
    Special,
}

impl EntryKind {
    /// The error about an entry of this kind where another kind is needed.
    pub(super) fn unsuitable(self) -> io::Error {
        io::Error::new(
            io::ErrorKind::InvalidInput,
            match self {
                Self::File => "it is a file, not a folder",
                Self::Folder => "it is a folder, not a file",
                Self::Link => "it is a symbolic link, and links are not followed here; remove it",
                Self::Special => "it is not a regular file",
            },
        )
    }
}
