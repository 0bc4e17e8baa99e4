//! Every kind of part: construction, measures and exact derivatives.

use linkwright::autodiff::Scalar;
use linkwright::mechanics::elements::{ElementDescriptor, ElementKind, Role, StateFunction, kinds};
use linkwright::mechanics::motion::Fixed;
use linkwright::model_file::{read, tables};
use linkwright::problem::{Problem, ResponseAt};

pub(crate) const BASE: &str = r#"
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

/// Functions of time of every kind, as the force of a load.
const FUNCTIONS: &[&str] = &[
    "{ kind = 'constant-speed', speed = 'p' }",
    "{ kind = 'start-up', speed = 'p', duration = 0.01 }",
    "{ kind = 'harmonic', amplitude = 'p', frequency = 9 }",
    "{ kind = 'ramp', from = 0, to = 'p', duration = 0.01 }",
    "{ kind = 'table', times = [0, 1, 2], values = [0, 1, 3], scale = 'p' }",
];

/// A force that observes both bodies, for elements with a function of state.
pub(crate) struct Observed;

impl StateFunction for Observed {
    fn generalized_force<T: Scalar>(&self, _p: &[T], _t: T, q: &[T], _v: &[T]) -> T {
        q[0]
    }
}

fn kinds_of_elements() -> Vec<ElementKind<Fixed, Observed>> {
    kinds()
}

/// An element between the bodies of the base with all inputs at their typical values, each parameter a design variable.
pub(crate) fn typical(section: &str, descriptor: &ElementDescriptor) -> String {
    let (mut variables, mut keys) = (String::new(), String::new());
    let mut points = ["{ body = 'one', at = ['p/3', 0.1] }", "{ body = 'two', at = [-0.2, '-p/15'] }"].into_iter();
    let mut coordinates = ["'one.theta'", "'two.theta'", "'ground.theta'"].into_iter();
    for input in descriptor.inputs {
        let name = input.name;
        let value = match input.role {
            Role::Marker | Role::Body | Role::Translations => points.next().unwrap().to_owned(),
            role @ (Role::Marker3 | Role::Body3 | Role::Translations3) => unreachable!("{role:?} in the plane"),
            Role::Coordinate => coordinates.next().unwrap().to_owned(),
            // Large enough to touch the other body.
            Role::Profile => {
                let point = |k: u32| {
                    let (sin, cos) = (std::f64::consts::TAU * (f64::from(k) + 0.5) / 12.0).sin_cos();
                    format!("['p*{:.4}', {:.4}]", 0.8 / 1.5 * cos, 0.8 * sin)
                };
                format!("[{}]", (0..12).map(point).collect::<Vec<_>>().join(", "))
            }
            Role::Joint(kinds) => {
                let kinds_of_joints = kinds_of_elements();
                let on = kinds_of_joints.iter().find(|kind| kind.descriptor.kind == kinds[0]).unwrap();
                let joint = typical("joint", on.descriptor).replace("\"part\"", "\"on\"");
                variables = format!("{variables}{joint}");
                "'on'".to_owned()
            }
            Role::Parameter | Role::Gravity => {
                variables += &format!("[design.of_{name}]\nstart = {:e}\n", input.example);
                format!("'of_{name}'")
            }
            Role::TimeFunction => "'0.3 + p*time^2'".to_owned(),
            Role::StateFunction => "'-3*p*two.x - two.vx + one.omega*time + two.theta*ground.x'".to_owned(),
        };
        keys += &format!("{name} = {value}\n");
    }
    format!("{variables}[[{section}]]\nname = \"part\"\nkind = \"{}\"\n{keys}", descriptor.kind)
}

fn problem(text: &str) -> Problem {
    read("m.toml", text).unwrap_or_else(|report| panic!("{text}\n{report}")).problem().unwrap()
}

