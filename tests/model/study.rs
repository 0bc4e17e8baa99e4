//! Studies from the command line: rows, resumption, parts, bad input.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright, text};
use std::process::Command;

const MODEL: &str = r#"
version = 2
title = "bar"
[design.width]
start = 3.0
lower = 0.5
upper = 8.0
unit = "m"
[constants]
load = 1.0
[[output]]
name = "stress"
value = "load/width"
[objective]
name = "mass"
minimize = "width"
[[constraint]]
name = "strength"
value = "stress"
at_most = 0.5
"#;

const SAMPLE: &str = r#"
version = 1
model = "bar.toml"
kind = "sample"
count = 40
sequence = "latin-hypercube"
[vary.width]
[vary.load]
mean = 1.0
deviation = 0.1
"#;

/// A folder with the model and a study.
fn place(name: &str, study: &str) -> TempFolder {
    let place = TempFolder::new(&format!("study-{name}"));
    std::fs::write(place.0.join("bar.toml"), MODEL).unwrap();
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    place
}

#[test]
fn rows_have_the_same_bytes_for_any_number_of_threads() {
    let place = place("threads", SAMPLE);
    for jobs in ["1", "2", "5"] {
        place.run(&["study", "s", "--jobs", jobs, "--quiet", "--out", jobs], 0);
    }
    let rows = place.read("1/rows.jsonl");
    assert_eq!(rows.lines().count(), 41);
    for other in ["2", "5"] {
        for file in ["rows.jsonl", "runs.csv", "summary.csv", "summary.json", "report.html"] {
            assert_eq!(
                place.read(&format!("1/{file}")),
                place.read(&format!("{other}/{file}")),
                "{file}, {other} threads"
            );
        }
    }
    // The stress is the load over the width, in every row.
    for line in place.read("1/runs.csv").lines().skip(1) {
        let cells: Vec<f64> = line.split(',').take(5).map(|cell| cell.parse().unwrap()).collect();
        assert!((cells[4] - cells[2] / cells[1]).abs() < 1e-14, "{line}");
        assert!((0.5..8.0).contains(&cells[1]) && cells[3] == cells[1], "{line}");
    }
}

/// What a kill can leave: the first lines of the row file in any order, and a part of one more.
#[test]
fn a_killed_study_is_continued_to_the_same_bytes_and_nothing_is_done_twice() {
    let place = place("killed", SAMPLE);
    place.run(&["study", "s", "--quiet", "--out", "whole"], 0);
    let whole = place.read("whole/rows.jsonl");
    let lines: Vec<&str> = whole.split_inclusive('\n').collect();
    for (kept, cut) in [(1, 0), (1, 9), (17, 30), (39, 1), (41, 0)] {
        let out = format!("cut-{kept}-{cut}");
        place.run(&["study", "s", "--quiet", "--out", &out], 0);
        let next = lines.get(kept).map_or("", |line| &line[..cut]);
        // The rows of a killed study are in the order in which the runs ended.
        let mut left: Vec<&str> = lines[1..kept].to_vec();
        left.reverse();
        let text = [lines[0], &left.concat(), next].concat();
        std::fs::write(place.0.join(&out).join("rows.jsonl"), text).unwrap();
        for file in ["runs.csv", "summary.json", "report.html"] {
            std::fs::remove_file(place.0.join(&out).join(file)).unwrap();
        }
        let shown = place.run(&["study", "s", "--out", &out], 0);
        let missing = 41 - kept;
        assert!(
            kept == 1 || shown.contains(&format!("{} runs are done already, {missing} are missing", kept - 1)),
            "{shown}"
        );
        for file in ["rows.jsonl", "runs.csv", "summary.json", "report.html"] {
            assert_eq!(
                place.read(&format!("{out}/{file}")),
                place.read(&format!("whole/{file}")),
                "{file} after {kept} lines"
            );
        }
    }
}

#[test]
fn a_study_that_is_killed_by_a_signal_is_continued() {
    let long = SAMPLE.replace("count = 40", "count = 20000");
    let place = place("signal", &long);
    let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
        .args(["study", "s", "--quiet", "--out", "killed"])
        .current_dir(&place.0)
        .spawn()
        .unwrap();
    let rows = place.0.join("killed/rows.jsonl");
    while std::fs::metadata(&rows).map_or(0, |file| file.len()) < 20_000 {
        std::thread::yield_now();
        if child.try_wait().unwrap().is_some() {
            break;
        }
    }
    drop(child.kill());
    child.wait().unwrap();
    place.run(&["study", "s", "--quiet", "--out", "killed"], 0);
    place.run(&["study", "s", "--quiet", "--out", "whole", "--jobs", "1"], 0);
    assert!(place.read("killed/rows.jsonl") == place.read("whole/rows.jsonl"));
}

