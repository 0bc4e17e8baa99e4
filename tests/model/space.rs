//! Model files of mechanisms in space.

use crate::kinds::{assert_derivatives, outputs};
use linkwright::mechanics::elements::Measure;
use linkwright::model_file::{Accepts, Need, TableKeys, read, tables};
use linkwright::problem::Problem;
use proptest::prelude::*;
use std::f64::consts::PI;

const BASE: &str = r#"
version = 2
space = 3
gravity = [0.3, 0, -9.81]
[design.p]
start = 1.5
[objective]
minimize = "p"
[time]
to = 0.02
points = 3
[analysis]
kind = "dynamics"
scheme = "rk8"
tolerance = 1e-12
[[body]]
name = "one"
mass = "2*p"
inertia = ["0.5*p", 0.6, 0.7]
products = [0.01, "0.02*p", 0]
centre = [0.02, 0, "0.01*p"]
angular_velocity = [0.5, 0.3, -0.4]
[[body]]
name = "two"
mass = "p"
inertia = [0.2, 0.3, "0.2*p"]
position = [1, 0.2, 0]
orientation = { order = "zyx", angles = [0.1, -0.2, "0.1*p"] }
velocity = [0, 0.2, 0.1]
"#;

pub fn problem(text: &str) -> Problem {
    read("m.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}")).problem().unwrap()
}

/// Values of the outputs at the last time of a model that may lack an objective.
pub fn last_of(text: &str) -> Vec<f64> {
    last(&format!("{text}{OBJECTIVE}"))
}

/// An objective for models of which outputs are wanted only.
pub const OBJECTIVE: &str = "[design.unused]\nstart = 1\n[objective]\nminimize = \"unused\"\n";

/// Values of the outputs at the last time.
pub fn last(text: &str) -> Vec<f64> {
    let problem = problem(text);
    let responses = problem.analyze(&problem.start()).unwrap_or_else(|error| panic!("{text}\n{error}"));
    responses.values.iter().map(|values| values[values.len() - 1]).collect()
}

/// Values of the outputs at all times of a model without design variables.
fn simulated(text: &str) -> Vec<Vec<f64>> {
    read("m.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}")).simulate(&[]).unwrap().values
}

pub fn assert_near(found: &[f64], expected: &[f64], tolerance: f64) {
    let worst = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(found.len() == expected.len() && worst <= tolerance, "{found:?}, expected {expected:?}");
}

/// A part with values for all keys that it requires, between the bodies of the base.
fn typical(table: &TableKeys) -> String {
    let section = table.name.trim_end_matches('3');
    let mut keys = format!("[[{section}]]\nname = \"part\"\nkind = \"{}\"\n", table.kind.unwrap());
    let mut points =
        ["{ body = 'one', at = ['p/3', 0.1, 0], z = [0.1, '0.2*p', 1] }", "{ body = 'two', at = [-0.2, 0, 0.1] }"]
            .into_iter();
    let mut coordinates = ["'one.x'", "'two.y'", "'one.z'"].into_iter();
    for key in table.keys.iter().filter(|key| key.need != Need::Optional) {
        let value = match key.accepts {
            Accepts::Marker => points.next().unwrap(),
            Accepts::Coordinate => coordinates.next().unwrap(),
            Accepts::Triple => "['0.6*p', 0.4, 0.5]",
            Accepts::Motion => "'0.3 + p*time^2'",
            Accepts::Feedback => "'-3*p*two.x - two.vz + one.vy*time'",
            _ => "'p/3'",
        };
        keys += &format!("{} = {value}\n", key.name);
    }
    keys
}

