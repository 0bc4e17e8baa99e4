//! The database of runs: what is taken, what is found, and optimizations that start with earlier analyses.
#![cfg(feature = "database")]

use crate::shell::{TempFolder, linkwright, text};
use linkwright::model_file::{read, with_setting};
use serde_json::Value;
use std::process::Command;

const STUDY: &str = "version = 1\nmodel = \"two-bar-truss.toml\"\nkind = \"grid\"\n\
    [vary.area]\nfrom = 1\nto = 3\npoints = 5\n[vary.span]\nfrom = 0.2\nto = 1\npoints = 3\n";

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|e| panic!("{e}: {line}"))).collect()
}

#[test]
fn runs_and_studies_are_taken_once_and_found_by_expressions() {
    let place = TempFolder::new("database");
    place.example("two-bar-truss");
    std::fs::write(place.0.join("grid.toml"), STUDY).unwrap();
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "out/a"], 0);
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--max-cycles", "1", "--out", "out/b"], 3);
    place.run(&["study", "grid.toml", "--quiet"], 0);
    let shown = place.run(&["runs", "--db", "runs.db"], 0);
    assert!(shown.contains("3 new or changed runs and studies, 15 rows and 2 analyses were added"), "{shown}");
    assert!(shown.contains("study: grid"), "{shown}");
    assert!(!place.run(&["runs", "--db", "runs.db"], 0).contains("were added"));
    // The database keeps what was deleted.
    std::fs::remove_dir_all(place.0.join("out")).unwrap();
    let found = |expression: &str| {
        let all = lines(&place.run(&["runs", "--db", "runs.db", "--json", "--where", expression], 0));
        all.iter().map(|run| run["folder"].as_str().unwrap().rsplit('/').next().unwrap().to_owned()).collect::<String>()
    };
    assert_eq!(found("objective < 1.51"), "a");
    assert_eq!(found("kind = 'run' and status <> 'Converged'"), "b");
    assert_eq!(found("area > 0 and cycles >= 0"), "ab");
    assert_eq!(found("done = runs and failed = 0"), "grid");
    let shown = place.run(&["runs", "--db", "runs.db", "--where", "objektive < 1"], 1);
    assert!(shown.contains("no such column: objektive") && shown.contains("design variables: area, span"), "{shown}");
}

#[test]
fn folders_are_found_by_expressions_without_a_database() {
    let place = TempFolder::new("database-none");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "out/a"], 0);
    assert!(place.run(&["runs", "--where", "objective < 1.51"], 0).contains("out/a"));
    assert!(place.run(&["runs", "--where", "objective > 1.51"], 0).contains("No runs below out"));
    assert!(place.run(&["runs", "out/a", "out/a", "--where", "1"], 1).contains("list runs"));
}

/// The files of a run that have no dates in them.
fn results(place: &TempFolder, out: &str) -> Vec<String> {
    ["state.json", "cycles.csv", "summary.json", "responses.csv", "constraints.csv"]
        .map(|file| place.read(&format!("{out}/{file}")))
        .to_vec()
}

/// The numbers in the note at the end of a run: analyses and sensitivity analyses that were taken, records that were added.
fn counts(shown: &str) -> [usize; 3] {
    let line = shown.lines().find(|line| line.contains("were taken from")).unwrap_or_else(|| panic!("{shown}"));
    let line = line.split("; ").next().unwrap();
    let words: Vec<&str> = line.split_whitespace().collect();
    let before = |next: &str| words[words.iter().position(|word| *word == next).unwrap() - 1].parse().unwrap();
    let added = words[words.len() - 3].parse().unwrap();
    [before("analyses"), before("sensitivity"), added]
}

#[test]
fn a_warm_start_takes_all_that_is_known_and_changes_no_bit() {
    let place = TempFolder::new("database-warm");
    for (name, method) in [("impact-absorber", "slp"), ("two-bar-truss", "gcmma"), ("rigid-four-bar", "slp")] {
        place.example(name);
        let file = format!("{name}.toml");
        let run = |out: &str, more: &[&str]| {
            let arguments = ["optimize", &file, "--method", method, "--max-cycles", "4", "--out", out];
            let output = linkwright(&[&arguments, more].concat(), &place.0);
            assert!(matches!(output.status.code(), Some(0 | 3)), "{}", text(&output.stderr));
            text(&output.stdout) + &text(&output.stderr)
        };
        let [cold, first, second] = ["cold", "first", "second"].map(|kind| format!("{name}-{kind}"));
        run(&cold, &[]);
        let shown = counts(&run(&first, &["--warm", "runs.db"]));
        assert_eq!(shown[0], 0);
        let shown = run(&second, &["--warm", "runs.db"]);
        let summary: Value = serde_json::from_str(&place.read(&format!("{second}/summary.json"))).unwrap();
        let expected = [&summary["analyses"], &summary["sensitivity_analyses"]].map(|n| n.as_u64().unwrap() as usize);
        let [analyses, derivatives, added] = counts(&shown);
        assert!(analyses >= expected[0] && derivatives >= expected[1], "{shown} {expected:?}");
        assert_eq!(added, 0, "{shown}");
        assert!(results(&place, &cold) == results(&place, &first), "{name}");
        assert!(results(&place, &cold) == results(&place, &second), "{name}");
    }
}

