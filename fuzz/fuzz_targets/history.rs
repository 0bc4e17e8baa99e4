//! A file `history.jsonl` of any bytes, with checksums that fit: the folder is read, or rejected with a reason.
#![no_main]

use linkwright_fuzz::any_folder::AnyFolder;
use std::sync::LazyLock;

static FOLDER: LazyLock<AnyFolder> = LazyLock::new(|| AnyFolder::new("history"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    FOLDER.history(bytes);
});
