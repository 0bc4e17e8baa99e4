//! Inverse dynamics of a Stewart platform, compared with the principle of virtual work.

use crate::{follows, times, watch};
use autodiff::{Jet2, Scalar};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::motion::Motion;
use linkwright_mechanics::{Assembly, Mechanism, kinematics};

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
