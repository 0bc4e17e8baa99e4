//! Contacts and friction that change their modes several times within a short time, in motions that are unique.

use crate::derivative_methods::{all_settings, check_adjoint_by, check_semi_analytical_by};
use crate::models::outputs;
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::elements::{BeamSection, Element, ElementState, Shear};
use linkwright_mechanics::integrators::explicit::Explicit;
use linkwright_mechanics::mechanism::Pose3;
use linkwright_mechanics::motion::Motion;
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Pose, Result};

/// p₀ t² + p₁ sin(p₂ t).
struct Accelerating;

impl Motion for Accelerating {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] * t * t + p[1] * (p[2] * t).sin()
    }
}

fn position(m: &mut Mechanism<f64>, name: &str, coordinate: linkwright_mechanics::Coordinate) {
    let sensor = m.coordinate_sensor(&format!("{name} sensor"), m.ground().x, coordinate);
    let term = m.measure(sensor, "position").unwrap();
    m.output(name, &[term]);
}

/// Two masses on springs and on a belt that accelerates, with friction.
fn masses_on_a_belt() -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::new();
    let belt = m.coordinate("belt", 0.0, 0.0);
    m.inertia("belt", belt, 1.0);
    m.drive(belt, Accelerating, &[0.05, 0.02, 5.0]);
    let [a, b] = [("a", 0.02, 1.0), ("b", 0.0, 1.7)].map(|(name, position, mass)| {
        let coordinate = m.coordinate(name, position, 0.0);
        m.inertia(name, coordinate, mass);
        coordinate
    });
    let ground = m.ground();
    m.coordinate_spring("between", a, b, [20.0, 0.1, 0.0, 0.0]);
    m.coordinate_spring("spring", ground.x, a, [40.0, 0.0, 0.0, 0.0]);
    m.dry_friction("first", belt, a, [2.0, 1.4, 0.1]);
    m.dry_friction("second", belt, b, [1.6, 1.2, 0.1]);
    position(&mut m, "a", a);
    position(&mut m, "b", b);
    m
}

#[test]
fn masses_on_an_accelerating_belt_move_alike_in_all_schemes() {
    let (m, times) = (masses_on_a_belt(), [1.0, 1.5, 2.0, 4.0, 6.0]);
    let exact = simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &times).unwrap();
    let hht = |h: f64| Dynamics { scheme: GeneralizedAlpha::hht(0.1).unwrap(), ..Dynamics::fixed(h) };
    for settings in [Dynamics::fixed(2e-3), Dynamics::fixed(1e-3), Dynamics::fixed(3e-4), hht(1e-3)] {
        let run = simulate(&m, &settings, &times).unwrap();
        for (ours, exact) in run.values.iter().flatten().zip(exact.values.iter().flatten()) {
            assert!((ours - exact).abs() < 1e-4, "{ours} for {exact}");
        }
    }
}

/// A four-bar with dry friction in each of its pins, driven by a torque from rest.
fn four_bar(friction: f64) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let [l1, l2, l3, l0] = [0.3, 0.9, 0.7, 0.9];
    let pose = |x, y, theta| Pose { x, y, theta };
    let crank = m.body("crank", 1.0, l1 * l1 / 12.0, pose(0.05435366317150104, 0.13980586289508393, 1.2));
    let coupler =
        m.body("coupler", 2.0, l2 * l2 / 6.0, pose(0.5066036255368701, 0.4897986309194452, 0.48598779731764186));
    let rocker =
        m.body("rocker", 1.5, 1.5 * l3 * l3 / 12.0, pose(0.9022499623653691, 0.34999276802436136, 1.5643678186168148));
    let ground = m.ground();
    m.revolute("O", ground.origin(), crank.at(-l1 / 2.0, 0.0));
    m.revolute("A", crank.at(l1 / 2.0, 0.0), coupler.at(-l2 / 2.0, 0.0));
    m.revolute("B", coupler.at(l2 / 2.0, 0.0), rocker.at(l3 / 2.0, 0.0));
    m.revolute("D", ground.at(l0, 0.0), rocker.at(-l3 / 2.0, 0.0));
    m.dry_friction("fO", ground.theta, crank.theta, [friction, 1.0, 0.0]);
    m.dry_friction("fA", crank.theta, coupler.theta, [0.7 * friction, 1.0, 0.0]);
    m.dry_friction("fB", coupler.theta, rocker.theta, [0.5 * friction, 1.0, 0.0]);
    m.dry_friction("fD", ground.theta, rocker.theta, [0.3 * friction, 1.0, 0.0]);
    let clock = m.coordinate("torque", 0.0, 0.0);
    m.drive(clock, Torque, &[12.0, 3.0]);
    m.add("load", LoadOf, &[crank.theta, clock], &[]);
    position(&mut m, "theta", crank.theta);
    m
}

