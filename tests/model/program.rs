//! Model files whose outputs another program computes: a script of the shell in place of a simulator.
#![cfg(all(feature = "cli", unix))]

use crate::shell::TempFolder;

/// The stresses of the two-bar truss of Svanberg (1987), section 6.
const SCRIPT: &str = r#"number() { printf '%s' "$line" | sed "s/.*\"$1\":\([-0-9.e]*\).*/\1/"; }
echo "simulator of trusses" >&2
while read -r line; do
    echo "$line" >> requests
    awk -v id="$(number id)" -v a="$(number area)" -v s="$(number span)" 'BEGIN {
        if (s > 1.59) { printf "{\"id\":%d,\"error\":\"the span %g is too wide\"}\n", id, s; exit }
        l = 0.124 * sqrt(1 + s * s)
        printf "{\"id\":%d,\"responses\":{\"stress1\":%.17g,\"stress2\":%.17g}}\n", id, l * (8 / a + 1 / (a * s)), l * (8 / a - 1 / (a * s))
    }'
done
"#;

/// The example with a program in the place of the formulas.
fn truss(place: &TempFolder) -> String {
    std::fs::write(place.0.join("truss.sh"), SCRIPT).unwrap();
    place.example("two-bar-truss");
    let text = place.read("two-bar-truss.toml");
    let formula = text.lines().find(|line| line.starts_with("value = \"0.124")).unwrap();
    let program =
        "[analysis]\nkind = \"program\"\ncommand = [\"sh\", \"truss.sh\"]\nderivatives = \"central\"\n\n[design.area]";
    text.replace(formula, "program = \"number\"").replace("[design.area]", program)
}

/// The model file `truss.toml` with its program.
#[cfg(feature = "database")]
pub fn truss_with_a_script(place: &TempFolder) {
    std::fs::write(place.0.join("truss.toml"), truss(place)).unwrap();
}

#[test]
fn a_program_is_started_only_if_that_is_allowed() {
    let place = TempFolder::new("program");
    std::fs::write(place.0.join("truss.toml"), truss(&place)).unwrap();
    for command in [["optimize", "truss.toml"], ["analyze", "truss.toml"], ["check", "truss.toml"]] {
        let shown = place.run(&command, 1);
        assert!(shown.contains("`sh truss.sh`: a model file starts no program unless that is allowed"), "{shown}");
        assert!(shown.contains("--allow-programs"), "{shown}");
    }
    assert!(!place.0.join("requests").exists());
}

#[test]
fn a_program_is_optimized_like_its_formulas() {
    let place = TempFolder::new("program-optimum");
    std::fs::write(place.0.join("truss.toml"), truss(&place)).unwrap();
    let end = |arguments: &[&str]| -> serde_json::Value {
        let shown = place.run(arguments, 0);
        serde_json::from_str(shown.lines().last().unwrap()).unwrap()
    };
    let by_program = end(&["optimize", "truss.toml", "--allow-programs", "--json", "--out", "a"]);
    let by_formula = end(&["optimize", "two-bar-truss.toml", "--json", "--out", "b"]);
    assert_eq!(by_program["status"], "Converged");
    let [program, formula] = [&by_program, &by_formula].map(|end| end["objective"]["value"].as_f64().unwrap());
    assert!((program - formula).abs() < 1e-6, "{program} {formula}");
    // Central differences of two variables; no design is sent twice.
    let mut designs = designs(&place);
    let count = designs.len();
    designs.sort_unstable();
    designs.dedup();
    assert_eq!(designs.len(), count);
    // The report analyses the first and the last design again, by the program in the folder of the model file.
    assert!(place.run(&["report", "a"], 1).contains("--allow-programs"));
    place.run(&["report", "a", "--slice", "3", "--allow-programs"], 0);
}

/// The truss by a program that gives derivatives where they are requested.
const DIFFERENTIATED: &str = r#"number() { printf '%s' "$line" | sed "s/.*\"$1\":\([-0-9.e]*\).*/\1/"; }
while read -r line; do
    echo "$line" >> requests
    case "$line" in *'"derivatives":true'*) wanted=1 ;; *) wanted=0 ;; esac
    awk -v id="$(number id)" -v a="$(number area)" -v s="$(number span)" -v wanted="$wanted" 'BEGIN {
        root = sqrt(1 + s * s); l = 0.124 * root; m = 0.124 * s / root
        printf "{\"id\":%d,\"responses\":{\"stress1\":%.17g,\"stress2\":%.17g}", id, l * (8 / a + 1 / (a * s)), l * (8 / a - 1 / (a * s))
        if (wanted) for (k = 1; k <= 2; k++) {
            sign = k == 1 ? 1 : -1
            sum = 8 / a + sign / (a * s)
            printf (k == 1 ? ",\"derivatives\":{" : ",")
            printf "\"stress%d\":{\"area\":%.17g,\"span\":%.17g}", k, -l * sum / a, m * sum - sign * l / (a * s * s)
        }
        print (wanted ? "}}" : "}")
    }'
