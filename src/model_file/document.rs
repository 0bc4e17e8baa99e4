//! The reference of all keys: as tables, as Markdown for the documentation, and as JSON schema for editors.

use super::expression::{REDUCTIONS, Reduction};
use super::file::{KEYS, element_of, families};
use super::{Accepts, Key, Need, TableKeys};
use mechanics::elements::Measure;
use serde_json::{Map, Value, json};

/// Declarations of all tables with their keys, in the order of a file.
pub fn tables() -> Vec<TableKeys> {
    let file = TableKeys { name: "", kind: None, about: "the file", keys: KEYS };
    std::iter::once(file).chain(families()).collect()
}

/// Reference of all tables and keys as Markdown, in the order of a file.
///
/// The section "All keys" of `docs/model-file.md` is this text; a test compares them.
pub fn document() -> String {
    let all = tables();
    let mut text = String::new();
    let mut last: Option<&TableKeys> = None;
    for table in &all {
        let again = last.is_some_and(|last| last.name == table.name && last.kind == table.kind);
        if !again {
            text += &heading(table, last);
        }
        if !table.keys.is_empty() && !again {
            text += "| key | takes | default | |\n|---|---|---|---|\n";
        }
        for key in table.keys {
            let need = match key.need {
                Need::Required => "*required*".to_owned(),
                Need::Default("") => "empty".to_owned(),
                Need::Default(value) => format!("`{value}`"),
                Need::Optional => String::new(),
            };
            text +=
                &format!("| `{}` | {} | {need} | {} |\n", key.name, key.accepts.words(), key.about.replace('|', "\\|"));
        }
        last = Some(table);
    }
    text + &reductions()
}

/// The reductions of histories.
fn reductions() -> String {
    let line = |(name, _, has_number, about): &(&str, Reduction, bool, &str)| {
        let number = if *has_number { ", …" } else { "" };
        format!("| `{name}(x{number})` | {} |\n", about.replace('|', "\\|"))
    };
    let lines: String = REDUCTIONS.iter().map(line).collect();
    format!(
        "\n### Reductions of histories\n\nFunctions in `minimize`, `maximize` and the `value` of a constraint. Two more numbers, as in \
         `max(x, 0.5, 2)`, limit them to the time points of an interval.\n\n| function | |\n|---|---|\n{lines}"
    )
}

/// The heading of a table, or the line above the keys of one kind.
fn heading(table: &TableKeys, last: Option<&TableKeys>) -> String {
    let new = last.is_none_or(|last| last.name != table.name);
    let title = match (table.name, table.name.strip_suffix('3')) {
        ("", _) => "The file".to_owned(),
        ("marker3", _) => "A point in space".to_owned(),
        ("orientation3", _) => "`orientation` in space".to_owned(),
        (_, Some(name)) => format!("`{name}` in space"),
        (name, None) => format!("`{name}`"),
    };
    match table.kind {
        None => format!("\n### {title}\n\n{}.\n\n", capital(table.about)),
        Some(kind) if new => format!("\n### {title}\n\n**`kind = \"{kind}\"`** — {}.\n\n", table.about),
        Some(kind) => format!(
            "\n**`kind = \"{kind}\"`**{} — {}.\n\n{}{}",
            family(table),
            table.about,
            law(table),
            measures(table)
        ),
    }
}

/// The family of an element in brackets.
fn family(table: &TableKeys) -> String {
    element_of(table).map_or(String::new(), |element| format!(" ({})", element.family))
}

/// The formula of an element's force, or the equation of its constraint.
fn law(table: &TableKeys) -> String {
    let law = element_of(table).map_or("", |element| element.law);
    if law.is_empty() { String::new() } else { format!("Law: {law}.\n\n") }
}

