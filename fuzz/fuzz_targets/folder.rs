//! Any bytes in the place of one file of a run, which the first byte chooses: the folder is read, or rejected with a reason.
#![no_main]

use linkwright_fuzz::any_folder::AnyFolder;
use std::sync::LazyLock;

static FOLDER: LazyLock<AnyFolder> = LazyLock::new(|| AnyFolder::new("folder"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    FOLDER.any_file(bytes);
});
