//! Robots from MJCF files: motions compared with those of MuJoCo and of the same robot in URDF, loops, mistakes, and the command.

use crate::urdf::{accurate, near, output, outputs};
use linkwright::model_file::read;
use linkwright::model_file::robot::{Base, LIMIT, import};
use proptest::prelude::*;

/// A model with some elements in its world.
fn model(bodies: &str) -> String {
    format!("<mujoco>\n<worldbody>\n{bodies}\n</worldbody>\n</mujoco>")
}

fn imported(text: &str) -> String {
    import("m.xml", text, Base::Fixed).unwrap_or_else(|error| panic!("{text}\n{error}")).text
}

/// A model with all that the import reads, and its motion by `benches/peers/mujoco_motion.py`.
const CRANE: [&str; 2] = [include_str!("robots/crane.xml"), include_str!("robots/crane.csv")];

#[test]
fn a_crane_moves_as_in_mujoco() {
    let [model, motion] = CRANE;
    let rows: Vec<Vec<&str>> = motion.lines().skip(2).map(|line| line.split(',').collect()).collect();
    let mut text = accurate(&imported(model), 0.5);
    let mut expected = vec![];
    for (k, row) in rows.iter().enumerate() {
        let name = row[1];
        let measures: &[&str] = match (row[0], name) {
            ("start", "rail") => &["acceleration"],
            ("start", _) => &["alpha"],
            ("joint", "rail") => &["displacement"],
            ("joint", _) => &["angle"],
            _ => &["x", "y", "z"],
        };
        for (measure, value) in measures.iter().zip(&row[2..]) {
            text += &output(&format!("o{k}_{measure}"), &format!("{name}.{measure}"));
            expected.push((row[0] == "start", format!("{row:?}"), value.parse::<f64>().unwrap()));
        }
    }
    let found = outputs(&text);
    assert!(expected.len() == 32, "{}", expected.len());
    // The first outputs are those of the import: positions of the four joints with one degree of freedom.
    for (series, (is_start, row, expected)) in found[4..].iter().zip(&expected) {
        let value = if *is_start { series[0] } else { series[2] };
        let tolerance = if *is_start { 1e-11 * expected.abs().max(1.0) } else { 1e-8 };
        assert!((value - expected).abs() < tolerance, "{row}: {value}");
    }
}

#[test]
fn what_the_crane_lacks_is_named() {
    let left_out = import("m.xml", CRANE[0], Base::Fixed).unwrap().left_out.join("\n");
    for words in
        ["<motor> (2) was left out", "shapes <geom> (8) give masses only", "limits of joints (2) are comments only"]
    {
        assert!(left_out.contains(words), "{left_out}");
    }
}

/// A pendulum of a rod between two points, by the closed form of its small oscillations.
#[test]
fn a_joint_apart_from_the_frame_of_its_body_has_the_period_of_its_pendulum() {
    let text = accurate(
        &imported(&model(
            "<body pos=\"0 0 2\"><joint name=\"pin\" pos=\"0.1 0 0.3\" axis=\"0 1 0\"/>\
             <inertial pos=\"0.1 0 -0.2\" mass=\"3\" diaginertia=\"0.15 0.2 0.15\"/></body>",
        )),
        1.0,
    );
    let pushed = text.replace(
        "centre = [0.1, 0, -0.2]",
        "centre = [0.1, 0, -0.2]\nangular_velocity = [0, 1e-4, 0]\n\
                              velocity = [-0.3e-4, 0, 1e-5]",
    );
    assert_ne!(text, pushed, "{text}");
    let rate = (3.0 * 9.81 * 0.5f64 / (0.2 + 3.0 * 0.25)).sqrt();
    near(outputs(&pushed)[0][2], 1e-4 / rate * rate.sin(), 1e-9);
}

/// `relpose` places the point `anchor` of the second body in the first one.
#[test]
fn a_weld_with_an_anchor_and_a_relative_pose_has_both() {
    let shape = "<geom type=\"box\" size=\"0.1 0.05 0.02\" mass=\"1\"/>";
    let bodies = format!(
        "<body name=\"b2\" pos=\"0 0.5 1\"><freejoint/>{shape}</body><body name=\"b3\" pos=\"0 1.5 1\"><freejoint/>{shape}</body>"
    );
    let with = |weld: &str| {
        let closed = format!("{}<equality>{weld}</equality>\n</mujoco>", model(&bodies).trim_end_matches("</mujoco>"));
        imported(&closed)
    };
    let text = with("<weld body1=\"b2\" body2=\"b3\" relpose=\"0 1 0 1 0 0 0\" anchor=\"0.1 0.2 0\"/>");
    assert!(
        text.contains("a = { body = \"b2\", at = [0, 1.0, 0] }\nb = { body = \"b3\", at = [0.1, 0.2, 0] }"),
        "{text}"
    );
    let text = with("<weld body1=\"b2\" body2=\"b3\" anchor=\"0.1 0.2 0\"/>");
    assert!(
        text.contains("a = { body = \"b2\", at = [0.1, 1.2, 0] }\nb = { body = \"b3\", at = [0.1, 0.2, 0] }"),
        "{text}"
    );
}

