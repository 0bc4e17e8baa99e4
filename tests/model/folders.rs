//! Run folders that come from elsewhere: links, other people's files, changed states, special files, control characters.
#![cfg(all(feature = "cli", unix))]

use crate::shell::{TempFolder, linkwright, sealed, text};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

const TRUSS: &str = "two-bar-truss.toml";
const VICTIM: &str = "the user's own file\n";

/// A folder with the model of the two-bar truss.
fn truss(name: &str) -> TempFolder {
    let place = TempFolder::new(name);
    place.example("two-bar-truss");
    place
}

/// All files below a folder, with their bytes. Links are not followed.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = vec![];
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let kind = entry.file_type().unwrap();
        if kind.is_dir() {
            found.extend(files(&entry.path()));
        } else if kind.is_file() {
            found.push((entry.path(), std::fs::read(entry.path()).unwrap()));
        }
    }
    found.sort();
    found
}

/// Runs the command for at most a time; `None` if it takes longer.
fn within(seconds: u64, arguments: &[&str], folder: &Path) -> Option<Output> {
    let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while begun.elapsed() < Duration::from_secs(seconds) {
        if child.try_wait().unwrap().is_some() {
            return Some(child.wait_with_output().unwrap());
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    None
}

/// Every name that a command writes below its folder, and the names that earlier versions wrote for a moment.
fn written_names(folder: &Path) -> Vec<String> {
    let inside = |(path, _): &(PathBuf, Vec<u8>)| path.strip_prefix(folder).unwrap().display().to_string();
    let names: Vec<String> = files(folder).iter().map(inside).collect();
    let parts = names.iter().map(|name| format!("{name}.part"));
    names.iter().cloned().chain(parts).collect()
}

/// A command that writes into the folder `out`, after the commands that prepare it.
const WRITERS: &[(&[&[&str]], &[&str])] = &[
    (&[], &["optimize", TRUSS, "--quiet", "--out", "out", "--report"]),
    (&[&["optimize", TRUSS, "--quiet", "--out", "out"]], &["report", "out", "--slice", "0"]),
    (&[&["optimize", TRUSS, "--quiet", "--out", "out"], &["longer"]], &["resume", "out", "--quiet"]),
    (&[], &["analyze", TRUSS, "--out", "out"]),
    (&[], &["sensitivities", TRUSS, "--out", "out"]),
    (&[], &["check", TRUSS, "--out", "out"]),
    (&[], &["compare", TRUSS, "--methods", "slp", "--out", "out"]),
    (&[], &["compare", "two-bar-truss", "--methods", "slp", "--out", "out"]),
    (&[], &["reproduce", "svanberg-1987", "--only", "two_bar_truss", "--out", "out"]),
];

fn prepare(place: &TempFolder, commands: &[&[&str]]) {
    for command in commands {
        if *command == ["longer"] {
            let model =
                place.read("out/model.toml").replace("preset = \"gcmma\"", "preset = \"gcmma\"\naccuracy = 1e-9");
            std::fs::write(place.0.join("out/model.toml"), model).unwrap();
        } else {
            place.run(command, 0);
        }
    }
}

#[test]
fn no_command_writes_through_a_link() {
    for (preparation, command) in WRITERS {
        let place = truss("links");
        let out = place.0.join("out");
        prepare(&place, preparation);
        let prepared = if out.exists() { files(&out) } else { vec![] };
        let output = linkwright(command, &place.0);
        assert_eq!(output.status.code(), Some(0), "{command:?}: {}", text(&output.stderr));
        let names = written_names(&out);
        assert!(names.len() > 3, "{names:?}");
        // The figures of a report are those of the command `report`.
        let is_tried =
            |name: &&String| !name.starts_with("figures/") || (command[0] == "report" && !name.ends_with(".part"));
        for name in names.iter().filter(is_tried) {
            std::fs::remove_dir_all(&out).unwrap();
            std::fs::create_dir(&out).unwrap();
            prepared.iter().for_each(|(path, bytes)| std::fs::write(path, bytes).unwrap());
            let (victim, link) = (place.0.join("victim"), out.join(name));
            std::fs::write(&victim, VICTIM).unwrap();
            std::fs::create_dir_all(link.parent().unwrap()).unwrap();
            drop(std::fs::remove_file(&link));
            symlink(&victim, &link).unwrap();
            let output = linkwright(command, &place.0);
            assert_eq!(std::fs::read_to_string(&victim).unwrap(), VICTIM, "{command:?} through {name}");
            assert_ne!(output.status.code(), Some(101), "{command:?}: {}", text(&output.stderr));
        }
    }
}

#[test]
fn no_command_writes_into_a_linked_folder() {
    for name in ["figures", "figures/figures"] {
        let place = truss("linked-folder");
        place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 0);
        std::fs::create_dir(place.0.join("victims")).unwrap();
        if let Some(parent) = Path::new(name).parent().filter(|p| !p.as_os_str().is_empty()) {
            std::fs::create_dir(place.0.join("out").join(parent)).unwrap();
        }
        symlink(place.0.join("victims"), place.0.join("out").join(name)).unwrap();
        let output = linkwright(&["report", "out", "--slice", "0"], &place.0);
        assert!(files(&place.0.join("victims")).is_empty(), "{}", text(&output.stderr));
    }
    // The folder of a run in the default place, too.
    let place = truss("linked-default");
    std::fs::create_dir_all(place.0.join("victims")).unwrap();
    std::fs::create_dir_all(place.0.join("out")).unwrap();
    symlink(place.0.join("victims"), place.0.join("out/two-bar-truss")).unwrap();
    let shown = place.run(&["optimize", TRUSS], 1);
    assert!(shown.contains("symbolic link") && files(&place.0.join("victims")).is_empty(), "{shown}");
}

#[test]
fn a_history_with_a_second_name_is_not_appended_to() {
    let place = truss("hard-link");
    place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 0);
    prepare(&place, &[&["longer"]]);
    std::fs::hard_link(place.0.join("out/history.jsonl"), place.0.join("victim")).unwrap();
    let before = place.read("victim");
    let shown = text(&linkwright(&["resume", "out", "--quiet"], &place.0).stderr);
    assert!(place.read("victim") == before && shown.contains("history.jsonl") && shown.contains("copy"), "{shown}");
}

