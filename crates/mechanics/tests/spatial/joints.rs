//! Joints and their coordinates compared with closed forms.

use crate::{accurate, follows, times, watch};
use autodiff::{DualNum, Jet2};
use linkwright_mechanics::elements::spatial::{LoadKind3, MassProperties3};
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Harmonic};
use linkwright_mechanics::{Assembly, Mechanism, kinematics, simulate_explicitly};

/// Two shafts at the angle β, joined by a universal joint: tan φ₂ = cos β tan φ₁ if the cross's axis on the first shaft is
/// normal to the plane of the shafts at φ₁ = 0.
///
/// # Sources
/// Seherr-Thoss, Schmelz & Aucktor, *Universal Joints and Driveshafts* (2006), Section 1.2.
#[test]
fn a_universal_joint_transmits_its_ratio_and_torque() {
    let (beta, speed, inertia, load) = (0.5f64, 7.0, 0.02, 1.5);
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground3();
    let (first, second) = ([1.0, 0.0, 0.0], [beta.cos(), beta.sin(), 0.0]);
    let (normal, across) = ([0.0, 0.0, 1.0], [-beta.sin(), beta.cos(), 0.0]);
    let properties = MassProperties3::principal(1.0, [inertia; 3]);
    let shafts = ["one", "two"].map(|name| m.body3(name, properties, Pose3::at([0.0; 3])));
    let [one, two] = shafts;
    let bearing = [ground.origin().with_z_x(first, normal), one.origin().with_z_x(first, normal)];
    let other = [ground.origin().with_z_x(second, normal), two.origin().with_z_x(second, normal)];
    m.revolute3("bearing", bearing[0], bearing[1]);
    // The second shaft is held by the cross, and turns about its own axis only.
    m.cylindrical("sleeve", other[0], other[1]);
    m.universal("cross", one.origin().with_z(normal), two.origin().with_z(across));
    let input = m.drive_angle("input", bearing[0], bearing[1], ConstantSpeed, &[0.0, speed]);
    let output = m.joint_angle("output", other[0], other[1]);
    m.load3("load", LoadKind3::FollowerTorque, two.origin(), second, Fixed, &[load]);
    let still = m.ground().x;
    let sensor = m.coordinate_sensor("output motion", still, output);
    watch(&mut m, sensor, &["position", "velocity", "acceleration"]).unwrap();
    let torque = m.driving_force(input);
    m.output("torque", &[torque]);
    let at = times(2.0, 80);
    let values = kinematics(&m, Assembly::default(), &at).unwrap();
    let turn = |t: f64| {
        let phi = Jet2::new(speed * t, speed, 0.0);
        let (sin, cos) = phi.sin_cos();
        // Deviation from φ₁, which has no jumps.
        let ahead = (sin * cos * (beta.cos() - 1.0)).atan2(cos * cos + sin * sin * beta.cos());
        phi + ahead
    };
    follows("φ2", &at, &values[0], |t| turn(t).re, 1e-11);
    follows("rate", &at, &values[1], |t| turn(t).v1, 1e-10);
    follows("acceleration", &at, &values[2], |t| turn(t).v2, 1e-8);
    // Virtual work: T₁ φ̇₁ = (J φ̈₂ − T₂) φ̇₂.
    let expected = |t: f64| (inertia * turn(t).v2 - load) * turn(t).v1 / speed;
    follows("torque", &at, &values[3], expected, 1e-9);
}

/// Two shafts at the angle β, joined by a constant-velocity joint: φ₂ = φ₁, and the torques have the same size.
///
/// # Sources
/// Seherr-Thoss, Schmelz & Aucktor, *Universal Joints and Driveshafts* (2006), Section 1.3.
#[test]
fn a_constant_velocity_joint_transmits_angle_and_torque_unchanged() {
    let (inertia, load) = (0.02, 1.5);
    for beta in [0.0, 0.5, -1.1, 1.9f64] {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground3();
        let (first, second, normal) = ([1.0, 0.0, 0.0], [beta.cos(), beta.sin(), 0.0], [0.0, 0.0, 1.0]);
        let properties = MassProperties3::principal(1.0, [inertia; 3]);
        let [one, two] = ["one", "two"].map(|name| m.body3(name, properties, Pose3::at([0.0; 3])));
        let bearing = [ground.origin().with_z_x(first, normal), one.origin().with_z_x(first, normal)];
        let other = [ground.origin().with_z_x(second, normal), two.origin().with_z_x(second, normal)];
        m.revolute3("bearing", bearing[0], bearing[1]);
        m.cylindrical("sleeve", other[0], other[1]);
        let joint = m.constant_velocity("joint", bearing[1], other[1]);
        let input = m.drive_angle("input", bearing[0], bearing[1], Harmonic, &[0.0, 2.0, 3.0, 0.4]);
        let output = m.joint_angle("output", other[0], other[1]);
        m.load3("load", LoadKind3::FollowerTorque, two.origin(), second, Fixed, &[load]);
        let still = m.ground().x;
        for (name, shaft) in [("first", input), ("second", output)] {
            let sensor = m.coordinate_sensor(name, still, shaft);
            watch(&mut m, sensor, &["position", "velocity", "acceleration"]).unwrap();
        }
        watch(&mut m, joint, &["torque"]).unwrap();
        let torque = m.driving_force(input);
        m.output("driving torque", &[torque]);
        let at = times(2.0, 80);
        let values = kinematics(&m, Assembly::default(), &at).unwrap();
        for k in 0..at.len() {
            for order in 0..3 {
                let (given, found) = (values[order][k], values[3 + order][k]);
                assert!((found - given).abs() < 1e-10, "order {order} at β = {beta}: {found} for {given}");
            }
            // Of the torque about the bisector of the shafts, each shaft feels the component along it; the bearings hold the rest.
            let shaft = inertia * values[5][k] - load;
            let (driving, at_joint) = (inertia * values[2][k] + shaft, shaft.abs() / (0.5 * beta).cos());
            assert!((values[7][k] - driving).abs() < 1e-10, "β = {beta}: {} for {driving}", values[7][k]);
            assert!((values[6][k] - at_joint).abs() < 1e-10, "β = {beta}: {} for {at_joint}", values[6][k]);
        }
    }
}

