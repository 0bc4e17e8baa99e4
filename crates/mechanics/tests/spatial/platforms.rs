//! Inverse dynamics of a Stewart platform and of a delta robot, compared with the principle of virtual work.

use crate::{follows, times, watch};
use autodiff::{Jet2, Scalar};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::motion::Motion;
use linkwright_mechanics::{Assembly, Mechanism, kinematics};
use nalgebra::{Matrix6, Vector3, Vector6};

/// Motion of the platform: position, and matrix row by row.
fn platform<T: Scalar>(t: T) -> ([T; 3], [[T; 3]; 3]) {
    let position = [(t * 2.0).sin() * 0.1, (t * 3.0).cos() * 0.05, t.sin() * 0.1 + 0.8];
    let tilt = Rotation::about_x((t * 2.0).sin() * 0.2).then(Rotation::about_y(t.cos() * 0.15));
    (position, tilt.then(Rotation::about_z(t * 0.3)).matrix())
}

/// Length of a leg from a point of the base to a point of the platform: p = (base, platform).
struct Leg;

impl Motion for Leg {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let (position, rotation) = platform(t);
        let square = |i: usize| {
            let end = position[i] + rotation[i][0] * p[3] + rotation[i][1] * p[4] + rotation[i][2] * p[5] - p[i];
            end * end
        };
        (square(0) + square(1) + square(2)).sqrt()
    }
}

#[test]
fn forces_of_the_legs_do_the_work_of_the_platform() {
    let (mass, gravity) = (12.0, [0.0, 0.0, -9.81]);
    let moments = [0.5, 0.6, 0.9];
    let mut m = Mechanism::<f64>::with_gravity3(gravity);
    let ground = m.ground3();
    let (start, rows) = platform(0.0);
    let pose = Pose3::new(start, Rotation::from_matrix(rows).unwrap());
    let body = m.body3("platform", MassProperties3::principal(mass, moments), pose);
    let ends: Vec<[[f64; 3]; 2]> = (0..6)
        .map(|k| {
            let angle = f64::from(k) * std::f64::consts::FRAC_PI_3;
            let (near, far) = (angle + if k % 2 == 0 { 0.45 } else { -0.45 }, angle);
            [[0.6 * far.cos(), 0.6 * far.sin(), 0.0], [0.3 * near.cos(), 0.3 * near.sin(), -0.02]]
        })
        .collect();
    for (k, [base, top]) in ends.iter().enumerate() {
        let leg = m.drive_distance(&format!("leg {k}"), ground.at(*base), body.at(*top), Leg, &[*base, *top].concat());
        let force = m.driving_force(leg);
        m.output(format!("force {k}"), &[force]);
    }
    let sensor = m.sensor3("sensor", body.origin());
    watch(&mut m, sensor, &["x", "y", "z"]).unwrap();
    let at = times(4.0, 80);
    let values = kinematics(&m, Assembly::default(), &at).unwrap();
    for k in 0..3 {
        follows(&format!("position {k}"), &at, &values[6 + k], |t| platform(t).0[k], 1e-11);
    }
    let mut worst = [0.0f64; 2];
    for (p, &t) in at.iter().enumerate() {
        let (position, rotation) = platform(Jet2::new(t, 1.0, 0.0));
        let (mut force, mut moment) = ([0.0; 3], [0.0; 3]);
        for (k, [base, top]) in ends.iter().enumerate() {
            let lever: [f64; 3] = std::array::from_fn(|i| (0..3).map(|j| rotation[i][j].re * top[j]).sum());
            let along: [f64; 3] = std::array::from_fn(|i| position[i].re + lever[i] - base[i]);
            let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
            let push = along.map(|x| x / length * values[k][p]);
            for i in 0..3 {
                let (j, l) = ((i + 1) % 3, (i + 2) % 3);
                force[i] += push[i];
                moment[i] += lever[j] * push[l] - lever[l] * push[j];
            }
        }
        // The rate of the angular momentum is ∫ (R ρ) × (R̈ ρ) dm, with the second moments of mass ∫ ρ ρᵀ dm.
        let half = 0.5 * moments.iter().sum::<f64>();
        let second = moments.map(|j| half - j);
        let product =
            |i: usize, j: usize| -> f64 { (0..3).map(|k| rotation[i][k].v2 * second[k] * rotation[j][k].re).sum() };
        for i in 0..3 {
            let (j, l) = ((i + 1) % 3, (i + 2) % 3);
            worst[0] = worst[0].max((force[i] - mass * (position[i].v2 - gravity[i])).abs());
            worst[1] = worst[1].max((moment[i] - (product(l, j) - product(j, l))).abs());
        }
    }
    println!("force {:.1e} N, moment {:.1e} N·m", worst[0], worst[1]);
    assert!(worst[0] < 1e-9 && worst[1] < 1e-9);
}