#[test]
fn a_new_model_file_is_not_written_through_a_link() {
    let place = TempFolder::new("new-link");
    symlink(place.0.join("victim"), place.0.join("lift.toml")).unwrap();
    assert!(place.run(&["new", "lift"], 1).contains("exists"));
    assert!(!place.0.join("victim").exists());
}

#[test]
fn of_two_runs_in_one_folder_one_is_rejected() {
    for k in 0..20 {
        let place = truss("race");
        place.example("cantilever");
        let start = |file: &str| {
            Command::new(env!("CARGO_BIN_EXE_linkwright"))
                .args(["optimize", file, "--quiet", "--out", "one"])
                .current_dir(&place.0)
                .stderr(Stdio::piped())
                .spawn()
                .unwrap()
        };
        let both = if k % 2 == 0 { [TRUSS, "cantilever.toml"] } else { ["cantilever.toml", TRUSS] };
        let ends = both.map(start).map(|child| child.wait_with_output().unwrap());
        let codes = ends.each_ref().map(|end| end.status.code().unwrap());
        let won = codes.iter().position(|code| *code == 0).unwrap_or_else(|| panic!("{codes:?}"));
        let shown = text(&ends[1 - won].stderr);
        assert_eq!(codes[1 - won], 1, "round {k}: {shown}");
        assert!(shown.contains("another process runs in one") || shown.contains("has a run in it"), "{shown}");
        let model = std::fs::read(place.0.join(both[won])).unwrap();
        assert_eq!(std::fs::read(place.0.join("one/model.toml")).unwrap(), model, "the result is that of the winner");
    }
}

/// Reports that are written at once, of which each has read the list of files before the other changed it.
#[test]
fn of_two_reports_in_one_folder_both_end_well() {
    let place = truss("two-reports");
    place.run(&["optimize", TRUSS, "--quiet", "--out", "one"], 0);
    for round in 0..6 {
        for name in ["report.html", "figures"] {
            let old = place.0.join("one").join(name);
            drop(std::fs::remove_file(&old));
            drop(std::fs::remove_dir_all(&old));
        }
        let list = place.read("one/files.json").replace("    \"report.html\",\n", "");
        std::fs::write(place.0.join("one/files.json"), list).unwrap();
        let start = |_| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
            command.args(["report", "one", "--quiet", "--slice", "0"]).current_dir(&place.0).stderr(Stdio::piped());
            command.spawn().unwrap()
        };
        for end in [0, 1, 2].map(start).map(|child| child.wait_with_output().unwrap()) {
            assert!(end.status.success(), "round {round}: {}", text(&end.stderr));
        }
        let figures = std::fs::read_dir(place.0.join("one/figures")).unwrap();
        let figures: Vec<_> = figures.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        let list = place.read("one/figures/files.json");
        let missing: Vec<_> = figures.iter().filter(|name| *name != "files.json" && !list.contains(*name)).collect();
        assert!(missing.is_empty() && figures.len() > 4, "round {round}: {missing:?} of {figures:?}");
        assert!(place.read("one/files.json").contains("report.html"));
    }
}

