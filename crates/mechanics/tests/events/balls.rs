//! Contacts of balls in space: stops on coordinates between points.

use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::mechanism::Pose3;
use linkwright_mechanics::{Body3, Dynamics, Mechanism};

fn ball(m: &mut Mechanism<f64>, name: &str, mass: f64, place: [f64; 3], velocity: [f64; 3]) -> Body3 {
    let body = m.body3(name, MassProperties3::principal(mass, [0.1; 3]), Pose3::at(place));
    m.set_velocity3(body, velocity, [0.0; 3]);
    let sensor = m.sensor3(&format!("{name} sensor"), body.origin());
    for what in ["x", "y", "z", "vx", "vy", "vz"] {
        let term = m.measure(sensor, what).unwrap();
        m.output(format!("{name} {what}"), &[term]);
    }
    body
}

/// Balls of 1 kg and 2 kg with the radius 0.2 m meet obliquely with the restitution 0.5. The impulse is along the line of centres.
#[test]
fn two_balls_bounce_off_each_other() {
    let mut m = Mechanism::with_gravity3([0.0; 3]);
    let a = ball(&mut m, "a", 1.0, [0.0; 3], [1.0, 0.0, 0.0]);
    let b = ball(&mut m, "b", 2.0, [1.0, 0.1, 0.0], [0.0; 3]);
    let distance = m.point_distance("distance", a.origin(), b.origin());
    let ground = m.ground();
    m.rigid_stop("contact", ground.x, distance, 0.4, 0.5);
    let normal = [0.15f64.sqrt() / 0.4, 0.1 / 0.4];
    let impulse = 1.5 * normal[0] / 1.5;
    let exact = [1.0 - impulse * normal[0], -impulse * normal[1], 0.5 * impulse * normal[0], 0.5 * impulse * normal[1]];
    let runs = [
        (simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &[2.0]).unwrap(), 1e-9),
        (simulate_explicitly(&m, &Explicit::adaptive(1e-9), &[2.0]).unwrap(), 1e-9),
        (simulate(&m, &Dynamics::fixed(5e-3), &[2.0]).unwrap(), 1e-5),
    ];
    for (run, accuracy) in runs {
        let ours = [3, 4, 9, 10].map(|k| run.values[k][0]);
        assert!(ours.iter().zip(exact).all(|(a, b)| (a - b).abs() < accuracy), "{ours:?} {exact:?}");
    }
}

/// A ball of the radius 0.2 m bounces on a floor until it rests, and keeps its velocity along the floor.
#[test]
fn a_ball_comes_to_rest_on_a_floor() {
    let mut m = Mechanism::with_gravity3([0.0, 0.0, -9.81]);
    let b = ball(&mut m, "b", 1.0, [0.0, 0.0, 1.0], [0.5, 0.0, 0.0]);
    let (floor, ground) = (m.ground3(), m.ground());
    let height = m.joint_displacement("height", floor.origin(), b.origin());
    let stop = m.rigid_stop("floor", ground.x, height, 0.2, 0.3);
    let force = m.measure(stop, "contact_force").unwrap();
    m.output("force", &[force]);
    for run in [
        simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &[2.0]).unwrap(),
        simulate(&m, &Dynamics::fixed(5e-3), &[2.0]).unwrap(),
    ] {
        let [x, z, force] = [0, 2, 6].map(|k| run.values[k][0]);
        assert!((x - 1.0).abs() < 1e-9 && (z - 0.2).abs() < 1e-8 && (force - 9.81).abs() < 1e-6, "{x} {z} {force}");
    }
}
