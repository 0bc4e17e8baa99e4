//! Analyses over another quantity than the time: its name, dimension and unit, in files, results and reports.

use linkwright::model_file::read;
use linkwright::report::outcome;

/// A crank whose height is swept over a lift.
pub const LIFT: &str = r#"version = 2
[constants]
length = "200 mm"

[[body]]
name = "arm"
mass = 1
inertia = 0.01
position = [0, 0]

[[joint]]
name = "hinge"
a = "ground"
b = "arm"

[[point]]
name = "tip"
body = "arm"
at = ["length", 0]

[[driver]]
name = "rise"
coordinate = "arm.theta"
motion = "asin(lift/length)"

[sweep]
variable = "lift"
from = "-80 mm"
to = "80 mm"
points = 9

[analysis]
kind = "kinematics"

[[output]]
name = "back"
value = "length - tip.x"
shown_in = "mm"

[[output]]
name = "own"
value = "tip.y - lift"

[design.limit]
start = "30 mm"
lower = "1 mm"
upper = "50 mm"

[objective]
minimize = "limit"

[[constraint]]
name = "near the middle"
value = "back - limit"
at_most = "0 mm"
scale = "10 mm"
from = "-4 cm"
to = "6 cm"
"#;

#[test]
fn a_lift_is_the_axis_of_an_analysis() {
    let model = read("lift.toml", LIFT).unwrap_or_else(|report| panic!("{report}"));
    let grid = model.grid().unwrap();
    assert_eq!((&*grid.name, &*grid.unit, grid.points[0], grid.points[8]), ("lift", "mm", -0.08, 0.08));
    assert_eq!(grid.shown_points()[..3], [-80.0, -60.0, -40.0]);
    let problem = model.problem().unwrap();
    let responses = problem.analyze(&problem.start()).unwrap();
    for (p, lift) in grid.points.iter().enumerate() {
        let exact = 1e3 * (0.2 - (0.04f64 - lift * lift).sqrt());
        assert!((responses.values[0][p] - exact).abs() < 1e-9 && responses.values[1][p].abs() < 1e-12);
    }
    // The constraint holds from -40 to 60 mm, where the largest value is 200 - sqrt(200² - 60²) mm.
    let end = model.method().solve(&problem, |_| ()).unwrap();
    assert!((end.design[0] - (200.0 - (40_000.0f64 - 3600.0).sqrt())).abs() < 1e-6, "{:?}", end.design);
    assert_eq!(problem.time_in_words(Some(0), 7), "lift 60 mm");
}

#[test]
fn plain_numbers_are_in_si_and_units_and_labels_show_them() {
    let plain = LIFT.replace("\"-80 mm\"", "-0.08").replace("\"80 mm\"", "0.08");
    for (keys, unit, first) in [
        ("", "", -0.08),
        ("unit = \"cm\"\n", "cm", -8.0),
        ("unit = \"steps\"\n", "steps", -0.08),
        ("name = \"travel of the wheel\"\nunit = \"in\"\n", "in", -0.08 / 0.0254),
    ] {
        let text = plain.replace("variable = \"lift\"\n", &format!("variable = \"lift\"\n{keys}"));
        let model = read("lift.toml", &text).unwrap_or_else(|report| panic!("{report}"));
        let grid = model.grid().unwrap();
        assert!(grid.unit == unit && (grid.shown_points()[0] - first).abs() < 1e-12, "{keys}: {grid:?}");
    }
    let at = LIFT.replace("from = \"-80 mm\"\nto = \"80 mm\"\npoints = 9", "at = [\"-1 cm\", 0, \"20 mm\"]");
    let model = read("lift.toml", &at).unwrap_or_else(|report| panic!("{report}"));
    assert_eq!((model.grid().unwrap().points.clone(), &*model.grid().unwrap().unit), (vec![-0.01, 0.0, 0.02], "m"));
    // Formulas without a mechanism can be evaluated over a sweep, too.
    let formula = "version = 2\n[sweep]\nvariable = \"angle\"\nto = \"90 deg\"\npoints = 3\n[[output]]\nname = \"height\"\n\
                   value = \"sin(angle)\"\n";
    let model = read("f.toml", formula).unwrap_or_else(|report| panic!("{report}"));
    let values = &model.simulate(&[]).unwrap().values[0];
    assert!((values[1] - 0.5f64.sqrt()).abs() < 1e-15 && model.grid().unwrap().shown_points()[2] == 90.0);
}

