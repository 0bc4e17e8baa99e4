//! Units in numbers: the same problem in SI and in other units, how values are shown, and messages about wrong units.

use linkwright::model_file::unit::Unit;
use linkwright::model_file::{Model, read, with_setting};
use linkwright::problem::Problem;
use linkwright::report::outcome;

/// A pendulum with a motor and a spring, written in SI.
const SI: &str = r#"
version = 2
gravity = [0, -9.81]
[constants]
load = 2.0
[design.length]
start = 0.4
lower = 0.2
upper = 0.8
[design.stiffness]
start = 1500.0
lower = 100.0
[[body]]
name = "arm"
mass = "1.5*length"
inertia = 0.02
position = ["length/2", 0.01]
angle = 0.1
[[joint]]
name = "pin"
a = "ground"
b = { body = "arm", at = ["-length/2", 0] }
[[force]]
name = "spring"
kind = "spring"
a = { body = "ground", at = [0, 0.3] }
b = { body = "arm", at = ["length/2", 0] }
stiffness = "stiffness"
damping = 12.0
length = 0.3
[[force]]
name = "motor"
kind = "load"
b = "arm.theta"
generalized_force = "load*sin(6.283185307179586*time)"
[time]
to = 0.5
points = 26
[analysis]
kind = "dynamics"
step = 0.002
[[output]]
name = "height"
value = "arm.y"
unit = "m"
[[output]]
name = "tension"
value = "spring.tension"
[objective]
minimize = "rms(height)"
[[constraint]]
name = "low"
value = "height"
at_least = -0.3
[[constraint]]
name = "swing"
value = "range(tension) + 0*stiffness"
at_most = 4000
"#;

/// The same in other units.
fn in_units() -> String {
    let changes = [
        ("gravity = [0, -9.81]", "gravity = [0, \"-9.81 m/s^2\"]"),
        ("load = 2.0", "load = \"2000 N*mm\""),
        ("start = 0.4\nlower = 0.2\nupper = 0.8", "start = \"400 mm\"\nlower = \"20 cm\"\nupper = \"0.8 m\""),
        ("start = 1500.0\nlower = 100.0", "start = \"1.5 kN/m\"\nlower = \"0.1 N/mm\""),
        ("mass = \"1.5*length\"", "mass = \"1.5 kg/m*length\""),
        ("inertia = 0.02", "inertia = \"20 kg*m^2/1000\""),
        ("[\"length/2\", 0.01]", "[\"length/2\", \"10 mm\"]"),
        ("angle = 0.1", "angle = \"18 deg/pi\""),
        ("at = [0, 0.3]", "at = [0, \"300 mm\"]"),
        ("damping = 12.0", "damping = \"12 N·s/m\""),
        ("length = 0.3", "length = \"30 cm\""),
        ("sin(6.283185307179586*time)", "sin(60 rpm*time)"),
        ("to = 0.5", "to = \"500 ms\""),
        ("step = 0.002", "step = \"2 ms\""),
        ("value = \"arm.y\"\nunit = \"m\"", "value = \"arm.y\"\nshown_in = \"mm\""),
        ("minimize = \"rms(height)\"", "minimize = \"rms(height)\"\nshown_in = \"cm\""),
        ("at_least = -0.3", "at_least = \"-30 cm\""),
        ("value = \"range(tension) + 0*stiffness\"\nat_most = 4000", "value = \"range(tension)\"\nat_most = \"4 kN\""),
    ];
    changes.iter().fold(SI.to_owned(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1)
    })
}

fn parsed(text: &str) -> Model {
    read("m.toml", text).unwrap_or_else(|report| panic!("{report}"))
}

fn problem(text: &str) -> Problem {
    parsed(text).problem().unwrap()
}