/// Measures of an element from the documentation of its table.
fn measures(table: &TableKeys) -> Vec<&'static str> {
    use linkwright::mechanics::elements::{StateFunction, kinds, spatial};
    use linkwright::mechanics::motion::Fixed;
    fn of<L: StateFunction>(table: &TableKeys) -> Vec<&'static str> {
        let own = [spatial::joints::kinds::<Fixed, L>(), spatial::drives::kinds(), spatial::forces::kinds()];
        let own = own.into_iter().chain([spatial::contacts::kinds()]);
        let known = own.flatten().chain(kinds()).find(|kind| Some(kind.descriptor.kind) == table.kind);
        known.map_or(vec![], |kind| kind.descriptor.measures.iter().map(|measure: &Measure| measure.name).collect())
    }
    match table.kind {
        Some("angle" | "displacement" | "length") if table.name == "joint3" => {
            vec!["position", "velocity", "acceleration"]
        }
        _ => of::<crate::kinds::Observed>(table),
    }
}

#[test]
fn every_kind_in_space_measures_and_differentiates() {
    let mut tested = vec![];
    for table in tables().iter().filter(|table| ["joint3", "driver3", "force3"].contains(&table.name)) {
        let Some(kind) = table.kind else { continue };
        // Rigid contacts need implicit steps.
        if kind.starts_with("rigid") {
            continue;
        }
        let measures = measures(table).into_iter().map(|measure| format!("part.{measure}"));
        let motion = ["one.ax", "two.az", "two.alpha_y", "one.yaw", "two.roll"].map(str::to_owned);
        let outputs = outputs(measures.chain(motion));
        // A static limit is at least the sliding friction.
        let part = typical(table).replace("static_ratio = 'p/3'", "static_ratio = 'p'");
        assert_derivatives(&format!("{BASE}{part}{outputs}"));
        tested.push(kind);
    }
    assert!(tested.len() >= 25, "{tested:?}");
}

#[test]
fn named_points_axes_and_coordinates_of_joints_differentiate() {
    let text = format!(
        "{BASE}{}",
        r#"
[[point]]
name = "pin"
at = ["0.4*p", 0.1, 0]
[[point]]
name = "far"
body = "two"
at = [0, "0.1*p", 0.3]
z = [0, 1, "p"]
[[joint]]
name = "hinge"
a = "ground"
b = "one"
at = "pin"
axis = ["pin", "far"]
[[joint]]
name = "sleeve"
kind = "cylindrical"
a = "one"
b = "two"
at = "far"
axis = [0.2, "p", 0]
x = [1, 0, 0]
[[force]]
name = "spring"
kind = "coordinate-spring"
a = "ground.x"
b = "sleeve.displacement"
stiffness = "100*p"
[[force]]
name = "damper"
kind = "feedback"
coordinate = "hinge.angle"
generalized_force = "-p*hinge.omega - 2*sleeve.velocity"
[[beam]]
name = "rod"
from = [0, 1, 0]
to = ["0.5*p", 1, 0]
elements = 2
young = 1e7
density = 1000
diameter = "0.05*p"
start = "ground"
"#
    );
    let wanted = [
        "hinge.angle",
        "hinge.omega",
        "hinge.alpha",
        "sleeve.angle",
        "sleeve.displacement",
        "sleeve.acceleration",
        "far.vx",
        "far.pitch",
        "rod.last.z",
        "rod.last.moment_y",
        "kinetic_energy",
        "p*rod.2.torque + hypot(one.x, far.vy)",
    ];
    let values = assert_derivatives(&format!("{text}{}", outputs(wanted)));
    assert!(values.iter().take(9).all(|value| *value != 0.0), "{values:?}");
}

/// Parts on coordinates act against the ground by default, also those that turn in the plane.
#[test]
fn gears_between_joints_need_no_carrier() {
    let text = format!(
        "{BASE}{}",
        r#"
[[joint]]
name = "first"
axis = [0, 0, 1]
a = "ground"
b = "one"
[[joint]]
name = "second"
axis = [0, 0, 1]
a = "ground"
b = "two"
at = [1, 0.2, 0]
[[joint]]
name = "teeth"
kind = "gears"
a = "first.angle"
b = "second.angle"
radius_a = 0.2
radius_b = 0.1
"#
    );
    let values = last(&format!("{text}{}", outputs(["first.angle", "second.angle"])));
    assert!(values[0].abs() > 1e-4, "{values:?}");
    assert_near(&[values[1]], &[-2.0 * values[0]], 1e-9);
}