#[test]
fn what_free_joints_have_in_mujoco_and_unknown_attributes_are_named() {
    let free = |joint: &str| {
        let body = format!("<body name=\"b\">{joint}<geom size=\"0.1\" mass=\"1\"/></body>");
        import("m.xml", &model(&body), Base::Fixed).unwrap().left_out.join("\n")
    };
    let found = free("<joint type=\"free\" damping=\"0.4\" armature=\"0.05\"/>");
    for words in [
        "damping and friction of planar, spherical and floating joints (1) were left out",
        "springs and motor inertia of spherical and floating joints (1) were left out",
    ] {
        assert!(found.contains(words), "{found}");
    }
    assert!(!free("<freejoint/>").contains("floating"));
    let found = free("<joint typ=\"slide\" axis=\"1 0 0\"/>");
    assert!(found.contains("attribute `typ` of joint `b_joint` is not known and was left out"), "{found}");
}

/// A parallelogram that is closed by `connect`, and one of two bodies by `weld`: m l²/3 φ̈ = … of two cranks and a coupler.
#[test]
fn loops_are_closed_by_joints() {
    let rod = "<inertial pos=\"0.25 0 0\" mass=\"2\" diaginertia=\"0.01 0.04 0.04\"/>";
    let loop_of = |end: &str| {
        format!(
            "<mujoco><compiler angle=\"radian\"/><worldbody>\
             <body name=\"crank\"><joint name=\"a\" axis=\"0 1 0\"/>{rod}\
             <body name=\"coupler\" pos=\"0.5 0 0\"><joint name=\"b\" axis=\"0 1 0\"/>\
             <inertial pos=\"0 0 -0.4\" mass=\"1\" diaginertia=\"0.02 0.02 0.01\"/></body></body>\
             <body name=\"rocker\" pos=\"0 0 -0.8\"><joint name=\"c\" axis=\"0 1 0\"/>{rod}</body>\
             </worldbody><equality>{end}</equality></mujoco>"
        )
    };
    let connect = "<connect name=\"close\" body1=\"coupler\" body2=\"rocker\" anchor=\"0 0 -0.8\"/>";
    // From the horizontal: 2 (J + m s²) φ̈ + M l² φ̈ = g (2 m s + M l), with the coupler in translation.
    let expected = 9.81 * (2.0 * 2.0 * 0.25 + 0.5) / (2.0 * (0.04 + 2.0 * 0.0625) + 0.25);
    let text = accurate(&imported(&loop_of(connect)), 0.1) + &output("alpha", "a.alpha") + &output("turn", "b.angle");
    let found = outputs(&text);
    near(found[3][0], expected, 1e-9);
    near(found[4][2] + found[0][2], 0.0, 1e-9);
    let follow = "<joint joint1=\"c\" joint2=\"a\" polycoef=\"0 1 0 0 0\"/>\
                  <joint joint1=\"b\" joint2=\"a\" polycoef=\"0 -1 0 0 0\"/>";
    let text = accurate(&imported(&loop_of(follow)), 0.1) + &output("alpha", "a.alpha");
    near(outputs(&text)[3][0], expected, 1e-9);
    // Welded to the rocker, nothing can move: the mechanism keeps its place.
    let weld = "<weld body1=\"coupler\" body2=\"rocker\"/>";
    let text = accurate(&imported(&loop_of(weld)), 0.1);
    near(outputs(&text)[0][2], 0.0, 1e-9);
    let nothing = import("m.xml", &loop_of("<tendon name=\"t\"/><joint joint1=\"a\" active=\"false\"/>"), Base::Fixed);
    let left_out = nothing.unwrap().left_out.join("\n");
    assert!(left_out.contains("equality `t`, a <tendon>") && left_out.contains("not active"), "{left_out}");
}

