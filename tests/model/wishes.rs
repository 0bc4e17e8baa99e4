//! Objectives and constraints stated directly: reductions of histories, peaks without a scale, several histories in one min–max objective.

use linkwright::model_file::{Model, read};
use linkwright::problem::{Problem, ResponseAt, Sensitivities, SignedQuantity};

/// x = a sin(w t) + 0.1 a² over one second, with its reductions as constraints.
fn model(objective: &str, constraints: &[&str]) -> String {
    let head = "version = 2\n[design]\na = { start = 1.3, lower = 0.1, upper = 5.0 }\nw = { start = 5.0, lower = 1.0, upper = 9.0 }\n\
        [time]\nto = 1\npoints = 41\n[[output]]\nname = \"x\"\nvalue = \"a*sin(w*time) + 0.1*a^2\"\nunit = \"m\"\n\
        [[output]]\nname = \"y\"\nvalue = \"-3*a*cos(w*time)\"\nunit = \"m\"\n";
    let one = |value: &&str| format!("[[constraint]]\nname = \"{value}\"\nvalue = \"{value}\"\nat_most = 1000\n");
    format!("{head}[objective]\n{objective}\n{}", constraints.iter().map(one).collect::<String>())
}

fn parsed(text: &str) -> Model {
    read("m.toml", text).unwrap_or_else(|report| panic!("{report}"))
}

/// The value of each constraint at a design.
fn values(problem: &Problem, b: &[f64]) -> Vec<f64> {
    let here = problem.analyze_design(b).unwrap();
    linkwright::report::outcome::constraints(problem, b, &here.evaluation).iter().map(|c| c.value).collect()
}

#[test]
fn every_reduction_has_its_value_and_exact_derivatives() {
    let wishes = [
        "peak(x)",
        "max(x)",
        "min(x)",
        "range(x)",
        "mean(x)",
        "rms(x)",
        "integral(x)",
        "sum(x)",
        "initial(x)",
        "final(x)",
        "at(x, 0.37)",
        "time_of_max(x)",
        "time_of_min(y)",
        "time_of_peak(y, 0.2, 0.9)",
        "crossing(x, 0.5)",
        "norm(x, 8)",
        "smooth_max(x, 20)",
        "min(x, 0.2, 0.4)",
        "range(x + y)/final(y)",
        "a*rms(x) - w/max(abs(x))",
        "max(range(x), 2)",
    ];
    let problem = parsed(&model("minimize = \"range(x)\"", &wishes)).problem().unwrap();
    let b = problem.start();
    let responses = problem.analyze(&b).unwrap();
    let x = &responses.values[0];
    let largest = x.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = x.iter().copied().fold(f64::INFINITY, f64::min);
    let found = values(&problem, &b);
    let close = |a: f64, b: f64| (a - b).abs() < 1e-9 * (1.0 + b.abs());
    for (wish, expected) in [
        ("peak(x)", largest.abs().max(least.abs())),
        ("range(x)", largest - least),
        ("final(x)", x[40]),
        ("sum(x)", x.iter().sum()),
    ] {
        let k = wishes.iter().position(|w| *w == wish).unwrap();
        assert!(close(found[k], expected), "{wish}: {} and {expected}", found[k]);
    }
    assert!(close(problem.evaluate(&b, &responses).unwrap().objective, largest - least));

    let at: Vec<ResponseAt> = (0..2).flat_map(|h| (0..41).map(move |p| ResponseAt { response: h, point: p })).collect();
    let rows = problem.sensitivities(&b, &responses, &at).unwrap();
    let known = Sensitivities { at, rows };
    let step = 1e-6;
    for (j, wish) in wishes.iter().enumerate() {
        let signed = SignedQuantity { quantity: &problem.constraints[j].quantity, sign: 1.0, bound: None };
        let exact = problem.total_derivative(signed, 0, &b, &responses, &known);
        for k in 0..2 {
            let moved = |by: f64| {
                let mut b = b.clone();
                b[k] += by;
                values(&problem, &b)[j]
            };
            let difference = (moved(step) - moved(-step)) / (2.0 * step);
            assert!(
                (exact[k] - difference).abs() < 1e-6 * (1.0 + difference.abs()),
                "{wish}: {} and {difference}",
                exact[k]
            );
        }
    }
}