#[test]
fn a_model_in_other_units_is_the_model_in_si() {
    let [si, other] = [problem(SI), problem(&in_units())];
    let [a, b] = [&si, &other].map(|problem| problem.analyze_design(&problem.start()).unwrap());
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * (1.0 + b.abs());
    assert!(close(b.evaluation.objective, 100.0 * a.evaluation.objective));
    for (x, y) in a.evaluation.residuals.iter().flatten().zip(b.evaluation.residuals.iter().flatten()) {
        assert!(close(*x, *y), "{x} {y}");
    }
    for (p, (x, y)) in a.responses.values[0].iter().zip(&b.responses.values[0]).enumerate() {
        assert!(close(1000.0 * x, *y), "{p}: {x} {y}");
    }
    // d(cm)/d(mm) is 100/1000 of d(m)/d(m).
    let slope = |problem: &Problem, b: &[f64], k: usize, h: f64| {
        let at = |sign: f64| {
            let moved: Vec<f64> = b.iter().enumerate().map(|(i, x)| if i == k { x + sign * h } else { *x }).collect();
            problem.analyze_design(&moved).unwrap().evaluation.objective
        };
        (at(1.0) - at(-1.0)) / (2.0 * h)
    };
    let [m, mm] = [slope(&si, &si.start(), 0, 1e-5), slope(&other, &other.start(), 0, 1e-2)];
    assert!((mm - 0.1 * m).abs() < 1e-6 * m.abs(), "{mm} {m}");
}

#[test]
fn values_are_shown_as_they_are_written() {
    let problem = problem(&in_units());
    let shown = |k: usize| {
        let v = &problem.variables[k];
        (v.unit.clone(), v.start, v.lower, v.upper)
    };
    assert_eq!(shown(0), ("mm".into(), 400.0, 200.0, 800.0));
    assert_eq!(shown(1), ("kN/m".into(), 1.5, 0.1, f64::INFINITY));
    assert_eq!((problem.objective.unit.as_str(), problem.responses[0].unit.as_str()), ("cm", "mm"));
    let here = problem.analyze_design(&problem.start()).unwrap();
    let all = outcome::constraints(&problem, &problem.start(), &here.evaluation);
    let of = |k: usize| (all[k].unit.as_str(), all[k].limit);
    assert_eq!([of(0), of(1)], [("mm", -300.0), ("kN", 4.0)]);
    // A limit that is a constant has its unit.
    let text = in_units().replace("at_most = \"4 kN\"", "at_most = \"strength\"");
    let text = text.replace("load = \"2000 N*mm\"", "load = \"2000 N*mm\"\nstrength = \"4 kN\"");
    let by_constant = self::problem(&text);
    let all = outcome::constraints(&by_constant, &problem.start(), &here.evaluation);
    assert_eq!((all[1].unit.as_str(), all[1].limit), ("kN", 4.0));
    // An explicit unit converts, and the command line takes units.
    let text = with_setting("m", &in_units(), "design.length.unit", "cm").unwrap();
    let text = with_setting("m", &text, "design.length.start", "0.35 m").unwrap();
    let model = parsed(&text);
    let variable = &model.variables()[0];
    assert_eq!((variable.unit.as_str(), variable.start, variable.upper), ("cm", 35.0, 80.0));
}

#[test]
fn a_peak_of_a_shown_output_is_bounded_in_its_unit() {
    let text = in_units().replace(
        "minimize = \"rms(height)\"\nshown_in = \"cm\"",
        "minimize = \"peak(height)\"\nbound = { start = \"0.2 m\" }",
    );
    let problem = problem(&text);
    let bound = problem.variables.last().unwrap();
    // A bound that the file describes has no lower limit unless the file gives one.
    assert_eq!((bound.unit.as_str(), bound.start, bound.lower), ("mm", 200.0, f64::NEG_INFINITY));
    let here = problem.analyze_design(&problem.start()).unwrap();
    let peak = here.responses.values[0].iter().fold(0.0f64, |all, x| all.max(x.abs()));
    let scale = problem.constraints.iter().find(|constraint| constraint.bound.is_some()).unwrap().scale;
    assert!((scale - peak).abs() < 1e-9 * peak, "{scale} {peak}");
}

