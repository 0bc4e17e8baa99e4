//! Fault injection: every operation on a file of a study fails once, alone or together with all that follow it, as in a kill or on a full
//! disk. Afterwards the same command continues the study to the same bytes.

use super::{Shown, StudyFolder};
use crate::command::faults::{Fault, Files, Place, watch};
use linkwright::storage::Directory;
use linkwright::study::{ModelSource, Part, Study, StudyFile};

/// Files that are equal for a study with and without faults: all files without a date.
const FILES: [&str; 5] = ["rows.jsonl", "runs.csv", "summary.csv", "summary.json", "report.html"];

fn study() -> Study {
    let model = "version = 2\n[design.width]\nstart = 3.0\n[[output]]\nname = \"stress\"\nvalue = \"1/width\"\n";
    let file = "version = 1\nmodel = \"m.toml\"\nkind = \"grid\"\n[vary.width]\nfrom = 1\nto = 2\npoints = 5\n";
    let source = ModelSource { name: "m.toml".to_owned(), text: model.to_owned(), programs: None };
    Study::new(StudyFile::read("s.toml", file).unwrap(), &source).unwrap()
}

/// Begins or continues the study in a folder, with one thread.
fn run(directory: Directory) -> anyhow::Result<()> {
    let study = study();
    let (folder, rows) = StudyFolder::open(directory, &study, Part::WHOLE, "s.toml", false)?;
    let shown = Shown { jobs: Some(1), json: false, quiet: true };
    shown.run(&study, folder, rows, Part::WHOLE).map(drop)
}

fn undisturbed() -> (Files, usize) {
    let place = Place::new("study-undisturbed");
    let (watch, log) = watch(Fault::None);
    run(place.directory(&watch)).unwrap();
    let count = log.lock().unwrap().len();
    (place.files("."), count)
}

#[test]
fn every_operation_of_a_study_fails_once() {
    let (expected, count) = undisturbed();
    for number in 0..count {
        for fault in [Fault::Once(number), Fault::From(number)] {
            let place = Place::new("study-fault");
            let (faulty, log) = watch(fault);
            let ended = run(place.directory(&faulty));
            let what = format!("{fault:?}: {:?}", log.lock().unwrap().get(number));
            let reason = ended.as_ref().map_or_else(|error| format!("{error:#}"), |()| String::new());
            assert!(ended.is_ok() || reason.len() > 20, "{what}: {reason}");
            assert!(matches!(fault, Fault::Once(_)) || ended.is_err(), "{what}: a process without files succeeded");
            run(place.directory(&watch(Fault::None).0))
                .unwrap_or_else(|error| panic!("{what} ({reason}), then {error:#}"));
            let found = place.files(".");
            for file in FILES {
                assert!(found.get(file) == expected.get(file), "{file} after {what} ({reason})");
            }
            let left: Vec<_> = found.keys().filter(|name| !expected.contains_key(*name)).collect();
            assert!(left.is_empty(), "{left:?} after {what}");
        }
    }
    println!("{count} operations of a study");
    assert!(count > 20, "{count}");
}