#[test]
fn other_peoples_files_are_not_replaced() {
    let place = truss("foreign");
    for name in ["model.toml", "cycles.csv", "summary.json", "report.html", "notes.txt"] {
        let own = place.0.join(format!("own-{name}"));
        std::fs::create_dir(&own).unwrap();
        std::fs::write(own.join(name), VICTIM).unwrap();
        let out = own.display().to_string();
        let shown = place.run(&["optimize", TRUSS, "--quiet", "--out", &out], 1);
        assert!(shown.contains("is not empty") && shown.contains("--force"), "{shown}");
        let names: Vec<_> = files(&own).into_iter().map(|(path, _)| path).collect();
        assert_eq!(names, [own.join(name)], "a rejected run leaves nothing behind");
        // With --force a run lies next to other files, but it does not replace them.
        let forced = linkwright(&["optimize", TRUSS, "--quiet", "--force", "--out", &out], &place.0);
        assert_eq!(forced.status.code(), Some(i32::from(name != "notes.txt")), "{}", text(&forced.stderr));
        assert_eq!(std::fs::read_to_string(own.join(name)).unwrap(), VICTIM);
    }
    for command in [
        ["analyze", TRUSS, "--out", "mine"].as_slice(),
        &["sensitivities", TRUSS, "--out", "mine"],
        &["check", TRUSS, "--out", "mine"],
        &["compare", TRUSS, "--methods", "slp", "--out", "mine"],
    ] {
        drop(std::fs::remove_dir_all(place.0.join("mine")));
        std::fs::create_dir(place.0.join("mine")).unwrap();
        for name in ["responses.csv", "sensitivities.csv", "derivatives.csv", "two-bar-truss.csv"] {
            std::fs::write(place.0.join("mine").join(name), VICTIM).unwrap();
        }
        let shown = text(&linkwright(command, &place.0).stderr);
        assert!(shown.contains("exists"), "{command:?}: {shown}");
        assert!(files(&place.0.join("mine")).iter().all(|(_, bytes)| bytes == VICTIM.as_bytes()));
    }
    // A command replaces files that it wrote itself.
    place.run(&["analyze", TRUSS, "--out", "twice"], 0);
    place.run(&["analyze", TRUSS, "--out", "twice"], 0);
    // A figure of the user among the figures of a report.
    place.run(&["optimize", TRUSS, "--quiet", "--out", "run"], 0);
    std::fs::create_dir(place.0.join("run/figures")).unwrap();
    std::fs::write(place.0.join("run/figures/convergence.svg"), VICTIM).unwrap();
    let output = linkwright(&["report", "run", "--slice", "0"], &place.0);
    assert_eq!(place.read("run/figures/convergence.svg"), VICTIM);
    assert!(output.status.code() == Some(1) && text(&output.stderr).contains("convergence.svg exists"), "{output:?}");
    assert!(place.0.join("run/report.html").exists());
    // The files of a run are not replaced by the tables of another command.
    let before = place.read("run/responses.csv");
    assert!(place.run(&["analyze", TRUSS, "--out", "run"], 1).contains("has a run in it"));
    assert_eq!(place.read("run/responses.csv"), before);
}

#[test]
fn a_model_file_without_a_name_does_not_write_into_the_current_folder() {
    let place = truss("dots");
    std::fs::copy(place.0.join(TRUSS), place.0.join("...toml")).unwrap();
    let shown = place.run(&["optimize", "...toml", "--quiet"], 1);
    assert!(shown.contains("--out"), "{shown}");
    assert_eq!(files(&place.0).len(), 2);
}

#[test]
fn a_run_whose_state_was_deleted_does_not_keep_the_old_history() {
    let place = truss("deleted");
    place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 0);
    let history = place.read("out/history.jsonl");
    for name in ["state.json", "state-previous.json"] {
        drop(std::fs::remove_file(place.0.join("out").join(name)));
    }
    let shown = place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 1);
    assert!(shown.contains("has a run in it") && shown.contains("--force"), "{shown}");
    let shown = place.run(&["resume", "out"], 1);
    assert!(shown.contains("state.json is missing") && shown.contains("history.jsonl"), "{shown}");
    // A new run replaces the files of the old one.
    let other = place.read(TRUSS).replace("preset = \"gcmma\"", "preset = \"mma\"");
    std::fs::write(place.0.join("other.toml"), other).unwrap();
    place.run(&["optimize", "other.toml", "--quiet", "--force", "--out", "out"], 0);
    let new = place.read("out/history.jsonl");
    assert!(
        new != history && new.matches("\"event\":\"begin\"").count() == 1 && new.matches("\"cycle\":0").count() == 1
    );
}

