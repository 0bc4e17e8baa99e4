//! The commands on model files, as a user types them.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright, messages, text};

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

/// A file has the name of a problem of the library: all commands read the file. A folder of that name does not count.
#[test]
fn a_file_wins_over_a_problem_of_the_library() {
    let place = TempFolder::new("own-absorber");
    let example = format!("{}/examples/models/impact-absorber.toml", env!("CARGO_MANIFEST_DIR"));
    let own = std::fs::read_to_string(example).unwrap().replacen("title = \"", "title = \"MINE ", 1);
    std::fs::write(place.0.join("impact-absorber.toml"), own).unwrap();
    for command in ["check", "analyze", "compare"] {
        let more: &[&str] = if command == "compare" { &["--methods", "mma"] } else { &[] };
        let shown = place.run(&[&[command, "impact-absorber"], more].concat(), 0);
        assert!(shown.contains("MINE"), "{command}: {shown}");
    }
    std::fs::remove_file(place.0.join("impact-absorber.toml")).unwrap();
    std::fs::create_dir(place.0.join("impact-absorber")).unwrap();
    assert!(!place.run(&["check", "impact-absorber"], 0).contains("MINE"));
}

/// A setting on the command line is written into the file as TOML has it.
#[test]
fn settings_may_have_any_character() {
    let place = TempFolder::new("any-setting");
    place.example("two-bar-truss");
    for title in ["a\u{1b}[31m", "a\u{a0}b\u{202e}c", "a\"b\\c", "a\tb\u{7f}"] {
        place.run(&["analyze", "two-bar-truss.toml", "--set", &format!("title={title}")], 0);
        let why = place.run(&["analyze", "two-bar-truss.toml", "--set", &format!("method.preset={title}")], 1);
        assert!(why.contains("there is no method"), "{title:?}: {why}");
    }
}

/// The least largest of two numbers: every command and the report.
#[test]
fn a_largest_number_is_optimized_and_reported() {
    let place = TempFolder::new("largest-number");
    let text = "version = 2\n[design.a]\nstart = 2.5\nlower = -5\nupper = 5\n[design.b]\nstart = 1\nlower = -5\nupper = 5\n\
        [[output]]\nname = 'f1'\nvalue = 'a^2 + b^2'\n[[output]]\nname = 'f2'\nvalue = '(a - 2)^2 + b^2'\n\
        [objective]\nminimize = ['f1', 'f2']\n[[constraint]]\nname = 'far'\nvalue = 'a'\nat_least = 0.2\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    for command in [&["check"][..], &["analyze"], &["sensitivities"], &["compare", "--methods", "mma", "--out", "c"]] {
        place.run(&[&command[..1], &["m.toml"], &command[1..]].concat(), 0);
    }
    place.run(&["optimize", "m.toml", "--out", "a", "--report"], 0);
    let summary: serde_json::Value = serde_json::from_str(&place.read("a/summary.json")).unwrap();
    assert!((summary["objective"]["value"].as_f64().unwrap() - 1.0).abs() < 1e-6, "{summary}");
    assert_eq!(summary["constraints"].as_array().unwrap().len(), 1);
}

/// A setting without a value is left out, so that another one can take its place.
#[test]
fn a_setting_without_a_value_is_left_out() {
    let place = TempFolder::new("no-setting");
    place.example("cam-follower");
    assert!(place.read("cam-follower.toml").contains("\nstep = 1e-4"));
    let run = |settings: &[&str], code: i32| {
        let settings: Vec<&str> = settings.iter().flat_map(|setting| ["--set", setting]).collect();
        place.run(&[&["analyze", "cam-follower.toml"], &settings[..]].concat(), code)
    };
    let both = run(&["analysis.tolerance=1e-6"], 1);
    assert!(
        both.contains("`step` and `tolerance` exclude each other")
            && both.contains("`--set KEY=` leaves a setting out"),
        "{both}"
    );
    run(&["analysis.step=", "analysis.tolerance=1e-6"], 0);
    let wrong = run(&["analysis.step=", "analysis.tolerance=no"], 1);
    assert!(wrong.contains("with no analysis.step, analysis.tolerance = no, from the command line"), "{wrong}");
    let absent = run(&["analysis.stepp="], 1);
    assert!(absent.contains("there is no `analysis.stepp` in the file that could be removed"), "{absent}");
}

