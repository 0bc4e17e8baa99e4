//! Warnings about results that are doubtful although the analysis has succeeded, wherever its numbers are shown.
#![cfg(feature = "cli")]

use crate::shell::{TempFolder, linkwright};
use linkwright::model_file::read;

/// The impact absorber with a spring that pushes away, and other derivatives.
fn model(place: &TempFolder, derivatives: &str) {
    place.example("impact-absorber");
    let spring =
        "[[force]]\nname = \"magnet\"\nkind = \"coordinate-spring\"\nb = \"mass\"\nstiffness = -0.001\n\n[time]";
    let analysis = format!("[analysis]\nderivatives = \"{derivatives}\"");
    let text = place.read("impact-absorber.toml").replace("[time]", spring).replace("[analysis]", &analysis);
    std::fs::write(place.0.join("magnet.toml"), text).unwrap();
}

#[test]
fn warnings_are_shown_by_every_command_that_shows_the_numbers() {
    for derivatives in ["direct", "central"] {
        let place = TempFolder::new("warnings");
        model(&place, derivatives);
        let warning = "Warning: magnet: its stiffness of -0.001 N/m";
        let run = |arguments: &[&str], code: i32| {
            let shown = place.run(arguments, code);
            assert!(shown.contains(warning), "{arguments:?}: {shown}");
        };
        run(&["analyze", "magnet"], 0);
        let json: serde_json::Value =
            serde_json::from_slice(&linkwright(&["analyze", "magnet", "--json"], &place.0).stdout).unwrap();
        assert!(json["warnings"][0].as_str().unwrap().starts_with("magnet: its stiffness"));
        run(&["sensitivities", "magnet"], 0);
        run(&["optimize", "magnet", "--max-cycles", "2"], 3);
        run(&["resume", "magnet"], 3);
        let summary: serde_json::Value = serde_json::from_str(&place.read("out/magnet/summary.json")).unwrap();
        assert!(summary["warnings"][0].as_str().unwrap().starts_with("magnet: its stiffness"));
        let without_objective = place.read("magnet.toml");
        let from = without_objective.find("[objective]").unwrap();
        std::fs::write(place.0.join("simulation.toml"), &without_objective[..from]).unwrap();
        run(&["analyze", "simulation"], 0);
    }
}

const MODELS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models");

/// The warnings about the model in `text` at its start design.
fn warnings(text: &str) -> Vec<String> {
    let problem = read("m.toml", text).unwrap_or_else(|report| panic!("{report}")).problem().unwrap();
    let start = problem.start();
    let responses = problem.analyze(&start).unwrap();
    problem.analysis.warnings(&start, &responses)
}