/// Results whose run.json or study.json is lost are somebody's work: without --force nothing replaces them.
#[test]
fn results_without_the_file_of_their_folder_are_not_replaced() {
    let place = truss("lost");
    let study = "version = 1\nmodel = 'two-bar-truss.toml'\nkind = 'sample'\ncount = 3\n[vary.area]\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    std::fs::write(place.0.join("other.toml"), study.replace("count = 3", "count = 2")).unwrap();
    place.run(&["optimize", TRUSS, "-q", "--out", "out/run"], 0);
    place.run(&["study", "s", "-q", "--out", "out/study"], 0);
    std::fs::remove_file(place.0.join("out/run/run.json")).unwrap();
    std::fs::remove_file(place.0.join("out/study/study.json")).unwrap();
    let before = files(&place.0.join("out"));
    for (command, name) in [
        (vec!["optimize", TRUSS, "--out", "out/run"], "run.json"),
        (vec!["optimize", TRUSS, "--out", "out/study"], "study.json"),
        (vec!["study", "other", "--out", "out/study"], "study.json"),
        (vec!["study", "other", "--out", "out/run"], "run.json"),
        (vec!["analyze", TRUSS, "--out", "out/run"], "run.json"),
        (vec!["analyze", TRUSS, "--out", "out/study"], "study.json"),
        (vec!["resume", "out/run"], "run.json"),
        (vec!["report", "out/run"], "run.json"),
    ] {
        let shown = place.run(&command, 1);
        assert!(shown.contains(name) && shown.contains("restore"), "{command:?}: {shown}");
        assert_eq!(files(&place.0.join("out")), before, "{command:?}");
    }
    let listed = place.run(&["runs"], 0);
    assert_eq!(listed.matches("Damaged").count(), 2, "{listed}");
    place.run(&["optimize", TRUSS, "-q", "--out", "out/run", "--force"], 0);
    place.run(&["study", "other", "-q", "--out", "out/study", "--force"], 0);
    assert!(!place.run(&["runs"], 0).contains("Damaged"));
    // Tables of other commands do not go into the folder of a study either.
    assert!(place.run(&["analyze", TRUSS, "--out", "out/study"], 1).contains("has a study in it"));
}

/// A run that is replaced is there until the new one has begun.
#[test]
fn a_run_is_kept_if_the_new_one_cannot_begin() {
    let place = truss("kept");
    place.run(&["optimize", TRUSS, "-q", "--out", "run"], 0);
    let bad = place
        .read(TRUSS)
        .replace("[objective]", "[[output]]\nname = \"root\"\nvalue = \"sqrt(area - 100)\"\n[objective]");
    assert_ne!(bad, place.read(TRUSS));
    std::fs::write(place.0.join("bad.toml"), bad).unwrap();
    let before = files(&place.0.join("run"));
    let shown = place.run(&["optimize", "bad.toml", "--out", "run", "--force"], 1);
    assert!(shown.contains("the earlier run in run is kept"), "{shown}");
    assert_eq!(files(&place.0.join("run")), before);
    // Nor is anything removed if a folder has the name of a file of the run.
    std::fs::create_dir(place.0.join("run/answers.jsonl")).unwrap();
    for command in [vec!["optimize", TRUSS, "--out", "run", "--force"], vec!["resume", "run"]] {
        let shown = place.run(&command, 1);
        assert!(shown.contains("answers.jsonl is a folder"), "{shown}");
        assert_eq!(files(&place.0.join("run")), before);
    }
    let study = "version = 1\nmodel = 'two-bar-truss.toml'\nkind = 'sample'\ncount = 3\n[vary.area]\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    place.run(&["study", "s", "-q", "--out", "study"], 0);
    std::fs::create_dir(place.0.join("study/front.csv")).unwrap();
    let before = files(&place.0.join("study"));
    assert!(place.run(&["study", "s", "--out", "study", "--force"], 1).contains("front.csv is a folder"));
    assert_eq!(files(&place.0.join("study")), before);
}

/// The list has the files that were written, so that a file of the user which has the name of another one is never removed.
#[test]
fn the_list_has_only_files_that_were_written() {
    let place = truss("listed");
    let study = "version = 1\nmodel = 'two-bar-truss.toml'\nkind = 'sample'\ncount = 3\n[vary.area]\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    place.run(&["optimize", TRUSS, "-q", "--out", "run"], 0);
    place.run(&["study", "s", "-q", "--out", "study"], 0);
    for (folder, own) in [("run", "answers.jsonl"), ("study", "front.csv")] {
        let list: serde_json::Value = serde_json::from_str(&place.read(&format!("{folder}/files.json"))).unwrap();
        for name in list["files"].as_array().unwrap() {
            assert!(place.0.join(folder).join(name.as_str().unwrap()).exists(), "{folder}: {name}");
        }
        std::fs::write(place.0.join(folder).join(own), VICTIM).unwrap();
        let command: &[&str] = if folder == "run" { &["optimize", TRUSS] } else { &["study", "s"] };
        let shown = place.run(&[command, &["--out", folder, "--force"]].concat(), 1);
        assert!(shown.contains(&format!("{own} exists")), "{shown}");
        assert_eq!(place.read(&format!("{folder}/{own}")), VICTIM);
    }
}

