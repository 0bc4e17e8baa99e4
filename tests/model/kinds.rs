//! Every kind of part: it is built, measures what it says, and has exact derivatives.

use linkwright::model_file::{read, tables};
use linkwright::problem::{Problem, ResponseAt};
use std::collections::BTreeSet;

const BASE: &str = r#"
version = 2
gravity = [0, -9.81]
[design.p]
start = 1.5
[objective]
minimize = "p"
[time]
to = 0.02
points = 3
[[body]]
name = "one"
mass = "2*p"
inertia = "0.5*p"
position = [0, 0]
[[body]]
name = "two"
mass = "p"
inertia = "0.2*p"
position = [1, 0]
[[force]]
name = "pull"
kind = "force"
at = { body = "one", at = [0.2, 0.1] }
direction = 1.0
force = "3*p"
"#;
const DYNAMICS: &str = "[analysis]\nkind = \"dynamics\"\nstep = 1e-3\n";
/// Reactions of implicit steps carry the tolerance of their iteration over the square of the step, too much for differences.
const EXPLICIT: &str = "[analysis]\nkind = \"dynamics\"\nscheme = \"rk8\"\ntolerance = 1e-12\n";

/// A part, and what it measures.
const PARTS: &[(&str, &str, &str, &[&str])] = &[
    ("joint", "revolute", "a = 'one'\nb = { body = 'two', at = [-1, 0] }", &["force_x", "force_y", "force"]),
    ("joint", "fixed", "a = { body = 'one', at = [1, 0] }\nb = 'two'", &["force_x", "force_y", "moment"]),
    ("joint", "prismatic", "a = 'one'\nb = 'two'", &["force", "moment", "position"]),
    ("joint", "point-on-line", "a = 'one'\nb = 'two'", &["force", "position"]),
    ("joint", "distance", "a = 'one'\nb = 'two'\nlength = 1", &["tension"]),
    ("joint", "gears", "a = 'one.theta'\nb = 'two.theta'\nradius_a = 'p/3'\nradius_b = 0.5", &["tooth_force"]),
    ("joint", "rack", "a = 'one'\nb = 'two'\nradius = 0.5\noffset = -1", &["tooth_force"]),
    ("driver", "coordinate", "coordinate = 'one.theta'\nmotion = 'p*time^2'", &["driving_force"]),
    ("driver", "relative", "a = 'one.theta'\nb = 'two.theta'\nmotion = 'p*time^2'", &["driving_force", "power"]),
    ("driver", "length", "a = 'one'\nb = 'two'\nmotion = '1 + p*time^2'", &["tension", "length"]),
    (
        "force",
        "spring",
        "a = 'one'\nb = 'two'\nstiffness = '10*p'\ndamping = 1\nlength = 0.7\ncubic = 3",
        &["tension", "length", "rate"],
    ),
    (
        "force",
        "coordinate-spring",
        "a = 'one.y'\nb = 'two.y'\nstiffness = '10*p'\nunloaded = 0.1",
        &["generalized_force", "elongation", "rate"],
    ),
    (
        "force",
        "bushing",
        "a = { body = 'one', at = [0.9, 0] }\nb = 'two'\nstiffness_x = '10*p'\nstiffness_y = 10\nstiffness_theta = 2\ndamping_x = 1",
        &["force_x", "force_y", "moment"],
    ),
    ("force", "actuator", "a = 'one'\nb = 'two'\ntension = '3*p*time'", &["tension", "length", "rate"]),
    (
        "force",
        "load",
        "a = 'one.theta'\nb = 'two.theta'\ngeneralized_force = 'p*sin(9*time)'",
        &["generalized_force", "power"],
    ),
    ("force", "force", "at = { body = 'one', at = ['p/9', 0] }\ndirection = 'deg(30)'\nforce = 'p'", &["force"]),
    (
        "force",
        "friction",
        "a = 'one.y'\nb = 'ground.y'\ncoulomb_force = 'p'\nspeed = 0.01\nviscous = 1",
        &["generalized_force"],
    ),
    (
        "force",
        "bump-stop",
        "a = 'ground.y'\nb = 'one.y'\nstiffness = '1e4*p'\ndamping = 0.1\nlimit = 0.01",
        &["contact_force"],
    ),
    (
        "force",
        "wall",
        "at = 'one'\nwall_x = 0\nwall_y = 0.01\nnormal = 'pi/2'\nstiffness = '1e4*p'\ndamping = 0.1",
        &["contact_force"],
    ),
    (
        "force",
        "feedback",
        "coordinate = 'two.x'\ngeneralized_force = '-3*p*two.x - two.vx + one.omega*time + two.theta*ground.x'",
        &["generalized_force", "power"],
    ),
    (
        "force",
        "load",
        "b = 'one.x'\ngeneralized_force = { kind = 'constant-speed', speed = 'p' }",
        &["generalized_force"],
    ),
    (
        "force",
        "load",
        "b = 'one.x'\ngeneralized_force = { kind = 'start-up', speed = 'p', duration = 0.01 }",
        &["generalized_force"],
    ),
    (
        "force",
        "load",
        "b = 'one.x'\ngeneralized_force = { kind = 'harmonic', amplitude = 'p', frequency = 9 }",
        &["generalized_force"],
    ),
    (
        "force",
        "load",
        "b = 'one.x'\ngeneralized_force = { kind = 'ramp', from = 0, to = 'p', duration = 0.01 }",
        &["generalized_force"],
    ),
    (
        "force",
        "load",
        "b = 'one.x'\ngeneralized_force = { kind = 'table', times = [0, 1, 2], values = [0, 1, 3], scale = 'p' }",
        &["generalized_force"],
    ),
];