/// A text of the file, its replacement, and words of the message.
#[test]
fn numbers_of_a_history_are_taken_at_points_in_the_unit_of_the_axis() {
    let text = format!(
        "{LIFT}\n[[constraint]]\nname = \"at six\"\nvalue = \"at(back, 6 cm)\"\nat_most = \"1 m\"\nscale = \"1 m\"\n\
         [[constraint]]\nname = \"point\"\nvalue = \"own\"\nat_most = \"1 m\"\nscale = \"1 m\"\nfrom = \"6 cm\"\nto = \"60 mm\"\n"
    );
    let problem = read("lift.toml", &text).unwrap_or_else(|report| panic!("{report}")).problem().unwrap();
    let b = problem.start();
    let evaluation = problem.evaluate(&b, &problem.analyze(&b).unwrap()).unwrap();
    let all = outcome::constraints(&problem, &b, &evaluation);
    let six = all.iter().find(|c| c.name == "at six").unwrap();
    assert!((six.value - (0.2 - (0.04f64 - 0.06 * 0.06).sqrt())).abs() < 1e-12, "{six:?}");
    for (wrong, words) in [
        ("at(back, 6 s)", "takes a value in m"),
        ("at(back, 90 mm)", "the lift 90 is not between the first and the last point, -80 and 80 mm"),
        ("mean(back, 61 mm, 62 mm)", "fewer than two points are between 61 and 62 mm"),
    ] {
        let report = read("lift.toml", &text.replace("at(back, 6 cm)", wrong)).err().unwrap().to_string();
        assert!(report.contains(words), "{report}");
    }
}

const MISTAKES: &[[&str; 3]] = &[
    ["variable = \"lift\"\n", "", "variable"],
    ["variable = \"lift\"", "variable = \"length\"", "the name `length` is taken twice"],
    ["variable = \"lift\"", "variable = \"time\"", "the name `time` is reserved"],
    ["variable = \"lift\"", "variable = \"1x\"", "cannot be a name"],
    ["asin(lift/length)", "asin(time/length)", "this file, whose [sweep] is over `lift`"],
    ["asin(lift/length)", "asin(lif/length)", "did you mean `lift`"],
    ["asin(lift/length)", "asin(lift + 1 s)", "cannot be added"],
    ["tip.y - lift", "tip.vx - lift", "cannot be added or compared"],
    ["from = \"-80 mm\"", "from = \"-80 deg\"", "`from` takes a value in m"],
    ["from = \"-80 mm\"", "from = \"-80 mm\"\nunit = \"deg\"", "`unit` is an angle, and the points are a length"],
    ["from = \"-80 mm\"", "from = \"90 mm\"", "must be after the first one"],
    ["from = \"-80 mm\"", "from = \"90 mm\"", "write `first - way` in place of `lift`"],
    ["to = \"80 mm\"\npoints", "to = \"80 mm\"\nat = [1]\npoints", "exclude each other"],
    ["to = \"6 cm\"", "to = \"6 s\"", "`to` takes a value in m"],
    ["kind = \"kinematics\"", "kind = \"dynamics\"", "a motion over time needs [time]"],
    ["[analysis]", "[time]\nto = 1\npoints = 2\n[analysis]", "[time] and [sweep] exclude each other"],
];

#[test]
fn mistakes_in_sweeps_are_named() {
    for [good, bad, words] in MISTAKES {
        assert!(LIFT.contains(good), "`{good}` is not in the file");
        let report =
            read("lift.toml", &LIFT.replacen(good, bad, 1)).err().unwrap_or_else(|| panic!("{bad}: it was read"));
        assert!(report.to_string().contains(words), "{bad}: wanted `{words}` in\n{report}");
    }
}

#[cfg(feature = "cli")]
#[test]
fn tables_and_reports_show_the_axis_in_its_unit() {
    use crate::shell::TempFolder;
    let place = TempFolder::new("sweeps");
    std::fs::write(place.0.join("lift.toml"), LIFT).unwrap();
    let shown = place.run(&["analyze", "lift.toml", "--out", "a"], 0);
    assert!(shown.contains("at lift") && shown.contains("-80"), "{shown}");
    assert!(place.read("a/responses.csv").starts_with("lift,back,own\n-80,"), "{}", place.read("a/responses.csv"));
    place.run(&["optimize", "lift.toml", "--out", "run"], 0);
    assert!(place.read("run/responses.csv").contains("\n-80,"));
    let closest = place.run(&["analyze", "lift.toml"], 0);
    assert!(closest.contains("at 60 mm"), "{closest}");
    place.run(&["report", "run", "--page-only"], 0);
    let page = place.read("run/report.html");
    assert!(page.contains("lift [mm]") && page.contains("The mechanism over the lift."), "axis of the report");
}

