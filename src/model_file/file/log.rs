//! The mistakes of a file that is being read, and where its parts stand.

use super::section::Read;
use crate::model_file::Diagnostic;
use std::cell::{Cell, RefCell};
use std::collections::{HashMap, HashSet};
use std::ops::Range;

/// Mistakes that are shown at once.
const MOST: usize = 10;

/// What has been found so far.
#[derive(Debug, Default)]
pub struct Log {
    mistakes: RefCell<Vec<Diagnostic>>,
    /// Names that would be known if what defines them were right.
    spoiled: RefCell<HashSet<String>>,
    all_spoiled: Cell<bool>,
    places: RefCell<HashMap<String, Range<usize>>>,
}

/// The text of a file with what has been found in it.
#[derive(Clone, Copy, Debug)]
pub struct FileSource<'a> {
    pub text: &'a str,
    pub log: &'a Log,
}

impl Log {
    /// Notes a mistake, unless it follows from one that is known.
    pub fn note(&self, mistake: Diagnostic) {
        let mut mistakes = self.mistakes.borrow_mut();
        let follows = mistake.asked.as_deref().is_some_and(|name| self.is_spoiled(name));
        let is_known = mistakes.iter().any(|m| m.span == mistake.span && m.message == mistake.message);
        if mistakes.is_empty() || !(follows || is_known || mistakes.len() >= MOST) {
            mistakes.push(mistake);
        }
    }

    /// What was read, or nothing and a note.
    pub fn keep<T>(&self, read: Read<T>) -> Option<T> {
        read.map_err(|mistake| self.note(mistake)).ok()
    }

    /// A name whose definition is wrong: that it is not known is no mistake of those who use it.
    pub fn poison(&self, name: &str) {
        self.spoiled.borrow_mut().insert(name.to_owned());
    }

    /// The same for names that cannot be told.
    pub fn poison_all(&self) {
        self.all_spoiled.set(true);
    }

    /// Whether a name, or what it is a part of, is spoiled: `pin` spoils `pin.force_x`.
    fn is_spoiled(&self, name: &str) -> bool {
        let spoiled = self.spoiled.borrow();
        let ends = name.match_indices('.').map(|(k, _)| k).chain([name.len()]);
        self.all_spoiled.get() || ends.into_iter().any(|end| spoiled.contains(&name[..end]))
    }

    /// Remembers where a part stands.
    pub fn place(&self, name: &str, span: Range<usize>) {
        self.places.borrow_mut().entry(name.to_owned()).or_insert(span);
    }

    /// An end to the reading if there is any mistake.
    pub fn stop(&self) -> Read<()> {
        self.mistakes.borrow().first().map_or(Ok(()), |mistake| Err(mistake.clone()))
    }

    /// All mistakes in the order of the file, and where parts stand.
    pub fn into_parts(self) -> (Vec<Diagnostic>, HashMap<String, Range<usize>>) {
        let mut mistakes = self.mistakes.into_inner();
        mistakes.sort_by_key(|m| m.span.start);
        (mistakes, self.places.into_inner())
    }
}
