//! Bad input of spatial mechanisms: the error names the part, the value and the remedy.

use linkwright_mechanics::elements::spatial::{LoadKind3, MassProperties3};
use linkwright_mechanics::mechanism::{Marker3, Pose3, Rotation};
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
    has(&why, &["ball", "rod", "contradictory", "a gap of 2.000 m"]);
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

/// A joint between two markers.
type Add = fn(&mut Mechanism<f64>, &str, Marker3<f64>, Marker3<f64>);

/// Joints with axes that must have the same direction, and whether they keep all of them.
const ALIGNED: [(&str, bool, Add); 5] = [
    ("revolute", false, |m, name, a, b| {
        m.revolute3(name, a, b);
    }),
    ("prismatic", true, |m, name, a, b| {
        m.prismatic3(name, a, b);
    }),
    ("cylindrical", false, |m, name, a, b| {
        m.cylindrical(name, a, b);
    }),
    ("planar", false, |m, name, a, b| {
        m.planar_joint(name, a, b);
    }),
    ("fixed", true, |m, name, a, b| {
        m.fixed_joint3(name, a, b);
    }),
];

/// The equations of perpendicular axes hold upside down, too: every joint that has them says so, with its name and a remedy.
#[test]
fn every_joint_that_is_upside_down_is_named() {
    let half = std::f64::consts::PI;
    for (kind, keeps_all, add) in ALIGNED {
        // Turned about x, z and y are wrong; about z, joints that keep all axes are.
        for (turn, is_wrong) in [(Rotation::about_x(half), true), (Rotation::about_z(half), keeps_all)] {
            let mut m = Mechanism::<f64>::new();
            let ground = m.ground3();
            let arm = m.body3("arm", regular(), Pose3::new([0.0; 3], turn));
            add(&mut m, kind, ground.origin(), arm.origin());
            match simulate(&m, &Dynamics::fixed(0.01), &[0.1]) {
                Ok(_) => assert!(!is_wrong, "{kind}"),
                Err(error) => {
                    let words = [kind, "wrong way round", "should have the same direction", "initial orientations"];
                    has(&error.to_string(), &words);
                    assert!(is_wrong, "{kind}");
                }
            }
        }
    }
}

/// Axes of length zero, and parallel ones, at either end of every joint with axes.
#[test]
fn every_joint_with_an_impossible_axis_is_named() {
    let others: [(&str, Add); 5] = [
        ("universal", |m, name, a, b| {
            m.universal(name, a, b);
        }),
        ("constant-velocity", |m, name, a, b| {
            m.constant_velocity(name, a, b);
        }),
        ("point-on-line", |m, name, a, b| {
            m.point_on_line3(name, a, b);
        }),
        ("point-on-plane", |m, name, a, b| {
            m.point_on_plane(name, a, b);
        }),
        ("angle", |m, name, a, b| {
            m.joint_angle(name, a, b);
        }),
    ];
    let all = ALIGNED.map(|(kind, _, add)| (kind, add)).into_iter().chain(others);
    for (kind, add) in all {
        for (end, z, x, words) in [
            ("a", [0.0; 3], [1.0, 0.0, 0.0], "length zero"),
            ("b", [0.0; 3], [1.0, 0.0, 0.0], "length zero"),
            ("a", [0.0, 0.0, 1.0], [0.0, 0.0, -3.0], "parallel"),
            ("b", [0.0, 0.0, 1.0], [0.0, 0.0, 2.0], "parallel"),
            ("a", [f64::NAN, 0.0, 1.0], [1.0, 0.0, 0.0], "no rotation"),
        ] {
            let why = message(regular(), Pose3::at([0.0; 3]), |m, ground, arm| {
                let (a, b) = (ground.origin(), arm.origin());
                let bad = |marker: Marker3<f64>| marker.with_z_x(z, x);
                if end == "a" { add(m, kind, bad(a), b) } else { add(m, kind, a, bad(b)) }
            });
            has(&why, &[kind, &format!("point {end} is no rotation"), words]);
        }
    }
}

/// Joints that cannot hold at the same time: one of them is named, with what to check.
#[test]
fn joints_that_contradict_each_other_are_named() {
    let at = Pose3::at([0.0; 3]);
    let across = |m: &mut Mechanism<f64>, ground: Body3, arm: Body3| {
        m.fixed_joint3("weld", ground.origin(), arm.origin());
        m.revolute3("hinge", ground.origin().with_z([1.0, 0.0, 0.0]), arm.origin().with_z([0.0, 1.0, 0.0]));
    };
    let apart = |m: &mut Mechanism<f64>, ground: Body3, arm: Body3| {
        m.prismatic3("guide", ground.origin(), arm.origin());
        m.spherical("ball", ground.at([0.2, 0.0, 0.0]), arm.origin());
    };
    let driven = |m: &mut Mechanism<f64>, ground: Body3, arm: Body3| {
        m.revolute3("hinge", ground.origin(), arm.origin());
        m.distance_constraint3("rod", ground.at([3.0, 0.0, 0.0]), arm.at([1.0, 0.0, 0.0]), 1.0);
    };
    for (names, add) in [
        (["weld", "hinge"], &across as &dyn Fn(&mut Mechanism<f64>, Body3, Body3)),
        (["guide", "ball"], &apart),
        (["hinge", "rod"], &driven),
    ] {
        let why = message(regular(), at, |m, ground, arm| add(m, ground, arm));
        println!("{why}");
        assert!(names.iter().any(|name| why.contains(name)), "{why}");
        assert!(
            ["contradictory", "cannot be assembled", "cannot be closed"].iter().any(|words| why.contains(words)),
            "{why}"
        );
        assert!(why.contains(';'), "no remedy: {why}");
    }
}
