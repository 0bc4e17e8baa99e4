//! The TOML of a model file: parsing, all settings by their keys, and the fingerprint.

use super::expression::{ExpressionTree, TextPlace};
use super::{Diagnostic, DiagnosticReport, attached, limits, text_parts, version};
use std::collections::BTreeMap;
use toml::de::{DeTable, DeValue};

/// Parses the text of a model file.
///
/// # Errors
/// If the text is too long or not TOML.
pub(super) fn parse(text: &str) -> Result<DeTable<'_>, Diagnostic> {
    parse_up_to(limits::FILE, text)
}

/// As [`parse`], for a text of up to `longest` bytes.
pub(super) fn parse_up_to(longest: usize, text: &str) -> Result<DeTable<'_>, Diagnostic> {
    if text.len() > longest {
        let message = format!("a file of {} bytes is too long", text.len());
        return Err(Diagnostic::new(0..0, message).help(format!("at most {longest} are read")));
    }
    attached::parse(text)
}

/// Hash of a problem: of everything except method, title and bounds of design variables. It does not depend on comments, order of
/// keys and version of the format.
pub(super) fn fingerprint(file: &DeTable<'_>) -> u64 {
    let mut file = file.clone();
    let mut text = peak_scale(&mut file);
    // The keywords of version 1, in which the first stored runs were hashed.
    version::to_first_version(&mut file);
    for (key, value) in &file {
        match &**key.get_ref() {
            "method" | "title" | "include" => {}
            "version" => text += "version1",
            key => {
                text += key;
                write_plainly(value.get_ref(), &mut text);
            }
        }
    }
    crate::storage::fnv1a(&text)
}

/// Hash of all that the responses of a problem depend on: as [`fingerprint`], without the start values of design variables.
pub(super) fn analysis_fingerprint(file: &DeTable<'_>) -> u64 {
    let mut file = file.clone();
    if let Some(DeValue::Table(design)) = file.get_mut("design").map(toml::Spanned::get_mut) {
        for (_, variable) in design.iter_mut() {
            if let DeValue::Table(keys) = variable.get_mut() {
                ["start", "lower", "upper"].iter().for_each(|key| drop(keys.remove(*key)));
            }
        }
    }
    fingerprint(&file)
}

/// Converts the scale of a peak to version 1, where the default is 1: such a scale is removed. Returns a text that replaces in the hash
/// the default of later versions.
fn peak_scale(file: &mut DeTable<'_>) -> String {
    let is_first = file.get("version").is_some_and(|version| plain(version.get_ref()) == "1");
    let Some(DeValue::Table(objective)) = file.get_mut("objective").map(toml::Spanned::get_mut) else {
        return String::new();
    };
    if objective.get("over").and_then(|over| over.get_ref().as_str()) != Some("peak") {
        return String::new();
    }
    let scale = objective.get("scale").map(|scale| plain(scale.get_ref()).parse::<f64>());
    match scale {
        Some(Ok(1.0)) => drop(objective.remove("scale")),
        None if !is_first => return "scale of the start".to_owned(),
        _ => {}
    }
    String::new()
}

fn write_plainly(value: &DeValue<'_>, out: &mut String) {
    match value {
        DeValue::String(text) => *out += &format!("{text:?}"),
        DeValue::Integer(i) => *out += i.as_str(),
        DeValue::Float(f) => *out += f.as_str(),
        DeValue::Boolean(b) => *out += if *b { "true" } else { "false" },
        DeValue::Datetime(_) => {}
        DeValue::Array(list) => list.iter().for_each(|item| {
            write_plainly(item.get_ref(), out);
            out.push(',');
        }),
        DeValue::Table(table) => {
            let is_variable = table.contains_key("start");
            for (key, value) in table {
                // Bounds of design variables may change when a run is resumed.
                if !(is_variable && matches!(&**key.get_ref(), "lower" | "upper")) {
                    *out += &format!("{:?}=", key.get_ref());
                    write_plainly(value.get_ref(), out);
                    out.push(';');
                }
            }
        }
    }
}

