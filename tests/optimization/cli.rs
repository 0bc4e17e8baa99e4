//! Exit codes and messages of the command line.

use std::process::{Command, Output};

fn linkwright(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_linkwright")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn an_unknown_problem_or_method_ends_with_one_and_the_nearest_names() {
    for (arguments, nearest) in [
        (&["compare", "impact-absorbr"][..], "`impact-absorber`"),
        (&["compare", "slider-crank", "--methods", "gcma"], "`gcmma`"),
    ] {
        let output = linkwright(arguments);
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{message}");
        assert!(
            message.starts_with("error: ") && message.contains(nearest) && message.lines().count() == 1,
            "{message}"
        );
    }
}

#[test]
fn wrong_arguments_end_with_two() {
    for arguments in [&["compare"][..], &["compare", "slider-crank", "--all"], &["compare", "--all", "--list"]] {
        assert_eq!(linkwright(arguments).status.code(), Some(2), "{arguments:?}");
    }
}

#[test]
fn a_comparison_prints_a_table_and_writes_it_with_a_figure() {
    let folder = std::env::temp_dir().join(format!("linkwright-compare-{}", std::process::id()));
    let out = folder.to_str().unwrap();
    let output = linkwright(&["compare", "impact-absorber", "--methods", "paper,hessian-errors", "--out", out]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let lines: Vec<String> = text(&output.stdout).lines().map(str::to_owned).collect();
    assert!(lines[0].starts_with("impact-absorber: "));
    assert_eq!(lines.iter().filter(|l| l.contains(" optimum ")).count(), 2);
    let csv = std::fs::read_to_string(folder.join("impact-absorber.csv")).unwrap();
    assert!(csv.starts_with("method,end,analyses_to_optimum,gradients_to_optimum,") && csv.lines().count() == 3);
    for extension in ["svg", "png"] {
        assert!(folder.join(format!("impact-absorber.{extension}")).exists());
    }
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(text(&linkwright(&["compare", "--list"]).stdout).contains("slider-crank"));
}

#[test]
fn derivatives_are_checked_by_every_method_for_readers_and_machines() {
    let model = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models/chain.toml");
    let output = linkwright(&["check", model, "--points", "2"]);
    let shown = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{shown}{}", text(&output.stderr));
    for word in ["direct", "adjoint", "semi", "differences", "±", "apart", "verdict", "more that agree"] {
        assert!(shown.contains(word), "{word} in\n{shown}");
    }
    let table = shown.lines().skip(2);
    assert!(table.clone().all(|line| line.chars().count() <= 80), "{shown}");
    let lines = text(&linkwright(&["check", model, "--points", "2", "--json", "--response", "tip_y"]).stdout);
    let objects: Vec<serde_json::Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(objects.len(), 2 * 10 + 1);
    assert!(objects[0]["semi-analytical"].is_number() && objects[0]["finding"] == "right", "{}", objects[0]);
    assert_eq!(objects[20]["wrong"], 0);
    let output = linkwright(&["check", model, "--response", "tip_z"]);
    assert!(text(&output.stderr).contains("`tip_y`") && output.status.code() == Some(1));
}

#[test]
fn check_tells_scales_that_are_far_off() {
    let told = |problem: &str| {
        let output = text(&linkwright(&["check", problem, "--points", "1"]).stdout);
        output.lines().filter(|line| line.starts_with("Scale of")).map(str::to_owned).collect::<Vec<_>>()
    };
    // The rows of the heat exchangers are differences of products of flows and temperatures, with limit zero.
    let advice = told("hs106");
    assert!(
        advice.len() == 2 && advice[0].contains("`g4`") && advice[0].contains("Write `scale = 1.2e6`"),
        "{advice:#?}"
    );
    let json = text(&linkwright(&["check", "hs106", "--points", "1", "--json"]).stdout);
    let last: serde_json::Value = serde_json::from_str(json.lines().last().unwrap()).unwrap();
    assert_eq!(last["scales"].as_array().unwrap().len(), 2, "{last}");
    for problem in ["impact-absorber", "slider-crank", "cantilever", "ten-bar-truss", "vehicle-suspension"] {
        assert!(told(problem).is_empty(), "{problem}: {:#?}", told(problem));
    }
}
