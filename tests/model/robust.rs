//! Runs that are killed, folders on full disks, folders that cannot be written.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, text};
use std::process::{Command, Stdio};
use std::time::Duration;

/// Files that must be equal for a run with and without a kill: all files without a date.
const FILES: &[&str] =
    &["state.json", "history.jsonl", "cycles.csv", "summary.json", "responses.csv", "constraints.csv"];

fn assert_same(place: &TempFolder, one: &str, other: &str) {
    for name in FILES {
        assert_eq!(place.read(&format!("{one}/{name}")), place.read(&format!("{other}/{name}")), "{name} of {one}");
    }
}

/// Evenly spread numbers from 0 to 1: multiples of the golden ratio.
fn spread(k: u32) -> f64 {
    (f64::from(k) * 0.618_033_988_749_895 + 0.37).fract()
}

#[test]
fn a_run_that_is_killed_at_any_moment_is_resumed_to_the_same_end() {
    let place = TempFolder::new("kill");
    place.example("impact-absorber-formula");
    let file = "impact-absorber-formula.toml";
    place.run(&["optimize", file, "--quiet", "--out", "whole"], 0);
    place.run(&["optimize", file, "--quiet", "--out", "again"], 0);
    assert_same(&place, "again", "whole");
    let whole = place.read("whole/history.jsonl").len();
    let mut interrupted = 0;
    for k in 0..50 {
        let out = format!("cut{k}");
        // The run, then a process that resumes it; both are killed.
        for (try_, command) in [["optimize", file, "--quiet", "--out", &out].as_slice(), &["resume", &out, "--quiet"]]
            .into_iter()
            .enumerate()
        {
            if try_ == 1 && !place.0.join(&out).join("run.json").exists() {
                break;
            }
            let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
                .args(command)
                .current_dir(&place.0)
                .stdout(Stdio::null())
                .spawn()
                .unwrap();
            // On any machine: shortly after a given part of the history has been written.
            let (part, moment) = (spread(2 * k + try_ as u32), spread(7 * k + 3));
            let written = || std::fs::metadata(place.0.join(&out).join("history.jsonl")).map_or(0, |file| file.len());
            while (written() as f64) < part * whole as f64 && child.try_wait().unwrap().is_none() {
                std::thread::sleep(Duration::from_micros(200));
            }
            std::thread::sleep(Duration::from_micros((2000.0 * moment) as u64));
            drop(child.kill());
            child.wait().unwrap();
        }
        let summary = std::fs::read_to_string(place.0.join(&out).join("summary.json")).unwrap_or_default();
        interrupted += usize::from(!summary.contains("Converged"));
        if !place.0.join(&out).join("run.json").exists() {
            // Killed before anything was written: the run can be started again in the same folder.
            place.run(&["optimize", file, "--quiet", "--out", &out], 0);
        } else {
            place.run(&["resume", &out, "--quiet"], 0);
        }
        assert_same(&place, &out, "whole");
    }
    assert!(interrupted > 10, "only {interrupted} of 50 runs were interrupted");
}

#[test]
fn an_incomplete_last_line_is_repaired_and_a_history_that_is_too_short_is_rejected() {
    let place = TempFolder::new("torn");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "whole"], 0);
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "torn"], 0);
    let whole = place.read("whole/history.jsonl");
    let end = whole.rfind("{\"event\":\"end\"").unwrap();
    for keep in [end, end + 10, whole.len() - 1] {
        std::fs::write(place.0.join("torn/history.jsonl"), &whole[..keep]).unwrap();
        place.run(&["resume", "torn", "--quiet"], 0);
        assert_eq!(place.read("torn/history.jsonl"), whole);
    }
    // The state refers to cycles that are not in the file.
    for keep in [0, 10, whole.len() / 2, end - 1] {
        std::fs::write(place.0.join("torn/history.jsonl"), &whole[..keep]).unwrap();
        assert!(place.run(&["resume", "torn", "--quiet"], 1).contains("history.jsonl is not the history of the state"));
        assert_eq!(place.read("torn/history.jsonl"), whole[..keep]);
    }
}

