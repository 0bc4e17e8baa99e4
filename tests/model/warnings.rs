//! Warnings about results that are doubtful although the analysis has succeeded.

use linkwright::model_file::read;

const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models");

/// The warnings about the model in `text` at its start design.
fn warnings(text: &str) -> Vec<String> {
    let problem = read("m.toml", text).unwrap_or_else(|report| panic!("{report}")).problem().unwrap();
    let start = problem.start();
    let responses = problem.analyze(&start).unwrap();
    problem.analysis.warnings(&start, &responses)
}

/// Mechanisms with events have warnings like others.
#[test]
fn a_mechanism_with_events_has_warnings() {
    let text = "version = 2\ngravity = [0, -10]\n[design.p]\nstart = 0.8\n[objective]\nminimize = 'p'\n[time]\nto = 0.6\n\
                points = 7\n[[body]]\nname = 'ball'\nkind = 'point'\nmass = 2\nposition = [0, 0.8]\n\
                [[force]]\nname = 'floor'\nkind = 'rigid-stop'\na = 'ground.y'\nb = 'ball.y'\nclearance = 0\n\
                restitution = 'p'\n[[force]]\nname = 'drag'\nkind = 'coordinate-spring'\nb = 'ball.x'\nstiffness = 1\n\
                damping = -0.1\n[analysis]\nkind = 'dynamics'\nstep = 0.01\n[[output]]\nname = 'y'\nvalue = 'ball.y'\n";
    let found = warnings(text);
    assert!(found.len() == 1 && found[0].contains("drag: its damping of -0.1"), "{found:?}");
}

/// A shipped model with replaced parts.
fn shipped(name: &str, replaced: &[(&str, &str)]) -> String {
    let text = std::fs::read_to_string(format!("{MODELS}/{name}.toml")).unwrap();
    replaced.iter().fold(text, |text, (old, new)| {
        assert!(text.contains(old), "{name} has no `{old}`");
        text.replace(old, new)
    })
}

/// Simulations whose steps are long enough for a false alarm: all shipped models and benchmarks.
#[test]
fn shipped_models_have_no_warnings() {
    let mut files = vec![];
    for folder in [MODELS.to_owned(), format!("{MODELS}/benchmarks")] {
        let entries = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
        files.extend(entries.filter(|path| path.extension().is_some_and(|end| end == "toml")));
    }
    files.sort();
    assert!(files.len() > 30);
    for file in files {
        let found = warnings(&std::fs::read_to_string(&file).unwrap());
        assert!(found.is_empty(), "{}: {found:?}", file.display());
    }
}

#[test]
fn steps_that_are_too_long_are_warnings() {
    // Steps of 50 ms are short enough for the spin-up, and too long for the steady rotation after it.
    let beam = |step: &str| shipped("spinning-beam", &[("to = 15\n", "to = 20\n"), ("step = 0.01", step)]);
    let found = warnings(&beam("step = 0.05"));
    assert!(found.iter().any(|w| w.contains("if the time step is 1.0e-1 s") && w.contains("2.5e-2")), "{found:?}");
    assert_eq!(warnings(&beam("step = 0.01")), Vec::<String>::new());
    // Explicit steps that leave the constraints.
    let steps = "scheme = \"rk5\"\nstep = 0.05\n";
    let found = warnings(&shipped("benchmarks/car-axis", &[("scheme = \"rk8\"\ntolerance = 1e-12\n", steps)]));
    assert!(found.iter().any(|w| w.contains("leave the constraints from t = ") && w.contains("shorter")), "{found:?}");
    assert!(found.iter().any(|w| w.contains("if the time step is") || w.contains("twice the one given")), "{found:?}");
}
