//! `state.json`: everything that `resume` needs except for the history, which is in `history.jsonl`.
//!
//! The file is one line: version, checksum, fingerprint of the model, part of the history, state. The checksum is the hash of the
//! whole file with zeros in place of its digits. It binds the parts to each other; it does not protect against an author who computes
//! it again.

use super::records::{Prefix, STATE_FILE_VERSION};
use anyhow::{Context, bail};
use linkwright::sao::{RunState, STATE_VERSION};
use linkwright::storage::{Directory, fnv1a};
use serde::{Deserialize, Serialize};

/// The state after the last cycle, and the one before it.
pub const STATE: &str = "state.json";
pub const PREVIOUS: &str = "state-previous.json";
/// Name of the hash, before its digits.
const HASH: &str = "fnv1a64:";
const DIGITS: usize = 16;

#[derive(Serialize, Deserialize)]
struct StateFile<S> {
    version: u32,
    checksum: String,
    model: String,
    history: Prefix,
    state: S,
}

/// A state that was read.
pub enum StoredState {
    /// A state without its history, and the part of the history that belongs to it.
    Bound(RunState, Prefix),
    /// A state with its history, of an earlier version: it has no checksum.
    Old(RunState),
}

/// The content of the file.
pub fn sealed(state: &mut RunState, model: &str, history: &Prefix) -> anyhow::Result<String> {
    let checksum = format!("{HASH}{}", "0".repeat(DIGITS));
    let text = state.without_history(|state| {
        let (model, history) = (model.to_owned(), history.clone());
        serde_json::to_string(&StateFile { version: STATE_FILE_VERSION, checksum, model, history, state })
    })?;
    let digits = text.find(HASH).map_or(0, |place| place + HASH.len());
    Ok(format!("{}{:016x}{}\n", &text[..digits], fnv1a(&(text.clone() + "\n")), &text[digits + DIGITS..]))
}

/// True if the checksum is that of the content.
fn is_sealed(text: &str) -> bool {
    let Some(digits) = text.find(HASH).map(|place| place + HASH.len()) else { return false };
    let (Some(head), Some(found), Some(tail)) =
        (text.get(..digits), text.get(digits..digits + DIGITS), text.get(digits + DIGITS..))
    else {
        return false;
    };
    found == format!("{:016x}", fnv1a(&format!("{head}{}{tail}", "0".repeat(DIGITS))))
}

/// Reads a state file of at most `limit` bytes for a model; `None` if it does not exist.
pub fn read(directory: &Directory, name: &str, model: &str, limit: u64) -> anyhow::Result<Option<StoredState>> {
    #[derive(Deserialize)]
    struct StateHead {
        version: u32,
    }
    let place = directory.path().join(name);
    let unreadable = || format!("{} is not readable", place.display());
    let bytes = directory.read(name, limit).with_context(|| format!("cannot read {}", place.display()))?;
    let Some(bytes) = bytes else { return Ok(None) };
    let text = String::from_utf8(bytes).with_context(unreadable)?;
    let StateHead { version } = serde_json::from_str(&text).with_context(unreadable)?;
    let shown = place.display();
    match version {
        STATE_VERSION => Ok(Some(StoredState::Old(serde_json::from_str(&text).with_context(unreadable)?))),
        STATE_FILE_VERSION => {
            if !is_sealed(&text) {
                bail!("{shown} was changed or damaged: its checksum is not that of its content");
            }
            let file: StateFile<RunState> = serde_json::from_str(&text).with_context(unreadable)?;
            if file.model != model {
                let other = file.model;
                bail!("{shown} is the state of another model (fingerprint {other}, expected {model})");
            }
            Ok(Some(StoredState::Bound(file.state, file.history)))
        }
        other => bail!(
            "{shown} has version {other}, this program reads versions {STATE_VERSION} and {STATE_FILE_VERSION}; continue it with the release \
             that wrote it"
        ),
    }
}
