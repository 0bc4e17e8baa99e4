//! Initial velocities of which some are given: the others follow from the joints, or have the least kinetic energy.

use autodiff::Scalar;
use linkwright_mechanics::derivatives::adjoint::{AdjointFunctional, differentiate_backwards};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::semi_analytical::{STEP, differentiate_semi_analytically};
use linkwright_mechanics::elements::spatial::MassProperties3;
use linkwright_mechanics::mechanism::{ParametricMechanism, Pose, Pose3, Rotation};
use linkwright_mechanics::{Dynamics, Explicit, Mechanism, Result, simulate, simulate_explicitly};

/// Outputs at the start.
fn at_start(m: &Mechanism<f64>) -> Vec<f64> {
    let implicit = simulate(m, &Dynamics::fixed(1e-3), &[0.0]).unwrap();
    let explicit = simulate_explicitly(m, &Explicit::eighth_order(1e-9), &[0.0]).unwrap();
    let [a, b] = [implicit, explicit].map(|run| run.values.iter().map(|series| series[0]).collect::<Vec<_>>());
    assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-9 * (1.0 + b.abs())), "{a:?} {b:?}");
    a
}

fn watch<S: Scalar>(m: &mut Mechanism<S>, body: linkwright_mechanics::Body, names: &[&str]) {
    let sensor = m.sensor("sensor", body.origin());
    for name in names {
        let term = m.measure(sensor, name).unwrap();
        m.output(format!("{} {name}", m.output_names().len()), &[term]);
    }
}

/// A slider-crank in a plane whose lengths are multiplied by `scale`; the crank turns at 3 rad/s.
fn slider_crank(scale: f64, give: impl Fn(&mut Mechanism<f64>, [linkwright_mechanics::Body; 3])) -> Mechanism<f64> {
    let mut m = Mechanism::<f64>::new();
    let (crank, rod) = (scale, 2.5 * scale);
    let angle = 0.7f64;
    let turned = (crank / rod * angle.sin()).asin();
    let joint = [crank * angle.cos(), crank * angle.sin()];
    let a = m.body("crank", 1.0, 0.1 * scale * scale, Pose { x: 0.5 * joint[0], y: 0.5 * joint[1], theta: angle });
    let [x, y] = [joint[0] + 0.5 * rod * turned.cos(), 0.5 * joint[1]];
    let b = m.body("rod", 2.0, 0.4 * scale * scale, Pose { x, y, theta: -turned });
    let end = joint[0] + rod * turned.cos();
    let c = m.body("slider", 1.5, scale * scale, Pose { x: end, y: 0.0, theta: 0.0 });
    let ground = m.ground();
    m.revolute("O", ground.origin(), a.at(-0.5 * crank, 0.0));
    m.revolute("A", a.at(0.5 * crank, 0.0), b.at(-0.5 * rod, 0.0));
    m.revolute("B", b.at(0.5 * rod, 0.0), c.origin());
    m.prismatic("guide", ground.origin(), 0.0, c.origin(), 0.0);
    give(&mut m, [a, b, c]);
    watch(&mut m, a, &["omega"]);
    watch(&mut m, b, &["omega"]);
    watch(&mut m, c, &["vx"]);
    m
}

#[test]
fn velocities_that_are_not_given_follow_from_the_joints_in_all_units() {
    let angle = 0.7f64;
    let turned = (angle.sin() / 2.5).asin();
    let rod = -3.0 * angle.cos() / (2.5 * turned.cos());
    let slider = -3.0 * angle.sin() + 2.5 * turned.sin() * rod;
    for scale in [1e-3, 1.0, 1e3] {
        for given in ["crank", "rod", "slider", "all", "crank and slider"] {
            let m = slider_crank(scale, |m, [a, b, c]| {
                if given.contains("crank") || given == "all" {
                    m.set_velocity(a.theta, 3.0);
                }
                if given == "rod" || given == "all" {
                    m.set_velocity(b.theta, rod);
                }
                if given.contains("slider") || given == "all" {
                    m.set_velocity(c.x, slider * scale);
                }
            });
            let found = at_start(&m);
            let expected = [3.0, rod, slider * scale];
            for (found, expected) in found.iter().zip(expected) {
                assert!((found / expected - 1.0).abs() < 1e-9, "{given} given, {scale} m: {found} for {expected}");
            }
            let run = simulate(&m, &Dynamics::fixed(1e-3), &[0.0]).unwrap();
            assert!(run.warnings.iter().all(|w| !w.contains("initial velocities")), "{:?}", run.warnings);
        }
    }
}