#[test]
fn another_start_or_method_takes_known_designs_and_another_model_none() {
    let place = TempFolder::new("database-model");
    place.example("impact-absorber");
    place.run(&["optimize", "impact-absorber", "--quiet", "--out", "a"], 0);
    // From the folder: the last design of a run.
    place.run(&["runs", ".", "--db", "runs.db"], 0);
    let summary: Value = serde_json::from_str(&place.read("a/summary.json")).unwrap();
    let start: Vec<String> = summary["design"]
        .as_array()
        .unwrap()
        .iter()
        .map(|b| format!("{}={:?}", b["name"].as_str().unwrap(), b["value"].as_f64().unwrap()))
        .filter(|b| !b.starts_with("peak"))
        .collect();
    let run = |out: &str, more: &[&str]| {
        let arguments = ["optimize", "impact-absorber", "--start", &start.join(","), "--warm", "runs.db", "--out", out];
        place.run(&[&arguments, more].concat(), 0)
    };
    let shown = run("b", &["--method", "gcmma"]);
    assert!(counts(&shown)[0] >= 1, "{shown}");
    let shown = run("c", &["--set", "time.points=51"]);
    assert_eq!(counts(&shown)[0], 0, "{shown}");
}

/// What a stored analysis is bound to: it may depend neither on start values and bounds nor on the method.
#[test]
fn responses_depend_on_nothing_that_their_fingerprint_leaves_out() {
    let place = TempFolder::new("database-fingerprint");
    for name in ["impact-absorber", "rigid-four-bar", "two-bar-truss", "vehicle-suspension"] {
        place.example(name);
        let text = place.read(&format!("{name}.toml"));
        let model = read(name, &text).unwrap();
        let design = model.problem().unwrap().start();
        let mut other = with_setting(name, &text, "method.preset", "mma").unwrap();
        for variable in model.variables() {
            let middle = 0.99 * variable.start + 0.01 * variable.upper.min(2.0 * variable.start);
            other =
                with_setting(name, &other, &format!("design.{}.start", variable.name), &format!("{middle:?}")).unwrap();
        }
        let other = read(name, &other).unwrap();
        assert_eq!(model.analysis_fingerprint(), other.analysis_fingerprint(), "{name}");
        assert_ne!(model.fingerprint(), other.fingerprint(), "{name}");
        let [one, two] = [model, other].map(|model| model.problem().unwrap().analyze(&design).unwrap().values);
        assert_eq!(one, two, "{name}");
    }
}

#[test]
fn a_damaged_analysis_is_computed_again() {
    let place = TempFolder::new("database-damaged");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss", "--quiet", "--warm", "runs.db", "--out", "a"], 0);
    let change = rusqlite::Connection::open(place.0.join("runs.db")).unwrap();
    change.execute("UPDATE analyses SET numbers = zeroblob(length(numbers)) WHERE request = ''", []).unwrap();
    drop(change);
    let shown = place.run(&["optimize", "two-bar-truss", "--warm", "runs.db", "--out", "b"], 0);
    assert!(shown.contains("damaged records were computed again"), "{shown}");
    assert!(results(&place, "a") == results(&place, "b"));
    let shown = place.run(&["optimize", "two-bar-truss", "--warm", "runs.db", "--out", "c"], 0);
    assert!(!shown.contains("damaged"), "{shown}");
}

#[test]
fn files_that_cannot_be_used_are_rejected_before_a_run_begins() {
    let place = TempFolder::new("database-other");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss", "--quiet", "--out", "out/a"], 0);
    std::fs::write(place.0.join("notes.txt"), "no database\n".repeat(200)).unwrap();
    for arguments in [["runs", "out", "--db", "notes.txt"], ["optimize", "two-bar-truss", "--warm", "notes.txt"]] {
        let shown = place.run(&arguments, 1);
        assert!(shown.contains("notes.txt is not a database of linkwright"), "{shown}");
    }
    assert!(!place.0.join("out/two-bar-truss").exists());
    assert_eq!(place.read("notes.txt"), "no database\n".repeat(200));
    // A database of which a part is lost.
    place.run(&["runs", "--db", "runs.db"], 0);
    let mut bytes = std::fs::read(place.0.join("runs.db")).unwrap();
    let length = bytes.len();
    bytes[length / 4..].fill(0xff);
    std::fs::write(place.0.join("runs.db"), bytes).unwrap();
    let shown = place.run(&["runs", "--db", "runs.db"], 1);
    assert!(shown.contains("runs.db") && shown.contains("make a new") && !shown.contains("panicked"), "{shown}");
    assert!(place.run(&["runs", "--db", "new.db"], 0).contains("1 new or changed"));
}

