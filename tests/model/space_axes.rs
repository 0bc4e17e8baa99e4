//! Axes in space: directions of which one alone is given, angles of orientations, and sections of beams.

use crate::kinds::outputs;
use crate::space::{assert_near, last_of, problem};
use linkwright::model_file::read;
use std::f64::consts::FRAC_PI_2;

const KINEMATICS: &str = "version = 2\nspace = 3\n[time]\nto = 0.1\npoints = 2\n[analysis]\nkind = \"kinematics\"\n";

/// A body with this key, and the values of its measures after a short motion.
fn body(key: &str, measures: &[&str]) -> Vec<f64> {
    let text = format!(
        "version = 2\nspace = 3\n[time]\nto = 0.1\npoints = 2\n[analysis]\nkind = \"dynamics\"\n\
         [[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1.2, 1.4]\nvelocity = [1, 0, 0]\n{key}\n\
         [[point]]\nname = \"tip\"\nbody = \"b\"\nat = [0, 1, 0]\n"
    );
    last_of(&(text + &outputs(measures)))
}

/// The angular velocity of a body that a driven hinge turns at 1 rad/s.
fn spin(body: &str, joint: &str) -> Vec<f64> {
    let text = format!(
        "{KINEMATICS}[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1.2, 1.4]\n{body}\n\
         [[joint]]\nname = \"h\"\nkind = \"revolute\"\n{joint}\n\
         [[driver]]\nname = \"m\"\ncoordinate = \"h.angle\"\nmotion = \"time\"\n"
    );
    last_of(&(text + &outputs(["b.omega_x", "b.omega_y", "b.omega_z"])))
}

#[test]
fn with_x_alone_the_axis_z_is_near_that_of_the_body() {
    // A hinge between bodies with the axes of the world turns about z, whatever x across it is.
    for x in ["[0, 1, 0]", "[1, 1, 0]", "[-3, 0.2, 0]"] {
        let found = spin("", &format!("a = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\nx = {x}"));
        assert_near(&found, &[0.0, 0.0, 1.0], 1e-9);
    }
    let half = 0.5f64.sqrt();
    let inclined = spin("", "a = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\nx = [1, 0, 1]");
    assert_near(&inclined, &[-half, 0.0, half], 1e-9);
    // Of a body that lies on its side, z is that of the body.
    let lying = "orientation = { axis = [1, 0, 0], angle = \"90 deg\" }";
    let joint = "a = { body = \"ground\", at = [0, 0, 0], z = [0, -1, 0], x = [1, 0, 0] }\nb = \"b\"\nat = [0, 0, 0]\nx = [1, 0, 0]";
    assert_near(&spin(lying, &joint.replace("at = [0, 0, 0]\n", "")), &[0.0, -1.0, 0.0], 1e-9);
    // Points and orientations have the same rule.
    let marker = "a = { body = \"ground\", at = [0, 0, 0], x = [0, 1, 0] }\nb = { body = \"b\", at = [0, 0, 0] }";
    let turned = "orientation = { order = \"zyx\", angles = [\"pi/2\", 0, 0] }";
    assert_near(&spin(turned, marker), &[0.0, 0.0, 1.0], 1e-9);
    let angles = body("orientation = { x = [\"cos(0.5)\", \"sin(0.5)\", 0] }", &["b.yaw", "b.pitch", "b.roll"]);
    assert_near(&angles, &[0.5, 0.0, 0.0], 1e-12);
    let raised = body("orientation = { x = [3, 0, 4] }", &["b.yaw", "b.pitch", "b.roll"]);
    assert_near(&raised, &[0.0, -(0.8f64.asin()), 0.0], 1e-12);
}

#[test]
fn x_alone_along_z_is_an_error() {
    let text =
        format!("{KINEMATICS}[[body]]\nname = \"b\"\nkind = \"fixed-node\"\norientation = {{ x = [0, 0, 2] }}\n");
    let report = read("m.toml", &text).err().unwrap().to_string();
    assert!(
        report.contains("with `x` alone the axis z is near z of the body") && report.contains("`z`, too"),
        "{report}"
    );
    // The axes of the bodies are known at the design only.
    let text = "version = 2\nspace = 3\n[time]\nto = 0.1\npoints = 2\n[analysis]\nkind = \"dynamics\"\n\
                [[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1, 1]\n\
                [[joint]]\nname = \"h\"\nkind = \"revolute\"\na = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\nx = [0, 0, 1]\n\
                [[output]]\nname = \"x\"\nvalue = \"b.x\"\n";
    let error = read("m.toml", text).unwrap().simulate(&[]).unwrap_err().to_string();
    assert!(error.contains("two axes are parallel") && !error.contains("NaN"), "{error}");
}