/// A parallelogram whose crank turns once: its change points, where the rocker can also turn the other way.
fn parallelogram(points: usize) -> String {
    let body = |name: &str, at: &str, angle: &str| {
        format!("[[body]]\nname = \"{name}\"\nmass = \"m\"\ninertia = 0.01\nposition = {at}\nangle = \"{angle}\"\n")
    };
    format!(
        "version = 2\n[design]\nm = {{ start = 1, lower = 0.5 }}\n{}{}{}[[joint]]\nname = \"A0\"\na = \"ground\"\nb = \"crank\"\n\
         [[joint]]\nname = \"A\"\na = {{ body = \"crank\", at = [0.1, 0] }}\nb = \"coupler\"\n\
         [[joint]]\nname = \"B\"\na = {{ body = \"coupler\", at = [0.3, 0] }}\nb = {{ body = \"rocker\", at = [0.1, 0] }}\n\
         [[joint]]\nname = \"B0\"\na = {{ body = \"ground\", at = [0.3, 0] }}\nb = \"rocker\"\n\
         [[driver]]\nname = \"motor\"\ncoordinate = \"crank.theta\"\nmotion = \"pi/2 + phi\"\n\
         [sweep]\nvariable = \"phi\"\nto = \"360 deg\"\npoints = {points}\n[analysis]\nkind = \"kinematics\"\n\
         [[output]]\nname = \"rocker\"\nvalue = \"rocker.theta - crank.theta\"\n\
         [objective]\nminimize = \"final(rocker)\"\n",
        body("crank", "[0, 0]", "90 deg"),
        body("coupler", "[0, 0.1]", "0 deg"),
        body("rocker", "[0.3, 0]", "90 deg"),
    )
}

/// At a change point velocities and reactions are not determined: a time point there is an error, and others step over it.
#[test]
fn a_change_point_at_a_time_point_is_an_error() {
    let of = |points: usize| {
        let model = read("m.toml", &parallelogram(points)).unwrap_or_else(|report| panic!("{report}"));
        let problem = model.problem().unwrap();
        problem.analyze(&[1.0])
    };
    for points in [5, 9, 13, 37, 73, 121, 361] {
        let reason = of(points).err().map_or_else(|| panic!("{points} points: no error"), |error| error.to_string());
        assert!(
            reason.contains("singular position") && reason.contains("other time points"),
            "{points} points: {reason}"
        );
    }
    for points in [6, 8, 72, 91, 360] {
        let largest = of(points).unwrap().values[0].iter().fold(0.0f64, |a, x| a.max(x.abs()));
        assert!(largest < 1e-9, "{points} points: {largest}");
    }
}

/// A crank-rocker whose crank turns 30 rad: the positions at a time do not depend on the number of time points before it.
#[test]
fn a_branch_is_kept_for_any_distance_of_time_points() {
    let of = |points: usize| {
        let body = |name: &str, at: &str, angle: f64| {
            format!("[[body]]\nname = \"{name}\"\nmass = \"m\"\ninertia = 0.01\nposition = {at}\nangle = {angle}\n")
        };
        let text = format!(
            "version = 2\n[design]\nm = {{ start = 1, lower = 0.5 }}\n{}{}{}\
             [[joint]]\nname = \"A\"\na = \"ground\"\nb = {{ body = \"crank\", at = [-0.05, 0] }}\n\
             [[joint]]\nname = \"B\"\na = {{ body = \"crank\", at = [0.05, 0] }}\nb = {{ body = \"coupler\", at = [-0.15, 0] }}\n\
             [[joint]]\nname = \"C\"\na = {{ body = \"coupler\", at = [0.15, 0] }}\nb = {{ body = \"rocker\", at = [0.13, 0] }}\n\
             [[joint]]\nname = \"D\"\na = {{ body = \"ground\", at = [0.4, 0] }}\nb = {{ body = \"rocker\", at = [-0.13, 0] }}\n\
             [[driver]]\nname = \"motor\"\nkind = \"relative\"\nb = \"crank.theta\"\nmotion = \"10*time\"\n\
             [time]\nto = 3\npoints = {points}\n[analysis]\nkind = \"kinematics\"\n\
             [[output]]\nname = \"rocker\"\nvalue = \"rocker.theta\"\n[objective]\nminimize = \"final(rocker)\"\n",
            body("crank", "[0.05, 0]", 0.0),
            body("coupler", "[0.2, 0.15]", 0.6),
            body("rocker", "[0.37, 0.14]", 1.7),
        );
        let model = read("m.toml", &text).unwrap_or_else(|report| panic!("{report}"));
        model.problem().unwrap().analyze(&[1.0]).unwrap().values[0].clone()
    };
    let fine = of(3601);
    for points in [2, 3, 4, 5, 6, 7, 9, 13, 101] {
        let every = 3600 / (points - 1);
        for (p, angle) in of(points).iter().enumerate() {
            let error = (angle - fine[p * every]).abs();
            assert!(error < 1e-9, "{points} points, point {p}: {error}");
        }
    }
}

