//! The commands on model files, as a user types them.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright, text};

#[test]
fn from_nothing_to_an_optimized_mechanism() {
    let place = TempFolder::new("starter");
    place.run(&["new", "lift"], 0);
    assert!(place.run(&["new", "lift"], 1).contains("exists"));
    let checked = place.run(&["check", "lift.toml"], 0);
    assert!(checked.starts_with("lift: 3 design variables, 3 responses, 2 constraints, 151 time points"), "{checked}");
    let shown = place.run(&["optimize", "lift.toml"], 0);
    assert!(shown.contains("Converged"), "{shown}");
    for file in [
        "model.toml",
        "run.json",
        "state.json",
        "history.jsonl",
        "cycles.csv",
        "responses.csv",
        "constraints.csv",
        "summary.json",
    ] {
        assert!(!place.read(&format!("out/lift/{file}")).is_empty());
    }
    let run: serde_json::Value = serde_json::from_str(&place.read("out/lift/run.json")).unwrap();
    assert!(run["input"].as_str().unwrap().starts_with("fnv1a64:") && run["begun"].as_str().unwrap().ends_with('Z'));
    assert!(place.run(&["optimize", "lift.toml", "--out", "out/lift"], 1).contains("resume"));
}

#[test]
fn one_design_is_analysed_and_differentiated() {
    let place = TempFolder::new("analyze");
    place.example("impact-absorber");
    let shown = place.run(&["analyze", "impact-absorber.toml", "--at", "k=0.36276,c=0.48231", "--out", "here"], 0);
    assert!(shown.contains("1 ≤ 1 m at 2.04 s, active"), "{shown}");
    assert_eq!(place.read("here/responses.csv").lines().count(), 102);
    assert!(place.read("here/responses.csv").starts_with("time,displacement,acceleration\n0,0,"));
    let shown = place.run(&["sensitivities", "impact-absorber.toml", "--out", "here"], 0);
    assert!(shown.contains("d/d k"), "{shown}");
    // The acceleration at the start is −c: its derivative with respect to c is −1.
    let table = place.read("here/sensitivities.csv");
    let first = table.lines().find(|line| line.starts_with("acceleration,0,")).unwrap();
    let numbers: Vec<f64> = first.split(',').skip(2).map(|n| n.parse().unwrap()).collect();
    for (found, expected) in numbers.iter().zip([-0.3, 0.0, -1.0, 0.0]) {
        assert!((found - expected).abs() < 1e-9, "{first}");
    }
    assert!(place.run(&["analyze", "impact-absorber.toml", "--at", "q=1"], 1).contains("choose from k, c"));
    let shown = place.run(&["optimize", "impact-absorber.toml", "--set", "k=3"], 1);
    assert!(shown.contains("`k` is a design variable") && shown.contains("--start k=3"), "{shown}");
    assert!(place.run(&["analyze", "impact-absorber.toml", "--at", "k=9"], 1).contains("bounds"));
}

#[test]
fn json_lines_are_json_and_quiet_is_quiet() {
    let place = TempFolder::new("json");
    place.example("two-bar-truss");
    let shown = place.run(&["optimize", "two-bar-truss.toml", "--json", "--out", "a"], 0);
    let lines: Vec<serde_json::Value> = shown.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert!(lines.len() > 2 && lines[..lines.len() - 1].iter().all(|line| line["event"] == "cycle"));
    let end = &lines[lines.len() - 1];
    assert_eq!((&end["event"], &end["status"], &end["version"]), (&"end".into(), &"Converged".into(), &1.into()));
    assert!((end["objective"]["value"].as_f64().unwrap() - 1.50865).abs() < 1e-4);
    assert_eq!(place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "b"], 0), "");
    assert_eq!(place.read("a/cycles.csv"), place.read("b/cycles.csv"));
}

#[test]
fn mistakes_end_with_one_and_limits_with_three() {
    let place = TempFolder::new("codes");
    place.example("cantilever");
    let good = place.read("cantilever.toml");
    std::fs::write(place.0.join("bad.toml"), good.replace("at_most", "atmost")).unwrap();
    let shown = place.run(&["optimize", "bad.toml"], 1);
    assert!(shown.starts_with("error: constraint `stiff` has no key `atmost`\n  --> bad.toml:"), "{shown}");
    assert!(place.run(&["check", "missing.toml"], 1).contains("cannot read the model missing.toml"));
    std::fs::write(place.0.join("short.toml"), good.clone() + "max_cycles = 2\n").unwrap();
    assert!(place.run(&["optimize", "short.toml"], 3).contains("CycleLimit"));
    assert_eq!(linkwright(&["optimize"], &place.0).status.code(), Some(2));
}

