//! Verdicts at the end of runs of formulas with known optima: a run converges at one, or does not say that it has converged.

use crate::shell::TempFolder;

/// A problem of formulas: name, start and unit length of each variable, objective, and constraints `value at_most limit`.
struct Formulas {
    name: &'static str,
    variables: &'static [(&'static str, f64, f64)],
    objective: &'static str,
    at_most: &'static [(&'static str, f64)],
    /// Bounds of all variables.
    bounds: Option<[f64; 2]>,
    /// The optimum, and local ones.
    optima: &'static [f64],
}

const fn problem(name: &'static str, objective: &'static str, optima: &'static [f64]) -> Formulas {
    Formulas { name, variables: &[], objective, at_most: &[], bounds: None, optima }
}

impl Formulas {
    /// The model file; the objective is an output, or written directly.
    fn text(&self, is_direct: bool) -> String {
        let mut text = String::from("version = 2\n");
        for (name, start, unit) in self.variables {
            let bounds = self.bounds.map_or_else(String::new, |[lower, upper]| {
                format!(", lower = {:e}, upper = {:e}", lower * unit, upper * unit)
            });
            text += &format!("design.z{name} = {{ start = {:e}{bounds} }}\n", start * unit);
        }
        text += "[expressions]\n";
        for (name, _, unit) in self.variables {
            text += &format!("{name} = \"z{name} / {unit:e}\"\n");
        }
        let objective = if is_direct { self.objective } else { "f" };
        if !is_direct {
            text += &format!("[[output]]\nname = \"f\"\nvalue = \"{}\"\n", self.objective);
        }
        for (k, (value, _)) in self.at_most.iter().enumerate() {
            text += &format!("[[output]]\nname = \"c{k}\"\nvalue = \"{value}\"\n");
        }
        text += &format!("[objective]\nminimize = \"{objective}\"\n");
        for (k, (_, limit)) in self.at_most.iter().enumerate() {
            text += &format!("[[constraint]]\nname = \"limit {k}\"\nvalue = \"c{k}\"\nat_most = {limit:?}\n");
        }
        text
    }
}

const ROSENBROCK: &str = "100*(y - x^2)^2 + (1 - x)^2";
const DOUBLE_WELL: &str = "x^4 + y^4 - 4*x*y";

