//! Files that a model file names: other model files by `include`, and tables of numbers by `file`.
//!
//! Their texts are attached to the text of the model, each after a line with its name. A model with all its files is therefore one text,
//! which is stored with a run, hashed and edited as a whole. Only [`with_files`] opens files.

use super::diagnostics::SecondUse;
use super::text_parts::{AttachedText, MARK, split};
use super::{Diagnostic, DiagnosticReport, limits};
use std::borrow::Cow;
use std::ops::Range;
use std::path::{Component, Path};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Attaches the files that a model names, from its folder. A text that is not TOML is returned unchanged.
///
/// # Errors
/// If a path leaves the folder, a file cannot be read or includes itself, or all files together are too long.
pub fn with_files(file: &str, text: &str, folder: &Path) -> Result<String, Box<DiagnosticReport>> {
    let mut all = text.to_owned();
    let fail = |all: &str, error: Diagnostic| {
        Box::new(DiagnosticReport { file: file.to_owned(), text: all.to_owned(), diagnostics: vec![error] })
    };
    // Parts that are searched for names of files, each with the chain of files that include it.
    let mut parts: Vec<(Range<usize>, Vec<String>)> = vec![(0..split(text).0, vec![])];
    while let Some((part, path)) = parts.pop() {
        let Ok(table) = DeTable::parse(&all[part.clone()]) else { continue };
        let named: Vec<(String, Range<usize>, bool)> = named(table.get_ref(), part.start);
        for (name, span, is_model) in named {
            if path.contains(&name) {
                let circle = path.iter().chain([&name]).map(String::as_str).collect::<Vec<_>>().join(" → ");
                return Err(fail(&all, Diagnostic::new(span, format!("`{name}` includes itself")).help(circle)));
            }
            if split(&all).1.iter().any(|known| known.name == name) {
                continue;
            }
            let content = read(&name, folder, &span).map_err(|error| fail(&all, error))?;
            if all.len() + content.len() > limits::FILE || split(&all).1.len() >= limits::FILES {
                let message =
                    format!("with `{name}` the model has more than {} bytes or {} files", limits::FILE, limits::FILES);
                return Err(fail(&all, Diagnostic::new(span, message)));
            }
            if !all.ends_with('\n') {
                all.push('\n');
            }
            all += &format!("{MARK}{name}\n");
            let begin = all.len();
            all += &content;
            if is_model {
                parts.push((begin..all.len(), path.iter().cloned().chain([name]).collect()));
            }
        }
    }
    Ok(all)
}

/// Names of files in a table, with their places, and whether they are model files.
fn named(table: &DeTable<'_>, offset: usize) -> Vec<(String, Range<usize>, bool)> {
    let place = |value: &Spanned<DeValue<'_>>| value.span().start + offset..value.span().end + offset;
    let mut found = vec![];
    let text = |value: &Spanned<DeValue<'_>>, is_model: bool, found: &mut Vec<_>| {
        found.extend(value.get_ref().as_str().map(|name| (name.to_owned(), place(value), is_model)));
    };
    if let Some(include) = table.get("include") {
        text(include, true, &mut found);
        include
            .get_ref()
            .as_array()
            .into_iter()
            .flat_map(|list| list.iter())
            .for_each(|item| text(item, true, &mut found));
    }
    for table in table.get("table").and_then(|tables| tables.get_ref().as_table()).into_iter().flat_map(|t| t.values())
    {
        let name = table.get_ref().as_table().and_then(|table| table.get("file"));
        name.into_iter().for_each(|name| text(name, false, &mut found));
    }
    found
}

/// The content of a file in a folder, which a model names.
fn read(name: &str, folder: &Path, span: &Range<usize>) -> Result<String, Diagnostic> {
    let fail = |why: &str| Diagnostic::new(span.clone(), format!("cannot read `{name}`: {why}"));
    let content = read_within(name, folder, limits::FILE).map_err(|error| match error.help {
        Some(help) => fail(&error.why).help(help),
        None => fail(&error.why),
    })?;
    match content.lines().any(|line| line.starts_with(MARK)) {
        true => Err(fail(&format!("it has a line that begins with `{}`", MARK.trim()))),
        false => Ok(content),
    }
}

/// Reason why a file was not read.
pub struct Unreadable {
    pub why: String,
    pub help: Option<&'static str>,
}