/// A rod on a pin of which spin ω and velocity u of its centre are given: M-weighted, (J + m l²) ω⁺ = J ω + m l u.
#[test]
fn contradicting_velocities_are_projected_by_the_masses_in_all_units() {
    for scale in [1e-3, 1.0, 1e3] {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground();
        let (mass, arm, inertia, spin, u) = (1.5, 0.7 * scale, 0.3 * scale * scale, 3.0, 0.4 * scale);
        let rod = m.body("rod", mass, inertia, Pose { x: 0.0, y: -arm, theta: 0.0 });
        m.revolute("O", ground.origin(), rod.at(0.0, arm));
        m.set_velocity(rod.theta, spin);
        m.set_velocity(rod.x, u);
        watch(&mut m, rod, &["omega", "vx"]);
        let omega = (inertia * spin + mass * arm * u) / (inertia + mass * arm * arm);
        for (found, expected) in at_start(&m).into_iter().zip([omega, arm * omega]) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{scale} m: {found} for {expected}");
        }
    }
}

/// A massless bar carries a mass at its end: no mass decides on the velocity of the bar that is given.
#[test]
fn velocities_of_massless_bodies_are_kept() {
    for scale in [1e-3, 1.0, 1e3] {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground();
        let bar = m.massless_node("bar", Pose { x: 0.0, y: -scale, theta: 0.0 });
        let mass = m.point_mass("mass", 2.0, 0.0, -scale);
        m.revolute("O", ground.origin(), bar.at(0.0, scale));
        m.revolute("A", bar.origin(), mass.origin());
        m.set_velocity(bar.theta, 3.0);
        watch(&mut m, mass, &["vx", "vy"]);
        let found = at_start(&m);
        assert!((found[0] - 3.0 * scale).abs() < 1e-9 * scale && found[1].abs() < 1e-9 * scale, "{scale} m: {found:?}");
    }
}

#[test]
fn contradicting_velocities_are_named() {
    let m = slider_crank(1.0, |m, [a, b, _]| {
        m.set_velocity(a.theta, 3.0);
        m.set_velocity(b.theta, 3.0);
    });
    let explicit = simulate_explicitly(&m, &Explicit::eighth_order(1e-9), &[0.0]).unwrap();
    for run in [simulate(&m, &Dynamics::fixed(1e-3), &[0.0]).unwrap(), explicit] {
        let named = run.warnings.iter().any(|w| w.contains("is given 3.000000 and becomes"));
        assert!(named, "{:?}", run.warnings);
    }
}

/// The second pendulum is free: with u the velocity of the joint, least kinetic energy is that of a rod of which one point is moved.
#[test]
fn what_remains_free_has_the_least_kinetic_energy() {
    for scale in [1e-2, 1.0, 1e2] {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground();
        let (mass, inertia) = (1.5, 0.2 * scale * scale);
        let one = m.body("one", 1.0, 0.1, Pose { x: 0.0, y: -0.5 * scale, theta: 0.0 });
        let two = m.body("two", mass, inertia, Pose { x: 0.0, y: -1.6 * scale, theta: 0.0 });
        m.revolute("O", ground.origin(), one.at(0.0, 0.5 * scale));
        m.revolute("A", one.at(0.0, -0.5 * scale), two.at(0.0, 0.6 * scale));
        m.set_velocity(one.theta, 2.0);
        watch(&mut m, one, &["omega"]);
        watch(&mut m, two, &["vx", "vy", "omega"]);
        let found = at_start(&m);
        // The impulse P at the joint: m v = P, J ω = −0.6 P with an arm of 0.6 m, and v − 0.6 ω = 2.
        let arm = 0.6 * scale;
        let impulse = 2.0 * scale / (1.0 / mass + arm * arm / inertia);
        let expected = [2.0, impulse / mass, 0.0, -arm * impulse / inertia];
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{found} for {expected}");
        }
    }
}