#[test]
fn a_state_that_does_not_fit_is_named_and_rejected() {
    let place = truss("state");
    let unlike = place.read(TRUSS).replace("at_most = 1.0", "at_most = 0.9");
    assert_ne!(unlike, place.read(TRUSS));
    std::fs::write(place.0.join("unlike.toml"), unlike).unwrap();
    place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 0);
    place.run(&["optimize", "unlike.toml", "--quiet", "--out", "unlike"], 0);
    let (good, history) = (place.read("out/state.json"), place.read("out/history.jsonl"));
    let put = |name: &str, content: &str| std::fs::write(place.0.join("out").join(name), content).unwrap();
    let both = || {
        let resumed = place.run(&["resume", "out", "--quiet"], 1);
        assert_eq!(resumed, place.run(&["report", "out", "--slice", "0"], 1));
        resumed
    };
    // The state of another model of the same shape.
    put("state.json", &place.read("unlike/state.json"));
    let shown = both();
    assert!(shown.contains("state.json") && shown.contains("another model"), "{shown}");
    assert!(shown.contains("`linkwright resume out --previous`"), "the older state is offered: {shown}");
    // A digit changed.
    put("state.json", &good.replacen("\"objective\":1.5", "\"objective\":1.4", 1));
    let shown = both();
    assert!(shown.contains("checksum") && shown.contains("--previous"), "{shown}");
    place.run(&["resume", "out", "--quiet", "--previous"], 0);
    assert_eq!((place.read("out/state.json"), place.read("out/history.jsonl")), (good.clone(), history.clone()));
    // The history of another run, and one that is cut.
    for (changed, word) in [
        (place.read("unlike/history.jsonl"), "history.jsonl"),
        (history[..history.len() / 2].to_owned(), "history.jsonl"),
        (String::new(), "history.jsonl"),
        (history.replacen("\"cycle\":1,", "\"cycle\":2,", 1), "history.jsonl"),
    ] {
        put("history.jsonl", &changed);
        let shown = both();
        assert!(shown.contains(word) && shown.contains("out"), "{shown}");
        assert_eq!(place.read("out/history.jsonl"), changed, "a rejected history stays as it is");
    }
    put("history.jsonl", &history);
    // Wrong shapes, with a checksum that fits.
    let value: serde_json::Value = serde_json::from_str(&good).unwrap();
    let mut rejected = 0;
    for path in leaves(&value) {
        for change in [Change::Shorten, Change::Lengthen, Change::Huge, Change::Null] {
            let mut changed = value.clone();
            if !change.apply(changed.pointer_mut(&path).unwrap()) {
                continue;
            }
            put("state.json", &sealed(&reordered(&good, &changed)));
            for command in [["resume", "out", "--quiet"].as_slice(), &["report", "out", "--slice", "0", "--page-only"]]
            {
                let output = linkwright(command, &place.0);
                let code = output.status.code();
                assert!(matches!(code, Some(0 | 1 | 3)), "{path} {change:?}: {code:?} {}", text(&output.stderr));
                rejected += usize::from(code == Some(1));
            }
            put("history.jsonl", &history);
        }
    }
    assert!(rejected > 60, "{rejected}");
}

#[derive(Clone, Copy, Debug)]
enum Change {
    Shorten,
    Lengthen,
    Huge,
    Null,
}

impl Change {
    /// Changes a value; `false` if the change does not suit it.
    fn apply(self, value: &mut serde_json::Value) -> bool {
        match (self, value) {
            (Self::Shorten, serde_json::Value::Array(items)) => items.pop().is_some(),
            (Self::Lengthen, serde_json::Value::Array(items)) => {
                let more = items.last().cloned().unwrap_or(1.into());
                items.push(more);
                true
            }
            (Self::Huge, value @ serde_json::Value::Number(_)) => {
                *value = if value.is_u64() { (1_u64 << 62).into() } else { 1e300.into() };
                true
            }
            (Self::Null, value @ serde_json::Value::Number(_)) => {
                *value = serde_json::Value::Null;
                true
            }
            _ => false,
        }
    }
}

/// JSON pointers of the arrays and of the first numbers of each array and object of the state.
fn leaves(value: &serde_json::Value) -> Vec<String> {
    fn walk(value: &serde_json::Value, path: &str, found: &mut Vec<String>) {
        match value {
            serde_json::Value::Array(items) => {
                found.push(path.to_owned());
                items.iter().enumerate().take(2).for_each(|(k, item)| walk(item, &format!("{path}/{k}"), found));
            }
            serde_json::Value::Object(items) => {
                items.iter().for_each(|(key, item)| walk(item, &format!("{path}/{key}"), found));
            }
            serde_json::Value::Number(_) => found.push(path.to_owned()),
            _ => {}
        }
    }
    let mut found = vec![];
    walk(value, "", &mut found);
    found
}

/// The changed state with the head of the original file: version and checksum come first.
fn reordered(original: &str, changed: &serde_json::Value) -> String {
    let mut body = changed.clone();
    body.as_object_mut().unwrap().remove("checksum");
    let digits = original.find("fnv1a64:").unwrap();
    format!("{{\"checksum\":\"{}\",{}", &original[digits..digits + 24], &body.to_string()[1..])
}

