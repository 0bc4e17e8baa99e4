//! Cost of a run of a study compared with its analysis: `cargo bench --bench study`. `docs/scale.md` has the figures.
//!
//! The command does a study with few and with many runs; the difference of the processor times is that of the runs, with their rows and
//! tables. It is compared with the analyses alone, or the optimizations alone, in this process.

#[path = "cpu/mod.rs"]
mod cpu;

use linkwright::model_file::read;
use std::path::Path;
use std::process::Command;

/// Model, study, numbers of runs; true if a run is an optimization.
const STUDIES: [(&str, &str, [usize; 2], bool); 3] = [
    ("two-bar-truss", "kind = \"sample\"\n[vary.area]\n[vary.span]\n", [10_000, 210_000], false),
    (
        "impact-absorber",
        "kind = \"sample\"\n[vary.k]\nfrom = 0.1\nto = 1.0\n[vary.c]\nfrom = 0.1\nto = 1.0\n",
        [500, 5_500],
        false,
    ),
    (
        "impact-absorber-formula",
        "kind = \"multi-start\"\n[vary.k]\nfrom = 0.1\nto = 1.0\n[vary.c]\nfrom = 0.1\nto = 0.5\n",
        [20, 220],
        true,
    ),
];

/// Processor time of the children that have ended, in s.
fn children() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").expect("the system is Linux");
    let fields: Vec<&str> = stat.rsplit_once(") ").expect("a name in parentheses").1.split(' ').collect();
    // cutime and cstime, in units of 10 ms.
    [13, 14].map(|k: usize| fields[k].parse::<f64>().expect("a number")).iter().sum::<f64>() / 100.0
}

fn of_command(place: &Path, model: &str, study: &str, count: usize) -> f64 {
    let name = format!("{model}-{count}");
    let text = format!("version = 1\nmodel = \"{model}.toml\"\ncount = {count}\n{study}");
    std::fs::write(place.join(format!("{name}.toml")), text).expect("the folder can be written to");
    let before = children();
    let mut command = Command::new(env!("CARGO_BIN_EXE_linkwright"));
    command.args(["study", &name, "--quiet", "--force", "--out", &name]).current_dir(place);
    assert!(command.status().expect("the program starts").success());
    children() - before
}

fn alone(model: &str, text: &str, is_optimization: bool) -> f64 {
    let model = read(model, text).expect("the example is good");
    let problem = model.problem().expect("the example is good");
    let design = problem.start();
    cpu::least(5, || {
        if is_optimization {
            model.method().solve(&problem, |_| ()).expect("it runs").evaluation.objective
        } else {
            problem.analyze_design(&design).expect("it runs").evaluation.objective
        }
    })
}

fn main() {
    let place = std::env::temp_dir().join(format!("linkwright-bench-study-{}", std::process::id()));
    std::fs::create_dir_all(&place).expect("the folder can be made");
    println!("{:<26}{:>16}{:>16}{:>10}", "model", "µs per run", "µs alone", "ratio");
    for (model, study, [few, many], is_optimization) in STUDIES {
        let file = format!("{}/examples/models/{model}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(file).expect("the example exists");
        std::fs::write(place.join(format!("{model}.toml")), &text).expect("the folder can be written to");
        let spent = [few, many].map(|count| of_command(&place, model, study, count));
        let run = (spent[1] - spent[0]) / (many - few) as f64;
        let alone = alone(model, &text, is_optimization);
        println!("{model:<26}{:>16.1}{:>16.1}{:>10.2}", 1e6 * run, 1e6 * alone, run / alone);
    }
    drop(std::fs::remove_dir_all(&place));
}