#[test]
fn wrong_units_say_what_was_expected() {
    let text = in_units();
    for (from, to, message) in [
        ("damping = \"12 N·s/m\"", "damping = \"12 N\"", "`damping` takes a value in N·s/m, and `N` is a force"),
        ("angle = \"18 deg/pi\"", "angle = \"18 mm\"", "`angle` takes a value in rad, and `mm` is a length"),
        ("[0, \"300 mm\"]", "[0, \"300 kg\"]", "`at` takes a value in m, and `kg` is a mass"),
        ("to = \"500 ms\"", "to = \"500 Hz\"", "`to` takes a value in s, and `Hz` is a frequency"),
        (
            "mass = \"1.5 kg/m*length\"",
            "mass = \"1.5 kg*length\"",
            "`mass` takes a value in kg, and this expression is",
        ),
        ("length = \"30 cm\"", "length = \"length + 2 kg\"", "a length and a mass cannot be added"),
        ("length = \"30 cm\"", "length = \"stiffness\"", "takes a value in m, and this expression is a value in kg/s²"),
        ("\"load*sin(60 rpm*time)\"", "\"load*sin(length)\"", "`sin` takes a number or an angle, and this is a length"),
        ("at_least = \"-30 cm\"", "at_least = \"-30 deg\"", "`at_least` is an angle, and the value is a length"),
        ("at_most = \"4 kN\"", "at_most = \"4 kW\"", "`at_most` is a power, and the value is a force"),
        ("shown_in = \"mm\"", "shown_in = \"kg\"", "this is a length, and cannot be shown in kg"),
        ("shown_in = \"mm\"", "shown_in = \"mmm\"", "there is no unit `mmm`"),
        ("shown_in = \"mm\"", "shown_in = \"mm\"\nunit = \"mm\"", "exclude each other"),
        ("\"0.8 m\"", "0.8", "the start has the unit mm, and `upper` has none"),
        ("\"0.8 m\"", "\"0.8 s\"", "`upper` takes a value in mm, and `s` is a time"),
        ("start = \"400 mm\"", "start = 0.4", "`lower` has a unit, and the start has none"),
        ("start = \"400 mm\"", "start = \"400 mn\"", "there is no unit `mn`"),
        ("start = \"400 mm\"", "start = \"400 m*g\"\nunit = \"kN\"", "`unit` is a force, and the start is"),
        ("start = \"400 mm\"", "start = \"400 mm 3\"", "expected an operator or the end"),
        (
            "kind = \"load\"",
            "kind = \"friction\"\ncoulomb_force = 1\nspeed = \"3 Hz\"",
            "`speed` takes a value in m/s or rad/s, and `Hz` is a frequency",
        ),
        ("load = \"2000 N*mm\"", "load = \"2000 N*mm\"\nmm = 3", "`mm` is a unit here, and a name of this file"),
    ] {
        assert!(text.contains(from), "{from}");
        let mut wrong = text.replacen(from, to, 1);
        if to.contains("friction") {
            wrong = wrong.replacen("generalized_force = \"load*sin(60 rpm*time)\"\n", "", 1);
        }
        let report = match read("m.toml", &wrong) {
            Err(report) => report.to_string(),
            Ok(_) => panic!("{to} is accepted"),
        };
        assert!(report.contains(message), "{to}: {report}");
        assert!(report.contains("m.toml:") && report.contains('^'), "{report}");
        let is_consequence = !message.contains("the start has none") && report.contains("the start has none");
        assert!(!is_consequence, "{to}: {report}");
    }
}

