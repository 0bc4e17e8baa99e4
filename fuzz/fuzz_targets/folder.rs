//! Any bytes in the place of one file of a run: the folder is read, or rejected with a reason. The first byte chooses the method of
//! the run, the second one the file.
#![no_main]

use linkwright_fuzz::any_folder::{AnyFolder, chosen};
use std::sync::LazyLock;

static FOLDERS: LazyLock<[AnyFolder; 4]> = LazyLock::new(|| AnyFolder::all("folder"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    if let Some((folder, bytes)) = chosen(&*FOLDERS, bytes) {
        folder.any_file(bytes);
    }
});