/// A pendulum of 1 kg m²/s² that a torque turns; beyond a torque of 1 N m it has no equilibrium.
fn torque(to: f64, points: usize) -> String {
    format!(
        "version = 2\ngravity = [0, -1]\n[[body]]\nname = 'arm'\nmass = 1\ninertia = 0.01\nposition = [0, -1]\n\
         [[joint]]\nname = 'hinge'\na = 'ground'\nb = {{ body = 'arm', at = [0, 1] }}\n\
         [[force]]\nname = 'motor'\nkind = 'load'\nb = 'arm.theta'\ngeneralized_force = 'p'\n\
         [sweep]\nvariable = 'p'\nto = {to}\npoints = {points}\n[analysis]\nkind = 'statics'\n\
         [[output]]\nname = 'angle'\nvalue = 'arm.theta'\n"
    )
}

/// Equilibria exist up to 1 N m. From 0.9 to 1.2 N m, a third of the unbalanced torque can be removed: it is not a third of the load.
#[test]
fn a_load_without_equilibrium_is_told_with_what_was_looked_at() {
    let error = read("m.toml", &torque(1.2, 5)).unwrap().simulate(&[]).err().unwrap().to_string();
    assert!(error.contains("for the load at p 1.2") && !error.contains("p 1.2 "), "{error}");
    assert!(
        error.contains("turns back (limit point) where 33.3") && error.contains("others were not searched"),
        "{error}"
    );
    assert!(!error.contains("exist up to"), "{error}");
}

/// A shallow truss snaps through within a small part of a step of the sweep, whose points have no unit.
#[test]
fn the_ends_of_a_jump_have_different_numbers() {
    let text = "version = 2\n[[body]]\nname = 'top'\nkind = 'point'\nmass = 1\nposition = [0, 0.2]\n\
                [[force]]\neach = [{ n = 'l', s = -1 }, { n = 'r', s = 1 }]\nname = 'bar{n}'\nkind = 'spring'\n\
                a = { body = 'ground', at = ['{s}', 0] }\nb = 'top'\nstiffness = 2000\nlength = 'hypot(1, 0.2)'\n\
                [[force]]\nname = 'P'\nkind = 'load'\nb = 'top.y'\ngeneralized_force = '-p'\n\
                [sweep]\nvariable = 'p'\nto = 20\npoints = 21\n[analysis]\nkind = 'statics'\n\
                [[output]]\nname = 'y'\nvalue = 'top.y'\n";
    let warnings = read("m.toml", text).unwrap().simulate(&[]).unwrap().warnings;
    let jump =
        warnings.iter().find(|warning| warning.contains("jumps between")).unwrap_or_else(|| panic!("{warnings:?}"));
    let ends = jump.split("between p ").nth(1).and_then(|rest| rest.split(" by ").next()).unwrap();
    let (first, last) = ends.split_once(" and p ").unwrap();
    assert!(first.parse::<f64>().unwrap() < last.parse::<f64>().unwrap(), "{jump}");
}

/// Errors of the analysis name the point of the sweep, in its unit.
#[test]
fn failures_name_the_point_of_the_sweep() {
    for kind in ["kinematics", "statics"] {
        let text = LIFT.replace("to = \"80 mm\"", "to = \"240 mm\"").replace("\"kinematics\"", &format!("\"{kind}\""));
        let model = read("lift.toml", &text).unwrap_or_else(|report| panic!("{report}"));
        let error = model.problem().unwrap().analyze(&[30.0]).unwrap_err().to_string();
        assert!(error.contains("at lift 2") && error.contains(" mm") && !error.contains("t = "), "{kind}: {error}");
    }
}