/// `2 1/s` is a number with a unit; `2/s` divides by a name, and the message says how a unit is written.
#[test]
fn a_number_may_have_an_inverse_unit() {
    let objective = |value: &str| {
        let text =
            format!("version = 2\n[design.x]\nstart = \"3 m\"\n[objective]\nminimize = \"{value}\"\nunit = \"m/s\"\n");
        read("m.toml", &text).map_err(|report| report.to_string())
    };
    for value in ["x * 2 1/s", "2 1/s * x", "x*(2 s^-1)", "x * 2 1/s + 0 m/s"] {
        let problem = objective(value).unwrap_or_else(|why| panic!("{value}: {why}")).problem().unwrap();
        let start = problem.start();
        let evaluation = problem.evaluate(&start, &problem.analyze(&start).unwrap()).unwrap();
        assert_eq!(evaluation.objective, 6.0, "{value}");
    }
    let why = objective("x * 2/s").err().unwrap();
    assert!(why.contains("there is no name `s`") && why.contains("`2 1/s`"), "{why}");
    for wrong in ["x * 2 1", "x * 2 1/q", "x * 2 10"] {
        assert!(objective(wrong).is_err(), "{wrong}");
    }
}

#[test]
fn a_plain_number_may_stand_for_any_unit() {
    for (from, to) in [
        ("mass = \"1.5 kg/m*length\"", "mass = \"1.5*length\""),
        ("\"load*sin(60 rpm*time)\"", "\"load*sin(6*time) + 0.1*time\""),
        ("length = \"30 cm\"", "length = \"max(0.3, 200 mm)\""),
        ("at_least = \"-30 cm\"", "at_least = -0.3"),
        ("lower = \"20 cm\"", "lower = 0"),
    ] {
        assert!(in_units().contains(from), "{from}");
        parsed(&in_units().replacen(from, to, 1));
    }
}

#[test]
fn units_have_the_factors_of_their_definitions() {
    for (text, si, shown, base) in [
        ("mm", 1e-3, "mm", "m"),
        ("kN*m/rad", 1e3, "kN·m/rad", "m²·kg/s²/rad"),
        ("N/mm^2", 1e6, "N/mm²", "kg/m/s²"),
        ("m/s²", 1.0, "m/s²", "m/s²"),
        ("km/h", 1.0 / 3.6, "km/h", "m/s"),
        ("in", 0.0254, "in", "m"),
        ("cm⁴", 1e-8, "cm⁴", "m⁴"),
        ("N/m^1.5", 1.0, "N/m^1.5", "kg/m^0.5/s²"),
        ("GPa", 1e9, "GPa", "kg/m/s²"),
        ("kg", 1.0, "kg", "kg"),
        ("rpm", std::f64::consts::PI / 30.0, "rpm", "rad/s"),
    ] {
        let unit = Unit::parse(text).unwrap();
        assert!((unit.to_si(1.0) / si - 1.0).abs() < 1e-15, "{text}: {}", unit.to_si(1.0));
        assert_eq!((unit.text.as_str(), unit.dimension.base_units().as_str()), (shown, base), "{text}");
        assert!((unit.of_si(unit.to_si(0.7)) / 0.7 - 1.0).abs() < 1e-15);
    }
    assert_eq!([Unit::parse("mm").unwrap().to_si(120.0), Unit::parse("kg").unwrap().to_si(0.3)], [0.12, 0.3]);
    for text in ["", "xm", "kin", "m/", "m^", "m^x", "m(2)", "mkg", "m/1"] {
        assert_eq!(Unit::parse(text), None, "{text}");
    }
    // A name after a sign begins another operand.
    assert_eq!(Unit::at_start("mm*width").map(|(unit, length)| (unit.text, length)), Some(("mm".into(), 2)));
    assert_eq!(Unit::at_start("N*m + 1").map(|(_, length)| length), Some(3));
}

#[test]
fn revolutions_per_second_are_no_angular_velocity() {
    let of = |text: &str| Unit::parse(text).unwrap().dimension;
    assert!(!of("Hz").is_written_like(of("rad/s")) && of("rpm").is_written_like(of("rad/s")));
    assert!(of("N*m").is_written_like(of("N*m/rad")) && of("Hz").is_like(of("rad/s")));
    assert!(!of("Hz").fits(of("rad/s")) && !of("rpm").fits(of("Hz")) && !of("Hz*s").fits(of("rad")));
    // Of 1/s nothing is known: √(stiffness/mass) is an angular velocity, speed/pitch a frequency.
    assert!(of("1/s").fits(of("rad/s")) && of("1/s").fits(of("Hz")) && of("rad*Hz").fits(of("rpm")));
    assert_eq!([of("Hz"), of("1/s"), of("Hz*s")].map(|d| d.si_unit()), ["Hz", "1/s", ""]);
    assert_eq!(of("kN").to_string(), "a force");
    assert_eq!(of("N/m").to_string(), "a value in kg/s²");
}