/// The axes of `b` are those of `a`, turned to `axis_b`: the shaft that is driven is not twisted by the assembly, and turns by the angle of
/// the driving one.
#[test]
fn a_drive_shaft_with_a_constant_velocity_joint_turns_by_the_same_angle() {
    let text = format!(
        r#"
version = 2
space = 3
[design.bend]
start = 0.5
[objective]
minimize = "bend"
[time]
to = 0.4
points = 3
[analysis]
kind = "kinematics"
{}
[[joint]]
name = "bearing"
a = "ground"
b = "driving"
axis = [1, 0.2, 0.3]
[[joint]]
name = "sleeve"
kind = "cylindrical"
a = "ground"
b = "driven"
axis = [1, 0.2, "0.3 + bend"]
[[joint]]
name = "joint"
kind = "constant-velocity"
a = "driving"
b = "driven"
axis = [1, 0.2, 0.3]
axis_b = [1, 0.2, "0.3 + bend"]
[[driver]]
name = "motor"
coordinate = "bearing.angle"
motion = "3*time"
{}"#,
        ["driving", "driven"]
            .map(|name| format!("[[body]]\nname = \"{name}\"\nmass = 1\ninertia = [1, 1, 1]\n"))
            .concat(),
        outputs(["sleeve.angle", "joint.torque"]),
    );
    assert_near(&last(&text), &[1.2, 0.0], 1e-11);
    assert_derivatives(&text);
}

/// A frame at rest with the orientation, and its angles.
fn angles(orientation: &str) -> Vec<f64> {
    let outputs = outputs(["frame.yaw", "frame.pitch", "frame.roll"]);
    last(&format!("{BASE}[[body]]\nname = \"frame\"\nkind = \"fixed-node\"\norientation = {orientation}\n{outputs}"))
}

#[test]
fn every_way_to_give_an_orientation_gives_the_same() {
    // A third of a turn about (1, 1, 1): x becomes y, y becomes z. Yaw by 90°, then roll by 90°.
    let expected = [PI / 2.0, 0.0, PI / 2.0];
    for orientation in [
        "{ order = 'zyx', angles = ['90 deg', 0, '90 deg'] }",
        "{ axis = [1, 1, 1], angle = '120 deg' }",
        "{ z = [2, 0, 0], x = [0.3, 1, 0] }",
        "{ matrix = [[0, 0, 1], [1, 0, 0], [0, 1, 0]] }",
        "{ euler_parameters = [0.5, 0.5, 0.5, 0.5] }",
    ] {
        assert_near(&angles(orientation), &expected, 1e-12);
    }
    assert_near(&angles("{ order = 'xyz', angles = ['0.1 * p', 0, 0] }"), &[0.0, 0.0, 0.15], 1e-12);
}

#[test]
fn a_conical_pendulum_keeps_its_height() {
    // The centripetal force of a weight at the radius r and the depth h: v = r √(g/h).
    let text = "version = 2\nspace = 3\ngravity = [0, 0, -9.81]\n[time]\nto = \"2*pi*sqrt(0.4/9.81)\"\npoints = 11\n\
                [[body]]\nname = \"bob\"\nkind = \"point\"\nmass = 2\nposition = [0.3, 0, -0.4]\n\
                velocity = [0, \"0.3*sqrt(9.81/0.4)\", 0]\n\
                [[joint]]\nname = \"rod\"\nkind = \"distance\"\na = \"ground\"\nb = \"bob\"\nlength = 0.5\n\
                [analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-10\n";
    let values = simulated(&format!("{text}{}", outputs(["bob.x", "bob.y", "bob.z"])));
    let end: Vec<f64> = values.iter().map(|v| v[v.len() - 1]).collect();
    assert_near(&end, &[0.3, 0.0, -0.4], 1e-7);
    assert!(values[2].iter().all(|z| (z + 0.4).abs() < 1e-8));
}

