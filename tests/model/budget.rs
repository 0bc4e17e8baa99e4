//! Estimates of memory before the work, compared with measured peaks: `cargo test --test model estimates -- --nocapture` prints both.
#![cfg(all(feature = "cli", target_os = "linux"))]

use crate::peak::peak;
use crate::shell::TempFolder;

/// A sum of squares over time with derivatives that are not zero: links of a chain of n variables (Rosenbrock's function).
fn chain(n: usize, points: usize, preset: &str) -> String {
    let start = |k: usize| if k.is_multiple_of(2) { -1.2 } else { 1.0 };
    let variables: String =
        (0..n).map(|k| format!("[design.a{k}]\nstart = {}\nlower = -3.0\nupper = 3.0\n", start(k))).collect();
    let link = |k: usize| {
        format!(
            "[[output]]\nname = \"p{k}\"\nvalue = \"10*(a{}-a{k}^2)*(1+0.1*time)\"\n\
             [[output]]\nname = \"q{k}\"\nvalue = \"(1-a{k})*(1+0.1*time)\"\n",
            k + 1
        )
    };
    let outputs: String = (0..n - 1).map(link).collect();
    let sum: Vec<String> = (0..n - 1).map(|k| format!("p{k}^2 + q{k}^2")).collect();
    let sum = sum.join(" + ");
    format!(
        "version = 2\ntitle = \"chain\"\n{variables}[time]\nto = 1.0\npoints = {points}\n{outputs}[objective]\nminimize = \"{sum}\"\n\
         over = \"mean\"\n[[constraint]]\nname = \"first\"\nvalue = \"q0\"\nat_most = 5.0\n[method]\npreset = \"{preset}\"\n"
    )
}

/// Functions of n variables over time, each with a limit.
fn histories(n: usize, points: usize) -> String {
    let variables: String = (0..n).map(|k| format!("[design.a{k}]\nstart = 1.0\nlower = 0.1\nupper = 3.0\n")).collect();
    let history = |k: usize| {
        let terms: Vec<String> = (0..n).map(|j| format!("a{j}^2*cos({}*time)", j + k)).collect();
        format!(
            "[[output]]\nname = \"f{k}\"\nvalue = \"{}\"\n[[constraint]]\nname = \"c{k}\"\nvalue = \"f{k}\"\nat_most = {}.0\n",
            terms.join(" + "),
            n + 10
        )
    };
    let outputs: String = (0..5).map(history).collect();
    let sum: Vec<String> = (0..n).map(|k| format!("a{k}^2 + 1/a{k}")).collect();
    format!(
        "version = 2\ntitle = \"histories\"\n{variables}[time]\nto = 3.0\npoints = {points}\n{outputs}[objective]\n\
         minimize = \"{}\"\n[method]\npreset = \"automatic\"\n",
        sum.join(" + ")
    )
}

/// The estimate in bytes that the command states if its budget is too small.
fn estimate(place: &TempFolder, arguments: &[&str]) -> u64 {
    let shown = place.run(&[arguments, &["--memory", "1k"]].concat(), 1);
    let (_, rest) = shown.split_once("about ").unwrap_or_else(|| panic!("{shown}"));
    let mut words = rest.split_whitespace();
    let number: u64 = words.next().unwrap().parse().unwrap();
    number
        * [("kB", 1000), ("MB", 1_000_000), ("GB", 1_000_000_000)]
            .into_iter()
            .find(|(unit, _)| words.clone().next() == Some(*unit))
            .unwrap()
            .1
}

#[test]
fn estimates_of_memory_are_between_the_peak_and_a_few_times_the_peak() {
    let place = TempFolder::new("memory");
    std::fs::write(place.0.join("small.toml"), chain(2, 3, "automatic")).unwrap();
    let base = peak(&["optimize", "small.toml", "--max-cycles", "1", "--out", "small"], &place.0);
    let optimize = |cycles| vec!["optimize", "m.toml", "--out", "out", "--force", "--quiet", "--max-cycles", cycles];
    let cases = [
        (chain(10, 120, "automatic"), optimize("40")),
        (chain(40, 20, "automatic"), optimize("3")),
        (histories(20, 4000), optimize("6")),
        (chain(10, 300, "slp"), optimize("6")),
        (chain(10, 100, "gcmma"), optimize("6")),
        (chain(10, 300, "multipoint"), optimize("6")),
        (chain(10, 300, "hessian"), optimize("3")),
        (chain(10, 3000, "slp"), vec!["sensitivities", "m.toml", "--out", "here"]),
        (chain(10, 3000, "slp"), vec!["analyze", "m.toml", "--out", "here"]),
    ];
    for (text, arguments) in cases {
        std::fs::write(place.0.join("m.toml"), &text).unwrap();
        let estimate = estimate(&place, &arguments) as f64 / 1e6;
        let peak = peak(&arguments, &place.0).saturating_sub(base) as f64 / 1e6;
        let method = text.lines().last().unwrap();
        println!(
            "{method:<24} {:<14} estimate {estimate:>6.0} MB, peak {peak:>6.1} MB above {:.0} MB",
            arguments[0],
            base as f64 / 1e6
        );
        assert!(peak <= 1.1 * estimate + 4.0 && estimate <= 6.0 * peak + 4.0, "{method} {arguments:?}");
    }
}

