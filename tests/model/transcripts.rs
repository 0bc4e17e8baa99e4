//! The transcripts of the pages in `docs/howto`, `docs/models` and `docs/theory`: every `$ linkwright …` prints the lines below it.
//!
//! With `UPDATE_DOCS=1` they are written anew.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright, messages, text};
use std::path::PathBuf;

/// The command whose tables have a test of their own, because they take long and rounding errors differ between machines.
const COMPARISON: &str = "compare ";

fn pages() -> Vec<PathBuf> {
    let folders =
        ["docs/howto", "docs/models", "docs/theory"].map(|folder| format!("{}/{folder}", env!("CARGO_MANIFEST_DIR")));
    let files = folders.into_iter().flat_map(|folder| std::fs::read_dir(folder).unwrap());
    let mut pages: Vec<PathBuf> = files.map(|file| file.unwrap().path()).collect();
    pages.retain(|path| path.extension().is_some_and(|extension| extension == "md"));
    pages.sort();
    pages
}

/// The example models, and the files that the pages derive from them.
fn prepare(place: &TempFolder) {
    for item in std::fs::read_dir(format!("{}/examples/models", env!("CARGO_MANIFEST_DIR"))).unwrap() {
        let path = item.unwrap().path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            std::fs::copy(&path, place.0.join(path.file_name().unwrap())).unwrap();
        }
    }
    let absorber = place.read("impact-absorber.toml");
    let coarse = absorber.replace("points = 101", "points = 25");
    let continuous = coarse.replacen("at_most = 1.0\n", "at_most = 1.0\ncontinuous = true\n", 1);
    let page = std::fs::read_to_string(format!("{}/docs/howto/rms.md", env!("CARGO_MANIFEST_DIR"))).unwrap();
    let listing = page.split("```toml\n").nth(1).unwrap().split("```").next().unwrap();
    let crank = |values: &str| format!("m = {{ start = {values}");
    let long_crank = place.read("walking-leg.toml").replacen(
        &crank("0.150, lower = 0.1455, upper = 0.1545"),
        &crank("0.6, lower = 0.1455, upper = 0.6"),
        1,
    );
    for (name, model) in [
        ("coarse", &coarse),
        ("continuous", &continuous),
        ("absorber-rms", &format!("{absorber}\n{listing}")),
        ("long-crank", &long_crank),
    ] {
        std::fs::write(place.0.join(format!("{name}.toml")), model).unwrap();
    }
}

/// The text with the same date everywhere.
fn undated(text: &str) -> String {
    let is_date = |word: &str| word.len() >= 20 && word.starts_with("20") && word[..20].ends_with('Z');
    let words = text
        .split(' ')
        .map(|word| if is_date(word) { format!("2026-11-22T21:07:09Z{}", &word[20..]) } else { word.to_owned() });
    words.collect::<Vec<_>>().join(" ")
}

/// A transcript with the output that its commands have now.
fn again(transcript: &str, place: &TempFolder) -> String {
    let mut new = String::new();
    let mut is_kept = true;
    for line in transcript.lines() {
        let Some(command) = line.strip_prefix("$ linkwright ") else {
            if is_kept {
                new += &format!("{line}\n");
            }
            continue;
        };
        new += &format!("{line}\n");
        is_kept = command.starts_with(COMPARISON);
        if !is_kept {
            let output = linkwright(&command.split_whitespace().collect::<Vec<_>>(), &place.0);
            new += &undated(&(text(&output.stdout) + &messages(&output.stderr)));
        }
    }
    new
}

#[test]
fn the_transcripts_of_the_pages_are_those_of_the_commands() {
    let place = TempFolder::new("transcripts");
    let mut commands = 0;
    for path in pages() {
        drop(std::fs::remove_dir_all(place.0.join("out")));
        prepare(&place);
        let page = std::fs::read_to_string(&path).unwrap();
        let mut parts = page.split("```console\n");
        let mut new = parts.next().unwrap().to_owned();
        for part in parts {
            let (transcript, rest) = part.split_once("```").unwrap();
            commands += transcript.matches("$ linkwright").count();
            new += &format!("```console\n{}```{rest}", again(transcript, &place));
        }
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::write(&path, new).unwrap();
        } else {
            assert!(page == new, "{}: run this test with UPDATE_DOCS=1 and read the difference\n{new}", path.display());
        }
    }
    assert!(commands > 5, "{commands} commands");
}