#[test]
fn a_cantilever_bends_to_both_sides_as_beam_theory_says() {
    // F L³/(3 E I) with loads so small that the geometry stays linear; width along y, height along z.
    let text = "version = 2\nspace = 3\n[time]\nat = [0]\n[analysis]\nkind = \"statics\"\n\
                [[beam]]\nname = \"bar\"\nkind = \"rectangular\"\nfrom = [0, 0, 0]\nto = [2, 0, 0]\nstart = \"ground\"\n\
                young = 2e11\ndensity = 8000\nwidth = 0.02\nheight = 0.04\nshear = \"rigid\"\nelements = 8\n\
                [[force]]\nname = \"down\"\nkind = \"force\"\nat = \"bar.last\"\ndirection = [0, 3, -4]\nmagnitude = 0.5\n";
    let values = simulated(&format!("{text}{}", outputs(["bar.last.y", "bar.last.z", "bar.first.moment_y"])));
    let [y, z] = [0.02f64.powi(3) * 0.04 / 12.0, 0.04f64.powi(3) * 0.02 / 12.0].map(|i| 8.0 / (3.0 * 2e11 * i));
    assert_near(&[values[0][0] / y, values[1][0] / z], &[0.3, -0.4], 3e-3);
    // Half way in the first of eight elements: 0.4 N · 1.875 m.
    assert!((values[2][0].abs() - 0.75).abs() < 1e-3, "{}", values[2][0]);
}

#[test]
fn the_slider_crank_moves_as_its_triangle_says() {
    let text =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/models/spatial-slider-crank.toml"));
    let model = read("spatial-slider-crank.toml", &text.unwrap()).unwrap_or_else(|report| panic!("{report}"));
    let responses = model.simulate(&[0.08, 0.3]).unwrap();
    for (t, x) in model.grid().unwrap().points.iter().zip(&responses.values[0]) {
        let (sin, cos) = (2.0 * PI * t).sin_cos();
        let (y, z) = (0.1 - 0.08 * sin, 0.12 + 0.08 * cos);
        let exact = 1e3 * (0.09f64 - y * y - z * z).sqrt();
        assert!((x - exact).abs() < 1e-8, "{t}: {x} {exact}");
    }
}

/// Two mirrored halves as copies with a sign, with a sloppy position of the wheels: the assembly moves them to their arms.
#[test]
fn mirrored_halves_are_copies_with_a_sign() {
    let text = "version = 2\nspace = 3\n[time]\nat = [0]\n[analysis]\nkind = \"kinematics\"\n\
                [[body]]\neach = [{ side = \"left\", s = -1 }, { side = \"right\", s = 1 }]\nname = \"{side}\"\nmass = 1\n\
                inertia = [1, 1, 1]\nposition = [0, \"{s}*0.41\", 0.01]\n\
                [[joint]]\neach = [{ side = \"left\", s = -1 }, { side = \"right\", s = 1 }]\nname = \"{side}_hinge\"\n\
                a = { body = \"ground\", at = [0, \"{s}*0.1\", 0], z = [1, 0, 0] }\n\
                b = { body = \"{side}\", at = [0, \"{s}*(-0.3)\", 0], z = [1, 0, 0] }\n\
                [[driver]]\neach = [{ side = \"left\", s = -1 }, { side = \"right\", s = 1 }]\nname = \"{side}_drive\"\n\
                coordinate = \"{side}_hinge.angle\"\nmotion = \"{s}*0.5\"\n";
    let wanted = ["left.y", "right.y", "left.z", "right.z", "left_hinge.angle"];
    let values: Vec<f64> = simulated(&format!("{text}{}", outputs(wanted))).iter().map(|v| v[0]).collect();
    let (sin, cos) = 0.5f64.sin_cos();
    assert_near(&values, &[-0.1 - 0.3 * cos, 0.1 + 0.3 * cos, 0.3 * sin, 0.3 * sin, -0.5], 1e-9);
}