#[test]
fn only_regular_files_of_bounded_size_are_read() {
    let place = truss("special");
    place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 0);
    let fifo = |name: &str| {
        let made = Command::new("mkfifo").arg(place.0.join(name)).status().unwrap();
        assert!(made.success());
    };
    fifo("fifo.toml");
    let shown = within(10, &["optimize", "fifo.toml"], &place.0).expect("a model in a FIFO does not wait");
    assert!(text(&shown.stderr).contains("regular file"), "{shown:?}");
    let shown = within(10, &["optimize", "/dev/zero"], &place.0).expect("an endless model ends");
    for peers in ["fifo.toml", "/dev/zero"] {
        let compare = ["compare", "--suite", "time", "--methods", "slp", "--peers", peers];
        let shown = within(10, &compare, &place.0).expect("runs of other programs are a regular file");
        assert!(text(&shown.stderr).contains("cannot read"), "{peers}: {}", text(&shown.stderr));
    }
    assert!(text(&shown.stderr).contains("regular file"), "{shown:?}");
    let names = ["summary.json", "run.json", "state.json", "history.jsonl", "model.toml", "run.lock", "files.json"];
    for name in names {
        for special in ["fifo", "zero", "sparse"] {
            let path = place.0.join("out").join(name);
            let saved = std::fs::read(&path).unwrap_or_default();
            drop(std::fs::remove_file(&path));
            match special {
                "fifo" => fifo(&format!("out/{name}")),
                "zero" => symlink("/dev/zero", &path).unwrap(),
                _ => std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap(),
            }
            for command in [["runs", "."].as_slice(), &["report", "out", "--slice", "0"], &["resume", "out", "--quiet"]]
            {
                let begun = Instant::now();
                let output = within(20, command, &place.0);
                let output = output.unwrap_or_else(|| panic!("{command:?} waits for {name} ({special})"));
                assert_ne!(output.status.code(), Some(101), "{command:?} {name} {special}: {}", text(&output.stderr));
                assert!(begun.elapsed() < Duration::from_secs(15));
            }
            std::fs::remove_file(&path).unwrap();
            std::fs::write(&path, saved).unwrap();
        }
    }
    place.run(&["resume", "out", "--quiet"], 0);
}

#[test]
fn control_characters_of_a_model_are_shown_and_not_sent() {
    let place = truss("escapes");
    // Clears the screen, sets the title of the window, in 7 and in 8 bits, and reverses the direction of writing.
    let bad = "\\u001b[2J\\u001b]0;owned\\u0007\\u009b31m\\u202e\\u007f";
    let title = place.read(TRUSS).lines().find(|line| line.starts_with("title")).unwrap().to_owned();
    let model = place.read(TRUSS).replace(&title, &format!("title = \"{bad}\""));
    let model = model.replacen("unit = \"", &format!("unit = \"{bad}"), 1);
    std::fs::write(place.0.join("bad.toml"), model).unwrap();
    let sent =
        |shown: &str| shown.chars().find(|c| (c.is_control() && *c != '\n') || ('\u{202a}'..='\u{202e}').contains(c));
    let plain = |command: &[&str]| {
        let output = linkwright(command, &place.0);
        let shown = text(&output.stdout) + &text(&output.stderr);
        assert_eq!(sent(&shown), None, "{command:?}: {shown:?}");
        shown
    };
    plain(&["optimize", "bad.toml", "--out", "out"]);
    for entry in std::fs::read_dir(place.0.join("out")).unwrap() {
        let path = entry.unwrap().path();
        if let Ok(written) = std::fs::read_to_string(&path) {
            assert_eq!(sent(&written), None, "{}", path.display());
        }
    }
    plain(&["optimize", "bad.toml", "--json", "--out", "json"]).lines().for_each(|line| {
        serde_json::from_str::<serde_json::Value>(line).unwrap_or_else(|e| panic!("{e}: {line}"));
    });
    for command in
        [["check", "bad.toml"].as_slice(), &["analyze", "bad.toml"], &["runs", "out", "json"], &["runs", "."]]
    {
        assert!(plain(command).contains("owned") || command[0] == "check");
    }
    // In a folder of somebody else: names of files, records and mistakes.
    std::fs::rename(place.0.join("json"), place.0.join("\u{1b}[31mjson")).unwrap();
    plain(&["runs", "."]);
    plain(&["runs", "--json", "."]);
    std::fs::write(place.0.join("out/summary.json"), "{ \"\u{9b}31m\": \"\u{1b}[2J").unwrap();
    plain(&["runs", "."]);
    std::fs::write(place.0.join("wrong.toml"), "version = 2\n\"\\u001b[2Jowned\" = 1\n# \u{9b}31m\n").unwrap();
    plain(&["optimize", "wrong.toml"]);
    plain(&["optimize", "\u{1b}[2Jmissing.toml"]);
}

