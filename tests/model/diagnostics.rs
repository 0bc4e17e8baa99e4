//! Display of diagnostics.

use linkwright::model_file::{Diagnostic, DiagnosticReport};
use std::ops::Range;

fn report(text: &str, span: Range<usize>) -> DiagnosticReport {
    let diagnostics = vec![Diagnostic::new(span, "wrong").label("here").help("do better")];
    DiagnosticReport { file: "m.toml".into(), text: text.into(), diagnostics }
}

/// The report about the first occurrence of `word`.
fn about(text: &str, word: &str) -> String {
    let start = text.find(word).unwrap();
    report(text, start..start + word.len()).to_string()
}

#[test]
fn the_text_is_underlined() {
    let shown = about("a = 1\nβ = \"crnk\"\n", "\"crnk\"");
    assert_eq!(shown, "wrong\n --> m.toml:2:5\n  |\n2 | β = \"crnk\"\n  |     ^^^^^^ here\n  |\n  = help: do better");
}

#[test]
fn wide_characters_and_tabs_are_aligned() {
    let shown = [
        about("title = \"四連桿機構\" # 二\nb = \"crnk\"\n", "四連桿機構"),
        about("unit = \"🙂🙂\"; b = \"crnk\"", "\"crnk\""),
        about("\tname =\t\"crnk\"\t# a tab before", "\"crnk\""),
        about("values = [\n  1,\n  2,\n]\n", "[\n  1,\n  2,\n]"),
        about(&format!("{}wrong{}", "long ".repeat(60), " and longer".repeat(30)), "wrong"),
    ];
    insta::assert_snapshot!("layout", shown.join("\n\n"));
}

#[test]
fn spans_outside_the_text_are_shown() {
    for (text, span) in [("", 0..0), ("", 5..9), ("a", 1..1), ("ββ", 1..3), ("a\n", 2..2), ("a\r\nb\r\n", 2..6)] {
        assert!(report(text, span).to_string().contains("m.toml"));
    }
}

#[test]
fn a_body_with_a_mistake_is_not_missing() {
    let text = "version = 2\n[[body]]\nname = 'a'\nmass = 1\ninertia = 1\nomega = 2\n[[force]]\nname = 'f'\nkind = 'force'\n\
                at = 'a'\ndirection = 0\nforce = 1\n[time]\nto = 1\npoints = 2\n[analysis]\nkind = 'dynamics'\nstep = 0.1\n";
    let report = linkwright::model_file::read("m.toml", text).map(|_| ()).unwrap_err();
    assert_eq!(report.diagnostics.len(), 1, "{report}");
    assert!(report.to_string().contains("no key `omega`"), "{report}");
}

/// A common word for a measure leads to its name in model files.
#[test]
fn usual_words_for_measures_lead_to_their_names() {
    let template =
        std::fs::read_to_string(format!("{}/src/command/template.toml", env!("CARGO_MANIFEST_DIR"))).unwrap();
    for (word, name) in
        [("angle", "theta"), ("rotation", "theta"), ("angular_velocity", "omega"), ("angular_acceleration", "alpha")]
    {
        let text = template.replace("value = \"arm.theta\"", &format!("value = \"arm.{word}\""));
        assert_ne!(text, template);
        let shown = linkwright::model_file::read("m.toml", &text).err().unwrap().to_string();
        assert!(shown.contains(&format!("did you mean `arm.{name}`?")), "{word}: {shown}");
    }
}

/// A common word for a part of a model leads to the section in which it is declared.
#[test]
fn usual_words_for_sections_lead_to_their_names() {
    let words =
        [("spring", "force"), ("motor", "driver"), ("hinge", "joint"), ("link", "body"), ("variables", "design")];
    for (word, name) in words {
        let text = format!("version = 2\n[{word}]\n");
        let shown = linkwright::model_file::read("m.toml", &text).err().unwrap().to_string();
        assert!(shown.contains(&format!("the file has no key `{word}`")), "{word}: {shown}");
        assert!(shown.contains(&format!("did you mean `{name}`?")), "{word}: {shown}");
    }
}

/// The limits of a constraint have other names in other programs, as have the bounds of a design variable.
#[test]
fn usual_words_for_limits_lead_to_their_names() {
    let template =
        std::fs::read_to_string(format!("{}/src/command/template.toml", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let limit = "\n[[constraint]]\nname = \"limit\"\nvalue = \"arm.theta\"\n";
    for (word, name) in
        [("upper", "at_most"), ("max", "at_most"), ("lower", "at_least"), ("min", "at_least"), ("equal", "equals")]
    {
        let shown = linkwright::model_file::read("m.toml", &format!("{template}{limit}{word} = 1\n"));
        let shown = shown.err().unwrap().to_string();
        assert!(shown.contains(&format!("did you mean `{name}`?")), "{word}: {shown}");
    }
    for (key, word) in [("upper", "max"), ("lower", "min"), ("upper", "upper_bound")] {
        let text = format!(
            "version = 2\n[design]\nx = {{ start = 1, {word} = 2 }}\n[time]\nto = 1\npoints = 2\n[objective]\nminimize = \"x\"\n"
        );
        let shown = linkwright::model_file::read("m.toml", &text).err().unwrap().to_string();
        assert!(shown.contains(&format!("did you mean `{key}`?")), "{word}: {shown}");
    }
}

/// A measure in a function of time leads to the kinds of forces that depend on the motion.
#[test]
fn a_force_of_time_with_a_measure_leads_to_feedback() {
    let template =
        std::fs::read_to_string(format!("{}/src/command/template.toml", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let load =
        "\n[[force]]\nname = \"drag\"\nkind = \"load\"\nb = \"arm.theta\"\ngeneralized_force = \"-2*arm.omega\"\n";
    let shown = linkwright::model_file::read("m.toml", &format!("{template}{load}")).err().unwrap().to_string();
    assert!(
        shown.contains("there is no name `arm.omega`") && shown.contains("\"feedback\", of a coordinate"),
        "{shown}"
    );
}

/// Both uses of a name are shown, as both places of a key.
#[test]
fn a_name_that_is_used_twice_has_both_places() {
    let head = "version = 2\n[design.x]\nstart = 1\n";
    let output = "[[output]]\nname = \"y\"\nvalue = \"x\"\n";
    let constraint = "[[constraint]]\nname = \"c\"\nvalue = \"x\"\nat_most = 2\n";
    for (text, says) in [
        (format!("{head}{output}{output}"), "the name `y` is taken twice"),
        (format!("{head}{output}").replace("\"y\"", "\"x\""), "the name `x` is taken twice"),
        (format!("{head}[objective]\nminimize = \"x\"\n{constraint}{constraint}"), "the name `c` is taken twice"),
        (format!("{head}start = 2\n"), "`start` is given twice"),
        (format!("{head}{output}[design.x]\nstart = 2\n"), "`design.x` is given twice"),
        (format!("{head}{output}value = \"2*x\"\n"), "`value` is given twice"),
    ] {
        let shown = linkwright::model_file::read("m.toml", &text).map(|_| ()).unwrap_err().to_string();
        for part in [says, "first use", "second use"] {
            assert!(shown.contains(part), "{part}: {shown}");
        }
    }
}