/// At a pitch of ±90° the roll is zero, and the yaw is what remains of the rotation.
#[test]
fn yaw_pitch_and_roll_are_those_of_the_orientation_at_a_pitch_of_a_right_angle() {
    let measures = ["b.yaw", "b.pitch", "b.roll", "tip.x - b.x"];
    let matrix = "orientation = { matrix = [[0, -1, 0], [0, 0, -1], [1, 0, 0]] }";
    assert_near(&body(matrix, &measures), &[FRAC_PI_2, -FRAC_PI_2, 0.0, -1.0], 1e-12);
    let angles = "orientation = { order = \"zyx\", angles = [0.3, \"pi/2\", 0.2] }";
    assert_near(&body(angles, &measures[..3]), &[0.1, FRAC_PI_2, 0.0], 1e-12);
}

#[test]
fn a_pitch_of_a_right_angle_is_told() {
    let text = "version = 2\nspace = 3\n[design.p]\nstart = 1.0\nlower = 0.5\nupper = 1.5\n\
                [[body]]\nname = \"b\"\nmass = 1\ninertia = [0.1, 0.2, 0.3]\n\
                orientation = { order = \"zyx\", angles = [\"0.3*p\", \"pi/2\", 0.2] }\nangular_velocity = [1, \"2*p\", 3]\n\
                [time]\nto = 0.5\npoints = 3\n[analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\n\
                [[output]]\nname = \"yaw\"\nvalue = \"b.yaw\"\n[objective]\nminimize = \"final(yaw)\"\n";
    let problem = problem(text);
    let start = problem.start();
    let warnings = problem.analyze(&start).unwrap().warnings;
    assert!(warnings.len() == 1 && warnings[0].starts_with("b: at t = 0 s"), "{warnings:?}");
    assert!(warnings[0].contains("no derivatives"), "{warnings:?}");
    // At other times there are derivatives.
    let checked = problem.check_sensitivities(&start, 3).unwrap();
    assert!(checked.derivatives.iter().skip(1).all(|derivative| derivative.is_fine()), "{checked:?}");
}

/// A round bar is the same in any direction; its sections have a default orientation also if it is vertical.
#[test]
fn a_vertical_beam_needs_no_direction_of_its_sections() {
    let bar = |to: &str, keys: &str| {
        last_of(&format!(
            "version = 2\nspace = 3\n[time]\nat = [0]\n[analysis]\nkind = \"statics\"\n\
             [[body]]\nname = \"base\"\nkind = \"fixed-node\"\n\
             [[beam]]\nname = \"s\"\nkind = \"rectangular\"\nwidth = 0.02\nheight = 0.03\nyoung = 2e11\ndensity = 7800\n\
             from = [0, 0, 0]\nto = {to}\nstart = \"base\"\n{keys}\n\
             [[output]]\nname = \"first\"\nfrequency = 1\n[[output]]\nname = \"second\"\nfrequency = 2\n"
        ))
    };
    let lying = bar("[0, 1, 0]", "");
    for vertical in [bar("[0, 0, 1]", ""), bar("[0, 0, -1]", ""), bar("[0, 0, 1]", "up = [1, 0, 0]")] {
        assert!(lying.iter().zip(&vertical).all(|(a, b)| (a - b).abs() < 1e-6 * a), "{lying:?} {vertical:?}");
    }
}

#[test]
fn a_ratio_of_poisson_that_no_material_has_is_an_error() {
    for (space, ends) in [(3, "from = [0, 0, 0]\nto = [1, 0, 0]"), (2, "from = [0, 0]\nto = [1, 0]")] {
        for poisson in ["0.6", "-1"] {
            let text = format!(
                "version = 2\nspace = {space}\n[time]\nat = [0]\n[analysis]\nkind = \"statics\"\n\
                 [[beam]]\nname = \"s\"\ndiameter = 0.02\nyoung = 2e11\ndensity = 7800\npoisson = {poisson}\n{ends}\nstart = \"ground\"\n\
                 [[output]]\nname = \"x\"\nvalue = \"s.last.x\"\n"
            );
            let text = if space == 2 {
                text.replace("space = 2\n", "").replace("name = \"s\"\n", "name = \"s\"\nkind = \"circular\"\n")
            } else {
                text
            };
            let report = read("m.toml", &text).err().unwrap().to_string();
            assert!(report.contains("at most 0.5"), "{report}");
        }
    }
}

