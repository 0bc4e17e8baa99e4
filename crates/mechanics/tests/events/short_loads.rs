//! Loads and prescribed motions that act for a short time on what is at rest: adaptive steps do not miss them.

use crate::models::{Above, outputs};
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{simulate, simulate_explicitly};
use linkwright_mechanics::events::Action;
use linkwright_mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright_mechanics::motion::{Fixed, Harmonic, Motion, Ramp};
use linkwright_mechanics::{Body, Coordinate, Dynamics, Mechanism, Pose};

/// A pulse p₁ exp(−((t − p₂)/p₃)²) added to the constant p₀.
struct Pulse;

impl Motion for Pulse {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        let x = (t - p[2]) / p[3];
        p[0] + p[1] * (-x * x).exp()
    }
}

/// A mass of 1 kg at rest on a line, whose position is the output.
fn mass() -> (Mechanism<f64>, Coordinate) {
    let mut m = Mechanism::new();
    let mass = m.point_mass("mass", 1.0, 0.0, 0.0);
    let sensor = m.sensor("motion", mass.origin());
    let x = m.measure(sensor, "x").unwrap();
    m.output("x", &[x]);
    (m, mass.x)
}

fn push(m: &mut Mechanism<f64>, on: Coordinate, p: [f64; 4]) {
    let ground = m.ground();
    m.load("push", ground.x, on, Pulse, &p);
}

/// A free mass and a pulse: a quarter of the motion after it.
fn pushed() -> Mechanism<f64> {
    let (mut m, x) = mass();
    push(&mut m, x, [0.0, 5.0, 5.3, 0.1]);
    m
}

/// A mass that dry friction holds until a pulse.
fn held_by_friction() -> Mechanism<f64> {
    let (mut m, x) = mass();
    push(&mut m, x, [0.0, 5.0, 5.3, 0.3]);
    let ground = m.ground();
    m.dry_friction("friction", ground.x, x, [3.0, 1.0, 0.0]);
    m
}

/// A mass under a harmonic force of the given amplitude and angular frequency that breaks away and stops in every half of the period.
fn shaken(force: f64, frequency: f64, frictions: &[f64]) -> Mechanism<f64> {
    let (mut m, x) = mass();
    let ground = m.ground();
    m.load("push", ground.x, x, Harmonic, &[0.0, force, frequency, 0.0]);
    for (k, &friction) in frictions.iter().enumerate() {
        m.dry_friction(&format!("friction {k}"), ground.x, x, [friction, 1.0, 0.0]);
    }
    m
}

/// A mass that is pressed against a rigid stop until a pulse.
fn lifted() -> Mechanism<f64> {
    let (mut m, x) = mass();
    push(&mut m, x, [-3.0, 5.0, 5.3, 0.2]);
    let ground = m.ground();
    m.rigid_stop("stop", ground.x, x, 0.0, 0.0);
    m
}

/// A driven coordinate, next to the mass.
fn hammer(m: &mut Mechanism<f64>, motion: impl Motion, p: &[f64]) -> Coordinate {
    let hammer = m.coordinate("hammer", -0.1, 0.0);
    m.drive(hammer, motion, p);
    hammer
}

/// A mass that a rigid or soft hammer hits, with a pulse or a harmonic motion.
fn hit(is_rigid: bool, is_pulse: bool) -> Mechanism<f64> {
    let (mut m, x) = mass();
    let hammer = match is_pulse {
        true => hammer(&mut m, Pulse, &[-0.1, 0.2, 5.3, 0.1]),
        false => hammer(&mut m, Harmonic, &[-0.1, 0.141, 13.0, 0.0]),
    };
    match is_rigid {
        true => drop(m.rigid_stop("stop", hammer, x, 0.0, 0.5)),
        false => drop(m.bump_stop("stop", hammer, x, [1e4, 0.1, 0.0])),
    }
    m
}

/// A mass on which a force acts from an event of a driven coordinate on.
fn switched_on() -> Mechanism<f64> {
    let (mut m, x) = mass();
    let ground = m.ground();
    let load = m.load("push", ground.x, x, Fixed, &[1.0]);
    let slider = m.point_mass("slider", 1.0, -0.1, 1.0);
    m.drive(slider.x, Harmonic, &[-0.1, 0.15, 3.0, 0.0]);
    m.fix(slider.y);
    let sensor = m.sensor("place", slider.origin());
    let place = m.measure(sensor, "x").unwrap();
    m.when("event", Above(0.04), &[place], &[Action::Activate(load)]).unwrap();
    m
}

