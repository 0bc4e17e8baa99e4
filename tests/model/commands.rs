//! The commands on model files, as a user types them.
#![cfg(feature = "cli")]

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::Duration;

fn linkwright(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_linkwright")).args(arguments).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// A fresh folder that is removed at the end.
pub struct Place(pub PathBuf);

impl Place {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("linkwright-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn example(&self, name: &str) {
        let from = format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        std::fs::copy(from, self.0.join(format!("{name}.toml"))).unwrap();
    }

    pub fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.0.join(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    pub fn run(&self, arguments: &[&str], code: i32) -> String {
        let output = linkwright(arguments, &self.0);
        let all = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}\n{all}");
        all
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

#[test]
fn from_nothing_to_an_optimized_mechanism() {
    let place = Place::new("starter");
    place.run(&["new", "lift"], 0);
    assert!(place.run(&["new", "lift"], 1).contains("exists"));
    let checked = place.run(&["check", "lift.toml"], 0);
    assert!(checked.starts_with("lift: 3 design variables, 3 responses, 5 constraints, 151 time points"), "{checked}");
    let shown = place.run(&["optimize", "lift.toml"], 0);
    assert!(shown.contains("Converged"), "{shown}");
    for file in
        ["model.toml", "run.json", "state.json", "cycles.csv", "responses.csv", "constraints.csv", "summary.json"]
    {
        assert!(!place.read(&format!("out/lift/{file}")).is_empty());
    }
    assert!(place.run(&["optimize", "lift.toml"], 1).contains("resume"));
}

#[test]
fn one_design_is_analysed_and_differentiated() {
    let place = Place::new("analyze");
    place.example("impact-absorber");
    let shown = place.run(&["analyze", "impact-absorber.toml", "--at", "k=0.36276,c=0.48231", "--out", "here"], 0);
    assert!(shown.contains("displacement upper"), "{shown}");
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
    assert!(place.run(&["analyze", "impact-absorber.toml", "--at", "q=1"], 1).contains("choose from k, c, peak"));
    assert!(place.run(&["analyze", "impact-absorber.toml", "--at", "k=9"], 1).contains("bounds"));
}

#[test]
fn json_lines_are_json_and_quiet_is_quiet() {
    let place = Place::new("json");
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
    let place = Place::new("codes");
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
    let place = Place::new("edit");
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
        serde_json::json!([{ "after_tries": 3, "lines": ["max_cycles = 90 # more"] }])
    );
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
    assert!(place.run(&["resume", "nowhere"], 1).contains("no run"));
}

#[test]
fn a_run_that_is_killed_at_any_moment_is_resumed_to_the_same_end() {
    let place = Place::new("kill");
    place.example("impact-absorber-comfort");
    let file = "impact-absorber-comfort.toml";
    let begun = std::time::Instant::now();
    place.run(&["optimize", file, "--quiet", "--out", "whole"], 0);
    let whole = begun.elapsed();
    let mut interrupted = 0;
    for k in 0..12u32 {
        let out = format!("cut{k}");
        let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
            .args(["optimize", file, "--quiet", "--out", &out])
            .current_dir(&place.0)
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_secs_f64(whole.as_secs_f64() * f64::from(k) / 12.0));
        drop(child.kill());
        child.wait().unwrap();
        interrupted += usize::from(!place.0.join(&out).join("summary.json").exists());
        if !place.0.join(&out).join("run.json").exists() {
            // Killed before anything was written: there is nothing to resume.
            continue;
        }
        place.run(&["resume", &out, "--quiet"], 0);
        for name in ["cycles.csv", "summary.json", "responses.csv", "state.json"] {
            assert_eq!(place.read(&format!("{out}/{name}")), place.read(&format!("whole/{name}")), "{name} of {out}");
        }
    }
    assert!(interrupted > 0);
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let place = Place::new("full");
    place.example("cantilever");
    std::fs::write(place.0.join("file"), "").unwrap();
    let shown = place.run(&["optimize", "cantilever.toml", "--out", "file/runs"], 1);
    assert!(shown.contains("file/runs"), "{shown}");
}

/// Every `$ linkwright …` of the tutorial ends well and prints the lines that stand below it.
#[test]
fn the_tutorial_does_what_it_says() {
    let place = Place::new("tutorial");
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
    assert_eq!(commands, 8);
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