#[test]
fn parts_joined_are_the_whole() {
    let place = place("parts", SAMPLE);
    place.run(&["study", "s", "--quiet"], 0);
    for part in ["1/3", "2/3", "3/3"] {
        let shown = place.run(&["study", "s", "--part", part], 0);
        assert!(shown.contains("study merge"), "{shown}");
    }
    let parts: Vec<String> = (1..=3).map(|k| format!("out/s-part-{k}-of-3")).collect();
    let incomplete = place.run(&["study", "merge", &parts[0], &parts[2], "--out", "two"], 0);
    assert!(incomplete.contains("13 runs are missing"), "{incomplete}");
    // The missing runs are done in the joined folder.
    place.run(&["study", "s", "--quiet", "--out", "two"], 0);
    place.run(&["study", "merge", &parts[2], &parts[0], &parts[1], "--out", "all", "--quiet"], 0);
    for other in ["all", "two"] {
        for file in ["rows.jsonl", "runs.csv", "summary.json", "report.html"] {
            assert_eq!(place.read(&format!("{other}/{file}")), place.read(&format!("out/s/{file}")), "{other}/{file}");
        }
    }
    assert!(place.run(&["study", "s", "--part", "4/3"], 2).contains("give a part as 3/16"));
    let error = place.run(&["study", "s", "--part", "2/3", "--out", "all"], 1);
    assert!(error.contains("all has part 1/1 of this study"), "{error}");
}

/// The job script of the examples, run as Slurm runs the tasks of an array job; `.ci/slurm` does the same on a real cluster.
#[cfg(unix)]
#[test]
fn the_job_script_of_slurm_does_a_part_for_each_task() {
    let place = place("slurm", &SAMPLE.replace("count = 40", "count = 20000"));
    let program = std::path::Path::new(env!("CARGO_BIN_EXE_linkwright"));
    let path = format!("{}:{}", program.parent().unwrap().display(), std::env::var("PATH").unwrap());
    let task = |number: usize| {
        let mut command = Command::new("sh");
        command.args([concat!(env!("CARGO_MANIFEST_DIR"), "/examples/slurm.sh"), "s.toml", "4"]);
        command.env("PATH", &path).env("SLURM_ARRAY_TASK_ID", number.to_string()).env("SLURM_CPUS_PER_TASK", "1");
        command.current_dir(&place.0);
        command
    };
    for number in [1, 3, 4] {
        assert!(task(number).status().unwrap().success());
    }
    // A task is killed in the middle, and submitted again.
    let rows = place.0.join("out/s-part-2-of-4/rows.jsonl");
    let mut killed = task(2).spawn().unwrap();
    while std::fs::metadata(&rows).map_or(0, |file| file.len()) < 20_000 {
        std::thread::yield_now();
        if killed.try_wait().unwrap().is_some() {
            break;
        }
    }
    drop(killed.kill());
    killed.wait().unwrap();
    assert!(task(2).status().unwrap().success());
    let parts: Vec<String> = (1..=4).map(|k| format!("out/s-part-{k}-of-4")).collect();
    let mut merge = vec!["study", "merge", "--out", "merged", "--quiet"];
    merge.extend(parts.iter().map(String::as_str));
    place.run(&merge, 0);
    place.run(&["study", "s", "--quiet", "--out", "whole"], 0);
    for file in ["rows.jsonl", "runs.csv", "summary.json"] {
        assert!(place.read(&format!("merged/{file}")) == place.read(&format!("whole/{file}")), "{file}");
    }
}