const GOOD: &str = r#"version = 2
space = 3
gravity = [0, 0, -9.81]

[design.length]
start = 0.4

[[point]]
name = "pin"
at = [0, 0, 1]

[[body]]
name = "arm"
mass = 2
inertia = [0.02, 0.03, 0.02]
position = [0, "length", 1]

[[joint]]
name = "hinge"
kind = "revolute"
a = "ground"
b = "arm"
at = "pin"
axis = [1, 0, 0]

[[driver]]
name = "motor"
coordinate = "hinge.angle"
motion = "time"

[time]
to = 1
points = 11

[analysis]
kind = "kinematics"

[[output]]
name = "height"
value = "arm.z"
"#;

/// The mistake as a text of the good file, its replacement, and words of the message: about a number of a line.
const MISTAKES: &[[&str; 4]] = &[
    ["space = 3", "space = 4", "m.toml:2", "number of dimensions, 2 or 3"],
    ["space = 3\n", "", "m.toml:2:11", "with `space = 3` at the top of the file"],
    ["gravity = [0, 0, -9.81]", "gravity = [0, -9.81]", "m.toml:3:11", "three values [x, y, z]"],
    ["axis = [1, 0, 0]", "axis = [0, 0, 0]", "m.toml:24:8", "`axis` has length zero"],
    ["axis = [1, 0, 0]", "axis = [\"pin\", \"pin\"]", "m.toml:24:8", "length zero"],
    ["axis = [1, 0, 0]", "axis = [\"pin\", \"pim\"]", "m.toml:24:16", "did you mean `pin`"],
    ["axis = [1, 0, 0]", "axis = [1, 0, 0]\nx = [-2, 0, 0]", "m.toml:25:5", "parallel"],
    ["at = \"pin\"", "at = \"pi\"", "m.toml:23:6", "no point `pi`"],
    ["b = \"arm\"", "b = \"amr\"", "m.toml:22:5", "did you mean `arm`"],
    ["b = \"arm\"", "b = { body = \"amr\", at = [0, 0, 0] }", "m.toml:22", "did you mean `arm`"],
    ["b = \"arm\"", "b = { body = \"arm\", at = [0, 0] }", "m.toml:22", "three values"],
    ["\"revolute\"", "\"cam-follower\"", "m.toml:20:8", "one of planar mechanisms"],
    ["hinge.angle", "hinge.displacement", "m.toml:28:14", "hinge.angle"],
    ["hinge.angle", "arm.theta", "m.toml:28:14", "no coordinate `arm.theta`"],
    ["arm.z\"", "arm.theta\"", "m.toml:40", "no name `arm.theta`"],
    ["mass = 2\n", "mass = 2\nangle = 1\n", "m.toml", "body `arm` has no key `angle`"],
    ["mass = 2\n", "mass = 2\norientation = { angles = [1, 0, 0] }\n", "m.toml:15", "`angles` needs `order`"],
    ["mass = 2\n", "mass = 2\norientation = { order = \"zyz\", angles = [1, 0] }\n", "m.toml:15", "three values"],
    [
        "mass = 2\n",
        "mass = 2\norientation = { order = \"zzx\", angles = [1, 0, 0] }\n",
        "m.toml:15:25",
        "did you mean `yzx`",
    ],
    [
        "mass = 2\n",
        "mass = 2\norientation = { matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]] }\n",
        "m.toml:15",
        "no rotation",
    ],
    ["mass = 2\n", "mass = 2\norientation = { euler_parameters = [1, 1, 0, 0] }\n", "m.toml:15", "length is 1.4142"],
    ["mass = 2\n", "mass = 2\norientation = { axis = [0, 0, 0], angle = 1 }\n", "m.toml:15", "length zero"],
    ["mass = 2\n", "mass = 2\norientation = { z = [0, 0, 1], angle = 1 }\n", "m.toml:15", "exclude each other"],
    ["mass = 2\n", "mass = 2\norientation = {}\n", "m.toml:15", "lacks its angles or axes"],
    ["inertia = [0.02, 0.03, 0.02]", "inertia = 0.02", "m.toml:15:11", "three values [x, y, z]"],
];

