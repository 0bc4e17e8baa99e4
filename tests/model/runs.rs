//! Lists of runs, comparisons of runs and of methods.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright, text};
use serde_json::Value;

fn json(text: &str) -> Value {
    serde_json::from_str(text.trim()).unwrap_or_else(|e| panic!("{e}: {text}"))
}

#[test]
fn runs_are_found_wherever_their_folders_are() {
    let place = TempFolder::new("runs");
    assert!(place.run(&["runs"], 1).contains("there is no folder out"));
    place.example("two-bar-truss");
    for out in ["out/a", "out/studies/b", "out/c"] {
        place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", out], 0);
    }
    // Moved, deleted, damaged in three ways.
    std::fs::rename(place.0.join("out/a"), place.0.join("out/moved")).unwrap();
    std::fs::remove_dir_all(place.0.join("out/c")).unwrap();
    for (name, file, content) in
        [("x", "run.json", "{ \"version\""), ("y", "run.json", "\u{0}\u{1}"), ("z", "summary.json", "[1, 2")]
    {
        std::fs::create_dir_all(place.0.join("out").join(name)).unwrap();
        std::fs::copy(place.0.join("out/moved/run.json"), place.0.join(format!("out/{name}/run.json"))).unwrap();
        std::fs::write(place.0.join(format!("out/{name}/{file}")), content).unwrap();
    }
    let shown = place.run(&["runs"], 0);
    assert!(shown.contains("out/moved") && shown.contains("out/studies/b") && !shown.contains("out/a"), "{shown}");
    assert!(shown.contains("Note: out/x: out/x/run.json is not readable"), "{shown}");
    let lines: Vec<Value> = place.run(&["runs", "--json"], 0).lines().map(json).collect();
    let status = |folder: &str| {
        lines.iter().find(|run| run["folder"] == format!("out/{folder}")).map(|run| run["status"].clone()).unwrap()
    };
    assert_eq!(
        ["moved", "studies/b", "x", "y", "z"].map(status),
        ["Converged", "Converged", "Damaged", "Damaged", "Damaged"]
    );
    // As a shell completes `out/*`; a folder in another one is listed once.
    let several = place.run(&["runs", "out/moved", "out/studies", "out/studies/b", "out/x", "--json"], 0);
    let folders: Vec<Value> = several.lines().map(|line| json(line)["folder"].clone()).collect();
    assert_eq!(folders.len(), 3, "{several}");
    for folder in ["out/moved", "out/studies/b", "out/x"] {
        assert!(folders.contains(&folder.into()), "{several}");
    }
    assert!(place.run(&["runs", "out/moved", "out/studies", "out/x"], 0).contains("Runs below 3 folders"));
    assert!(place.run(&["runs", "out/moved", "out/none", "out/x"], 1).contains("there is no folder out/none"));
    let run = lines.iter().find(|run| run["folder"] == "out/moved").unwrap();
    assert_eq!((&run["method"], &run["result"]["analyses"]), (&"gcmma".into(), &11.into()));
    assert!(run["result"]["objective"]["value"].as_f64().unwrap() > 1.5);
}

#[test]
fn results_go_where_the_environment_says() {
    let place = TempFolder::new("environment");
    place.example("two-bar-truss");
    let run = |arguments: &[&str]| {
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_linkwright"));
        text(&command.args(arguments).env("LINKWRIGHT_OUT", "studies").current_dir(&place.0).output().unwrap().stdout)
    };
    run(&["optimize", "two-bar-truss.toml"]);
    assert!(place.0.join("studies/two-bar-truss/summary.json").exists() && !place.0.join("out").exists());
    assert!(run(&["runs"]).contains("studies/two-bar-truss"));
    assert!(run(&["runs", "two-bar-truss", "two-bar-truss"]).contains("All settings are the same."));
}

#[test]
fn two_runs_are_compared() {
    let place = TempFolder::new("compared");
    place.example("two-bar-truss");
    let good = place.read("two-bar-truss.toml");
    std::fs::write(place.0.join("mma.toml"), good.replace("preset = \"gcmma\"", "preset = \"mma\"")).unwrap();
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "a"], 0);
    place.run(&["optimize", "mma.toml", "--quiet", "--out", "b"], 0);
    let shown = place.run(&["runs", "a", "b"], 0);
    let row = |start: &str| -> Vec<String> {
        let found = shown.lines().find(|line| line.trim_start().starts_with(start));
        found.unwrap_or_else(|| panic!("{start}\n{shown}")).split_whitespace().map(str::to_owned).collect()
    };
    assert_eq!(row("method.preset"), ["method.preset", "\"gcmma\"", "\"mma\""]);
    assert_eq!(row("analyses")[1], "11");
    let comparison = json(&place.run(&["runs", "a", "b", "--json"], 0));
    assert_eq!((&comparison["one_problem"], &comparison["version"]), (&true.into(), &1.into()));
    let objective = comparison["quantities"].as_array().unwrap().iter().find(|q| q["name"] == "objective").unwrap();
    let [a, b] = [0, 1].map(|k| objective["values"][k].as_f64().unwrap());
    assert!((a - b).abs() < 1e-3 && a != b, "{a} {b}");
    assert!(place.run(&["runs", "a", "nowhere"], 1).contains("there is no folder nowhere"));
}