#[test]
fn a_changed_study_is_rejected_in_its_folder_and_begins_another_one() {
    let place = place("changed", SAMPLE);
    place.run(&["study", "s", "--quiet"], 0);
    let rows = place.read("out/s/rows.jsonl");
    // Comments and titles do not count.
    std::fs::write(place.0.join("s.toml"), format!("# a comment\ntitle = \"other\"\n{SAMPLE}")).unwrap();
    assert!(place.run(&["study", "s"], 0).contains("40 runs are done already, 0 are missing"));
    std::fs::write(place.0.join("s.toml"), SAMPLE.replace("count = 40", "count = 41")).unwrap();
    let error = place.run(&["study", "s", "--out", "out/s"], 1);
    assert!(error.contains("out/s has another study") && error.contains("study: count"), "{error}");
    assert!(place.run(&["study", "s"], 0).contains("This study goes to out/s-2"));
    std::fs::write(place.0.join("s.toml"), SAMPLE).unwrap();
    std::fs::write(place.0.join("bar.toml"), MODEL.replace("load/width", "2*load/width")).unwrap();
    let error = place.run(&["study", "s", "--out", "out/s"], 1);
    assert!(error.contains("model: output.stress.value"), "{error}");
    assert_eq!(place.read("out/s/rows.jsonl"), rows);
    place.run(&["study", "s", "--out", "out/s", "--force", "--quiet"], 0);
    assert_ne!(place.read("out/s/rows.jsonl"), rows);
}

#[test]
fn a_damaged_row_is_named_and_other_folders_are_left_alone() {
    let place = place("damaged", SAMPLE);
    place.run(&["study", "s", "--quiet", "--out", "d"], 0);
    let rows = place.read("d/rows.jsonl");
    let damaged = rows.replacen("\"run\":6,", "\"run\":7,", 1);
    std::fs::write(place.0.join("d/rows.jsonl"), &damaged).unwrap();
    let error = place.run(&["study", "s", "--out", "d"], 1);
    assert!(error.contains("d/rows.jsonl: line 8 is damaged") && error.contains("remove this line"), "{error}");
    // As the message says.
    let mut lines: Vec<&str> = damaged.split_inclusive('\n').collect();
    lines.remove(7);
    std::fs::write(place.0.join("d/rows.jsonl"), lines.concat()).unwrap();
    place.run(&["study", "s", "--quiet", "--out", "d"], 0);
    assert_eq!(place.read("d/rows.jsonl"), rows);
    std::fs::create_dir(place.0.join("mine")).unwrap();
    std::fs::write(place.0.join("mine/notes.txt"), "mine").unwrap();
    assert!(place.run(&["study", "s", "--out", "mine"], 1).contains("is not empty and has no study in it"));
    assert_eq!(std::fs::read_dir(place.0.join("mine")).unwrap().count(), 1);
}

#[test]
fn a_run_does_not_begin_in_the_folder_of_a_study() {
    let place = place("study-and-run", SAMPLE);
    place.run(&["study", "s", "-o", "out/bar", "-q"], 0);
    let rows = place.read("out/bar/rows.jsonl");
    for arguments in [&["optimize", "bar", "-o", "out/bar"][..], &["optimize", "bar", "-o", "out/bar", "--force"]] {
        assert!(place.run(arguments, 1).contains("has a study in it"), "{arguments:?}");
    }
    assert!(place.run(&["optimize", "bar"], 0).contains("Results are in out/bar-2"));
    assert_eq!(place.read("out/bar/rows.jsonl"), rows);
    place.run(&["study", "s", "-o", "out/bar", "-q"], 0);
}

#[test]
fn a_failed_run_is_a_row_with_its_reason() {
    let study = "version = 1\nmodel = \"bar.toml\"\nkind = \"grid\"\n[vary.width]\nfrom = -1\nto = 1\npoints = 3\n";
    let place = place("failed", study);
    let shown = place.run(&["study", "s"], 0);
    assert!(shown.contains("1 of 3 runs failed"), "{shown}");
    let rows = place.read("out/s/runs.csv");
    let failed: Vec<&str> = rows.lines().filter(|line| line.contains("failed")).collect();
    assert!(failed.len() == 1 && failed[0].starts_with("1,0,") && failed[0].contains("`stress` is inf"), "{rows}");
    assert!(place.read("out/s/report.html").contains("Failed runs"));
    // All runs fail: an error, with the reason.
    std::fs::write(place.0.join("bar.toml"), MODEL.replace("load/width", "sqrt(-load - width^2)/width")).unwrap();
    let error = place.run(&["study", "s", "--out", "all"], 1);
    assert!(error.contains("all 3 runs failed") && error.contains("`stress` is NaN"), "{error}");
}