#[test]
fn what_is_no_reduction_of_a_history_is_explained() {
    for (wish, message) in [
        ("range(a)", "reduces a history, and this is a number"),
        ("x - mean(x)", "cannot use a history beside them"),
        ("max(range(x))", "can be used in"),
        ("at(x)", "takes a history, a number"),
        ("at(x, 7)", "is not between"),
        ("mean(x, 0.5, 0.501)", "fewer than two points"),
        ("rnage(x)", "did you mean `range`"),
        ("norm(x, 0.5)", "at least 1"),
    ] {
        let Err(report) = read("m.toml", &model("minimize = \"a\"", &[wish])) else { panic!("{wish} is accepted") };
        assert!(report.to_string().contains(message), "{wish}: {report}");
    }
}

/// A peak needs neither bound nor scale nor start: they follow from the start design.
#[test]
fn a_peak_starts_at_the_peak_of_the_start_design() {
    for objective in [
        "minimize = \"y\"\nover = \"peak\"",
        "minimize = \"peak(y)\"",
        "minimize = \"peak(y)\"\nbound = { name = \"most\", lower = 0 }",
    ] {
        let problem = parsed(&model(objective, &[])).problem().unwrap();
        let here = problem.analyze_design(&problem.start()).unwrap();
        let peak = linkwright::report::outcome::objective(&problem, &here.design, &here.evaluation);
        assert_eq!(problem.objective.unit, "m");
        assert!((problem.variables[2].start - peak).abs() < 1e-12 && (peak - 3.9).abs() < 1e-2, "{peak}");
        assert!(problem.constraints.iter().all(|c| (c.scale - peak).abs() < 1e-12));
        assert!(here.evaluation.max_violation_pct().abs() < 1e-9);
    }
    let given = "minimize = \"y\"\nover = \"peak\"\nscale = 7\nbound = { start = 50 }";
    let problem = parsed(&model(given, &[])).problem().unwrap();
    assert_eq!((problem.variables[2].start, problem.constraints[0].scale), (50.0, 7.0));
}

#[test]
fn the_largest_of_several_peaks_is_minimized() {
    for list in ["minimize = [\"x\", \"y\"]\nover = \"peak\"", "minimize = [\"peak(x)\", \"peak(y)\"]"] {
        let problem = parsed(&model(list, &[])).problem().unwrap();
        assert_eq!(problem.constraints.len(), 4);
        let state = linkwright::sao::Method::default().solve(&problem, |_| ()).unwrap();
        let peak = linkwright::report::outcome::objective(&problem, &state.design, &state.evaluation);
        // y is the larger one: 3 a at a = 0.1.
        assert!((peak - 0.3).abs() < 1e-6, "{peak}");
        assert!(linkwright::report::outcome::constraints(&problem, &state.design, &state.evaluation).is_empty());
    }
    assert!(read("m.toml", &model("minimize = [\"x\", \"y\"]\nover = \"mean\"", &[])).is_err());
}

/// The default scale fits the problem; a wrong one, such as 1, costs many analyses.
#[test]
fn the_shaper_needs_few_analyses_without_a_scale() {
    let text = std::fs::read_to_string(format!("{}/examples/models/shaper.toml", env!("CARGO_MANIFEST_DIR"))).unwrap();
    assert!(!text.contains("scale"));
    let model = parsed(&text);
    let state = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    assert!(
        state.status.is_success() && state.counters.analyses <= 15,
        "{:?} {}",
        state.status,
        state.counters.analyses
    );
}