/// The good file with one replacement.
fn edited(good: &str, bad: &str) -> String {
    assert!(GOOD.contains(good), "`{good}` is not in the good file");
    GOOD.replacen(good, bad, 1)
}

#[test]
fn mistakes_in_space_are_shown_at_their_location() {
    read("m.toml", GOOD).unwrap_or_else(|report| panic!("{report}"));
    for [good, bad, place, words] in MISTAKES {
        let report =
            read("m.toml", &edited(good, bad)).err().unwrap_or_else(|| panic!("{bad}: the file was read")).to_string();
        assert!(report.contains(place) && report.contains(words), "{bad}: wanted {place} and `{words}` in\n{report}");
    }
    let planar = include_str!("good.toml").replacen("kind = \"fixed\"", "kind = \"spherical\"", 1);
    let report = read("m.toml", &planar).err().unwrap().to_string();
    assert!(report.contains("write `space = 3` at the top of the file"), "{report}");
}

/// A matrix that is a reflection is rejected in a whole sentence.
#[test]
fn a_matrix_that_is_no_rotation_is_told_in_a_sentence() {
    let bad = edited("mass = 2\n", "mass = 2\norientation = { matrix = [[1, 0, 0], [0, 1, 0], [0, 0, -1]] }\n");
    let report = read("m.toml", &bad).err().unwrap().to_string();
    assert!(report.contains("the orientation matrix: it is no rotation"), "{report}");
}

/// Valid files of mechanisms that cannot be analysed, with words of the message.
const FAILURES: &[[&str; 3]] = &[
    ["mass = 2", "mass = \"length - 1\"", "must be positive"],
    ["inertia = [0.02, 0.03, 0.02]", "inertia = [0.02, 0.09, 0.02]", "must not exceed the sum of the others"],
    ["inertia = [0.02, 0.03, 0.02]", "inertia = [0, 0.03, 0.03]", "all must be positive"],
    [
        "mass = 2\n",
        "mass = 2\norientation = { axis = [\"length - 0.4\", 0, 0], angle = 1 }\n",
        "arm: its orientation is no rotation",
    ],
    ["axis = [1, 0, 0]", "axis = [\"length - 0.4\", 0, 0]", "no rotation"],
    // The hinge holds with its axes opposite: the joint is upside down.
    ["b = \"arm\"", "b = { body = \"arm\", at = [0, \"-length\", 0], z = [-1, 0, 0] }", "the wrong way round"],
];

#[test]
fn impossible_mechanisms_in_space_are_named() {
    for [good, bad, words] in FAILURES {
        let model = read("m.toml", &edited(good, bad)).unwrap_or_else(|report| panic!("{bad}: {report}"));
        let error = model.simulate(&[0.4]).err().unwrap_or_else(|| panic!("{bad}: nothing fails"));
        let report = model.locate(&error).unwrap_or_else(|| panic!("{bad}: {error}")).to_string();
        assert!(report.contains(words) && report.contains("m.toml:"), "{bad}: wanted `{words}` in\n{report}");
    }
}

