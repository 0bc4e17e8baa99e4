//! Bodies that are held by more joints than they need, compared with the same ones without the second joint.

use linkwright_mechanics::derivatives::modal::{About, squared_frequencies};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::integrators::explicit::{Coordinates, StepControl};
use linkwright_mechanics::motion::{ConstantSpeed, Ramp};
use linkwright_mechanics::{
    Dynamics, Explicit, Mechanism, Pose3, Rotation, Statics, equilibria, simulate, simulate_explicitly,
};

/// The second joint of a door: on the line of the hinge, or one that allows the same rotation.
#[derive(Clone, Copy, Debug, PartialEq)]
enum SecondJoint {
    None,
    Hinge,
    Ball,
    Plane,
    Cylinder,
}

const SECOND: [SecondJoint; 4] = [SecondJoint::Hinge, SecondJoint::Ball, SecondJoint::Plane, SecondJoint::Cylinder];

const AXES: [[f64; 3]; 6] =
    [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 1.0], [0.2, 1.0, 0.0], [0.6, 0.8, 0.0], [1.0, -2.0, 0.5]];

/// A door on a hinge about `axis`, turned by `angle`, with a torsional spring of `stiffness`.
fn door(axis: [f64; 3], angle: f64, second: SecondJoint, stiffness: f64) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -9.81]);
    let ground = m.ground3();
    let properties = MassProperties3::principal(2.0, [0.1, 0.12, 0.09]).with_centre([0.3, 0.1, -0.2]);
    let body = m.body3("door", properties, Pose3::new([0.0; 3], Rotation::about(axis, angle)));
    let length = axis.iter().map(|x| x * x).sum::<f64>().sqrt();
    let above = axis.map(|x| 0.5 * x / length);
    let (a, b) = (ground.origin().with_z(axis), body.origin().with_z(axis));
    m.revolute3("hinge", a, b);
    let (c, d) = (ground.at(above).with_z(axis), body.at(above).with_z(axis));
    match second {
        SecondJoint::None => None,
        SecondJoint::Hinge => Some(m.revolute3("second", c, d)),
        SecondJoint::Ball => Some(m.spherical("second", c, d)),
        SecondJoint::Plane => Some(m.planar_joint("second", c, d)),
        SecondJoint::Cylinder => Some(m.cylindrical("second", c, d)),
    };
    let turned = m.joint_angle("turned", a, b);
    let still = m.ground().theta;
    m.coordinate_spring("spring", still, turned, [stiffness, 0.0, 0.0, 0.0]);
    let sensor = m.coordinate_sensor("sensor", still, turned);
    let term = m.measure(sensor, "position").unwrap();
    m.output("angle", &[term]);
    m
}

/// Asserts for all doors that a result does not depend on the second joint.
fn is_without_effect(tolerance: f64, result: impl Fn(&Mechanism<f64>) -> linkwright_mechanics::Result<Vec<f64>>) {
    let (mut wrong, mut compared) = (Vec::new(), 0);
    for axis in AXES {
        for angle in [0.3, 0.9, 1.7, -0.5] {
            for stiffness in [0.0, 3.0] {
                // A search for an equilibrium far away may fail for the hinge alone.
                let Ok(expected) = result(&door(axis, angle, SecondJoint::None, stiffness)) else { continue };
                compared += 1;
                for second in SECOND {
                    let found = result(&door(axis, angle, second, stiffness));
                    let is_right = found.as_ref().is_ok_and(|found| {
                        found.iter().zip(&expected).all(|(a, b)| (a - b).abs() <= tolerance * (1.0 + b.abs()))
                    });
                    if !is_right {
                        wrong.push(format!("{axis:?} {angle} {stiffness} {second:?}: {found:?} for {expected:?}"));
                    }
                }
            }
        }
    }
    assert!(compared > 30, "{compared}");
    assert!(wrong.is_empty(), "{} are wrong\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn equilibria_and_frequencies_are_those_of_one_hinge() {
    is_without_effect(1e-7, |m| {
        let mut found: Vec<f64> = equilibria(m, &Statics::default(), &[0.0])?.concat();
        found.extend(squared_frequencies(m, About::Equilibrium(Statics::default()), 0.0)?);
        Ok(found)
    });
}

#[test]
fn explicit_motions_are_those_of_one_hinge_in_both_coordinates() {
    for coordinates in [Coordinates::Absolute, Coordinates::Relative] {
        let settings = Explicit::eighth_order(1.0).with_step_control(StepControl::Fixed(5e-3));
        let settings = settings.with_coordinates(coordinates);
        is_without_effect(1e-8, |m| Ok(simulate_explicitly(m, &settings, &[0.0, 0.2, 0.5])?.values.concat()));
    }
}

#[test]
fn implicit_motions_are_those_of_one_hinge() {
    is_without_effect(1e-6, |m| Ok(simulate(m, &Dynamics::fixed(5e-3), &[0.0, 0.1, 0.3])?.values.concat()));
}

/// A door that is fixed to the ground, and driven about its hinge: both cannot be satisfied at once.
#[test]
fn drives_that_contradict_redundant_joints_are_errors() {
    for (speed, is_at_start) in [([0.0, 1.0], true), ([0.0, 0.0], false)] {
        let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -9.81]);
        let ground = m.ground3();
        let body = m.body3("door", MassProperties3::principal(2.0, [0.1, 0.12, 0.09]), Pose3::at([0.0; 3]));
        m.revolute3("hinge", ground.origin(), body.origin());
        m.fixed_joint3("weld", ground.at([0.3, 0.0, 0.0]), body.at([0.3, 0.0, 0.0]));
        let place = if is_at_start { [0.0; 2] } else { [0.1, 0.1] };
        let motion = Ramp::Smooth;
        match is_at_start {
            true => m.drive_angle("motor", ground.origin(), body.origin(), ConstantSpeed, &speed),
            false => m.drive_angle("motor", ground.origin(), body.origin(), motion, &[0.0, 0.5, place[0], place[1]]),
        };
        let times = [0.0, 0.3];
        let error = simulate(&m, &Dynamics::fixed(5e-3), &times).unwrap_err().to_string();
        assert!(error.contains("contradict"), "{error}");
        if is_at_start {
            let error = simulate_explicitly(&m, &Explicit::eighth_order(1e-8), &times).unwrap_err().to_string();
            assert!(error.contains("contradict"), "{error}");
        }
    }
}