#[test]
fn a_run_that_has_converged_is_at_an_optimum() {
    let problems = [
        // Slopes of the constraint change by eighteen orders.
        Formulas {
            variables: &[("x", 0.001, 1.0), ("y", 140.0, 1.0), ("z", 650.0, 1.0)],
            at_most: &[("4/(x*y*z)", 1.0)],
            bounds: Some([0.001, 1000.0]),
            ..problem("box", "40*x*y + 40*y*z + 20*x*z", &[240.0])
        },
        // A displacement along a guessed length leads far away.
        Formulas {
            variables: &[("x", 0.1, 1e4), ("y", 0.0, 1e-5)],
            at_most: &[("x^2 + y^2", 4.0)],
            ..problem("disc", "-x^2 - 2*y^2", &[-8.0])
        },
        // Stiff directions hide that a soft one has not come down.
        Formulas {
            variables: &[("a", 3.5, 1.0), ("b", 5.0, 1.0), ("c", -2400.0, 1.0), ("d", 29.0, 1.0)],
            ..problem("ellipsoid", "(a-0.3)^2 + 1e3*(b-0.3)^2 + 1e5*(c-0.3)^2 + 1e7*(d-0.3)^2", &[0.0])
        },
        // The first trial is a saddle point, and no short step was made.
        Formulas {
            variables: &[("x", -0.5, 1.0), ("y", 1.6, 1.0)],
            bounds: Some([-3.0, 3.0]),
            ..problem("camel", "(4 - 2.1*x^2 + x^4/3)*x^2 + x*y + (-4 + 4*y^2)*y^2", &[-1.031_628_453_489_877_4])
        },
        Formulas {
            variables: &[("x", 2000.0, 1.0), ("y", -2200.0, 1.0)],
            ..problem("double well", DOUBLE_WELL, &[-2.0])
        },
        Formulas {
            variables: &[("x", 0.0, 1e-5), ("y", 0.0, 1e4)],
            ..problem("start at a saddle", DOUBLE_WELL, &[-2.0])
        },
        // The limit has no slope where both variables vanish.
        Formulas {
            variables: &[("x", 17.0, 1.0), ("y", 0.0, 1.0)],
            at_most: &[("x*y", 0.0)],
            bounds: Some([0.0, 100.0]),
            ..problem("either or", "(x-1)^2 + (y-2)^2", &[1.0, 4.0])
        },
        // Trials of hundreds of decades, the last one of which is rejected. The optimum is ln 1500 + ½ ln 3000.
        Formulas {
            variables: &[("x", -5.8, 1.0), ("y", 8.9, 1.0)],
            at_most: &[("exp(-x) + exp(-2*y)", 0.001)],
            ..problem("exponentials", "x + y", &[11.316_404_171])
        },
        Formulas {
            variables: &[("t", 250.0, 1.0)],
            ..problem("huge trial", "(0.02*exp(4000/(45 + t)) - 34780)^2", &[0.0])
        },
        Formulas { variables: &[("x", -120.0, 1.0), ("y", 500.0, 1.0)], ..problem("valley", ROSENBROCK, &[0.0]) },
        // The residual at the end is a rounding error.
        Formulas {
            variables: &[("x", 1.0, 1.0), ("y", 1.0, 1.0)],
            ..problem("exact zero", "(x-0.3)^2 + (y-0.1)^2", &[0.0])
        },
        Formulas { variables: &[("x", 1.0, 1.0)], ..problem("unbounded", "-x^2", &[]) },
    ];
    let scratch = TempFolder::new("verdicts");
    let mut converged = vec![];
    for problem in &problems {
        for is_direct in [false, true] {
            std::fs::write(scratch.0.join("model.toml"), problem.text(is_direct)).unwrap();
            let output =
                crate::shell::linkwright(&["optimize", "model.toml", "--out", "run", "--force", "-q"], &scratch.0);
            assert!(matches!(output.status.code(), Some(0 | 3)), "{}: {output:?}", problem.name);
            let summary: serde_json::Value = serde_json::from_str(&scratch.read("run/summary.json")).unwrap();
            let objective = summary["objective"]["value"].as_f64().unwrap();
            let reason = summary["reason"].as_str().unwrap_or_default();
            assert!(!reason.contains("noise"), "{}: {reason}", problem.name);
            if output.status.code() == Some(0) {
                let is_near = |optimum: &f64| (objective - optimum).abs() < 1e-5 * optimum.abs().max(0.1);
                assert!(problem.optima.iter().any(is_near), "{}: {objective:e}, {reason}", problem.name);
                converged.push(problem.name);
            }
        }
    }
    // Some end at the limit of cycles, or stalled.
    assert!(converged.len() >= 15, "{converged:?}");
}

/// The reason of failed trial steps is told at the end of a run that has not converged, in its summary and on its page.
#[test]
fn failed_trial_steps_have_their_reason_at_the_end() {
    let text = "version = 2\n[design.x]\nstart = 2\nlower = 0\nupper = 10\n[[output]]\nname = \"f\"\nvalue = \"x + 1e-3/sqrt(x - 1.5)\"\n\
                [objective]\nminimize = \"f\"\n";
    let scratch = TempFolder::new("failed-steps");
    std::fs::write(scratch.0.join("model.toml"), text).unwrap();
    let shown = scratch.run(&["optimize", "model.toml", "--max-cycles", "1", "--out", "run"], 3);
    scratch.run(&["report", "run", "--page-only", "-q"], 0);
    for shown in [shown, scratch.read("run/summary.json"), scratch.read("run/report.html")] {
        assert!(shown.contains("he analysis of 1 trial step failed") && shown.contains("sqrt(-1.5)"), "{shown}");
    }
}

