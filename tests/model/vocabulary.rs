//! What a model file can say besides numbers: tables, included files, copies with constants of their own, poses at the start of the motion.

use crate::shell::TempFolder;
use linkwright::model_file::{Model, read, schema, with_files, with_setting};

fn parsed(text: &str) -> Model {
    read("m.toml", text).unwrap_or_else(|report| panic!("{report}"))
}

fn report(text: &str) -> String {
    match read("m.toml", text) {
        Err(report) => report.to_string(),
        Ok(_) => panic!("the text is accepted: {text}"),
    }
}

/// The objective of a file at its start.
fn objective(text: &str) -> f64 {
    let problem = parsed(text).problem().unwrap();
    problem.analyze_design(&problem.start()).unwrap().evaluation.objective
}

fn formula(tables: &str, value: &str) -> String {
    format!(
        "version = 2\n[design.x]\nstart = 1.5\n{tables}\n[[output]]\nname = \"f\"\nvalue = \"{value}\"\n[objective]\nminimize = \"f\"\n"
    )
}

#[test]
fn a_table_is_a_function() {
    let points = "x = [0, 1, 2, 4]\ny = [0, 1, 4, 16]\n";
    let linear =
        formula(&format!("[table.lift]\n{points}interpolation = \"linear\""), "2*lift(x) + lift(5) + lift(-1)");
    // Straight lines, also beyond the ends: 2.5, 16 + 6, −1.
    assert!((objective(&linear) - (5.0 + 22.0 - 1.0)).abs() < 1e-12);
    let cubic = formula(&format!("[table.lift]\n{points}"), "lift(x)");
    assert!((objective(&cubic) - 2.25).abs() < 0.2);
    let problem = parsed(&cubic).problem().unwrap();
    let b = problem.start();
    let f = |x: f64| problem.analyze_design(&[x]).unwrap().evaluation.objective;
    let responses = problem.analyze(&b).unwrap();
    let at = [linkwright::problem::ResponseAt { response: 0, point: 0 }];
    let slope = problem.sensitivities(&b, &responses, &at).unwrap()[(0, 0)];
    assert!((slope - (f(1.5 + 1e-6) - f(1.5 - 1e-6)) / 2e-6).abs() < 1e-7);
    for (tables, value, message) in [
        ("[table.lift]\nx = [0, 1]\ny = [0]", "lift(x)", "has 2 x and 1 y"),
        ("[table.lift]\nx = [0, 0]\ny = [0, 1]", "lift(x)", "must have two or more increasing numbers"),
        ("[table.lift]\nx = [0, 1]", "lift(x)", "lacks `y`"),
        ("[table.lift]\nx = [0, 1]\ny = [0, 1]", "lfit(x)", "did you mean `lift`?"),
        ("[table.sin]\nx = [0, 1]\ny = [0, 1]", "x", "is reserved"),
        ("[table.lift]\nfile = \"lift.csv\"", "lift(x)", "is not attached"),
    ] {
        let found = report(&formula(tables, value));
        assert!(found.contains(message), "{tables}: {found}");
    }
}