fn problem(text: &str) -> Problem {
    read("m.toml", text).unwrap_or_else(|fault| panic!("{fault}")).problem().unwrap()
}

/// Derivatives of all responses against central differences; returns the responses at the last time.
fn assert_derivatives(text: &str) -> Vec<f64> {
    let problem = problem(text);
    let (b, h) = (problem.start()[0], 1e-5);
    let at = |b: f64| problem.analyze(&[b]).unwrap_or_else(|e| panic!("{text}\n{e}"));
    let (here, above, below) = (at(b), at(b + h), at(b - h));
    let of = |(h, values): (usize, &Vec<f64>)| (0..values.len()).map(move |p| ResponseAt { response: h, point: p });
    let instants: Vec<ResponseAt> = here.values.iter().enumerate().flat_map(of).collect();
    let slopes = problem.sensitivities(&[b], &here, &instants).unwrap();
    for (k, instant) in instants.iter().enumerate() {
        let difference = (above.at(*instant) - below.at(*instant)) / (2.0 * h);
        let error = (slopes[(k, 0)] - difference).abs();
        let size = 1.0 + difference.abs() + here.at(*instant).abs();
        let name = &problem.responses[instant.response].name;
        assert!(error < 2e-6 * size, "{name} of\n{text}\n{} and {difference}", slopes[(k, 0)]);
    }
    here.values.iter().map(|values| values[values.len() - 1]).collect()
}

fn outputs(measures: impl Iterator<Item = String>) -> String {
    measures.enumerate().map(|(k, m)| format!("[[output]]\nname = \"o{k}\"\nvalue = \"{m}\"\n")).collect()
}

#[test]
fn every_joint_drive_and_force_measures_and_differentiates() {
    for (section, kind, keys, measures) in PARTS {
        let part = format!("[[{section}]]\nname = \"part\"\nkind = \"{kind}\"\n{keys}\n");
        let outputs = outputs(measures.iter().map(|m| format!("part.{m}")));
        let values = assert_derivatives(&format!("{BASE}{EXPLICIT}{part}{outputs}"));
        assert!(values.iter().any(|v| *v != 0.0), "{kind} measures nothing: {values:?}");
    }
}

