//! Robots from URDF files: motions and torques against hand-written models and closed forms, mistakes, and the command.

use linkwright::model_file::read;
use linkwright::model_file::robot::{Base, LIMIT, import};
use proptest::prelude::*;

/// A robot of some elements, on a link `base` without mass.
fn robot(elements: &str) -> String {
    format!("<?xml version=\"1.0\"?>\n<robot name=\"r\">\n<link name=\"base\"/>\n{elements}\n</robot>")
}

fn link(name: &str, mass: f64, centre: [f64; 3], moments: [f64; 3]) -> String {
    let ([x, y, z], [xx, yy, zz]) = (centre, moments);
    format!(
        "<link name=\"{name}\"><inertial><origin xyz=\"{x} {y} {z}\"/><mass value=\"{mass}\"/>\
         <inertia ixx=\"{xx}\" iyy=\"{yy}\" izz=\"{zz}\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n"
    )
}

fn joint(name: &str, kind: &str, [parent, child]: [&str; 2], rest: &str) -> String {
    format!(
        "<joint name=\"{name}\" type=\"{kind}\"><parent link=\"{parent}\"/><child link=\"{child}\"/>{rest}</joint>\n"
    )
}

fn imported(elements: &str) -> String {
    import("r.urdf", &robot(elements), Base::Fixed).unwrap_or_else(|error| panic!("{elements}\n{error}")).text
}

/// Steps with small errors, and the end of the motion.
pub(crate) fn accurate(text: &str, end: f64) -> String {
    text.replace("kind = \"dynamics\"", "kind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-11")
        .replace("to = 1\npoints = 101", &format!("to = {end}\npoints = 3"))
}

pub(crate) fn output(name: &str, value: &str) -> String {
    format!("[[output]]\nname = \"{name}\"\nvalue = \"{value}\"\n")
}

/// Values of all outputs, [output][time].
pub(crate) fn outputs(text: &str) -> Vec<Vec<f64>> {
    let model = read("r.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}"));
    model.simulate(&[]).unwrap_or_else(|error| panic!("{text}\n{error}")).values
}

#[track_caller]
pub(crate) fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance, "{found}, expected {expected}");
}

/// Two links that hang along −z and turn about y, with frames that are turned about the axis and back.
fn double_pendulum() -> String {
    link("one", 2.0, [0.0, 0.0, -0.3], [0.05, 0.06, 0.02])
        + &link("two", 1.0, [0.2, 0.0, 0.0], [0.01, 0.03, 0.03])
        + &joint("a", "continuous", ["base", "one"], "<origin xyz=\"0 0 1\" rpy=\"0 -1.2 0\"/><axis xyz=\"0 2 0\"/>")
        + &joint("b", "revolute", ["one", "two"], "<origin xyz=\"0 0 -0.5\" rpy=\"0 0.4 0\"/><axis xyz=\"0 1 0\"/>")
}

#[test]
fn a_double_pendulum_moves_as_the_planar_one_written_by_hand() {
    let space = accurate(&imported(&double_pendulum()), 1.5);
    // In the plane with x to the right and y upwards, angles count against those about y.
    let plane = "version = 2\ngravity = [0, -9.81]\n[time]\nto = 1.5\npoints = 3\n\
        [analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-11\n\
        [[body]]\nname = \"one\"\nmass = 2\ninertia = 0.06\nposition = [\"0.3*sin(1.2)\", \"-0.3*cos(1.2)\"]\nangle = 1.2\n\
        [[body]]\nname = \"two\"\nmass = 1\ninertia = 0.03\nangle = 0.8\n\
        position = [\"0.5*sin(1.2) + 0.2*cos(0.8)\", \"-0.5*cos(1.2) + 0.2*sin(0.8)\"]\n\
        [[joint]]\nname = \"a\"\nkind = \"revolute\"\na = \"ground\"\nb = { body = \"one\", at = [0, 0.3] }\n\
        [[joint]]\nname = \"b\"\nkind = \"revolute\"\na = { body = \"one\", at = [0, -0.2] }\n\
        b = { body = \"two\", at = [-0.2, 0] }\n";
    let plane = format!("{plane}{}{}", output("one", "1.2 - one.theta"), output("two", "one.theta - two.theta - 0.4"));
    let (space, plane) = (outputs(&space), outputs(&plane));
    for (own, by_hand) in space.iter().zip(&plane) {
        assert!(by_hand[2].abs() > 0.3, "{by_hand:?}");
        own.iter().zip(by_hand).for_each(|(own, by_hand)| near(*own, *by_hand, 1e-7));
    }
}