#[cfg(feature = "app")]
#[test]
fn a_study_is_not_opened_as_a_model() {
    let place = TempFolder::new("open-study");
    place.example("two-bar-truss");
    let study =
        "version = 1\nmodel = \"two-bar-truss.toml\"\nkind = \"grid\"\n[vary.area]\nfrom = 1\nto = 2\npoints = 2\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    let why = place.run(&["open", "s.toml", "--no-browser"], 1);
    assert!(why.contains("s.toml is a study") && why.contains("linkwright study s.toml"), "{why}");
}

/// Commands that last say so on standard error, where standard output is not a terminal, and what to do after Ctrl-C.
#[cfg(unix)]
#[test]
fn long_commands_show_progress_and_end_at_ctrl_c() {
    use std::io::{BufRead, BufReader};
    use std::process::{Command, Stdio};
    let place = TempFolder::new("long");
    place.example("vehicle-suspension");
    for command in [&["compare", "vehicle-suspension", "--methods", "gcmma,mma"][..], &["check", "vehicle-suspension"]]
    {
        let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
            .args(command)
            .current_dir(&place.0)
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines().map(|line| line.unwrap());
        let first = lines.next().unwrap_or_default();
        assert!(first.ends_with(" elapsed"), "{command:?}: {first}");
        assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
        assert_eq!(child.wait().unwrap().code(), Some(130), "{command:?}");
        let rest: Vec<String> = lines.collect();
        assert!(rest.concat().contains("the same command begins it again"), "{command:?}: {rest:?}");
    }
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

/// Every command with `--json` prints lines of JSON and nothing else, and at least one.
#[test]
fn every_command_with_json_prints_json() {
    let place = TempFolder::new("all-json");
    place.example("impact-absorber");
    place.example("two-bar-truss");
    let study = "version = 1\nmodel = 'two-bar-truss.toml'\nkind = 'sample'\ncount = 2\n[vary.area]\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    for arguments in [
        "analyze impact-absorber",
        "sensitivities impact-absorber",
        "sensitivities two-bar-truss --out here",
        "check two-bar-truss",
        "optimize two-bar-truss -o a",
        "optimize two-bar-truss -o b --method mma",
        "resume a",
        "report a --slice 0 --page-only",
        "runs .",
        "runs a b",
        "study s --part 1/2 -o p",
        "study s --part 2/2 -o q",
        "study merge p q -o s",
        "compare two-bar-truss.toml --methods slp",
        "compare cantilever --methods slp",
        "compare --suite adversarial --methods slp",
        "reproduce svanberg-1987",
    ] {
        let mut all: Vec<&str> = arguments.split(' ').collect();
        all.push("--json");
        let output = linkwright(&all, &place.0);
        let shown = text(&output.stdout);
        assert!(!shown.trim().is_empty(), "{arguments} prints nothing: {}", text(&output.stderr));
        for line in shown.lines() {
            serde_json::from_str::<serde_json::Value>(line).unwrap_or_else(|e| panic!("{arguments}: {e}: {line}"));
        }
    }
}