/// Also without an objective, where each output is a result.
#[test]
fn an_undefined_output_is_a_failure_with_its_reason() {
    let study = "version = 1\nmodel = \"bar.toml\"\nkind = \"grid\"\n[vary.x]\nfrom = -1\nto = 1\npoints = 5\n";
    let place = place("undefined", study);
    let model = "version = 2\n[design.x]\nstart = 0.5\nlower = -1.0\nupper = 1.0\n[[output]]\nname = \"y\"\nvalue = \"sqrt(x)\"\n";
    let simulated = "version = 2\n[time]\nto = 2.0\npoints = 3\n[[output]]\nname = \"y\"\nvalue = \"ln(1 - time)\"\n";
    std::fs::write(place.0.join("bar.toml"), model).unwrap();
    std::fs::write(place.0.join("late.toml"), simulated).unwrap();
    let shown = place.run(&["study", "s"], 0);
    assert!(shown.contains("2 of 5 runs failed") && shown.contains("3 of 5 analyses have results"), "{shown}");
    let rows = place.read("out/s/runs.csv");
    assert!(rows.contains("0,-1,,failed,\"response `y` is NaN at x = -1 (sqrt(-1) is not defined"), "{rows}");
    let shown = place.run(&["analyze", "bar", "--at", "x=-0.25"], 1);
    assert!(
        shown.contains("response `y` is NaN at x = -0.25 (sqrt(-0.25) is not defined") && shown.contains("bar.toml:"),
        "{shown}"
    );
    assert!(place.run(&["analyze", "late"], 1).contains("response `y` is -inf at time 1 s (ln(0) is not finite"));
    // Tolerances around a mean without a result have no conclusion.
    std::fs::write(
        place.0.join("s.toml"),
        "version = 1\nmodel = \"bar.toml\"\nkind = \"tolerance\"\ncount = 4\n[vary.x]\nmean = -0.5\ndeviation = 0.01\n",
    )
    .unwrap();
    let shown = place.run(&["study", "s", "--out", "t"], 1);
    assert!(shown.contains("response `y` is NaN at x = -0.5"), "{shown}");
}

#[test]
fn lines_of_json_are_rows_and_a_summary() {
    let place = place("json", SAMPLE);
    let output = linkwright(&["study", "s", "--json"], &place.0);
    let all = text(&output.stdout);
    let lines: Vec<serde_json::Value> = all.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(lines.len(), 41);
    assert!(lines[..40].iter().all(|line| line["event"] == "row" && line["phase"] == "runs"));
    assert_eq!((&lines[40]["event"], &lines[40]["runs"], &lines[40]["failed"]), (&"end".into(), &40.into(), &0.into()));
    assert_eq!(lines[40]["tables"]["summary"][0]["quantity"], "mass");
}

#[test]
fn mistakes_have_a_place_in_the_study_file() {
    let place = place("mistakes", SAMPLE);
    for (old, new, says) in [
        ("[vary.load]", "[vary.lode]", "s.toml:8:7"),
        ("[vary.load]", "[vary.lode]", "did you mean `load`?"),
        ("count = 40", "count = 40\nquantities = [\"mass\", \"sterngth\"]", "s.toml:6:23"),
        ("count = 40", "count = 40\nset = { \"constraint.strenth.at_most\" = 1 }", "s.toml:6:9"),
        ("deviation = 0.1", "deviation = 0", "the spread of `load` is not positive"),
        ("bar.toml", "none.toml", "cannot read the model none.toml"),
    ] {
        std::fs::write(place.0.join("s.toml"), SAMPLE.replacen(old, new, 1)).unwrap();
        let error = place.run(&["study", "s"], 1);
        assert!(error.contains(says), "{new}: {error}");
    }
    assert!(!place.0.join("out").exists());
}