/// Problems on which runs were lost, or ended with a false verdict. All are solved.
#[test]
fn problems_that_misled_are_solved() {
    let model = |starts: &[f64], bounds: &str, objective: &str, constraints: &[(&str, &str)]| {
        let variable = |(k, start): (usize, &f64)| format!("[design.x{}]\nstart = {start:?}\n{bounds}", k + 1);
        let constraint = |(k, (value, limit)): (usize, &(&str, &str))| {
            format!(
                "[[output]]\nname = \"c{k}\"\nvalue = \"{value}\"\n[[constraint]]\nname = \"c{k}\"\nvalue = \"c{k}\"\n{limit}\n"
            )
        };
        format!(
            "version = 2\n{}[[output]]\nname = \"f\"\nvalue = \"{objective}\"\n[objective]\nminimize = \"f\"\n{}",
            starts.iter().enumerate().map(variable).collect::<String>(),
            constraints.iter().enumerate().map(constraint).collect::<String>()
        )
    };
    let chain: Vec<String> = (2..=34).map(|k| format!("2*x{k}^2 - 2*x{}*x{k}", k - 1)).collect();
    let problems = [
        // The violation is stationary at zero, where it was called infeasible; the start is feasible.
        ("product", model(&[10.0; 3], "lower = 0\n", "x1 + x2 + x3", &[("x1*x2*x3", "at_least = 1")]), 3.0),
        ("powers", model(&[10.0; 2], "lower = 0\n", "x1 + x2", &[("x1^3*x2", "at_least = 1")]), 4.0 / 27f64.powf(0.25)),
        // Problem BT8 of CUTEst: at the optimum, a step of 1e10 was accepted.
        (
            "squared slacks",
            model(
                &[1.0, 1.0, 1.0, 0.0, 0.0],
                "",
                "x1^2 + x2^2 + x3^2",
                &[("x1 - 1 - x4^2 + x2^2", "equals = 0"), ("x1^2 + x2^2 - 1 - x5^2", "equals = 0")],
            ),
            1.0,
        ),
        // A point of inflection at zero.
        ("cubic", model(&[1.0], "lower = -3\nupper = 3\n", "x1^3", &[]), -27.0),
        // More variables than steps from which curvatures were made: problem 300 of Schittkowski's collection, larger.
        ("tridiagonal", model(&[0.1; 34], "", &format!("x1^2 - 2*x1 + {}", chain.join(" + ")), &[]), -34.0),
    ];
    let scratch = TempFolder::new("misled");
    for (name, text, optimum) in problems {
        std::fs::write(scratch.0.join("model.toml"), text).unwrap();
        scratch.run(&["optimize", "model.toml", "--out", "run", "--force", "-q"], 0);
        let summary: serde_json::Value = serde_json::from_str(&scratch.read("run/summary.json")).unwrap();
        let objective = summary["objective"]["value"].as_f64().unwrap();
        assert!((objective - optimum).abs() < 1e-6 * optimum.abs(), "{name}: {objective} for {optimum}");
    }
}

/// Limits that exclude each other by 0.6 %. The restoration leaves this region for a stationary violation of 38 %: the run goes back and ends at
/// the design that violates least.
#[test]
fn an_infeasible_run_ends_at_its_least_violation() {
    let place = TempFolder::new("least-violation");
    std::fs::write(place.0.join("beam.toml"), BEAM).unwrap();
    place.run(&["optimize", "beam", "--quiet"], 3);
    let summary: serde_json::Value = serde_json::from_str(&place.read("out/beam/summary.json")).unwrap();
    assert_eq!(summary["status"], "Infeasible", "{}", summary["reason"]);
    assert!(summary["violation_pct"].as_f64().unwrap() < 0.61 && summary["best"].is_null(), "{summary}");
}