/// Derivatives of all responses with respect to all design variables against central differences; returns the responses at
/// the last time.
pub(crate) fn assert_derivatives(text: &str) -> Vec<f64> {
    let problem = problem(text);
    let b = problem.start();
    let at = |b: &[f64]| problem.analyze(b).unwrap_or_else(|e| panic!("{text}\n{e}"));
    let here = at(&b);
    let of = |(h, values): (usize, &Vec<f64>)| (0..values.len()).map(move |p| ResponseAt { response: h, point: p });
    let instants: Vec<ResponseAt> = here.values.iter().enumerate().flat_map(of).collect();
    let gradients = problem.sensitivities(&b, &here, &instants).unwrap();
    for i in 0..b.len() {
        let scale = b[i].abs().max(0.1);
        let moved = |h: f64| {
            let mut moved = b.clone();
            moved[i] += h * scale;
            at(&moved)
        };
        let (h, above, below) = (1e-5, moved(1e-5), moved(-1e-5));
        for (k, instant) in instants.iter().enumerate() {
            let difference = (above.at(*instant) - below.at(*instant)) / (2.0 * h);
            let gradient = gradients[(k, i)] * scale;
            let size = 1.0 + difference.abs() + here.at(*instant).abs();
            let name = &problem.responses[instant.response].name;
            let error = (gradient - difference).abs();
            assert!(error < 2e-6 * size, "{name} of\n{text}\nto variable {i}: {gradient} and {difference}");
        }
    }
    here.values.iter().map(|values| values[values.len() - 1]).collect()
}

/// Outputs of these measures, with the names `o0`, `o1`, ….
pub(crate) fn outputs(measures: impl IntoIterator<Item: AsRef<str>>) -> String {
    let all = measures.into_iter().enumerate();
    all.map(|(k, m)| format!("[[output]]\nname = \"o{k}\"\nvalue = \"{}\"\n", m.as_ref())).collect()
}

#[test]
fn every_joint_drive_and_force_measures_and_differentiates() {
    let kinds = kinds_of_elements();
    let mut tested = 0;
    for table in tables() {
        let Some(kind) = kinds.iter().find(|kind| Some(kind.descriptor.kind) == table.kind) else { continue };
        if !["joint", "driver", "force"].contains(&table.name) {
            continue;
        }
        tested += 1;
        // Rigid contacts need implicit steps; they have a test of their own.
        if kind.is_rigid_contact() {
            continue;
        }
        let measures = kind.descriptor.measures.iter().map(|measure| format!("part.{}", measure.name));
        let motion = ["one.ax", "two.ay", "two.alpha"].map(str::to_owned);
        let outputs = outputs(measures.chain(motion));
        let part = typical(table.name, kind.descriptor);
        let values = assert_derivatives(&format!("{BASE}{EXPLICIT}{part}{outputs}"));
        let measured = &values[..kind.descriptor.measures.len()];
        assert!(measured.is_empty() || measured.iter().any(|v| *v != 0.0), "{part} measures nothing: {values:?}");
    }
    assert_eq!(tested, kinds.len(), "every element that can be named has a section of the file");
}

#[test]
fn every_function_of_time_differentiates() {
    for function in FUNCTIONS {
        let part = format!("[[force]]\nname = 'part'\nkind = 'load'\nb = 'one.x'\ngeneralized_force = {function}\n");
        let outputs = outputs(["part.generalized_force"]);
        let values = assert_derivatives(&format!("{BASE}{EXPLICIT}{part}{outputs}"));
        assert!(values.iter().any(|v| *v != 0.0), "{function} measures nothing: {values:?}");
    }
}

#[test]
fn mass_on_a_coordinate_slows_it_down() {
    let part = "[[force]]\nname = \"ballast\"\nkind = \"inertia\"\ncoordinate = \"one.x\"\ninertia = \"p\"\n";
    let of = |part: &str| assert_derivatives(&format!("{BASE}{EXPLICIT}{part}{}", outputs(["one.ax"])))[0];
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
        clamped("circular", &format!("diameter = 0.02\n{material}\nrise = \"1e-3*p\"\ntension = \"3*p\"")),
    ];
    let measures = [
        "rod.first.moment",
        "rod.2.shear_force",
        "rod.last.y",
        "rod.last.omega",
        "p*rod.last.y + hypot(rod.2.x, one.vy)",
    ];
    for beam in beams {
        let values = assert_derivatives(&format!("{BASE}{DYNAMICS}{beam}{}", outputs(measures)));
        assert!(values.iter().all(|v| *v != 0.0), "{values:?}");
    }
    let parts = "[[body]]\nname = \"bob\"\nkind = \"point\"\nmass = 1\nposition = [2, 0]\nvelocity = [\"p\", 0]\n\
                 [[body]]\nname = \"slide\"\nkind = \"slider\"\nmass = 1\nvelocity = \"p\"\n\
                 [[point]]\nname = \"edge\"\nbody = \"one\"\nat = [\"p\", 0]\n";
    let measures = ["bob.vx", "slide.position", "edge.x", "kinetic_energy", "potential_energy + time"];
    let values = assert_derivatives(&format!("{BASE}{DYNAMICS}{parts}{}", outputs(measures)));
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