/// The lines of JSON have the numbers of the text.
#[test]
fn sensitivities_as_json_are_those_of_the_text() {
    let place = TempFolder::new("sensitivities-json");
    place.example("impact-absorber");
    let shown = place.run(&["sensitivities", "impact-absorber", "--digits", "17"], 0);
    let line = text(&linkwright(&["sensitivities", "impact-absorber", "--json"], &place.0).stdout);
    let record: serde_json::Value = serde_json::from_str(&line).unwrap();
    assert_eq!((&record["event"], &record["version"]), (&"sensitivities".into(), &1.into()));
    let gradients: Vec<&serde_json::Value> =
        std::iter::once(&record["objective"]).chain(record["constraints"].as_array().unwrap()).collect();
    let variables: Vec<&str> =
        gradients[0]["derivatives"].as_array().unwrap().iter().map(|d| d["variable"].as_str().unwrap()).collect();
    assert_eq!(variables, ["k", "c"]);
    assert!(gradients.len() > 1 && gradients[1]["limit"].is_number() && gradients[1]["time"].is_number());
    for gradient in gradients {
        let name = gradient["name"].as_str().unwrap();
        for derivative in gradient["derivatives"].as_array().unwrap() {
            let value = derivative["value"].as_f64().unwrap();
            let is_shown = |word: &str| word.replace('−', "-").parse::<f64>().is_ok_and(|shown| shown == value);
            let mut lines = shown.lines().filter(|line| line.contains(name));
            assert!(lines.any(|line| line.split_whitespace().any(is_shown)), "{name}: {value} in {shown}");
        }
    }
}

#[test]
fn a_new_model_has_a_name() {
    let place = TempFolder::new("dots-new");
    for name in [".", "..", "", ".toml"] {
        assert!(place.run(&["new", "--", name], 1).contains("name"), "{name}");
    }
    assert!(place.run(&["new", "--", "-x"], 0).contains("linkwright optimize ./-x.toml"));
    assert_eq!(std::fs::read_dir(&place.0).unwrap().count(), 1);
    place.run(&["check", "./-x.toml"], 0);
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
    assert_eq!(messages(&linkwright(&["check", "lift.toml"], &place.0).stderr), expected);
}

/// min (x − 2)² + (y − 1)² + 0.1 x y. The start is outside the bounds that a run gets later.
const BOWL: &str = "version = 2\n[design.x]\nstart = 5\nlower = 0\nupper = 10\n[design.y]\nstart = 5\nlower = 0\nupper = 10\n\
    [[output]]\nname = \"f\"\nvalue = \"(x - 2)^2 + (y - 1)^2 + 0.1*x*y\"\n[objective]\nminimize = \"f\"\n";

/// Only bounds that exclude the last accepted design are rejected; the start counts until the first design is accepted.
#[test]
fn a_run_goes_on_with_bounds_that_exclude_its_start() {
    let place = TempFolder::new("bounds");
    std::fs::write(place.0.join("bowl.toml"), BOWL).unwrap();
    place.run(&["optimize", "bowl", "--quiet", "--method", "gcmma", "--max-cycles", "3"], 3);
    let tight = BOWL.replacen("upper = 10", "upper = 4.5", 1);
    let on = |arguments: &[&str], code: i32| {
        let all = [&["resume", "bowl", "--max-cycles", "60"], arguments].concat();
        place.run(&all, code)
    };
    let kept = place.read("out/bowl/model.toml");
    assert!(on(&["--set", "design.x.upper=0.5"], 1).contains("the bounds exclude the last accepted design"));
    assert_eq!(place.read("out/bowl/model.toml"), kept, "a refused edit is not kept");
    let shown = on(&["--set", "design.x.upper=4.5"], 0);
    assert!(shown.contains("Changed design.x.upper: 10 → 4.5") && shown.contains("Converged"), "{shown}");
    // The edited copy, and the edited file, do the same.
    std::fs::write(place.0.join("bowl.toml"), tight.replacen("4.5", "4.25", 1)).unwrap();
    on(&["bowl.toml"], 0);
    place.run(&["resume", "bowl", "--quiet"], 0);
    for command in ["report", "runs"] {
        place.run(&[command, if command == "runs" { "out" } else { "bowl" }, "--quiet"], 0);
    }
    // A new run begins at the start, which must be inside.
    std::fs::write(place.0.join("bowl.toml"), tight.replace("(x - 2)", "(x - 3)")).unwrap();
    assert!(on(&["bowl.toml"], 1).contains("the start 5 of `x` is outside its bounds, 0 to 4.5"));
    assert!(place.run(&["optimize", "bowl"], 1).contains("outside its bounds"));
}