/// Ends of runs, as `compare` writes them.
const ENDS: [&str; 4] = ["converged", "cycle limit", "stalled", "infeasible"];

/// A row of a table of `compare`.
#[derive(Debug)]
struct Row {
    /// Method, end, cycles and analyses, which are the same on all machines.
    counts: Vec<String>,
    /// Objective, its distance above the best, violation and residual, which have rounding errors.
    numbers: Vec<f64>,
}

impl Row {
    /// Numbers agree to 1e-3, or to the 1e-6 up to which a run of another machine may have another rounding error.
    fn is_alike(&self, other: &Self) -> bool {
        let are_close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-3 * a.abs() + 1e-6;
        self.counts == other.counts
            && self.numbers.len() == other.numbers.len()
            && self.numbers.iter().zip(&other.numbers).all(are_close)
    }
}

fn rows(table: &str) -> Vec<Row> {
    let of_row = |line: &str| -> Option<Row> {
        let (end, start) = ENDS.iter().find_map(|end| Some((end, line.find(&format!(" {end} "))?)))?;
        let columns: Vec<&str> = line[start..].trim_start().strip_prefix(end)?.split_whitespace().collect();
        let (counts, numbers) = columns.split_at_checked(3)?;
        let counts = [line[..start].trim(), end].into_iter().chain(counts.iter().copied()).map(str::to_owned);
        let numbers = numbers.iter().map(|number| number.parse().ok()).collect::<Option<Vec<f64>>>()?;
        Some(Row { counts: counts.collect(), numbers })
    };
    table.lines().filter_map(of_row).collect()
}

/// With `UPDATE_DOCS=1` the tables are written anew.
#[test]
fn the_comparisons_of_the_pages_are_those_of_the_methods() {
    let place = TempFolder::new("comparisons");
    prepare(&place);
    let mut tables = 0;
    for path in pages() {
        let page = std::fs::read_to_string(&path).unwrap();
        let mut new = page.clone();
        for transcript in page.split("```console\n").skip(1).map(|part| part.split("```").next().unwrap()) {
            for part in transcript.split("$ linkwright ").filter(|part| part.starts_with(COMPARISON)) {
                let (command, table) = part.split_once('\n').unwrap();
                let now = place.run(&command.split_whitespace().collect::<Vec<_>>(), 0);
                if std::env::var_os("UPDATE_DOCS").is_none() {
                    let [page, now] = [table, &now].map(rows);
                    let are_alike =
                        page.len() == now.len() && page.iter().zip(&now).all(|(page, now)| page.is_alike(now));
                    assert!(!page.is_empty() && are_alike, "{}: {command}: {page:?} {now:?}", path.display());
                }
                new = new.replacen(table, &now, 1);
                tables += 1;
            }
        }
        if std::env::var_os("UPDATE_DOCS").is_some() {
            std::fs::write(&path, new).unwrap();
        }
    }
    assert!(tables >= 2, "{tables}");
}

/// The counts of analyses in the table of the models are those of runs with default settings.
#[test]
fn the_models_need_as_many_analyses_as_their_table_says() {
    let place = TempFolder::new("counts");
    prepare(&place);
    let root = env!("CARGO_MANIFEST_DIR");
    let index = std::fs::read_to_string(format!("{root}/docs/models/index.md")).unwrap();
    let mut rows = 0;
    for row in index.lines().filter(|line| line.starts_with("| [")) {
        let page = row.split("](").nth(1).unwrap().split(')').next().unwrap();
        let text = std::fs::read_to_string(format!("{root}/docs/models/{page}")).unwrap();
        let files = text.split("`examples/models/").skip(1).map(|rest| rest.split('`').next().unwrap());
        let counts: Vec<String> = files
            .map(|file| {
                let output = linkwright(&["optimize", file, "--force", "--json"], &place.0);
                let end: serde_json::Value = serde_json::from_slice(
                    output.stdout.split(|b| *b == b'\n').rfind(|line| !line.is_empty()).unwrap(),
                )
                .unwrap();
                assert_eq!(end["status"], "Converged", "{file}");
                end["analyses"].to_string()
            })
            .collect();
        assert_eq!(row.rsplit('|').nth(1).unwrap().trim(), counts.join(", "), "{page}");
        rows += 1;
    }
    assert!(rows >= 12, "{rows}");
}