/// Torques that hold and move an arm of two links; Craig, *Introduction to Robotics* (2005), Section 6.7, with inertia.
#[test]
fn torques_of_an_arm_of_two_links_are_those_of_the_closed_form() {
    let ([m1, m2], [l1, c1, c2], [j1, j2]) = ([2.0, 1.5], [0.5, 0.2, 0.3], [0.04, 0.03]);
    let arm = link("one", m1, [c1, 0.0, 0.0], [0.01, j1, 0.04])
        + &link("two", m2, [c2, 0.0, 0.0], [0.01, j2, 0.03])
        // Axes along −y, so that positive angles lift the arm.
        + &joint("a", "revolute", ["base", "one"], "<axis xyz=\"0 -1 0\"/><limit lower=\"-2\" upper=\"2\"/>")
        + &joint("b", "revolute", ["one", "two"], &format!("<origin xyz=\"{l1} 0 0\"/><axis xyz=\"0 -1 0\"/>"));
    let driver = |name: &str, motion: &str| {
        format!("[[driver]]\nname = \"{name}_motor\"\ncoordinate = \"{name}.angle\"\nmotion = \"{motion}\"\n")
    };
    let text = imported(&arm).replace("kind = \"dynamics\"", "kind = \"kinematics\"")
        + &driver("a", "0.3 + time + time^2")
        + &driver("b", "-0.5 + 2*time - 3*time^2")
        + &output("ta", "a_motor.driving_force")
        + &output("tb", "b_motor.driving_force");
    let found = outputs(&text);
    for (k, t) in [(0, 0.0), (50, 0.5), (100, 1.0)] {
        let [q1, w1, e1] = [0.3 + t + t * t, 1.0 + 2.0 * t, 2.0];
        let [q2, w2, e2]: [f64; 3] = [-0.5 + 2.0 * t - 3.0 * t * t, 2.0 - 6.0 * t, -6.0];
        let (g, h) = (9.81, m2 * l1 * c2);
        let inertia = j2 + m2 * c2 * c2;
        let second = inertia * (e1 + e2) + h * (q2.cos() * e1 + q2.sin() * w1 * w1) + m2 * g * c2 * (q1 + q2).cos();
        let first = (j1 + m1 * c1 * c1 + m2 * l1 * l1) * e1 + second + h * q2.cos() * (e1 + e2)
            - h * q2.sin() * (w1 + w2).powi(2)
            + (m1 * c1 + m2 * l1) * g * f64::cos(q1);
        near(found[2][k], first, 1e-8);
        near(found[3][k], second, 1e-8);
    }
}