/// Every command that analyses a model refuses what exceeds its budget, before it writes anything.
#[test]
fn every_command_that_analyses_has_a_budget() {
    let place = TempFolder::new("budgets");
    std::fs::write(place.0.join("m.toml"), chain(10, 300, "slp")).unwrap();
    let objective = chain(10, 300, "slp");
    let simulation: String = objective.split("[objective]").next().unwrap().to_owned();
    std::fs::write(place.0.join("simulation.toml"), simulation).unwrap();
    let study = "version = 1\nmodel = \"m.toml\"\nkind = \"sample\"\ncount = 1000\n[vary.a0]\n";
    std::fs::write(place.0.join("study.toml"), study).unwrap();
    place.run(&["optimize", "m.toml", "--max-cycles", "1", "--out", "done"], 3);
    for arguments in [
        &["optimize", "m.toml", "--out", "o"][..],
        &["resume", "done"],
        &["analyze", "m.toml", "--out", "o"],
        &["analyze", "simulation.toml", "--out", "o"],
        &["sensitivities", "m.toml", "--out", "o"],
        &["check", "m.toml", "--out", "o"],
        &["compare", "m.toml", "--out", "o"],
        &["report", "done", "--out", "o"],
        &["report", "done", "done", "--out", "o"],
        &["study", "study.toml", "--out", "o"],
    ] {
        let shown = place.run(&[arguments, &["--memory", "10k"]].concat(), 1);
        for word in ["of memory are needed", "budget of 10 kB", "give --memory"] {
            assert!(shown.contains(word), "{arguments:?}: {shown}");
        }
        assert!(!place.0.join("o").exists(), "{arguments:?}");
    }
    // The rows of a study have the same budget.
    let shown = place.run(&["study", "study.toml", "--out", "o", "--memory", "200M", "--set", "time.points=3"], 0);
    assert!(!shown.contains("budget"), "{shown}");
    std::fs::write(place.0.join("study.toml"), study.replace("1000", "5000000")).unwrap();
    let shown = place.run(&["study", "study.toml", "--out", "p"], 1);
    assert!(shown.contains("for the rows of 5000000 runs") && shown.contains("budget of 2 GB"), "{shown}");
    // A part has its own rows only.
    std::fs::write(place.0.join("study.toml"), study.replace("1000", "10000000")).unwrap();
    let shown = place.run(&["study", "study.toml", "--part", "1/2", "--out", "p", "--memory", "200M"], 1);
    assert!(shown.contains("for the rows of 5000000 runs") && shown.contains("parts (--part 1/4)"), "{shown}");
    // Runs of a model without an objective are simulations.
    std::fs::write(place.0.join("study.toml"), study.replace("m.toml", "simulation.toml")).unwrap();
    let shown = place.run(&["study", "study.toml", "--out", "p", "--memory", "10k"], 1);
    assert!(shown.contains("values of responses") && shown.contains("budget of 10 kB"), "{shown}");
    assert!(!place.0.join("p").exists());
}

/// A study of analyses needs the memory of analyses, one with derivatives that of some derivatives, one of optimizations that of optimizations.
#[test]
fn a_study_needs_the_memory_of_its_runs() {
    let place = TempFolder::new("study-memory");
    std::fs::write(place.0.join("m.toml"), chain(40, 200, "automatic")).unwrap();
    let study = |kind: &str| format!("version = 1\nmodel = \"m.toml\"\nkind = \"{kind}\"\ncount = 2\n[vary.a0]\n");
    let mut found = vec![];
    for kind in ["sample", "tolerance", "multi-start"] {
        let spread = if kind == "tolerance" { "deviation = 0.1\n" } else { "" };
        std::fs::write(place.0.join("s.toml"), study(kind) + spread).unwrap();
        found.push(estimate(&place, &["study", "s.toml", "--out", "o"]));
    }
    let analysis = estimate(&place, &["analyze", "m.toml"]);
    let optimization = estimate(&place, &["optimize", "m.toml"]);
    assert_eq!((found[0], found[2]), (analysis, optimization));
    assert!(found[0] <= found[1] && found[1] < found[2] / 10, "{found:?}");
}