done
"#;

/// Values and derivatives of a design are one request, whatever the method; what needs no derivatives does not ask for them.
#[test]
fn derivatives_of_a_program_come_with_its_values() {
    let place = TempFolder::new("program-derivatives");
    let text = truss(&place).replace("derivatives = \"central\"", "derivatives = \"program\"");
    std::fs::write(place.0.join("truss.toml"), text).unwrap();
    std::fs::write(place.0.join("truss.sh"), DIFFERENTIATED).unwrap();
    for method in ["automatic", "slp", "slp-filter", "sqp-filter", "mma", "gcmma", "bfgs"] {
        drop(std::fs::remove_file(place.0.join("requests")));
        place.run(&["optimize", "truss.toml", "--allow-programs", "--method", method, "--out", method], 0);
        let summary: serde_json::Value = serde_json::from_str(&place.read(&format!("{method}/summary.json"))).unwrap();
        let objective = summary["objective"]["value"].as_f64().unwrap();
        assert!((objective - 1.50865).abs() < 1e-3, "{method}: {objective}");
        let mut all = designs(&place);
        let count = all.len();
        all.sort_unstable();
        all.dedup();
        assert_eq!(all.len(), count, "{method}: no design twice");
        let requests = place.read("requests");
        assert!(requests.lines().all(|line| line.contains("\"derivatives\":true")), "{method}: {requests}");
    }
    // The report has the designs of the run from its answers, and needs values only for the slice.
    let before = designs(&place).len();
    place.run(&["report", "bfgs", "--slice", "3", "--page-only", "--allow-programs"], 0);
    let requests = place.read("requests");
    let new: Vec<&str> = requests.lines().skip(before).collect();
    assert!(!new.is_empty() && new.iter().all(|line| line.contains("\"derivatives\":false")), "{new:?}");
    // So do the rows of a study of analyses.
    let study = "version = 1\nmodel = \"truss.toml\"\nkind = \"grid\"\n[vary.area]\nfrom = 1\nto = 2\npoints = 3\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    drop(std::fs::remove_file(place.0.join("requests")));
    place.run(&["study", "s.toml", "--quiet", "--allow-programs"], 0);
    let requests = place.read("requests");
    assert!(requests.lines().count() == 3 && !requests.contains("\"derivatives\":true"), "{requests}");
}

/// The designs that the program was asked for.
fn designs(place: &TempFolder) -> Vec<String> {
    let requests = place.read("requests");
    requests.lines().map(|line| line[line.find("\"design\"").unwrap()..].to_owned()).collect()
}

#[test]
fn a_continued_run_asks_for_no_design_again() {
    let place = TempFolder::new("program-answers");
    std::fs::write(place.0.join("truss.toml"), truss(&place)).unwrap();
    let run = |arguments: &[&str], code: i32| place.run(&[arguments, &["--allow-programs"]].concat(), code);
    run(&["optimize", "truss.toml", "--max-cycles", "2", "--out", "a"], 3);
    let before = designs(&place).len();
    // A kill while an answer is written.
    let kept = place.read("a/answers.jsonl");
    std::fs::write(place.0.join("a/answers.jsonl"), format!("{kept}{{\"hash\":\"12")).unwrap();
    run(&["resume", "a", "truss.toml"], 0);
    let mut all = designs(&place);
    let count = all.len();
    assert!(count > before);
    all.sort_unstable();
    all.dedup();
    assert_eq!(all.len(), count, "no design twice");
    assert_eq!(place.read("a/answers.jsonl").lines().count(), 1 + count);
    run(&["report", "a", "--slice", "0"], 0);
    assert_eq!(designs(&place).len(), count, "the report has its designs from the file");
    // The same run without an interruption.
    run(&["optimize", "truss.toml", "--out", "b"], 0);
    assert_eq!(place.read("a/cycles.csv"), place.read("b/cycles.csv"));

    let damaged = place.read("a/answers.jsonl").replacen("\"stress1\":1", "\"stress1\":2", 1);
    assert_ne!(damaged, place.read("a/answers.jsonl"));
    std::fs::write(place.0.join("a/answers.jsonl"), damaged).unwrap();
    let shown = run(&["resume", "a"], 1);
    assert!(
        shown.contains("answers.jsonl") && shown.contains("is damaged") && shown.contains("remove the file"),
        "{shown}"
    );
}