/// The first output time at which a function is negative is named: 1 − 2 t from 0.6 s on, and 0.35 − t from 0.4 s on.
#[test]
fn coefficients_that_become_negative_during_the_motion_are_told() {
    let text = "version = 2\n[design.p]\nstart = 1\n[objective]\nminimize = 'p'\n[time]\nto = 1\npoints = 11\n\
                [[body]]\nname = 'ball'\nkind = 'point'\nmass = 2\nposition = [0, 0.8]\n\
                [[force]]\nname = 'spring'\nkind = 'variable-spring'\na = 'ground'\nb = 'ball'\nstiffness = 'p - 2*time'\n\
                [[force]]\nname = 'brake'\nkind = 'variable-damper'\na = 'ground'\nb = 'ball'\ndamping = '0.35*p - time'\n\
                [[output]]\nname = 'k'\nvalue = 'spring.stiffness'\n[[output]]\nname = 'c'\nvalue = 'brake.damping'\n\
                [analysis]\nkind = 'dynamics'\n";
    for steps in ["step = 1e-3\n", "scheme = 'rk8'\ntolerance = 1e-10\n"] {
        let found = warnings(&(text.to_owned() + steps));
        let has = |parts: [&str; 3]| found.iter().any(|warning| parts.iter().all(|part| warning.contains(part)));
        assert!(has(["spring: its stiffness of -0.2", "N/m at t = 0.6 s", "pushes away"]), "{found:?}");
        assert!(has(["brake: its damping of -0.05", "N·s/m at t = 0.4 s", "adds energy"]), "{found:?}");
    }
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

/// A slider on a stiff spring along explicit steps beyond their limit of stability: the motion grows by powers of ten until it overflows.
#[test]
fn explicit_steps_beyond_their_stability_are_told() {
    let spring = |step: &str, to: &str| {
        format!(
            "version = 2\n[design.k]\nstart = 1e6\n[objective]\nminimize = \"0*k + peak(x)\"\n[time]\nto = {to}\npoints = 11\n\
             [analysis]\nkind = \"dynamics\"\nscheme = \"rk5\"\nstep = {step}\n[[body]]\nname = \"m\"\nkind = \"slider\"\nmass = 1\n\
             position = 0.01\n[[force]]\nname = \"s\"\nkind = \"feedback\"\ncoordinate = \"m\"\ngeneralized_force = \"-k*m.position\"\n\
             [[output]]\nname = \"x\"\nvalue = \"m.position\"\n"
        )
    };
    let told = |text: &str, what: &str| {
        let found = warnings(text);
        assert!(found.iter().any(|warning| warning.contains(what)), "{found:?}");
    };
    told(&spring("0.0036", "0.036"), "x: it changes by 6.1e7 times its size if the time step is 7.2e-3 s");
    told(&spring("0.02", "1"), "x: it grows without limit if the time step is 4.0e-2 s");
    let place = TempFolder::new("unstable");
    std::fs::write(place.0.join("model.toml"), spring("0.02", "10")).unwrap();
    let shown = place.run(&["analyze", "model.toml"], 1);
    assert!(shown.contains("not finite at t = ") && shown.contains("take shorter steps"), "{shown}");
}

#[test]
fn angular_velocities_that_do_not_fit_are_named_as_such() {
    let text = "version = 2\nspace = 3\n[design.d]\nstart = 1\n[objective]\nminimize = \"d*final(w)\"\n[time]\nto = 0.1\npoints = 2\n\
                [analysis]\nkind = \"dynamics\"\n[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1.2, 1.4]\nangular_velocity = [1, 0, 2]\n\
                [[joint]]\nname = \"h\"\na = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\naxis = [0, 0, 1]\n\
                [[output]]\nname = \"w\"\nvalue = \"b.omega_z\"\n";
    let found = warnings(text);
    let named =
        "the angular velocity of b is given (1.000000, 0.000000, 2.000000) and becomes (0.000000, 0.000000, 2.000000)";
    assert!(found.iter().any(|warning| warning.contains(named)), "{found:?}");
}

/// y = p sin 2π t at the time points 0, 1/6, 2/6 … s: its largest value is p √3/2 there, and p in between, of which a parabola shows most.
#[test]
fn larger_values_between_the_time_points_are_told() {
    let wish = |objective: &str, constraint: &str| {
        format!(
            "version = 2\n[design.p]\nstart = 1\nlower = 0.5\nupper = 2\n[time]\nto = 1\npoints = 7\n[[output]]\nname = 'y'\n\
             value = 'p*sin(2*pi*time)'\nunit = 'm'\n[objective]\n{objective}\n{constraint}"
        )
    };
    let low = "[[constraint]]\nname = 'dip'\nvalue = 'y'\nat_least = -0.8661\n";
    let cases = [
        (
            "name = 'swing'\nminimize = 'max(y)'",
            "",
            Some("swing: about 0.487 m between the time points, near time 0.25 s, 12 % more than at them"),
        ),
        ("name = 'swing'\nminimize = 'max(y)'\ncontinuous = true", "", None),
        (
            "maximize = 'p'",
            low,
            Some("dip: about -0.974 m between the time points, near time 0.75 s, where the limit is -0.866 m"),
        ),
        ("maximize = 'p'", &low.replace("name", "continuous = true\nname"), None),
    ];
    for (objective, constraint, expected) in cases {
        let place = TempFolder::new("between");
        std::fs::write(place.0.join("m.toml"), wish(objective, constraint)).unwrap();
        let shown = place.run(&["optimize", "m"], 0);
        match expected {
            Some(text) => assert!(shown.contains(text) && shown.contains("continuous = true"), "{shown}"),
            None => assert!(!shown.contains("between the time points"), "{shown}"),
        }
    }
}

/// A body that is turned to a pitch of 90°, at rest in equilibrium or driven through it.
#[test]
fn a_pitch_of_ninety_degrees_is_told_by_every_analysis() {
    let text = |kind: &str| {
        format!(
            "version = 2\nspace = 3\n[design]\np = {{ start = 1, lower = 0.5, upper = 2 }}\n[[body]]\nname = 'b'\nmass = 1\ninertia = [1, 1, 1]\n\
             [[joint]]\nname = 'h'\na = 'ground'\nb = 'b'\nat = [0, 0, 0]\naxis = [0, 1, 0]\n\
             [[driver]]\nname = 'm'\ncoordinate = 'h.angle'\nmotion = 'p*pi/2*time'\n[time]\nto = 2\npoints = 5\n\
             [analysis]\nkind = '{kind}'\n[[output]]\nname = 'yaw'\nvalue = 'b.yaw'\n[objective]\nminimize = 'p'\n"
        )
    };
    for kind in ["kinematics", "statics", "dynamics"] {
        let found = warnings(&text(kind));
        assert!(
            found.iter().any(|warning| warning.contains("pitch") && warning.contains("t = 1")),
            "{kind}: {found:?}"
        );
    }
}

/// A file without an objective, whose title names one of its parts: the message says what is missing, and points at no part.
#[test]
fn sensitivities_without_an_objective_say_what_is_missing() {
    let place = TempFolder::new("no-objective");
    let text = "version = 2\ntitle = \"motion of the arm\"\n[design]\nk = { start = 2, lower = 1, upper = 4 }\n\
                [[body]]\nname = \"arm\"\nkind = \"slider\"\nmass = 1\n\
                [[force]]\nname = \"s\"\nkind = \"coordinate-spring\"\nb = \"arm\"\nstiffness = \"k\"\n\
                [time]\nto = 1\npoints = 3\n[analysis]\nkind = \"statics\"\n[[output]]\nname = \"x\"\nvalue = \"arm.position\"\n";
    std::fs::write(place.0.join("m.toml"), text).unwrap();
    let shown = place.run(&["sensitivities", "m"], 1);
    assert!(shown.contains("there is no objective") && shown.contains("`linkwright check`"), "{shown}");
    assert!(!shown.contains("^^") && !shown.contains("motion of"), "{shown}");
    place.run(&["analyze", "m", "--out", "out"], 0);
    let page = place.read("out/report.html");
    assert!(page.contains("The mechanism in equilibrium over the time."), "the page of statics shows no motion");
    assert!(!page.contains("in motion"));
}

/// A pendulum on its hinge: an equilibrium at the top is told with the point of the sweep, by the name of the part.
#[test]
fn unstable_equilibria_are_told() {
    let text = |height: f64| {
        format!(
            "version = 2\ngravity = [0, -10]\n[[body]]\nname = 'arm'\nmass = 1\ninertia = 0.01\nposition = [0, {height}]\n\
             [[joint]]\nname = 'hinge'\na = 'ground'\nb = {{ body = 'arm', at = [0, {}] }}\n\
             [[force]]\nname = 'motor'\nkind = 'load'\nb = 'arm.theta'\ngeneralized_force = 'p'\n\
             [sweep]\nvariable = 'p'\nto = 2\npoints = 3\n[analysis]\nkind = 'statics'\n\
             [[output]]\nname = 'angle'\nvalue = 'arm.theta'\n",
            -height
        )
    };
    let found = read("m.toml", &text(1.0)).unwrap().simulate(&[]).unwrap().warnings;
    let told = |warning: &String| warning.starts_with("arm") && warning.contains("at p 0 (and 2 more) is unstable");
    assert!(found.iter().any(told), "{found:?}");
    assert_eq!(read("m.toml", &text(-1.0)).unwrap().simulate(&[]).unwrap().warnings, [""; 0]);
}

/// Two points at one place have no direction: a spring whose unloaded length is not zero pushes either way.
#[test]
fn a_spring_between_points_that_coincide_is_told() {
    let text = |space: &str, place: &str, length: f64, kind: &str| {
        format!(
            "version = 2\n{space}[[body]]\nname = 'b'\nkind = 'point'\nmass = 1\nposition = {place}\n[[force]]\nname = 's'\nkind = 'spring'\n\
             a = 'ground'\nb = 'b'\nstiffness = 100\nlength = {length}\n[time]\nto = 0.1\npoints = 3\n\
             [analysis]\nkind = '{kind}'\n[[output]]\nname = 'x'\nvalue = 'b.x'\n"
        )
    };
    let found = |text: String| {
        let model = read("m.toml", &text).unwrap_or_else(|report| panic!("{report}"));
        model.simulate(&[]).map(|responses| responses.warnings).unwrap_or_else(|error| panic!("{error}"))
    };
    for (space, at, apart) in [("", "[0, 0]", "[0.3, 0]"), ("space = 3\n", "[0, 0, 0]", "[0.3, 0, 0]")] {
        let told = found(text(space, at, 0.2, "dynamics"));
        let is_told = |warning: &String| warning.starts_with("s: at t = 0") && warning.contains("length 0");
        assert!(told.iter().any(is_told), "{space}: {told:?}");
        assert_eq!(found(text(space, at, 0.0, "dynamics")), [""; 0], "{space}");
        assert_eq!(found(text(space, apart, 0.2, "dynamics")), [""; 0], "{space}");
    }
}

/// Two links at a right angle that a joint holds at `angle`: at another angle both turn, as positions of the model are estimates. In line, the
/// distance Σ (q − q_guess)² from the guess is least at 3.5 sin θ − 1.5 cos θ + 4 θ = π.
#[test]
fn positions_that_do_not_fit_the_joints_are_told() {
    let links = |angle: &str, more: &str, configuration: &str| {
        format!(
            "version = 2\ngravity = [0, -9.81]\n[design.d]\nstart = 1\n[objective]\nminimize = 'd*final(w)'\n[time]\nto = 0.1\npoints = 3\n\
             [analysis]\nkind = 'dynamics'\ninitial_configuration = '{configuration}'\n\
             [[body]]\nname = 'arm'\nmass = 1\ninertia = 0.1\nposition = [0.5, 0]\n\
             [[body]]\nname = 'club'\nmass = 1\ninertia = 0.1\nposition = [1, 0.5]\nangle = 'pi/2'\n\
             [[joint]]\nname = 'shoulder'\na = 'ground'\nb = {{ body = 'arm', at = [-0.5, 0] }}\n\
             [[joint]]\nname = 'wrist'\nkind = 'fixed'\nangle = '{angle}'\na = {{ body = 'arm', at = [0.5, 0] }}\n\
             b = {{ body = 'club', at = [-0.5, 0] }}\n{more}[[output]]\nname = 'w'\nvalue = 'club.omega'\n"
        )
    };
    let found = warnings(&links("0", "", "built"));
    let told =
        |found: &[String], what: &str| found.iter().any(|w| w.contains("do not fit the joints") && w.contains(what));
    assert!(told(&found, "club.theta is given 1.570796 and becomes 0.600433"), "{found:?}");
    // Estimates near enough, and those of a mechanism that joints and drives determine.
    let driven = "[[driver]]\nname = 'motor'\ncoordinate = 'arm.theta'\nmotion = '0'\n";
    let spring = "[[force]]\nname = 'spring'\nkind = 'coordinate-spring'\nb = 'arm.theta'\nstiffness = 100\n";
    for text in [
        links("pi/2", "", "built"),
        links("1.5", "", "built"),
        links("0", driven, "built"),
        links("0", spring, "equilibrium"),
    ] {
        let found = warnings(&text);
        assert!(!told(&found, ""), "{found:?}\n{text}");
    }
}

#[test]
fn orientations_that_do_not_fit_the_joints_are_told() {
    let text = "version = 2\nspace = 3\n[design.d]\nstart = 1\n[objective]\nminimize = 'd*final(w)'\n[time]\nto = 0.1\npoints = 2\n\
                [analysis]\nkind = 'dynamics'\n[[body]]\nname = 'b'\nmass = 1\ninertia = [1, 1.2, 1.4]\n\
                [[joint]]\nname = 'h'\na = { body = 'ground', at = [0, 0, 0], z = [0, 0, 1] }\n\
                b = { body = 'b', at = [0, 0, 0], z = [0, 'sin(0.5)', 'cos(0.5)'] }\n\
                [[output]]\nname = 'w'\nvalue = 'b.omega_z'\n";
    let found = warnings(text);
    assert!(found.iter().any(|w| w.contains("do not fit the joints") && w.contains("b is turned by 0.5")), "{found:?}");
}
