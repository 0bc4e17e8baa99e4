//! Fault injection: every operation on a file of a run, of its continuation and of its report fails once, alone or together with all
//! that follow it, as in a kill or on a full disk.
//!
//! Afterwards the folder is readable or rejected with a reason, the run is continued to the same bits, and no file is incomplete.

use super::optimize::{Optimize, ProgressForm, Resume};
use super::report::DrawnReport;
use super::run_directory::RunDirectory;
use linkwright::model_file::{Model, read};
use linkwright::storage::{Directory, Operation, Watch};
use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// Files that are equal for a run with and without faults: all files without a date.
const FILES: [&str; 6] =
    ["state.json", "history.jsonl", "cycles.csv", "summary.json", "responses.csv", "constraints.csv"];

/// Operations that fail.
#[derive(Clone, Copy, Debug)]
enum InjectedFault {
    None,
    /// The operation of this number.
    Once(usize),
    /// The operation of this number and all later ones: the process is gone.
    From(usize),
}

/// Operations with the names of their files, in order.
type OperationLog = Arc<Mutex<Vec<(Operation, String)>>>;

/// Files of a folder by name.
type Files = BTreeMap<String, Vec<u8>>;

/// A watch that lets operations fail, and what it sees.
fn watch(fault: InjectedFault) -> (Watch, OperationLog) {
    let log = OperationLog::default();
    let seen = Arc::clone(&log);
    let watch = move |operation: Operation, name: &str| {
        let mut log = seen.lock().unwrap();
        let number = log.len();
        log.push((operation, name.to_owned()));
        let fails = match fault {
            InjectedFault::None => false,
            InjectedFault::Once(one) => number == one,
            InjectedFault::From(first) => number >= first,
        };
        if fails { Err(io::ErrorKind::StorageFull.into()) } else { Ok(()) }
    };
    (Arc::new(watch), log)
}

struct TestFolder(PathBuf);

impl TestFolder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("linkwright-faults-{name}-{}", std::process::id()));
        drop(std::fs::remove_dir_all(&path));
        std::fs::create_dir(&path).unwrap();
        Self(path)
    }

    fn directory(&self, watch: &Watch) -> Directory {
        Directory::open(&self.0).unwrap().watched(Arc::clone(watch))
    }

    fn files(&self, folder: &str) -> Files {
        let entries = std::fs::read_dir(self.0.join(folder)).into_iter().flatten().flatten();
        let files = entries.filter(|entry| entry.file_type().unwrap().is_file());
        files.map(|entry| (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())).collect()
    }
}

impl Drop for TestFolder {
    fn drop(&mut self) {
        drop(std::fs::remove_dir_all(&self.0));
    }
}

/// The model of the two-bar truss with some cycles.
fn model(cycles: usize) -> (Model, String) {
    let text = include_str!("../../examples/models/two-bar-truss.toml");
    let text = text.replace("preset = \"gcmma\"", &format!("preset = \"gcmma\"\nmax_cycles = {cycles}"));
    (read("m.toml", &text).unwrap(), text)
}

/// Begins the run in a folder without one, and continues the run of a folder.
fn run(directory: Directory, cycles: usize) -> anyhow::Result<()> {
    if directory.path().join("run.json").exists() {
        return Resume::in_directory(directory, false, None, &ProgressForm::QUIET).map(drop);
    }
    let (model, text) = model(cycles);
    Optimize::in_directory(directory, &model, &text, Path::new("m.toml"), false, &ProgressForm::QUIET).map(drop)
}

/// The run without faults, with its operations.
fn undisturbed(prepare: impl Fn(&TestFolder), cycles: usize) -> (Files, Vec<(Operation, String)>) {
    let place = TestFolder::new("undisturbed");
    prepare(&place);
    let (watch, log) = watch(InjectedFault::None);
    run(place.directory(&watch), cycles).unwrap();
    let log = log.lock().unwrap().clone();
    (place.files("."), log)
}

/// Lets every operation of a run in a prepared folder fail; returns the number of operations.
fn every_fault(name: &str, prepare: impl Fn(&TestFolder), cycles: usize) -> usize {
    let (expected, log) = undisturbed(&prepare, cycles);
    let none = watch(InjectedFault::None).0;
    for number in 0..log.len() {
        for fault in [InjectedFault::Once(number), InjectedFault::From(number)] {
            let place = TestFolder::new(name);
            prepare(&place);
            let what = format!("{fault:?}: {:?}", log[number]);
            let ended = run(place.directory(&watch(fault).0), cycles);
            let reason = ended.as_ref().map_or_else(|error| format!("{error:#}"), |()| String::new());
            assert!(ended.is_ok() || reason.len() > 20, "{what}: {reason}");
            assert!(
                matches!(fault, InjectedFault::Once(_)) || ended.is_err(),
                "{what}: a process without files succeeded"
            );
            readable(&place, &what);
            run(place.directory(&none), cycles).unwrap_or_else(|error| panic!("{what}, then {error:#}"));
            let found = place.files(".");
            for file in FILES {
                assert!(found.get(file) == expected.get(file), "{file} after {what} ({reason})");
            }
            let left: Vec<_> = found.keys().filter(|name| !expected.contains_key(*name)).collect();
            assert!(left.is_empty(), "{left:?} after {what}");
        }
    }
    log.len()
}