/// Compares adaptive steps by all methods with short fixed ones.
fn compare(name: &str, m: &Mechanism<f64>, end: f64, tolerated: f64) {
    let times: Vec<f64> = (0..=400).map(|k| end * f64::from(k) / 400.0).collect();
    let fixed = Explicit::eighth_order(1e-9).with_step_control(StepControl::Fixed(1e-3));
    let expected = simulate_explicitly(m, &fixed, &times).unwrap().values.remove(0);
    assert!(expected.iter().any(|x| x.abs() > 10.0 * tolerated), "{name}: it does not move");
    let found = [
        simulate_explicitly(m, &Explicit::adaptive(1e-9), &times),
        simulate_explicitly(m, &Explicit::eighth_order(1e-9), &times),
        simulate(m, &Dynamics::adaptive(1e-8), &times),
    ];
    for (method, history) in ["rk5", "rk8", "implicit"].iter().zip(found) {
        let x = history.unwrap_or_else(|error| panic!("{name}, {method}: {error}")).values.remove(0);
        let error = x.iter().zip(&expected).map(|(x, expected)| (x - expected).abs()).fold(0.0, f64::max);
        println!("{name}, {method}: {error:.1e}");
        assert!(error <= tolerated, "{name}, {method}: {error:.1e}");
    }
}

#[test]
fn a_load_that_acts_for_a_short_time_moves_a_mass_at_rest() {
    compare("pushed", &pushed(), 10.0, 1e-3);
    // The speed is the impulse, and the centre of the pulse is at 5.3 s.
    let history = simulate_explicitly(&pushed(), &Explicit::eighth_order(1e-9), &[0.0, 10.0]).unwrap();
    let x = history.values[0][1];
    let exact = 0.5 * std::f64::consts::PI.sqrt() * 4.7;
    assert!((x - exact).abs() < 1e-6, "{x} {exact}");
}

#[test]
fn friction_breaks_away_within_a_long_step() {
    compare("held by friction", &held_by_friction(), 10.0, 1e-3);
    compare("shaken slowly", &shaken(5.0, 3.0, &[3.0]), 4.0, 1e-3);
    compare("shaken", &shaken(3.5, 10.0, &[3.0]), 4.0, 1e-5);
    compare("two frictions", &shaken(5.0, 3.0, &[1.0, 2.0]), 4.0, 1e-3);
    compare("two frictions, shaken fast", &shaken(7.0, 8.0, &[1.0, 2.0]), 4.0, 1e-3);
}

#[test]
fn a_stop_opens_within_a_long_step() {
    compare("lifted", &lifted(), 10.0, 1e-3);
}

#[test]
fn prescribed_motions_touch_and_switch_within_a_long_step() {
    compare("rigid hammer, once", &hit(true, true), 10.0, 1e-2);
    compare("rigid hammer", &hit(true, false), 10.0, 1e-1);
    compare("soft hammer, once", &hit(false, true), 10.0, 1e-2);
    compare("switched on", &switched_on(), 10.0, 1e-3);
}

/// A body at `x` on a guide, and another one with it: on a pin, or on a spring.
fn cart_with_rod(x: f64, has_pin: bool) -> (Mechanism<f64>, Body, Body) {
    let mut m = Mechanism::with_gravity(0.0, -9.81);
    let cart = m.body("cart", 1.0, 1.0, Pose { x, y: 0.0, theta: 0.0 });
    let rod = m.body("rod", 1.0, 1.0 / 12.0, Pose { x, y: -0.5, theta: 0.0 });
    let ground = m.ground();
    m.prismatic("guide", ground.origin(), 0.0, cart.origin(), 0.0);
    match has_pin {
        true => drop(m.revolute("pin", cart.origin(), rod.at(0.0, 0.5))),
        false => {
            m.prismatic("slide", ground.at(0.0, -0.5), 0.0, rod.origin(), 0.0);
            m.coordinate_spring("spring", cart.x, rod.x, [30.0, 0.0, 0.5, 0.0]);
        }
    }
    (m, cart, rod)
}

/// [`cart_with_rod`], driven by a linear ramp.
fn driven_cart(has_pin: bool) -> Mechanism<f64> {
    let (mut m, cart, rod) = cart_with_rod(0.0, has_pin);
    m.drive(cart.x, Ramp::Linear, &[0.0, 0.5, 0.505, 1.0]);
    let sensor = m.sensor("motion", rod.origin());
    let x = m.measure(sensor, "x").unwrap();
    m.output("x", &[x]);
    m
}

#[test]
fn explicit_steps_refuse_jumps_of_prescribed_velocities_that_take_impulses() {
    let times = [0.0, 1.0, 2.0];
    let fixed = Explicit::eighth_order(1e-9).with_step_control(StepControl::Fixed(1e-2));
    for settings in [Explicit::adaptive(1e-9), Explicit::eighth_order(1e-9), fixed] {
        let error = simulate_explicitly(&driven_cart(true), &settings, &times).unwrap_err().to_string();
        assert!(
            error.contains("cart.x") && error.contains("jumps by 5.000e-1") && error.contains("0.505 s"),
            "{error}"
        );
    }
    assert!(simulate(&driven_cart(true), &Dynamics::fixed(1e-3), &times).is_ok());
    // A spring has no impulse.
    compare("spring", &driven_cart(false), 2.0, 1e-4);
}