#[test]
fn files_are_included_and_belong_to_the_text() {
    let place = TempFolder::new("include");
    let write = |name: &str, text: &str| {
        let path = place.0.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, text).unwrap();
    };
    write("parts/steel.toml", "include = [\"parts/units.toml\"]\n[constants]\ndensity = \"7800 kg/m^3\"\n");
    write("parts/units.toml", "[constants]\ngram = \"1 g\"\n");
    write("lift.csv", "# measured\nangle; lift\n0; 0\n1; 1\n2; 4\n");
    let text = format!(
        "include = [\"parts/steel.toml\"]\n{}",
        formula(
            "[table.lift]\nfile = \"lift.csv\"\ninterpolation = \"linear\"",
            "lift(x) + density/1000 kg^-1*m^3 + gram/(1 kg)"
        )
    );
    let text = text.replace("density/1000 kg^-1*m^3", "density/(1000 kg/m^3)");
    let whole = with_files("m.toml", &text, &place.0).unwrap_or_else(|report| panic!("{report}"));
    assert!((objective(&whole) - (2.5 + 7.8 + 0.001)).abs() < 1e-12);
    // Attaching again changes nothing, a setting of an included file can be changed, and the content belongs to the fingerprint.
    assert_eq!(with_files("m.toml", &whole, &place.0).unwrap(), whole);
    let heavier = with_setting("m.toml", &whole, "constants.density", "9000 kg/m^3").unwrap();
    assert!((objective(&heavier) - (2.5 + 9.0 + 0.001)).abs() < 1e-12);
    let added = with_setting("m.toml", &whole, "method.max_cycles", "3").unwrap();
    assert_eq!(parsed(&added).fingerprint(), parsed(&whole).fingerprint());
    assert_ne!(parsed(&heavier).fingerprint(), parsed(&whole).fingerprint());
    assert_ne!(parsed(&whole.replace("2; 4", "2; 5")).fingerprint(), parsed(&whole).fingerprint());

    // Mistakes are shown in the file that has them.
    let wrong = report(&whole.replace("7800 kg/m^3", "7800 kgg"));
    assert!(wrong.contains("--> parts/steel.toml:3:17"), "{wrong}");
    let wrong = report(&whole.replace("2; 4", "2; four"));
    assert!(wrong.contains("--> lift.csv:5:4") && wrong.contains("`four` is not a number"), "{wrong}");
    // A row with a number is no heading.
    let wrong = report(&whole.replace("0; 0", "0 mm; 0"));
    assert!(wrong.contains("--> lift.csv:3:1") && wrong.contains("`0 mm` is not a number"), "{wrong}");
    let twice = report(&whole.replace("version = 2\n", "version = 2\n[constants]\ngram = 1\n"));
    assert!(twice.contains("`gram` of [constants] is defined twice"), "{twice}");

    // A path stays inside the folder, and circles are named.
    let fail = |text: &str| with_files("m.toml", text, &place.0).unwrap_err().to_string();
    for name in ["../m.toml", "/etc/hostname", "parts/../../x.toml", ""] {
        let found = fail(&format!("include = [\"{name}\"]\n"));
        assert!(found.contains("leaves the folder") && found.contains("m.toml:1:12"), "{found}");
    }
    assert!(fail("include = [\"none.toml\"]\n").contains("cannot read `none.toml`"));
    write("a.toml", "include = [\"b.toml\"]\n");
    write("b.toml", "include = [\"a.toml\"]\n");
    let circle = fail("include = [\"a.toml\"]\n");
    assert!(circle.contains("`a.toml` includes itself") && circle.contains("a.toml → b.toml → a.toml"), "{circle}");

    // The command reads them, too, and stores one text with the run.
    write("m.toml", &text);
    place.run(&["check", "m"], 0);
}

#[test]
fn copies_have_constants_of_their_own() {
    let text = "version = 2\n[design.x]\nstart = 2.0\n[[output]]\neach = [{ name = \"thigh\", m = 1.5, l = \"400 mm\" }, { name = \"shank\", m = 3, l = \"x\" }]\n\
        name = \"{name}\"\nvalue = \"{m}*({l})\"\n[objective]\nminimize = \"thigh + 10*shank\"\n";
    assert!((objective(text) - (0.6 + 60.0)).abs() < 1e-12);
    let different = report(&text.replace(", m = 3,", ","));
    assert!(different.contains("the tables of `each` have different keys"), "{different}");
    assert!(report(&text.replace("{ name = \"thigh\", m = 1.5, l = \"400 mm\" }", "3")).contains("an item of `each`"));
    assert!(schema()["$defs"]["output"]["properties"]["each"]["anyOf"].is_array());
}