/// p₀ sin(p₁ t), the torque.
struct Torque;

impl Motion for Torque {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        p[0] * (p[1] * t).sin()
    }
}

/// A force on the first coordinate that is the second coordinate.
struct LoadOf;

impl Element for LoadOf {
    fn residual<T: Scalar>(&self, x: &ElementState<'_, T>, dynamics: &mut [T], _constraint: &mut [T]) {
        dynamics[0] -= x.q[1];
    }
}

#[test]
fn a_four_bar_with_friction_in_all_pins_breaks_away() {
    let times: Vec<f64> = (0..=50).map(|k| 0.02 * f64::from(k)).collect();
    let exact = simulate(&four_bar(1.0), &Dynamics::fixed(2e-4), &times).unwrap();
    for settings in [Explicit::eighth_order(1e-9), Explicit::adaptive(1e-9)] {
        let run = simulate_explicitly(&four_bar(1.0), &settings, &times).unwrap();
        for (ours, exact) in run.values.iter().flatten().zip(exact.values.iter().flatten()) {
            assert!((ours - exact).abs() < 1e-3 * (1.0 + exact.abs()), "{ours} for {exact}");
        }
    }
}

/// Two bars in space on hinges that are not parallel; friction and a stop are in the first one.
fn chain_on_a_stop(length: f64) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::with_gravity3([0.0, 0.0, -9.81]);
    let half = 0.5 * length;
    let upper = m.body3("upper", MassProperties3::principal(1.0, [0.02, 0.02, 0.002]), Pose3::at([half, 0.0, 0.0]));
    let lower = m.body3("lower", MassProperties3::principal(1.5, [0.03, 0.03, 0.003]), Pose3::at([length, 0.0, -half]));
    let ground = m.ground3();
    let [across, along] = [[0.0, 1.0, 0.0], [1.0, 0.3, 0.0]];
    let first = [ground.origin().with_z(across), upper.at([-half, 0.0, 0.0]).with_z(across)];
    let second = [upper.at([half, 0.0, 0.0]).with_z(along), lower.at([0.0, 0.0, half]).with_z(along)];
    let angles = [("first", first), ("second", second)].map(|(name, [a, b])| {
        m.revolute3(name, a, b);
        m.joint_angle(&format!("{name} angle"), a, b)
    });
    m.dry_friction("friction", m.ground().x, angles[0], [0.3, 1.2, 0.0]);
    m.rigid_stop("stop", angles[0], m.ground().x, -1.2, 0.3);
    position(&mut m, "first", angles[0]);
    position(&mut m, "second", angles[1]);
    m
}

#[test]
fn a_chain_in_space_bounces_on_a_stop_by_all_steps() {
    for length in [0.49, 0.499, 0.501, 0.51, 0.52] {
        let m = chain_on_a_stop(length);
        let exact = simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &[1.0, 3.0]).unwrap();
        for h in [5e-3, 2e-3, 2e-4] {
            let run = simulate(&m, &Dynamics::fixed(h), &[1.0, 3.0]).unwrap();
            for (ours, exact) in run.values.iter().flatten().zip(exact.values.iter().flatten()) {
                assert!((ours - exact).abs() < 5e-3, "{length} m, {h} s: {ours} for {exact}");
            }
        }
    }
}

