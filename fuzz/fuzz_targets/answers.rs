//! Any bytes in the place of the answers of a program, as they are and as lines with hashes that fit: they are read, or rejected with
//! a reason.
#![no_main]

use linkwright::responses::program::{ExternalProgram, ProgramAnalysis};
use linkwright::storage::{Directory, fnv1a};
use std::sync::LazyLock;

static PLACE: LazyLock<Directory> = LazyLock::new(|| {
    let path = std::env::temp_dir().join(format!("linkwright-answers-{}", std::process::id()));
    Directory::create(&path).expect("the temporary folder can be written to")
});

/// The file: a first line that fits, and any further lines.
const NAME: &str = "answers.jsonl";

/// A line with the hash of its content, if it is a JSON object without one.
fn sealed(line: &[u8]) -> Vec<u8> {
    match std::str::from_utf8(line) {
        Ok(text) if text.starts_with('{') => format!("{{\"hash\":\"{:016x}\",{}\n", fnv1a(text), &text[1..]).into_bytes(),
        _ => [line, b"\n"].concat(),
    }
}

fn read(bytes: &[u8]) {
    let responses = [("a", true), ("m", false)];
    let analysis = ProgramAnalysis::new(ExternalProgram::new(["true"]), ["k", "c"], &[0.0, 0.5], responses).expect("it is good");
    PLACE.replace(NAME, b"", false).expect("it can be written");
    analysis.keep_answers_in(&PLACE, NAME).expect("the file is empty");
    PLACE.appender(NAME).and_then(|mut file| file.append(bytes)).expect("it can be written");
    if let Err(error) = analysis.read_answers_from(&PLACE, NAME) {
        assert!(!error.to_string().is_empty());
    }
}

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    read(bytes);
    read(&bytes.split(|byte| *byte == b'\n').flat_map(sealed).collect::<Vec<u8>>());
});