/// All settings of a file by their full keys, with values as written: `design.k.lower` is `1e-6`, `joint.pin.a` is `"ground"`. The key of a table
/// in a list has the name of the table, or its number if it has none. Words of version 1 are replaced by the current ones.
///
/// # Errors
/// If the text is not TOML.
pub fn settings(file: &str, text: &str) -> Result<BTreeMap<String, String>, Box<DiagnosticReport>> {
    let mut table = parse(text).map_err(|error| {
        Box::new(DiagnosticReport { file: file.to_owned(), text: text.to_owned(), diagnostics: vec![error] })
    })?;
    version::modernize(&mut table);
    let mut found = BTreeMap::new();
    collect("", &table, &mut found);
    Ok(found)
}

/// The text of a file with another value of a setting; `key` has the form of [`settings`]. Comments and all other lines stay.
///
/// A value that is not TOML, such as an expression, becomes a text. A key that the file lacks is added to its table, and a table that the
/// file lacks to its end; not to a table in a list, such as `[[joint]]`. An empty value removes the key; an empty text is `""`.
///
/// # Errors
/// If the text is not TOML, or the key cannot be added or removed.
pub fn with_setting(file: &str, text: &str, key: &str, value: &str) -> Result<String, Box<DiagnosticReport>> {
    let fail = |error: Diagnostic| {
        Box::new(DiagnosticReport { file: file.to_owned(), text: text.to_owned(), diagnostics: vec![error] })
    };
    let table = parse(text).map_err(fail)?;
    if value.trim().is_empty() {
        return without_setting(text, &table, key).map_err(fail);
    }
    let is_toml = DeTable::parse(&format!("value = {value}")).is_ok_and(|table| table.get_ref().len() == 1);
    let value = if is_toml { value.trim().to_owned() } else { toml_string(value) };
    let edited =
        |range: std::ops::Range<usize>, new: &str| format!("{}{new}{}", &text[..range.start], &text[range.end..]);
    let parts = parts_of(key);
    let (Some((last, path)), true) = (parts.split_last(), parts.iter().all(|part| !part.is_empty())) else {
        return Err(fail(Diagnostic::new(0..0, format!("`{key}` is no key such as method.max_cycles"))));
    };
    let variables = table.get("design").and_then(|all| all.get_ref().as_table());
    let is_variable = variables.is_some_and(|all| all.contains_key(last.as_str()));
    if path.is_empty() && is_variable && !table.contains_key(last.as_str()) {
        let message = format!("`{last}` is a design variable");
        let help = format!("give --start {last}={value} for its start, or design.{last}.start, .lower or .upper");
        return Err(fail(Diagnostic::new(0..0, message).help(help)));
    }
    let mut here = &table;
    for (depth, part) in path.iter().enumerate() {
        let Some(found) = value_at(&table, here, &path[..=depth]) else {
            let exists = depth > 0;
            let header = path.iter().map(|part| written(part)).collect::<Vec<_>>().join(".");
            return if exists || parts.len() > 3 {
                Err(fail(Diagnostic::new(0..0, format!("there is no `{}` in the file", path[..=depth].join(".")))))
            } else {
                let (own, attached) = text.split_at(text_parts::split(text).0);
                Ok(format!("{}\n\n[{header}]\n{} = {value}\n{attached}", own.trim_end(), written(last)))
            };
        };
        match found.get_ref() {
            DeValue::Table(inner) => here = inner,
            DeValue::Array(_) if depth + 1 < path.len() => {}
            _ => return Err(fail(Diagnostic::new(found.span(), format!("`{part}` has no keys")))),
        }
        let is_inline = text[found.span()].starts_with('{');
        if depth + 1 == path.len() && is_inline && here.get(last.as_str()).is_none() {
            let start = found.span().start + 1;
            let comma = if here.is_empty() { "" } else { "," };
            return Ok(edited(start..start, &format!(" {} = {value}{comma}", written(last))));
        }
    }
    if let Some(old) = here.get(last.as_str()) {
        if let DeValue::Table(inner) = old.get_ref() {
            let keys: Vec<String> = inner.keys().map(|inner| format!("{key}.{}", inner.get_ref())).collect();
            let message = format!("`{key}` is a table");
            return Err(fail(
                Diagnostic::new(old.span(), message).help(format!("set one of its keys: {}", keys.join(", "))),
            ));
        }
        if let Some(error) = lost_unit(key, old, &value) {
            return Err(fail(error));
        }
        return Ok(edited(old.span(), &value));
    }
    let header = format!("[{}]", path.iter().map(|part| written(part)).collect::<Vec<_>>().join("."));
    let lines = text.split_inclusive('\n').scan(0, |end, line| {
        *end += line.len();
        Some((*end, line))
    });
    let of_header = |line: &str| line.split('#').next().is_some_and(|line| line.trim() == header);
    match lines.into_iter().find(|(_, line)| of_header(line)).map(|(end, _)| end) {
        _ if path.is_empty() => Ok(format!("{} = {value}\n{text}", written(last))),
        Some(end) => Ok(edited(end..end, &format!("{} = {value}\n", written(last)))),
        // A table in a list begins with its first key.
        None => match first_key(here, text) {
            Some(start) => Ok(edited(start..start, &format!("{} = {value}\n", written(last)))),
            None => Err(fail(Diagnostic::new(0..0, format!("`{key}` cannot be added; write it into the file")))),
        },
    }
}