/// A limit on the size of files acts as a full disk: it is reached by the rows, or only by a table, the summary or the page.
#[cfg(target_os = "linux")]
#[test]
fn on_a_full_disk_finished_runs_are_kept_and_the_same_command_continues() {
    let place = place("full", &SAMPLE.replace("count = 40", "count = 400"));
    place.run(&["study", "s", "--quiet", "--out", "whole"], 0);
    let size = |name: &str| place.0.join("whole").join(name).metadata().unwrap().len();
    let largest = std::fs::read_dir(place.0.join("whole")).unwrap().map(|f| f.unwrap().metadata().unwrap().len()).max();
    // The unit of the limit is 512 or 1024 bytes, as the shell has it.
    let limits = [4, size("rows.jsonl") / 2 / 1024, largest.unwrap() / 1024 - 1];
    for limit in limits {
        let out = format!("cut-{limit}");
        let script = format!(
            "trap '' XFSZ; ulimit -f {limit}; exec {} study s --quiet --out {out}",
            env!("CARGO_BIN_EXE_linkwright")
        );
        let output = Command::new("sh").args(["-c", &script]).current_dir(&place.0).output().unwrap();
        let shown = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{limit}: {shown}");
        assert!(shown.starts_with(&format!("error: cannot write {out}/")), "{shown}");
        assert!(shown.contains("finished runs are kept") && shown.contains("File too large"), "{shown}");
        let kept = place.read(&format!("{out}/rows.jsonl")).lines().count();
        assert!(kept > 10, "{limit}: {kept} lines of rows.jsonl");
        place.run(&["study", "s", "--quiet", "--out", &out], 0);
        for file in ["rows.jsonl", "runs.csv", "summary.csv", "summary.json", "report.html"] {
            assert_eq!(place.read(&format!("{out}/{file}")), place.read(&format!("whole/{file}")), "{limit}: {file}");
        }
    }
}

#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_study_after_the_runs_that_have_begun() {
    let place = place("ctrl-c", &SAMPLE.replace("count = 40", "count = 4000"));
    place.run(&["study", "s", "--quiet", "--out", "whole"], 0);
    let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
        .args(["study", "s", "--json", "--jobs", "1", "--out", "cut"])
        .current_dir(&place.0)
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    // The signal arrives after the first row: the handler is there, and the full pipe holds the study until this program reads on.
    let mut lines = std::io::BufReader::new(child.stdout.take().unwrap());
    std::io::BufRead::read_line(&mut lines, &mut String::new()).unwrap();
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    std::io::copy(&mut lines, &mut std::io::sink()).unwrap();
    let output = child.wait_with_output().unwrap();
    let shown = text(&output.stderr);
    assert_eq!(output.status.code(), Some(130), "{shown}");
    assert!(shown.contains("stopping after the runs that have begun"), "{shown}");
    assert!(shown.contains("the same command again continues the study in cut"), "{shown}");
    assert!(!place.0.join("cut/report.html").exists());
    let kept = place.read("cut/rows.jsonl").lines().count();
    assert!(kept > 1 && kept < 4001, "{kept} lines of rows.jsonl");
    let shown = place.run(&["study", "s", "--out", "cut"], 0);
    assert!(shown.contains(&format!("{} runs are done already, {} are missing", kept - 1, 4001 - kept)), "{shown}");
    assert_eq!(place.read("cut/rows.jsonl"), place.read("whole/rows.jsonl"));
}

/// A part, or parts joined, of which all runs failed, is an error as a whole study is; runs that are missing do not hide that.
#[test]
fn a_part_whose_runs_all_fail_is_an_error() {
    let study = SAMPLE.replace("count = 40", "count = 4").replace("[vary.width]", "[vary.width]\nfrom = -2\nto = -1");
    let place = place("part-fails", &study);
    let broken = place.read("bar.toml").replace("load/width", "sqrt(width)/load");
    std::fs::write(place.0.join("bar.toml"), broken).unwrap();
    for part in ["1/2", "2/2"] {
        let shown = place.run(&["study", "s", "--part", part], 1);
        assert!(shown.contains("all 2 runs failed"), "{shown}");
    }
    assert!(place.run(&["study", "merge", "out/s-part-1-of-2", "--out", "one"], 1).contains("all 2 runs failed"));
    let parts = ["study", "merge", "out/s-part-1-of-2", "out/s-part-2-of-2", "--out", "two"];
    assert!(place.run(&parts, 1).contains("all 4 runs failed"));
    assert_eq!(place.read("one/rows.jsonl").lines().count(), 3);
}

