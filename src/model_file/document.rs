//! The list of all keys, as it stands in the documentation.

use super::file::element_of;
use super::{Need, Table, tables};
use mechanics::elements::Measure;

/// All tables with their keys as Markdown, in the order of a file.
///
/// The section "All keys" of `docs/model-file.md` is this text; a test holds it to it.
pub fn document() -> String {
    let all = tables();
    let mut text = String::new();
    let mut last: Option<&Table> = None;
    for table in &all {
        let again = last.is_some_and(|last| last.name == table.name && last.kind == table.kind);
        if !again {
            text += &heading(table, last);
        }
        if !table.keys.is_empty() && !again {
            text += "| key | takes | left out | |\n|---|---|---|---|\n";
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
    text
}

/// A heading for a table, a line for a kind of it.
fn heading(table: &Table, last: Option<&Table>) -> String {
    let new = last.is_none_or(|last| last.name != table.name);
    let title = if table.name.is_empty() { "The file".to_owned() } else { format!("`{}`", table.name) };
    match table.kind {
        None => format!("\n### {title}\n\n{}.\n\n", capital(table.about)),
        Some(kind) if new => format!("\n### {title}\n\n**`kind = \"{kind}\"`** — {}.\n\n", table.about),
        Some(kind) => format!("\n**`kind = \"{kind}\"`**{} — {}.\n\n{}", family(table), table.about, measures(table)),
    }
}

/// The family of an element in brackets.
fn family(table: &Table) -> String {
    element_of(table).map_or(String::new(), |element| format!(" ({})", element.family))
}

/// The measures of an element, with unit and sign.
fn measures(table: &Table) -> String {
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