/// Radii of the circles of motors and of the rods on the platform, lengths of arms and rods, half the distance of two rods.
const DELTA: [f64; 5] = [0.15, 0.05, 0.25, 0.6, 0.04];

/// Path of the platform of a delta robot below its motors.
fn way<T: Scalar>(t: T) -> [T; 3] {
    [(t * 2.0).sin() * 0.12, (t * 3.0).cos() * 0.1, (t * 1.5).sin() * 0.08 - 0.55]
}

/// Angle of the arm of a delta robot below the horizontal, in the direction of the given angle about z.
struct ArmAngle(f64);

impl Motion for ArmAngle {
    fn position<T: Scalar>(&self, _p: &[T], t: T) -> T {
        let ([base, plate, arm, rod, _], [x, y, z]) = (DELTA, way(t));
        let (sin, cos) = self.0.sin_cos();
        let (out, side, down) = (x * cos + y * sin + (plate - base), y * cos - x * sin, -z);
        let reach = (out * out + down * down).sqrt();
        let cosine = (reach * reach + side * side + (arm * arm - rod * rod)) / (reach * (2.0 * arm));
        down.atan2(out) - cosine.acos()
    }
}

/// An arm of a delta robot: its direction, the axis of its motor, and its elbow as a function of its angle.
fn elbow<T: Scalar>(direction: f64, angle: T) -> [T; 3] {
    let [base, _, arm, ..] = DELTA;
    let (sin, cos) = direction.sin_cos();
    let out = angle.cos() * arm + base;
    [out * cos, out * sin, -angle.sin() * arm]
}