#[test]
fn a_body_begins_where_its_driver_does() {
    let model = |angle: &str, start: &str| {
        format!(
            "version = 2\n[design.l]\nstart = 0.3\n[expressions]\nturn = \"1.2 + 60 rpm*time\"\n[[body]]\nname = \"crank\"\nmass = 1\ninertia = 0.01\n\
             position = [\"l*cos(turn)\", \"l*sin(turn)\"]\nangle = \"{angle}\"\n[[joint]]\nname = \"pin\"\na = \"ground\"\n\
             b = {{ body = \"crank\", at = [\"-l\", 0] }}\n[[driver]]\nname = \"motor\"\ncoordinate = \"crank.theta\"\nmotion = \"turn\"\n\
             [time]\nfrom = 0.25\nto = 0.5\npoints = 6\n[analysis]\nkind = \"dynamics\"\nstep = 0.01\nstart = {start}\n[[output]]\nname = \"x\"\nvalue = \"crank.x\"\n\
             [objective]\nminimize = \"initial(x)\"\n"
        )
    };
    let expected = 0.3 * (1.2 + std::f64::consts::FRAC_PI_2).cos();
    for start in ["0.25", "0"] {
        let found = objective(&model("turn", start));
        assert!((found - expected).abs() < 1e-6, "{start}: {found} {expected}");
    }
}

#[test]
#[cfg(feature = "report")]
fn loads_and_drives_have_arrows() {
    let text = "version = 2\n[[body]]\nname = \"crank\"\nmass = 1\ninertia = 0.01\nposition = [0.3, 0]\n[[joint]]\nname = \"pin\"\na = \"ground\"\n\
        b = { body = \"crank\", at = [-0.3, 0] }\n[[driver]]\nname = \"motor\"\ncoordinate = \"crank.theta\"\nmotion = \"60 rpm*time\"\n\
        [[force]]\nname = \"push\"\nkind = \"force\"\nat = { body = \"crank\", at = [0.2, 0] }\ndirection = \"90 deg\"\nforce = \"5 N\"\n\
        [time]\nto = 0.5\npoints = 51\n[analysis]\nkind = \"kinematics\"\n[[output]]\nname = \"x\"\nvalue = \"crank.x\"\n";
    let frames = parsed(text).drawings(&[&[]], &[0.0, 0.25]).unwrap().unwrap().remove(0);
    // The motor turns around the pin on the ground; the force ends at its point and keeps its direction.
    let [turn, force] = &frames[1].arrows[..] else { panic!("{:?}", frames[1].arrows) };
    let radii: Vec<f64> = turn.iter().map(|p| p[0].hypot(p[1])).collect();
    assert!(radii.iter().all(|r| (r - radii[0]).abs() < 1e-9 && *r > 0.0), "{radii:?}");
    let [from, tip] = force[..] else { panic!("{force:?}") };
    assert!(
        tip[0].abs() < 1e-6 && (tip[1] - 0.5).abs() < 1e-6 && (from[0] - tip[0]).abs() < 1e-9 && from[1] < tip[1],
        "{force:?}"
    );
}