/// Masses of shapes that are scaled to a total.
#[test]
fn the_total_mass_is_as_the_file_says() {
    let text = "<mujoco><compiler settotalmass=\"14\"/><worldbody><body name=\"one\"><joint type=\"slide\"/>\
                <geom size=\"0.1\"/><body name=\"two\"><joint type=\"slide\"/><geom size=\"0.2\"/></body></body>\
                </worldbody></mujoco>";
    let masses: Vec<f64> = imported(text)
        .lines()
        .filter_map(|line| line.strip_prefix("mass = "))
        .map(|mass| mass.parse().unwrap())
        .collect();
    near(masses[0] + masses[1], 14.0, 1e-12);
    near(masses[1] / masses[0], 8.0, 1e-12);
}

/// Models that are not possible, and words of the message.
fn mistakes() -> Vec<(String, [&'static str; 2])> {
    let body = |rest: &str| model(&format!("<body name=\"arm\">{rest}</body>"));
    let mass = "<geom size=\"0.1\"/>";
    let on = |joint: &str| body(&format!("{joint}{mass}"));
    let around =
        |rest: &str| format!("<mujoco>{rest}<worldbody><body name=\"arm\"><joint/>{mass}</body></worldbody></mujoco>");
    vec![
        (on("<joint name=\"j\" axis=\"0 0 0\"/>"), ["joint `j` (line 3)", "length zero"]),
        (on("<joint name=\"j\" axis=\"0 0\"/>"), ["joint `j`", "give three"]),
        (on("<joint name=\"j\" type=\"screw\"/>"), ["joint `j`", "hinge"]),
        (on("<joint name=\"j\" damping=\"-1\"/>"), ["joint `j`", "not negative"]),
        (on("<joint name=\"j\" pos=\"0 inf 0\"/>"), ["joint `j`", "finite"]),
        (on("<joint name=\"j\"/><freejoint name=\"k\"/>"), ["joint `k`", "the only one"]),
        (on("<joint name=\"j\"/><joint name=\"j\"/>"), ["joint `j`", "two joints"]),
        (on("<joint class=\"fast\"/>"), ["<joint>", "no class of that name"]),
        (body("<joint name=\"j\"/>"), ["joint `j`", "no mass"]),
        (body("<freejoint/>"), ["arm_joint", "no mass"]),
        (body("<joint name=\"j\"/><geom type=\"box\" size=\"0.1 0.1\"/>"), ["shape of body `arm`", "3 positive sizes"]),
        (body("<joint name=\"j\"/><geom type=\"mesh\" mesh=\"hull\"/>"), ["shape of body `arm`", "<inertial>"]),
        (
            body("<joint/><geom type=\"capsule\" size=\"1\" fromto=\"0 0 0 0 0 0\"/>"),
            ["shape of body `arm`", "two points"],
        ),
        (body("<joint/><geom size=\"1\" mass=\"-1\"/>"), ["shape of body `arm`", "negative"]),
        (body("<joint/><inertial pos=\"0 0 0\" mass=\"1\"/>"), ["body `arm`", "diaginertia"]),
        (body("<joint/><inertial mass=\"-1\" diaginertia=\"1 1 1\"/>"), ["body `arm`", "mass is -1 kg"]),
        (body("<joint/><inertial mass=\"1\" diaginertia=\"1 1 3\"/>"), ["link `arm`", "exceeds the sum"]),
        (body("<joint/><inertial mass=\"1\" diaginertia=\"1 1 1\" quat=\"0 0 0 0\"/>"), ["body `arm`", "length zero"]),
        (model("<body name=\"arm\"><geom size=\"1\"/></body>"), ["nothing moves", "<freejoint>"]),
        (model(&"<body name=\"arm\"><joint/><geom size=\"1\"/></body>".repeat(2)), ["joint `arm_joint`", "two joints"]),
        (model("<replicate count=\"3\"><body/></replicate>"), ["<replicate>", "mj_saveLastXML"]),
        (around("<compiler coordinate=\"global\"/>"), ["<compiler>", "global"]),
        (around("<compiler eulerseq=\"xyw\"/>"), ["<compiler>", "eulerseq"]),
        (around("<compiler angle=\"grad\"/>"), ["<compiler>", "degree"]),
        (around("<equality><connect body1=\"leg\"/></equality>"), ["equality `connect_1`", "no body of that name"]),
        (around("<equality><weld/></equality>"), ["equality `weld_1`", "body1"]),
        (around("<include file=\"scene.xml\"/>"), ["m.xml", "includes `scene.xml`"]),
        (around("<default><default/></default>"), ["<default>", "class"]),
    ]
}

#[test]
fn mistakes_name_the_body_or_joint_and_what_to_do() {
    for (text, words) in mistakes() {
        let error = import("m.xml", &text, Base::Fixed).map(|made| made.text).expect_err(&text);
        let message = error.to_string();
        assert!(words.iter().all(|word| message.contains(word)), "{text}\n{message}");
        assert!(message.contains(';'), "no remedy: {message}");
    }
    let free = import("m.xml", CRANE[0], Base::Free).unwrap_err().to_string();
    assert!(free.contains("--free-base"), "{free}");
}

#[test]
fn files_that_attack_are_refused() {
    let deep = format!("<mujoco><worldbody>{}{}</worldbody></mujoco>", "<body>".repeat(900), "</body>".repeat(900));
    let classes = format!("<mujoco>{}{}</mujoco>", "<default class=\"a\">".repeat(90), "</default>".repeat(90));
    let bomb = "<!DOCTYPE m [<!ENTITY a \"aaaaaaaaaa\">]><mujoco model=\"&a;\"/>";
    for (text, word) in [
        ("<mujoco/>", "nothing moves"),
        ("<mujoco>", "repair"),
        ("<sdf/>", "<sdf>"),
        (&*deep, "nested more than"),
        (&*classes, "nested more than"),
        (bomb, "entities"),
        (&*" ".repeat(LIMIT + 1), "bytes"),
    ] {
        let message = import("m.xml", text, Base::Fixed).unwrap_err().to_string();
        assert!(message.contains(word), "{message}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Any text in place of a part of a model gives a model or an error.
    #[test]
    fn any_change_of_a_crane_is_a_model_or_an_error(at in 0usize..3200, length in 0usize..12, new in "[<>/\"= a-z0-9.-]{0,12}") {
        let mut text = CRANE[0].to_owned();
        let (from, to) = (at.min(text.len()), (at + length).min(text.len()));
        text.replace_range(from..to, &new);
        if let Ok(made) = import("m.xml", &text, Base::Fixed) {
            prop_assert!(read("m.toml", &made.text).is_ok());
        }
    }
}

#[cfg(feature = "cli")]
#[test]
fn the_command_reads_included_files_of_its_folder() {
    use crate::shell::{TempFolder, linkwright, text};
    let place = TempFolder::new("mjcf");
    let write = |name: &str, text: &str| std::fs::write(place.0.join(name), text).unwrap();
    write(
        "legs.xml",
        "<mujoco><default><geom density=\"500\"/></default><worldbody><body name=\"leg\"><joint name=\"hip\" axis=\"0 1 0\"/>\
          <geom type=\"capsule\" fromto=\"0 0 0 0.1 0 -0.5\" size=\"0.05\"/></body></worldbody></mujoco>",
    );
    write("robot.xml", "<mujoco model=\"dog\"><include file=\"./legs.xml\"/></mujoco>");
    let made = linkwright(&["import", "robot.xml"], &place.0);
    assert!(text(&made.stdout).starts_with("Wrote robot.toml. Next"), "{}", text(&made.stderr));
    assert_eq!(text(&made.stderr), "note: shapes <geom> (1) give masses only: their contacts were left out\n");
    assert!(place.run(&["analyze", "robot.toml"], 0).contains("hip_position"));
    for (file, words) in
        [("../legs.xml", "leaves the folder"), ("none.xml", "none.xml"), ("circle.xml", "include each other")]
    {
        write("circle.xml", &format!("<mujoco><include file=\"{file}\"/></mujoco>"));
        let message = place.run(&["import", "circle.xml", "circle"], 1);
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn gravity_may_be_switched_off() {
    let body = "<body name=\"ball\"><freejoint/><geom type=\"sphere\" size=\"0.1\"/></body>";
    let flagged =
        |flag: &str| model(body).replace("<worldbody>", &format!("<option><flag {flag}/></option>\n<worldbody>"));
    let made = import("m.xml", &flagged("gravity=\"disable\" contact=\"disable\""), Base::Fixed).unwrap();
    assert!(made.left_out.iter().any(|line| line == "`contact` of <flag> was left out"), "{:?}", made.left_out);
    let [still, falling] = [made.text, imported(&flagged("gravity=\"enable\""))];
    assert!(still.contains("gravity = [0, 0, 0]") && !falling.contains("gravity = [0, 0, 0]"), "{still}\n{falling}");
}
