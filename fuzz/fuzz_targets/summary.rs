//! A file `summary.json` of any bytes: the run is listed.
#![no_main]

use linkwright_fuzz::any_folder::AnyFolder;
use std::sync::LazyLock;

static FOLDER: LazyLock<AnyFolder> = LazyLock::new(|| AnyFolder::new("summary", "automatic"));

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    FOLDER.is_listed("summary.json", bytes);
});