/// The content of a file of at most `most` bytes that a text names, in a folder or below.
///
/// # Errors
/// If the path leaves the folder, even by a link, or the file cannot be read or is not UTF-8.
pub fn read_within(name: &str, folder: &Path, most: usize) -> Result<String, Unreadable> {
    let fail = |why: String| Unreadable { why, help: None };
    let path = Path::new(name);
    let is_inside = path.components().all(|part| matches!(part, Component::Normal(_) | Component::CurDir))
        && path.components().any(|part| part != Component::CurDir);
    if !is_inside || name.contains(['\n', '\r', '\\']) {
        let help = Some("give a path such as \"parts/leg.toml\"");
        return Err(Unreadable { why: "the path leaves the folder of the model".into(), help });
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let real = folder.join(path).canonicalize().map_err(|error| fail(error.to_string()))?;
    let root = folder.canonicalize().map_err(|error| fail(error.to_string()))?;
    if !real.starts_with(&root) {
        return Err(fail("it is a link to a file outside the folder of the model".into()));
    }
    let bytes = crate::storage::read_file(&real, most as u64).map_err(|error| fail(error.to_string()))?;
    String::from_utf8(bytes).map_err(|_| fail("it is not UTF-8".into()))
}

/// Parses the model's own text and the attached ones, and merges them.
///
/// # Errors
/// If a text is not TOML, a setting is given twice, or a named file is not attached.
pub fn parse(text: &str) -> Result<DeTable<'_>, Diagnostic> {
    let (own, attached) = split(text);
    let mut all = part(&text[..own], 0)?;
    let models = |table: &DeTable<'_>| -> Vec<String> {
        named(table, 0).into_iter().filter(|(.., is_model)| *is_model).map(|(name, ..)| name).collect()
    };
    let missing = |table: &DeTable<'_>| {
        let is_missing = |(name, ..): &(String, Range<usize>, bool)| !attached.iter().any(|part| part.name == name);
        named(table, 0).into_iter().find(is_missing)
    };
    let mut next = models(&all);
    let mut merged: Vec<String> = vec![];
    let mut lacking = missing(&all);
    while let Some(name) = next.pop() {
        let Some(file) = attached.iter().find(|file| file.name == name).filter(|_| !merged.contains(&name)) else {
            continue;
        };
        let table = part(&text[file.span.clone()], file.span.start)?;
        next.extend(models(&table));
        lacking = lacking.or_else(|| missing(&table));
        merge(&mut all, table)?;
        merged.push(name);
    }
    if let Some((name, span, _)) = lacking {
        let message = format!("the file `{name}` is not attached to this text");
        return Err(Diagnostic::new(span, message).help("read the model by its path"));
    }
    columns(&mut all, text, &attached)?;
    Ok(all)
}

/// The key or the heading of a table that is given twice, where the parser noticed it in the line at `byte`: its name, and both places.
fn given_twice(text: &str, byte: usize) -> Option<(&str, [Range<usize>; 2])> {
    let start = text.get(..byte)?.rfind('\n').map_or(0, |end| end + 1);
    let name_of = |line: &str| -> Option<Range<usize>> {
        let content = line.trim();
        let name =
            if content.starts_with('[') { content.split(']').next()? } else { content.split('=').next()?.trim_end() };
        let name = name.trim_start_matches('[');
        let begin = line.find(name)?;
        (!name.is_empty()).then(|| begin..begin + name.len())
    };
    let line = text[start..].lines().next()?;
    let is_heading = line.trim_start().starts_with('[');
    let second = name_of(line)?;
    let name = &line[second.clone()];
    let mut first = None;
    let mut from = 0;
    for earlier in text[..start].split_inclusive('\n') {
        let starts_table = earlier.trim_start().starts_with('[');
        if starts_table && !is_heading {
            first = None;
        }
        if starts_table == is_heading
            && let Some(at) = name_of(earlier).filter(|at| earlier[at.clone()] == *name)
        {
            first = Some(from + at.start..from + at.end);
        }
        from += earlier.len();
    }
    Some((name, [first?, start + second.start..start + second.end]))
}

/// A part of a text as a table, with places in the whole text.
fn part(text: &str, offset: usize) -> Result<DeTable<'_>, Diagnostic> {
    let broken = |e: toml::de::Error| {
        let message = e.message().lines().next().unwrap_or("");
        let span = e.span().unwrap_or(0..0);
        let error = |message: &str| Diagnostic::new(span.start + offset..span.end + offset, message);
        if message.starts_with("duplicate key")
            && let Some((name, [first, second])) = given_twice(text, span.start)
        {
            let [first, second] = [first, second].map(|at| at.start + offset..at.end + offset);
            let error = Diagnostic::new(second, format!("`{name}` is given twice")).label("second use");
            return Diagnostic {
                second_use: Some(Box::new(SecondUse { first: Some(first), ..SecondUse::default() })),
                ..error
            };
        }
        if message.contains("recurs") {
            error("tables and lists are nested too deeply").help("a model needs three levels")
        } else {
            error(message)
        }
    };
    let table = DeTable::parse(text).map_err(broken)?.into_inner();
    Ok(if offset == 0 { table } else { moved(table, offset) })
}

fn moved<'a>(table: DeTable<'a>, offset: usize) -> DeTable<'a> {
    let later = |span: Range<usize>| span.start + offset..span.end + offset;
    let one = |(key, value): (Spanned<Cow<'a, str>>, Spanned<DeValue<'a>>)| {
        let place = later(key.span());
        (Spanned::new(place, key.into_inner()), moved_value(value, offset))
    };
    table.into_iter().map(one).collect()
}

fn moved_value<'a>(value: Spanned<DeValue<'a>>, offset: usize) -> Spanned<DeValue<'a>> {
    let span = value.span().start + offset..value.span().end + offset;
    let value = match value.into_inner() {
        DeValue::Array(list) => DeValue::Array(list.into_iter().map(|item| moved_value(item, offset)).collect()),
        DeValue::Table(table) => DeValue::Table(moved(table, offset)),
        other => other,
    };
    Spanned::new(span, value)
}