/// A frequency is not accepted as an angular velocity by any route: through constants, variables, expressions, sums, units of outputs and limits.
#[test]
fn a_frequency_is_not_taken_for_an_angular_velocity() {
    let text = in_units();
    let put = |names: &str, from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, to, 1).replacen("[constants]", &format!("[constants]\n{names}"), 1)
    };
    let motor = "\"load*sin(60 rpm*time)\"";
    let friction = |speed: &str| {
        format!(
            "\"0 N*m\"\n[[force]]\nname = \"rub\"\nkind = \"friction\"\nb = \"arm.theta\"\ncoulomb_force = 1\nspeed = \"{speed}\""
        )
    };
    let output = |value: &str, unit: &str| {
        format!("[[output]]\nname = \"turns\"\nvalue = \"{value}\"\nshown_in = \"{unit}\"\n[objective]")
    };
    let limit = |value: &str, limit: &str| {
        format!("[[constraint]]\nname = \"turns\"\nvalue = \"{value}\"\nat_most = \"{limit}\"\n[objective]")
    };
    let turning = "[[output]]\nname = \"turning\"\nvalue = \"arm.omega\"\n[objective]";
    let refused = [
        put("f = \"5 Hz\"", motor, &friction("f")),
        put("f = \"5 Hz\"\ng = \"2*f - f\"", motor, &friction("f + 1 Hz")),
        put("f = \"5 Hz\"", motor, "\"load*sin(f*time)\""),
        put("f = \"5 Hz\"", motor, "\"load*sin(60 rpm*time) + 0*(f + 60 rpm)\""),
        put("f = \"5 Hz\"", motor, "\"load*max(f, 60 rpm)*0\""),
        put("", "[objective]", &output("arm.omega", "Hz")),
        put("w = \"300 rpm\"", "[objective]", &output("w", "Hz")),
        put("f = \"5 Hz\"", "[objective]", &output("f", "rpm")),
        put("f = \"5 Hz\"", "[objective]", &output("f", "deg/s")),
        put("f = \"5 Hz\"", "[objective]", &output("f*time", "deg")),
        put("", "[objective]", &limit("max(turning)", "5 Hz")).replacen("[objective]", turning, 1),
        put("w = \"300 rpm\"", "[objective]", &limit("max(w, w)", "5 Hz")),
    ];
    for text in refused {
        let report = read("m.toml", &text).map(drop).expect_err(&text).to_string();
        assert!(report.contains("cycles") || report.contains("frequency"), "{report}");
        assert!(report.contains("2*pi"), "{report}");
    }
    let accepted = [
        put("f = \"5 Hz\"", motor, &friction("2*pi*f")),
        put("f = \"5 Hz\"", motor, &friction("6.28 rad*f")),
        put("f = \"5 Hz\"", motor, "\"load*sin(2*pi*f*time)\""),
        put("f = \"5 Hz\"", motor, "\"load*exp(-f*time)\""),
        put("w = \"300 rpm\"", motor, &friction("w")),
        put("w = \"30 deg/s\"", motor, &friction("w + 2 rad/s")),
        put("k = \"9 N/m\"\nw0 = \"1 kg\"", motor, &friction("sqrt(k/w0)")),
        put("", "[objective]", &output("arm.omega", "rpm")),
        put("", "[objective]", &output("arm.omega", "rev/s")),
        put("", "[objective]", &output("arm.omega/(2*pi)", "Hz")),
        put("", "[objective]", &output("arm.omega/(360 deg)", "Hz")),
        put("f = \"5 Hz\"", "[objective]", &output("f", "kHz")),
        put("f = \"5 Hz\"", "[objective]", &limit("max(f, f)", "9 Hz")),
    ];
    for text in accepted {
        read("m.toml", &text).map(drop).unwrap_or_else(|report| panic!("{report}"));
    }
}