const BEAM: &str = r#"version = 2
title = "cantilever under own weight and distributed load settles on a bump stop; pre-gap"
gravity = [0, -9.81]
[design]
ht = { start = "6 mm", lower = "3 mm", upper = "20 mm" }
gap = { start = "5 mm", lower = "0 mm", upper = "50 mm" }
ks = { start = 2e6, lower = 1e4, upper = 1e8 }
len = { start = "80 cm", lower = "50 cm", upper = "120 cm" }
[[beam]]
name = "b"
kind = "rectangular"
width = "20 mm"
height = "ht"
young = "70 GPa"
density = "2700 kg/m^3"
from = [0, 0]
to = ["len", 0]
elements = 6
load_y = "-q"
[[joint]]
name = "clamp"
kind = "fixed"
a = "ground"
b = "b.first"
[[force]]
name = "stop"
kind = "bump-stop"
b = "b.last.y"
stiffness = "ks"
limit = "-gap"
[sweep]
variable = "q"
to = "30 N/m"
points = 4
[analysis]
kind = "statics"
[[output]]
name = "y"
value = "b.last.y"
shown_in = "mm"
[[output]]
name = "R"
value = "stop.contact_force"
[[output]]
name = "M"
value = "clamp.moment"
[[output]]
name = "f"
frequency = 1
shown_in = "Hz"
[objective]
minimize = "1e3*ht*len + 1e-7*ks"
[[constraint]]
name = "stopforce"
value = "R"
at_most = "8 N"
[[constraint]]
name = "moment"
value = "abs(M)"
at_most = "3 N*m"
[[constraint]]
name = "freq"
value = "f"
at_least = "31 Hz"
from = "10 N/m"
[[constraint]]
name = "long"
value = "len"
at_least = "75 cm"
"#;

/// An equality that always holds has values and derivatives of rounding errors, which are no constraint. Scaled up, they were one: runs converged
/// at other designs, or stalled.
#[test]
fn an_identity_is_no_constraint() {
    let place = TempFolder::new("identity");
    let identities = [
        "sin(x+y)-sin(x)*cos(y)-cos(x)*sin(y)",
        "x*y-3*x*y+2*y*x",
        "(x+y)^2-x^2-2*x*y-y^2",
        "cos(x)^2+sin(x)^2-1",
        "1e6*(exp(x)*exp(y)-exp(x+y))/exp(x+y)*1e-6",
    ];
    for (k, identity) in identities.iter().enumerate() {
        for start in ["x = 0, y = -1.5", "x = 1, y = -1.9", "x = 0.3, y = -1.7"] {
            let design: String = start
                .split(", ")
                .map(|one| one.split_once(" = ").unwrap())
                .map(|(name, value)| format!("design.{name} = {{ start = {value}, lower = -2, upper = 2 }}\n"))
                .collect();
            let outputs = format!(
                "version = 2\n{design}[[output]]\nname = \"f\"\nvalue = \"x^2+y^2\"\n[[output]]\nname = \"g\"\nvalue = \"x+2*y^2\"\n\
                 [[output]]\nname = \"h\"\nvalue = \"{identity}\"\n[objective]\nminimize = \"f\"\n\
                 [[constraint]]\nname = \"limit\"\nvalue = \"g\"\nat_least = 6\n[[constraint]]\nname = \"identity\"\nvalue = \"h\"\nequals = 0\n"
            );
            std::fs::write(place.0.join("m.toml"), outputs).unwrap();
            let end: serde_json::Value = serde_json::from_str(
                place.run(&["optimize", "m", "--json", "--force", "--out", "run"], 0).lines().last().unwrap(),
            )
            .unwrap();
            let found = end["objective"]["value"].as_f64().unwrap();
            assert!((found - 2.9375).abs() < 1e-5, "{k}, {start}: {found}, {}", end["reason"]);
        }
    }
}