/// A pendulum of three links with fixed joints, whose frames are turned: α = Σ m g x/Σ (J + m r²) about the axis y.
#[test]
fn links_with_fixed_joints_are_one_body_with_named_points() {
    let rod = "<link name=\"rod\"><inertial><origin xyz=\"0.4 0 0\" rpy=\"0 0 1.5707963267948966\"/><mass value=\"1.2\"/>\
               <inertia ixx=\"0.07\" iyy=\"0.002\" izz=\"0.071\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\n";
    let text = imported(
        &(rod.to_owned()
            + &link("disc", 2.0, [0.0, 0.0, 0.0], [0.02, 0.03, 0.04])
            + "<link name=\"tip\"/>"
            + &joint("hinge", "continuous", ["base", "rod"], "<axis xyz=\"0 1 0\"/>")
            + &joint("clamp", "fixed", ["rod", "disc"], "<origin xyz=\"0.8 0 0\" rpy=\"1.5707963267948966 0 0\"/>")
            + &joint("end", "fixed", ["disc", "tip"], "<origin xyz=\"0 0.5 0\"/>")),
    );
    assert_eq!(text.matches("[[body]]").count(), 1, "{text}");
    let found = outputs(&(text + &output("alpha", "hinge.alpha") + &output("z", "tip.z")));
    // The rod's moment about y is its own about x, and the disc's is its own about z.
    let inertia = 0.07 + 1.2 * 0.16 + 0.04 + 2.0 * 0.64;
    near(found[1][0], 9.81 * (1.2 * 0.4 + 2.0 * 0.8) / inertia, 1e-9);
    // The disc's y is z of the rod.
    near(found[2][0], 0.5, 1e-12);
}

#[test]
fn inertia_in_turned_axes_and_products_are_the_same_body() {
    let (sin, cos) = 0.7f64.sin_cos();
    let [a, b] = [0.03, 0.08];
    let [xx, yy, xy] = [a * cos * cos + b * sin * sin, a * sin * sin + b * cos * cos, (a - b) * sin * cos];
    let of = |origin: &str, inertia: &str| {
        let own = format!(
            "<link name=\"top\"><inertial><origin xyz=\"0.1 0.2 0.3\" {origin}/><mass value=\"1\"/><inertia {inertia}/>\
             </inertial></link>\n"
        );
        let text = imported(
            &(own + &joint("a", "continuous", ["base", "top"], "<origin rpy=\"0.3 0.2 0.1\"/><axis xyz=\"1 2 0.5\"/>")),
        );
        let text = accurate(&text, 0.6) + &output("alpha", "a.alpha") + &output("torque", "a.torque");
        let measured = outputs(&text);
        [measured[1][1], measured[2][1]]
    };
    let turned = of("rpy=\"0 0 0.7\"", &format!("ixx=\"{a}\" iyy=\"{b}\" izz=\"0.1\" ixy=\"0\" ixz=\"0\" iyz=\"0\""));
    let plain = of("", &format!("ixx=\"{xx}\" iyy=\"{yy}\" izz=\"0.1\" ixy=\"{xy}\" ixz=\"0\" iyz=\"0\""));
    assert!(turned[0].abs() > 0.1 && turned[1].abs() > 0.1, "{turned:?}");
    turned.iter().zip(plain).for_each(|(a, b)| near(*a, b, 1e-8));
}

/// Two weights on vertical guides with q₂ = 0.1 − 2 q₁: (m₁ + 4 m₂) a = (2 m₂ − m₁) g. A third falls with a damper.
#[test]
fn mimic_and_damping_follow_closed_forms() {
    let moments = [0.1; 3];
    let up = "<axis xyz=\"0 0 1\"/>";
    let text = imported(
        &(link("one", 3.0, [0.0; 3], moments)
            + &link("two", 1.0, [0.0; 3], moments)
            + &link("three", 2.0, [0.0; 3], moments)
            + &joint("a", "prismatic", ["base", "one"], up)
            + &joint(
                "b",
                "prismatic",
                ["base", "two"],
                &format!("{up}<mimic joint=\"a\" multiplier=\"-2\" offset=\"0.1\"/>"),
            )
            + &joint("c", "prismatic", ["base", "three"], &format!("{up}<dynamics damping=\"5\"/>"))),
    );
    let found = outputs(&accurate(&text, 0.4));
    let a = (2.0 - 3.0) * 9.81 / (3.0 + 4.0);
    near(found[0][2], 0.5 * a * 0.16, 1e-9);
    near(found[1][2], 0.1 - 2.0 * found[0][2], 1e-9);
    let (speed, time) = (2.0 * 9.81 / 5.0, 2.0 / 5.0);
    near(found[2][2], -speed * (0.4 - time * (1.0 - f64::exp(-0.4 / time))), 1e-8);
}

