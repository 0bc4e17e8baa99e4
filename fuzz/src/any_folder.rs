//! Any bytes in the place of a file of a run: the folder is read, or rejected with a reason. Used by random edits in the tests of the
//! command, and by the fuzz targets.

use crate::command::optimize::{Optimize, ProgressForm};
use crate::command::report::DrawnReport;
use crate::command::run_directory::RunDirectory;
use crate::command::run_entry::below;
use linkwright::model_file::read;
use linkwright::storage::{Directory, fnv1a};
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Methods whose states differ in what they store: models and trust regions, conservatism, earlier designs, second derivatives.
pub const PRESETS: [&str; 4] = ["automatic", "gcmma", "multipoint", "hessian"];

/// A folder with a run, and its files as they were written.
pub struct AnyFolder {
    path: PathBuf,
    files: BTreeMap<String, Vec<u8>>,
}

impl AnyFolder {
    /// A folder for each of the [`PRESETS`].
    pub fn all(name: &str) -> [Self; PRESETS.len()] {
        PRESETS.map(|preset| Self::new(&format!("{name}-{preset}"), preset))
    }

    /// Runs some cycles of a small problem in a temporary folder.
    pub fn new(name: &str, preset: &str) -> Self {
        let path = std::env::temp_dir().join(format!("linkwright-any-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        let text = include_str!("../../examples/models/two-bar-truss.toml");
        let text = text.replace("preset = \"gcmma\"", &format!("preset = \"{preset}\"\nmax_cycles = 3"));
        let model = read("m.toml", &text).expect("the example is good");
        let directory = Directory::create(&path).expect("the temporary folder can be written to");
        Optimize::in_directory(directory, &model, &text, Path::new("m.toml"), false, &ProgressForm::QUIET)
            .expect("it runs");
        let entries = std::fs::read_dir(&path).expect("the folder exists").flatten();
        let file = |entry: std::fs::DirEntry| {
            (entry.file_name().to_string_lossy().into_owned(), std::fs::read(entry.path()).expect("it is a file"))
        };
        let files = entries.map(file).collect();
        Self { path, files }
    }

    /// A file as it was written.
    pub fn good(&self, name: &str) -> &[u8] {
        &self.files[name]
    }

    /// Reads the folder with other bytes in the place of some files, writes its report, and continues its run by a step. Returns
    /// `true` if that is possible.
    pub fn is_read(&self, changed: &[(&str, &[u8])]) -> bool {
        let put = |name: &str, bytes: &[u8]| std::fs::write(self.path.join(name), bytes).expect("it can be written");
        changed.iter().for_each(|(name, bytes)| put(name, bytes));
        let ended = self.all_readings();
        changed.iter().for_each(|(name, _)| put(name, &self.files[*name]));
        match ended {
            Ok(()) => true,
            Err(error) => {
                assert!(!format!("{error:#}").is_empty());
                false
            }
        }
    }

    #[cfg_attr(test, allow(dead_code, reason = "for the fuzz target of the summary"))]
    /// Lists the run with other bytes in the place of a file, as `linkwright runs` does.
    pub fn is_listed(&self, name: &str, bytes: &[u8]) {
        std::fs::write(self.path.join(name), bytes).expect("it can be written");
        assert_eq!(below(std::slice::from_ref(&self.path)).len(), 1);
        below(std::slice::from_ref(&self.path)).iter().for_each(|run| drop(serde_json::to_string(run)));
    }

    fn all_readings(&self) -> anyhow::Result<()> {
        below(std::slice::from_ref(&self.path)).iter().for_each(|run| drop(serde_json::to_string(run)));
        let (folder, model, text) = RunDirectory::open(&self.path)?;
        let problem = model.problem()?;
        if let Some(last) = folder.last(&model, &problem)? {
            // A step from meaningless numbers may fail, but must not panic.
            drop(model.method().step(&problem, last.state));
        }
        DrawnReport::new(&folder, &model, Some(0), false)?.store(folder, &model, &text).map(drop)
    }

    /// Any bytes as a state: alone, and as the state in a file with a checksum that fits.
    pub fn state(&self, bytes: &[u8]) -> bool {
        let alone = self.is_read(&[("state.json", bytes)]);
        let Ok(text) = std::str::from_utf8(bytes) else { return alone };
        alone | self.is_read(&[("state.json", sealed(text).as_bytes())])
    }

    /// Any bytes as a history, with a state that names them.
    pub fn history(&self, bytes: &[u8]) -> bool {
        let mut state: Value = serde_json::from_slice(self.good("state.json")).expect("it is JSON");
        let is_cycle = |line: &&[u8]| line.starts_with(b"{\"event\":\"cycle\"") && line.ends_with(b"\n");
        let (mut end, mut length, mut cycles) = (0, 0, 0);
        for line in bytes.split_inclusive(|byte| *byte == b'\n') {
            length += line.len();
            if is_cycle(&line) {
                (end, cycles) = (length, cycles + 1);
            }
        }
        let mut hash = linkwright::storage::Fnv1a::default();
        hash.add(&bytes[..end]);
        let prefix = serde_json::json!({ "cycles": cycles, "bytes": end, "hash": format!("{:016x}", hash.value()) });
        state["history"] = prefix;
        let state = sealed(&state.to_string());
        self.is_read(&[("history.jsonl", bytes), ("state.json", state.as_bytes())])
    }

    /// Any bytes as one of the files: the first byte chooses it.
    pub fn any_file(&self, bytes: &[u8]) -> bool {
        const NAMES: [&str; 7] = [
            "run.json",
            "summary.json",
            "files.json",
            "model.toml",
            "state.json",
            "state-previous.json",
            "history.jsonl",
        ];
        let Some((first, bytes)) = bytes.split_first() else { return false };
        self.is_read(&[(NAMES[usize::from(*first) % NAMES.len()], bytes)])
    }
}

impl Drop for AnyFolder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.path));
    }
}

