//! Bad input of spatial mechanisms: the error names the part, the value and the remedy.

use linkwright_mechanics::elements::spatial::{LoadKind3, MassProperties3};
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::motion::Fixed;
use linkwright_mechanics::{Assembly, Body3, Dynamics, Mechanism, kinematics, simulate};

/// The message of a mechanism of the ground and one body after `add`.
fn message(
    properties: MassProperties3<f64>,
    pose: Pose3<f64>,
    add: impl FnOnce(&mut Mechanism<f64>, Body3, Body3),
) -> String {
    let mut m = Mechanism::new();
    let ground = m.ground3();
    let body = m.body3("arm", properties, pose);
    add(&mut m, ground, body);
    simulate(&m, &Dynamics::fixed(0.01), &[0.1]).unwrap_err().to_string()
}

fn regular() -> MassProperties3<f64> {
    MassProperties3::principal(1.0, [1.0, 1.2, 1.5])
}

#[track_caller]
fn has(message: &str, words: &[&str]) {
    println!("{message}");
    for word in words {
        assert!(message.contains(word), "`{word}` is not in: {message}");
    }
}

#[test]
fn masses_and_inertias_that_no_body_has() {
    let at = Pose3::at([0.0; 3]);
    let of = |properties| message(properties, at, |_, _, _| {});
    has(&of(MassProperties3::principal(-1.0, [1.0; 3])), &["arm", "mass is -1 kg", "positive"]);
    has(&of(MassProperties3::principal(1.0, [1.0, 0.0, 1.0])), &["arm", "principal moments", "positive"]);
    has(&of(MassProperties3::principal(1.0, [1.0, 1.0, 2.5])), &["arm", "must not exceed the sum"]);
    has(&of(MassProperties3 { products: [1.5, 0.0, 0.0], ..regular() }), &["arm", "positive", "sign of the products"]);
}

#[test]
fn axes_without_length_and_orientations_that_are_no_rotations() {
    let at = Pose3::at([0.0; 3]);
    let joint = message(regular(), at, |m, ground, arm| {
        m.revolute3("hinge", ground.origin().with_z([0.0; 3]), arm.origin());
    });
    has(&joint, &["hinge", "point a is no rotation", "length zero"]);
    let parallel = message(regular(), at, |m, ground, arm| {
        m.revolute3("hinge", ground.origin(), arm.origin().with_z_x([0.0, 0.0, 1.0], [0.0, 0.0, 2.0]));
    });
    has(&parallel, &["hinge", "point b is no rotation", "parallel"]);
    let load = message(regular(), at, |m, _, arm| {
        m.load3("wind", LoadKind3::Force, arm.origin(), [0.0; 3], Fixed, &[1.0]);
    });
    has(&load, &["wind", "direction", "length zero"]);
    let pose = Pose3::new([0.0; 3], Rotation::about([0.0; 3], 1.0));
    has(&message(regular(), pose, |_, _, _| {}), &["arm.e", "not finite"]);
    let rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]];
    has(&Rotation::from_matrix(rows).unwrap_err().to_string(), &["no rotation", "right-handed"]);
}

#[test]
fn joints_that_are_assembled_the_wrong_way_round() {
    let half = std::f64::consts::PI;
    let upside_down = Pose3::new([0.0; 3], Rotation::about_x(half - 0.2));
    let why = message(regular(), upside_down, |m, ground, arm| {
        m.revolute3("hinge", ground.origin(), arm.origin());
    });
    has(&why, &["hinge", "wrong way round", "z-axes", "initial orientations"]);
    // A little nearer, it is assembled as intended.
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground3();
    let arm = m.body3("arm", regular(), Pose3::new([0.1, 0.0, 0.0], Rotation::about_x(1.2)));
    m.revolute3("hinge", ground.origin(), arm.origin());
    m.drive_angle("drive", ground.origin(), arm.origin(), Fixed, &[0.3]);
    assert!(kinematics(&m, Assembly::default(), &[0.0]).is_ok());
}

#[test]
fn points_that_coincide_and_joints_that_cannot_close() {
    let at = Pose3::at([0.0; 3]);
    let why = message(regular(), at, |m, ground, arm| {
        m.distance_constraint3("rod", ground.origin(), arm.origin(), 1.0);
    });
    has(&why, &["rod", "coincide"]);
    let why = message(regular(), Pose3::at([1.0, 0.0, 0.0]), |m, ground, arm| {
        m.spherical("ball", ground.at([3.0, 0.0, 0.0]), arm.origin());
        m.distance_constraint3("rod", ground.origin(), arm.at([0.5, 0.0, 0.0]), 1.0);
    });
    has(&why, &["rod", "contradictory"]);
}

/// Warnings about negative coefficients look at the coefficients, not at coordinates of points.
#[test]
fn a_spring_that_pushes_away_is_told() {
    let warnings = |stiffness: f64| {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground3();
        let arm = m.body3("arm", regular(), Pose3::at([1.0, 0.0, 0.0]));
        m.spring_damper3("spring", ground.at([-0.1; 3]), arm.at([-0.2; 3]), [stiffness, 0.1, 1.0]);
        simulate(&m, &Dynamics::fixed(0.01), &[0.1]).unwrap().warnings
    };
    assert!(warnings(5.0).is_empty(), "{:?}", warnings(5.0));
    assert!(warnings(-5.0).iter().any(|warning| warning.contains("spring") && warning.contains("stiffness of -5")));
}