/// A start at an optimum, up to rounding: the slopes there vanish and tell nothing about the size of variables without bounds.
#[test]
fn a_run_that_starts_at_an_optimum_says_so() {
    let place = TempFolder::new("restart");
    let problems: [(&str, &[&str]); 3] = [
        ("(x-3)^2 + y^2 + x*y", &["x=4.00000000001,y=-2.00000000001", "x=4,y=-2", "x=3.9999999999,y=-2"]),
        ("x^2 - ln(x + y) + exp(y) - y", &["x=0.5,y=0.2", "x=1,y=1", "x=2,y=0"]),
        ("100*(y-x^2)^2 + (1-x)^2 + 1", &["x=1.00000000001,y=1.00000000002", "x=-1.2,y=1"]),
    ];
    for (objective, starts) in problems {
        let text = format!(
            "version = 2\n[design]\nx = {{ start = 1 }}\ny = {{ start = 1 }}\n[[output]]\nname = \"f\"\nvalue = \"{objective}\"\n[objective]\nminimize = \"f\"\n"
        );
        std::fs::write(place.0.join("m.toml"), text).unwrap();
        let run = |start: &str, code: i32| -> serde_json::Value {
            let shown = place.run(&["optimize", "m", "--json", "--force", "--out", "run", "--start", start], code);
            serde_json::from_str(shown.lines().last().unwrap()).unwrap()
        };
        for start in starts {
            let end = run(start, 0);
            // And again from its own end.
            let design: Vec<String> = end["design"]
                .as_array()
                .unwrap()
                .iter()
                .map(|one| format!("{}={:?}", one["name"].as_str().unwrap(), one["value"].as_f64().unwrap()))
                .collect();
            let again = run(&design.join(","), 0);
            let [first, second] = [&end, &again].map(|end| end["objective"]["value"].as_f64().unwrap());
            assert!((first - second).abs() <= 1e-9 * first.abs().max(1e-9), "{objective} {start}: {first} {second}");
        }
    }
}

/// A search subregion without limits, as of a return to an earlier design, is stored and read again.
#[test]
fn runs_with_unbounded_variables_can_be_read_again() {
    let place = TempFolder::new("unbounded-region");
    let text = "version = 2\n[design]\nx = { start = 3 }\ny = { start = 1 }\n[[output]]\nname = \"f\"\nvalue = \"x^2 + y^2\"\n\
        [[output]]\nname = \"g\"\nvalue = \"cos(3*x) + 0.1*x^2 + y^2\"\n[objective]\nminimize = \"f\"\n\
        [[constraint]]\nname = \"limit\"\nvalue = \"g\"\nat_most = -1\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    place.run(&["optimize", "m", "--quiet", "--out", "run"], 3);
    let history = place.read("run/history.jsonl");
    assert!(history.contains("\"upper\":[null"), "no subregion is without limit: {history}");
    place.run(&["report", "run"], 0);
    let resumed = place.run(&["resume", "run", "--quiet"], 3);
    assert!(!resumed.contains("not readable"), "{resumed}");
}

