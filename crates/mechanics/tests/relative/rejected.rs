//! Mechanisms that relative coordinates do not support: an error that names the part, and absolute coordinates by default.

use crate::settings;
use linkwright_mechanics::analyses::dynamics::simulate_explicitly;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::integrators::explicit::{Coordinates, StepControl, Tolerance};
use linkwright_mechanics::mechanism::{Body, Marker3, Mechanism, Pose, Pose3, Rotation};
use linkwright_mechanics::{Error, Explicit};

/// Two rods on the ground, with an addition.
fn pendulum(add: impl Fn(&mut Mechanism<f64>, [Body; 2])) -> Mechanism<f64> {
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let first = m.body("first", 1.0, 0.1, Pose { x: 0.5, y: 0.0, theta: 0.0 });
    let second = m.body("second", 1.0, 0.1, Pose { x: 1.5, y: 0.0, theta: 0.0 });
    let ground = m.ground();
    m.revolute("pin", ground.origin(), first.at(-0.5, 0.0));
    m.revolute("elbow", first.at(0.5, 0.0), second.at(-0.5, 0.0));
    add(&mut m, [first, second]);
    m
}

fn is_named(m: &Mechanism<f64>, what: &str, why: &str) {
    let run = |coordinates| simulate_explicitly(m, &settings(coordinates), &[0.0, 0.02]);
    let error = run(Coordinates::Relative).unwrap_err();
    let text = error.to_string();
    assert!(matches!(error, Error::Unsupported { .. }), "{text}");
    assert!(text.contains(what) && text.contains(why) && text.contains("absolute coordinates"), "{text}");
    assert_eq!(run(Coordinates::Automatic).unwrap().coordinates, Coordinates::Absolute);
}

#[test]
fn what_is_not_a_tree_is_named() {
    let beside = pendulum(|m, [_, second]| {
        let driver = m.coordinate("free", 0.0, 0.0);
        let ground = m.ground();
        m.gear_pair("gears", [driver, second.theta], ground.theta, [1.0, 1.0, 0.0]);
    });
    is_named(&beside, "gears", "no mass of its own");
    let contact = pendulum(|m, [_, second]| {
        let ground = m.ground();
        m.rope("rope", ground.origin(), second.at(0.5, 0.0), [10.0, 0.0, 1.0]);
    });
    is_named(&contact, "rope", "not smooth");
    let mut rubbing = Mechanism::with_gravity(0.0, -9.81);
    let rod = rubbing.body("rod", 1.0, 0.1, Pose { x: 0.5, y: 0.0, theta: 0.0 });
    let pin = rubbing.revolute("pin", rubbing.ground().origin(), rod.at(-0.5, 0.0));
    rubbing.revolute_friction("friction", pin, [0.2, 0.01, 0.1, 1e-6]).unwrap();
    is_named(&rubbing, "friction", "reactions of a joint");
}

/// The angle between the markers of a universal joint is not one of its two coordinates, and a mass on one coordinate of a body is
/// not a rigid body.
#[test]
fn what_is_not_a_tree_in_space_is_named() {
    fn hung(add: impl Fn(&mut Mechanism<f64>, [Marker3<f64>; 2])) -> Mechanism<f64> {
        let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
        let ground = m.ground3().at([0.0; 3]).turned(Rotation::about_y(-1.2));
        let properties = MassProperties3 { mass: 1.0, centre: [0.0; 3], moments: [0.1, 0.1, 0.1], products: [0.0; 3] };
        let quarter = Rotation::about_y(std::f64::consts::FRAC_PI_2);
        let pose = Pose3::new([0.0; 3], Rotation::about_y(-1.2).then(quarter).then(Rotation::about_z(0.7)));
        let rod = m.body3("rod", properties, pose);
        let own = rod.at([0.0; 3]);
        m.universal("joint", ground, own);
        add(&mut m, [ground, own]);
        m
    }
    let angle = hung(|m, [a, b]| {
        m.joint_angle("angle", a, b);
    });
    is_named(&angle, "angle", "no coordinate of a joint");
    let mass = hung(|m, [_, b]| {
        m.inertia("added", b.body.x, 5.0);
    });
    is_named(&mass, "added", "adds mass to one coordinate");
}

#[test]
fn a_joint_that_moves_no_mass_is_named() {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let node = m.massless_node("node", Pose { x: 0.5, y: 0.0, theta: 0.0 });
    let ground = m.ground();
    m.revolute("pin", ground.origin(), node.at(-0.5, 0.0));
    let error = simulate_explicitly(&m, &settings(Coordinates::Relative), &[0.0, 0.1]).unwrap_err().to_string();
    assert!(error.contains("angle of pin") && error.contains("moves no mass"), "{error}");
}

#[test]
fn tolerances_by_component_are_those_of_absolute_coordinates() {
    let m = pendulum(|_, _| {});
    let count = 2 * m.coordinates().len();
    let tolerance = Tolerance { relative: vec![1e-8], absolute: vec![1e-8; count] };
    let control = StepControl::Adaptive { tolerance, longest: 0.1 };
    let by_component = Explicit::eighth_order(1.0).with_step_control(control);
    let run = simulate_explicitly(&m, &by_component, &[0.0, 0.1]).unwrap();
    assert_eq!(run.coordinates, Coordinates::Absolute);
    let given = by_component.clone().with_step_control(StepControl::Given(vec![0.1]));
    assert_eq!(simulate_explicitly(&m, &given, &[0.1]).unwrap().coordinates, Coordinates::Absolute);
    let relative = by_component.with_coordinates(Coordinates::Relative);
    let error = simulate_explicitly(&m, &relative, &[0.1]).unwrap_err().to_string();
    assert!(error.contains("absolute tolerances") && error.contains('4'), "{error}");
}

#[test]
fn very_different_masses_are_left_to_absolute_coordinates() {
    for (mass, expected) in [(1e-5, Coordinates::Relative), (1e-7, Coordinates::Absolute)] {
        let m = pendulum(|m, [_, second]| {
            let light = m.body("light", mass, mass * 0.01, Pose { x: 2.0, y: 0.0, theta: 0.0 });
            m.revolute("last", second.at(0.5, 0.0), light.origin());
        });
        let run = |coordinates| simulate_explicitly(&m, &settings(coordinates), &[0.02]).unwrap();
        assert_eq!(run(Coordinates::Automatic).coordinates, expected);
        assert_eq!(run(Coordinates::Relative).coordinates, Coordinates::Relative);
    }
}
