//! Conditions of events that become true at the borders of steps, at rest, by jumps of loads, and several at one time.

use crate::derivative_methods::check_adjoint_by;
use crate::models::{Above, Linear};
use autodiff::Scalar;
use linkwright_mechanics::analyses::dynamics::{History, simulate, simulate_explicitly};
use linkwright_mechanics::derivatives::forward::dynamics::differentiate;
use linkwright_mechanics::derivatives::forward::explicit::differentiate_explicitly;
use linkwright_mechanics::derivatives::history::SensitiveHistory;
use linkwright_mechanics::derivatives::semi_analytical::{STEP, differentiate_semi_analytically};
use linkwright_mechanics::events::Action;
use linkwright_mechanics::integrators::explicit::{Explicit, StepControl};
use linkwright_mechanics::integrators::generalized_alpha::Newton;
use linkwright_mechanics::mechanism::Formula;
use linkwright_mechanics::motion::{ConstantSpeed, Fixed, Motion};
use linkwright_mechanics::{Dynamics, GeneralizedAlpha, Mechanism, ParametricMechanism, Result};

/// The time less a given one.
struct After(f64);

impl Formula for After {
    fn value<T: Scalar>(&self, t: T, _x: &[T]) -> T {
        t - self.0
    }
}

/// The load p₀ from the time p₁ on.
struct Jump;

impl Motion for Jump {
    fn position<T: Scalar>(&self, p: &[T], t: T) -> T {
        if t.re() < p[1].re() { T::from(0.0) } else { p[0] }
    }
}

fn times() -> Vec<f64> {
    (0..=20).map(|k| 0.05 * f64::from(k)).collect()
}

/// The motion by all schemes, with their names.
fn motions(m: &Mechanism<f64>, steps: &[f64]) -> Vec<(String, History)> {
    let times = times();
    let mut all = Vec::new();
    for &h in steps {
        all.push((format!("implicit, {h} s"), simulate(m, &Dynamics::fixed(h), &times)));
        let fixed = Explicit::eighth_order(1e-9).with_step_control(StepControl::Fixed(h));
        all.push((format!("rk8, {h} s"), simulate_explicitly(m, &fixed, &times)));
    }
    for tolerance in [1e-5, 1e-8] {
        all.push((format!("adaptive, {tolerance:e}"), simulate(m, &Dynamics::adaptive(tolerance), &times)));
        all.push((format!("rk8, {tolerance:e}"), simulate_explicitly(m, &Explicit::eighth_order(tolerance), &times)));
        all.push((format!("rk5, {tolerance:e}"), simulate_explicitly(m, &Explicit::adaptive(tolerance), &times)));
    }
    all.into_iter().map(|(name, history)| (name.clone(), history.unwrap_or_else(|e| panic!("{name}: {e}")))).collect()
}

/// A mass of 1 kg on a joint that breaks above `limit`, under a load that grows with the `rate` (N/s).
fn fuse(limit: f64, rate: f64) -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let part = m.point_mass("part", 1.0, 0.0, 0.0);
    let joint = m.revolute("fuse", m.ground().origin(), part.origin());
    let ground = m.ground();
    m.load("pull", ground.x, part.x, ConstantSpeed, &[0.0, rate]);
    let force = m.measure(joint, "force").unwrap();
    m.when("break", Above(limit), &[force], &[Action::Deactivate(joint)]).unwrap();
    let sensor = m.sensor("motion", part.origin());
    let x = m.measure(sensor, "x").unwrap();
    m.output("x", &[x]);
    m
}

#[test]
fn a_joint_breaks_where_its_growing_force_reaches_the_limit() {
    for limit in [50.0, 31.7, 50.0 + 1e-9, 7.3, 12.5, 61.8034] {
        let m = fuse(limit, 100.0);
        let begin = limit / 100.0;
        let left = 1.0 - begin;
        let exact = limit * left * left / 2.0 + 100.0 * left * left * left / 6.0;
        for (name, history) in motions(&m, &[0.01, 0.003, 0.05]) {
            let [event] = &history.impacts[..] else { panic!("{limit}, {name}: {:?}", history.impacts) };
            assert!((event.t - begin).abs() < 1e-9, "{limit}, {name}: {} for {begin}", event.t);
            let x = *history.values[0].last().unwrap();
            assert!((x - exact).abs() < 1e-2 * exact, "{limit}, {name}: {x} for {exact}");
        }
    }
}