/// A limit on the size of files acts as a full disk: the first writes succeed, a later one fails.
#[cfg(target_os = "linux")]
#[test]
fn on_a_full_disk_earlier_cycles_are_kept_and_the_message_says_what_to_do() {
    let place = TempFolder::new("full");
    place.example("cantilever");
    place.run(&["optimize", "cantilever.toml", "--quiet", "--out", "whole"], 0);
    // Blocks of 512 or 1024 bytes, as the shell has it; the state grows with the history.
    let script = format!(
        "trap '' XFSZ; ulimit -f 40; exec {} optimize cantilever.toml --quiet --out cut",
        env!("CARGO_BIN_EXE_linkwright")
    );
    let output = Command::new("sh").args(["-c", &script]).current_dir(&place.0).output().unwrap();
    let shown = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{shown}");
    assert!(shown.starts_with("error: cannot write cut/"), "{shown}");
    assert!(shown.contains("earlier cycles are kept") && shown.contains("`linkwright resume cut`"), "{shown}");
    assert!(shown.contains("File too large"), "{shown}");
    let before: usize = place.read("cut/cycles.csv").lines().count();
    assert!(before > 2, "{before} lines of cycles.csv");
    assert!(
        std::fs::read_dir(place.0.join("cut")).unwrap().all(|f| f.unwrap().path().extension() != Some("part".as_ref()))
    );
    assert!(place.run(&["runs", "cut"], 0).contains("Interrupted"));
    place.run(&["resume", "cut", "--quiet"], 0);
    assert_same(&place, "cut", "whole");
}

#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let place = TempFolder::new("readonly");
    place.example("two-bar-truss");
    std::fs::write(place.0.join("file"), "").unwrap();
    let shown = place.run(&["optimize", "two-bar-truss.toml", "--out", "file/runs"], 1);
    assert!(shown.contains("cannot make the folder file/runs"), "{shown}");
    // No user may write to this folder.
    if cfg!(target_os = "linux") {
        let shown = place.run(&["optimize", "two-bar-truss.toml", "--out", "/proc/sys"], 1);
        assert!(shown.contains("cannot write /proc/sys/") && shown.contains("give a folder"), "{shown}");
    }
}

#[test]
fn two_processes_do_not_run_in_one_folder() {
    let place = TempFolder::new("twice");
    place.example("two-bar-truss");
    place.run(&["optimize", "two-bar-truss.toml", "--quiet", "--out", "one"], 0);
    let lock = std::fs::File::open(place.0.join("one/run.lock")).unwrap();
    lock.lock().unwrap();
    assert!(place.run(&["resume", "one"], 1).contains("another process runs in one"));
    assert!(place.run(&["runs", "."], 0).contains("Running"));
    lock.unlock().unwrap();
    place.run(&["resume", "one", "--quiet"], 0);
}

/// Ctrl-C ends a run with exit code 130 after saying how to go on, and the run goes on.
#[cfg(unix)]
#[test]
fn a_run_that_is_interrupted_says_how_to_go_on() {
    use std::io::Read;
    let place = TempFolder::new("interrupt");
    place.run(&["new", "lift", "-q"], 0);
    // So many steps that the run lasts far longer than the test waits.
    let options = ["optimize", "lift", "--out", "cut", "--set", "analysis.step=1e-5"];
    let mut child = Command::new(env!("CARGO_BIN_EXE_linkwright"))
        .args(options)
        .current_dir(&place.0)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !place.0.join("cut/run.json").exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(300));
    assert!(Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap().success());
    let code = child.wait().unwrap().code();
    let mut shown = String::new();
    child.stderr.take().unwrap().read_to_string(&mut shown).unwrap();
    assert_eq!(code, Some(130), "{shown}");
    assert!(shown.contains("interrupted; `linkwright resume cut` continues the run"), "{shown}");
    assert!(place.run(&["resume", "cut", "--set", "analysis.step=0.005", "--max-cycles", "2"], 3).contains("cycle"));
}