#[test]
fn adaptive_implicit_steps_refuse_jumps_of_prescribed_velocities_that_take_impulses() {
    let times = [0.0, 1.0, 2.0];
    for tolerance in [1e-6, 1e-8] {
        let settings = Dynamics::adaptive(tolerance);
        let error = simulate(&driven_cart(true), &settings, &times).unwrap_err().to_string();
        assert!(
            error.contains("cart.x") && error.contains("jumps by 5.000e-1") && error.contains("0.505 s"),
            "{error}"
        );
        assert!(error.contains("fixed steps"), "{error}");
        // A spring has no impulse.
        assert!(simulate(&driven_cart(false), &settings, &times).is_ok());
    }
}

/// A drive between two bodies has the same impulses as a prescribed coordinate; bodies that only follow it have none.
#[test]
fn jumps_of_the_velocity_of_a_drive_are_refused_where_they_take_impulses() {
    let cart = |has_pin: bool, length: bool| {
        let (mut m, cart, rod) = cart_with_rod(0.5, has_pin);
        let ground = m.ground();
        let motion = [0.5, 1.0, 0.505, 1.0];
        match length {
            true => m.drive_length("drive", ground.origin(), cart.origin(), Ramp::Linear, &motion),
            false => m.driver("drive", ground.x, cart.x, Ramp::Linear, &motion),
        };
        outputs(&mut m, rod.x).unwrap();
        m
    };
    let times = [0.0, 1.0, 2.0];
    for length in [false, true] {
        let (pinned, sprung) = (cart(true, length), cart(false, length));
        let fixed = simulate(&sprung, &Dynamics::fixed(1e-3), &times).unwrap().values[0][2];
        for tolerance in [1e-6, 1e-8] {
            let error = simulate(&pinned, &Dynamics::adaptive(tolerance), &times).unwrap_err().to_string();
            let words = ["drive", "jumps by 5.000e-1", "0.505 s", "fixed steps"];
            assert!(words.iter().all(|word| error.contains(word)), "{error}");
            let found = simulate(&sprung, &Dynamics::adaptive(tolerance), &times).unwrap().values[0][2];
            assert!((found - fixed).abs() < 1e-3, "{found} {fixed}");
        }
        let steps = Explicit::eighth_order(1e-9).with_step_control(StepControl::Fixed(1e-2));
        for settings in [Explicit::adaptive(1e-9), Explicit::eighth_order(1e-9), steps] {
            let error = simulate_explicitly(&pinned, &settings, &times).unwrap_err().to_string();
            assert!(error.contains("drive: its prescribed velocity jumps") && error.contains("0.505 s"), "{error}");
        }
        let found = simulate_explicitly(&sprung, &Explicit::eighth_order(1e-9), &times).unwrap().values[0][2];
        assert!((found - fixed).abs() < 1e-3, "{found} {fixed}");
        assert!(simulate(&pinned, &Dynamics::fixed(1e-3), &times).is_ok());
    }
}

/// A rod hangs on a cart that a ramp moves by 0.1 m within 0.3 ms, between two outputs.
#[test]
fn short_ramps_of_drives_are_not_passed_over() {
    let mut m = Mechanism::<f64>::with_gravity(0.0, -9.81);
    let cart = m.body("cart", 1.0, 1.0, Pose { x: 0.0, y: 0.0, theta: 0.0 });
    let rod = m.body("rod", 1.0, 1.0 / 12.0, Pose { x: 0.0, y: -0.5, theta: -std::f64::consts::FRAC_PI_2 });
    m.drive(cart.y, Fixed, &[0.0]);
    m.drive(cart.theta, Fixed, &[0.0]);
    m.revolute("pin", cart.origin(), rod.at(-0.5, 0.0));
    m.drive(cart.x, Ramp::Smooth, &[0.0, 0.1, 0.505, 3e-4]);
    outputs(&mut m, rod.theta).unwrap();
    let times: Vec<f64> = (0..=20).map(|k| 0.1 * f64::from(k)).collect();
    let steps: Vec<f64> = [vec![0.005; 101], vec![1e-5; 30], vec![1e-3; 1495]].concat();
    let fixed = Explicit::eighth_order(1.0).with_step_control(StepControl::Given(steps));
    let expected = simulate_explicitly(&m, &fixed, &times).unwrap().values[0][20];
    for settings in [Explicit::eighth_order(1e-8), Explicit::adaptive(1e-8)] {
        let found = simulate_explicitly(&m, &settings, &times).unwrap().values[0][20];
        assert!((found - expected).abs() < 1e-4 * expected.abs(), "{found} for {expected}");
    }
}
