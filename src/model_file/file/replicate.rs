//! Replication of a table by its key `each`, as in `each = { i = "1..10" }`.

use super::value::{Read, Value, ordered, wrong_type};
use crate::model_file::{Diagnostic, limits};
use std::borrow::Cow;
use std::ops::Range;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// An index of `each` with its values.
struct Index {
    name: String,
    values: Vec<String>,
}

/// The copies of a table: the table itself, or one copy for each combination of the values in `each`, the last index fastest.
/// `each` may also be a list of tables, with one copy for each of them. In all texts `{i}` is replaced by the value, and
/// `{i+1}`, `{i-1}`, … by its neighbours if it is a whole number.
pub fn replicate<'a>(table: &DeTable<'a>, span: Range<usize>) -> Read<Vec<DeTable<'a>>> {
    let Some(each) = table.get("each") else { return Ok(vec![table.clone()]) };
    if let Some(list) = each.get_ref().as_array() {
        return listed(table, list.iter(), each.span(), span);
    }
    let Some(entries) = each.get_ref().as_table() else {
        return Err(wrong_type(each, "`each`", "a table, or a list of tables"));
    };
    let indices =
        ordered(entries).into_iter().map(|(name, value)| index(name.text, value)).collect::<Read<Vec<_>>>()?;
    let count = indices.iter().try_fold(1usize, |n, index| n.checked_mul(index.values.len()));
    let size: usize = table.values().map(text_size).sum();
    if count.is_none_or(|count| count > limits::PARTS || count * size > 16 * limits::FILE) {
        let message = format!("`each` makes more copies than the limit of {}", limits::PARTS);
        return Err(Diagnostic::new(each.span(), message));
    }
    let mut plain = table.clone();
    plain.remove("each");
    let mut all = vec![plain];
    for index in &indices {
        let copy = |table: &DeTable<'a>, value: &String| -> Read<DeTable<'a>> {
            let table = Spanned::new(span.clone(), DeValue::Table(table.clone()));
            match substituted(&table, &index.name, value)?.into_inner() {
                DeValue::Table(table) => Ok(table),
                _ => unreachable!("a table stays a table"),
            }
        };
        all = all
            .iter()
            .flat_map(|t| index.values.iter().map(move |v| (t, v)))
            .map(|(t, v)| copy(t, v))
            .collect::<Read<_>>()?;
    }
    Ok(all)
}

/// One copy for each table of a list: in all texts the names in braces are replaced by the values of the table.
fn listed<'a, 'v>(
    table: &DeTable<'a>,
    list: impl Iterator<Item = &'v Value<'a>>,
    each: Range<usize>,
    span: Range<usize>,
) -> Read<Vec<DeTable<'a>>>
where
    'a: 'v,
{
    let mut plain = table.clone();
    plain.remove("each");
    let size: usize = plain.values().map(text_size).sum();
    let (mut all, mut first): (Vec<DeTable<'a>>, Option<Vec<String>>) = (vec![], None);
    for item in list {
        let Some(entries) = item.get_ref().as_table() else {
            return Err(wrong_type(item, "an item of `each`", "a table such as { name = \"thigh\", length = 0.4 }"));
        };
        let entries = ordered(entries);
        let names: Vec<String> = {
            let mut names: Vec<String> = entries.iter().map(|(name, _)| name.text.clone()).collect();
            names.sort();
            names
        };
        if first.get_or_insert_with(|| names.clone()) != &names {
            let message = "the tables of `each` have different keys";
            return Err(Diagnostic::new(item.span(), message).help("give every copy a value of each"));
        }
        if all.len() >= limits::PARTS || (all.len() + 1) * size > 16 * limits::FILE {
            let message = format!("`each` makes more copies than the limit of {}", limits::PARTS);
            return Err(Diagnostic::new(each, message));
        }
        let mut copy = Spanned::new(span.clone(), DeValue::Table(plain.clone()));
        for (name, value) in entries {
            let to = match value.get_ref() {
                DeValue::String(text) => text.to_string(),
                DeValue::Integer(i) => i.as_str().to_owned(),
                DeValue::Float(f) => f.as_str().to_owned(),
                _ => return Err(wrong_type(value, &format!("`{}`", name.text), "a number or a text")),
            };
            copy = substituted(&copy, &name.text, &to)?;
        }
        match copy.into_inner() {
            DeValue::Table(table) => all.push(table),
            _ => unreachable!("a table stays a table"),
        }
    }
    Ok(all)
}

/// A list of words and numbers, or a range "first..last".
fn index(name: String, value: &Value<'_>) -> Read<Index> {
    let wanted = "a list, or a range such as \"1..10\"";
    let values = match value.get_ref() {
        DeValue::String(range) => {
            let ends = range.split_once("..").and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
            let Some((first, last)): Option<(i64, i64)> = ends else {
                return Err(
                    Diagnostic::new(value.span(), format!("`{range}` is not a range")).help(format!("give {wanted}"))
                );
            };
            let count = last.checked_sub(first).and_then(|n| usize::try_from(n.checked_add(1)?).ok()).unwrap_or(0);
            if count > limits::PARTS || count == 0 {
                let message = format!("a range of {count} values is not possible");
                return Err(Diagnostic::new(value.span(), message).help(format!("1 to {} are possible", limits::PARTS)));
            }
            (first..=last).map(|i| i.to_string()).collect()
        }
        DeValue::Array(list) => {
            let one = |item: &Value<'_>| match item.get_ref() {
                DeValue::String(text) => Ok(text.to_string()),
                DeValue::Integer(i) => Ok(i.as_str().to_owned()),
                _ => Err(wrong_type(item, "a value of `each`", "text or a whole number")),
            };
            list.iter().map(one).collect::<Read<_>>()?
        }
        _ => return Err(wrong_type(value, &format!("`{name}`"), wanted)),
    };
    Ok(Index { name, values })
}