/// The scale of a peak is that of the start, also when bounds exclude the start later: with them, the state fits as before.
#[test]
fn the_scale_of_a_peak_stays_that_of_its_start() {
    let place = TempFolder::new("peak-bounds");
    let model = "version = 2\n[design.k]\nstart = 3\nlower = 0.5\nupper = 6\n[time]\nto = 1\npoints = 11\n[[output]]\nname = \"f\"\n\
        value = \"k + sin(3*time)/k\"\n[objective]\nminimize = \"f\"\nover = \"peak\"\n";
    std::fs::write(place.0.join("wave.toml"), model).unwrap();
    place.run(&["optimize", "wave", "--quiet", "--method", "gcmma", "--max-cycles", "4"], 3);
    let objective = |arguments: &[&str]| {
        place.run(&[&["resume", "wave", "--max-cycles", "40"], arguments].concat(), 0);
        let summary: serde_json::Value = serde_json::from_str(&place.read("out/wave/summary.json")).unwrap();
        summary["objective"]["value"].as_f64().unwrap()
    };
    // k + 1/k is least at 1.
    assert!((objective(&["--set", "design.k.upper=2.5"]) - 2.0).abs() < 0.02);
}

#[test]
fn texts_of_the_user_stay_in_their_line() {
    let place = TempFolder::new("one-line");
    let model = "version = 2\ntitle = \"a\\nb\"\n[design.x]\nstart = 5\nlower = 1\nunit = \"m\\nm\"\n[[output]]\nname = \"f\"\nvalue = \"x^2\"\nunit = \"k\\ng\"\n\
        [[output]]\nname = \"h\"\nvalue = \"x\"\n[objective]\nname = \"o\\np\"\nminimize = \"h\"\nunit = \"q\\nr\"\n\
        [[constraint]]\nname = \"c\\nd\"\nvalue = \"h\"\nat_least = 2\n";
    std::fs::write(place.0.join("nl.toml"), model).unwrap();
    let shown: String =
        [&["analyze", "nl"][..], &["check", "nl"], &["sensitivities", "nl"], &["optimize", "nl"], &["runs"]]
            .map(|arguments| place.run(arguments, 0))
            .concat();
    for text in ["a\\u000ab", "k\\u000ag", "o\\u000ap", "q\\u000ar", "c\\u000ad", "m\\u000am"] {
        assert!(shown.contains(text), "{text} is not in\n{shown}");
    }
    let broken = ["b", "g", "p", "r", "d", "m"];
    let is_rest = |line: &&str| broken.iter().any(|rest| line.starts_with(&format!("{rest} ")) || line == rest);
    assert_eq!(shown.lines().find(is_rest), None, "{shown}");
}

/// The remaining messages of small commands: what they write is a name, their hint is a command, and lost output is an error.
#[test]
fn names_and_hints_are_usable() {
    let place = TempFolder::new("names");
    for name in ["", ".toml", "sub/"] {
        assert!(place.run(&["new", name], 1).contains("needs a name"), "{name}");
    }
    let shown = place.run(&["new", "a b\"c"], 0);
    assert!(shown.contains("Next: linkwright optimize 'a b\"c.toml'"), "{shown}");
    assert!(place.run(&["new", "lift"], 0).contains("Next: linkwright optimize lift.toml"));
    #[cfg(target_os = "linux")]
    for arguments in [&["help"][..], &["--help"], &["--version"], &["help", "study"]] {
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").unwrap();
        let output =
            std::process::Command::new(env!("CARGO_BIN_EXE_linkwright")).args(arguments).stdout(full).output().unwrap();
        let why = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{arguments:?}\n{why}");
        assert!(why.contains("cannot write to standard output"), "{arguments:?}\n{why}");
    }
}