/// The measures of an element, with unit and sign.
fn measures(table: &TableKeys) -> String {
    let measures = element_of(table).map_or(&[][..], |element| element.measures);
    if measures.is_empty() {
        return String::new();
    }
    let line = |measure: &Measure| format!("| `{}` | {} | {} |\n", measure.name, measure.unit, measure.about);
    let lines: String = measures.iter().map(line).collect();
    format!("| measure | unit | |\n|---|---|---|\n{lines}\n")
}

fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// The JSON schema of model files, with which editors complete keys and mark mistakes.
pub fn schema() -> Value {
    let all = tables();
    let mut definitions = Map::new();
    for table in all.iter().filter(|table| !table.name.is_empty()) {
        if !definitions.contains_key(table.name) {
            definitions.insert(table.name.to_owned(), object(table.name, &all));
        }
    }
    definitions.insert("number".into(), json!({ "type": ["number", "string"] }));
    definitions.insert("pair".into(), json!({ "type": "array", "items": number(), "minItems": 2, "maxItems": 2 }));
    definitions.insert("triple".into(), json!({ "type": "array", "items": number(), "minItems": 3, "maxItems": 3 }));
    definitions.insert("numbers".into(), json!({ "type": "array", "items": number() }));
    let mut file = object("", &all);
    file["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    file["title"] = json!("model file of linkwright");
    let of = |suffix: &str| -> Value {
        let names = all.iter().filter(|table| has_space(table.name, &all)).map(|table| table.name);
        let items = |name: &str| json!({ "items": { "$ref": format!("#/$defs/{name}{suffix}") } });
        json!({ "properties": names.map(|name| (name.to_owned(), items(name))).collect::<Map<_, _>>() })
    };
    let in_space = json!({ "properties": { "space": { "const": 3 } }, "required": ["space"] });
    file["allOf"] = json!([{ "if": in_space, "then": of("3"), "else": of("") }]);
    file["$defs"] = Value::Object(definitions);
    file
}

/// Returns whether the table has other keys in space.
fn has_space(name: &str, all: &[TableKeys]) -> bool {
    all.iter().any(|table| table.name.strip_suffix('3') == Some(name))
}

/// The schema of a table: the keys of all its kinds, and for each kind the keys that it requires.
fn object(name: &str, all: &[TableKeys]) -> Value {
    let own = || all.iter().filter(|table| table.name == name);
    let mut properties = Map::new();
    for key in own().flat_map(|table| table.keys) {
        let new = property(name, key, all);
        match properties.get_mut(key.name) {
            // Kinds may take different values for one key: a slider has one velocity component, a body in the plane two.
            Some(known) => extend(known, new),
            None => drop(properties.insert(key.name.to_owned(), new)),
        }
    }
    let required = |kind: Option<&str>| -> Vec<&str> {
        let keys = own().filter(|table| table.kind == kind).flat_map(|table| table.keys);
        keys.filter(|key| key.need == Need::Required).map(|key| key.name).collect()
    };
    let mut kinds: Vec<&str> = own().filter_map(|table| table.kind).collect();
    kinds.dedup();
    let of_kind = |kind: &&str| {
        let condition = json!({ "properties": { "kind": { "const": kind } }, "required": ["kind"] });
        json!({ "if": condition, "then": { "required": required(Some(kind)) } })
    };
    let mut object = json!({
        "type": "object",
        "properties": properties,
        "required": required(None),
        "additionalProperties": false,
    });
    if !kinds.is_empty() {
        object["allOf"] = kinds.iter().map(of_kind).collect();
    }
    object
}

/// Lets a property take the values of another declaration, too.
fn extend(known: &mut Value, mut new: Value) {
    let about = known.as_object_mut().and_then(|known| known.remove("description"));
    new.as_object_mut().and_then(|new| new.remove("description"));
    if *known != new {
        let mut several = match known.as_object_mut().and_then(|known| known.remove("anyOf")) {
            Some(Value::Array(several)) => several,
            _ => vec![known.take()],
        };
        if !several.contains(&new) {
            several.push(new);
        }
        *known = json!({ "anyOf": several });
    }
    if let Some(about) = about {
        known["description"] = about;
    }
}

fn property(table: &str, key: &Key, all: &[TableKeys]) -> Value {
    let mut property = match key.accepts {
        Accepts::Number | Accepts::Expression | Accepts::Quantity | Accepts::Feedback => number(),
        Accepts::Quantities => json!({ "anyOf": [number(), { "$ref": "#/$defs/numbers" }] }),
        Accepts::Pair => json!({ "$ref": "#/$defs/pair" }),
        Accepts::Pairs => json!({ "type": "array", "items": { "$ref": "#/$defs/pair" } }),
        Accepts::Vector => json!({ "type": "array", "items": number(), "minItems": 2, "maxItems": 3 }),
        Accepts::Triple => json!({ "$ref": "#/$defs/triple" }),
        Accepts::Place => json!({ "anyOf": [{ "type": "string" }, { "$ref": "#/$defs/triple" }] }),
        Accepts::Direction => json!({ "anyOf": [{ "$ref": "#/$defs/triple" }, { "$ref": "#/$defs/pair" }] }),
        Accepts::Numbers if key.name == "matrix" => json!({ "type": "array", "items": { "$ref": "#/$defs/triple" } }),
        Accepts::Numbers => json!({ "$ref": "#/$defs/numbers" }),
        Accepts::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        Accepts::Names => {
            json!({ "anyOf": [{ "type": "string" }, { "type": "array", "items": { "type": "string" } }] })
        }
        // The text is that of a copy, such as "{i}".
        Accepts::Count => json!({ "anyOf": [{ "type": "integer", "minimum": 0 }, { "type": "string" }] }),
        Accepts::Flag => json!({ "type": "boolean" }),
        Accepts::Text | Accepts::Name | Accepts::Coordinate | Accepts::Condition => json!({ "type": "string" }),
        Accepts::Marker if table.ends_with('3') => {
            json!({ "anyOf": [{ "type": "string" }, { "$ref": "#/$defs/marker3" }] })
        }
        Accepts::Marker => json!({ "type": ["string", "object"] }),
        Accepts::Motion => json!({ "anyOf": [number(), { "$ref": "#/$defs/motion" }] }),
        Accepts::Intermediate => json!({ "type": ["number", "string", "object"] }),
        Accepts::Choice(words) => json!({ "enum": words }),
        Accepts::NumberOr(words) => json!({ "anyOf": [{ "type": "number" }, { "enum": words }] }),
        Accepts::Each => {
            json!({ "anyOf": [{ "type": "object" }, { "type": "array", "items": { "type": "object" } }] })
        }
        Accepts::Tables if matches!(key.name, "design" | "table") => {
            let one = format!("#/$defs/{}.NAME", key.name);
            json!({ "type": "object", "additionalProperties": { "$ref": one } })
        }
        // The schema of the items depends on the dimension of the mechanism.
        Accepts::Tables if has_space(key.name, all) => json!({ "type": "array" }),
        Accepts::Tables => json!({ "type": "array", "items": { "$ref": format!("#/$defs/{}", key.name) } }),
        Accepts::Table if key.name == "orientation" => json!({ "$ref": "#/$defs/orientation3" }),
        Accepts::Table => inner(table, key, all),
    };
    property["description"] = json!(key.about);
    property
}

/// The schema of a table inside another one, or of one whose keys are names of the user.
fn inner(table: &str, key: &Key, all: &[TableKeys]) -> Value {
    let name = if table.is_empty() { key.name.to_owned() } else { format!("{table}.{}", key.name) };
    if all.iter().any(|table| table.name == name) {
        return json!({ "$ref": format!("#/$defs/{name}") });
    }
    let value = if key.name == "series" { json!({ "$ref": "#/$defs/numbers" }) } else { number() };
    json!({ "type": "object", "additionalProperties": value })
}

fn number() -> Value {
    json!({ "$ref": "#/$defs/number" })
}