/// A round beam of the diameter `d` (m), 2e9 N/m² and 1000 kg/m³.
fn section(d: f64) -> BeamSection<f64> {
    let (area, second) = (std::f64::consts::PI * d * d / 4.0, std::f64::consts::PI * d.powi(4) / 64.0);
    let shear = 2e9 / 2.6 * area * 0.9;
    BeamSection { axial: 2e9 * area, shear, bending: 2e9 * second, mass: 1000.0 * area, inertia: 1000.0 * second }
}

/// A pinned beam of 1 m with a mass at its tip, 0.1 m above a wall.
fn beam_above_a_wall() -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let (d, height) = (0.02f64, 0.1);
    let section = section(d);
    let ground = m.ground();
    let tip = m.body("tip", 0.2, 1e-4, Pose { x: 1.0, y: height, theta: 0.0 });
    let (nodes, _) = m.beam("beam", [[0.0, height], [1.0, height]], [None, None], 3, &section, Shear::Flexible);
    m.fixed_joint("F", tip.origin(), nodes[3].origin(), 0.0);
    m.revolute("P", ground.at(0.0, height), nodes[0].origin());
    m.rigid_wall("wall", ground.origin(), 0.0, tip.origin(), 0.0);
    position(&mut m, "tip", tip.y);
    m
}

#[test]
fn a_beam_falls_on_a_wall_by_all_steps() {
    let m = beam_above_a_wall();
    let times = [0.2, 0.3, 0.4, 0.5, 0.6];
    for settings in [Dynamics::fixed(2e-3), Dynamics::fixed(1e-3), Dynamics::fixed(2e-4), Dynamics::fixed(1e-4)] {
        let run = simulate(&m, &settings, &times).unwrap();
        assert!(run.values[0].iter().all(|y| *y > -1e-6 && *y < 0.03), "{:?}", run.values);
    }
}

/// Two masses fall from the same height on the ground; a horizontal spring is between them.
fn two_masses(restitution: f64) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let ground = m.ground();
    let [a, b] = [("a", 1.0, 0.0, 1.0), ("b", 2.0, 3.0, -0.4)].map(|(name, mass, x, speed)| {
        let point = m.point_mass(name, mass, x, 0.5);
        m.set_velocity(point.x, speed);
        point
    });
    m.rigid_wall("wall a", ground.origin(), 0.0, a.origin(), restitution);
    m.rigid_wall("wall b", ground.origin(), 0.0, b.origin(), 0.5);
    m.coordinate_spring("spring", a.x, b.x, [3.0, 0.0, 2.0, 0.0]);
    position(&mut m, "a", a.y);
    position(&mut m, "b", b.y);
    m
}

/// Bodies that are not joined fall and bounce as each would alone.
#[test]
fn impacts_at_the_same_time_that_have_no_effect_on_each_other_are_independent() {
    let (g, e): (f64, f64) = (9.81, 0.6);
    let fall = (2.0f64 * 0.5 / g).sqrt();
    let bounce = |e: f64, t: f64| e * g * fall * (t - fall) - 0.5 * g * (t - fall).powi(2);
    let m = two_masses(e);
    let times = [0.4, 0.5, 0.6];
    let implicit = |h: f64| simulate(&m, &Dynamics::fixed(h), &times).unwrap();
    let runs = [
        (simulate_explicitly(&m, &Explicit::eighth_order(1e-10), &times).unwrap(), 1e-6),
        (simulate_explicitly(&m, &Explicit::adaptive(1e-9), &times).unwrap(), 1e-6),
        (implicit(1e-3), 1e-4),
        (implicit(5e-3), 1e-3),
    ];
    for (run, tolerance) in runs {
        for (k, &t) in times.iter().enumerate() {
            for (body, e) in [e, 0.5].into_iter().enumerate() {
                let (ours, exact) = (run.values[body][k], bounce(e, t));
                assert!((ours - exact).abs() < tolerance, "{ours} for {exact} at {t} s");
            }
        }
    }
}