#[test]
fn methods_are_compared_on_a_model_file() {
    let place = TempFolder::new("methods");
    place.example("two-bar-truss");
    let shown = place.run(&["compare", "two-bar-truss.toml", "--methods", "slp,mma,gcmma", "--out", "here"], 0);
    assert!(shown.contains("(the file's)") && shown.matches("converged").count() >= 3, "{shown}");
    let table = place.read("here/two-bar-truss.csv");
    let line = |name: &str| table.lines().find(|line| line.starts_with(name)).unwrap().split_once(',').unwrap().1;
    assert_eq!((line("(the file's)"), table.lines().count()), (line("gcmma"), 5));
    let shown = place.run(&["compare", "two-bar-truss.toml", "--methods", "gcmma", "--json", "--out", "here"], 0);
    let rows: Vec<Value> = shown.lines().map(json).collect();
    assert_eq!((rows.len(), &rows[1]["analyses"]), (2, &11.into()));
    assert!((rows[0]["objective"].as_f64().unwrap() - 1.50865).abs() < 1e-4);
    // A maximized objective has its own sign, and the largest one is the best; a peak is its value, not the variable that bounds it.
    let design = "version = 2\n[design.x]\nstart = 0.4\nlower = 0\nupper = 2\n";
    let peak = "[time]\nfrom = 0\nto = 1\npoints = 11\n[[output]]\nname = \"y\"\nvalue = \"(x - 1)^2 + time\"\n";
    let one_cycle = "[method]\npreset = \"slp\"\nmax_cycles = 1\n";
    for (objective, largest) in [
        ("[objective]\nmaximize = \"3 - (x - 1)^2\"\n".to_owned(), 3.0),
        (format!("{peak}[objective]\nminimize = \"y\"\nover = \"peak\"\nbound = {{ start = 50 }}\n{one_cycle}"), 1.36),
    ] {
        std::fs::write(place.0.join("stated.toml"), format!("{design}{objective}")).unwrap();
        let arguments = ["compare", "stated.toml", "--methods", "slp,bfgs", "--json", "--out", "there"];
        let output = linkwright(&arguments, &place.0);
        assert!(text(&output.stdout).lines().count() == 3, "{output:?}");
        for row in text(&output.stdout).lines().map(json) {
            let (value, above) = (row["objective"].as_f64().unwrap(), row["above_best"].as_f64().unwrap_or(0.0));
            assert!(value > 0.0 && value <= largest + 1e-9 && above >= -1e-12, "{row}");
        }
    }
}

/// The least value of Rosenbrock's function is zero: the ends near it are compared in units of a millionth of the decrease.
#[test]
fn ends_near_an_objective_of_zero_are_compared() {
    let place = TempFolder::new("zero");
    for unit in ["1", "1e-12", "1e12"] {
        let model = format!(
            "version = 2\n[design]\nx.start = -1.2\ny.start = 1\n[objective]\nminimize = \"{unit}*(100*(y - x^2)^2 + (1 - x)^2)\"\n"
        );
        std::fs::write(place.0.join("zero.toml"), model).unwrap();
        let shown = place.run(&["compare", "zero.toml", "--methods", "gcmma,sqp-filter,bfgs", "--json"], 0);
        for row in shown.lines().map(json) {
            let above = row["above_best"].as_f64().unwrap_or_else(|| panic!("{row}"));
            assert!((0.0..1e-6).contains(&above), "{row}");
        }
    }
}