/// The unit that an output of the model in SI shows with these lines, and the note.
fn labelled(value: &str, unit: &str) -> (String, String) {
    let text = SI.replace("value = \"arm.y\"\nunit = \"m\"", &format!("value = \"{value}\"\n{unit}"));
    assert_ne!(text, SI);
    let model = read("m.toml", &text).unwrap();
    let shown = model.output_names().next().unwrap().1.to_owned();
    (shown, model.note().map(|note| note.to_string()).unwrap_or_default())
}

/// A number is never shown with a unit that is not its own: `unit` converts nothing.
#[test]
fn a_false_label_is_told_and_not_shown() {
    let false_ones = [
        ("arm.theta", "deg", "rad", Some("deg")),
        ("arm.y", "mm", "m", Some("mm")),
        ("arm.omega", "rpm", "rad/s", Some("rpm")),
        ("arm.omega", "Hz", "rad/s", None),
        ("spring.tension", "kN", "N", Some("kN")),
        ("spring.tension", "N·m", "N", None),
        ("arm.y/arm.x", "%", "", Some("%")),
        ("kinetic_energy/arm.y", "J", "N", None),
        ("time", "ms", "s", Some("ms")),
    ];
    for (value, unit, shown, remedy) in false_ones {
        let (found, note) = labelled(value, &format!("unit = \"{unit}\""));
        assert_eq!(found, shown, "{value} in {unit}");
        assert!(
            note.contains("no unit of these") || note.contains("is not the unit of these values"),
            "{value}: {note}"
        );
        if let Some(remedy) = remedy {
            assert!(note.contains(&format!("shown_in = \"{remedy}\"")), "{note}");
        }
    }
    let true_ones = [
        ("arm.theta", "rad"),
        ("spring.tension", "kg*m/s^2"),
        ("arm.theta*180/pi", "deg"),
        ("1000*arm.y", "mm"),
        ("arm.theta", "turns"),
        ("sin(arm.theta)", "m"),
        ("length", "mm"),
    ];
    for (value, unit) in true_ones {
        assert_eq!(labelled(value, &format!("unit = \"{unit}\"")), (unit.to_owned(), String::new()), "{value}");
    }
    assert_eq!(labelled("arm.theta", "shown_in = \"deg\""), ("deg".to_owned(), String::new()));
}

/// The limits of an output with a false label stay what they were, and so do its numbers.
#[test]
fn a_false_label_changes_no_number() {
    let with = |unit: &str| {
        let text = SI.replace("unit = \"m\"", unit);
        let problem = read("m.toml", &text).unwrap().problem().unwrap();
        let responses = problem.analyze(&problem.start()).unwrap();
        let evaluation = problem.evaluate(&problem.start(), &responses).unwrap();
        (responses.values, evaluation.objective, evaluation.residuals)
    };
    assert_eq!(with("unit = \"mm\""), with("unit = \"m\""));
}