/// The error of a file with two bodies and this joint or load.
fn error_of(part: &str) -> String {
    let text = format!(
        "{KINEMATICS}[[body]]\nname = \"b\"\nmass = 1\ninertia = [1, 1.2, 1.4]\n\
         [[body]]\nname = \"p\"\nkind = \"point\"\nmass = 1\n[[joint]]\nname = \"h\"\n{part}\n"
    );
    read("m.toml", &text).err().map_or(String::new(), |report| report.to_string())
}

#[test]
fn axes_that_contradict_the_kind_of_a_joint_are_errors() {
    let universal = "kind = \"universal\"\na = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\naxis = [0, 1, 0]\n";
    assert_eq!(error_of(&format!("{universal}axis_b = [1, 0, 0]")), "");
    assert_eq!(error_of(&format!("{universal}axis_b = [1, 1e-5, 0]")), "");
    let oblique = error_of(&format!("{universal}axis_b = [1, 1, 0]"));
    assert!(oblique.contains("joint `h`: the angle between its axes is 45.0°"), "{oblique}");
    let missing = error_of(universal);
    assert!(
        missing.contains("`axis_b` is missing") && missing.contains("give the axis of `b` as `axis_b`"),
        "{missing}"
    );
    for kind in ["revolute", "cylindrical", "planar", "prismatic", "fixed"] {
        let joint = format!(
            "kind = \"{kind}\"\na = \"ground\"\nb = \"b\"\nat = [0, 0, 0]\naxis = [0, 1, 0]\naxis_b = [0, 1, 0.2]\n"
        );
        let found = error_of(&joint);
        assert!(found.contains(&format!("the axes of `a` and `b` are the same in a {kind} joint")), "{kind}: {found}");
    }
}

#[test]
fn keys_of_joints_without_effect_are_errors() {
    let own = "a = \"ground\"\nb = { body = \"b\", at = [0, 0, 0], z = [0, 0, 1] }\n";
    let of_both = own.replace("\"ground\"", "{ body = \"ground\", at = [0, 0, 0], z = [0, 0, 1] }");
    for (key, joint) in [("at", &of_both), ("axis", &of_both), ("x", &of_both), ("axis_b", &own.to_owned())] {
        let found = error_of(&format!("{joint}{key} = [0, 1, 0]\n"));
        assert!(found.contains(&format!("`{key}` has no effect")), "{key}: {found}");
    }
    // The place is for the other point.
    assert_eq!(error_of(&format!("{own}at = [0, 0, 0]\n")), "");
    let torque = "a = \"ground\"\nb = \"b\"\n[[force]]\nname = \"t\"\nkind = \"torque\"\nat = \"p\"\ndirection = [0, 0, 1]\nmagnitude = 2\n";
    let found = error_of(torque);
    assert!(found.contains("force `t` has no effect: a body of kind `point` does not turn"), "{found}");
    assert_eq!(error_of(&torque.replace("\"p\"", "\"b\"")), "");
}

#[test]
fn a_joint_of_a_part_with_itself_is_an_error() {
    let found = error_of("a = \"ground\"\nb = \"ground\"\nat = [0, 0, 0]");
    assert!(found.contains("`a` and `b` of joint `h` are the same part"), "{found}");
    let plane = "version = 2\n[time]\nto = 1\npoints = 2\n[analysis]\nkind = \"dynamics\"\n[[body]]\nname = \"b\"\nmass = 1\ninertia = 1\nposition = [0, 0]\n";
    for joint in [
        "a = \"b\"\nb = { body = \"b\", at = [1, 0] }",
        "kind = \"gears\"\na = \"b.theta\"\nb = \"b.theta\"\nradius_a = 1\nradius_b = 1",
    ] {
        let text = format!("{plane}[[joint]]\nname = \"h\"\n{joint}\n");
        let found = read("m.toml", &text).err().unwrap().to_string();
        assert!(found.contains("`a` and `b` of joint `h` are the same part"), "{found}");
    }
}