/// A limit far away has its index, one out of reach the probability 0 or 1, and an equation no index: none is a failed run.
#[test]
fn limits_far_away_and_equations_have_answers() {
    let place = TempFolder::new("far-limits");
    let constraint = |name: &str, limit: &str| format!("[[constraint]]\nname = '{name}'\nvalue = 'f'\n{limit}\n");
    let model = [
        "version = 2\n[design.x]\nstart = 0\nlower = -1000\nupper = 1000\n[design.y]\nstart = 0\nlower = -1000\nupper = 1000\n\
         [[output]]\nname = 'f'\nvalue = 'x+y'\n[objective]\nminimize = 'f'\n",
        &constraint("near", "at_most = 1"),
        &constraint("far", "at_most = 186"),
        &constraint("equation", "equals = -1"),
    ]
    .concat();
    std::fs::write(place.0.join("m.toml"), model).unwrap();
    let table = |study: &str| -> (serde_json::Value, String) {
        std::fs::write(
            place.0.join("s.toml"),
            format!("version = 1\nmodel = 'm.toml'\nkind = 'tolerance'\ncount = 100\n{study}"),
        )
        .unwrap();
        let shown = place.run(&["study", "s", "-o", "s", "--force"], 0);
        assert!(!shown.contains("runs failed"), "{shown}");
        (serde_json::from_str(&place.read("s/summary.json")).unwrap(), shown)
    };
    let (normal, shown) = table("[vary.x]\ndeviation = 1\n");
    let rows = normal["tables"]["reliability"].as_array().unwrap();
    let beta = |k: usize| rows[k]["beta"].as_f64().unwrap();
    assert!((beta(0) - 1.0).abs() < 1e-8, "{rows:?}");
    assert!(rows[1]["beta"].is_null() && rows[1]["probability"] == 0.0, "{rows:?}");
    assert_eq!((&rows[2]["constraint"], &rows[2]["beta"]), (&"equation".into(), &serde_json::Value::Null));
    assert!(rows[2]["probability"].is_null() && rows[2]["sample_probability"] == 1.0);
    assert!(shown.contains("equation is an equation"), "{shown}");
    let (uniform, shown) = table("[vary.x]\nplus_minus = 0.5\n[vary.y]\nplus_minus = 0.3\n");
    let rows = uniform["tables"]["reliability"].as_array().unwrap();
    assert!(rows[0]["beta"].is_null() && rows[0]["probability"] == 0.0, "{rows:?}");
    assert!(rows[1]["beta"].is_null() && rows[1]["probability"] == 0.0, "{rows:?}");
    assert!(shown.contains("near is met for all values"), "{shown}");
    let (uniform, _) = table("[vary.x]\nplus_minus = 0.5\nmean = 9\n");
    assert_eq!(uniform["tables"]["reliability"][0]["probability"], 1.0);
}

/// An extreme that moves to another time point near the mean has no second derivatives there.
#[test]
fn a_kink_near_the_mean_has_no_second_order_values() {
    let place = TempFolder::new("kink");
    let model = "version = 2\n[design.x]\nstart = 1.0\nlower = 0\nupper = 3\n[time]\nto = 1\npoints = 2\n\
                 [[output]]\nname = 'f'\nvalue = 'time*(x - 1.001)*4 + x^2'\n\
                 [[output]]\nname = 'g'\nvalue = '(1 + time)*x^2'\n[objective]\nminimize = 'max(f)'\n\
                 [[constraint]]\nname = 'smooth'\nvalue = 'max(g)'\nat_most = 90\n";
    std::fs::write(place.0.join("m.toml"), model).unwrap();
    let study = "version = 1\nmodel = 'm.toml'\nkind = 'tolerance'\ncount = 50\nquantities = ['f.max', 'g.max']\n[vary.x]\ndeviation = 0.1\n";
    std::fs::write(place.0.join("s.toml"), study).unwrap();
    let shown = place.run(&["study", "s", "-o", "s"], 0);
    assert!(shown.contains("f.max has no second-order values") && !shown.contains("g.max has no"), "{shown}");
    let summary: serde_json::Value = serde_json::from_str(&place.read("s/summary.json")).unwrap();
    let rows = summary["tables"]["moments"].as_array().unwrap();
    assert!(rows[0]["second_order_mean"].is_null() && rows[0]["linear_deviation"].is_number());
    assert!((rows[1]["second_order_mean"].as_f64().unwrap() - 2.0 * 1.01).abs() < 1e-9);
}

