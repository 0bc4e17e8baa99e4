//! Contacts of spheres with friction, compared with closed forms and conservation laws.

use crate::{accurate, follows, times, watch};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::mechanism::{Pose3, Rotation};
use linkwright_mechanics::{Dynamics, Mechanism, Result, simulate, simulate_explicitly};

const MASS: f64 = 0.17;
const RADIUS: f64 = 0.0286;
const SPEED: f64 = 2.0;
const FRICTION: f64 = 0.2;
const GRAVITY: f64 = 9.81;

/// A ball that rests in the compliant floor, an inclined plane of the given angle (rad), with the velocity 2 m/s along x and no spin.
fn ball(incline: f64, friction: f64) -> Result<Mechanism<f64>> {
    let stiffness = 1e6;
    let (sin, cos) = incline.sin_cos();
    let mut m = Mechanism::with_gravity3([GRAVITY * sin, 0.0, -GRAVITY * cos]);
    let sinking = (MASS * GRAVITY * cos / stiffness).powf(2.0 / 3.0);
    let inertia = 0.4 * MASS * RADIUS * RADIUS;
    let body = m.body3(
        "ball",
        MassProperties3::principal(MASS, [inertia; 3]),
        Pose3::new([0.0, 0.0, RADIUS - sinking], Rotation::about([1.0, 2.0, -0.5], 0.7)),
    );
    m.set_velocity3(body, [SPEED, 0.0, 0.0], [0.0; 3]);
    let ground = m.ground3();
    let floor = m.sphere_plane3("floor", ground.origin(), body.origin(), RADIUS, [stiffness, 0.0, friction, 1e-3]);
    let sensor = m.sensor3("centre", body.origin());
    watch(&mut m, sensor, &["x", "vx", "omega_y", "z"])?;
    watch(&mut m, floor, &["contact_force", "friction_x", "friction_y", "depth"])?;
    Ok(m)
}

/// A ball slides until its lowest point is at rest, at t = 2 v₀/(7 μ g), and rolls then with 5/7 of its speed.
///
/// # Sources
/// Goldsmith, *Impact* (1960); Coriolis, *Théorie mathématique des effets du jeu de billard* (1835).
#[test]
fn a_billiard_ball_slides_and_then_rolls() -> Result<()> {
    let (m, times) = (ball(0.0, FRICTION)?, times(0.6, 60));
    let rolls = 2.0 * SPEED / (7.0 * FRICTION * GRAVITY);
    assert!(rolls < 0.3);
    let speed = |t: f64| SPEED - FRICTION * GRAVITY * t.min(rolls);
    let spin = |t: f64| 2.5 * FRICTION * GRAVITY * t.min(rolls) / RADIUS;
    for (label, history) in [
        ("explicit", simulate_explicitly(&m, &accurate(), &times)?),
        ("implicit", simulate(&m, &Dynamics::fixed(1e-4), &times)?),
    ] {
        // The friction falls over the transition speed.
        follows(&format!("{label} speed"), &times, &history.values[1], speed, 3e-5);
        follows(&format!("{label} spin"), &times, &history.values[2], spin, 3e-3);
        follows(&format!("{label} force"), &times, &history.values[4], |_| MASS * GRAVITY, 1e-8);
    }
    Ok(())
}

/// Down an incline a ball rolls with 5/7 of the acceleration of a body without friction, and with less friction than 2/7 tan α it slides.
#[test]
fn a_ball_on_an_incline_rolls_or_slides() -> Result<()> {
    let (incline, times) = (0.4f64, times(0.5, 10));
    let pull = GRAVITY * incline.sin();
    let limit = 2.0 / 7.0 * incline.tan();
    let sliding = simulate_explicitly(&ball(incline, 0.5 * limit)?, &accurate(), &times)?;
    let acceleration = pull - 0.5 * limit * GRAVITY * incline.cos();
    follows("slides", &times, &sliding.values[1], |t| SPEED + acceleration * t, 1e-7);
    let rolling = simulate_explicitly(&ball(incline, 5.0 * limit)?, &accurate(), &times)?;
    let change = |history: &[f64]| (history[9] - history[4]) / (times[9] - times[4]);
    let (rate, spin) = (change(&rolling.values[1]), change(&rolling.values[2]));
    assert!((rate - 5.0 / 7.0 * pull).abs() < 1e-6 * pull, "{rate}");
    assert!((spin * RADIUS - rate).abs() < 1e-6 * rate, "{spin}");
    Ok(())
}

/// Two balls without friction and damping exchange their velocities along the line of their centres. With friction and damping, momentum and
/// angular momentum are conserved.
#[test]
fn two_balls_collide() -> Result<()> {
    let inertia = 0.4 * MASS * RADIUS * RADIUS;
    let (offset, times) = (0.5f64, times(0.06, 12));
    for (damping, friction) in [(0.0, 0.0), (0.3, 0.4)] {
        let mut m = Mechanism::new();
        let properties = MassProperties3::principal(MASS, [inertia; 3]);
        let [one, two] = [("one", [0.0; 3]), ("two", [0.08, 2.0 * RADIUS * offset, 0.0])]
            .map(|(name, at)| m.body3(name, properties, Pose3::at(at)));
        m.set_velocity3(one, [SPEED, 0.0, 0.0], [0.0; 3]);
        m.sphere_sphere3("hit", one.origin(), two.origin(), [RADIUS; 2], [1e12, damping, friction, 1e-3]);
        for (name, body) in [("first", one), ("second", two)] {
            let sensor = m.sensor3(name, body.origin());
            watch(&mut m, sensor, &["x", "y", "vx", "vy", "omega_z"])?;
        }
        let history = simulate_explicitly(&m, &accurate(), &times)?;
        let last = |k: usize| *history.values[k].last().unwrap();
        let momentum = [last(2) + last(7), last(3) + last(8)];
        let angular = |k: usize| MASS * (last(k) * last(k + 3) - last(k + 1) * last(k + 2)) + inertia * last(k + 4);
        assert!((momentum[0] - SPEED).abs() < 1e-9 && momentum[1].abs() < 1e-9, "{momentum:?}");
        assert!((angular(0) + angular(5)).abs() < 1e-9 * MASS, "{}", angular(0) + angular(5));
        if friction == 0.0 {
            // Of the velocity, the part along the line of centres (cos² = 1 − offset²) passes to the second ball.
            let part = SPEED * (1.0 - offset * offset);
            assert!((last(7) - part).abs() < 1e-3 * SPEED, "{} {part}", last(7));
            assert!((last(2) - (SPEED - part)).abs() < 1e-3 * SPEED && last(9).abs() < 1e-9, "{}", last(2));
        } else {
            // Equal balls turn in the same sense.
            assert!(last(4) * last(9) > 0.0 && (last(4) - last(9)).abs() < 1e-6, "{} {}", last(4), last(9));
        }
    }
    Ok(())
}
