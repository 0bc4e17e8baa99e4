//! The arrows of the house point down: reads the `use crate::…` lines and fails on an upward one.

use std::path::{Path, PathBuf};

/// Floors from the ground up; a module may use modules of lower floors, and of its own folder.
const FLOORS: &[&[&str]] = &[
    &["error"],
    &["scalar", "linalg"],
    &["problem", "multibody"],
    &["approximation", "analysis"],
    &["subproblem", "sensitivity"],
    &["sao"],
    &["library"],
    &["report"],
    &["papers", "model"],
    &["cli"],
];

/// Modules of the two wings, which never use each other.
const PHYSICS: &[&str] = &["multibody", "analysis", "sensitivity"];
const OPTIMIZATION: &[&str] = &["approximation", "subproblem"];

fn floor(module: &str) -> usize {
    let found = FLOORS.iter().position(|modules| modules.contains(&module));
    found.unwrap_or_else(|| panic!("module `{module}` has no floor: add it to FLOORS"))
}

fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, found);
        } else if path.extension().is_some_and(|e| e == "rs") {
            found.push(path);
        }
    }
}

/// The top-level modules that a source file uses, from `crate::NAME` outside of comments and tests.
fn used(text: &str) -> Vec<String> {
    let code = text.split("#[cfg(test)]").next().unwrap();
    let lines = code.lines().filter(|l| !l.trim_start().starts_with("//"));
    let names = lines.flat_map(|l| {
        l.match_indices("crate::").map(|(at, m)| {
            let rest = &l[at + m.len()..];
            rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>()
        })
    });
    names.filter(|n| FLOORS.iter().any(|f| f.contains(&n.as_str()))).collect()
}

#[test]
fn arrows_point_down_and_the_wings_stay_apart() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = vec![];
    sources(&root, &mut files);
    let mut upward = vec![];
    for file in files {
        let relative = file.strip_prefix(&root).unwrap();
        let first = relative.components().next().unwrap().as_os_str().to_string_lossy();
        let module = first.trim_end_matches(".rs").to_owned();
        if module == "lib" || module == "main" {
            continue;
        }
        for target in used(&std::fs::read_to_string(&file).unwrap()) {
            let across = |a: &[&str], b: &[&str]| a.contains(&module.as_str()) && b.contains(&target.as_str());
            let apart = across(PHYSICS, OPTIMIZATION) || across(OPTIMIZATION, PHYSICS);
            if (target != module && floor(&target) >= floor(&module)) || apart {
                upward.push(format!("{} uses crate::{target}", relative.display()));
            }
        }
    }
    assert!(upward.is_empty(), "arrows that point up or across:\n{}", upward.join("\n"));
}