#[test]
fn no_kind_is_forgotten_here() {
    let tested: BTreeSet<(&str, &str)> = PARTS.iter().map(|(section, kind, ..)| (*section, *kind)).collect();
    for table in tables().iter().filter(|t| ["joint", "driver", "force"].contains(&t.name)) {
        // These measure nothing; they have tests of their own.
        let silent = ["inertia", "rigid-stop", "rigid-wall"];
        if let Some(kind) = table.kind.filter(|kind| !silent.contains(kind)) {
            assert!(tested.contains(&(table.name, kind)), "{} of kind {kind}", table.name);
        }
    }
}

#[test]
fn mass_on_a_coordinate_slows_it_down() {
    let part = "[[force]]\nname = \"ballast\"\nkind = \"inertia\"\ncoordinate = \"one.x\"\ninertia = \"p\"\n";
    let of = |part: &str| {
        assert_derivatives(&format!("{BASE}{EXPLICIT}{part}{}", outputs(["one.ax".to_owned()].into_iter())))[0]
    };
    // 3p cos 1 on 2p, and on 3p.
    assert!((of("") / of(part) - 1.5).abs() < 1e-9, "{} {}", of(""), of(part));
}

#[test]
fn bodies_beams_and_formulas_differentiate() {
    let clamped = |kind: &str, keys: &str| {
        format!(
            "[[beam]]\nname = \"rod\"\nkind = \"{kind}\"\nfrom = [0, 1]\nto = [1, 1]\nelements = 2\n{keys}\n\
             [[joint]]\nname = \"clamp\"\nkind = \"fixed\"\na = {{ body = \"ground\", at = [0, 1] }}\nb = \"rod.first\"\n"
        )
    };
    let material = "young = 2.1e9\ndensity = 1000";
    let beams = [
        clamped("circular", &format!("diameter = \"0.02*p\"\n{material}")),
        clamped("rectangular", &format!("width = 0.02\nheight = \"0.02*p\"\n{material}\npoisson = 0.2")),
        clamped("section", "axial = 1e6\ntransverse = 4e5\nbending = \"20*p\"\nmass = 0.5\ninertia = 1e-4"),
    ];
    let measures = [
        "rod.first.moment",
        "rod.2.shear_force",
        "rod.last.y",
        "rod.last.omega",
        "p*rod.last.y + hypot(rod.2.x, one.vy)",
    ];
    for beam in beams {
        let values =
            assert_derivatives(&format!("{BASE}{DYNAMICS}{beam}{}", outputs(measures.iter().map(|m| (*m).to_owned()))));
        assert!(values.iter().all(|v| *v != 0.0), "{values:?}");
    }
    let parts = "[[body]]\nname = \"bob\"\nkind = \"point\"\nmass = 1\nposition = [2, 0]\nvelocity = [\"p\", 0]\n\
                 [[body]]\nname = \"slide\"\nkind = \"slider\"\nmass = 1\nvelocity = \"p\"\n\
                 [[point]]\nname = \"edge\"\nbody = \"one\"\nat = [\"p\", 0]\n";
    let measures = ["bob.vx", "slide.position", "edge.x", "kinetic_energy", "potential_energy + time"];
    let values =
        assert_derivatives(&format!("{BASE}{DYNAMICS}{parts}{}", outputs(measures.iter().map(|m| (*m).to_owned()))));
    // Without forces along x; the edge of the body that is pulled has hardly moved.
    for (found, expected, tolerance) in [(values[0], 1.5, 1e-9), (values[1], 0.03, 1e-9), (values[2], 1.5, 1e-3)] {
        assert!((found - expected).abs() < tolerance, "{values:?}");
    }
}