/// Another process reads the folder, if a run has begun in it: state, history and model.
fn readable(place: &TestFolder, what: &str) {
    if place.0.join("run.json").exists() {
        let (folder, model, _) = RunDirectory::open(&place.0).unwrap_or_else(|error| panic!("{what}: {error:#}"));
        folder.last(&model, &model.problem().unwrap()).unwrap_or_else(|error| panic!("{what}: {error:#}"));
    }
}

#[test]
fn every_operation_of_a_run_fails_once() {
    let count = every_fault("run", |_| (), 4);
    println!("{count} operations of a run");
    assert!(count > 70, "{count}");
}

#[test]
fn every_operation_of_a_continued_run_fails_once() {
    let half = TestFolder::new("half");
    run(half.directory(&watch(InjectedFault::None).0), 3).unwrap();
    let longer = |place: &TestFolder| {
        for (name, bytes) in half.files(".") {
            std::fs::write(place.0.join(&name), bytes).unwrap();
        }
        std::fs::write(place.0.join("model.toml"), model(6).1).unwrap();
    };
    let count = every_fault("resume", longer, 6);
    println!("{count} operations of a continued run");
    assert!(count > 50, "{count}");
}

#[test]
fn every_operation_of_a_report_fails_once() {
    let place = TestFolder::new("report");
    let none = watch(InjectedFault::None);
    run(place.directory(&none.0), 4).unwrap();
    let (opened, model, _) = RunDirectory::open(&place.0).unwrap();
    // Drawn once: only reading and writing fail.
    let drawn = DrawnReport::new(&opened, &model, Some(0), true).unwrap();
    let write = |fault| {
        let (watch, log) = watch(fault);
        let opened = RunDirectory::read(place.directory(&watch));
        let ended = opened.and_then(|(folder, model, text)| {
            folder.last(&model, &model.problem()?)?;
            drawn.clone().store(folder, &model, &text)
        });
        let log = log.lock().unwrap().clone();
        (ended, log)
    };
    let remove = || {
        std::fs::remove_dir_all(place.0.join("figures")).unwrap();
        std::fs::remove_file(place.0.join("report.html")).unwrap();
    };
    write(InjectedFault::None).0.unwrap();
    // The list of files has these files already.
    remove();
    let (ended, log) = write(InjectedFault::None);
    ended.unwrap();
    let (page, figures) = (place.files("."), place.files("figures"));
    for number in 0..log.len() {
        for fault in [InjectedFault::Once(number), InjectedFault::From(number)] {
            remove();
            let (ended, _) = write(fault);
            assert!(ended.is_err() || matches!(fault, InjectedFault::Once(_)), "{fault:?}: {:?}", log[number]);
            for (name, bytes) in place.files("figures") {
                let is_part = name.ends_with(".part") && matches!(fault, InjectedFault::From(_));
                assert!(
                    is_part || name == "files.json" || figures.get(&name) == Some(&bytes),
                    "half of {name}: {:?}",
                    log[number]
                );
            }
            if let (InjectedFault::Once(_), Err(error)) = (fault, &ended) {
                let is_complete = place.files(".").get("report.html").is_some_and(|bytes| !bytes.is_empty());
                let is_figure = format!("{error:#}").contains("figures");
                assert_eq!(is_complete, is_figure, "{:?}: {error:#}", log[number]);
            }
            write(InjectedFault::None).0.unwrap();
            let found = place.files("figures");
            assert!(figures.iter().all(|(name, bytes)| found.get(name) == Some(bytes)), "{:?}", log[number]);
            // A report that is killed may leave a hidden temporary file: it may belong to another report that is being written.
            let names =
                |files: &Files| files.keys().filter(|name| !name.ends_with(".part")).cloned().collect::<Vec<_>>();
            assert_eq!(names(&place.files(".")), names(&page));
        }
    }
    println!("{} operations of a report", log.len());
    assert!(log.len() > 40, "{}", log.len());
}

/// Bytes written per cycle do not grow with the number of cycles.
#[test]
fn a_cycle_writes_as_many_bytes_early_as_late() {
    let (model, text) = model(400);
    let place = TestFolder::new("pace");
    let written = Arc::new(Mutex::new(vec![]));
    let problem = model.problem().unwrap();
    let size = |name: &str| std::fs::metadata(place.0.join(name)).map_or(0, |file| file.len());
    let (watch, _) = watch(InjectedFault::None);
    let mut folder = RunDirectory::create(place.directory(&watch), &model, &text, Path::new("m.toml"), false).unwrap();
    let mut state = model.method().start(&problem).unwrap();
    for _ in 0..400 {
        let before = size("history.jsonl") + size("cycles.csv");
        folder.save(&model, &problem, &mut state).unwrap();
        let grown = size("history.jsonl") + size("cycles.csv") - before;
        written.lock().unwrap().push(grown + size("state.json") + size("summary.json"));
        // Beyond convergence, too: the steps become small, and their number does not matter.
        state = model.method().step(&problem, state).unwrap();
    }
    let written = written.lock().unwrap();
    let mean = |part: &[u64]| part.iter().sum::<u64>() as f64 / part.len() as f64;
    let (early, late) = (mean(&written[10..60]), mean(&written[350..]));
    println!("{early} bytes per cycle at first, {late} at the end");
    assert!(late < 1.2 * early, "{early} bytes per cycle at first, {late} at the end");
}
