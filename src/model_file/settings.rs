//! All values of a model file, key by key, for telling two files apart.

use super::{Diagnostic, DiagnosticReport};
use std::collections::BTreeMap;
use toml::de::{DeTable, DeValue};

/// Every value under its whole key, as it is written: `design.k.lower` is `1e-6`, `joint.pin.a` is `"ground"`. Tables of a list
/// go by their name, or by their number where they have none.
///
/// **Errors.** A text that is not TOML.
pub fn settings(file: &str, text: &str) -> Result<BTreeMap<String, String>, Box<DiagnosticReport>> {
    let broken = |e: toml::de::Error| {
        let complaint = Diagnostic::new(e.span().unwrap_or(0..0), e.message());
        Box::new(DiagnosticReport { file: file.to_owned(), text: text.to_owned(), complaint, others: vec![] })
    };
    let table = DeTable::parse(text).map_err(broken)?.into_inner();
    let mut found = BTreeMap::new();
    collect("", &table, &mut found);
    Ok(found)
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
        DeValue::String(text) => format!("{text:?}"),
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
    fn tables_of_a_list_go_by_their_names() {
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
}