/// `above_best` refers to the best feasible design in any cycle of any run, also one that its run has left; a run whose own stop test holds
/// away from an optimum is not called converged.
#[test]
fn a_comparison_states_what_the_runs_have_seen() {
    let place = TempFolder::new("best-seen");
    // One cycle: no run converges.
    place.example("two-bar-truss");
    let few = ["compare", "two-bar-truss.toml", "--methods", "slp,mma", "--set", "method.max_cycles=2"];
    let shown = place.run(&[&few[..], &["--out", "few"]].concat(), 0);
    assert!(shown.contains("The best feasible design of all cycles has the objective"), "{shown}");
    let table = place.read("few/two-bar-truss.csv");
    let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let head = lines.next().unwrap();
    let column = |name: &str| head.iter().position(|column| *column == name).unwrap();
    for row in lines {
        let [above, violation] = ["above_best", "violation_pct"].map(|name| row[column(name)].parse::<f64>().unwrap());
        assert!(row[column("end")] != "converged" && (above >= 0.0 || violation > 1e-3), "{row:?}");
    }
    // Large steps of the objective count as settled: the presets end far from the optimum.
    let wide = ["compare", "two-bar-truss.toml", "--methods", "slp,mma,gcmma", "--set", "method.accuracy=0.9"];
    let shown = place.run(&[&wide[..], &["--out", "wide"]].concat(), 0);
    let table = place.read("wide/two-bar-truss.csv");
    let mut early = 0;
    for row in table.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>()) {
        let [residual, above] = ["kkt_residual", "above_best"].map(|name| row[column(name)].parse::<f64>().unwrap());
        assert!(row[column("end")] != "converged" || residual <= 0.03 || above <= 1e-5, "{row:?}");
        early += usize::from(row[column("end")] == "not optimal");
    }
    assert!(early > 0 && shown.contains("The optimality conditions do not hold at the end of"), "{shown}");
}

#[test]
fn every_command_shows_examples_and_exit_codes_and_shells_complete_them() {
    let place = TempFolder::new("help");
    let listed = place.run(&["--help"], 0);
    let commands = listed.split("Commands:\n").nth(1).unwrap().split("\n\n").next().unwrap();
    let names: Vec<&str> = commands.lines().filter_map(|line| line.split_whitespace().next()).collect();
    assert!(names.len() >= 12, "{names:?}");
    for name in names.iter().filter(|name| **name != "help") {
        let help = place.run(&[name, "--help"], 0);
        assert!(help.contains(&format!("Examples:\n  linkwright {name}")) && help.contains("Exit codes: 0"), "{help}");
    }
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let script = place.run(&["completion", shell], 0);
        assert!(names.iter().all(|name| script.contains(name)) && script.contains("methods"), "{shell}");
    }
    assert_eq!(linkwright(&["completion", "cmd"], &place.0).status.code(), Some(2));
    // An installed shell checks the syntax of the script.
    if let Ok(bash) = std::process::Command::new("bash").arg("--version").output()
        && bash.status.success()
    {
        std::fs::write(place.0.join("script"), place.run(&["completion", "bash"], 0)).unwrap();
        let command = "source ./script; COMP_WORDS=(linkwright opt); COMP_CWORD=1; _linkwright linkwright opt linkwright; \
                       echo \"${COMPREPLY[@]}\"";
        let output = std::process::Command::new("bash").args(["-c", command]).current_dir(&place.0).output().unwrap();
        assert_eq!(text(&output.stdout).trim(), "optimize", "{}", text(&output.stderr));
    }
}

/// On a terminal each row replaces the line with the remaining time; a pipe gets plain lines.
#[cfg(target_os = "linux")]
#[test]
fn a_terminal_shows_the_time_that_is_left() {
    let place = TempFolder::new("terminal");
    place.example("slider-crank");
    let plain = place.run(&["optimize", "slider-crank.toml", "--out", "plain"], 0);
    assert!(!plain.contains('\u{1b}') && !plain.contains("elapsed"), "{plain}");
    let command = format!("{} optimize slider-crank.toml --out drawn", env!("CARGO_BIN_EXE_linkwright"));
    let drawn =
        std::process::Command::new("script").args(["-qec", &command, "/dev/null"]).current_dir(&place.0).output();
    // Some systems cannot emulate a terminal.
    let Ok(drawn) = drawn else { return };
    let drawn = text(&drawn.stdout).replace("\r\n", "\n");
    assert!(drawn.contains(" elapsed, about ") && drawn.contains(" left, at most "), "{drawn}");
    // The visible text: of each line the part after it was last cleared.
    let shown =
        |line: &str| line.rsplit("\u{1b}[K").next().unwrap().replace("\u{1b}[?7l", "").replace("\u{1b}[?7h", "");
    let screen: Vec<String> = drawn.lines().map(shown).collect();
    let expected: Vec<&str> = plain.lines().collect();
    let table = expected.iter().position(|line| line.is_empty()).unwrap();
    assert_eq!(screen[..table], expected[..table]);
}

#[test]
fn runs_in_the_folders_of_runs_are_listed() {
    let place = TempFolder::new("nested");
    place.example("two-bar-truss");
    for out in ["out/a", "out/a/again", "out/a/more/deep"] {
        place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", out], 0);
    }
    let lines: Vec<Value> = place.run(&["runs", "--json"], 0).lines().map(json).collect();
    let mut folders: Vec<&str> = lines.iter().map(|run| run["folder"].as_str().unwrap()).collect();
    folders.sort_unstable();
    assert_eq!(folders, ["out/a", "out/a/again", "out/a/more/deep"]);
}

