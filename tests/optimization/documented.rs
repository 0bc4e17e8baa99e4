//! Tables of `docs/choosing.md`: each is computed by a test, and `UPDATE_DOCS=1 cargo test --test optimization` rewrites those that differ.

use linkwright::cases::{Attempt, Conclusion, attempt_with, find, slider_crank};
use linkwright::sao::{preset, presets};
use std::fmt::Write;
use std::sync::Mutex;

const PAGE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/choosing.md");
/// Tests run in parallel, and each may rewrite its table.
static WRITING: Mutex<()> = Mutex::new(());

/// Compares the part of the page between the comments `<!-- table: NAME -->` and `<!-- end of table -->` with `text`, or rewrites it.
#[track_caller]
pub fn assert_table(name: &str, text: &str) {
    let _alone = WRITING.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let page = std::fs::read_to_string(PAGE).unwrap();
    let (begin, end) = (format!("<!-- table: {name} -->\n"), "<!-- end of table -->");
    let from = page.find(&begin).unwrap_or_else(|| panic!("docs/choosing.md has no table `{name}`")) + begin.len();
    let to = from + page[from..].find(end).expect("each table has an end");
    let text = format!("{}\n", text.trim_end());
    if page[from..to] == text {
        return;
    }
    assert!(std::env::var_os("UPDATE_DOCS").is_some(), "run with UPDATE_DOCS=1 to rewrite the table `{name}`:\n{text}");
    std::fs::write(PAGE, format!("{}{text}{}", &page[..from], &page[to..])).unwrap();
}

/// `text` as a code block.
pub fn code_block(text: &str) -> String {
    format!("```text\n{}\n```", text.trim_end())
}

/// Work to the known optimum of a run that converges to it.
fn work(a: &Attempt) -> Option<[usize; 2]> {
    let reached = matches!(a.conclusion, Conclusion::Reached(_));
    a.to_optimum.filter(|_| reached).map(|w| [w.analyses, w.sensitivity_analyses])
}

/// Least work of all methods on problems for which the work of other programs is known.
pub fn least_work(columns: &[Vec<Attempt>]) -> String {
    const PEERS: [(&str, &str); 6] = [
        ("impact-absorber", "SLSQP 5+4"),
        ("impact-absorber-comfort", "Gauss–Newton SQP 7+5, SLSQP 10+9"),
        ("cantilever", "mmapy 6+5"),
        ("two-bar-truss", "IPOPT 5+4"),
        ("quadratic-forms-1", ""),
        ("quadratic-forms-2", ""),
    ];
    let mut text = "| problem | least work | presets | other programs, as measured |\n|---|---|---|---|\n".to_owned();
    for (name, others) in PEERS {
        let runs = columns.iter().flatten().filter(|a| a.problem == name);
        let done: Vec<([usize; 2], &str)> = runs.filter_map(|a| Some((work(a)?, a.method))).collect();
        let least = done.iter().map(|(w, _)| w[0] + w[1]).min().expect("a method reaches the optimum");
        let best: Vec<_> = done.iter().filter(|(w, _)| w[0] + w[1] == least).collect();
        let names: Vec<String> = best.iter().map(|(_, method)| format!("`{method}`")).collect();
        writeln!(text, "| {name} | {}+{} | {} | {others} |", best[0].0[0], best[0].0[1], names.join(", ")).unwrap();
    }
    text
}

#[test]
fn the_slider_crank_from_random_starts_is_as_documented() {
    const METHODS: [&str; 9] = [
        "slp-filter",
        "conlin",
        "linear-conservative",
        "slp",
        "reciprocal",
        "gcmma",
        "mma-filtered",
        "quadratic-mma",
        "mma",
    ];
    assert!(METHODS.iter().all(|name| presets().iter().any(|p| p.name == *name)));
    let optima = find("slider-crank").unwrap().optima();
    let starts = slider_crank::random_starts(1998, 16);
    let mut text = "| method | optimum reached | median work |\n|---|---|---|\n".to_owned();
    for name in METHODS {
        let mut done: Vec<[usize; 2]> = starts
            .iter()
            .filter_map(|start| {
                let problem = slider_crank::path_generation(*start).unwrap();
                let method = (preset(name).unwrap().method)();
                work(&attempt_with(&problem, &method, optima, ["slider-crank", "method"]).ok()?)
            })
            .collect();
        done.sort_unstable();
        let median = done.get(done.len() / 2).map_or("-".to_owned(), |w| format!("{}+{}", w[0], w[1]));
        writeln!(text, "| `{name}` | {} | {median} |", done.len()).unwrap();
    }
    text += "| SLSQP (other program) | 16 | 72+47 |\n| Gauss–Newton SQP (other program) | 13 | 18+11 |\n";
    assert_table("slider-crank", &text);
}