#[test]
fn a_closed_pipe_is_an_interruption() {
    let place = truss("pipe");
    let script = |script: &str| {
        let script = script.replace("linkwright", env!("CARGO_BIN_EXE_linkwright"));
        let output = Command::new("bash").args(["-c", &script]).current_dir(&place.0).output().unwrap();
        text(&output.stdout) + &text(&output.stderr)
    };
    let shown = script(&format!("linkwright optimize {TRUSS} --out out | true; echo code ${{PIPESTATUS[0]}}"));
    assert!(shown.contains("code 1") && shown.contains("standard output was closed"), "{shown}");
    assert!(shown.contains("linkwright resume out"), "{shown}");
    place.run(&["resume", "out", "--quiet"], 0);
    // Commands that only print end quietly.
    let shown = script("linkwright schema | head -1; echo code ${PIPESTATUS[0]}");
    assert!(shown.contains("code 0") && !shown.contains("error"), "{shown}");
    // Messages that cannot be written do not change the exit code.
    let shown = script("linkwright optimize nothing.toml 2>/dev/full; echo code $?");
    assert!(shown.contains("code 1"), "{shown}");
    let shown = script("linkwright runs . >/dev/full; echo code $?");
    assert!(shown.contains("code 1"), "{shown}");
}

#[test]
fn too_many_threads_are_reduced() {
    let place = truss("threads");
    let run = |threads: &str, out: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
        let output = command.args(["optimize", TRUSS, "--quiet", "--out", out]).env("RAYON_NUM_THREADS", threads);
        let output = output.current_dir(&place.0).output().unwrap();
        assert_eq!(output.status.code(), Some(0), "{threads}: {}", text(&output.stderr));
        place.read(&format!("{out}/state.json"))
    };
    assert_eq!(run("100000", "many"), run("1", "one"));
}

/// A limit on the size of files acts as a full disk: every file of the report fits, except for the animation.
#[cfg(target_os = "linux")]
#[test]
fn a_figure_that_does_not_fit_on_the_disk_leaves_the_page_and_no_half_file() {
    let place = TempFolder::new("full-figure");
    place.example("slider-crank");
    place.run(&["optimize", "slider-crank.toml", "--quiet", "--out", "out"], 0);
    place.run(&["report", "out", "--slice", "0"], 0);
    let whole = files(&place.0.join("out/figures"));
    let page = std::fs::metadata(place.0.join("out/report.html")).unwrap().len();
    let largest = whole.iter().map(|(_, bytes)| bytes.len() as u64).max().unwrap();
    assert!(largest > 2048, "{largest}");
    std::fs::remove_dir_all(place.0.join("out/figures")).unwrap();
    std::fs::remove_file(place.0.join("out/report.html")).unwrap();
    // The shell counts in blocks of 1024 bytes.
    let limit = (largest - 1) / 1024;
    let command =
        format!("trap '' XFSZ; ulimit -f {limit}; exec {} report out --slice 0", env!("CARGO_BIN_EXE_linkwright"));
    let output = Command::new("bash").args(["-c", &command]).current_dir(&place.0).output().unwrap();
    let shown = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{shown}");
    assert!(shown.contains("File too large"), "{shown}");
    for (path, bytes) in files(&place.0.join("out/figures")) {
        let same = |(other, expected): &(PathBuf, Vec<u8>)| {
            *other == path && (*expected == bytes || path.ends_with("files.json"))
        };
        assert!(whole.iter().any(same), "half of {}", path.display());
    }
    if page <= limit * 1024 {
        assert!(place.0.join("out/report.html").exists() && shown.contains("figures/"), "{shown}");
    }
}

#[test]
fn messages_do_not_have_three_hundred_digits() {
    let place = truss("digits");
    let model = place.read(TRUSS);
    for (number, option) in [("1e308", "accuracy"), ("1e300", "accuracy"), ("1e-300", "max_cycles")] {
        let changed = model.replace("preset = \"gcmma\"", &format!("preset = \"gcmma\"\n{option} = {number}"));
        std::fs::write(place.0.join("big.toml"), changed).unwrap();
        let shown = place.run(&["optimize", "big.toml"], 1);
        assert!(!shown.contains("00000000000000000000"), "{shown}");
    }
    for value in ["1e308", "-1e308"] {
        let shown = text(&linkwright(&["analyze", TRUSS, "--at", &format!("area={value}")], &place.0).stderr);
        assert!(shown.contains("bounds") && !shown.contains("00000000000000000000"), "{shown}");
    }
}