/// An infeasible design on the way to an optimum has a better objective only by its violation, and is not called better; a constraint whose limit is
/// zero is active where its value is a rounding error.
#[test]
fn a_violation_is_no_improvement() {
    let place = TempFolder::new("violation");
    let file = |variables: &str, f: &str, g: &str| {
        format!(
            "version = 2\n[design]\n{variables}\n[[output]]\nname = \"f\"\nvalue = \"{f}\"\n[[output]]\nname = \"g\"\nvalue = \"{g}\"\n\
             [objective]\nminimize = \"f\"\n[[constraint]]\nname = \"limit\"\nvalue = \"g\"\nat_most = 0\n"
        )
    };
    let (x, y) = ("x = { start = 5 }", "x = { start = 5 }\ny = { start = 3 }");
    for (variables, f, g) in [(x, "-x", "1e-6*(x - 1)"), (y, "(x-4)^2 + (y-4)^2", "1e-7*(x*y - 4)")] {
        std::fs::write(place.0.join("m.toml"), file(variables, f, g)).unwrap();
        let shown = place.run(&["optimize", "m", "--force", "--out", "run"], 0);
        assert!(shown.contains("Converged") && !shown.contains("best design"), "{f}: {shown}");
        let shown = place.run(&["compare", "m", "--methods", "automatic,slp-filter", "--out", "comparison"], 0);
        assert!(!shown.contains("before its end") && shown.contains("the end of"), "{f}: {shown}");
        drop(std::fs::remove_dir_all(place.0.join("comparison")));
    }
    for weight in ["0.7", "1.0", "1.3", "1.6", "2.2", "3.1"] {
        let variables = "x = { start = 3 }\ny = { start = 1 }";
        let text = file(variables, &format!("(x - {weight})^2 + (y - 0.1)^2"), "x^2 - 3*y");
        std::fs::write(place.0.join("m.toml"), text).unwrap();
        let shown = place.run(&["optimize", "m", "--force", "--out", "run"], 0);
        assert!(shown.contains(", active, margin"), "{weight}: {shown}");
    }
}

/// The scale of a peak is that of the start: a start that cannot be analysed ends an optimization, and not the analysis of another design.
#[test]
fn a_start_that_fails_does_not_stop_the_analysis_of_another_design() {
    let place = TempFolder::new("failing-start");
    let text = "version = 2\n[design]\nm = { start = 0, lower = 0, upper = 5 }\n[[body]]\nname = \"box\"\nkind = \"slider\"\nmass = \"m\"\nvelocity = 1\n\
        [[force]]\nname = \"s\"\nkind = \"coordinate-spring\"\nb = \"box\"\nstiffness = 10\n[time]\nto = 1\npoints = 11\n\
        [analysis]\nkind = \"dynamics\"\n[[output]]\nname = \"x\"\nvalue = \"box.position\"\n[objective]\nminimize = \"max(x)\"\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    let shown = place.run(&["analyze", "m", "--at", "m=1"], 0);
    assert!(shown.contains("minimized"), "{shown}");
    let shown = place.run(&["optimize", "m"], 1);
    assert!(shown.contains("box") && shown.contains("inertia is 0"), "{shown}");
}

#[test]
fn a_file_without_outputs_has_no_derivatives_to_check() {
    let place = TempFolder::new("nothing-to-check");
    let text = "version = 2\n[design.x]\nstart = -1.2\n[objective]\nminimize = \"(1 - x)^2\"\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    assert!(place.run(&["check", "m"], 0).contains("There is nothing to check: without outputs"));
}

/// A four-bar whose coupler point follows eight points with prescribed crank angles: lengths of base, crank, coupler and rocker,
/// coordinates of the point at the start, and the points.
struct PathFit {
    start: [f64; 6],
    x: [f64; 8],
    y: [f64; 8],
    /// The least sum of squares, by SciPy's `least_squares` from the same start (`xtol = ftol = gtol = 1e-15`).
    least: f64,
}