/// Ball joints of the double wishbone keep their distances from the hinges and from each other, and toe and camber are those of the
/// rotation that moves them: nine equations for nine coordinates, without bodies and joints.
#[test]
fn the_double_wishbone_moves_as_its_hardpoints_say() {
    use nalgebra::{Matrix3, Vector3};
    let mut text = include_str!("../../examples/models/double-wishbone-space.toml").to_owned();
    let balls = ["lower_ball", "upper_ball", "tie_outer"];
    for ball in balls {
        text += &format!("[[point]]\nname = \"on_{ball}\"\nbody = \"carrier\"\nat = \"{ball}\"\n");
    }
    let measures = balls.iter().flat_map(|ball| ["x", "y", "z"].map(|axis| format!("on_{ball}.{axis}")));
    text += &outputs(measures.chain(["carrier.z".to_owned()]));
    let model = read("wishbone.toml", &text).unwrap_or_else(|report| panic!("{report}"));
    let problem = model.problem().unwrap();
    let design = problem.start();
    let values = problem.analyze(&design).unwrap().values;
    let travel = &problem.grids[0].points;
    let index = |name: &str| problem.responses.iter().position(|response| response.name == name).unwrap();
    let (toe, camber, first) = (index("toe"), index("camber"), problem.responses.len() - 10);
    let at = |ball: usize, p: usize| Vector3::from_fn(|k, _| values[first + 3 * ball + k][p]);
    // Hardpoints of the file at ride height, which is the middle of the travel.
    let [upper_front_z, upper_rear_z, lower_rear_z, upper_ball_y, tie_y, tie_z] = design[..6] else { panic!() };
    let lower = [Vector3::new(-0.18, -0.38, 0.20), Vector3::new(0.20, -0.38, lower_rear_z)];
    let upper = [Vector3::new(-0.12, -0.44, upper_front_z), Vector3::new(0.16, -0.45, upper_rear_z)];
    let tie = Vector3::new(0.15, tie_y, tie_z);
    let ride =
        [Vector3::new(-0.01, -0.70, 0.19), Vector3::new(0.02, upper_ball_y, 0.50), Vector3::new(0.14, -0.69, 0.27)];
    let frame = |[a, b, c]: [Vector3<f64>; 3]| Matrix3::from_columns(&[b - a, c - a, (b - a).cross(&(c - a))]);
    let mut worst = [0.0f64; 2];
    for (p, travel) in travel.iter().enumerate() {
        let now = [0, 1, 2].map(|ball| at(ball, p));
        let mut keeps = |a: Vector3<f64>, b: Vector3<f64>, a0: Vector3<f64>, b0: Vector3<f64>| {
            worst[0] = worst[0].max(((a - b).norm() - (a0 - b0).norm()).abs());
        };
        for k in 0..2 {
            keeps(now[0], lower[k], ride[0], lower[k]);
            keeps(now[1], upper[k], ride[1], upper[k]);
        }
        keeps(now[2], tie, ride[2], tie);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            keeps(now[i], now[j], ride[i], ride[j]);
        }
        worst[0] = worst[0].max((values[first + 9][p] - 0.31 - travel).abs());
        let turn = frame(now) * frame(ride).try_inverse().unwrap();
        let (yaw, roll) = (turn[(1, 0)].atan2(turn[(0, 0)]), turn[(2, 1)].atan2(turn[(2, 2)]));
        let unit = PI / 180.0;
        worst[1] = worst[1].max((values[toe][p] * unit + yaw).abs().max((values[camber][p] * unit - roll).abs()));
    }
    println!("distances {:.1e} m, angles {:.1e} rad", worst[0], worst[1]);
    assert!(worst[0] < 1e-10 && worst[1] < 1e-9 && values[toe].iter().any(|toe| toe.abs() > 0.5), "{worst:?}");
}

