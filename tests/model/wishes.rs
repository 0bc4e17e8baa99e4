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
    // Limits of `peak(x)` and `max(x)` alone are those of the history.
    let wishes = [
        "0 + peak(x)",
        "0 + max(x)",
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
        ("0 + peak(x)", largest.abs().max(least.abs())),
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
        ("peak(a)", "reduces a history, and this is a number"),
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

/// A list without `over` minimizes the largest of its numbers, `peak(…)` and `max(…)`; the largest one may be negative, and an output of one time
/// point is a number.
#[test]
fn the_largest_of_several_numbers_is_minimized() {
    let head = "version = 2\n[design]\na = { start = 2.5, lower = -5.0, upper = 5.0 }\n[[output]]\nname = \"f1\"\nvalue = \"a^2\"\n\
        [[output]]\nname = \"f2\"\nvalue = \"(a - 2)^2\"\n";
    let history = "[[output]]\nname = \"x\"\nvalue = \"time*a\"\n[time]\nto = 1\npoints = 11\n";
    for (more, list, least) in [
        ("", "[\"f1\", \"f2\"]", 1.0),
        ("", "[\"-a\", \"-(3 - a)\"]", -1.5),
        ("", "[\"f1 + 1\", \"2*f2\", \"a\"]", 2.0),
        (history, "[\"f2\", \"peak(x)\"]", 1.0),
        (history, "[\"max(x)\", \"-a\"]", 0.0),
        ("[time]\nat = [0.5]\n[[output]]\nname = \"x\"\nvalue = \"time*a\"\n", "[\"-x\", \"a - 3\"]", -1.0),
    ] {
        let problem = parsed(&format!("{head}{more}[objective]\nminimize = {list}\n")).problem().unwrap();
        for method in [linkwright::sao::Method::default(), (linkwright::sao::preset("gcmma").unwrap().method)()] {
            let end = method.solve(&problem, |_| ()).unwrap();
            let found = linkwright::report::outcome::objective(&problem, &end.design, &end.evaluation);
            assert!((found - least).abs() < 1e-3, "{list}: {found}");
            assert!(linkwright::report::outcome::peak_row(&problem, &end.design, &end.evaluation).is_some(), "{list}");
        }
    }
    let error = |more: &str, objective: &str| {
        read("m.toml", &format!("{head}{more}[objective]\n{objective}\n")).map(|_| ()).unwrap_err().to_string()
    };
    let of_history = error(history, "minimize = [\"x\", \"f1\"]");
    assert!(of_history.contains("a history, not a number") && of_history.contains("peak(…)"), "{of_history}");
    let with_over = error("", "minimize = [\"f1\", \"f2\"]\nover = \"peak\"");
    assert!(with_over.contains("leave `over` out"), "{with_over}");
    let continuous = error("", "minimize = [\"f1\", \"f2\"]\ncontinuous = true");
    assert!(continuous.contains("a number has no peak in continuous time"), "{continuous}");
    let lengths = "[design.b]\nstart = \"1 m\"\n[design.m]\nstart = \"1 kg\"\n";
    let kinds = error(lengths, "minimize = [\"b\", \"m\"]");
    assert!(kinds.contains("quantities of different kinds have no largest one"), "{kinds}");
}

/// A largest value, and one of a part of a history, are bounded by a variable as a peak is: the value where two time points are equal is
/// a kink, and the run ends there as converged.
#[test]
fn a_largest_value_and_a_part_of_a_history_are_bounded_by_a_variable() {
    for wish in ["max(x)", "peak(x, 0.2, 0.6)", "max(y, 0.5, 1)", "max(x - 9)"] {
        let number = format!("0 + {wish}");
        let problem = parsed(&model(&format!("minimize = \"{wish}\""), &[&number])).problem().unwrap();
        let here = problem.analyze_design(&problem.start()).unwrap();
        let found = problem.peak_objective(&here.design, &here.evaluation).unwrap();
        let expected = values(&problem, &here.design)[0];
        assert!(
            (found - expected).abs() < 1e-12 && (here.design[2] - found).abs() < 1e-12,
            "{wish}: {found}, {expected}"
        );
    }
    let kink = "version = 2\n[design]\na = { start = 0.2, lower = 0.0, upper = 3.0 }\n[time]\nto = 1\npoints = 11\n\
        [[output]]\nname = \"x\"\nvalue = \"time*a + (1 - time)*(2 - a) - 3\"\n[objective]\nminimize = ";
    for (wish, least) in [("\"max(x)\"", -2.0), ("[\"max(x)\", \"max(-2*x, 0, 0.15)\"]", 2.4)] {
        let problem = parsed(&format!("{kink}{wish}\n")).problem().unwrap();
        let end = linkwright::sao::Method::default().solve(&problem, |_| ()).unwrap();
        let found = linkwright::report::outcome::objective(&problem, &end.design, &end.evaluation);
        assert!(end.status.is_success(), "{wish}: {:?}", end.status);
        assert!((found - least).abs() < 1e-6, "{wish}: {found}");
    }
}

/// A limit of the largest or smallest value is one of all values, in the interval; the opposite limit is that of a number.
#[test]
fn a_limit_of_an_extreme_is_a_limit_of_the_history() {
    let limited = |value: &str, limit: &str| {
        let text =
            model("minimize = \"a\"", &[]) + "[[constraint]]\nname = \"c\"\nvalue = \"" + value + "\"\n" + limit + "\n";
        let problem = parsed(&text).problem().unwrap();
        let design = problem.start();
        let here = problem.analyze_design(&design).unwrap();
        let found = linkwright::report::outcome::constraints(&problem, &design, &here.evaluation).remove(0);
        (problem.constraints[0].quantity.is_transient(), found.value, found.margin)
    };
    for (value, limit) in [
        ("max(x)", "at_most = 1"),
        ("min(x)", "at_least = 0.3"),
        ("peak(y)", "at_most = 5"),
        ("peak(y, 0.3, 0.6)", "at_most = 5"),
        ("max(x + y, 0.1, 0.2)", "at_most = 1"),
    ] {
        let (is_history, found, margin) = limited(value, limit);
        let (is_number, expected, other) = limited(&format!("0 + {value}"), limit);
        assert!(is_history && !is_number, "{value}");
        assert!((found - expected).abs() < 1e-12 && (margin - other).abs() < 1e-12, "{value}: {found}, {expected}");
    }
    for (value, limit) in [("max(x)", "at_least = 1"), ("min(x)", "at_most = 1"), ("peak(x)", "equals = 1")] {
        assert!(!limited(value, limit).0, "{value} {limit}");
    }
}

#[test]
fn a_range_as_objective_and_an_unused_variable_are_noted() {
    let notes = |objective: &str, more: &str| {
        let model = parsed(&model(objective, &[]).replace("w = {", &format!("{more}w = {{")));
        model.note().map(|report| report.to_string()).unwrap_or_default()
    };
    let of_range = notes("minimize = \"range(x)/2\"", "");
    assert!(of_range.contains("`range` has a kink") && of_range.contains("peak(x - middle)"), "{of_range}");
    assert!(notes("minimize = \"2*max(x)\"", "").contains("`max` has a kink"));
    assert_eq!(notes("minimize = \"max(x)\"", "") + &notes("maximize = \"max(x)\"", ""), "");
    let unused = notes("minimize = \"rms(x)\"", "b = { start = 1.0 }\n");
    assert!(unused.contains("no expression uses the design variable `b`"), "{unused}");
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

/// A crossing exists close to a design only: beyond the domain of the approximations, steps are shorter.
#[test]
fn the_latest_crossing_is_found_although_it_vanishes_beyond() {
    let text = "version = 2\n[design]\na = { start = 1.2, lower = 0.2, upper = 3 }\nw = { start = 2, lower = 0.5, upper = 4 }\n\
        [time]\nto = 2\npoints = 41\n[[output]]\nname = \"x\"\nvalue = \"a*sin(w*time)\"\n\
        [objective]\nmaximize = \"crossing(x, 1)\"\n[[constraint]]\nname = \"size\"\nvalue = \"a*w\"\nat_least = 1\n";
    let model = parsed(text);
    let end = model.method().solve(&model.problem().unwrap(), |_| ()).unwrap();
    assert!(end.cycles() > 2 && -end.evaluation.objective > 0.85, "{}: {:?}", end.reason, end.evaluation);
}

/// An equality on an interval holds there, and is not violated elsewhere.
#[test]
fn an_equality_may_hold_on_an_interval() {
    let text = "version = 2\n[design]\na = { start = 1.2, lower = 0.2, upper = 3 }\n[time]\nto = 1\npoints = 11\n\
        [[output]]\nname = \"x\"\nvalue = \"a*if(time < 0.55, time, 0.5)\"\n[objective]\nminimize = \"a^2\"\n\
        [[constraint]]\nname = \"rest\"\nvalue = \"x\"\nequals = 0.25\nfrom = 0.6\n";
    let model = parsed(text);
    let problem = model.problem().unwrap();
    let end = model.method().solve(&problem, |_| ()).unwrap();
    assert!(end.status.is_success() && (end.design[0] - 0.5).abs() < 1e-9, "{}: {:?}", end.reason, end.design);
    assert!(end.evaluation.max_violation_pct().abs() < 1e-7, "{}", end.evaluation.max_violation_pct());
}

/// A sine of which no time point is the peak.
const BETWEEN_POINTS: &str = "version = 2\n[design]\na = { start = 1, lower = 0.5, upper = 2 }\n[time]\nto = 3\npoints = 8\n\
                              [[output]]\nname = 'y'\nvalue = 'a*sin(time)'\n[objective]\nminimize = 'y'\nover = 'peak'\n";

#[test]
fn a_peak_between_the_time_points_is_minimized_if_the_file_says_so() {
    for (keys, exact, accuracy) in [("", f64::sin(12.0 / 7.0), 1e-12), ("continuous = true\n", 1.0, 1e-4)] {
        let model = read("m.toml", &format!("{BETWEEN_POINTS}{keys}")).unwrap_or_else(|report| panic!("{report}"));
        let problem = model.problem().unwrap();
        let start = problem.analyze_design(&problem.start()).unwrap();
        let peak = problem.peak_objective(&start.design, &start.evaluation).unwrap();
        assert!((peak - exact).abs() < accuracy, "{keys}: {peak}");
        let end = model.method().solve(&problem, |_| ()).unwrap();
        let peak = problem.peak_objective(&end.design, &end.evaluation).unwrap();
        assert!(
            (end.design[0] - 0.5).abs() < 1e-9 && (peak - 0.5 * exact).abs() < accuracy,
            "{keys}: {:?}",
            end.design
        );
    }
    for (wish, words) in [
        ("minimize = 'peak(y, 1, 2)'\ncontinuous = true\n", "a part of a history has no peak in continuous time"),
        ("minimize = 'y'\nover = 'integral'\ncontinuous = true\n", "`continuous` belongs to over = \"peak\""),
        ("minimize = 'a'\ncontinuous = true\n", "`continuous` belongs to over = \"peak\""),
        ("minimize = 'y'\nover = 'peak'\ncontinuous = 1\n", "must be true or false"),
    ] {
        let text = BETWEEN_POINTS.replace("minimize = 'y'\nover = 'peak'\n", wish);
        let report = read("m.toml", &text).err().unwrap().to_string();
        assert!(report.contains(words), "{wish}: {report}");
    }
}
