//! The figures of `docs/scale.md`: `UPDATE_DOCS=1 cargo test --test model scale` writes its table anew.
#![cfg(all(feature = "cli", target_os = "linux"))]

use crate::peak::peak;
use crate::shell::TempFolder;

/// Studies of models in `examples/models`: what is done, quantities, and numbers of runs. The difference of the two numbers gives the cost per run.
const STUDIES: [(&str, &str, &str, [usize; 2]); 3] = [
    (
        "sample of the two-bar truss: formulas, 2 variables, 4 results",
        "two-bar-truss",
        "kind = \"sample\"\n[vary.area]\n[vary.span]\n",
        [2_000, 42_000],
    ),
    (
        "sample of the impact absorber: dynamics, 2 variables, 4 results",
        "impact-absorber",
        "kind = \"sample\"\n[vary.k]\nfrom = 0.1\nto = 1.0\n[vary.c]\nfrom = 0.1\nto = 1.0\n",
        [100, 1_100],
    ),
    (
        "starts of the impact absorber in formulas: an optimization each",
        "impact-absorber-formula",
        "kind = \"multi-start\"\n[vary.k]\nfrom = 0.1\nto = 1.0\n[vary.c]\nfrom = 0.1\nto = 0.5\n",
        [20, 220],
    ),
];

/// Number of runs from which the memory of the process shows that of the rows.
const MANY: usize = 10_000;

/// Bytes of a run: in `rows.jsonl`, in `runs.csv`, and of memory.
fn costs(place: &TempFolder, model: &str, study: &str, counts: [usize; 2]) -> [f64; 3] {
    place.example(model);
    let measured = counts.map(|count| {
        let name = format!("{model}-{count}");
        let text = format!("version = 1\nmodel = \"{model}.toml\"\ncount = {count}\n{study}");
        std::fs::write(place.0.join(format!("{name}.toml")), text).unwrap();
        let memory = peak(&["study", &name, "--quiet", "--out", &name], &place.0);
        let size = |file: &str| place.0.join(&name).join(file).metadata().unwrap().len();
        [size("rows.jsonl"), size("runs.csv"), memory].map(|bytes| bytes as f64)
    });
    let runs = (counts[1] - counts[0]) as f64;
    [0, 1, 2].map(|k| (measured[1][k] - measured[0][k]) / runs)
}

/// Sizes of files must be the documented ones to 5 %. Memory is that of the system's allocator: half to twice the documented one.
#[test]
fn sizes_of_studies_are_as_documented() {
    let place = TempFolder::new("scale");
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/scale.md");
    let page = std::fs::read_to_string(path).unwrap();
    let (begin, end) = ("<!-- sizes -->\n", "<!-- end of sizes -->");
    let (before, rest) = page.split_once(begin).unwrap();
    let (listed, after) = rest.split_once(end).unwrap();
    let mut found =
        "| study | `rows.jsonl` per run | `runs.csv` per run | memory per run |\n|---|---|---|---|\n".to_owned();
    let mut all = vec![];
    for (what, model, study, counts) in STUDIES {
        let costs = costs(&place, model, study, counts);
        let [rows, table, memory] = costs;
        let memory = if counts[1] < MANY { String::new() } else { in_words(memory) };
        found += &format!("| {what} | {rows:.0} B | {table:.0} B | {memory} |\n");
        all.push((what, costs));
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(path, format!("{before}{begin}{found}{end}{after}")).unwrap();
        return;
    }
    for (line, (what, costs)) in listed.lines().skip(2).zip(all) {
        let cells: Vec<&str> = line.split('|').skip(1).map(str::trim).collect();
        assert_eq!(cells[0], what);
        let stated = |k: usize| -> f64 {
            let (number, unit) = cells[k].split_once(' ').unwrap();
            number.parse::<f64>().unwrap() * if unit == "kB" { 1000.0 } else { 1.0 }
        };
        let limits = [[0.95, 1.05], [0.95, 1.05], [0.5, 2.0]];
        for (k, [least, most]) in limits.into_iter().enumerate().filter(|(k, _)| !cells[k + 1].is_empty()) {
            let ratio = costs[k] / stated(k + 1);
            assert!((least..=most).contains(&ratio), "{what}: {} B, documented {} B\n{found}", costs[k], stated(k + 1));
        }
    }
}

fn in_words(bytes: f64) -> String {
    if bytes < 1000.0 { format!("{bytes:.0} B") } else { format!("{:.1} kB", bytes / 1000.0) }
}
