//! The keys of a model file for editors.

use super::{Accepts, Key, Need, Table, tables};
use serde_json::{Map, Value, json};

/// The JSON schema of model files, made from the keys that the reader knows.
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
    definitions.insert("numbers".into(), json!({ "type": "array", "items": number() }));
    let mut file = object("", &all);
    file["$schema"] = json!("https://json-schema.org/draft/2020-12/schema");
    file["title"] = json!("model file of linkwright");
    file["$defs"] = Value::Object(definitions);
    file
}

/// One table: the keys of all its kinds, and for each kind those that it requires.
fn object(name: &str, all: &[Table]) -> Value {
    let own = || all.iter().filter(|table| table.name == name);
    let mut properties = Map::new();
    for key in own().flat_map(|table| table.keys) {
        properties.entry(key.name).or_insert_with(|| property(name, key, all));
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

fn property(table: &str, key: &Key, all: &[Table]) -> Value {
    let mut property = match key.accepts {
        Accepts::Number | Accepts::Expression | Accepts::Quantity | Accepts::Feedback => number(),
        Accepts::Pair => json!({ "$ref": "#/$defs/pair" }),
        Accepts::Numbers => json!({ "$ref": "#/$defs/numbers" }),
        Accepts::Count => json!({ "type": "integer", "minimum": 0 }),
        Accepts::Flag => json!({ "type": "boolean" }),
        Accepts::Text | Accepts::Name | Accepts::Coordinate => json!({ "type": "string" }),
        Accepts::Marker => json!({ "type": ["string", "object"] }),
        Accepts::Motion => json!({ "anyOf": [number(), { "$ref": "#/$defs/motion" }] }),
        Accepts::Intermediate => json!({ "type": ["number", "string", "object"] }),
        Accepts::Choice(words) => json!({ "enum": words }),
        Accepts::NumberOr(words) => json!({ "anyOf": [{ "type": "number" }, { "enum": words }] }),
        Accepts::Each => json!({ "type": "object" }),
        Accepts::Tables if key.name == "design" => {
            json!({ "type": "object", "additionalProperties": { "$ref": "#/$defs/design.NAME" } })
        }
        Accepts::Tables => json!({ "type": "array", "items": { "$ref": format!("#/$defs/{}", key.name) } }),
        Accepts::Table => inner(table, key, all),
    };
    property["description"] = json!(key.about);
    property
}

/// A table inside another one, or one whose keys are the user's names.
fn inner(table: &str, key: &Key, all: &[Table]) -> Value {
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