const PATH_FITS: [PathFit; 4] = [
    PathFit {
        start: [4.476555, 1.475392, 3.829754, 4.087378, 1.498381, 0.335306],
        x: [1.923277555, 1.833700567, 1.628680816, 1.334633742, 0.984258563, 0.611690471, 0.249076740, -0.075297594],
        y: [2.112062776, 2.365220414, 2.539171452, 2.625669987, 2.619536510, 2.519302713, 2.330097609, 2.064075202],
        least: 2.413303609e-07,
    },
    PathFit {
        start: [4.885574, 1.820012, 3.439339, 3.522861, 1.527974, 0.815309],
        x: [1.768848191, 1.737164707, 1.568628106, 1.291812989, 0.945825107, 0.567735718, 0.192085929, -0.150825800],
        y: [2.584839469, 2.878151700, 3.078636789, 3.182247863, 3.183801057, 3.084623468, 2.889256615, 2.612134953],
        least: 7.948877464e-07,
    },
    PathFit {
        start: [4.977951, 1.258590, 3.723261, 3.286265, 1.756230, 0.363114],
        x: [2.092643109, 2.051696789, 1.917040805, 1.710253747, 1.455984824, 1.182007733, 0.910581725, 0.661008023],
        y: [2.260874400, 2.409279185, 2.504700823, 2.539671773, 2.518083604, 2.426192466, 2.278857805, 2.075776868],
        least: 1.515027609e-05,
    },
    PathFit {
        start: [3.424474, 1.846479, 3.279370, 4.030817, 1.740254, 1.058348],
        x: [1.052586644, 1.250467340, 1.180937995, 0.922078336, 0.548836815, 0.117259310, -0.326728202, -0.747483048],
        y: [2.769658301, 3.255834406, 3.545716210, 3.700838608, 3.733298162, 3.650540905, 3.455673042, 3.162179433],
        least: 1.369056483e-06,
    },
];

impl PathFit {
    fn text(&self) -> String {
        let variables = ["base", "crank", "coupler", "rocker", "px", "py"].iter().zip(self.start);
        let designs: String = variables.map(|(name, start)| format!("{name} = {{ start = {start} }}\n")).collect();
        format!(
            r#"version = 2
[design]
{designs}
[series]
tx = {:?}
ty = {:?}
[expressions]
ax = "crank*cos(pi/6)"
ay = "crank*sin(pi/6)"
[[body]]
name = "disc"
mass = 1
inertia = 1
position = [0, 0]
angle = "pi/6"
[[body]]
name = "bar"
mass = 1
inertia = 1
position = ["ax", "ay"]
angle = 0.3
[[body]]
name = "lever"
mass = 1
inertia = 1
position = ["base", 0]
angle = 1.5
[[point]]
name = "tracer"
body = "bar"
at = ["px", "py"]
[[joint]]
name = "a0"
a = "ground"
b = "disc"
[[joint]]
name = "a"
a = {{ body = "disc", at = ["crank", 0] }}
b = "bar"
[[joint]]
name = "b"
a = {{ body = "bar", at = ["coupler", 0] }}
b = {{ body = "lever", at = ["rocker", 0] }}
[[joint]]
name = "b0"
a = {{ body = "ground", at = ["base", 0] }}
b = "lever"
[[driver]]
name = "motor"
coordinate = "disc.theta"
motion = "time"
[time]
from = "pi/6"
to = "3*pi/4"
points = 8
[analysis]
kind = "kinematics"
[[output]]
name = "x"
value = "tracer.x"
[[output]]
name = "y"
value = "tracer.y"
[objective]
minimize = "sum((x - tx)^2 + (y - ty)^2)"
"#,
            self.x, self.y
        )
    }
}

/// Rounding errors hide the last decrease of fits with a small residual, so that a run ends in a box that rejected steps have made small:
/// the optimality conditions hold there, and the run has converged.
#[test]
fn fits_with_a_small_residual_converge() {
    for (k, fit) in PATH_FITS.iter().enumerate() {
        let place = TempFolder::new("path-fit");
        std::fs::write(place.0.join("path.toml"), fit.text()).unwrap();
        let told = place.run(&["optimize", "path.toml", "--json"], 0);
        let end: serde_json::Value = serde_json::from_str(told.lines().last().unwrap()).unwrap();
        assert_eq!(end["status"], "Converged", "{k}: {end}");
        let objective = end["objective"]["value"].as_f64().unwrap();
        assert!((objective / fit.least - 1.0).abs() < 1e-6, "{k}: {objective:e} and {:e}", fit.least);
    }
}