/// The text of a file without a setting.
fn without_setting(text: &str, table: &DeTable<'_>, key: &str) -> Result<String, Diagnostic> {
    let parts = parts_of(key);
    let (last, path) = parts.split_last().expect("there is a first part");
    let absent = || Diagnostic::new(0..0, format!("there is no `{key}` in the file that could be removed"));
    let mut here = table;
    for depth in 0..path.len() {
        let found = value_at(table, here, &path[..=depth]).ok_or_else(absent)?;
        match found.get_ref() {
            DeValue::Table(inner) => here = inner,
            DeValue::Array(_) if depth + 1 < path.len() => {}
            _ => return Err(absent()),
        }
    }
    let (name, value) = here.get_key_value(last.as_str()).ok_or_else(absent)?;
    let (name, value) = (name.span(), value.span());
    let cannot = || {
        let help = "write a file without it, or remove its keys one by one";
        Diagnostic::new(name.clone(), format!("`{key}` cannot be removed from here")).help(help)
    };
    if value.start < name.end || text[name.end..value.start].trim() != "=" {
        return Err(cannot());
    }
    // A key with dots begins before its last part.
    let begin = text[..name.start].rfind(['\n', '{', ',']).map_or(0, |before| before + 1);
    let is_in_line = text[..begin].ends_with(['{', ',']);
    let rest = &text[value.end..];
    let (begin, end) = match rest.trim_start_matches([' ', '\t']).strip_prefix(',') {
        Some(after) if is_in_line => (begin, text.len() - after.len()),
        _ if is_in_line && text[..begin].ends_with(',') => (begin - 1, value.end),
        _ if is_in_line => (begin, value.end),
        _ => (begin, value.end + rest.find('\n').map_or(rest.len(), |end| end + 1)),
    };
    let new = format!("{}{}", &text[..begin], &text[end..]);
    // All other settings are as before.
    let [before, after] = [text, &new].map(|text| settings("", text).ok());
    let (Some(before), Some(after)) = (before, after) else { return Err(cannot()) };
    let removed = here.get(last.as_str()).map_or(0, |value| count_of(value.get_ref()));
    let is_kept = after.iter().all(|(key, value)| before.get(key) == Some(value));
    if is_kept && before.len() == after.len() + removed { Ok(new) } else { Err(cannot()) }
}

/// Number of settings in a value.
fn count_of(value: &DeValue<'_>) -> usize {
    match value {
        DeValue::Table(inner) => inner.values().map(|value| count_of(value.get_ref())).sum(),
        DeValue::Array(list) if list.iter().any(|item| item.get_ref().is_table()) => {
            list.iter().filter(|item| item.get_ref().is_table()).map(|item| count_of(item.get_ref())).sum()
        }
        _ => 1,
    }
}