/// Mirrored halves of which one is upside down: the copy is named, at its place in the file.
#[test]
fn a_mirrored_joint_that_is_upside_down_is_named() {
    let text = "version = 2\nspace = 3\n[time]\nto = 1\npoints = 2\n[analysis]\nkind = \"dynamics\"\n\
                [[body]]\neach = { side = [\"left\", \"right\"] }\nname = \"{side}\"\nmass = 1\ninertia = [0.1, 0.1, 0.1]\n\
                [[joint]]\neach = [{ side = \"left\", s = -1 }, { side = \"right\", s = 1 }]\nname = \"{side}_hinge\"\n\
                a = { body = \"ground\", z = [0, 0, -1] }\nb = { body = \"{side}\", z = [0, 0, \"{s}\"] }\n\
                [[output]]\nname = \"x\"\nvalue = \"left.x\"\n";
    let model = read("m.toml", text).unwrap_or_else(|report| panic!("{report}"));
    let error = model.simulate(&[]).unwrap_err();
    let report = model.locate(&error).unwrap().to_string();
    for words in ["right_hinge", "wrong way round", "initial orientations", "m.toml:15"] {
        assert!(report.contains(words), "{report}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_good_file_in_space_with_anything_typed_into_it_is_read_or_rejected(
        at in 0..GOOD.len(),
        cut in 0..20usize,
        typed in "[-+*/^(){}\\[\\]\"'=,.#a-z0-9 \n]{0,12}",
    ) {
        let end = (at + cut).min(GOOD.len());
        let text = format!("{}{typed}{}", &GOOD[..at], &GOOD[end..]);
        match read("m.toml", &text) {
            Ok(model) if model.grid().is_some_and(|grid| grid.len() < 1000) => {
                drop(model.simulate(&vec![0.4; model.variables().len()]));
            }
            Ok(_) => {}
            Err(report) => prop_assert!(report.to_string().contains("--> m.toml:")),
        }
    }
}

/// A ball that is thrown onto the floor bounces, slides and rolls with 5/7 of its speed; the optimizer finds the speed with which it reaches a
/// target in time.
#[test]
fn a_ball_bounces_slides_and_rolls_to_a_target() {
    let text = r#"
version = 2
space = 3
gravity = [0, 0, -9.81]
[design]
speed = { start = "3 m/s", lower = "1 m/s", upper = "6 m/s" }
mu = { start = 0.2, lower = 0.2, upper = 0.5 }
[[body]]
name = "ball"
mass = "170 g"
inertia = [5.56e-5, 5.56e-5, 5.56e-5]
position = [0, 0, "30 mm"]
velocity = ["speed", 0, 0]
[[force]]
name = "floor"
kind = "sphere-plane"
a = "ground"
b = "ball"
radius = "28.6 mm"
stiffness = 1e7
damping = 0.8
friction = "mu"
[time]
to = 0.8
points = 9
[analysis]
kind = "dynamics"
scheme = "rk8"
tolerance = 1e-9
[[output]]
name = "x"
value = "ball.x"
[[output]]
name = "vx"
value = "ball.vx"
[objective]
minimize = "(at(x, 0.8) - 2)^2"
"#;
    let model = read("m.toml", text).unwrap_or_else(|report| panic!("{report}"));
    let problem = model.problem().unwrap();
    let responses = problem.analyze(&[3.0, 0.2]).unwrap();
    // Impulses of friction and spin: m (v₀ − v) = I ω/r with v = ω r, however the ball bounces.
    let ratio = 1.0 / (1.0 + 5.56e-5 / (0.17 * 0.0286 * 0.0286));
    assert!((responses.values[1][8] - 3.0 * ratio).abs() < 1e-3, "{} {}", responses.values[1][8], 3.0 * ratio);
    let outcome = model.method().solve(&problem, |_| ()).unwrap();
    let reached = outcome.evaluation.objective;
    assert!(outcome.status.is_success() && reached < 1e-12, "{:?} {reached}", outcome.status);
    assert!(outcome.design[0] > 2.0, "{:?}", outcome.design);
}