#[test]
fn what_follows_a_fixed_joint_is_fixed_and_a_bad_inertia_on_a_good_body_is_named() {
    let robot = robot(
        &(link("arm", 2.0, [0.3, 0.0, 0.0], [0.1; 3])
            + &link("finger", 0.1, [0.0; 3], [0.001, 0.001, 0.01])
            + &joint("j", "continuous", ["base", "arm"], "<axis xyz=\"0 1 0\"/>")
            + "<link name=\"lock\"/>"
            + &joint("k", "fixed", ["arm", "lock"], "")
            + &joint("f", "prismatic", ["arm", "finger"], "<mimic joint=\"k\" offset=\"0.4\"/>")),
    );
    let made = import("r.urdf", &robot, Base::Fixed).unwrap();
    assert_eq!(made.left_out.len(), 2, "{:?}", made.left_out);
    assert!(made.left_out[0].contains("follows `k`") && made.left_out[1].contains("inertia of link `finger`"));
    let found = outputs(&(made.text + &output("alpha", "j.alpha") + &output("x", "finger.x")));
    near(found[1][0], 9.81 * (2.0 * 0.3 + 0.1 * 0.4) / (0.1 + 2.0 * 0.09 + 0.001 + 0.1 * 0.16), 1e-9);
    near(found[2][0], 0.4, 1e-12);
}

/// A free body falls; with a free base, everything does.
#[test]
fn floating_joints_and_bases_are_free() {
    let floats = link("stone", 2.0, [0.1, 0.0, 0.0], [0.1; 3])
        + &joint("f", "floating", ["base", "stone"], "<origin xyz=\"0 0 3\"/>");
    let found = outputs(&accurate(&(imported(&floats) + &output("z", "stone.z")), 0.5));
    near(found[0][2], 3.0 - 0.5 * 9.81 * 0.25, 1e-9);
    let all = link("trunk", 5.0, [0.0; 3], [0.1; 3])
        + &link("leg", 1.0, [0.0, 0.0, -0.2], [0.01; 3])
        + &joint("hip", "revolute", ["trunk", "leg"], "<axis xyz=\"0 1 0\"/><limit lower=\"0.2\" upper=\"1\"/>");
    let robot = format!("<robot name=\"r\">{all}</robot>");
    let text = import("r.urdf", &robot, Base::Free).unwrap().text;
    let found = outputs(&accurate(&(text + &output("z", "trunk.z")), 0.5));
    found[0].iter().for_each(|hip| near(*hip, 0.2, 1e-9));
    near(found[1][2], -0.5 * 9.81 * 0.25, 1e-9);
    assert!(import("r.urdf", &robot, Base::Fixed).is_ok());
}

#[test]
fn names_that_a_model_cannot_have_are_replaced() {
    let text = imported(
        &(link("a/b-c", 1.0, [0.1, 0.0, 0.0], [0.1; 3])
            + &link("time", 1.0, [0.1, 0.0, 0.0], [0.1; 3])
            + &joint("a/b-c", "continuous", ["base", "a/b-c"], "")
            + &joint("a_b_c", "continuous", ["a/b-c", "time"], "")),
    );
    assert!(text.contains("# joint a/b-c") && !text.contains("name = \"time\""), "{text}");
    assert_eq!(outputs(&text).len(), 2);
}