#[test]
fn processes_that_write_at_the_same_time_lose_nothing() {
    let place = TempFolder::new("database-writers");
    place.example("two-bar-truss");
    place.example("impact-absorber");
    let start = |k: usize| {
        let (name, out) = (["two-bar-truss", "impact-absorber"][k % 2], format!("out/{k}"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
        command.args(["optimize", name, "--quiet", "--warm", "runs.db", "--out", &out]).current_dir(&place.0);
        command.stderr(std::process::Stdio::piped()).spawn().unwrap()
    };
    let all: Vec<_> = (0..6).map(start).collect();
    for child in all {
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success() && output.stderr.is_empty(), "{}", text(&output.stderr));
    }
    let take = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
        command.args(["runs", "out", "--quiet", "--db", "runs.db"]).current_dir(&place.0).spawn().unwrap()
    };
    let all: Vec<_> = (0..3).map(|_| take()).collect();
    all.into_iter().for_each(|mut child| assert!(child.wait().unwrap().success()));
    assert_eq!(lines(&place.run(&["runs", "--db", "runs.db", "--json"], 0)).len(), 6);
    for name in ["two-bar-truss", "impact-absorber"] {
        let shown = place.run(&["optimize", name, "--warm", "runs.db", "--out", &format!("again-{name}")], 0);
        assert_eq!(counts(&shown)[2], 0, "{shown}");
    }
}

/// A limit on the size of files acts as a full disk: the run ends as it does without a database.
#[cfg(unix)]
#[test]
fn a_run_does_not_need_its_database() {
    let place = TempFolder::new("database-full");
    place.example("impact-absorber");
    place.run(&["optimize", "impact-absorber", "--quiet", "--out", "a"], 0);
    drop(place.run(&["runs", "a", "--db", "runs.db"], 0));
    let program = env!("CARGO_BIN_EXE_linkwright");
    let line = format!("trap '' XFSZ; ulimit -f 256; '{program}' optimize impact-absorber --warm runs.db --out b");
    // The database fills the size that a file may have.
    let fill = rusqlite::Connection::open(place.0.join("runs.db")).unwrap();
    fill.execute("INSERT INTO answers VALUES ('a', 'b', ?)", [" ".repeat(256 * 1024)]).unwrap();
    drop(fill);
    let output = Command::new("bash").args(["-c", &line]).current_dir(&place.0).output().unwrap();
    let shown = text(&output.stdout) + &text(&output.stderr);
    assert!(output.status.success() && shown.contains("The run is complete"), "{shown}");
    assert!(shown.contains("runs.db"), "{shown}");
    assert!(results(&place, "a") == results(&place, "b"));
}

#[cfg(unix)]
#[test]
fn a_program_is_not_asked_for_designs_that_are_known() {
    let place = TempFolder::new("database-program");
    crate::program::truss_with_a_script(&place);
    let asked = || place.read("requests").lines().count();
    let run =
        |more: &[&str]| place.run(&[&["optimize", "truss", "--allow-programs", "--warm", "runs.db"], more].concat(), 0);
    run(&["--out", "a"]);
    let first = asked();
    let shown = run(&["--out", "b"]);
    assert_eq!(asked(), first, "{shown}");
    assert!(shown.contains(&format!("{first} answers of the program are known")), "{shown}");
    assert_eq!(place.read("a/cycles.csv"), place.read("b/cycles.csv"));
    // From a folder, too.
    std::fs::remove_file(place.0.join("runs.db")).unwrap();
    assert!(place.run(&["runs", "a", "--db", "runs.db"], 0).contains(&format!("{first} analyses were added")));
    run(&["--out", "c"]);
    assert_eq!(asked(), first);
    // Another program of the same name has other answers.
    let script = place.read("truss.sh");
    std::fs::write(place.0.join("truss.sh"), script + "# changed\n").unwrap();
    run(&["--out", "d"]);
    assert_eq!(asked(), 2 * first);
}

/// The name of a folder need not be UTF-8: such a folder is listed, and does not hide the others.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_whose_name_is_no_text_is_taken() {
    use std::os::unix::ffi::OsStrExt;
    let place = TempFolder::new("database-no-text");
    place.example("two-bar-truss");
    for out in ["out/a", "out/b"] {
        place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", out], 0);
    }
    std::fs::rename(place.0.join("out/a"), place.0.join("out").join(std::ffi::OsStr::from_bytes(b"r\xff"))).unwrap();
    let shown = place.run(&["runs", "--db", "runs.db"], 0);
    assert!(shown.contains("2 new or changed runs and studies") && shown.contains("out/r\u{fffd}"), "{shown}");
    assert!(!place.run(&["runs", "--db", "runs.db"], 0).contains("were added"));
}