/// Two masses fall on the ground from the height b₀, with the restitutions b₁ and b₂.
struct Falling;

impl ParametricMechanism for Falling {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut m = Mechanism::with_gravity(S::from(0.0), S::from(-9.81));
        let (zero, ground) = (S::from(0.0), m.ground());
        for (name, mass, restitution) in [("a", 1.0, b[1]), ("b", 2.0, b[2])] {
            let point = m.point_mass(name, S::from(mass), zero, b[0]);
            m.rigid_wall(&format!("wall {name}"), ground.origin(), zero, point.origin(), restitution);
            outputs(&mut m, point.y)?;
        }
        Ok(m)
    }
}

#[test]
fn derivatives_through_impacts_at_the_same_time_are_those_of_each_body() {
    let b = [0.5f64, 0.6, 0.5];
    let times = [0.2, 0.5];
    let direct = differentiate(&Falling, &b, &Dynamics::fixed(2e-3), &times).unwrap();
    let explicit = differentiate_explicitly(&Falling, &b, &Explicit::eighth_order(1e-11), &times).unwrap();
    let g = 9.81;
    let fall = (2.0 * b[0] / g).sqrt();
    let later = times[1] - fall;
    for (body, e) in [b[1], b[2]].into_iter().enumerate() {
        // y = e u (t − u/g) − g (t − u/g)²/2 with the speed u = √(2 g h).
        let speed = g * fall;
        let by_speed = e * later - e * speed / g + later;
        let mut exact = [by_speed * g / speed, 0.0, 0.0];
        exact[1 + body] = speed * later;
        for (history, tolerance) in [(&direct, 1e-4), (&explicit, 1e-6)] {
            let output = 2 * body;
            for (ours, exact) in history.gradients[output][1].iter().zip(exact) {
                assert!((ours - exact).abs() < tolerance, "{body}: {ours} for {exact}");
            }
        }
    }
    check_adjoint_by(&all_settings()[..1], ("falling", 1e-6), &Falling, &b, &times);
    check_semi_analytical_by(&all_settings()[..1], ("falling", 1e-4), &Falling, &b, &times);
}

#[test]
fn impacts_at_the_same_time_of_joined_bodies_are_an_error() {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let ground = m.ground();
    let bar = m.body("bar", 1.0, 0.2, Pose { x: 0.0, y: 0.5, theta: 0.0 });
    for (name, x) in [("left", -0.5), ("right", 0.5)] {
        m.rigid_wall(name, ground.origin(), 0.0, bar.at(x, 0.0), 0.5);
    }
    let error = simulate(&m, &Dynamics::fixed(1e-3), &[1.0]).unwrap_err().to_string();
    assert!(error.contains("closes at the same time as"), "{error}");
}

/// A drive of 1 m/s presses a block against a stop.
#[test]
fn a_drive_that_is_locked_between_contacts_is_named() {
    let mut m = Mechanism::<f64>::new();
    let [a, b] = [("a", 0.0), ("b", 0.5)].map(|(name, position)| {
        let coordinate = m.coordinate(name, position, 0.0);
        m.inertia(name, coordinate, 1.0);
        coordinate
    });
    m.drive(a, Accelerating, &[0.5, 0.0, 0.0]);
    let ground = m.ground();
    m.rigid_stop("pusher", a, b, 0.0, 0.5);
    m.rigid_stop("wall", b, ground.x, -1.0, 0.5);
    let explicit = simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &[3.0]).unwrap_err();
    for error in [simulate(&m, &Dynamics::fixed(1e-3), &[3.0]).unwrap_err(), explicit] {
        let error = error.to_string();
        assert!(error.contains("a drive presses it against"), "{error}");
    }
}
