//! Helpers for stored runs: a hash that does not depend on the machine, and atomic replacement of files.

use std::fs::File;
use std::io::{self, Write};
use std::path::Path;

/// FNV-1a hash of a text, the same on every machine and in every version. It is not cryptographic.
///
/// # Sources
/// G. Fowler, L. C. Noll, K.-P. Vo and D. Eastlake, *The FNV non-cryptographic hash algorithm*, RFC 9923.
pub fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}

/// Replaces a file atomically: writes `NAME.part` and renames it. After an error the former file is unchanged.
///
/// With `flushed`, file and folder are flushed to disk, so that the new content survives a power cut.
///
/// # Errors
/// Those of the file system.
pub fn replace_file(path: &Path, content: &[u8], flushed: bool) -> io::Result<()> {
    let mut part = path.as_os_str().to_owned();
    part.push(".part");
    let part = Path::new(&part);
    let write = || {
        let mut file = File::create(part)?;
        file.write_all(content)?;
        if flushed { file.sync_all() } else { Ok(()) }
    };
    if let Err(error) = write().and_then(|()| std::fs::rename(part, path)) {
        // Frees the space of the incomplete file.
        drop(std::fs::remove_file(part));
        return Err(error);
    }
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // The folder holds the new name. Systems that cannot open a folder as a file flush it themselves.
    if let (true, Ok(folder)) = (flushed, File::open(folder)) {
        drop(folder.sync_all());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_hash_is_that_of_the_reference() {
        assert_eq!([fnv1a(""), fnv1a("foobar")], [0xcbf2_9ce4_8422_2325, 0x8594_4171_f739_67e8]);
    }
}