/// Six rods with mass between three arms and the platform, each with a spherical and a universal joint, against d'Alembert's
/// principle for slender rods: a rod with accelerations a₁ and a₂ of its ends needs the forces m/6 (2 a₁ + a₂) − m g/2 + λ u and
/// m/6 (a₁ + 2 a₂) − m g/2 − λ u.
#[test]
fn torques_of_a_delta_robot_are_those_of_virtual_work() {
    let ([base, plate, arm, rod, half], gravity) = (DELTA, Vector3::new(0.0, 0.0, -9.81));
    let ([arm_mass, rod_mass, plate_mass], moment) = ([0.3, 0.08, 0.7], 2e-3);
    let vector = |x: [f64; 3]| Vector3::from(x);
    let mut m = Mechanism::<f64>::with_gravity3(gravity.into());
    let ground = m.ground3();
    let start = vector(way(0.0));
    let platform = m.body3("platform", MassProperties3::principal(plate_mass, [2e-3; 3]), Pose3::at(start.into()));
    let directions = [0.0, 2.0, 4.0].map(|k| k * std::f64::consts::FRAC_PI_3);
    let axes = directions.map(|direction: f64| {
        let (sin, cos) = direction.sin_cos();
        [[cos, sin, 0.0], [-sin, cos, 0.0]].map(Vector3::from)
    });
    for (k, (&direction, [out, axis])) in directions.iter().zip(axes).enumerate() {
        let pivot = out * base;
        let first = vector(elbow(direction, ArmAngle(direction).position(&[], 0.0)));
        let along = (first - pivot) / arm;
        let properties = MassProperties3::principal(arm_mass, [moment; 3]).with_centre([0.5 * arm, 0.0, 0.0]);
        let pose = Pose3::new(pivot.into(), Rotation::from_x_z(along.into(), axis.into()));
        let body = m.body3(&format!("arm {k}"), properties, pose);
        let a = ground.at(pivot.into()).with_z_x(axis.into(), out.into());
        let b = body.origin().with_z_x([0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
        m.revolute3(&format!("hinge {k}"), a, b);
        let motor = m.drive_angle(&format!("motor {k}"), a, b, ArmAngle(direction), &[]);
        let torque = m.driving_force(motor);
        m.output(format!("torque {k}"), &[torque]);
        for side in [-half, half] {
            let fixed = out * plate + axis * side;
            let [near, far] = [first + axis * side, start + fixed];
            let along = (far - near) / rod;
            // A slender rod: its moment about its axis is small, but that of a body.
            let across = rod_mass * rod * rod / 12.0;
            let pose = Pose3::new(((near + far) * 0.5).into(), Rotation::from_x_z(along.into(), axis.into()));
            let to_rod = pose.orientation.inverse();
            let link = m.body3("rod", MassProperties3::principal(rod_mass, [1e-10, across, across]), pose);
            m.spherical("elbow", body.at([arm, 0.0, side]), link.at([-0.5 * rod, 0.0, 0.0]));
            let cross = along.cross(&axis);
            let end = link.at([0.5 * rod, 0.0, 0.0]).with_z(to_rod.rotate(cross.into()));
            m.universal("wrist", platform.at(fixed.into()).with_z(axis.into()), end);
        }
    }
    let at = times(4.0, 80);
    let values = kinematics(&m, Assembly::default(), &at).unwrap();
    let mut worst = 0.0f64;
    for (p, &t) in at.iter().enumerate() {
        let now = Jet2::new(t, 1.0, 0.0);
        let acceleration = |x: [Jet2<f64>; 3]| vector(x.map(|x| x.v2));
        let position = |x: [Jet2<f64>; 3]| vector(x.map(|x| x.re));
        let (middle, of_plate) = (position(way(now)), acceleration(way(now)));
        let (mut columns, mut right) = (Matrix6::zeros(), Vector6::zeros());
        right.fixed_rows_mut::<3>(0).copy_from(&((of_plate - gravity) * plate_mass));
        let mut arms = vec![];
        for (k, (&direction, [out, axis])) in directions.iter().zip(axes).enumerate() {
            let angle = ArmAngle(direction).position(&[], now);
            let near = elbow(direction, angle);
            let (at_elbow, of_elbow) = (position(near), acceleration(near));
            let along = (middle + out * plate - at_elbow) / rod;
            let own = (of_elbow * 2.0 + of_plate) * (rod_mass / 6.0) - gravity * (0.5 * rod_mass);
            let other = (of_elbow + of_plate * 2.0) * (rod_mass / 6.0) - gravity * (0.5 * rod_mass);
            for (j, side) in [-half, half].into_iter().enumerate() {
                let lever = out * plate + axis * side;
                let mut column = columns.column_mut(2 * k + j);
                column.fixed_rows_mut::<3>(0).copy_from(&along);
                column.fixed_rows_mut::<3>(3).copy_from(&lever.cross(&along));
                let mut force = right.fixed_rows_mut::<3>(0);
                force += other;
                let mut torque = right.fixed_rows_mut::<3>(3);
                torque += lever.cross(&other);
            }
            arms.push((angle, (at_elbow - out * base).cross(&axis) * -1.0, own, along));
        }
        let forces = columns.lu().solve(&right).unwrap();
        for (k, (angle, by_angle, own, along)) in arms.into_iter().enumerate() {
            let inertia = moment + arm_mass * 0.25 * arm * arm;
            let on_rods = own * 2.0 + along * (forces[2 * k] + forces[2 * k + 1]);
            let expected = inertia * angle.v2 - arm_mass * 0.5 * by_angle.dot(&gravity) + on_rods.dot(&by_angle);
            worst = worst.max((values[k][p] - expected).abs());
        }
    }
    let largest = values.iter().flatten().fold(0.0f64, |a, b| a.max(b.abs()));
    println!("torque {worst:.1e} N·m of {largest:.2} N·m");
    assert!(worst < 1e-9 && largest > 1.0);
}