/// 1000 design variables, 10 outputs, 10⁴ time points: the derivatives are 10⁸ numbers.
#[test]
fn a_problem_beyond_the_memory_budget_is_rejected_before_any_work() {
    let place = TempFolder::new("budget");
    let variables: String =
        (0..1000).map(|k| format!("[design.a{k}]\nstart = 1.0\nlower = 0.1\nupper = 9.0\n")).collect();
    let outputs: String =
        (0..10).map(|k| format!("[[output]]\nname = \"o{k}\"\nvalue = \"time*a{k} + a{}\"\n", k + 10)).collect();
    let wide = |points: usize| {
        let sum: Vec<String> = (0..10).map(|k| format!("o{k}^2")).collect();
        let rest: Vec<String> = (0..1000).step_by(5).map(|k| format!("a{k}")).collect();
        format!(
            "version = 2\ntitle = \"wide\"\n{variables}[time]\nto = 1.0\npoints = {points}\n{outputs}[objective]\nminimize = \"{}\"\n\
             over = \"mean\"\n[[constraint]]\nname = \"sum\"\nvalue = \"{}\"\nat_least = 180.0\n",
            sum.join(" + "),
            rest.join(" + ")
        )
    };
    std::fs::write(place.0.join("wide.toml"), wide(10_000)).unwrap();
    std::fs::write(place.0.join("narrow.toml"), wide(10)).unwrap();
    for command in [["optimize", "wide.toml"].as_slice(), &["sensitivities", "wide.toml", "--out", "here"]] {
        let output = within(20, command, &place.0).unwrap_or_else(|| panic!("{command:?} works for a long time"));
        let shown = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{shown}");
        for word in ["GB of memory", "1000 design variables", "budget of 2 GB", "--memory"] {
            assert!(shown.contains(word), "{word}: {shown}");
        }
        assert!(!place.0.join("out").exists() && !place.0.join("here").exists());
    }
    // The same problem with few time points fits, unless the budget is small.
    assert!(place.run(&["optimize", "narrow.toml", "--memory", "100k"], 1).contains("budget of 100 kB"));
    place.run(&["sensitivities", "narrow.toml"], 0);
    assert!(place.run(&["sensitivities", "narrow.toml", "--memory", "much"], 2).contains("8G"));
}

/// A folder as earlier versions wrote it: the history is in the state, there is no checksum and no list of files.
#[test]
fn a_folder_of_an_earlier_version_is_read_and_what_is_not_verified_is_said() {
    let place = truss("earlier");
    place.run(&["optimize", TRUSS, "--quiet", "--out", "whole"], 0);
    place.run(&["optimize", TRUSS, "--quiet", "--out", "out"], 0);
    let history = place.read("out/history.jsonl");
    let file: serde_json::Value = serde_json::from_str(&place.read("out/state.json")).unwrap();
    let earlier = |cycles: usize| {
        let mut state = file["state"].clone();
        let lines = history.lines().filter(|line| line.starts_with("{\"event\":\"cycle\"")).take(cycles);
        state["history"] = lines.map(|line| serde_json::from_str::<serde_json::Value>(line).unwrap()).collect();
        state.to_string()
    };
    let all = history.matches("{\"event\":\"cycle\"").count();
    let put = |name: &str, content: &str| std::fs::write(place.0.join("out").join(name), content).unwrap();
    for name in ["files.json", "state-previous.json", "run.lock"] {
        std::fs::remove_file(place.0.join("out").join(name)).unwrap();
    }
    put("state.json", &earlier(all));
    for command in [["report", "out", "--slice", "0"].as_slice(), &["resume", "out", "--quiet"]] {
        let shown = place.run(command, 0);
        assert!(shown.contains("has no checksum") && shown.contains("were not"), "{shown}");
    }
    for name in ["state.json", "history.jsonl", "cycles.csv", "summary.json"] {
        assert_eq!(place.read(&format!("out/{name}")), place.read(&format!("whole/{name}")), "{name}");
    }
    // The state of another model of the same shape, and shapes that do not fit.
    let other = earlier(all).replacen("\"values\":[[", "\"values\":[[1", 1);
    let cut = earlier(all - 1);
    for (bad, word) in [
        (other, "another model"),
        (cut, "state"),
        (earlier(all).replacen("\"factors\":[", "\"factors\":[1.0,", 1), "factors"),
    ] {
        put("state.json", &bad);
        std::fs::remove_file(place.0.join("out/state-previous.json")).unwrap_or(());
        let shown = place.run(&["resume", "out", "--quiet"], 1);
        assert!(shown.contains(word), "{word}: {shown}");
    }
}

/// The note about a run is the user's: a new run in its folder leaves it, and no list claims it.
#[test]
fn a_note_survives_a_new_run_in_its_folder() {
    let place = TempFolder::new("note");
    place.example("two-bar-truss");
    let run = |more: &[&str]| place.run(&[&["optimize", TRUSS, "--quiet", "--out", "out/a"], more].concat(), 0);
    run(&[]);
    assert!(!place.read("out/a/files.json").contains("note.txt"));
    std::fs::write(place.0.join("out/a/note.txt"), "mine").unwrap();
    run(&["--force"]);
    assert_eq!(place.read("out/a/note.txt"), "mine");
    assert!(!place.read("out/a/files.json").contains("note.txt"));
    assert!(place.run(&["runs"], 0).contains("mine"));
    // A list of an earlier version has it; it stays nevertheless.
    let list = place.read("out/a/files.json").replace("\"model.toml\"", "\"note.txt\",\"model.toml\"");
    std::fs::write(place.0.join("out/a/files.json"), list).unwrap();
    run(&["--force"]);
    assert_eq!(place.read("out/a/note.txt"), "mine");
}