/// The name of a file need not be UTF-8; its folder of results must then be given.
#[cfg(target_os = "linux")]
#[test]
fn a_name_that_is_no_text_is_a_name_of_a_file() {
    use std::os::unix::ffi::OsStrExt;
    let place = TempFolder::new("no-text");
    let name = std::ffi::OsStr::from_bytes(b"bad\xff.toml");
    std::fs::write(place.0.join(name), BOWL).unwrap();
    let run = |before: &[&str], after: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_linkwright"));
        let output = command.args(before).arg(name).args(after).current_dir(&place.0).output().unwrap();
        (output.status.code(), text(&output.stdout) + &text(&output.stderr))
    };
    assert_eq!(run(&["analyze"], &[]).0, Some(0));
    let (code, why) = run(&["optimize"], &[]);
    assert!(code == Some(1) && why.contains("give a folder with --out"), "{why}");
    assert_eq!(run(&["optimize"], &["--quiet", "--out", "out/bad"]).0, Some(0));
    #[cfg(feature = "app")]
    assert!(run(&["open"], &["--no-browser"]).1.contains("is not UTF-8; rename it"));
    std::fs::create_dir(place.0.join("folder.toml")).unwrap();
    assert!(place.run(&["analyze", "folder.toml"], 1).contains("it is a folder, not a file"));
}

/// Derivatives of a limit in continuous time and of a peak at all times are those at the time of the peak, not at the nearest time point.
#[test]
fn derivatives_of_a_peak_between_time_points_are_those_of_the_peak() {
    let place = TempFolder::new("between-points");
    place.example("impact-absorber");
    let coarse = place.read("impact-absorber.toml").replace("points = 101", "points = 13");
    let continuous = coarse.replace("at_most = 1.0\n", "at_most = 1.0\ncontinuous = true\n");
    std::fs::write(place.0.join("coarse.toml"), continuous).unwrap();
    let record = |command: &str, at: String| -> serde_json::Value {
        serde_json::from_str(&text(&linkwright(&[command, "coarse", "--at", &at, "--json"], &place.0).stdout)).unwrap()
    };
    let nearest = |k: f64| {
        let analysis = record("analyze", format!("k={k}"));
        let upper = analysis["constraints"].as_array().unwrap().iter().find(|c| c["relation"] == "≤").unwrap().clone();
        [&upper["value"], &upper["time"]].map(|x| x.as_f64().unwrap())
    };
    // For k = 1 and c = 0.3 the peak is at tan ωt = ω/0.15, between the points at 1 and 2 s, up to the error of interpolation.
    let omega = (1.0f64 - 0.15 * 0.15).sqrt();
    let exact = (omega / 0.15).atan() / omega;
    let record = record("sensitivities", "k=1".to_owned());
    let upper = record["constraints"].as_array().unwrap().iter().find(|c| c["relation"] == "≤").unwrap();
    let [value, time] = [&upper["value"], &upper["time"]].map(|x| x.as_f64().unwrap());
    assert!((time - exact).abs() < 0.01 && [value, time] == nearest(1.0), "{upper}");
    let derivative = upper["derivatives"][0]["value"].as_f64().unwrap();
    let expected = (nearest(1.0 - 1e-4)[0] - nearest(1.0 - 3e-4)[0]) / 2e-4;
    assert!((derivative - expected).abs() < 1e-3 * expected.abs(), "{derivative} for {expected}");
    let near = (nearest(1.0)[0] - nearest(1.0 - 2e-6)[0]) / 2e-6;
    assert!((derivative - near).abs() < 1e-5, "{derivative} for {near}");
}