#[test]
fn a_weight_hangs_lower_on_a_softer_spring() {
    let text = "version = 2\ngravity = [0, -10]\n[design.p]\nstart = 50\n[objective]\nminimize = \"p\"\n[time]\nat = [0]\n\
                [[body]]\nname = \"weight\"\nkind = \"point\"\nmass = 2\nposition = [0, 0]\n\
                [[driver]]\nname = \"guide\"\ncoordinate = \"weight.x\"\nmotion = 0\n\
                [[force]]\nname = \"spring\"\nkind = \"coordinate-spring\"\na = \"ground.y\"\nb = \"weight.y\"\nstiffness = \"p\"\n\
                [analysis]\nkind = \"statics\"\n[[output]]\nname = \"y\"\nvalue = \"weight.y\"\n";
    let problem = problem(text);
    let responses = problem.analyze(&[50.0]).unwrap();
    // y = −m g / k, dy/dk = m g / k².
    assert!((responses.values[0][0] + 0.4).abs() < 1e-12);
    let slope = problem.sensitivities(&[50.0], &responses, &[ResponseAt { response: 0, point: 0 }]).unwrap();
    assert!((slope[(0, 0)] - 0.008).abs() < 1e-12);
}

#[test]
fn a_ball_bounces_off_a_stop_and_off_a_wall() {
    let contacts = [
        "kind = \"rigid-stop\"\na = \"ground.y\"\nb = \"ball.y\"\nclearance = 0\nrestitution = \"p\"\n",
        "kind = \"rigid-wall\"\na = { body = \"ground\", at = [0, 0] }\nb = \"ball\"\nrestitution = \"p\"\n",
    ];
    for contact in contacts {
        let text = format!(
            "version = 2\ngravity = [0, -10]\n[design.p]\nstart = 0.8\n[objective]\nminimize = \"p\"\n[time]\nat = [0.6]\n\
             [[body]]\nname = \"ball\"\nkind = \"point\"\nmass = 2\nposition = [0, 0.8]\n\
             [[force]]\nname = \"floor\"\n{contact}{}\n[[output]]\nname = \"y\"\nvalue = \"ball.y\"\n",
            "[analysis]\nkind = \"dynamics\"\nstep = 0.01"
        );
        let problem = problem(&text);
        let responses = problem.analyze(&[0.8]).unwrap();
        // It falls for 0.4 s to 4 m/s, and rises with 4 p for 0.2 s.
        assert!((responses.values[0][0] - (0.8 * 0.8 - 0.2)).abs() < 1e-9, "{:?}", responses.values);
        let slope = problem.sensitivities(&[0.8], &responses, &[ResponseAt { response: 0, point: 0 }]).unwrap();
        assert!((slope[(0, 0)] - 0.8).abs() < 1e-9, "{slope}");
    }
}

#[test]
fn a_motion_from_an_equilibrium_stays_there() {
    let text = "version = 2\ngravity = [0, -10]\n[design.p]\nstart = 50\n[objective]\nminimize = \"p\"\n[time]\nat = [0, 0.5]\n\
                [[body]]\nname = \"weight\"\nkind = \"point\"\nmass = 2\nposition = [0, 0]\n\
                [[force]]\nname = \"spring\"\nkind = \"coordinate-spring\"\na = \"ground.y\"\nb = \"weight.y\"\nstiffness = \"p\"\n\
                [[force]]\nname = \"guide\"\nkind = \"coordinate-spring\"\na = \"ground.x\"\nb = \"weight.x\"\nstiffness = 10\n\
                [analysis]\nkind = \"dynamics\"\nstep = 0.01\ninitial_configuration = \"equilibrium\"\n\
                [[output]]\nname = \"y\"\nvalue = \"weight.y\"\n";
    let problem = problem(text);
    let responses = problem.analyze(&[50.0]).unwrap();
    assert!(responses.values[0].iter().all(|y| (y + 0.4).abs() < 1e-9), "{:?}", responses.values);
    let wanted = [0, 1].map(|point| ResponseAt { response: 0, point });
    let slopes = problem.sensitivities(&[50.0], &responses, &wanted).unwrap();
    assert!(slopes.iter().all(|slope| (slope - 0.008).abs() < 1e-9), "{slopes}");
}