#[test]
fn a_failure_of_the_program_is_told_with_its_reason() {
    let place = TempFolder::new("program-failure");
    let text = truss(&place);
    let run = |text: String| {
        std::fs::write(place.0.join("truss.toml"), text).unwrap();
        place.run(&["analyze", "truss.toml", "--allow-programs"], 1)
    };
    let shown = run(text.replace("start = 0.5", "start = 1.6"));
    assert!(shown.contains("the span 1.6 is too wide"), "{shown}");
    let shown = run(text.replace("truss.sh", "missing.sh"));
    assert!(shown.contains("exit status") && shown.contains("missing.sh"), "{shown}");
    let shown = run(text.replace("\"sh\", \"truss.sh\"", "\"./missing\""));
    assert!(shown.contains("the program cannot be started"), "{shown}");
}

#[test]
fn mistakes_about_programs_have_their_place() {
    let place = TempFolder::new("program-mistakes");
    let text = truss(&place);
    for (from, to, message, line) in [
        ("command = [\"sh\", \"truss.sh\"]", "command = []", "the command is empty", "command = []"),
        ("command = [\"sh\", \"truss.sh\"]", "command = \"sh\"", "a list of texts", "command = \"sh\""),
        ("program = \"number\"", "value = \"area\"", "the program computes the outputs", "value = \"area\""),
        ("program = \"number\"", "program = \"series\"", "`series`", "program = \"series\""),
        ("program = \"number\"", "program = \"history\"", "no time points", "[time]"),
        ("derivatives = \"central\"", "derivatives = \"direct\"", "`direct`", "derivatives = \"direct\""),
        ("derivatives = \"central\"", "jobs = 0", "`jobs` must be at least 1", "jobs = 0"),
        ("derivatives = \"central\"", "time_limit = -1", "positive number of seconds", "time_limit = -1"),
        ("derivatives = \"central\"", "derivatives = \"program\"\ndifference = 0.1", "use none", "difference = 0.1"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(place.0.join("bad.toml"), text.replace(from, to)).unwrap();
        let shown = place.run(&["check", "bad.toml"], 1);
        assert!(shown.contains(message) && shown.contains(line), "{to}: {shown}");
    }
    // Without a program, an output cannot be one of a program.
    let (begin, end) = (text.find("[analysis]").unwrap(), text.find("[design.area]").unwrap());
    std::fs::write(place.0.join("bad.toml"), text[..begin].to_owned() + &text[end..]).unwrap();
    assert!(place.run(&["check", "bad.toml"], 1).contains("there is no program that could compute this output"));
}

/// The truss with a script that is the program itself, and what hides it.
fn truss_with_own_script(place: &TempFolder) {
    let text = truss(place).replace("[\"sh\", \"truss.sh\"]", "[\"./truss.sh\"]");
    std::fs::write(place.0.join("truss.toml"), text).unwrap();
    std::fs::write(place.0.join("truss.sh"), format!("#!/bin/sh\n{SCRIPT}")).unwrap();
    let may_run = std::os::unix::fs::PermissionsExt::from_mode(0o755);
    std::fs::set_permissions(place.0.join("truss.sh"), may_run).unwrap();
}

fn hide(place: &TempFolder, is_hidden: bool) {
    let [shown, hidden] = ["truss.sh", "hidden.sh"].map(|name| place.0.join(name));
    let (from, to) = if is_hidden { (shown, hidden) } else { (hidden, shown) };
    std::fs::rename(from, to).unwrap();
}

#[test]
fn a_run_whose_program_is_not_started_can_be_continued() {
    let place = TempFolder::new("program-resume");
    truss_with_own_script(&place);
    place.run(&["optimize", "truss.toml", "--allow-programs", "--out", "b"], 0);
    place.run(&["optimize", "truss.toml", "--allow-programs", "--max-cycles", "2", "--out", "a"], 3);
    let before = place.read("a/history.jsonl").matches("\"cycle\"").count();
    assert!(place.run(&["resume", "a", "--max-cycles", "50"], 1).contains("--allow-programs"));
    hide(&place, true);
    let shown = place.run(&["resume", "a", "--max-cycles", "50", "--allow-programs"], 1);
    assert!(shown.contains("the program cannot be started"), "{shown}");
    assert_eq!(place.read("a/history.jsonl").matches("\"cycle\"").count(), before);
    hide(&place, false);
    place.run(&["resume", "a", "--max-cycles", "50", "--allow-programs"], 0);
    assert_eq!(place.read("a/cycles.csv"), place.read("b/cycles.csv"));
    // The same with a method that is composed of parts.
    place.run(&["optimize", "truss.toml", "--allow-programs", "--method", "mma", "--max-cycles", "2", "--out", "c"], 3);
    assert!(place.run(&["resume", "c", "--max-cycles", "50"], 1).contains("--allow-programs"));
    place.run(&["resume", "c", "--max-cycles", "50", "--allow-programs"], 0);
}

#[test]
fn a_study_whose_program_is_not_started_has_no_rows() {
    let place = TempFolder::new("program-study");
    truss_with_own_script(&place);
    let study = "version = 1\nmodel = \"truss.toml\"\nkind = \"grid\"\n[vary.area]\nfrom = 1\nto = 2\npoints = 3\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    let rows = || place.read("out/s/rows.jsonl").lines().count() - 1;
    assert!(place.run(&["study", "s.toml", "--quiet"], 1).contains("--allow-programs"));
    assert_eq!(rows(), 0);
    hide(&place, true);
    let shown = place.run(&["study", "s.toml", "--quiet", "--allow-programs"], 1);
    assert!(shown.contains("the program cannot be started") && shown.contains("the same command again"), "{shown}");
    assert_eq!(rows(), 0);
    hide(&place, false);
    place.run(&["study", "s.toml", "--quiet", "--allow-programs"], 0);
    assert_eq!(place.read("out/s/rows.jsonl").matches("\"done\"").count(), 3);
    // A finished study needs no program.
    place.run(&["study", "s.toml", "--quiet"], 0);
}

#[test]
fn no_end_of_a_command_leaves_its_program_behind() {
    let place = TempFolder::new("program-interrupted");
    let text = truss(&place).replace("[\"sh\", \"truss.sh\"]", "[\"sh\", \"hang.sh\"]");
    std::fs::write(place.0.join("truss.toml"), text).unwrap();
    std::fs::write(place.0.join("hang.sh"), "sleep 1000 & echo $$ $! > processes; wait\n").unwrap();
    let cases =
        [("optimize", "-INT"), ("analyze", "-INT"), ("optimize", "-TERM"), ("analyze", "-HUP"), ("optimize", "-KILL")];
    // A command of `nohup` outlives its terminal, as do those that it starts.
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignores_hangup = ignored.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).unwrap() & 1 == 1);
    for (command, signal) in cases.into_iter().filter(|(_, signal)| !(ignores_hangup && *signal == "-HUP")) {
        drop(std::fs::remove_file(place.0.join("processes")));
        let mut running = std::process::Command::new(env!("CARGO_BIN_EXE_linkwright"))
            .args([command, "truss.toml", "--allow-programs"])
            .current_dir(&place.0)
            .stderr(std::process::Stdio::null())
            .stdout(std::process::Stdio::null())
            .spawn()
            .unwrap();
        let until = std::time::Instant::now() + std::time::Duration::from_secs(60);
        let wait = || {
            assert!(std::time::Instant::now() < until, "{command} {signal}");
            std::thread::sleep(std::time::Duration::from_millis(20));
        };
        let processes = || std::fs::read_to_string(place.0.join("processes")).unwrap_or_default();
        while !processes().ends_with('\n') {
            wait();
        }
        let kill = |arguments: &[&str]| {
            std::process::Command::new("kill").args(arguments).stderr(std::process::Stdio::null()).status().unwrap()
        };
        assert!(kill(&[signal, &running.id().to_string()]).success());
        assert_eq!(running.wait().unwrap().code(), (signal == "-INT").then_some(130), "{signal}");
        let is_running = |process: &str| {
            // A process for which nobody has waited is a zombie.
            let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
            kill(&["-0", process]).success() && !stat.contains(") Z ")
        };
        while processes().split_whitespace().any(is_running) {
            wait();
        }
    }
}

/// The error about the key is the only one: a table with an error is a design variable, too.
#[test]
fn a_wrong_key_of_the_only_design_variable_is_one_error() {
    let place = TempFolder::new("only-variable");
    let text = "version = 2\n[design.a]\nstart = 1.0\nlowr = 0.0\n[[output]]\nname = \"r\"\nvalue = \"a^2\"\n[objective]\nminimize = \"r\"\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    let shown = place.run(&["check", "m.toml"], 1);
    assert!(shown.contains("no key `lowr`") && !shown.contains("there is no design variable"), "{shown}");
}