/// Bytes of all texts in a value, and a few for everything else.
fn text_size(value: &Value<'_>) -> usize {
    match value.get_ref() {
        DeValue::String(text) => text.len(),
        DeValue::Array(list) => list.iter().map(|item| 8 + text_size(item)).sum(),
        DeValue::Table(table) => table.iter().map(|(key, value)| 8 + key.get_ref().len() + text_size(value)).sum(),
        _ => 8,
    }
}

/// A copy in which the value replaces the index in all texts.
fn substituted<'a>(value: &Value<'a>, index: &str, to: &str) -> Read<Value<'a>> {
    let new = match value.get_ref() {
        DeValue::String(text) => DeValue::String(Cow::Owned(filled(text, index, to, value.span())?)),
        DeValue::Array(list) => DeValue::Array(
            list.iter().map(|item| substituted(item, index, to)).collect::<Read<Vec<_>>>()?.into_iter().collect(),
        ),
        DeValue::Table(table) => {
            let entry =
                |(key, value): (&Spanned<Cow<'a, str>>, &Value<'a>)| Ok((key.clone(), substituted(value, index, to)?));
            DeValue::Table(table.iter().map(entry).collect::<Read<_>>()?)
        }
        other => other.clone(),
    };
    Ok(Spanned::new(value.span(), new))
}

/// The text with `{index}` and `{index±k}` replaced.
fn filled(text: &str, index: &str, to: &str, span: Range<usize>) -> Read<String> {
    let mut out = String::with_capacity(text.len());
    let mut rest = text;
    let open = format!("{{{index}");
    while let Some(at) = rest.find(&open) {
        let inside = &rest[at + open.len()..];
        let Some(close) = inside.find('}') else { break };
        let shift = &inside[..close];
        let shifted = || to.parse::<i64>().ok()?.checked_add(shift.parse::<i64>().ok()?).map(|i| i.to_string());
        let value = match shift.chars().next() {
            None => to.to_owned(),
            Some('+' | '-') => shifted().ok_or_else(|| {
                Diagnostic::new(span.clone(), format!("`{{{index}{shift}}}` needs whole numbers, `{index}` is `{to}`"))
            })?,
            // Another index with a longer name.
            Some(_) => rest[at..at + open.len() + close + 1].to_owned(),
        };
        out += &rest[..at];
        out += &value;
        rest = &inside[close + 1..];
    }
    Ok(out + rest)
}