#[test]
fn settings_may_be_edited_between_two_parts_of_a_run_but_not_the_problem() {
    let place = TempFolder::new("edit");
    place.example("cantilever");
    let good = place.read("cantilever.toml");
    place.run(&["optimize", "cantilever.toml", "--quiet", "--out", "whole"], 0);
    std::fs::write(place.0.join("short.toml"), good.clone() + "max_cycles = 3\n").unwrap();
    place.run(&["optimize", "short.toml", "--quiet", "--out", "parts"], 3);
    std::fs::write(place.0.join("parts/model.toml"), good.clone() + "max_cycles = 90 # more\n").unwrap();
    place.run(&["resume", "parts", "--quiet"], 0);
    assert_eq!(place.read("parts/cycles.csv"), place.read("whole/cycles.csv"));
    let summary = |folder: &str| {
        serde_json::from_str::<serde_json::Value>(&place.read(&format!("{folder}/summary.json"))).unwrap()
    };
    assert_eq!(summary("parts")["design"], summary("whole")["design"]);
    assert_eq!(
        summary("parts")["edits"],
        serde_json::json!([{
            "after_tries": 3,
            "lines": ["max_cycles = 90 # more"],
            "changes": [{ "key": "method.max_cycles", "before": "3", "after": "90" }],
        }])
    );
    // The history says so, between the cycles before and after.
    let history = place.read("parts/history.jsonl");
    let events: Vec<serde_json::Value> = history.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let edit = events.iter().position(|event| event["event"] == "edit").unwrap();
    assert_eq!((&events[edit - 1]["status"], &events[edit + 1]["cycle"]), (&"CycleLimit".into(), &4.into()));
    assert_eq!(events[edit]["changes"][0]["after"], "90");
    // Tighter bounds: the last design is within them, the new optimum at one of them.
    let bounded = good
        .replace("x5 = { start = 5.0, lower = 1.0", "x5 = { start = 5.0, lower = 2.1")
        .replace("x1 = { start = 5.0, lower = 1.0, upper = 10.0", "x1 = { start = 5.0, lower = 1.0, upper = 6.02");
    std::fs::write(place.0.join("parts/model.toml"), bounded).unwrap();
    place.run(&["resume", "parts", "--quiet"], 0);
    std::fs::write(
        place.0.join("parts/model.toml"),
        good.replace("x1 = { start = 5.0, lower = 1.0, upper = 10.0", "x1 = { start = 5.0, lower = 1.0, upper = 5.5"),
    )
    .unwrap();
    assert!(place.run(&["resume", "parts"], 1).contains("the bounds exclude the last accepted design"));
    std::fs::write(place.0.join("parts/model.toml"), good.replace("61/x1", "62/x1")).unwrap();
    assert!(place.run(&["resume", "parts"], 1).contains("another problem"));
    assert!(place.run(&["resume", "nowhere"], 1).contains("there is no folder nowhere"));
}

/// Every `$ linkwright …` of the tutorial succeeds and prints the lines below it.
#[test]
fn the_tutorial_does_what_it_says() {
    let place = TempFolder::new("tutorial");
    let page = std::fs::read_to_string(format!("{}/docs/tutorial.md", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let consoles = page.split("```console\n").skip(1).map(|rest| rest.split("```").next().unwrap());
    let (mut shown, mut commands) = (String::new(), 0);
    for line in consoles.flat_map(str::lines) {
        match line.strip_prefix("$ linkwright ") {
            Some(arguments) => {
                shown = place.run(&arguments.split_whitespace().collect::<Vec<_>>(), 0);
                commands += 1;
            }
            None => assert!(shown.contains(line), "`{line}` is not in\n{shown}"),
        }
    }
    assert_eq!(commands, 12);
    // The misspelt name of the tutorial.
    let good = place.read("lift.toml");
    std::fs::write(
        place.0.join("lift.toml"),
        good.replacen("body = \"arm\", at = [\"-l", "body = \"amr\", at = [\"-l", 1),
    )
    .unwrap();
    let expected = page.split("```text\n").nth(1).unwrap().split("```").next().unwrap();
    assert_eq!(text(&linkwright(&["check", "lift.toml"], &place.0).stderr), expected);
}