/// Elements of a robot that is not possible, and words of the message.
fn mistakes() -> Vec<(String, [&'static str; 2])> {
    let good = || link("one", 1.0, [0.1, 0.0, 0.0], [0.1; 3]);
    let on = |rest: &str| joint("j", "revolute", ["base", "one"], rest);
    let inertial = |text: &str| format!("<link name=\"one\"><inertial>{text}</inertial></link>{}", on(""));
    let inertia = |values: &str| inertial(&format!("<mass value=\"1\"/><inertia {values}/>"));
    vec![
        (good() + &on("<axis xyz=\"0 0 0\"/>"), ["joint `j` (line 5)", "length zero"]),
        (good() + &on("<axis xyz=\"0 0\"/>"), ["joint `j`", "give three"]),
        (good() + &on("<origin xyz=\"0 nan 0\"/>"), ["joint `j`", "finite"]),
        (good() + &on("<limit lower=\"2\" upper=\"1\"/>"), ["joint `j`", "above the upper"]),
        (good() + &on("<dynamics damping=\"-1\"/>"), ["joint `j`", "not negative"]),
        (good() + &on("<mimic joint=\"k\"/>"), ["`mimic` of joint `j`", "no joint of that name"]),
        (good() + &on("<mimic joint=\"j\"/>"), ["`mimic` of joint `j`", "follow another"]),
        (good() + &joint("j", "screw", ["base", "one"], ""), ["joint `j`", "prismatic"]),
        (good() + &joint("j", "revolute", ["bass", "one"], ""), ["joint `j`", "`base`"]),
        (good() + "<joint name=\"j\" type=\"fixed\"><parent link=\"base\"/></joint>", ["joint `j`", "<child>"]),
        (good() + &on("") + &on(""), ["joint `j`", "two joints"]),
        (good() + &good() + &on(""), ["link `one`", "two links"]),
        (good() + &on("") + &joint("k", "fixed", ["base", "one"], ""), ["joint `k`", "child of joint `j`"]),
        (good(), ["`base`, `one`", "to one tree"]),
        (
            good()
                + "<link name=\"two\"/>"
                + &joint("j", "fixed", ["one", "two"], "")
                + &joint("k", "fixed", ["two", "one"], ""),
            ["joint `j`", "loop"],
        ),
        ("<link name=\"one\"/>".to_owned() + &on(""), ["joint `j`", "carries none"]),
        (
            "<link name=\"one\"/>".to_owned() + &joint("j", "floating", ["base", "one"], ""),
            ["joint `j`", "moves freely"],
        ),
        (inertial("<inertia ixx=\"1\"/>"), ["link `one` (line 4)", "no mass"]),
        (inertial("<mass value=\"0\"/><inertia ixx=\"1\"/>"), ["joint `j`", "has no mass"]),
        (inertial("<mass value=\"-1\"/>"), ["link `one`", "mass is -1 kg"]),
        (inertial("<mass value=\"1\"/>"), ["joint `j`", "must be positive"]),
        (inertia("ixx=\"-1\" iyy=\"1\" izz=\"1\""), ["joint `j`, link `one`", "must be positive"]),
        (inertia("ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"2\""), ["joint `j`, link `one`", "must be positive"]),
        (inertia("ixx=\"1\" iyy=\"1\" izz=\"3\""), ["joint `j`, link `one`", "exceeds the sum"]),
        (
            good()
                + &link("two", 1.0, [0.0; 3], [0.1; 3])
                + &on("<mimic joint=\"k\"/>")
                + &joint("k", "revolute", ["one", "two"], "<mimic joint=\"j\"/>"),
            ["`mimic` of joint", "circle"],
        ),
        (
            "<xacro:include xmlns:xacro=\"http://www.ros.org/wiki/xacro\" filename=\"arm.xacro\"/>".to_owned(),
            ["xacro", "expand"],
        ),
        ("<xacro:macro xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"m\"/>".to_owned(), ["xacro", "expand"]),
    ]
}

#[test]
fn mistakes_name_the_link_or_joint_and_what_to_do() {
    for (elements, words) in mistakes() {
        let error = import("r.urdf", &robot(&elements), Base::Fixed).map(|made| made.text).expect_err(&elements);
        let message = error.to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{elements}\n{message}");
        assert!(message.contains(';'), "no remedy: {message}");
    }
    let free = import("r.urdf", &robot(""), Base::Free).unwrap_err().to_string();
    assert!(free.contains("link `base`") && free.contains("moves freely"), "{free}");
}

#[test]
fn files_that_are_no_robots_or_attack_are_refused() {
    let bomb = "<!DOCTYPE r [<!ENTITY a \"aaaaaaaaaa\"><!ENTITY b \"&a;&a;&a;&a;&a;&a;\">]><robot name=\"&b;\"/>";
    let deep = "<a>".repeat(200_000);
    let wide = format!("<robot name=\"r\">{}</robot>", "<link name=\"base\"/>".repeat(1000));
    for (text, word) in [
        ("", "repair"),
        ("<robot name=\"r\">", "repair"),
        ("<mujoco/>", "nothing moves"),
        ("<sdf/>", "<sdf>"),
        ("<robot name=\"r\"/>", "no link"),
        ("<robot name=\"r\"><link name=\"a\"/></robot>", "nothing moves"),
        (bomb, "entities"),
        (&*deep, "repair"),
        (&*wide, "two links"),
        (&*" ".repeat(LIMIT + 1), "bytes"),
    ] {
        let message = import("r.urdf", text, Base::Fixed).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Any text in place of a part of a robot gives a model or an error.
    #[test]
    fn any_change_of_a_robot_is_a_model_or_an_error(at in 0usize..1200, length in 0usize..12, new in "[<>/\"= a-z0-9.-]{0,12}") {
        let mut text = robot(&double_pendulum());
        let (from, to) = (at.min(text.len()), (at + length).min(text.len()));
        text.replace_range(from..to, &new);
        for base in [Base::Fixed, Base::Free] {
            if let Ok(made) = import("r.urdf", &text, base) {
                prop_assert!(read("r.toml", &made.text).is_ok());
            }
        }
    }
}

#[cfg(feature = "cli")]
#[test]
fn the_command_writes_a_model_that_is_analysed() {
    use crate::shell::{TempFolder, linkwright, text};
    let place = TempFolder::new("urdf");
    let shape = "<link name=\"shape\"><visual/></link>".to_owned() + &joint("s", "fixed", ["two", "shape"], "");
    std::fs::write(place.0.join("arm.urdf"), robot(&(double_pendulum() + &shape))).unwrap();
    let made = linkwright(&["import", "arm.urdf"], &place.0);
    assert!(text(&made.stdout).starts_with("Wrote arm.toml. Next: linkwright analyze arm.toml"));
    assert_eq!(text(&made.stderr), "note: <visual> (1) was left out\n");
    assert!(place.read("arm.toml").contains("# * <visual> (1) was left out"));
    let shown = place.run(&["analyze", "arm.toml"], 0);
    assert!(shown.contains("a_position") && shown.contains("b_position"), "{shown}");
    // With an objective, its derivatives are checked.
    let with_goal = place.read("arm.toml").replace("to = 1\npoints = 101", "to = 0.2\npoints = 5")
        + "[design.p]\nstart = 1\nlower = 0.5\nupper = 2\n[[force]]\nname = \"spring\"\nkind = \"coordinate-spring\"\nb = \"a.angle\"\n\
           stiffness = \"3*p\"\n[objective]\nminimize = \"a_position\"\nover = \"peak\"\n";
    std::fs::write(place.0.join("goal.toml"), with_goal).unwrap();
    let checked = place.run(&["check", "goal.toml"], 0);
    assert!(checked.contains("right"), "{checked}");
    assert!(place.run(&["import", "arm.urdf"], 1).contains("exists"));
    assert_eq!(place.run(&["import", "arm.urdf", "other.toml", "--quiet"], 0), "note: <visual> (1) was left out\n");
    assert!(place.run(&["import", "arm.urdf", "free", "--free-base"], 1).contains("moves freely"));
    assert!(place.run(&["import", "none.urdf"], 1).contains("none.urdf: cannot read it"));
    place.run(&["import"], 2);
}