/// A free mass of 1 kg under a load that jumps to `load` (N) at the time `begin` (s); the motion ends where `term` exceeds `limit`.
fn pushed(load: f64, begin: f64, term: &str, limit: f64) -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let part = m.point_mass("part", 1.0, 0.0, 0.0);
    let ground = m.ground();
    m.load("push", ground.x, part.x, Jump, &[load, begin]);
    let sensor = m.sensor("motion", part.origin());
    let measured = m.measure(sensor, term).unwrap();
    m.when("event", Above(limit), &[measured], &[Action::Terminate]).unwrap();
    m.output("value", &[measured]);
    m
}

#[test]
fn a_condition_becomes_true_in_the_step_in_which_a_load_jumps() {
    for (begin, limit) in [(0.5, 0.04), (0.5, 0.2), (0.4987, 1e-3), (0.4987, 0.02), (0.5, 1e-6)] {
        let m = pushed(10.0, begin, "vx", limit);
        for (name, history) in motions(&m, &[0.01, 0.003]) {
            let [event] = &history.impacts[..] else { panic!("{begin} {limit}, {name}: {:?}", history.impacts) };
            let exact = begin + limit / 10.0;
            // A step of the implicit schemes and of fixed ones has the error of the load inside it.
            assert!((event.t - exact).abs() < 0.011, "{begin} {limit}, {name}: {} for {exact}", event.t);
        }
    }
}

#[test]
fn a_body_at_rest_moves_above_a_limit_of_zero_when_it_is_pushed() {
    for begin in [0.5, 0.25, 0.4987] {
        let m = pushed(10.0, begin, "vx", 0.0);
        for (name, history) in motions(&m, &[0.01, 0.003]) {
            let [event] = &history.impacts[..] else { panic!("{begin}, {name}: {:?}", history.impacts) };
            assert!((event.t - begin).abs() < 0.011, "{begin}, {name}: {}", event.t);
        }
    }
}

#[test]
fn several_events_of_one_time_change_a_force_in_their_order() {
    // On and off at the same time: nothing moves. Off first, then on: it moves.
    for (order, moves) in [([true, false], false), ([false, true], true)] {
        let mut m = Mechanism::new();
        let part = m.point_mass("part", 1.0, 0.0, 0.0);
        let ground = m.ground();
        let kick = m.load("kick", ground.x, part.x, Fixed, &[30.0]);
        for (k, on) in order.into_iter().enumerate() {
            let action = if on { Action::Activate(kick) } else { Action::Deactivate(kick) };
            m.when(format!("event {k}"), After(0.5), &[], &[action]).unwrap();
        }
        let sensor = m.sensor("motion", part.origin());
        let x = m.measure(sensor, "x").unwrap();
        m.output("x", &[x]);
        for (name, history) in motions(&m, &[0.01, 0.003]) {
            assert_eq!(history.impacts.len(), 2, "{name}");
            let x = *history.values[0].last().unwrap();
            // Off and on again: it acts all the time, as a force whose first change is to end acts from the start.
            let exact = if moves { 15.0 } else { 0.0 };
            assert!((x - exact).abs() < 1e-3, "{order:?} {name}: {x} for {exact}");
        }
    }
}

#[test]
fn an_event_that_another_one_causes_changes_the_same_force() {
    // Switched on at 0.5 s, and off when the mass is accelerated: at once.
    let mut m = Mechanism::new();
    let part = m.point_mass("part", 1.0, 0.0, 0.0);
    let ground = m.ground();
    let kick = m.load("kick", ground.x, part.x, Fixed, &[30.0]);
    let sensor = m.sensor("motion", part.origin());
    let [x, a] = ["x", "ax"].map(|name| m.measure(sensor, name).unwrap());
    m.when("on", After(0.5), &[], &[Action::Activate(kick)]).unwrap();
    m.when("off", Above(10.0), &[a], &[Action::Deactivate(kick)]).unwrap();
    m.output("x", &[x]);
    for (name, history) in motions(&m, &[0.01, 0.003]) {
        assert_eq!(history.impacts.len(), 2, "{name}");
        let x = *history.values[0].last().unwrap();
        assert!(x.abs() < 1e-9, "{name}: {x}");
    }
}