/// A screw under gravity along its axis: m s̈ + J (2π/p)² s̈ = −m g.
#[test]
fn a_nut_falls_slowly_on_its_screw() {
    let (mass, inertia, pitch, g) = (0.5, 0.003, 0.04, 9.81);
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -g]);
    let ground = m.ground3();
    let pose = Pose3::new([0.1, 0.2, 0.3], Rotation::about_z(0.4));
    let nut = m.body3("nut", MassProperties3::principal(mass, [0.01, 0.01, inertia]), pose);
    let [angle, displacement] = m.screw("screw", ground.at([0.1, 0.2, 0.0]), nut.origin(), pitch);
    let still = m.ground().x;
    for coordinate in [angle, displacement] {
        let sensor = m.coordinate_sensor("sensor", still, coordinate);
        watch(&mut m, sensor, &["position"]).unwrap();
    }
    let lead = pitch / (2.0 * std::f64::consts::PI);
    let acceleration = -g * mass / (mass + inertia / (lead * lead));
    let at = times(3.0, 30);
    let run = simulate_explicitly(&m, &accurate(), &at).unwrap();
    let fall = |t: f64| 0.5 * acceleration * t * t;
    // More than four turns in three seconds.
    follows("angle", &at, &run.values[0], |t| 0.4 + fall(t) / lead, 1e-8);
    follows("displacement", &at, &run.values[1], |t| 0.3 + fall(t), 1e-9);
    assert!(fall(3.0) / lead < -8.0 * std::f64::consts::PI);
}

/// Springs, gears and flywheels of coordinates act on angles of joints: two wheels with parallel axes and a torsion spring
/// oscillate with ω² = k/(J₁ + (r₁/r₂)² J₂).
#[test]
fn geared_wheels_oscillate_on_a_spring() {
    let (k, j1, j2, flywheel, ratio) = (4.0, 0.05, 0.02, 0.01, 1.6);
    let mut m = Mechanism::<f64>::new();
    let ground = m.ground3();
    let mut wheel = |name: &str, inertia: f64, at: [f64; 3], angle: f64| {
        // The axes are along x of the world.
        let along_x = [1.0, 0.0, 0.0];
        let orientation = Rotation::about_x(angle);
        let body = m.body3(name, MassProperties3::principal(1.0, [inertia, 0.05, 0.05]), Pose3::new(at, orientation));
        let up = [0.0, 0.0, 1.0];
        let (a, b) = (ground.at(at).with_z_x(along_x, up), body.origin().with_z_x(along_x, up));
        m.revolute3(name, a, b);
        m.joint_angle(&format!("{name}.angle"), a, b)
    };
    let one = wheel("one", j1, [0.0; 3], 0.3);
    let two = wheel("two", j2, [0.0, 0.4, 0.0], -0.3 * ratio);
    let fixed = m.ground().theta;
    m.gear_pair("gears", [one, two], fixed, [ratio, 1.0, 0.0]);
    m.coordinate_spring("spring", fixed, one, [k, 0.0, 0.0, 0.0]);
    m.inertia("flywheel", two, flywheel);
    let sensor = m.coordinate_sensor("sensor", fixed, one);
    watch(&mut m, sensor, &["position"]).unwrap();
    let at = times(4.0, 40);
    let run = simulate_explicitly(&m, &accurate(), &at).unwrap();
    let rate = (k / (j1 + ratio * ratio * (j2 + flywheel))).sqrt();
    follows("angle", &at, &run.values[0], |t| 0.3 * (rate * t).cos(), 1e-8);
}

/// A cantilevered body on a guide: displacement, reaction and its moment by statics.
#[test]
fn a_guide_carries_force_and_moment() {
    let (mass, g, lever) = (2.0, 9.81, 0.3);
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -g]);
    let ground = m.ground3();
    let along_x = [1.0, 0.0, 0.0];
    let up = [0.0, 0.0, 1.0];
    let carriage = m.body3(
        "carriage",
        MassProperties3::principal(mass, [0.1; 3]).with_centre([0.0, lever, 0.0]),
        Pose3::at([0.0; 3]),
    );
    let (a, b) = (ground.origin().with_z_x(along_x, up), carriage.origin().with_z_x(along_x, up));
    let guide = m.prismatic3("guide", a, b);
    let drive = m.drive_displacement("drive", a, b, ConstantSpeed, &[0.0, 0.5]);
    watch(&mut m, guide, &["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z"]).unwrap();
    let force = m.driving_force(drive);
    m.output("force", &[force]);
    let values = kinematics(&m, Assembly::default(), &[0.0, 0.8]).unwrap();
    // The marker has x up and z along x of the world: the weight turns the carriage about z of the marker.
    let expected = [mass * g, 0.0, 0.0, 0.0, 0.0, mass * g * lever, 0.0];
    for (series, expected) in values.iter().zip(expected) {
        for value in series {
            assert!((value - expected).abs() < 1e-10, "{values:?}");
        }
    }
}