/// The error of a plain number, other than zero, in place of one with a unit: it would be in SI units.
fn lost_unit(key: &str, old: &toml::Spanned<DeValue<'_>>, new: &str) -> Option<Diagnostic> {
    let number: f64 = new.parse().ok().filter(|number| *number != 0.0)?;
    let text = old.get_ref().as_str()?;
    let tree = ExpressionTree::parse(text, TextPlace::Within(old.span())).ok()?;
    let unit = &tree.unit()?.text;
    let error = Diagnostic::new(old.span(), format!("`{key}` is \"{text}\", and {number} has no unit"));
    Some(error.help(format!("write {key}=\"{number} {unit}\", or another unit")))
}

/// The beginning of the line of the first key of a table that is written line by line.
fn first_key(table: &DeTable<'_>, text: &str) -> Option<usize> {
    let first = table.keys().map(|key| key.span().start).min()?;
    let start = text[..first].rfind('\n').map_or(0, |end| end + 1);
    text[start..first].trim().is_empty().then_some(start)
}

/// The parts of a key with dots; a part in quotes may contain dots and spaces.
fn parts_of(key: &str) -> Vec<String> {
    let mut parts = vec![String::new()];
    let mut is_quoted = false;
    for c in key.chars() {
        match c {
            '"' => is_quoted = !is_quoted,
            '.' if !is_quoted => parts.push(String::new()),
            c => parts.last_mut().expect("there is a first part").push(c),
        }
    }
    parts.iter().map(|part| part.trim().to_owned()).collect()
}

/// A text as a TOML string: in quotes, with `\\` before quotes and backslashes, and with control characters as escape codes.
pub fn toml_string(text: &str) -> String {
    let written = |c: char| match c {
        '"' | '\\' => format!("\\{c}"),
        c if c.is_ascii_control() => format!("\\u{:04X}", c as u32),
        c => c.to_string(),
    };
    format!("\"{}\"", text.chars().map(written).collect::<String>())
}

/// A key as it is written in TOML: in quotes unless it consists of letters, digits, `_` and `-`.
fn written(part: &str) -> String {
    let is_bare = part.chars().all(|c| c.is_ascii_alphanumeric() || "_-".contains(c));
    if is_bare { part.to_owned() } else { toml_string(part) }
}

/// The text of a model in which a constant is a design variable that begins at its value. `None` if the text has no such constant on lines
/// of its own.
#[cfg(feature = "report")]
pub(crate) fn with_constant_as_variable(text: &str, name: &str) -> Option<String> {
    let table = parse(text).ok()?;
    let (key, value) = table.get("constants")?.get_ref().as_table()?.get_key_value(name)?;
    let (start, without) = (&text[value.span()], format!("{}{}", &text[..key.span().start], &text[value.span().end..]));
    let (own, attached) = without.split_at(text_parts::split(&without).0);
    Some(format!("{}\n\n[design.{name}]\nstart = {start}\n{attached}", own.trim_end()))
}

/// The value of the last part of a `path`, in the table `here` that the parts before it lead to, or in the list that the path begins with.
fn value_at<'t, 'i>(
    file: &'t DeTable<'i>,
    here: &'t DeTable<'i>,
    path: &[String],
) -> Option<&'t toml::Spanned<DeValue<'i>>> {
    let (last, before) = path.split_last()?;
    let is_in_list = |list: &String| file.get(list.as_str()).is_some_and(|value| value.get_ref().is_array());
    match before {
        [list] if is_in_list(list) => named_item(file, path),
        _ => here.get(last.as_str()),
    }
}

/// The table of a list that a path names: `joint`, `pin` is the table `[[joint]]` with this name or number.
fn named_item<'t, 'i>(file: &'t DeTable<'i>, path: &[String]) -> Option<&'t toml::Spanned<DeValue<'i>>> {
    let [list, name] = path else { return None };
    let items = file.get(list.as_str())?.get_ref().as_array()?;
    let is_named = |item: &toml::Spanned<DeValue<'_>>| {
        let own = item.get_ref().as_table().and_then(|table| table.get("name")).and_then(|n| n.get_ref().as_str());
        own == Some(name.as_str())
    };
    let number = || name.parse::<usize>().ok().and_then(|k| items.get(k.checked_sub(1)?));
    items.iter().find(|item| is_named(item)).or_else(number)
}

