//! The benchmark page of mechanics: every number is computed and compared with its reference, and the page has the computed tables.

#[path = "../../examples/mechanics_benchmarks/series.rs"]
mod series;
#[path = "../../examples/mechanics_benchmarks/table.rs"]
mod table;

use linkwright::model_file::read;
use table::{comparison, compute, orders, outside, references};

const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models");

/// Compares the part of the page between two comments with `found`, or writes it if `UPDATE_DOCS` is set.
fn assert_on_page(part: &str, found: &str) {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/mechanics-benchmarks.md");
    let page = std::fs::read_to_string(path).unwrap();
    let (begin, end) = (format!("<!-- {part} -->\n"), format!("<!-- end of {part} -->"));
    let (before, rest) = page.split_once(&begin).unwrap_or_else(|| panic!("the page has no part `{part}`"));
    let (listed, after) = rest.split_once(&end).unwrap_or_else(|| panic!("`{part}` has no end"));
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, format!("{before}{begin}{found}{end}{after}")).unwrap();
    } else {
        assert!(listed == found, "run this test with UPDATE_DOCS=1 to bring the page up to date; computed:\n{found}");
    }
}

/// One test, because both parts write the same page.
#[test]
fn the_benchmarks_meet_their_references_and_are_on_the_page() {
    let csv = std::fs::read_to_string(format!("{MODELS}/benchmarks/references.csv")).unwrap();
    let references = references(&csv);
    let values = compute(MODELS, &references).unwrap_or_else(|e| panic!("{e}"));
    let wrong = outside(&references, &values);
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let series = series::all(&references);
    let (table, measured) = orders(MODELS, &series).unwrap_or_else(|e| panic!("{e}"));
    for (s, order) in series.iter().zip(measured) {
        // Errors of high-order schemes decrease a little faster than in theory as long as steps are not very small.
        let expected = 0.9 * s.order..1.25 * s.order;
        assert!(expected.contains(&order), "{} with {}: order {order}\n{table}", s.model, s.scheme);
    }
    assert_on_page("table of references", &comparison(&references, &values));
    assert_on_page("table of orders", &table);
}

/// Without numerical damping the errors of the reactions change sign from step to step and grow in every singular position, until
/// Newton's iteration fails.
#[test]
fn a02_without_numerical_damping_fails_with_the_remedy() {
    let text = std::fs::read_to_string(format!("{MODELS}/benchmarks/a02.toml")).unwrap();
    let text = text.replace("1..40", "1..2");
    let analyze = |radius: &str| {
        let text = text.replace("spectral_radius = 0.9", &format!("spectral_radius = {radius}"));
        let problem = read("a02.toml", &text).unwrap_or_else(|report| panic!("{report}")).problem().unwrap();
        problem.analyze(&problem.start())
    };
    let error = analyze("1.0").unwrap_err().to_string();
    assert!(error.contains("add numerical damping, a spectral radius below 1"), "{error}");
    assert!(analyze("0.99").is_ok());
}