#[test]
#[cfg(feature = "report")]
fn a_torque_in_space_is_an_arc_around_its_axis() {
    let text = "version = 2\nspace = 3\n[[body]]\nname = \"top\"\nmass = 1\ninertia = [1, 1, 1]\nposition = [1, 2, 3]\n\
        [[force]]\nname = \"motor\"\nkind = \"torque\"\nat = \"top\"\ndirection = [0, 2, 0]\nmagnitude = 1\n\
        [[force]]\nname = \"push\"\nkind = \"force\"\nat = \"top\"\ndirection = [0, 2, 0]\nmagnitude = 0\n\
        [time]\nto = 0.1\npoints = 3\n[analysis]\nkind = \"dynamics\"\n[[output]]\nname = \"x\"\nvalue = \"top.x\"\n";
    let frames = parsed(text).drawings(&[&[]], &[0.0]).unwrap().unwrap().remove(0);
    let [arc, push] = &frames[0].space.as_ref().unwrap().arrows[..] else { panic!("{:?}", frames[0].space) };
    let levers: Vec<[f64; 2]> = arc.iter().map(|p| [p[2] - 3.0, p[0] - 1.0]).collect();
    let radius = levers[0][0].hypot(levers[0][1]);
    assert!(arc.iter().all(|p| (p[1] - 2.0).abs() < 1e-12) && radius > 0.0, "{arc:?}");
    // About y, a positive rotation turns z to x.
    for pair in levers.windows(2) {
        assert!((pair[1][0].hypot(pair[1][1]) - radius).abs() < 1e-12, "{levers:?}");
        assert!(pair[0][0] * pair[1][1] > pair[0][1] * pair[1][0], "{levers:?}");
    }
    assert!(push.len() == 2 && push[1] == [1.0, 2.0, 3.0] && push[0][1] < 2.0, "{push:?}");
}

#[test]
#[cfg(feature = "report")]
fn a_released_joint_is_drawn_until_it_comes_apart() {
    let text = include_str!("../../examples/models/trebuchet.toml");
    let model = parsed(text);
    let start: Vec<f64> = model.variables().iter().map(|variable| variable.start).collect();
    let frames = model.drawings(&[&start], &[0.0, 0.5, 3.0]).unwrap().unwrap().remove(0);
    let bars: Vec<usize> = frames.iter().map(|frame| frame.bars.len()).collect();
    assert!(bars[0] == bars[1] && bars[2] + 1 == bars[0], "{bars:?}");
    // Frames of the interactive tool have the same parts: the rope stays as a point at the tip of the arm.
    let frames = model.frames(&start, &[0.0, 0.5, 3.0]).unwrap().unwrap();
    assert!(frames.iter().all(|frame| frame.bars.len() == bars[0]), "{frames:?}");
    let length = |bar: &Vec<[f64; 2]>| (bar[1][0] - bar[0][0]).hypot(bar[1][1] - bar[0][1]);
    let shortest = |k: usize| frames[k].bars.iter().map(length).fold(f64::INFINITY, f64::min);
    assert!(shortest(1) > 1.0 && shortest(2) < 1e-12, "{frames:?}");
    // The same in space, where a ball hangs on a rod that is released.
    let text = "version = 2\nspace = 3\ngravity = [0, 0, -9.81]\n[[body]]\nname = \"ball\"\nkind = \"point\"\nmass = 1\nposition = [0, 0, -1]\n\
        [[joint]]\nname = \"rod\"\nkind = \"distance\"\na = \"ground\"\nb = \"ball\"\nlength = 1\n\
        [[event]]\nname = \"cut\"\nwhen = \"time > 0.2\"\nrelease = \"rod\"\n\
        [time]\nto = 1\npoints = 11\n[analysis]\nkind = \"dynamics\"\n[[output]]\nname = \"z\"\nvalue = \"ball.z\"\n";
    let frames = parsed(text).drawings(&[&[]], &[0.0, 0.1, 0.2, 1.0]).unwrap().unwrap().remove(0);
    let bars: Vec<usize> = frames.iter().map(|frame| frame.space.as_ref().unwrap().bars.len()).collect();
    assert_eq!(bars, [1, 1, 1, 0]);
    let frames = parsed(text).frames(&[], &[0.0, 1.0]).unwrap().unwrap();
    let rods: Vec<&Vec<[f64; 3]>> = frames.iter().map(|frame| &frame.space.as_ref().unwrap().bars[0]).collect();
    let lengths = rods.iter().map(|rod| (rod[1][2] - rod[0][2]).abs());
    assert!(lengths.zip([1.0, 0.0]).all(|(found, wanted)| (found - wanted).abs() < 1e-12), "{rods:?}");
}