fn collect(prefix: &str, table: &DeTable<'_>, found: &mut BTreeMap<String, String>) {
    for (key, value) in table {
        let key = format!("{prefix}{}", key.get_ref());
        match value.get_ref() {
            DeValue::Table(inner) => collect(&format!("{key}."), inner, found),
            DeValue::Array(list) if list.iter().any(|item| item.get_ref().is_table()) => {
                for (k, item) in list.iter().enumerate() {
                    let Some(inner) = item.get_ref().as_table() else { continue };
                    let name = inner.get("name").and_then(|n| n.get_ref().as_str());
                    let name = name.map_or_else(|| (k + 1).to_string(), str::to_owned);
                    collect(&format!("{key}.{name}."), inner, found);
                }
            }
            other => drop(found.insert(key, plain(other))),
        }
    }
}

fn plain(value: &DeValue<'_>) -> String {
    match value {
        DeValue::String(text) => toml_string(text),
        DeValue::Integer(i) => i.as_str().to_owned(),
        DeValue::Float(f) => f.as_str().to_owned(),
        DeValue::Boolean(b) => b.to_string(),
        DeValue::Datetime(d) => d.to_string(),
        DeValue::Array(list) => {
            format!("[{}]", list.iter().map(|item| plain(item.get_ref())).collect::<Vec<_>>().join(", "))
        }
        DeValue::Table(_) => "{ … }".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_of_a_list_have_their_names_as_keys() {
        let text =
            "version = 1\n[design.k]\nlower = 1e-6\n[[joint]]\nname = \"pin\"\na = [0, 1.5]\n[[joint]]\nb = true\n";
        let found: Vec<String> = settings("m", text).unwrap().into_iter().map(|(k, v)| format!("{k} = {v}")).collect();
        let expected = [
            "design.k.lower = 1e-6",
            "joint.2.b = true",
            "joint.pin.a = [0, 1.5]",
            "joint.pin.name = \"pin\"",
            "version = 1",
        ];
        assert_eq!(found, expected);
        assert!(settings("m", "a = ").is_err());
    }

    #[test]
    fn the_scale_of_a_peak_is_1_in_version_1_and_that_of_the_start_later() {
        let of = |version: u32, scale: &str| {
            let text = format!("version = {version}\n[objective]\nminimize = \"f\"\nover = \"peak\"\n{scale}");
            fingerprint(&parse(&text).unwrap())
        };
        let first = of(1, "");
        assert_eq!([of(1, "scale = 1"), of(2, "scale = 1.0")], [first, first]);
        assert_ne!(of(2, ""), first);
        assert_ne!(of(2, "scale = 2"), of(2, ""));
    }

    #[test]
    fn a_setting_is_replaced_where_it_stands() {
        let text = "version = 2 # two\n[design]\nk = { start = 1.0, lower = 0.0 }\n[method]\nmax_cycles = 3 # few\n\
            [[constraint]]\nname = \"sag\"\nat_most = 1\n";
        let set = |key: &str, value: &str| with_setting("m", text, key, value);
        for (key, value, old, new) in [
            ("design.k.start", "2.5", "start = 1.0", "start = 2.5"),
            ("design.k.upper", "9", "k = {", "k = { upper = 9,"),
            ("method.max_cycles", "40", "= 3 # few", "= 40 # few"),
            ("method.preset", "mma", "[method]\n", "[method]\npreset = \"mma\"\n"),
            ("constraint.sag.at_most", "2*k", "at_most = 1", "at_most = \"2*k\""),
            ("constraint.1.at_most", "7", "at_most = 1", "at_most = 7"),
            ("constraint.sag.from", "0.1", "name = \"sag\"", "from = 0.1\nname = \"sag\""),
            ("constraint.1.\"two words\"", "1", "name = \"sag\"", "\"two words\" = 1\nname = \"sag\""),
            ("title", "a lift", "version = 2", "title = \"a lift\"\nversion = 2"),
        ] {
            assert_eq!(set(key, value).unwrap(), text.replacen(old, new, 1), "{key}");
        }
        assert!(set("time.points", "11").unwrap().ends_with("at_most = 1\n\n[time]\npoints = 11\n"));
        for key in ["", "design..k", "constraint.none.at_most", "version.x", "design.q.start", "design.k", "design"] {
            assert!(set(key, "1").is_err(), "{key}");
        }
        let report = set("design.k", "2").unwrap_err().to_string();
        assert!(report.contains("design.k.lower, design.k.start"), "{report}");
    }

    #[test]
    fn an_empty_value_removes_a_setting() {
        let text = "version = 2\n[design]\nk = { start = 1.0, lower = 0.0 , upper = 3 }\nm = { start = 1 }\n[analysis]\nstep = \"1 ms\" # short\n\
            solver.kind = 'a' # dotted\n[[constraint]]\nname = \"sag\"\nat_most = [1,\n 2]\n[objective]\nbound.start = 5\n";
        let without = |key: &str| with_setting("m", text, key, " ");
        for (key, old, new) in [
            ("analysis.step", "step = \"1 ms\" # short\n", ""),
            ("analysis.solver.kind", "solver.kind = 'a' # dotted\n", ""),
            ("design.k.start", " start = 1.0,", ""),
            ("design.k.lower", " lower = 0.0 ,", ""),
            ("design.k.upper", ", upper = 3", ""),
            ("design.m.start", " start = 1 }", " }"),
            ("design.m", "m = { start = 1 }\n", ""),
            ("constraint.sag.at_most", "at_most = [1,\n 2]\n", ""),
            ("constraint.1.at_most", "at_most = [1,\n 2]\n", ""),
            ("objective.bound.start", "bound.start = 5\n", ""),
            ("version", "version = 2\n", ""),
        ] {
            assert!(text.contains(old), "{key}");
            assert_eq!(without(key).unwrap(), text.replacen(old, new, 1), "{key}");
        }
        for (key, part) in [
            ("analysis.tolerance", "no `analysis.tolerance` in the file"),
            ("time.points", "no `time.points`"),
            ("analysis", "cannot be removed"),
            ("constraint", "cannot be removed"),
        ] {
            let report = without(key).unwrap_err().to_string();
            assert!(report.contains(part), "{key}: {report}");
        }
    }

    /// The name of a part may be that of a table.
    #[test]
    fn a_part_may_have_the_name_of_a_table() {
        let file = "[[force]]\nname = \"a\"\n[[constraint]]\nname = \"force\"\nat_most = 5\nat_least = 1\n";
        let larger =
            with_setting("f", file, "constraint.force.at_most", "7").unwrap_or_else(|report| panic!("{report}"));
        assert_eq!(larger, file.replace('5', "7"));
        let without =
            with_setting("f", file, "constraint.force.at_least", "").unwrap_or_else(|report| panic!("{report}"));
        assert_eq!(without, file.replace("at_least = 1\n", ""));
        assert!(with_setting("f", file, "constraint.a.at_most", "7").is_err());
    }

    #[test]
    fn the_name_of_a_part_may_have_spaces() {
        let text = "[[constraint]]\nname = \"tip travel, m\"\nat_most = 1\n";
        let renamed = with_setting("m", text, "constraint.\"tip travel, m\".at_most", "2").unwrap();
        assert_eq!(renamed, text.replacen("at_most = 1", "at_most = 2", 1));
        assert_eq!(with_setting("m", text, "constraint.tip travel, m.at_most", "2").unwrap(), renamed);
    }

    #[test]
    fn a_problem_has_one_fingerprint_in_both_versions() {
        let first = "version = 1\n[[joint]]\nname = \"pin{i}\"\nkind = \"weld\"\nturn = 1\n[[driver]]\nname = \"motor\"\n\
            [[output]]\nvalue = \"motor.effort*pin1.couple + rod.first.moment\"\n";
        let second = "version = 2\n[[joint]]\nname = \"pin{i}\"\nkind = \"fixed\"\nangle = 1\n[[driver]]\nname = \"motor\"\n\
            [[output]]\nvalue = \"motor.driving_force*pin1.moment + rod.first.moment\"\n";
        let of = |text| fingerprint(&parse(text).unwrap());
        assert_eq!(of(first), of(second));
        assert_ne!(of(first), of(&first.replace("turn = 1", "turn = 2")));
        let [mut old, new] = [first, second].map(|text| settings("m", text).unwrap());
        old.insert("version".into(), "2".into());
        assert_eq!(old, new);
    }
}
