//! Parts of the text of a model: its own text, and the texts of attached files, each after a line with its name.

use std::ops::Range;

/// The line before an attached text begins with this, and ends with its name.
pub const MARK: &str = "#@ file ";

/// An attached text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttachedText<'a> {
    /// Its path, relative to the folder of the model.
    pub name: &'a str,
    /// Its bytes in the whole text.
    pub span: Range<usize>,
}

/// The end of the model's own text, and the texts attached to it.
pub fn split(text: &str) -> (usize, Vec<AttachedText<'_>>) {
    let mut found: Vec<AttachedText<'_>> = vec![];
    let (mut own, mut at) = (None, 0);
    for line in text.split_inclusive('\n') {
        if let Some(name) = line.strip_prefix(MARK) {
            own.get_or_insert(at);
            if let Some(last) = found.last_mut() {
                last.span.end = at;
            }
            let begin = at + line.len();
            found.push(AttachedText { name: name.trim(), span: begin..text.len() });
        }
        at += line.len();
    }
    (own.unwrap_or(text.len()), found)
}

/// The part of a text with these bytes: its name, `None` for the model's own text, and its bytes.
pub fn part_at(text: &str, byte: usize) -> (Option<&str>, Range<usize>) {
    let (own, attached) = split(text);
    let is_there = |part: &&AttachedText<'_>| byte >= part.span.start && byte <= part.span.end;
    match attached.iter().rfind(is_there) {
        Some(part) if byte >= own => (Some(part.name), part.span.clone()),
        _ => (None, 0..own),
    }
}