/// A hinge one metre off the reference point, in the plane and in space.
#[test]
fn the_angular_velocity_of_a_hinged_body_is_kept() {
    let mut plane = Mechanism::<f64>::new();
    let ground = plane.ground();
    let body = plane.body("body", 1.0, 1.0, Pose { x: 1.0, y: 0.0, theta: 0.0 });
    plane.revolute("hinge", ground.origin(), body.at(-1.0, 0.0));
    plane.set_velocity(body.theta, 3.0);
    watch(&mut plane, body, &["omega", "vy"]);
    assert_eq!(at_start(&plane).iter().map(|x| (x * 1e9).round()).collect::<Vec<_>>(), [3e9, 3e9]);
    for turned in [0.0, 1.3] {
        let mut m = Mechanism::<f64>::new();
        let ground = m.ground3();
        let orientation = Rotation::about_z(turned);
        let point = orientation.rotate([-1.0, 0.0, 0.0]);
        let pose = Pose3::new(point.map(|x| -x), orientation);
        let body = m.body3("body", MassProperties3::principal(1.0, [1.0, 2.0, 2.5]), pose);
        m.revolute3("hinge", ground.origin(), body.at([-1.0, 0.0, 0.0]));
        m.set_angular_velocity3(body, [0.0, 0.0, 3.0]);
        let sensor = m.sensor3("sensor", body.origin());
        for name in ["omega_z", "vx", "vy"] {
            let term = m.measure(sensor, name).unwrap();
            m.output(name, &[term]);
        }
        let expected = [3.0, -3.0 * turned.sin(), 3.0 * turned.cos()];
        for (found, expected) in at_start(&m).into_iter().zip(expected) {
            assert!((found - expected).abs() < 1e-9, "{found} for {expected}");
        }
    }
}

/// A double pendulum with one given angular velocity; the lengths, the masses and the velocity are design variables.
struct Pendulum {
    /// Gives a velocity of its centre of mass, too, which its joint does not allow.
    is_contradicting: bool,
}

impl ParametricMechanism for Pendulum {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let mut m = Mechanism::with_gravity(S::from(0.0), S::from(-9.81));
        let (zero, ground) = (S::from(0.0), m.ground());
        let (sin, cos) = (b[4]).sin_cos();
        let one = m.body("one", b[0], S::from(0.1), Pose { x: sin * b[1] * 0.5, y: -cos * b[1] * 0.5, theta: b[4] });
        let (x, y) = (sin * b[1], -cos * b[1] - b[2] * 0.6);
        let two = m.body("two", b[3], b[2] * b[2] * b[3] * 0.1, Pose { x, y, theta: zero });
        m.revolute("O", ground.origin(), one.at(zero, b[1] * 0.5));
        m.revolute("A", one.at(zero, b[1] * -0.5), two.at(zero, b[2] * 0.6));
        m.set_velocity(one.theta, b[5]);
        if self.is_contradicting {
            m.set_velocity(one.x, b[0] * b[5] * -0.3);
            m.set_velocity(two.y, b[1] * 0.2);
        }
        watch(&mut m, one, &["theta", "omega"]);
        watch(&mut m, two, &["x", "vx", "omega"]);
        Ok(m)
    }
}

#[test]
fn derivatives_of_velocities_with_the_least_kinetic_energy() {
    check_derivatives(&Pendulum { is_contradicting: false });
}

#[test]
fn derivatives_of_the_nearest_velocities() {
    check_derivatives(&Pendulum { is_contradicting: true });
}

/// Compares all methods with differences.
fn check_derivatives(model: &Pendulum) {
    let b = [1.0, 0.8, 0.9, 1.5, 0.4, 2.0];
    let times = [0.0, 0.1, 0.2];
    let settings = Dynamics::fixed(5e-3);
    let direct = differentiate(model, &b, &settings, &times).unwrap();
    let explicit = differentiate_explicitly(model, &b, &Explicit::eighth_order(1e-10), &times).unwrap();
    let semi = differentiate_semi_analytically(model, &b, &settings, &times, STEP).unwrap();
    let all: Vec<AdjointFunctional> =
        (0..5).flat_map(|output| (0..times.len()).map(move |point| AdjointFunctional::at(output, point))).collect();
    let rows = differentiate_backwards(model, &b, &settings, &times, &all).unwrap();
    let values = |b: &[f64]| simulate(&model.build(b).unwrap(), &settings, &times).unwrap().values;
    for k in 0..b.len() {
        let moved = |h: f64| {
            let mut b = b;
            b[k] += h;
            values(&b)
        };
        let (above, below) = (moved(1e-5), moved(-1e-5));
        for output in 0..5 {
            for point in 0..times.len() {
                let difference = (above[output][point] - below[output][point]) / 2e-5;
                let exact = direct.gradients[output][point][k];
                let close = |x: f64, tolerance: f64, name: &str| {
                    let error = (x - exact).abs() / (1.0 + exact.abs());
                    assert!(error < tolerance, "{name}: {x} for {exact}, output {output}, time {point}, variable {k}");
                };
                close(difference, 1e-7, "difference");
                close(rows[(output * times.len() + point, k)], 1e-10, "adjoint");
                close(semi.gradients[output][point][k], 1e-6, "semi-analytical");
                close(explicit.gradients[output][point][k], 1e-3, "explicit steps");
            }
        }
    }
}
