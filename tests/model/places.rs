//! How a mistake is shown.

use linkwright::model_file::{Diagnostic, DiagnosticReport};
use std::ops::Range;

fn fault(text: &str, span: Range<usize>) -> DiagnosticReport {
    let complaint = Diagnostic::new(span, "wrong").label("here").help("do better");
    DiagnosticReport { file: "m.toml".into(), text: text.into(), complaint, others: vec![] }
}

#[test]
fn the_text_is_underlined_where_it_stands() {
    let shown = fault("a = 1\nβ = \"crnk\"\n", 11..17).to_string();
    assert_eq!(shown, "wrong\n --> m.toml:2:5\n  |\n2 | β = \"crnk\"\n  |     ^^^^^^ here\n  |\n  = help: do better");
}

#[test]
fn places_outside_the_text_do_no_harm() {
    for (text, span) in [("", 0..0), ("", 5..9), ("a", 1..1), ("ββ", 1..3), ("a\n", 2..2)] {
        assert!(fault(text, span).to_string().contains("m.toml"));
    }
}