/// Two coupled masses of 1 kg at b₁ and b₁ + 1 move to the left with b₀; the front one hits a stop with restitution 1, and the coupling opens when
/// the rear one moves to the right.
struct OpensAtImpact;

impl ParametricMechanism for OpensAtImpact {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let [front, rear] =
            [0.0, 1.0].map(|behind| m.point_mass(&format!("mass {behind}"), S::from(1.0), b[1] + behind, zero));
        let ground = m.ground();
        for mass in [front, rear] {
            m.fix(mass.y);
            m.set_velocity(mass.x, -b[0]);
        }
        let rod = m.distance_constraint("coupling", front.origin(), rear.origin(), S::from(1.0));
        m.rigid_stop("stop", ground.x, front.x, zero, S::from(1.0));
        let sensor = m.sensor("motion", rear.origin());
        let velocity = m.measure(sensor, "vx")?;
        let position = m.measure(sensor, "x")?;
        m.when("open", Linear(vec![1.0], 0.0), &[velocity], &[Action::Deactivate(rod)])?;
        m.output("x", &[position]);
        m.output("v", &[velocity]);
        Ok(m)
    }
}

#[test]
fn an_event_that_an_impact_causes_comes_after_its_impulse() {
    let b = [1.0, 0.5];
    let m = OpensAtImpact.build(&b).unwrap();
    for (name, history) in motions(&m, &[0.01, 0.003]) {
        let [x, v] = [0, 1].map(|k| *history.values[k].last().unwrap());
        assert!((v - 1.0).abs() < 1e-9 && (x - 1.5).abs() < 1e-9, "{name}: {x} {v}");
    }
    // The rear mass is at b₁ + 1 − b₀ T + b₀ (1 − T) after 1 s, with the time T = b₁/b₀ of the impact: at 1 + b₀ − b₁.
    let exact = |name: &str, found: &SensitiveHistory| {
        let row = found.gradients[0].last().unwrap();
        assert!((row[0] - 1.0).abs() < 1e-8 && (row[1] + 1.0).abs() < 1e-8, "{name}: {row:?}");
    };
    let settings = Dynamics::fixed(0.01);
    exact("direct", &differentiate(&OpensAtImpact, &b, &settings, &times()).unwrap());
    exact("semi-analytical", &differentiate_semi_analytically(&OpensAtImpact, &b, &settings, &times(), STEP).unwrap());
    exact("rk8", &differentiate_explicitly(&OpensAtImpact, &b, &Explicit::eighth_order(1e-9), &times()).unwrap());
    check_adjoint_by(&[settings], ("opens at an impact", 1e-8), &OpensAtImpact, &b, &[0.1, 0.9, 1.0]);
}

/// A mass of 1 kg that friction holds with 4 N, or that a stop holds from the left, under a load that jumps.
fn held(is_friction: bool, before: f64, after: f64, begin: f64) -> Mechanism<f64> {
    let mut m = Mechanism::new();
    let mass = m.point_mass("mass", 1.0, 0.0, 0.0);
    m.fix(mass.y);
    let ground = m.ground();
    m.load("steady", ground.x, mass.x, Fixed, &[before]);
    m.load("jump", ground.x, mass.x, Jump, &[after - before, begin]);
    match is_friction {
        true => drop(m.dry_friction("friction", ground.x, mass.x, [4.0, 1.0, 0.0])),
        false => drop(m.rigid_stop("stop", ground.x, mass.x, 0.0, 0.0)),
    }
    let sensor = m.sensor("motion", mass.origin());
    let x = m.measure(sensor, "x").unwrap();
    m.output("x", &[x]);
    m
}

#[test]
fn a_load_that_jumps_moves_what_friction_or_a_contact_holds() {
    for begin in [0.5, 0.4987, 0.25] {
        for (is_friction, before, after, acceleration) in [(true, 0.0, 10.0, 6.0), (false, -6.0, 6.0, 6.0)] {
            let m = held(is_friction, before, after, begin);
            let exact = 0.5 * acceleration * (1.0 - begin) * (1.0 - begin);
            for (name, history) in motions(&m, &[0.01, 0.001, 0.0037]) {
                let x = *history.values[0].last().unwrap();
                // Steps of up to 0.01 s in which the load jumps begin or miss it by up to about half of their length: 6 m/s² × 0.75 s × 0.005 s.
                assert!((x - exact).abs() < 0.03, "{is_friction} {begin}, {name}: {x} for {exact}");
            }
        }
    }
}

