//! Models beyond the limits are rejected before any work is done.

use linkwright::model_file::read;

const GOOD: &str = include_str!("good.toml");

/// The good file with changes.
fn changed(changes: &[[&str; 2]]) -> String {
    changes.iter().fold(GOOD.to_owned(), |text, [good, bad]| {
        assert!(text.contains(good), "`{good}` is not in the good file");
        text.replacen(good, bad, 1)
    })
}

/// One mass at so many time points, with more in the file.
fn small(points: &str, more: &str) -> String {
    format!(
        "version = 2\n[design.k]\nstart = 1\n[objective]\nminimize = \"k\"\n[[body]]\nname = \"m\"\nkind = \"slider\"\nmass = 1\n\
         [time]\nto = 1.0\npoints = {points}\n[analysis]\nkind = \"dynamics\"\nstep = 0.1\n{more}"
    )
}

fn beyond_limits() -> Vec<(&'static str, String)> {
    let number = |value: &str| changed(&[["load = 2.0", &format!("load = {value}")]]);
    let ladder: String = (1..200).map(|k| format!("e{k} = \"e{}\"\n", k - 1)).collect();
    let variables: String = (0..20_000).map(|k| format!("[design.a{k}]\nstart=1\n")).collect();
    let many = |what: &str| format!("[[{what}]]\neach = {{ i = \"1..5000\" }}\n");
    vec![
        ("a long file", "# ".to_owned() + &"x".repeat(2 << 20)),
        ("lists inside each other", "version = 2\na = ".to_owned() + &"[".repeat(100_000) + &"]".repeat(100_000)),
        (
            "tables inside each other",
            "version = 2\na = ".to_owned() + &"{a=".repeat(50_000) + "1" + &"}".repeat(50_000),
        ),
        ("a deep key", "version = 2\n[".to_owned() + &"a.".repeat(50_000) + "a]\n"),
        ("deep parentheses", number(&format!("\"{}1{}\"", "(".repeat(1000), ")".repeat(1000)))),
        ("many signs", number(&format!("\"{}1\"", "-".repeat(1000)))),
        ("many powers", number(&format!("\"2{}\"", "^2".repeat(1000)))),
        ("a long expression", number(&format!("\"1{}\"", "+1".repeat(10_000)))),
        ("a huge whole number", number(&"9".repeat(400))),
        ("a huge number", number("1e400")),
        ("a huge power", number("\"10^10^10\"")),
        ("a huge result", number("\"exp(1e6)\"")),
        (
            "expressions upon each other",
            changed(&[["[expressions]\n", &format!("[expressions]\ne0 = \"1\"\n{ladder}")]]),
        ),
        (
            "a circle of expressions",
            changed(&[["[expressions]\n", "[expressions]\na = \"b\"\nb = \"c\"\nc = \"a\"\n"]]),
        ),
        ("too many variables", format!("version = 2\n{variables}")),
        ("a billion time points", changed(&[["points = 11", "points = 1000000000"]])),
        ("a whole number beyond all", changed(&[["points = 11", "points = 99999999999999999999"]])),
        ("a billion bodies", changed(&[["name = \"cart\"", "each = { i = \"1..1000000000\" }\nname = \"cart{i}\""]])),
        (
            "copies of copies",
            changed(&[[
                "name = \"cart\"",
                "each = { i = \"1..999\", j = \"1..999\", k = \"1..999\" }\nname = \"c{i}_{j}_{k}\"",
            ]]),
        ),
        ("a billion elements", changed(&[["elements = 2", "elements = 1000000000"]])),
        (
            "elements of many beams",
            changed(&[["elements = 2", "elements = 1000"]])
                + &many("beam")
                + "name = \"s{i}\"\nelements = 1000\nfrom = [0, 0]\nto = [1, 0]\ndiameter = 1\nyoung = 1\ndensity = 1\n",
        ),
        (
            "outputs at many time points",
            small("100000", &(many("output") + "name = \"o{i}\"\nvalue = \"m.position\"\n")),
        ),
        ("a trillion steps", changed(&[["step = 1e-2", "step = 1e-12"]])),
        (
            "steps of many bodies",
            changed(&[["step = 1e-2", "step = 1e-5"]])
                + &many("body")
                + "name = \"p{i}\"\nkind = \"point\"\nmass = 1\nposition = [0, 0]\n",
        ),
        ("an endless tolerance", changed(&[["step = 1e-2", "tolerance = 1e-300"]])),
        ("a billion cycles", changed(&[["preset = \"slp\"", "preset = \"slp\"\nmax_cycles = 1000000000"]])),
    ]
}

#[test]
fn models_beyond_the_limits_are_rejected() {
    let mut all = String::new();
    for (what, text) in beyond_limits() {
        let begun = std::time::Instant::now();
        let Err(report) = read("model.toml", &text) else { panic!("{what}: the file was read") };
        assert!(begun.elapsed().as_secs() < 10, "{what} took {:?}", begun.elapsed());
        let report = report.to_string();
        assert!(report.len() < 4000, "{what}: a report of {} bytes", report.len());
        all += &format!("## {what}\n{report}\n\n");
    }
    insta::assert_snapshot!("limits", all);
    assert!(peak_memory() < 1 << 30, "{} bytes", peak_memory());
}

/// Files at the limits are read, with little memory.
#[test]
fn files_at_the_limits_are_read_in_little_memory() {
    let bodies =
        "[[body]]\neach = { i = \"1..9000\" }\nname = \"p{i}\"\nkind = \"point\"\nmass = 1\nposition = [0, 0]\n";
    let doubling: String = (1..60).map(|k| format!("e{k} = \"e{0} + e{0}*e{0}\"\n", k - 1)).collect();
    let doubled = changed(&[["[expressions]\n", &format!("[expressions]\ne0 = \"1e-3*length\"\n{doubling}")]]);
    let outputs = "[[output]]\neach = { i = \"1..90\" }\nname = \"o{i}\"\nvalue = \"m.position\"\n";
    let beams = changed(&[["elements = 2", "elements = 1000"]]);
    for text in [changed(&[]) + bodies, beams, doubled, small("100000", outputs)] {
        let model = read("model.toml", &text).unwrap_or_else(|report| panic!("{report}"));
        drop(model.problem());
    }
    assert!(peak_memory() < 1 << 30, "{} bytes", peak_memory());
}

/// Peak memory of this process in bytes; zero on systems that do not report it.
fn peak_memory() -> usize {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kilobytes = line.and_then(|line| line.split_whitespace().next()?.parse::<usize>().ok());
    1024 * kilobytes.unwrap_or(0)
}