/// Labels of objective, bound and time points do not convert either.
#[test]
fn labels_of_the_objective_and_of_the_time_are_true() {
    let noted = |text: &str| {
        let model = read("m.toml", text).unwrap();
        let problem = model.problem().unwrap();
        let note = model.note().map(|note| note.to_string()).unwrap_or_default();
        (problem.objective.unit.clone(), problem.grids[0].unit.clone(), note)
    };
    let objective = |lines: &str| noted(&SI.replace("minimize = \"rms(height)\"", lines));
    let (unit, time, note) = objective("minimize = \"rms(height)\"\nunit = \"mm\"");
    assert_eq!((unit.as_str(), time.as_str(), note.matches("= help: shown_in").count()), ("m", "s", 1), "{note}");
    let (unit, _, note) = objective("minimize = \"rms(height)\"\nshown_in = \"mm\"");
    assert_eq!((unit.as_str(), note.as_str()), ("mm", ""));
    let (unit, _, note) =
        objective("minimize = \"height\"\nover = \"peak\"\nbound = { name = \"most\", start = 1.0, unit = \"mm\" }");
    assert_eq!((unit.as_str(), note.contains("shown_in")), ("m", false), "{note}");
    let (unit, _, note) = objective("minimize = \"height\"\nover = \"integral\"\nunit = \"m·s\"");
    assert_eq!((unit.as_str(), note.as_str()), ("m·s", ""));
    let (_, time, note) = noted(&SI.replace("points = 26", "points = 26\nunit = \"ms\""));
    assert_eq!((time.as_str(), note.contains("`ms` is not the unit")), ("s", true), "{note}");
    // In the unit of an output that is converted.
    let shown = SI.replace("value = \"arm.y\"\nunit = \"m\"", "value = \"arm.y\"\nshown_in = \"mm\"");
    let shown = shown.replace("minimize = \"rms(height)\"", "minimize = \"peak(height)\"\nunit = \"m\"");
    let (unit, _, note) = noted(&shown);
    assert_eq!((unit.as_str(), note.contains("they are in mm")), ("mm", true), "{note}");
}

/// Files without any number with a unit may be in other units, if their design variables say so.
#[test]
fn other_consistent_units_are_those_of_the_design_variables() {
    let file = |name: &str| format!("{}/examples/models/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(file("vehicle-suspension")).unwrap();
    let model = read("m.toml", &text).unwrap();
    assert!(model.note().is_none());
    assert!(model.output_names().all(|(_, unit, _)| unit.starts_with("in")));
    let inches = SI.replace("start = 0.4", "start = 0.4\nunit = \"in\"").replace("unit = \"m\"", "unit = \"in\"");
    assert!(read("m.toml", &inches).unwrap().note().is_none());
    // One number with a unit: the file is in SI.
    for number in ["gravity = [0, \"-9.81 m/s^2\"]", "gravity = [0, -9.81]\ntable.t = { x = [\"0 s\", 1], y = [1, 1] }"]
    {
        let model = read("m.toml", &inches.replace("gravity = [0, -9.81]", number)).unwrap();
        let note = model.note().unwrap().to_string();
        assert!(note.contains("they are in m, and are shown so"), "{note}");
    }
}

/// No example needs a note.
#[test]
fn labels_of_all_examples_are_true() {
    for file in std::fs::read_dir(format!("{}/examples/models", env!("CARGO_MANIFEST_DIR"))).unwrap() {
        let path = file.unwrap().path();
        if path.extension().is_some_and(|e| e == "toml") {
            let model = read(&path.display().to_string(), &std::fs::read_to_string(&path).unwrap());
            // Files with tables or parts in other files are read elsewhere.
            let Ok(model) = model else { continue };
            let note = model.note().map(|note| note.to_string()).unwrap_or_default();
            assert!(note.is_empty() || note.contains("version"), "{note}");
        }
    }
}

/// A unit in which a value is shown is none of an expression: its symbols are not taken for names of the file. Those of a limit are, at the
/// limit.
#[test]
fn a_symbol_of_a_unit_that_is_a_name_is_an_error_where_it_is_written() {
    let head = "version = 2\n[constants]\nm = \"2 kg\"\n[design]\nx = { start = \"3 m\", lower = \"0 m\", upper = \"9 m\" }\n\
        [[output]]\nname = \"moment\"\nvalue = \"m*x\"\nshown_in = \"g*m\"\n[objective]\nminimize = \"moment\"\n";
    let problem = problem(head);
    let here = problem.analyze_design(&problem.start()).unwrap();
    assert_eq!((here.evaluation.objective, problem.objective.unit.as_str()), (6000.0, "g·m"));
    let limited = format!("{head}[[constraint]]\nname = \"c\"\nvalue = \"m*x\"\nat_most = \"7 kg*m\"\n");
    let report = read("m.toml", &limited).err().expect("the unit is ambiguous").to_string();
    assert!(report.contains("`m` is a unit here") && report.contains("| at_most = "), "{report}");
}