/// A free mass of b₀ under a load that jumps to 10 N inside a step; the motion ends above a velocity that it has at the end of this step.
struct EndsAtJump;

impl ParametricMechanism for EndsAtJump {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let part = m.point_mass("part", b[0], zero, zero);
        let ground = m.ground();
        m.load("push", ground.x, part.x, Jump, &[S::from(10.0), S::from(0.4987)]);
        let sensor = m.sensor("motion", part.origin());
        let velocity = m.measure(sensor, "vx")?;
        m.when("event", Above(0.02), &[velocity], &[Action::Terminate])?;
        m.output("velocity", &[velocity]);
        Ok(m)
    }
}

#[test]
fn an_event_at_the_jump_of_a_load_has_no_derivatives() {
    let settings = Dynamics::fixed(0.01);
    let direct = differentiate(&EndsAtJump, &[1.0], &settings, &times()).unwrap_err().to_string();
    let semi = differentiate_semi_analytically(&EndsAtJump, &[1.0], &settings, &times(), STEP).unwrap_err().to_string();
    assert!(direct.contains("a load jumps at t = 0.4987") && semi.contains("a load jumps"), "{direct}\n{semi}");
}

/// A mass of 1 kg on a spring, let go at 1 m, that a force pushes once its acceleration exceeds b₀.
struct PushedByAcceleration;

impl ParametricMechanism for PushedByAcceleration {
    fn build<S: Scalar>(&self, b: &[S]) -> Result<Mechanism<S>> {
        let zero = S::from(0.0);
        let mut m = Mechanism::new();
        let mass = m.point_mass("mass", S::from(1.0), S::from(1.0), zero).x;
        let ground = m.ground();
        m.coordinate_spring("spring", ground.x, mass, [S::from(9.0), zero, zero, zero]);
        let push = m.load("push", ground.x, mass, Fixed, &[S::from(-4.0)]);
        let motion = m.coordinate_sensor("motion", ground.x, mass);
        let acceleration = m.measure(motion, "acceleration")?;
        let limit = m.sensor("limit", ground.at(b[0], zero));
        let terms = [acceleration, m.measure(limit, "x")?];
        m.when("push", Linear(vec![1.0, -1.0], 0.0), &terms, &[Action::Activate(push)])?;
        let position = m.measure(motion, "position")?;
        m.output("position", &[position]);
        m.output("acceleration", &[acceleration]);
        Ok(m)
    }
}

/// An event within rounding errors of a time at which steps are inspected, 0.112 s, or of the grid, 0.12 s, has the derivatives of one
/// beside it: no step ends just before the event.
#[test]
fn an_event_at_an_inspected_time_has_the_derivatives_of_one_beside_it() {
    let end = [0.16];
    for scheme in [GeneralizedAlpha::hht(0.1).unwrap(), GeneralizedAlpha::chung_hulbert(0.8).unwrap()] {
        let newton = Newton { tolerance: 1e-13, iterations: 30 };
        let settings = Dynamics { scheme, newton, ..Dynamics::fixed(0.02) };
        for time in [0.112, 0.12] {
            let free = PushedByAcceleration.build(&[100.0]).unwrap();
            let limit = simulate(&free, &settings, &[time, 0.16]).unwrap().values[1][0];
            let slope =
                |b: f64| differentiate(&PushedByAcceleration, &[b], &settings, &end).unwrap().gradients[0][0][0];
            let beside = [-1e-9, 1e-9].map(|part| slope(limit * (1.0 + part)));
            for k in -60..=60 {
                let found = slope(limit * (1.0 + 2e-14 * f64::from(k)));
                let off = beside.iter().map(|beside| (found / beside - 1.0).abs()).fold(f64::INFINITY, f64::min);
                assert!(off < 1e-6, "{time} s, {k}: {found:e}, beside {beside:?}");
            }
        }
    }
}