/// A grid that leaves the bounds says so; a constraint with both limits is known by its name; tables have the units of their columns.
#[test]
fn grids_have_bounds_sides_and_units() {
    let place = TempFolder::new("grid-bounds");
    let model = "version = 2\n[design.w]\nstart = '30 mm'\nlower = '20 mm'\nupper = '60 mm'\n[[output]]\nname = 'f'\nvalue = '2*w'\n\
                 [objective]\nminimize = 'f'\n[[constraint]]\nname = 'height'\nvalue = 'w'\nat_least = '25 mm'\nat_most = '50 mm'\n";
    std::fs::write(place.0.join("m.toml"), model).unwrap();
    let study = |kind: &str, keys: &str, vary: &str| {
        std::fs::write(
            place.0.join("s.toml"),
            format!("version = 1\nmodel = 'm.toml'\nkind = '{kind}'\n{keys}[vary.w]\n{vary}"),
        )
        .unwrap();
    };
    for kind in ["grid", "sweep"] {
        study(kind, "", "from = -30\nto = 40\npoints = 8\n");
        let shown = place.run(&["study", "s", "-o", kind], 0);
        assert!(shown.contains("In 5 runs w is outside its bounds in the model, 20 mm and 60 mm"), "{shown}");
        study(kind, "", "from = 30\nto = 40\npoints = 3\n");
        assert!(!place.run(&["study", "s", "-o", &format!("{kind}-inside")], 0).contains("outside"));
    }
    study("grid", "quantities = ['height', 'height.margin']\n", "from = 30\nto = 40\npoints = 3\n");
    let output = linkwright(&["study", "s", "-o", "sides", "--json"], &place.0);
    let lines: Vec<serde_json::Value> =
        text(&output.stdout).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let columns =
        serde_json::json!(["w", "height upper", "height lower", "height upper.margin", "height lower.margin"]);
    assert_eq!(lines[0]["columns"], columns, "{}", text(&output.stderr));
    assert_eq!(lines[3]["columns"]["runs"][0], serde_json::json!({ "name": "w", "unit": "mm" }));
    study("multi-start", "count = 2\n", "");
    assert!(place.run(&["study", "s", "-o", "starts"], 0).contains("w [mm]"));
    assert!(place.read("sweep/report.html").contains("w [mm]"));
    assert!(place.read("sweep/optima.csv").starts_with("run,w,"));
}

/// Numbers of cycles and analyses, and a setting that takes whole numbers, are integers in the terminal and on the page.
#[test]
fn counts_are_integers_in_the_tables_of_a_study() {
    let study = "version = 1\nmodel = \"bar.toml\"\nkind = \"sweep\"\n[vary.\"method.max_cycles\"]\nfrom = 17\nto = 19\npoints = 3\n";
    let place = place("counts", study);
    let shown = place.run(&["study", "s", "--out", "o"], 0);
    let page = place.read("o/report.html");
    assert!(shown.contains(" 17 ") && page.contains(">17<"), "{shown}");
    assert!(!shown.contains("17.0") && !page.contains(">17.0"), "{shown}");
    let csv = place.read("o/optima.csv");
    let head: Vec<&str> = csv.lines().next().unwrap().split(',').collect();
    let columns =
        ["cycles", "analyses", "sensitivity_analyses"].map(|name| head.iter().position(|c| *c == name).unwrap());
    // The row of each run in the text has its counts as in the file.
    for (run, line) in csv.lines().skip(1).enumerate() {
        let cells: Vec<&str> = line.split(',').collect();
        let counts = columns.map(|column| cells[column]);
        assert!(counts.iter().all(|count| count.parse::<usize>().is_ok()), "{csv}");
        let rows = shown.lines().map(|row| row.split_whitespace().collect::<Vec<_>>());
        let mut own = rows.filter(|words| words.first() == Some(&&*run.to_string()) && words.len() > 3);
        assert!(own.any(|words| words.windows(3).any(|three| three == counts)), "{shown}");
    }
}

/// The empty text leaves a setting of the model out.
#[test]
fn a_study_leaves_a_setting_out() {
    let study = "version = 1\nmodel = \"bar.toml\"\nkind = \"grid\"\nset = { \"constraint.strength.at_most\" = \"\", \"constraint.strength.at_least\" = 0.1 }\n[vary.width]\nfrom = 1\nto = 2\npoints = 2\n";
    let place = place("without", study);
    place.run(&["study", "s", "--out", "o", "--quiet"], 0);
    let model = place.read("o/model.toml");
    assert!(!model.contains("at_most") && model.contains("at_least = 0.1"), "{model}");
}