/// Starts, bounds, method and title say where and how a problem is solved; units are compared with units, and studies with no run.
#[test]
fn runs_of_one_problem_from_two_starts_are_compared_as_such() {
    let place = TempFolder::new("two-starts");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss", "-q", "-o", "a"], 0);
    place.run(&["optimize", "two-bar-truss", "-q", "-o", "b", "--start", "area=3", "--method", "mma"], 0);
    place.run(&["optimize", "two-bar-truss", "-q", "-o", "c", "--set", "objective.unit=\"lb\""], 0);
    let shown = place.run(&["runs", "a", "b"], 0);
    assert!(!shown.contains("different problems") && shown.contains("design.area.start"), "{shown}");
    let compared: serde_json::Value = serde_json::from_str(&place.run(&["runs", "a", "b", "--json"], 0)).unwrap();
    assert_eq!(compared["one_problem"], true);
    let summary: serde_json::Value = serde_json::from_str(&place.read("a/summary.json")).unwrap();
    let of = |compared: &serde_json::Value, name: &str| -> Vec<serde_json::Value> {
        let all = compared["quantities"].as_array().unwrap();
        all.iter().filter(|quantity| quantity["name"] == name).cloned().collect()
    };
    assert_eq!(of(&compared, "objective")[0]["unit"], summary["objective"]["unit"]);
    let other: serde_json::Value = serde_json::from_str(&place.run(&["runs", "a", "c", "--json"], 0)).unwrap();
    assert_eq!(other["one_problem"], false);
    assert_eq!(of(&other, "objective").len(), 2, "values in different units are not subtracted");
    let study = "version = 1\nmodel = 'two-bar-truss.toml'\nkind = 'sample'\ncount = 2\n[vary.area]\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    place.run(&["study", "s", "-q", "-o", "s"], 0);
    for pair in [["a", "s"], ["s", "s"]] {
        let shown = place.run(&["runs", pair[0], pair[1]], 1);
        assert!(shown.contains("s has a study in it") && shown.contains("s/report.html"), "{shown}");
    }
}

/// At an optimum in the interior all derivatives are zero; without constraints there is no violation.
#[test]
fn a_problem_without_constraints_has_no_violation_and_a_small_residual() {
    let place = TempFolder::new("interior");
    let text = "version = 2\n[design.x]\nstart = 5\nlower = 0\nupper = 10\n[[output]]\nname = 'f'\nvalue = '(x-2)^2 + 0.1*x^3'\n\
                [objective]\nminimize = 'f'\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    let inactive = format!("{text}[[constraint]]\nname = 'far'\nvalue = 'x'\nat_most = 9\n");
    std::fs::write(place.0.join("inactive.toml"), inactive).unwrap();
    for name in ["m", "inactive"] {
        place.run(&["compare", &format!("{name}.toml"), "--methods", "bfgs,sqp-filter,gcmma", "-q", "-o", "c"], 0);
        let table = place.read(&format!("c/{name}.csv"));
        let mut lines = table.lines().map(|line| line.split(',').collect::<Vec<_>>());
        let head = lines.next().unwrap();
        let column = |name: &str| head.iter().position(|column| *column == name).unwrap();
        for row in lines.filter(|row| row[column("end")] == "converged") {
            let residual: f64 = row[column("kkt_residual")].parse().unwrap();
            assert!(residual < 1e-3, "{name} {row:?}");
            assert_eq!(row[column("violation_pct")].is_empty(), name == "m", "{row:?}");
        }
    }
    place.run(&["optimize", "m.toml", "-q", "-o", "out/m"], 0);
    let summary: serde_json::Value = serde_json::from_str(&place.read("out/m/summary.json")).unwrap();
    assert!(summary["violation_pct"].is_null(), "{summary}");
    let listed: serde_json::Value = serde_json::from_str(&place.run(&["runs", "--json"], 0)).unwrap();
    assert!(listed["result"]["violation_pct"].is_null());
    assert!(!place.run(&["runs"], 0).contains("-100"));
    assert!(!place.run(&["runs", "out/m", "out/m"], 0).contains("-100"));
}

/// Options of suites are not ignored elsewhere.
#[test]
fn options_of_suites_are_refused_elsewhere() {
    let place = TempFolder::new("suite-options");
    place.example("two-bar-truss");
    for what in ["two-bar-truss.toml", "cantilever"] {
        for option in [["--transform", "objective=1e6"], ["--peers", "nofile"]] {
            let output = linkwright(&["compare", what, option[0], option[1]], &place.0);
            assert!(!output.status.success(), "{what} {option:?}");
            assert!(text(&output.stderr).contains("suite"), "{what} {option:?}");
        }
    }
}