#[cfg_attr(test, allow(dead_code, reason = "for the fuzz targets"))]
/// The folder that the first byte chooses, and the other bytes; `None` without a byte.
pub fn chosen<'f, 'b>(folders: &'f [AnyFolder], bytes: &'b [u8]) -> Option<(&'f AnyFolder, &'b [u8])> {
    let (first, rest) = bytes.split_first()?;
    Some((&folders[usize::from(*first) % folders.len()], rest))
}

/// A text with the checksum of its content in the place of the first checksum.
pub fn sealed(text: &str) -> String {
    let Some(begin) = text.find("fnv1a64:").map(|place| place + 8) else { return text.to_owned() };
    let (Some(head), Some(tail)) = (text.get(..begin), text.get(begin + 16..)) else { return text.to_owned() };
    let hash = fnv1a(&format!("{head}{}{tail}", "0".repeat(16)));
    format!("{head}{hash:016x}{tail}")
}

#[cfg(test)]
mod tests {
    use super::*;

    const BYTES: &[u8] = b"0123456789.-+[]{}\",:enulltrf \n\0\xff";

    /// SplitMix64: the same numbers in every run.
    struct Draw(u64);

    impl Draw {
        fn below(&mut self, end: usize) -> usize {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            (z ^ (z >> 31)) as usize % end.max(1)
        }

        /// Some edits: a byte, a piece removed, a piece doubled, a number replaced.
        fn edit(&mut self, bytes: &mut Vec<u8>) {
            for _ in 0..=self.below(2) {
                let (from, to) = (self.below(bytes.len()), self.below(bytes.len()));
                let end = (from + self.below(30)).min(bytes.len());
                match self.below(5) {
                    0 => drop(bytes.drain(from..end)),
                    1 => drop(bytes.splice(to..to, bytes[from..end].to_vec())),
                    2 => bytes[to] = BYTES[self.below(BYTES.len())],
                    _ => self.replace_number(bytes, from),
                }
                if bytes.is_empty() {
                    break;
                }
            }
        }

        fn replace_number(&mut self, bytes: &mut Vec<u8>, from: usize) {
            const NUMBERS: [&str; 12] =
                ["0", "-1", "1", "2", "7", "1e300", "-1e300", "1e-320", "18446744073709551615", "null", "[]", "0.5"];
            let is_number = |byte: &u8| byte.is_ascii_digit() || b".-+eE".contains(byte);
            let Some(begin) = bytes[from..].iter().position(u8::is_ascii_digit).map(|k| from + k) else { return };
            let end = bytes[begin..].iter().position(|byte| !is_number(byte)).map_or(bytes.len(), |k| begin + k);
            drop(bytes.splice(begin..end, NUMBERS[self.below(NUMBERS.len())].bytes()));
        }
    }

    fn inputs() -> usize {
        std::env::var("INPUTS").ok().and_then(|n| n.parse().ok()).unwrap_or(1500)
    }

    /// Edits one file; returns the part of the inputs that were read.
    fn edits(name: &str, file: &str, read: impl Fn(&AnyFolder, &[u8]) -> bool) -> f64 {
        let (folders, mut draw, mut good) = (AnyFolder::all(name), Draw(3), 0);
        for folder in folders.iter().cycle().take(inputs()) {
            let mut bytes = folder.good(file).to_vec();
            draw.edit(&mut bytes);
            good += usize::from(read(folder, &bytes));
        }
        good as f64 / inputs() as f64
    }

    #[test]
    fn edited_states_are_read_or_rejected() {
        assert!(edits("state", "state.json", AnyFolder::state) > 0.02);
    }

    #[test]
    fn edited_histories_are_read_or_rejected() {
        assert!(edits("history", "history.jsonl", AnyFolder::history) > 0.02);
    }

    #[test]
    fn other_edited_files_are_read_or_rejected() {
        for (k, file) in ["run.json", "summary.json", "files.json", "model.toml"].into_iter().enumerate() {
            let read = |folder: &AnyFolder, bytes: &[u8]| folder.any_file(&[&[k as u8], bytes].concat());
            edits(&format!("other{k}"), file, read);
        }
    }
}