/// Merges an included model: adds its entries to the tables of names, and its parts to the lists of parts.
fn merge<'a>(all: &mut DeTable<'a>, included: DeTable<'a>) -> Result<(), Diagnostic> {
    for (key, value) in included {
        let name = key.get_ref().to_string();
        if matches!(name.as_str(), "version" | "title" | "include") {
            continue;
        }
        let span = key.span();
        match (all.get_mut(name.as_str()).map(Spanned::get_mut), value.into_inner()) {
            (None, value) => drop(all.insert(key, Spanned::new(span, value))),
            (Some(DeValue::Array(known)), DeValue::Array(new)) => new.into_iter().for_each(|item| known.push(item)),
            (Some(DeValue::Table(known)), DeValue::Table(new)) if OF_NAMES.contains(&name.as_str()) => {
                for (key, value) in new {
                    if known.contains_key(key.get_ref().as_ref()) {
                        let message = format!("`{}` of [{name}] is defined twice", key.get_ref());
                        return Err(Diagnostic::new(key.span(), message).label("second definition"));
                    }
                    known.insert(key, value);
                }
            }
            _ => {
                let message = format!("`{name}` is given here and in the file that includes this one");
                return Err(Diagnostic::new(span, message).help("leave it out in one of them"));
            }
        }
    }
    Ok(())
}

/// Tables whose keys are names of the user.
const OF_NAMES: [&str; 5] = ["design", "constants", "expressions", "series", "table"];

/// Replaces `file` of each table by the first two columns of the attached text.
fn columns<'a>(all: &mut DeTable<'a>, text: &'a str, attached: &[AttachedText<'a>]) -> Result<(), Diagnostic> {
    let Some(DeValue::Table(tables)) = all.get_mut("table").map(Spanned::get_mut) else { return Ok(()) };
    let names: Vec<String> = tables.keys().map(|name| name.get_ref().to_string()).collect();
    for name in &names {
        let Some(DeValue::Table(table)) = tables.get_mut(name.as_str()).map(Spanned::get_mut) else { continue };
        let Some(value) = table.get("file") else { continue };
        let (Some(name), span) = (value.get_ref().as_str(), value.span()) else { continue };
        if let Some(key) = ["x", "y"].into_iter().find(|key| table.contains_key(*key)) {
            return Err(Diagnostic::new(span, format!("`file` and `{key}` exclude each other")));
        }
        let Some(file) = attached.iter().find(|file| file.name == name) else { continue };
        let [x, y] = two_columns(text, file)?;
        table.remove("file");
        for (key, column) in [("x", x), ("y", y)] {
            let list =
                column.into_iter().map(|(cell, place)| Spanned::new(place, DeValue::String(Cow::Borrowed(cell))));
            let list = DeValue::Array(list.collect());
            table.insert(Spanned::new(span.clone(), Cow::Borrowed(key)), Spanned::new(span.clone(), list));
        }
    }
    Ok(())
}

type TextColumn<'a> = Vec<(&'a str, Range<usize>)>;

/// The first two columns of a text, without a row of headings before them and comments. Cells are separated by commas, semicolons or white space.
fn two_columns<'a>(text: &'a str, file: &AttachedText<'a>) -> Result<[TextColumn<'a>; 2], Diagnostic> {
    let (mut columns, mut at, mut may_be_heading) = ([vec![], vec![]], file.span.start, true);
    for line in text[file.span.clone()].split_inclusive('\n') {
        let begin = at;
        at += line.len();
        let line = line.trim_end();
        if line.trim().is_empty() || line.starts_with('#') {
            continue;
        }
        let separator = [',', ';'].into_iter().find(|c| line.contains(*c));
        let cells: Vec<&str> = match separator {
            Some(separator) => line.split(separator).map(str::trim).collect(),
            None => line.split_whitespace().collect(),
        };
        let [x, y, ..] = cells[..] else {
            return Err(Diagnostic::new(begin..begin + line.len(), "a row of a table has two columns")
                .help("separate them by commas, semicolons or white space"));
        };
        // A heading has no digit in its first place: `0 mm` is a mistake, not a heading.
        let looks_like_number =
            x.trim_start_matches(['+', '-', '.', '"', '\'']).starts_with(|c: char| c.is_ascii_digit());
        let is_heading = std::mem::take(&mut may_be_heading) && x.parse::<f64>().is_err() && !looks_like_number;
        if is_heading {
            continue;
        }
        for (column, cell) in columns.iter_mut().zip([x, y]) {
            let start = cell.as_ptr() as usize - text.as_ptr() as usize;
            if cell.parse::<f64>().is_err() {
                return Err(Diagnostic::new(start..start + cell.len(), format!("`{cell}` is not a number")).help(
                    "cells are plain numbers, without units or quotation marks; one row of headings may precede them",
                ));
            }
            column.push((cell, start..start + cell.len()));
        }
    }
    Ok(columns)
}
